"""A node under test, in its own process and namespace, and one stretch of messages through it."""

from __future__ import annotations

from collections.abc import Sequence
import subprocess
import sys
import time
from typing import NamedTuple

from bench.load import Process, Received
from bench.report import cpu_ns, resident_bytes

POSES = ('left_foot/pose', 'right_foot/pose')
TWISTS = ('left_foot/twist', 'right_foot/twist')
DEPTH = 1000
_SOON = 0.5  # s without a message that end a wait for tries
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
        command = [sys.executable, '-m', 'bench.reference_nodes', name]
        ros_arguments = ['--ros-args', '-r', f'__ns:=/{namespace}', '--log-level', 'error']
        if name == 'ours':
            command = [sys.executable, '-m', 'icub_leg_fk.ros.main']
            joints = f'qos_overrides.{self.joint_topic}.subscription'
            for parameter in (*parameters, f'{joints}.reliability:=reliable',
                              f'{joints}.depth:={DEPTH}',
                              *(f'qos_overrides.{topic}.publisher.depth:={DEPTH}'
                                for topic in self.topics)):
                ros_arguments += ['-p', parameter]
        self._command = [*command, *ros_arguments]

    def start(self) -> NodeProcess:
        """Start the process."""
        self._process = subprocess.Popen(self._command)
        return self

    def cpu_ns(self) -> int:
        """Return the CPU time used so far [ns]."""
        return cpu_ns(self._process.pid)

    def resident_bytes(self) -> int:
        """Return the resident size [bytes]."""
        return resident_bytes(self._process.pid)

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
        from bench.load import observer, robot
        self._robot = Process(robot)
        self._observer = Process(observer)

    def close(self) -> None:
        """End both processes."""
        self._robot.close()
        self._observer.close()

    def watch(self, node: NodeProcess) -> None:
        """Subscribe to a node's outputs."""
        for topic in node.topics:
            self._observer('watch', topic)

    def match(self, node: NodeProcess) -> None:
        """Wait until messages reach a node and its poses reach the observer."""
        if not self._robot('match', node.joint_topic):
            raise RuntimeError(f'no node has subscribed to {node.joint_topic}')
        for _ in range(100):
            self._robot('send', node.joint_topic, 32, 100.0, _TRIES)
            answers = [self._observer('take', topic, _TRIES, _SOON) for topic in node.topics]
            if all(answer.stamps for answer in answers):
                break
        else:
            raise RuntimeError(f'nothing from {node.topics}')
        # What still comes is no answer to what is sent later; waiting for one topic takes all in.
        for topic in node.topics:
            self._observer('take', topic, sys.maxsize, _SOON if topic == node.topics[0] else 0.0)

    def forget(self, node: NodeProcess) -> None:
        """Take down all that was made for a node."""
        for topic in node.topics:
            self._observer('drop', topic)
        self._robot('close', node.joint_topic)

    def start_to_first_pose(self, node: NodeProcess) -> float:
        """Start a node between a robot and an observer that run; return the time it takes [s]."""
        self.watch(node)
        self._robot.send('send_until_told', node.joint_topic, 32, 200.0)
        self._robot.answer()
        started = time.time_ns()
        node.start()
        first = self._observer('first', node.topics[0])
        self._robot('stop', '')
        if first is None:
            raise RuntimeError(f'nothing from {node.topics[0]}')
        return float((first - started) / 1e9)

    def stretch(self, node: NodeProcess, joints: int, rate: float, count: int) -> Stretch:
        """Send messages through a node and return what was seen of them."""
        before = node.cpu_ns()
        sent = self._robot('send', node.joint_topic, joints, rate, count)
        received = [self._observer('take', topic, count) for topic in node.topics]
        cpu = (node.cpu_ns() - before) / 1000 / count
        return Stretch(cpu, _latencies(sent, received),
                       sum(count - len(topic.arrivals) for topic in received),
                       all(topic.stamps == sent for topic in received))


def _latencies(sent: list[int], received: list[Received]) -> list[float]:
    """Pair messages and poses by their order, for ready-made poses carry no stamp of theirs."""
    if any(len(topic.arrivals) != len(sent) for topic in received):
        return []
    return [(arrival - stamp) / 1000 for topic in received
            for stamp, arrival in zip(sent, topic.arrivals, strict=True)]
