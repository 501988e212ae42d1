"""The demonstration's session: the node in a process of its own, joint states out, poses back."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
import os
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any, IO

from icub_leg_fk.errors import LegFKError, MissingDependencyError
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.node.main import LOOPBACK_IS_DOWN, loopback_is_up, unusable_domain
from icub_leg_fk.tools.recording import JointRecording
from icub_leg_fk.tools.signals import held_signals
import numpy as np

DEPTH = 1000  # messages that may wait anywhere when a process is held up
_DISCOVERY_TIMEOUT = 20.0  # s
_LAST_POSE_TIMEOUT = 5.0  # s without a pose, after the last message
_STOP_TIMEOUT = 10.0  # s
_PROBE, _PROBE_PERIOD = -1, 0.1  # stands for its message's index; s
_HIGHEST_DOMAIN = 101  # beyond it DDS's ports meet those that Linux hands out


class DemoError(LegFKError):
    """The node did not start, stopped by itself or was not found."""


@dataclass
class Answers:
    """The poses of one tip, by message; NaN where none has come."""

    tip: str
    poses: Array  # (N, 7) rows x, y, z [m], qx, qy, qz, qw
    latencies: Array  # (N,) from publishing the message to receiving the pose [s]
    unexpected: int = 0  # poses that belong to no message, or to one that had a pose
    newest: int = 0  # index of the message whose pose came last

    @property
    def arrived(self) -> int:
        """How many messages have their pose."""
        return int(np.isfinite(self.latencies).sum())


def stay_on_this_machine() -> str:
    """Let DDS reach nobody else; return the ROS_DOMAIN_ID, the user's if there is one."""
    if fault := unusable_domain():
        raise LegFKError(fault)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.pop('ROS_STATIC_PEERS', None)
    return os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % _HIGHEST_DOMAIN))


def lossless(namespace: str, tips: Iterable[str], depth: int) -> dict[str, str]:
    """Return parameters by which the node loses nothing when a process is held up."""
    joint_states = f'qos_overrides.{namespace}/joint_states.subscription'
    return {f'{joint_states}.reliability': 'reliable', f'{joint_states}.depth': str(depth)} | {
        f'qos_overrides.{namespace}/foot_pose_publisher/{tip}/pose.publisher.depth': str(depth)
        for tip in tips}


@contextmanager
def running_node(namespace: str, parameters: Mapping[str, str],
                 program: Sequence[str] = ('icub_leg_fk.node.main',), own_session: bool = True
                 ) -> Iterator[tuple[subprocess.Popen[bytes], Callable[[], None]]]:
    """Run `foot_pose_publisher`, or another module, in a process of its own.

    In a session of its own Ctrl-C does not reach it. Gives the process, and what raises
    `DemoError` once it has stopped by itself.
    """
    words = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
    command = [sys.executable, '-m', *program, '--ros-args', '-r', f'__ns:={namespace}', *words]
    process: subprocess.Popen[bytes] | None = None
    with tempfile.TemporaryFile() as log:
        try:
            with held_signals():  # the node must not get away between its start and the next line
                process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log,
                                           stderr=log, start_new_session=own_session)
            yield process, partial(_check_runs, process, log)
        finally:
            with held_signals():
                if process is not None:
                    process.send_signal(signal.SIGINT)
                    try:
                        process.wait(_STOP_TIMEOUT)
                    except subprocess.TimeoutExpired:
                        process.kill()
                        process.wait()


def _check_runs(process: subprocess.Popen[bytes], log: IO[bytes]) -> None:
    if (status := process.poll()) is not None:
        log.seek(0)
        said = log.read().decode(errors='replace').strip() or 'it said nothing'
        raise DemoError(f'the node stopped with exit status {status}: '
                        f'{said.splitlines()[-1].strip()}')


