"""Endurance: the node at 1 kHz with a fault every few seconds; `python -m bench.soak`.

Passes if the node has received every message, has published every pose that the rules promise and
every one of them has arrived, its memory grows by less than 1 MB after the first minute (of a
longer run), and its latency stays what it was. The node takes its kinematics from
robot_description, which must have changed at least once in ten seconds (--no-descriptions: the
shipped tables).
"""

import argparse
from collections.abc import Sequence
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
LARGEST_SLOWDOWN = (
    1.5  # median latency, end to beginning; what else a machine does shows in it
)


class _Window(NamedTuple):
    """What has been seen at the end of some seconds.

    `received` and `published` are the node's latest diagnostics, up to a second old.
    """

    seconds: float  # since the start
    sent: int
    received: int
    published: int
    lost: int
    descriptions: int
    memory: float  # MB
    cpu: float  # us per message
    p50: float  # us

    def __str__(self) -> str:
        counts = f'{self.sent:10d}{self.received:10d}{self.published:11d}{self.lost:6d}'
        figures = f'{self.memory:12.2f}{self.cpu:17.0f}{self.p50:17.0f}'
        return f'{self.seconds:8.0f}{counts}{self.descriptions:14d}{figures}'


_HEADING = (
    '  time s      sent  received  published  lost  descriptions   memory MB   '
    'CPU us/message   latency p50 us'
)


class _Summary(NamedTuple):
    """What the windows after the warm-up show together."""

    memory_growth: float  # MB
    slowdown: float  # late latency to early
    cpu: float  # us per message
    p50: float  # us

    def __str__(self) -> str:
        return (
            f'memory grew by {self.memory_growth:.2f} MB after the first minute\n'
            f'latency p50 {self.p50:.0f} us, late to early {self.slowdown:.2f}; CPU '
            f'{self.cpu:.0f} us per message'
        )


def main() -> int:
    """Run for some minutes; return 0 if the node has endured, else 1."""
    parser = argparse.ArgumentParser(
        prog='python -m bench.soak',
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--minutes', type=float, default=10.0)
    parser.add_argument(
        '--descriptions',
        action=argparse.BooleanOptionalAction,
        default=True,
        help='take the kinematics from robot_description, which changes',
    )
    args = parser.parse_args()
    if not args.minutes > 0:
        parser.error(f'found --minutes {args.minutes:g}, allowed: more than 0')
    parameters = lossless(NAMESPACE, FEET, DEPTH)
    if args.descriptions:
        parameters['description_from_topic'] = 'true'
    try:
        stay_on_this_machine()
        with running_node(NAMESPACE, parameters) as (node, check):
            failures = _soak(node.pid, args.minutes, args.descriptions)
            check()
        if node.returncode:
            failures.append(f'exit code {node.returncode}')
    except LegFKError as error:
        failures = [str(error)]
    print(f'not endured: {"; ".join(failures)}' if failures else 'endured')
    return 1 if failures else 0


def _soak(pid: int, minutes: float, describes: bool) -> list[str]:
    """Run, print what is seen every ten seconds and in the end; return what is wrong."""
    robot = SoakRobot(NAMESPACE, describes)
    if not robot.connect():
        return ['the node does not answer']
    print(f'{machine()}\n\n{_HEADING}')
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
    if not windows:
        return ['interrupted before the first window']
    summary = _summary(windows)
    seconds = windows[-1].seconds
    _print_totals(robot, seconds, summary)
    failures = _wrong_counts(robot) + _wrong_figures(summary)
    if describes and robot.descriptions < max(1, seconds // WINDOW):
        failures.append(
            f'{robot.descriptions} changes of the description in {seconds:.0f} s'
        )
    return failures


def _window(pid: int, robot: SoakRobot, start: float, end: float) -> _Window:
    """Run for ten seconds, or what is left; return what was seen."""
    cpu, sent = cpu_ns(pid), robot.sent
    robot.run(min(WINDOW, end - time.monotonic()))
    latencies, robot.latencies = robot.latencies or [0.0], []
    return _Window(
        seconds=time.monotonic() - start,
        sent=robot.sent,
        received=robot.received,
        published=sum(robot.published.values()),
        lost=robot.lost,
        descriptions=robot.descriptions,
        memory=resident_bytes(pid) / 1e6,
        cpu=(cpu_ns(pid) - cpu) / 1000 / max(1, robot.sent - sent),
        p50=statistics.median(latencies),
    )


def _summary(windows: Sequence[_Window]) -> _Summary:
    """Return the figures of the windows after the warm-up."""
    warm = [window for window in windows if window.seconds >= WARM_UP] or windows[-2:]
    third = max(1, len(warm) // 3)
    early = statistics.median([window.p50 for window in warm[:third]])
    late = statistics.median([window.p50 for window in warm[-third:]])
    return _Summary(
        memory_growth=max(window.memory for window in warm) - warm[0].memory,
        slowdown=late / max(early, 1e-9),
        cpu=statistics.median([window.cpu for window in warm]),
        p50=statistics.median([window.p50 for window in warm]),
    )


def _print_totals(robot: SoakRobot, seconds: float, summary: _Summary) -> None:
    print(
        f'\n{seconds / 60:.1f} min: {robot.sent} messages sent, {robot.received} received; '
        f'poses promised {_by_foot(robot.promised)}, published {_by_foot(robot.published)}, '
        f'arrived {_by_foot(robot.arrived)}\n'
        f'lost {robot.lost}, unexpected {robot.unexpected}; {robot.twists} twists, '
        f'{robot.descriptions} changes of the description, {sum(robot.faults.values())} faults '
        f'of {len(robot.faults)} kinds\n{summary}'
    )
    for complaint in robot.complaints[:10]:
        print(f'  {complaint}')


def _by_foot(counts: dict[str, int]) -> str:
    return ' + '.join(str(count) for count in counts.values())


def _wrong_counts(robot: SoakRobot) -> list[str]:
    """Return which counts differ that must be equal, and what else is missed."""
    failures = []
    if robot.sent != robot.received:
        failures.append(f'{robot.sent} messages sent, {robot.received} received')
    for foot in FEET:
        promised, published, arrived = (
            robot.promised[foot],
            robot.published[foot],
            robot.arrived[foot],
        )
        if not promised == published == arrived:
            failures.append(
                f'{foot}: {promised} poses promised, {published} published, '
                f'{arrived} arrived'
            )
    if robot.complaints:
        failures.append(f'{len(robot.complaints)} complaints')
    return failures


def _wrong_figures(summary: _Summary) -> list[str]:
    """Return which figures are beyond what is allowed."""
    failures = []
    if summary.memory_growth >= LARGEST_GROWTH:
        failures.append(f'memory grew by {summary.memory_growth:.2f} MB')
    if summary.slowdown > LARGEST_SLOWDOWN:
        failures.append(f'latency grew by a factor of {summary.slowdown:.2f}')
    return failures


if __name__ == '__main__':
    sys.exit(main())
