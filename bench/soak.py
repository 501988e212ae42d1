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
    args = parser.parse_args()
    if not args.minutes > 0:
        parser.error(f'found --minutes {args.minutes:g}, allowed: more than 0')
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    with subprocess.Popen(_command()) as node:
        try:
            failures = _soak(node.pid, args.minutes)
        finally:
            node.send_signal(signal.SIGINT)
        if (code := node.wait()) != 0:
            failures.append(f'exit code {code}')
    print(f'not endured: {"; ".join(failures)}' if failures else 'endured')
    return 1 if failures else 0


def _command() -> list[str]:
    """Return what starts the node with QoS by which nothing is lost on the way."""
    from bench.soak_robot import DEPTH, FEET
    joints = f'qos_overrides./{NAMESPACE}/joint_states.subscription'
    parameters = [f'{joints}.reliability:=reliable', f'{joints}.depth:={DEPTH}', *(
        f'qos_overrides./{NAMESPACE}/foot_pose_publisher/{foot}/pose.publisher.depth:={DEPTH}'
        for foot in FEET)]
    return [sys.executable, '-m', 'icub_leg_fk.ros.main', '--ros-args', '-r',
            f'__ns:=/{NAMESPACE}', '--log-level', 'error',
            *(word for parameter in parameters for word in ('-p', parameter))]


def _soak(pid: int, minutes: float) -> list[str]:
    """Run, print what is seen every ten seconds and in the end; return what is wrong."""
    from bench.soak_robot import SoakRobot
    robot = SoakRobot(NAMESPACE)
    if not robot.connect():
        raise SystemExit('soak: the node does not answer')
    print(f'{machine()}\n\n'
          '  time s  messages     lost   memory MB   CPU us/message   latency p50 us    p99 us')
    windows: list[dict[str, float]] = []
    start = time.monotonic()
    interrupted = False
    while not interrupted and (left := start + 60 * minutes - time.monotonic()) > 0:
        cpu, sent = cpu_ns(pid), robot.sent
        try:
            robot.run(min(WINDOW, left))
        except KeyboardInterrupt:
            interrupted = True
        latencies, robot.latencies = robot.latencies or [0.0], []
        windows.append({
            'time': time.monotonic() - start, 'messages': robot.sent, 'lost': robot.lost,
            'memory': resident_bytes(pid) / 1e6,
            'cpu': (cpu_ns(pid) - cpu) / 1000 / max(1, robot.sent - sent),
            'p50': statistics.median(latencies), 'p99': percentile(latencies, 99)})
        print('{time:8.0f}{messages:10d}{lost:9d}{memory:12.2f}{cpu:17.0f}{p50:17.0f}{p99:10.0f}'
              .format(**windows[-1]), flush=True)
    robot.finish()
    warm = [window for window in windows if window['time'] >= WARM_UP] or windows[-2:]
    third = max(1, len(warm) // 3)
    early, late = (statistics.median(window['p50'] for window in part)
                   for part in (warm[:third], warm[-third:]))
    growth = max(window['memory'] for window in warm) - warm[0]['memory']
    cpu, p50, p99 = (statistics.median(window[key] for window in warm)
                     for key in ('cpu', 'p50', 'p99'))
    print(f'\n{windows[-1]["time"] / 60:.1f} min: {robot.sent} messages, {robot.kept} poses, '
          f'{robot.twists} twists, {sum(robot.faults.values())} faults of '
          f'{len(robot.faults)} kinds\nlost {robot.lost}, unexpected {robot.unexpected}; memory '
          f'grew by {growth:.2f} MB after the first minute\nlatency p50 {p50:.0f} us, p99 '
          f'{p99:.0f} us, late to early {late / max(early, 1e-9):.2f}; CPU {cpu:.0f} us per '
          'message')
    for text in robot.complaints[:10]:
        print(f'  {text}')
    checks = {
        f'{robot.lost} poses lost': robot.lost,
        f'{robot.unexpected} poses unexpected': robot.unexpected,
        f'{len(robot.complaints)} complaints': robot.complaints,
        f'memory grew by {growth:.2f} MB': growth >= LARGEST_GROWTH,
        f'latency grew by a factor of {late / max(early, 1e-9):.2f}':
            late > LARGEST_SLOWDOWN * early}
    return [text for text, failed in checks.items() if failed]


if __name__ == '__main__':
    sys.exit(main())
