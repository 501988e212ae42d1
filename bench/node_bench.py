"""The node beside its references, all at 1 kHz with 32 joints and two feet.

Nodes run side by side and get their messages in turns, so that whatever else the machine does
meets all of them; every ratio is of two stretches that followed one another.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
import subprocess
import sys
from typing import NamedTuple

from bench.load import observer, Process, robot
from bench.report import cpu_ns, percentile, ratio, Report, resident_bytes

POSES = ('left_foot/pose', 'right_foot/pose')
TWISTS = ('left_foot/twist', 'right_foot/twist')
_JOINTS = 32
_RATE = 1000.0  # Hz
_DEPTH = 1000
_QUIET = 5.0  # s without a message after which no more are waited for
_SOON = 0.5  # s, likewise for tries
_TRIES = 5  # messages sent at a time to see whether they are answered


class Stretch(NamedTuple):
    """CPU time per message, and message sent to pose received, of all poses [us]."""

    cpu: float
    latencies: list[float]


class NodeProcess:
    """A node in a process and namespace of its own: ours, or a reference node by its name."""

    def __init__(self, namespace: str, name: str = 'ours', outputs: Sequence[str] = POSES,
                 parameters: Sequence[str] = ()) -> None:
        self.joint_topic = f'/{namespace}/joint_states'
        self.topics = [f'/{namespace}/foot_pose_publisher/{output}' for output in outputs]
        module = ['icub_leg_fk.ros.main'] if name == 'ours' else ['bench.reference_nodes', name]
        words = ['--ros-args', '-r', f'__ns:=/{namespace}', '--log-level', 'fatal']
        if name == 'ours':
            joints = f'qos_overrides.{self.joint_topic}.subscription'
            for parameter in (*parameters, f'{joints}.reliability:=reliable',
                              f'{joints}.depth:={_DEPTH}',
                              *(f'qos_overrides.{topic}.publisher.depth:={_DEPTH}'
                                for topic in self.topics)):
                words += ['-p', parameter]
        self._process = subprocess.Popen([sys.executable, '-m', *module, *words])
        self.pid = self._process.pid

    def close(self) -> None:
        """End the process."""
        self._process.terminate()
        try:
            self._process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def measure_node(report: Report, quick: bool) -> None:
    """Add CPU, latency and memory."""
    turns, messages = (2, 50) if quick else (12, 1000)
    nodes: dict[str, NodeProcess] = {}
    with closing(Process(robot)) as sender, closing(Process(observer)) as receiver:
        try:
            nodes |= {'floor': NodeProcess('floor', 'floor'), 'here': NodeProcess('here'),
                      'plain': NodeProcess('plain', 'plain'),
                      'here, with two twists': NodeProcess(
                          'twists', 'ours', (*POSES, *TWISTS), ('publish_twist:=true',))}
            _match(sender, receiver, nodes.values())
            stretches: dict[str, list[Stretch]] = {name: [] for name in nodes}
            for turn in range(turns):  # forth and back, so that none is always first
                for name in nodes if turn % 2 == 0 else reversed(nodes):
                    stretches[name].append(_stretch(sender, receiver, nodes[name], messages))
            resident = {name: resident_bytes(node.pid) / 1e6 for name, node in nodes.items()}
        finally:
            for node in nodes.values():
                node.close()
    cpu = {name: [turn.cpu for turn in of_name] for name, of_name in stretches.items()}
    p50, p99 = ({name: [percentile(turn.latencies, percent) for turn in of_name]
                 for name, of_name in stretches.items()} for percent in (50, 99))
    report.section(f'node: CPU per message, two feet, {_RATE:.0f} Hz, {_JOINTS} joints')
    for name in nodes:
        report.row(f'CPU, {name}', cpu[name], 'us')
    report.row('CPU, here / floor', ratio(cpu['here'], cpu['floor']), 'x', at_most=1.3)
    report.row('CPU, here / plain', ratio(cpu['here'], cpu['plain']), 'x', at_most=0.32)
    report.section('node: latency, JointState sent to PoseStamped received; resident size')
    for name in ('floor', 'here', 'plain'):
        report.row(f'p50, {name}', p50[name], 'us')
        report.row(f'p99, {name}', p99[name], 'us')
        report.row(f'resident, {name}', [resident[name]], 'MB')
    report.row('p50, here / floor', ratio(p50['here'], p50['floor']), 'x', at_most=1.2)


def _match(sender: Process, receiver: Process, nodes: Sequence[NodeProcess]) -> None:
    """Wait until messages reach the nodes and their poses reach the observer."""
    for topic in (topic for node in nodes for topic in node.topics):
        receiver('watch', topic)
    for node in nodes:
        if not sender('match', node.joint_topic):
            raise RuntimeError(f'no node has subscribed to {node.joint_topic}')
        for _ in range(100):
            sender('send', node.joint_topic, _JOINTS, 100.0, _TRIES)
            answers = [receiver('take', topic, _TRIES, _SOON) for topic in node.topics]
            if all(answers):
                break
        else:
            raise RuntimeError(f'nothing from {node.topics}')
        # What still comes is no answer to what is sent later; one wait takes all in.
        for i, topic in enumerate(node.topics):
            receiver('take', topic, sys.maxsize, 0.0 if i else _SOON)


def _stretch(sender: Process, receiver: Process, node: NodeProcess, count: int) -> Stretch:
    """Send messages through a node and return what was seen of them."""
    before = cpu_ns(node.pid)
    sent = sender('send', node.joint_topic, _JOINTS, _RATE, count)
    received = [receiver('take', topic, count, _QUIET) for topic in node.topics]
    cpu = (cpu_ns(node.pid) - before) / 1000 / count
    # Messages and poses are paired by their order: ready-made poses carry no stamp of theirs.
    return Stretch(cpu, [(arrived - at) / 1000 for arrivals in received
                         for at, arrived in zip(sent, arrivals, strict=True)])
