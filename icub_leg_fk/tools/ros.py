"""ROS 2 for the commands that take part in a running system; everything else does without."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from icub_leg_fk.errors import LegFKError, MissingDependencyError


class Ros(NamedTuple):
    """A node of rclpy with what runs it, and the messages that the commands exchange."""

    rclpy: Any
    node: Any
    executor: Any
    joint_state: Any
    pose_stamped: Any
    string: Any


@contextmanager
def running_ros(purpose: str, name: str, namespace: str = '') -> Iterator[Ros]:
    """Run a node without parameters and log, in a context of its own, while it lasts.

    Args:
        purpose: what needs ROS 2, for the error.
        name: name of the node.
        namespace: its namespace.

    Raises:
        MissingDependencyError: rclpy or its messages are not installed.
        LegFKError: ROS 2 cannot be started.
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
        from std_msgs.msg import String
    except ImportError as error:
        raise MissingDependencyError(
            'rclpy', purpose, 'source ROS 2, or pip install "icub_leg_fk[ros]"'
        ) from error
    context = rclpy.context.Context()
    no_signals = rclpy.signals.SignalHandlerOptions.NO
    try:
        rclpy.init(args=[], context=context, signal_handler_options=no_signals)
        node = rclpy.create_node(
            name,
            namespace=namespace,
            context=context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
    except (RuntimeError, ValueError) as error:  # for what rcl refuses
        context.try_shutdown()
        reason = ' '.join(str(error).split())
        raise LegFKError(f'ROS 2 cannot be started: {reason}') from error
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        yield Ros(rclpy, node, executor, JointState, PoseStamped, String)
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()
