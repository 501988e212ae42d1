"""The demonstration's session: the node in its own process, joint states out, poses back."""

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

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.recording import JointRecording
from icub_leg_fk.tools.ros import Ros
from icub_leg_fk.tools.signals import held_signals
import numpy as np

DEPTH = 1000  # messages that may wait anywhere when a process is held up
_DISCOVERY_TIMEOUT = 20.0  # s
_LAST_POSE_TIMEOUT = 5.0  # s without a pose, after the last message
_STOP_TIMEOUT = 10.0  # s
_PROBE = -1  # stands for the index of a message that does not count
_PROBE_PERIOD = 0.1  # s
_HIGHEST_DOMAIN = 101  # beyond it DDS's ports meet those that Linux hands out


class DemoError(LegFKError):
    """The node did not start, stopped by itself or was not found."""


@dataclass
class Answers:
    """The poses of one tip, by message; NaN where none has come.

    Attributes:
        tip: name of the tip.
        poses: (N, 7) rows x, y, z [m], qx, qy, qz, qw.
        latencies: (N,) from publishing the message to receiving the pose [s].
        unexpected: poses that belong to no message, or to one that had a pose.
        newest: index of the message whose pose came last.
    """

    tip: str
    poses: Array
    latencies: Array
    unexpected: int = 0
    newest: int = 0

    @property
    def arrived(self) -> int:
        """How many messages have their pose."""
        return int(np.isfinite(self.latencies).sum())


def stay_on_this_machine() -> str:
    """Let DDS reach nobody else; return the ROS_DOMAIN_ID, the user's if there is one."""
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.pop('ROS_STATIC_PEERS', None)
    return os.environ.setdefault(
        'ROS_DOMAIN_ID', str(1 + os.getpid() % _HIGHEST_DOMAIN)
    )


def lossless(namespace: str, tips: Iterable[str], depth: int) -> dict[str, str]:
    """Return parameters by which the node loses nothing when a process is held up."""
    subscription = f'qos_overrides.{namespace}/joint_states.subscription'
    parameters = {
        f'{subscription}.reliability': 'reliable',
        f'{subscription}.depth': str(depth),
    }
    for tip in tips:
        pose = f'{namespace}/foot_pose_publisher/{tip}/pose'
        parameters[f'qos_overrides.{pose}.publisher.depth'] = str(depth)
    return parameters


@contextmanager
def running_node(
    namespace: str,
    parameters: Mapping[str, str],
    program: Sequence[str] = ('icub_leg_fk.node.main',),
    own_session: bool = True,
) -> Iterator[tuple[subprocess.Popen[bytes], Callable[[], None]]]:
    """Run `foot_pose_publisher`, or another module, in its own process.

    In its own session Ctrl-C does not reach it. Gives the process, and what raises
    `DemoError` once it has stopped by itself.
    """
    command = [sys.executable, '-m', *program, '--ros-args', '-r', f'__ns:={namespace}']
    for name, value in parameters.items():
        command += ['-p', f'{name}:={value}']
    process: subprocess.Popen[bytes] | None = None
    with tempfile.TemporaryFile() as log:
        try:
            with (
                held_signals()
            ):  # the node must not get away between its start and the next line
                process = subprocess.Popen(
                    command,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=log,
                    start_new_session=own_session,
                )
            yield process, partial(_check_runs, process, log)
        finally:
            with held_signals():
                if process is not None:
                    _stop(process)


