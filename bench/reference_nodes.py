"""The nodes that foot_pose_publisher is measured against: `python -m bench.reference_nodes NAME`.

`plain` is written as the rclpy tutorials show it: SingleThreadedExecutor and message objects.
`floor` does the least that any Python node must do that answers a JointState with two PoseStamped.
"""

from __future__ import annotations

import signal
import sys
from threading import Event
from typing import Any

from geometry_msgs.msg import PoseStamped
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

DEPTH = 1000  # messages; every node has it in and out, so that a stall of the machine loses none
QOS = QoSProfile(depth=DEPTH)
STOP = Event()
TIPS = ('left_foot', 'right_foot')


def floor(node: Node) -> None:
    """Receive bytes, send two ready-made byte strings."""
    left, right = _publishers(node)
    ready = _ready_made()

    def relay(data: bytes) -> None:
        left.publish(ready)
        right.publish(ready)
    node.create_subscription(JointState, 'joint_states', relay, QOS, raw=True)
    executor = EventsExecutor()
    executor.add_node(node)
    while not STOP.is_set():
        executor.spin_once(timeout_sec=0.25)


def plain(node: Node) -> None:
    """Compute with numpy, 4x4 matrix by 4x4 matrix."""
    from bench.plain import chains, foot_matrix, quaternion
    legs, publishers = chains(), _publishers(node)

    def publish_poses(message: JointState) -> None:
        positions = dict(zip(message.name, message.position))
        for leg, publisher in zip(legs, publishers):
            T = foot_matrix(leg, [positions[name] for name in leg.joint_names])
            pose = PoseStamped()
            pose.header.stamp = message.header.stamp
            pose.header.frame_id = leg.root_frame
            pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = T[:3, 3].tolist()
            (pose.pose.orientation.x, pose.pose.orientation.y, pose.pose.orientation.z,
             pose.pose.orientation.w) = quaternion(T)
            publisher.publish(pose)
    node.create_subscription(JointState, 'joint_states', publish_poses, QOS)
    _spin_plain(node)


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


NODES = {node.__name__: node for node in (plain, floor)}


def main() -> None:
    """Run the node that the first argument names until SIGTERM."""
    signal.signal(signal.SIGTERM, lambda number, frame: STOP.set())
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    NODES[sys.argv[1]](Node('foot_pose_publisher'))
    rclpy.shutdown()  # a node that does not say goodbye slows the discovery of the next one down


if __name__ == '__main__':
    main()
