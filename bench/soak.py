"""Endurance: the node at 1 kHz with a fault every few seconds; `python -m bench.soak`.

Passes if no pose is lost that the rules promise, the node's memory grows by less than 1 MB after
the first minute (of a longer run), and its latency stays what it was.
"""

import argparse
import statistics
import sys
import time

from bench.report import cpu_ns, machine, resident_bytes
from bench.soak_robot import DEPTH, FEET, SoakRobot
from icub_leg_fk.errors import LegFKError
from icub_leg_fk.tools.replay import lossless, running_node, stay_on_this_machine

NAMESPACE = '/soak'
WINDOW = 10.0  # s
WARM_UP = 60.0  # s
LARGEST_GROWTH = 1.0  # MB
LARGEST_SLOWDOWN = 1.5  # median latency, end to beginning; what else a machine does shows in it


def main() -> int:
    """Run for some minutes; return 0 if the node has endured, else 1."""
    parser = argparse.ArgumentParser(prog='python -m bench.soak', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--minutes', type=float, default=10.0)
    args = parser.parse_args()
    if not args.minutes > 0:
        parser.error(f'found --minutes {args.minutes:g}, allowed: more than 0')
    try:
        stay_on_this_machine()
        with running_node(NAMESPACE, lossless(NAMESPACE, FEET, DEPTH)) as (node, check):
            failures = _soak(node.pid, args.minutes)
            check()
        if node.returncode:
            failures.append(f'exit code {node.returncode}')
    except LegFKError as error:
        failures = [str(error)]
    print(f'not endured: {"; ".join(failures)}' if failures else 'endured')
    return 1 if failures else 0


def _soak(pid: int, minutes: float) -> list[str]:
    """Run, print what is seen every ten seconds and in the end; return what is wrong."""
    robot = SoakRobot(NAMESPACE)
    if not robot.connect():
        return ['the node does not answer']
    print(f'{machine()}\n\n'
          '  time s  messages     lost   memory MB   CPU us/message   latency p50 us')
    windows: list[dict[str, float]] = []
    start = time.monotonic()
    while (left := start + 60 * minutes - time.monotonic()) > 0:
        cpu, sent = cpu_ns(pid), robot.sent
        try:
            robot.run(min(WINDOW, left))
        except KeyboardInterrupt:
            minutes = 0.0
        latencies, robot.latencies = robot.latencies or [0.0], []
        windows.append({
            'time': time.monotonic() - start, 'messages': robot.sent, 'lost': robot.lost,
            'memory': resident_bytes(pid) / 1e6,
            'cpu': (cpu_ns(pid) - cpu) / 1000 / max(1, robot.sent - sent),
            'p50': statistics.median(latencies)})
        print('{time:8.0f}{messages:10d}{lost:9d}{memory:12.2f}{cpu:17.0f}{p50:17.0f}'
              .format(**windows[-1]), flush=True)
    robot.finish()
    warm = [window for window in windows if window['time'] >= WARM_UP] or windows[-2:]
    third = max(1, len(warm) // 3)
    early, late = (statistics.median(window['p50'] for window in part)
                   for part in (warm[:third], warm[-third:]))
    growth = max(window['memory'] for window in warm) - warm[0]['memory']
    slowdown = late / max(early, 1e-9)
    cpu, p50 = (statistics.median(window[key] for window in warm) for key in ('cpu', 'p50'))
    print(f'\n{windows[-1]["time"] / 60:.1f} min: {robot.sent} messages, '
          f'{sum(robot.kept.values())} poses, {robot.twists} twists, '
          f'{sum(robot.faults.values())} faults of {len(robot.faults)} kinds\n'
          f'lost {robot.lost}, unexpected {robot.unexpected}; memory grew by {growth:.2f} MB '
          f'after the first minute\nlatency p50 {p50:.0f} us, late to early {slowdown:.2f}; CPU '
          f'{cpu:.0f} us per message',
          *(f'  {text}' for text in robot.complaints[:10]), sep='\n')
    return [text for text, failed in {
        f'{robot.lost} poses lost': robot.lost,
        f'{robot.unexpected} poses unexpected': robot.unexpected,
        f'{len(robot.complaints)} complaints': robot.complaints,
        f'memory grew by {growth:.2f} MB': growth >= LARGEST_GROWTH,
        f'latency grew by a factor of {slowdown:.2f}': slowdown > LARGEST_SLOWDOWN,
    }.items() if failed]


if __name__ == '__main__':
    sys.exit(main())
