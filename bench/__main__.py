"""Measures everything: `python -m bench`; a table on stdout, figures in JSON, a picture."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import sys

PARTS = ('node', 'kinematics', 'bag')
_QUIET_LOAD = 0.5  # processes; what else runs shows in every figure


def main() -> int:
    """Run the parts asked for; return 0 if every promise holds, else 1."""
    parser = argparse.ArgumentParser(prog='python -m bench', description=__doc__)
    parser.add_argument('parts', nargs='*', metavar='PART', default=list(PARTS),
                        help=f'what to measure: {", ".join(PARTS)} (default: all)')
    parser.add_argument('--quick', action='store_true',
                        help='only see that everything runs; the figures mean little')
    parser.add_argument('--json', type=Path, default=Path('build/bench.json'), metavar='FILE')
    parser.add_argument('--picture', type=Path, default=Path('build/bench.png'), metavar='FILE')
    args = parser.parse_args()
    if unknown := set(args.parts) - set(PARTS):
        parser.error(f'found part {", ".join(sorted(unknown))}, allowed: {", ".join(PARTS)}')
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))

    from bench.picture import draw
    from bench.report import make_room, Report
    make_room(parser, args.json, args.picture)
    report = Report()
    if (load := os.getloadavg()[0]) > _QUIET_LOAD:
        report.note(f'this machine is busy (load {load:.1f}); expect wide spreads')
    if 'node' in args.parts:
        from bench.node_bench import Effort, measure_node
        measure_node(report, Effort(1, 50, 1, False) if args.quick
                     else Effort(7, 1000, 12, True))
    if 'kinematics' in args.parts:
        from bench.kinematics_bench import measure_kinematics
        measure_kinematics(report, seconds=0.1 if args.quick else 1.0)
    if 'bag' in args.parts:
        from bench.bag_bench import measure_bag
        measure_bag(report, quick=args.quick)
    report.write(args.json)
    print(f'\nfigures in {args.json}', end='')
    if report.growth:
        draw(report, args.picture)
        print(f', picture in {args.picture}', end='')
    broken = report.broken_promises()
    print(f'\nnot kept: {"; ".join(broken)}' if broken else '\nall promises kept')
    return 1 if broken else 0


if __name__ == '__main__':
    sys.exit(main())
