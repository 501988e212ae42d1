"""ROS 2 for the commands that take part in a running system; everything else does without."""

from typing import Any, NamedTuple

from icub_leg_fk.errors import MissingDependencyError


class Ros(NamedTuple):
    """rclpy with its modules, and the messages that the commands exchange with the node."""

    rclpy: Any
    joint_state: Any
    pose_stamped: Any


def import_ros(purpose: str) -> Ros:
    """Return ROS 2.

    Args:
        purpose: what needs it, for the error.

    Raises:
        MissingDependencyError: rclpy or its messages are not installed.
    """
    try:
        from geometry_msgs.msg import PoseStamped
        import rclpy.context
        import rclpy.exceptions
        import rclpy.executors
        import rclpy.qos
        import rclpy.serialization
        import rclpy.signals
        from sensor_msgs.msg import JointState
    except ImportError as error:
        raise MissingDependencyError(
            'rclpy', purpose, 'source ROS 2, or pip install "icub_leg_fk[ros]"'
        ) from error
    return Ros(rclpy, JointState, PoseStamped)