class Replay:
    """Publishes joint states in their own timing and collects poses, until it is closed."""

    def __init__(self, recording: JointRecording, namespace: str, tips: Sequence[str]) -> None:
        try:
            from geometry_msgs.msg import PoseStamped
            import rclpy
            from rclpy.context import Context
            from rclpy.executors import SingleThreadedExecutor
            from rclpy.serialization import serialize_message
            from rclpy.signals import SignalHandlerOptions
            from sensor_msgs.msg import JointState
        except ImportError as error:
            raise MissingDependencyError(f'the demonstration needs rclpy ({error}): source ROS 2, '
                                         'or pip install icub_leg_fk[ros]') from error
        count = len(recording.times)
        self.answers = [Answers(tip, np.full((count, 7), np.nan), np.full(count, np.nan))
                        for tip in tips]
        self.sent: list[tuple[int, bytes]] = []  # stamp [ns] and message
        self._recording = recording
        self._awaited: dict[int, tuple[int, float]] = {}  # by stamp: which message, sent when
        self._found: set[str] = set()
        self._joint_state, self._serialize = JointState, serialize_message
        self._context = Context()
        try:
            rclpy.init(args=[], context=self._context,
                       signal_handler_options=SignalHandlerOptions.NO)
            self._node = rclpy.create_node(
                'leg_fk_demo', namespace=namespace, context=self._context,
                use_global_arguments=False, enable_rosout=False, start_parameter_services=False)
        except (RuntimeError, ValueError) as error:  # what rclpy raises for what rcl refuses
            raise DemoError(f'ROS 2 cannot be started: {" ".join(str(error).split())}') from error
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._publisher = self._node.create_publisher(JointState, 'joint_states', DEPTH)
        for answers in self.answers:
            self._node.create_subscription(
                PoseStamped, f'foot_pose_publisher/{answers.tip}/pose',
                partial(self._take, answers), DEPTH)

    def close(self) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def wait_for_node(self, check: Callable[[], None]) -> None:
        """Send messages, which do not count, until each tip has answered one.

        `check` is called again and again, and raises if there is no hope.
        """
        deadline = time.monotonic() + _DISCOVERY_TIMEOUT
        while len(self._found) < len(self.answers):
            check()
            now = time.monotonic()
            if now > deadline:
                raise DemoError(f'the node was not found over DDS in {_DISCOVERY_TIMEOUT:g} s' + (
                    '' if loopback_is_up() else f': {LOOPBACK_IS_DOWN}'))
            self._publish(time.time_ns(), _PROBE)
            while time.monotonic() < now + _PROBE_PERIOD:
                self._spin(0.02)

    def play(self, on_time: Callable[[float], None], period: float, check: Callable[[], None]
             ) -> None:
        """Publish every message at its time and wait for the poses.

        Every `period` seconds, `on_time` is called with the time since the first message [s], and
        `check`, which raises if there is no hope.
        """
        times = self._recording.times - self._recording.times[0]
        start, start_ns = time.monotonic(), time.time_ns()
        next_call = start
        for index, offset in enumerate(times.tolist()):
            while (now := time.monotonic()) < start + offset:
                if now >= next_call:
                    next_call += period
                    check()
                    on_time(now - start)
                # A negative timeout would be none.
                self._spin(max(min(start + offset, next_call) - now, 0.0))
            stamp = start_ns + round(offset * 1e9)
            if self.sent:
                stamp = max(stamp, self.sent[-1][0] + 1)
            self.sent.append((stamp, self._publish(stamp, index)))
        arrived, deadline = -1, 0.0
        while (now_arrived := sum(a.arrived for a in self.answers)) < len(times) * len(
                self.answers):
            if now_arrived > arrived:
                arrived, deadline = now_arrived, time.monotonic() + _LAST_POSE_TIMEOUT
            if time.monotonic() > deadline:
                break
            check()
            self._spin(0.1)
        on_time(float(times[-1]))

    def _spin(self, seconds: float) -> None:
        # What a signal raises inside of rclpy it makes another exception of, or loses.
        with held_signals():
            self._executor.spin_once(timeout_sec=seconds)

    def _take(self, answers: Answers, message: Any) -> None:
        now, stamp = time.monotonic(), message.header.stamp
        index, sent = self._awaited.get(stamp.sec * 1_000_000_000 + stamp.nanosec, (None, now))
        if index == _PROBE:
            self._found.add(answers.tip)
        elif index is None or not np.isnan(answers.latencies[index]):
            answers.unexpected += 1
        else:
            p, q = message.pose.position, message.pose.orientation
            answers.poses[index] = (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
            answers.latencies[index] = now - sent
            answers.newest = index

    def _publish(self, stamp: int, index: int) -> bytes:
        message = self._joint_state(name=list(self._recording.joint_names),
                                    position=self._recording.positions[max(index, 0)].tolist())
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        data = bytes(self._serialize(message))
        self._awaited[stamp] = index, time.monotonic()
        with held_signals():
            self._publisher.publish(data)
        return data
