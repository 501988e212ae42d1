"""The node beside its references, all at 1 kHz with 32 joints and two feet.

Nodes run side by side and get their messages in turns, so that whatever else the machine does
meets all of them; every ratio is of two stretches that followed one another. Messages come from a
process of its own, and poses to this one, which handles bytes only.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing, ExitStack
import gc
import math
from multiprocessing import get_context
from multiprocessing.connection import Connection
import statistics
import struct
import time
from typing import Any, NamedTuple

from bench.joint_messages import joint_positions, ROBOT_JOINTS
from bench.report import cpu_ns, ratio, Report
from geometry_msgs.msg import PoseStamped, TwistStamped
from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.stream.configuration import LEGS
from icub_leg_fk.tools.replay import (
    DemoError,
    lossless,
    running_node,
    stay_on_this_machine,
)
from icub_leg_fk.tools.urdf_text import urdf_text
import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import String

FEET = ('left_foot', 'right_foot')
_OURS, _REFERENCES = 'icub_leg_fk.node.main', 'bench.reference_nodes'


class _Kind(NamedTuple):
    program: tuple[str, ...]
    publish_twist: bool = False
    reliable: bool = True  # whether its subscribers are
    described: bool = False  # whether it computes with a description of the robot


_NODES = {
    'floor': _Kind((_REFERENCES, 'floor')),
    'here': _Kind((_OURS,)),
    'here, with a description': _Kind((_OURS,), described=True),
    'plain': _Kind((_REFERENCES, 'plain')),
    'here, with two twists': _Kind((_OURS,), publish_twist=True),
    'here, best-effort subscribers': _Kind((_OURS,), reliable=False),
}
_RATE = 1000.0  # Hz
_DEPTH = 1000
_GAIT_MESSAGES = 100
_QUIET = 5.0  # s without a message after which no more are waited for
_SOON = 0.5  # s, likewise for tries
_TRIES = 5  # messages sent at a time to see whether they are answered
_STAMP, _STAMP_AT = struct.Struct('<iI'), 4  # behind the CDR encapsulation


class _Node(NamedTuple):
    namespace: str
    pid: int
    arrivals: list[list[int]]  # of the poses of either foot, and of their twists [ns]


class _Stretch(NamedTuple):
    cpu: float  # us per message
    latency: float  # us, median from message sent to pose received
    lost: int


def measure_node(report: Report, quick: bool) -> None:
    """Add CPU and latency."""
    turns, count = (2, 50) if quick else (12, 1000)
    stretches: dict[str, list[_Stretch]] = {name: [] for name in _NODES}
    stay_on_this_machine()
    with ExitStack() as stack:
        load = stack.enter_context(closing(_Load()))
        nodes, checks = {}, {}
        for i, (name, kind) in enumerate(_NODES.items()):
            nodes[name], checks[name] = _start(stack, load, f'/bench_{i}', kind)
        for name, node in nodes.items():
            _wait_for_answers(load, node, checks[name])
        for turn in range(turns):  # forth and back, so that none is always first
            for name in nodes if turn % 2 == 0 else reversed(nodes):
                before = cpu_ns(nodes[name].pid)
                latencies, lost = load.send(nodes[name], _RATE, count, _QUIET)
                cpu_us = (cpu_ns(nodes[name].pid) - before) / 1000 / count
                stretches[name].append(
                    _Stretch(cpu_us, statistics.median(latencies or [math.nan]), lost)
                )
    _report_cpu(report, stretches)
    _report_latency(report, stretches)


def _report_cpu(report: Report, stretches: dict[str, list[_Stretch]]) -> None:
    cpu = _figures(stretches, 'cpu')
    report.note(
        f'\nnode: CPU per message, two feet, {_RATE:.0f} Hz, {len(ROBOT_JOINTS)} joints'
    )
    for name, readings in cpu.items():
        report.row(f'CPU, {name}', readings, 'us')
        lost = sum(_figures(stretches, 'lost')[name])
        if lost:
            report.note(
                f'  {name}: {lost} of its messages were lost, expect odd figures'
            )
    report.row('CPU, here / floor', ratio(cpu['here'], cpu['floor']), 'x', at_most=1.25)
    report.row(
        'CPU, with a description / without',
        ratio(cpu['here, with a description'], cpu['here']),
        'x',
        at_most=1.03,
    )
    report.row('CPU, here / plain', ratio(cpu['here'], cpu['plain']), 'x', at_most=0.32)


def _report_latency(report: Report, stretches: dict[str, list[_Stretch]]) -> None:
    p50 = _figures(stretches, 'latency')
    report.note('\nnode: median latency, JointState sent to PoseStamped received')
    for name in ('floor', 'here', 'plain'):
        report.row(f'p50, {name}', p50[name], 'us')
    report.row('p50, here / floor', ratio(p50['here'], p50['floor']), 'x', at_most=1.2)


def _figures(
    stretches: dict[str, list[_Stretch]], figure: str
) -> dict[str, list[float]]:
    """Return one figure of all stretches, by node."""
    figures = {}
    for name, of_name in stretches.items():
        figures[name] = [getattr(stretch, figure) for stretch in of_name]
    return figures


def _start(
    stack: ExitStack, load: _Load, namespace: str, kind: _Kind
) -> tuple[_Node, Callable[[], None]]:
    """Start a node; return it, and what raises an error once it has stopped by itself."""
    parameters: dict[str, str] = {}
    if kind.program == (_OURS,):
        parameters = lossless(namespace, FEET, _DEPTH)
        parameters['publish_twist'] = str(kind.publish_twist).lower()
        parameters['description_from_topic'] = str(kind.described).lower()
    # In sessions of their own Linux would share out the cores among the nodes differently.
    process, check = stack.enter_context(
        running_node(namespace, parameters, kind.program, own_session=False)
    )
    return _Node(namespace, process.pid, load.watch(namespace, kind)), check


def _wait_for_answers(load: _Load, node: _Node, check: Callable[[], None]) -> None:
    """Wait until messages reach a node and everything of it comes back."""
    for _ in range(100):
        check()
        _, lost = load.send(node, 100.0, _TRIES, _SOON)
        if not lost:
            return
    raise DemoError(f'no answer from the node in {node.namespace}')


class _Load:
    """Sends joint states from a process of its own, and receives what nodes make of them."""

    def __init__(self) -> None:
        context = get_context('spawn')
        self._connection, theirs = context.Pipe()
        self._robot = context.Process(target=_robot, args=(theirs,), daemon=True)
        self._robot.start()
        self._node, _ = _node('observer')
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)

    def watch(self, namespace: str, kind: _Kind) -> list[list[int]]:
        """Subscribe to the poses, and twists, of a node; return where their arrivals go."""
        if kind.described:
            self._describe(namespace)
        arrivals = [
            self._watch(namespace, PoseStamped, f'{foot}/pose', kind) for foot in FEET
        ]
        if kind.publish_twist:
            arrivals += [
                self._watch(namespace, TwistStamped, f'{foot}/twist', kind)
                for foot in FEET
            ]
        return arrivals

    def _describe(self, namespace: str) -> None:
        """Send a description of the robot, as robot_state_publisher does."""
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = self._node.create_publisher(
            String, f'{namespace}/robot_description', latched
        )
        publisher.publish(String(data=urdf_text('icub', Catalog.load().select(LEGS))))

    def _watch(
        self, namespace: str, message: Any, topic: str, kind: _Kind
    ) -> list[int]:
        arrived: list[int] = []
        reliability = ReliabilityPolicy.BEST_EFFORT
        if kind.reliable:
            reliability = ReliabilityPolicy.RELIABLE
        self._node.create_subscription(
            message,
            f'{namespace}/foot_pose_publisher/{topic}',
            lambda data: arrived.append(time.time_ns()),
            QoSProfile(depth=_DEPTH, reliability=reliability),
            raw=True,
        )
        return arrived

    def send(
        self, node: _Node, rate: float, count: int, quiet: float
    ) -> tuple[list[float], int]:
        """Send messages through a node; return the latencies of its poses [us] and its losses."""
        for arrivals in node.arrivals:
            arrivals.clear()
        self._connection.send((f'{node.namespace}/joint_states', rate, count))
        seen, since = -1, time.monotonic()
        gc.disable()
        while not self._connection.poll() or time.monotonic() - since < quiet:
            self._executor.spin_once(timeout_sec=0.02)
            arrived = sum(map(len, node.arrivals))
            if arrived != seen:
                seen, since = arrived, time.monotonic()
            if seen == count * len(node.arrivals):
                break
        gc.enable()
        sent = self._connection.recv()
        # Paired by their order, since ready-made poses carry no stamp of theirs.
        latencies: list[float] = []
        for arrivals in node.arrivals[: len(FEET)]:
            latencies += [(at - by) / 1000 for by, at in zip(sent, arrivals)]
        return latencies, max(count - len(arrivals) for arrivals in node.arrivals)

    def close(self) -> None:
        """End the other process."""
        self._robot.terminate()
        self._robot.join()
        self._node.destroy_node()
        rclpy.try_shutdown()


def _robot(connection: Connection) -> None:
    """Publish JointStates, as told: topic, rate [Hz] and count; tell the times [ns].

    It waits busily between messages, as a robot's computer is busy: on a machine that falls asleep
    meanwhile, waking it up would be most of the cost of every node.
    """
    node, qos = _node('robot')
    gait = [
        bytearray(
            serialize_message(
                JointState(
                    name=ROBOT_JOINTS,
                    velocity=[0.0] * len(ROBOT_JOINTS),
                    effort=[0.0] * len(ROBOT_JOINTS),
                    position=joint_positions(2 * math.pi * i / _GAIT_MESSAGES),
                )
            )
        )
        for i in range(_GAIT_MESSAGES)
    ]
    publishers: dict[str, Any] = {}
    gc.disable()
    while True:
        topic, rate, count = connection.recv()
        if topic not in publishers:
            publishers[topic] = node.create_publisher(JointState, topic, qos)
        times = []
        due = time.perf_counter()
        for i in range(count):
            while time.perf_counter() < due:
                pass
            due += 1.0 / rate
            message, now = gait[i % _GAIT_MESSAGES], time.time_ns()
            _STAMP.pack_into(message, _STAMP_AT, *divmod(now, 1_000_000_000))
            publishers[topic].publish(bytes(message))
            times.append(now)
        connection.send(times)


def _node(name: str) -> tuple[Node, QoSProfile]:
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    return Node(name, namespace='bench'), QoSProfile(depth=_DEPTH)
