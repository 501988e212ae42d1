"""The nodes that foot_pose_publisher is measured against: `python -m bench.reference_nodes NAME`.

`plain` is written as the rclpy tutorials show it: SingleThreadedExecutor and message objects.
`floor` does the least that any Python node must do that answers a JointState with two PoseStamped.
"""

import signal
import sys
from threading import Event

from geometry_msgs.msg import PoseStamped
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

QOS = QoSProfile(depth=1000)  # so that a stall of the machine loses no message


def floor(node: Node, publishers: list[Publisher]) -> None:
    """Receive bytes, send two ready-made byte strings."""
    pose = PoseStamped()
    pose.header.frame_id = 'root_link'
    ready = bytes(serialize_message(pose))
    left, right = publishers

    def relay(data: bytes) -> None:
        left.publish(ready)
        right.publish(ready)

    node.create_subscription(JointState, 'joint_states', relay, QOS, raw=True)


def plain(node: Node, publishers: list[Publisher]) -> None:
    """Compute with numpy, 4x4 matrix by 4x4 matrix."""
    from bench.plain import chains, foot_matrix, quaternion

    legs = chains()

    def publish_poses(message: JointState) -> None:
        positions = dict(zip(message.name, message.position))
        for leg, publisher in zip(legs, publishers):
            T = foot_matrix(leg, [positions[name] for name in leg.joint_names])
            pose = PoseStamped()
            pose.header.stamp = message.header.stamp
            pose.header.frame_id = leg.root_frame
            pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = T[
                :3, 3
            ].tolist()
            (
                pose.pose.orientation.x,
                pose.pose.orientation.y,
                pose.pose.orientation.z,
                pose.pose.orientation.w,
            ) = quaternion(T)
            publisher.publish(pose)

    node.create_subscription(JointState, 'joint_states', publish_poses, QOS)


def main() -> None:
    """Run the node that the first argument names until SIGINT."""
    stop = Event()
    signal.signal(signal.SIGINT, lambda number, frame: stop.set())
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    node = Node('foot_pose_publisher')
    set_up, executor = {
        'floor': (floor, EventsExecutor()),
        'plain': (plain, SingleThreadedExecutor()),
    }[sys.argv[1]]
    set_up(
        node,
        [
            node.create_publisher(PoseStamped, f'~/{tip}/pose', QOS)
            for tip in ('left_foot', 'right_foot')
        ],
    )
    executor.add_node(node)
    while not stop.is_set():
        executor.spin_once(timeout_sec=0.25)
    rclpy.shutdown()  # a node that does not say goodbye slows the discovery of the next one down


if __name__ == '__main__':
    main()
