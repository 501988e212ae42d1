"""Endurance: the node at 1 kHz with a fault every few seconds; `python -m bench.soak`.

Passes if no pose is lost that the rules promise, the node's memory grows by less than 1 MB after
the first minute (of a longer run), and its latency stays what it was.
"""

from __future__ import annotations

import argparse
import os
import signal
import statistics
import subprocess
import sys
import time
from typing import Any

from bench.report import cpu_ns, machine, percentile, resident_bytes

NAMESPACE = 'soak'
WINDOW = 10.0  # s
WARM_UP = 60.0  # s
LARGEST_GROWTH = 1.0  # MB
LARGEST_SLOWDOWN = 1.5  # median latency, end to beginning; what else a machine does shows in it


def main() -> int:
    """Run for some minutes; return 0 if the node has endured, else 1."""
    parser = argparse.ArgumentParser(prog='python -m bench.soak', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--minutes', type=float, default=10.0)
    parser.add_argument('--rate', type=float, default=1000.0, help='messages per second')
    parser.add_argument('--every', type=float, default=2.0, help='seconds from fault to fault')
    args = parser.parse_args()
    if not (args.minutes > 0 and 0 < args.rate <= 1e5 and args.every > 0):
        parser.error('found minutes, rate or every out of range, allowed: more than 0')
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    with subprocess.Popen(_command()) as node:
        try:
            report = _soak(node.pid, args.minutes, args.rate, args.every)
        finally:
            node.send_signal(signal.SIGINT)
        report['exit code'] = node.wait()
    failures = _failures(report)
    _print(report)
    print(f'not endured: {"; ".join(failures)}' if failures else 'endured')
    return 1 if failures else 0


def _command() -> list[str]:
    """Return what starts the node with QoS by which nothing is lost on the way."""
    from bench.soak_robot import DEPTH, FEET
    joints = f'qos_overrides./{NAMESPACE}/joint_states.subscription'
    command = [sys.executable, '-m', 'icub_leg_fk.ros.main', '--ros-args', '-r',
               f'__ns:=/{NAMESPACE}', '--log-level', 'error',
               '-p', f'{joints}.reliability:=reliable', '-p', f'{joints}.depth:={DEPTH}']
    for foot in FEET:
        pose = f'qos_overrides./{NAMESPACE}/foot_pose_publisher/{foot}/pose.publisher'
        command += ['-p', f'{pose}.depth:={DEPTH}']
    return command


def _soak(pid: int, minutes: float, rate: float, every: float) -> dict[str, Any]:
    from bench.soak_robot import SoakRobot
    robot = SoakRobot(NAMESPACE, rate)
    if not robot.connect():
        raise SystemExit('soak: the node does not answer')
    print(f'{machine()}\n{minutes:g} min at {rate:g} Hz, a fault every {every:g} s\n\n'
          '  time s  messages     lost   memory MB   CPU us/message   latency p50 us    p99 us')
    windows: list[dict[str, float]] = []
    start = time.monotonic()
    interrupted = False
    while not interrupted and (left := start + 60 * minutes - time.monotonic()) > 0:
        cpu, sent = cpu_ns(pid), robot.sent
        try:
            robot.run(min(WINDOW, left), every)
        except KeyboardInterrupt:
            interrupted = True
        latencies, robot.latencies = robot.latencies or [0.0], []
        windows.append({
            'time': time.monotonic() - start,
            'messages': robot.sent,
            'lost': sum(ledger.lost for ledger in robot.ledgers.values()),
            'memory': resident_bytes(pid) / 1e6,
            'cpu': (cpu_ns(pid) - cpu) / 1000 / max(1, robot.sent - sent),
            'p50': statistics.median(latencies),
            'p99': percentile(latencies, 99),
        })
        print('{time:8.0f}{messages:10d}{lost:9d}{memory:12.2f}{cpu:17.0f}{p50:17.0f}{p99:10.0f}'
              .format(**windows[-1]), flush=True)
    robot.settle()
    ledgers = robot.ledgers.values()
    return {
        'minutes': windows[-1]['time'] / 60,
        'messages': robot.sent,
        'twists': robot.twists,
        'poses': sum(ledger.kept for ledger in ledgers),
        'lost': sum(ledger.lost for ledger in ledgers),
        'unexpected': sum(ledger.unexpected for ledger in ledgers),
        'examples': [text for ledger in ledgers for text in ledger.examples],
        'complaints': robot.complaints,
        'faults': robot.faults,
        **_trends(windows),
    }


def _trends(windows: list[dict[str, float]]) -> dict[str, float]:
    """Return memory growth [MB] and the ratio of late to early latency, after the warm-up."""
    late_enough = [window for window in windows if window['time'] >= WARM_UP]
    settled = late_enough if len(late_enough) > 1 else windows[len(windows) // 2:]
    third = max(1, len(settled) // 3)
    early, late = (statistics.median(window['p50'] for window in part)
                   for part in (settled[:third], settled[-third:]))
    return {
        'memory growth': max(window['memory'] for window in settled) - settled[0]['memory'],
        'slowdown': late / early if early else 1.0,
        'p50': statistics.median(window['p50'] for window in settled),
        'p99': statistics.median(window['p99'] for window in settled),
        'cpu': statistics.median(window['cpu'] for window in settled),
    }


def _failures(report: dict[str, Any]) -> list[str]:
    checks = {
        f'{report["lost"]} poses lost': report['lost'],
        f'{report["unexpected"]} poses unexpected': report['unexpected'],
        f'{len(report["complaints"])} complaints': report['complaints'],
        f'memory grew by {report["memory growth"]:.2f} MB':
            report['memory growth'] >= LARGEST_GROWTH,
        f'latency grew by a factor of {report["slowdown"]:.2f}':
            report['slowdown'] > LARGEST_SLOWDOWN,
        f'exit code {report["exit code"]}': report['exit code'],
    }
    return [text for text, failed in checks.items() if failed]


def _print(report: dict[str, Any]) -> None:
    faults = sum(report['faults'].values())
    print(f'\n{report["minutes"]:.1f} min: {report["messages"]} messages, '
          f'{report["poses"]} poses, {report["twists"]} twists, '
          f'{faults} faults of {len(report["faults"])} kinds\n'
          f'lost {report["lost"]}, unexpected {report["unexpected"]}; memory grew by '
          f'{report["memory growth"]:.2f} MB after the first minute\n'
          f'latency p50 {report["p50"]:.0f} us, p99 {report["p99"]:.0f} us, late to early '
          f'{report["slowdown"]:.2f}; CPU {report["cpu"]:.0f} us per message')
    for text in (*report['examples'], *report['complaints'][:10]):
        print(f'  {text}')


if __name__ == '__main__':
    sys.exit(main())
