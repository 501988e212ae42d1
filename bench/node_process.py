"""A node under test, in its own process and namespace, and one stretch of messages through it."""

from __future__ import annotations

from collections.abc import Sequence
import subprocess
import sys
from typing import NamedTuple

from bench.load import observer, Process, robot
from bench.report import cpu_ns, resident_bytes

POSES = ('left_foot/pose', 'right_foot/pose')
TWISTS = ('left_foot/twist', 'right_foot/twist')
_DEPTH = 1000
_QUIET = 5.0  # s without a message after which no more are waited for
_SOON = 0.5  # s, likewise for tries
_TRIES = 5  # messages sent at a time to see whether they are answered


class Stretch(NamedTuple):
    """What some messages through a node have shown.

    Attributes:
        cpu: CPU time per message [us].
        latencies: message sent to pose received, of all poses in order of arrival [us]; empty if
            poses were lost.
        lost: poses that did not arrive.
        in_order: whether each pose carried its message's stamp, in the order of sending.
    """

    cpu: float
    latencies: list[float]
    lost: int
    in_order: bool


class NodeProcess:
    """A node in a namespace, which `start` starts and `close` ends.

    Args:
        namespace: the namespace, which also tells runs of the same node apart.
        name: `ours`, or the name of a reference node.
        outputs: the topics that the observer shall subscribe to.
        parameters: parameters of ours beside the QoS.
    """

    def __init__(self, namespace: str, name: str, outputs: Sequence[str] = POSES,
                 parameters: Sequence[str] = ()) -> None:
        self.joint_topic = f'/{namespace}/joint_states'
        self.topics = [f'/{namespace}/foot_pose_publisher/{output}' for output in outputs]
        module = ['icub_leg_fk.ros.main'] if name == 'ours' else ['bench.reference_nodes', name]
        self._command = [sys.executable, '-m', *module, '--ros-args', '-r', f'__ns:=/{namespace}',
                         '--log-level', 'error']
        if name == 'ours':
            joints = f'qos_overrides.{self.joint_topic}.subscription'
            for parameter in (*parameters, f'{joints}.reliability:=reliable',
                              f'{joints}.depth:={_DEPTH}',
                              *(f'qos_overrides.{topic}.publisher.depth:={_DEPTH}'
                                for topic in self.topics)):
                self._command += ['-p', parameter]

    def start(self) -> NodeProcess:
        """Start the process."""
        self._process = subprocess.Popen(self._command)
        self.pid = self._process.pid
        return self

    def resident_bytes(self) -> int:
        """Return the resident size [bytes]."""
        return resident_bytes(self.pid)

    def close(self) -> None:
        """End the process."""
        self._process.terminate()
        try:
            self._process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class Bench:
    """A robot and an observer around the nodes under test."""

    def __init__(self) -> None:
        self._robot = Process(robot)
        self._observer = Process(observer)

    def close(self) -> None:
        """End both processes."""
        self._robot.close()
        self._observer.close()

    def match(self, nodes: Sequence[NodeProcess]) -> None:
        """Wait until messages reach the nodes and their poses reach the observer."""
        for topic in (topic for node in nodes for topic in node.topics):
            self._observer('watch', topic)
        for node in nodes:
            if not self._robot('match', node.joint_topic):
                raise RuntimeError(f'no node has subscribed to {node.joint_topic}')
            for _ in range(100):
                self._robot('send', node.joint_topic, 32, 100.0, _TRIES)
                answers = [self._observer('take', topic, _TRIES, _SOON) for topic in node.topics]
                if all(answers):
                    break
            else:
                raise RuntimeError(f'nothing from {node.topics}')
            # What still comes is no answer to what is sent later; one wait takes all in.
            for i, topic in enumerate(node.topics):
                self._observer('take', topic, sys.maxsize, 0.0 if i else _SOON)

    def forget(self, node: NodeProcess) -> None:
        """Take down all that was made for a node."""
        for topic in node.topics:
            self._observer('drop', topic)
        self._robot('close', node.joint_topic)

    def stretch(self, node: NodeProcess, joints: int, rate: float, count: int) -> Stretch:
        """Send messages through a node and return what was seen of them."""
        before = cpu_ns(node.pid)
        sent = self._robot('send', node.joint_topic, joints, rate, count)
        received = [self._observer('take', topic, count, _QUIET) for topic in node.topics]
        lost = sum(count - len(poses) for poses in received)
        # Messages and poses are paired by their order: ready-made poses carry no stamp of theirs.
        latencies = [] if lost else [
            (arrival - stamp) / 1000 for poses in received
            for stamp, (_, arrival) in zip(sent, poses, strict=True)]
        return Stretch((cpu_ns(node.pid) - before) / 1000 / count, latencies, lost,
                       all([stamp for stamp, _ in poses] == sent for poses in received))
