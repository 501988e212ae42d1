"""The two processes around a node under test: a robot that sends, an observer that receives.

Both are commanded through a pipe. They handle bytes only, so that they take little of the machine.
"""

from __future__ import annotations

import gc
import math
from multiprocessing import get_context
from multiprocessing.connection import Connection
import struct
import threading
import time
from typing import Any, NamedTuple

from bench.joint_messages import joint_names, joint_positions

_STAMP = struct.Struct('<iI')
_STAMP_AT = 4  # behind the CDR encapsulation
_GAIT_MESSAGES = 100
_QUIET = 5.0  # s without a message after which no more are waited for
_MATCH_TIMEOUT = 60.0  # s


class Received(NamedTuple):
    """What the observer has seen of one topic: stamps in the messages, times of arrival [ns]."""

    stamps: list[int]
    arrivals: list[int]


class Process:
    """A spawned process that answers commands.

    Args:
        target: the function to run in it, called with a connection.
    """

    def __init__(self, target: Any) -> None:
        context = get_context('spawn')
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=target, args=(theirs,), daemon=True)
        self._process.start()

    def __call__(self, *command: Any) -> Any:
        """Send a command and wait for the answer."""
        self.send(*command)
        return self.answer()

    def send(self, *command: Any) -> None:
        """Send a command."""
        self._connection.send(command)

    def answer(self) -> Any:
        """Wait for the answer to a command."""
        answer = self._connection.recv()
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        """End the process."""
        self._process.terminate()
        self._process.join()


def robot(connection: Connection) -> None:
    """Publish JointStates: ('send', topic, joints, rate, count) answers with the stamps [ns]."""
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState
    node, qos = _node('robot')
    publishers: dict[str, Any] = {}
    gaits: dict[int, list[bytearray]] = {}

    def publisher(topic: str) -> Any:
        if topic not in publishers:
            publishers[topic] = node.create_publisher(JointState, topic, qos)
        return publishers[topic]

    def gait(joints: int) -> list[bytearray]:
        if joints not in gaits:
            gaits[joints] = [bytearray(serialize_message(JointState(
                name=joint_names(joints),
                position=joint_positions(joints, 2 * math.pi * i / _GAIT_MESSAGES),
                velocity=[0.0] * joints, effort=[0.0] * joints))) for i in range(_GAIT_MESSAGES)]
        return gaits[joints]

    while True:
        command, topic, *arguments = connection.recv()
        if command == 'close':
            node.destroy_publisher(publishers.pop(topic))
            connection.send(None)
            continue
        out = publisher(topic)
        if command == 'match':
            deadline = time.monotonic() + _MATCH_TIMEOUT
            while out.get_subscription_count() < 1 and time.monotonic() < deadline:
                time.sleep(0.01)
            connection.send(out.get_subscription_count())
        elif command == 'send':
            joints, rate, count = arguments
            connection.send(_send(out.publish, gait(joints), rate, count))
        elif command == 'send_until_told':
            joints, rate = arguments
            connection.send(None)
            while not connection.poll():
                _send(out.publish, gait(joints), rate, round(rate * 0.05))
            connection.recv()
            connection.send(None)


def _send(publish: Any, messages: list[bytearray], rate: float, count: int) -> list[int]:
    """Publish messages at a rate; wait busily, as a robot's computer is busy.

    On a machine that falls asleep between two messages, waking it up would be most of the cost of
    every node.
    """
    stamps = []
    period = 1.0 / rate
    gc.disable()
    due = time.perf_counter()
    for i in range(count):
        while time.perf_counter() < due:
            pass
        due += period
        message = messages[i % _GAIT_MESSAGES]
        stamp = time.time_ns()
        _STAMP.pack_into(message, _STAMP_AT, *divmod(stamp, 1_000_000_000))
        publish(bytes(message))
        stamps.append(stamp)
    gc.enable()
    return stamps


def observer(connection: Connection) -> None:
    """Subscribe to outputs: 'watch' topics, 'drop' them, 'take' what came, know the 'first'."""
    from geometry_msgs.msg import PoseStamped, TwistStamped
    import rclpy
    from rclpy.experimental.events_executor import EventsExecutor
    node, qos = _node('observer')
    executor = EventsExecutor()
    executor.add_node(node)
    received: dict[str, list[tuple[int, bytes]]] = {}
    subscriptions: dict[str, Any] = {}
    todo: list[tuple[Any, ...]] = []

    def watch(topic: str) -> None:
        arrived: list[tuple[int, bytes]] = []
        received[topic] = arrived
        subscriptions[topic] = node.create_subscription(
            TwistStamped if topic.endswith('/twist') else PoseStamped, topic,
            lambda data: arrived.append((time.time_ns(), data)), qos, raw=True)

    def take(topic: str, count: int, quiet: float = _QUIET) -> Received:
        arrived = received[topic]
        seen, since = -1, time.monotonic()
        while len(arrived) < count and time.monotonic() - since < quiet:
            executor.spin_once(timeout_sec=0.02)
            if len(arrived) != seen:
                seen, since = len(arrived), time.monotonic()
        stamps = [sec * 1_000_000_000 + nanosec for sec, nanosec in (
            _STAMP.unpack_from(data, _STAMP_AT) for _, data in arrived)]
        answer = Received(stamps, [at for at, _ in arrived])
        arrived.clear()
        return answer

    def listen() -> None:
        while True:
            todo.append(connection.recv())

    threading.Thread(target=listen, daemon=True).start()
    gc.disable()
    while rclpy.ok():
        executor.spin_once(timeout_sec=0.01)
        if not todo:
            continue
        command, topic, *arguments = todo.pop(0)
        if command == 'watch':
            watch(topic)
            connection.send(None)
        elif command == 'drop':
            node.destroy_subscription(subscriptions.pop(topic))
            connection.send(received.pop(topic) and None)
        elif command == 'take':
            connection.send(take(topic, *arguments))
        elif command == 'matched':
            connection.send(node.count_publishers(topic))
        elif command == 'first':
            deadline = time.monotonic() + _MATCH_TIMEOUT
            while not received[topic] and time.monotonic() < deadline:
                executor.spin_once(timeout_sec=0.01)
            connection.send(received[topic][0][0] if received[topic] else None)


def _node(name: str) -> tuple[Any, Any]:
    import rclpy
    from rclpy.node import Node
    from rclpy.qos import QoSProfile
    rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    return Node(name, namespace='bench'), QoSProfile(depth=1000)
