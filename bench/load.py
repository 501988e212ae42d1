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

_STAMP, _STAMP_AT = struct.Struct('<iI'), 4  # behind the CDR encapsulation
_GAIT_MESSAGES = 100
_MATCH_TIMEOUT = 60.0  # s


class Process:
    """A spawned process that answers commands; `target` is called with a connection."""

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

    Commands are `match` with a topic, which waits for a subscriber and tells how many there are,
    and `send` with topic, joints, rate [Hz] and count, which tells the times [ns].
    """
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState
    node, qos = _node('robot')
    publishers: dict[str, Any] = {}
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
        else:
            joints, rate, count = arguments
            gait = [bytearray(serialize_message(JointState(
                name=joint_names(joints), velocity=[0.0] * joints, effort=[0.0] * joints,
                position=joint_positions(joints, 2 * math.pi * i / _GAIT_MESSAGES))))
                for i in range(_GAIT_MESSAGES)]
            connection.send(_send(publisher.publish, gait, rate, count))


def _send(publish: Any, messages: list[bytearray], rate: float, count: int) -> list[int]:
    """Publish messages at a rate; wait busily, as a robot's computer is busy.

    On a machine that falls asleep between two messages, waking it up would be most of the cost of
    every node.
    """
    times = []
    gc.disable()
    due = time.perf_counter()
    for i in range(count):
        while time.perf_counter() < due:
            pass
        due += 1.0 / rate
        message, now = messages[i % _GAIT_MESSAGES], time.time_ns()
        _STAMP.pack_into(message, _STAMP_AT, *divmod(now, 1_000_000_000))
        publish(bytes(message))
        times.append(now)
    gc.enable()
    return times


def observer(connection: Connection) -> None:
    """Subscribe to poses and twists, as told.

    Commands are `watch` with a topic, and `take` with topic, count and time [s], which tells when
    [ns] what has come did, once there are so many or none has come for so long.
    """
    from geometry_msgs.msg import PoseStamped, TwistStamped
    from rclpy.experimental.events_executor import EventsExecutor
    node, qos = _node('observer')
    executor = EventsExecutor()
    executor.add_node(node)
    arrivals: dict[str, list[int]] = {}

    def watch(topic: str) -> None:
        arrived = arrivals[topic] = []
        node.create_subscription(
            TwistStamped if topic.endswith('/twist') else PoseStamped, topic,
            lambda data: arrived.append(time.time_ns()), qos, raw=True)

    def take(topic: str, count: int, quiet: float) -> list[int]:
        arrived = arrivals[topic]
        seen, since = -1, time.monotonic()
        while len(arrived) < count and time.monotonic() - since < quiet:
            executor.spin_once(timeout_sec=0.02)
            if len(arrived) != seen:
                seen, since = len(arrived), time.monotonic()
        taken = list(arrived)
        arrived.clear()
        return taken

    gc.disable()
    while True:
        executor.spin_once(timeout_sec=0.01)
        if connection.poll():
            command, *arguments = connection.recv()
            connection.send({'watch': watch, 'take': take}[command](*arguments))


def _node(name: str) -> tuple[Any, Any]:
    import rclpy
    from rclpy.node import Node
    from rclpy.qos import QoSProfile
    rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    return Node(name, namespace='bench'), QoSProfile(depth=1000)
