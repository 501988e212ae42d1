"""Endurance: the node at 1 kHz with a fault every few seconds; `python -m bench.soak`.

Passes if no pose is lost that the rules promise, the node's memory grows by less than 1 MB after
the first minute (of a longer run), and its latency stays what it was.
"""

import argparse
import statistics
import sys
import time
from typing import NamedTuple

from bench.report import cpu_ns, machine, resident_bytes
from bench.soak_robot import DEPTH, FEET, SoakRobot
from icub_leg_fk.errors import LegFKError
from icub_leg_fk.tools.replay import lossless, running_node, stay_on_this_machine

NAMESPACE = '/soak'
WINDOW = 10.0  # s
WARM_UP = 60.0  # s
LARGEST_GROWTH = 1.0  # MB
LARGEST_SLOWDOWN = 1.5  # median latency, end to beginning; what else a machine does shows in it


class _Window(NamedTuple):
    seconds: float  # since the start
    messages: int
    lost: int
    memory: float  # MB
    cpu: float  # us per message
    p50: float  # us

    def __str__(self) -> str:
        return (f'{self.seconds:8.0f}{self.messages:10d}{self.lost:9d}{self.memory:12.2f}'
                f'{self.cpu:17.0f}{self.p50:17.0f}')


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
    windows: list[_Window] = []
    start = time.monotonic()
    end = start + 60 * minutes
    try:
        while time.monotonic() < end:
            windows.append(_window(pid, robot, start, end))
            print(windows[-1], flush=True)
    except KeyboardInterrupt:
        pass
    robot.finish()
    return _verdict(robot, windows)


def _window(pid: int, robot: SoakRobot, start: float, end: float) -> _Window:
    """Run for ten seconds, or what is left; return what was seen."""
    cpu, sent = cpu_ns(pid), robot.sent
    robot.run(min(WINDOW, end - time.monotonic()))
    latencies, robot.latencies = robot.latencies or [0.0], []
    return _Window(
        time.monotonic() - start, robot.sent, robot.lost, resident_bytes(pid) / 1e6,
        (cpu_ns(pid) - cpu) / 1000 / max(1, robot.sent - sent), statistics.median(latencies))


def _verdict(robot: SoakRobot, windows: list[_Window]) -> list[str]:
    """Print the summary; return what is wrong."""
    if not windows:
        return ['interrupted before the first window']
    warm = [window for window in windows if window.seconds >= WARM_UP] or windows[-2:]
    third = max(1, len(warm) // 3)
    early = statistics.median([window.p50 for window in warm[:third]])
    late = statistics.median([window.p50 for window in warm[-third:]])
    growth = max(window.memory for window in warm) - warm[0].memory
    slowdown = late / max(early, 1e-9)
    cpu = statistics.median([window.cpu for window in warm])
    p50 = statistics.median([window.p50 for window in warm])
    print(f'\n{windows[-1].seconds / 60:.1f} min: {robot.sent} messages, '
          f'{sum(robot.kept.values())} poses, {robot.twists} twists, '
          f'{sum(robot.faults.values())} faults of {len(robot.faults)} kinds\n'
          f'lost {robot.lost}, unexpected {robot.unexpected}; memory grew by {growth:.2f} MB '
          f'after the first minute\nlatency p50 {p50:.0f} us, late to early {slowdown:.2f}; CPU '
          f'{cpu:.0f} us per message')
    for complaint in robot.complaints[:10]:
        print(f'  {complaint}')
    failures = {
        f'{robot.lost} poses lost': robot.lost > 0,
        f'{robot.unexpected} poses unexpected': robot.unexpected > 0,
        f'{len(robot.complaints)} complaints': bool(robot.complaints),
        f'memory grew by {growth:.2f} MB': growth >= LARGEST_GROWTH,
        f'latency grew by a factor of {slowdown:.2f}': slowdown > LARGEST_SLOWDOWN}
    return [text for text, failed in failures.items() if failed]


if __name__ == '__main__':
    sys.exit(main())
