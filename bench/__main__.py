"""Measure everything beside what it is compared to: `python -m bench`, or `make bench`."""

import argparse
from importlib import import_module
import os
import sys

from bench.report import Report
from icub_leg_fk.errors import LegFKError

PARTS = {
    'start': 'kinematics_bench',
    'kinematics': 'kinematics_bench',
    'node': 'node_bench',
    'bag': 'bag_bench',
}
_QUIET_LOAD = 0.5  # processes; what else runs shows in every figure


def main() -> int:
    """Measure; return 0, or with --check 1 if a promise is missed."""
    parser = argparse.ArgumentParser(prog='python -m bench', description=__doc__)
    parser.add_argument(
        'parts',
        nargs='*',
        metavar='PART',
        default=list(PARTS),
        help=f'what to measure: {", ".join(PARTS)} (default: all)',
    )
    parser.add_argument(
        '--quick',
        action='store_true',
        help='only see that everything runs; the figures mean little',
    )
    parser.add_argument(
        '--check', action='store_true', help='exit status 1 if a promise is missed'
    )
    args = parser.parse_args()
    if unknown := set(args.parts) - PARTS.keys():
        parser.error(
            f'found part {", ".join(sorted(unknown))}, allowed: {", ".join(PARTS)}'
        )
    report = Report()
    if (load := os.getloadavg()[0]) > _QUIET_LOAD:
        report.note(f'  this machine is busy (load {load:.1f}): expect wide spreads')
    for part in (part for part in PARTS if part in args.parts):
        try:
            measure = getattr(import_module(f'bench.{PARTS[part]}'), f'measure_{part}')
            measure(report, args.quick)
        except (ImportError, LegFKError) as error:  # a library, or the machine's mood
            report.note(f'\n{part}: not measured: {error}')
    print(f'\n{report.verdict()}')
    return int(args.check and bool(report.missed))


if __name__ == '__main__':
    sys.exit(main())