def _check_runs(process: subprocess.Popen[bytes], log: IO[bytes]) -> None:
    status = process.poll()
    if status is None:
        return
    log.seek(0)
    lines = log.read().decode(errors='replace').split('\n')
    last_words = [line.strip() for line in lines if line.strip()][-1:]
    raise DemoError(
        f'the node stopped with exit status {status}: '
        f'{"".join(last_words) or "it said nothing"}'
    )


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.send_signal(signal.SIGINT)
    try:
        process.wait(_STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


class Replay:
    """Publishes joint states in their own timing and collects poses.

    Args:
        ros: the node that does it, in the namespace of `foot_pose_publisher`.
        recording: the joint states.
        tips: the tips of which poses come.

    Attributes:
        answers: the poses of each tip.
        sent: stamp [ns] and bytes of each message sent.
    """

    def __init__(
        self, ros: Ros, recording: JointRecording, tips: Sequence[str]
    ) -> None:
        count = len(recording.times)
        self.answers = [
            Answers(tip, np.full((count, 7), np.nan), np.full(count, np.nan))
            for tip in tips
        ]
        self.sent: list[tuple[int, bytes]] = []
        self._ros = ros
        self._recording = recording
        # by stamp: which message, and when it was sent
        self._awaited: dict[int, tuple[int, float]] = {}
        self._found: set[str] = set()
        node = ros.node
        self._publisher = node.create_publisher(ros.joint_state, 'joint_states', DEPTH)
        for answers in self.answers:
            topic = f'foot_pose_publisher/{answers.tip}/pose'
            take = partial(self._take, answers)
            node.create_subscription(ros.pose_stamped, topic, take, DEPTH)

    def wait_for_node(self, check: Callable[[], None]) -> None:
        """Send messages, which do not count, until each tip has answered one.

        `check` is called again and again, and raises if the node has ended.
        """
        deadline = time.monotonic() + _DISCOVERY_TIMEOUT
        while len(self._found) < len(self.answers):
            check()
            now = time.monotonic()
            if now > deadline:
                raise DemoError(
                    f'the node was not found over DDS in {_DISCOVERY_TIMEOUT:g} s'
                )
            self._publish(time.time_ns(), _PROBE)
            self._spin_until(now + _PROBE_PERIOD)

    def play(
        self, on_time: Callable[[float], None], period: float, check: Callable[[], None]
    ) -> None:
        """Publish every message at its time and wait for the poses.

        Every `period` seconds, `on_time` is called with the time since the first message [s], and
        `check`, which raises if the node has ended.
        """
        offsets = (self._recording.times - self._recording.times[0]).tolist()
        start, start_ns = time.monotonic(), time.time_ns()
        next_call = start
        for index, offset in enumerate(offsets):
            while next_call < start + offset:
                self._spin_until(next_call)
                check()
                on_time(time.monotonic() - start)
                next_call += period
            self._spin_until(start + offset)
            stamp = start_ns + round(offset * 1e9)
            if self.sent:
                stamp = max(stamp, self.sent[-1][0] + 1)
            self.sent.append((stamp, self._publish(stamp, index)))
        self._wait_for_last_poses(check)
        on_time(offsets[-1])

    def _wait_for_last_poses(self, check: Callable[[], None]) -> None:
        expected = len(self.sent) * len(self.answers)
        arrived = -1
        deadline = 0.0
        while arrived < expected:
            now = time.monotonic()
            newly_arrived = sum(answers.arrived for answers in self.answers)
            if newly_arrived > arrived:
                arrived = newly_arrived
                deadline = now + _LAST_POSE_TIMEOUT
            if now > deadline:
                return
            check()
            self._spin(0.1)

    def _spin_until(self, deadline: float) -> None:
        """Take what arrives until a time [s, monotonic]."""
        left = deadline - time.monotonic()
        while left > 0:
            self._spin(left)
            left = deadline - time.monotonic()

    def _spin(self, seconds: float) -> None:
        # What a signal raises inside of rclpy it makes another exception of, or loses.
        with held_signals():
            self._ros.executor.spin_once(timeout_sec=seconds)

    def _take(self, answers: Answers, message: Any) -> None:
        now = time.monotonic()
        stamp = message.header.stamp
        nanoseconds = stamp.sec * 1_000_000_000 + stamp.nanosec
        index, sent = self._awaited.get(nanoseconds, (None, now))
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
        row = self._recording.positions[max(index, 0)]
        message = self._ros.joint_state(
            name=list(self._recording.joint_names), position=row.tolist()
        )
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(
            stamp, 1_000_000_000
        )
        data = bytes(self._ros.rclpy.serialization.serialize_message(message))
        self._awaited[stamp] = index, time.monotonic()
        with held_signals():
            self._publisher.publish(data)
        return data
