"""The two processes around a node under test: a robot that sends, an observer that receives.

Both are commanded through a pipe. They handle bytes only, so that they take little of the machine.
"""

from __future__ import annotations

import gc
import math
from multiprocessing import get_context
from multiprocessing.connection import Connection
import struct
import time
from typing import Any

from bench.joint_messages import joint_names, joint_positions

STAMP = struct.Struct('<iI')
STAMP_AT = 4  # behind the CDR encapsulation
_GAIT_MESSAGES = 100
_MATCH_TIMEOUT = 60.0  # s


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
        self._connection.send(command)
        return self._connection.recv()

    def close(self) -> None:
        """End the process."""
        self._process.terminate()
        self._process.join()


def robot(connection: Connection) -> None:
    """Publish JointStates, as told.

    Commands are `match` with a topic, which waits for a subscriber and tells how many there are;
    `send` with topic, joints, rate [Hz] and count, which tells the stamps [ns]; `close` with a
    topic.
    """
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState
    node, qos = _node('robot')
    publishers: dict[str, Any] = {}
    gaits: dict[int, list[bytearray]] = {}
    while True:
        command, topic, *arguments = connection.recv()
        if topic not in publishers:
            publishers[topic] = node.create_publisher(JointState, topic, qos)
        publisher = publishers[topic]
        if command == 'match':
            deadline = time.monotonic() + _MATCH_TIMEOUT
            while publisher.get_subscription_count() < 1 and time.monotonic() < deadline:
                time.sleep(0.01)
            connection.send(publisher.get_subscription_count())
        elif command == 'send':
            joints, rate, count = arguments
            if joints not in gaits:
                gaits[joints] = [bytearray(serialize_message(JointState(
                    name=joint_names(joints), velocity=[0.0] * joints, effort=[0.0] * joints,
                    position=joint_positions(joints, 2 * math.pi * i / _GAIT_MESSAGES))))
                    for i in range(_GAIT_MESSAGES)]
            connection.send(_send(publisher.publish, gaits[joints], rate, count))
        else:
            node.destroy_publisher(publishers.pop(topic))
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
        STAMP.pack_into(message, STAMP_AT, *divmod(stamp, 1_000_000_000))
        publish(bytes(message))
        stamps.append(stamp)
    gc.enable()
    return stamps


def observer(connection: Connection) -> None:
    """Subscribe to poses and twists, as told.

    Commands are `watch` and `drop` with a topic, and `take` with topic, count and time [s], which
    tells the (stamp, time of arrival) [ns] of what has come, once there are so many or none has
    come for so long.
    """
    from geometry_msgs.msg import PoseStamped, TwistStamped
    from rclpy.experimental.events_executor import EventsExecutor
    node, qos = _node('observer')
    executor = EventsExecutor()
    executor.add_node(node)
    received: dict[str, list[tuple[int, bytes]]] = {}
    subscriptions: dict[str, Any] = {}

    def watch(topic: str) -> None:
        arrived = received[topic] = []
        subscriptions[topic] = node.create_subscription(
            TwistStamped if topic.endswith('/twist') else PoseStamped, topic,
            lambda data: arrived.append((time.time_ns(), data)), qos, raw=True)

    def take(topic: str, count: int, quiet: float) -> list[tuple[int, int]]:
        arrived = received[topic]
        seen, since = -1, time.monotonic()
        while len(arrived) < count and time.monotonic() - since < quiet:
            executor.spin_once(timeout_sec=0.02)
            if len(arrived) != seen:
                seen, since = len(arrived), time.monotonic()
        taken = [(sec * 1_000_000_000 + nanosec, at) for at, (sec, nanosec) in (
            (at, STAMP.unpack_from(data, STAMP_AT)) for at, data in arrived)]
        arrived.clear()
        return taken

    def drop(topic: str) -> None:
        node.destroy_subscription(subscriptions.pop(topic))
        del received[topic]

    commands = {'watch': watch, 'take': take, 'drop': drop}
    gc.disable()
    while True:
        executor.spin_once(timeout_sec=0.01)
        if connection.poll():
            command, *arguments = connection.recv()
            connection.send(commands[command](*arguments))


def _node(name: str) -> tuple[Any, Any]:
    import rclpy
    from rclpy.node import Node
    from rclpy.qos import QoSProfile
    rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    return Node(name, namespace='bench'), QoSProfile(depth=1000)
