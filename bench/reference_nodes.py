"""The nodes that foot_pose_publisher is measured against: `python -m bench.reference_nodes NAME`.

`bare` and `plain` are written as the rclpy tutorials show it: SingleThreadedExecutor and message
objects. `floor` does the least that any Python node must do that answers a JointState with two
PoseStamped. `dds`, `receive`, `send` and `decode` are the steps from nothing to our node.
"""

from __future__ import annotations

from collections.abc import Callable
import math
import signal
import sys
from threading import Event
import time
from typing import Any

from geometry_msgs.msg import PoseStamped
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from sensor_msgs.msg import JointState

DEPTH = 1000  # messages; every node has it in and out, so that a stall of the machine loses none
QOS = QoSProfile(depth=DEPTH)
STOP = Event()
TIPS = ('left_foot', 'right_foot')


def dds(node: Node) -> None:
    """Let the middleware receive, and never look."""
    node.create_subscription(JointState, 'joint_states', lambda message: None, QOS, raw=True)
    while not STOP.is_set():
        time.sleep(0.25)


def floor(node: Node) -> None:
    """Receive bytes, send two ready-made byte strings."""
    left, right = _publishers(node)
    ready = _ready_made()

    def relay(data: bytes) -> None:
        left.publish(ready)
        right.publish(ready)
    executor = _events_executor(node, relay)
    while not STOP.is_set():
        executor.spin_once(timeout_sec=0.25)


def receive(node: Node) -> None:
    """Receive bytes as our node does and drop them."""
    _spin_as_ours(node, lambda data: None)


def send(node: Node) -> None:
    """Receive and send bytes as our node does."""
    left, right = (publisher.handle.publish_raw for publisher in _publishers(node))
    ready = _ready_made()

    def relay(data: bytes) -> None:
        left(ready)
        right(ready)
    _spin_as_ours(node, relay)


def decode(node: Node) -> None:
    """Receive bytes, make joint vectors of them by the rules, send ready-made bytes."""
    from icub_leg_fk.kinematics import Catalog
    from icub_leg_fk.ros.joint_input import JointInput
    catalog = Catalog.load(None)
    chains = [catalog.chain(name, 'v2_5', 'dh') for name in ('left_leg', 'right_leg')]
    feed = JointInput(chains, 0.5, time.time_ns).feed
    sends = [publisher.handle.publish_raw for publisher in _publishers(node)]
    ready = _ready_made()

    def answer(data: bytes) -> None:
        for vector in feed(data):
            sends[vector.chain](ready)
    _spin_as_ours(node, answer)


def bare(node: Node) -> None:
    """Receive messages and relay their stamps."""
    publishers = _publishers(node)

    def relay(message: JointState) -> None:
        for publisher in publishers:
            pose = PoseStamped()
            pose.header.stamp = message.header.stamp
            publisher.publish(pose)
    node.create_subscription(JointState, 'joint_states', relay, QOS)
    _spin_plain(node)


def plain(node: Node) -> None:
    """Compute with numpy, 4x4 matrix by 4x4 matrix."""
    from icub_leg_fk.kinematics import Catalog
    catalog = Catalog.load(None)
    chains = [catalog.chain(name, 'v2_5', 'dh') for name in ('left_leg', 'right_leg')]
    publishers = _publishers(node)

    def publish_poses(message: JointState) -> None:
        positions = dict(zip(message.name, message.position))
        for chain, publisher in zip(chains, publishers):
            T = chain.T_root_0
            for name, link in zip(chain.joint_names, chain.links):
                T = T @ dh_transform(link.a, link.d, link.alpha, link.offset + positions[name])
            pose = PoseStamped()
            pose.header.stamp = message.header.stamp
            pose.header.frame_id = chain.root_frame
            pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = T[:3, 3].tolist()
            (pose.pose.orientation.x, pose.pose.orientation.y, pose.pose.orientation.z,
             pose.pose.orientation.w) = quaternion(T)
            publisher.publish(pose)
    node.create_subscription(JointState, 'joint_states', publish_poses, QOS)
    _spin_plain(node)


def dh_transform(a: float, d: float, alpha: float, theta: float) -> Any:
    """Return the (4, 4) matrix of a row of a DH table [m, rad]."""
    ct, st, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    return np.array([[ct, -st * ca, st * sa, a * ct],
                     [st, ct * ca, -ct * sa, a * st],
                     [0.0, sa, ca, d],
                     [0.0, 0.0, 0.0, 1.0]])


def quaternion(T: Any) -> tuple[float, float, float, float]:
    """Return x, y, z, w of the rotation in a (4, 4) matrix, by the largest of the four."""
    m = T.tolist()
    w = 1.0 + m[0][0] + m[1][1] + m[2][2]
    x = 1.0 + m[0][0] - m[1][1] - m[2][2]
    y = 1.0 - m[0][0] + m[1][1] - m[2][2]
    z = 1.0 - m[0][0] - m[1][1] + m[2][2]
    wx, wy, wz = m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]
    xy, xz, yz = m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]
    largest = max(w, x, y, z)
    scale = math.copysign(0.5 / math.sqrt(largest), w if largest == w else 1.0)
    if largest == w:
        q = (wx * scale, wy * scale, wz * scale, w * scale)
    elif largest == x:
        q = (x * scale, xy * scale, xz * scale, wx * scale)
    elif largest == y:
        q = (xy * scale, y * scale, yz * scale, wy * scale)
    else:
        q = (xz * scale, yz * scale, z * scale, wz * scale)
    return q if q[3] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])


def _publishers(node: Node) -> list[Any]:
    return [node.create_publisher(PoseStamped, f'~/{tip}/pose', QOS) for tip in TIPS]


def _ready_made() -> bytes:
    pose = PoseStamped()
    pose.header.frame_id = 'root_link'
    return bytes(serialize_message(pose))


def _spin_plain(node: Node) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not STOP.is_set():
        executor.spin_once(timeout_sec=0.25)


def _events_executor(node: Node, on_message: Callable[[bytes], None]) -> Any:
    from rclpy.experimental.events_executor import EventsExecutor
    node.create_subscription(JointState, 'joint_states', on_message, QOS, raw=True)
    executor = EventsExecutor()
    executor.add_node(node)
    return executor


def _spin_as_ours(node: Node, on_message: Callable[[bytes], None]) -> None:
    executor = _events_executor(node, on_message)
    while not STOP.is_set():
        executor.spin_until_future_complete(Future(), timeout_sec=0.25)


NODES = {node.__name__: node for node in (bare, plain, floor, dds, receive, send, decode)}


def main() -> None:
    """Run the node that the first argument names until SIGTERM."""
    signal.signal(signal.SIGTERM, lambda number, frame: STOP.set())
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    NODES[sys.argv[1]](Node('foot_pose_publisher'))
    rclpy.shutdown()  # a node that does not say goodbye slows the discovery of the next one down


if __name__ == '__main__':
    main()
