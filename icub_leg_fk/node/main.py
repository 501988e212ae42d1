"""Start and stop of the node: `ros2 run icub_leg_fk foot_pose_publisher`."""

from collections.abc import Sequence
import re
import signal
import sys
from typing import Any

from icub_leg_fk.errors import LegFKError, MissingDependencyError
from icub_leg_fk.node.arguments import check_assignments, read_arguments

_SPIN_PERIOD = 0.25  # s; how long a signal may wait
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_HELP = """usage: foot_pose_publisher [--ros-args -p NAME:=VALUE ... --params-file FILE]

Subscribes to joint_states (sensor_msgs/JointState) and publishes the poses of the iCub's feet
(geometry_msgs/PoseStamped) on ~/left_foot/pose and ~/right_foot/pose in root_link.

examples:
  foot_pose_publisher --ros-args -p version:=v2_5
  foot_pose_publisher --ros-args -p description_from_topic:=true
  foot_pose_publisher --ros-args -p chains:="[left_leg, head_imu=v2]" -p foot_frame:=sole
  foot_pose_publisher --ros-args --params-file foot_pose_publisher.yaml

parameters: chains, version, kinematics_file, description_from_topic, root_frame, joint_prefix,
foot_frame, frame_prefix, joint_timeout, stamp_source, publish_tf, publish_twist,
publish_markers. While the node runs, this explains each:
  ros2 param describe /foot_pose_publisher NAME
"""


def main() -> int:
    """Run the node until SIGINT or SIGTERM; return 0, or 1 after a line on what is wrong.

    rclpy's own signal handlers raise out of whatever the interpreter is doing, and a second signal
    during shutdown ends in a traceback; `ros2 launch` sends SIGINT twice.
    """
    received: list[
        int
    ] = []  # an Event would block where one signal comes upon the other
    for number in _SIGNALS:
        signal.signal(number, lambda number, _: received.append(number))
    try:
        _run(sys.argv, received)
    except LegFKError as error:
        print(f'foot_pose_publisher: error: {error}', file=sys.stderr)
        return 1
    finally:
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
    return 0


def _run(argv: Sequence[str], received: Sequence[int]) -> None:
    """Make the node and let it work until a signal has been received."""
    if '-h' in argv or '--help' in argv:
        print(_HELP, end='')
        return
    rclpy = _rclpy()
    try:
        node = _node(rclpy, argv)
        executor = _executor()
        executor.add_node(node)
        while rclpy.ok() and not received:
            # Unlike spin_once, this takes message after message without coming back in between.
            executor.spin_until_future_complete(
                rclpy.task.Future(), timeout_sec=_SPIN_PERIOD
            )
    finally:
        rclpy.try_shutdown()


def _rclpy() -> Any:
    try:
        import rclpy

        return rclpy
    except ImportError as error:
        raise MissingDependencyError(
            'rclpy',
            'the node',
            f"source ROS 2, or pip install 'icub_leg_fk[ros]' ({error})",
        ) from error


def _node(rclpy: Any, argv: Sequence[str]) -> Any:
    """Return the node as the command line wants it."""
    from icub_leg_fk.node.foot_pose_publisher import FootPosePublisher, START_ERRORS
    from icub_leg_fk.node.parameters import PARAMETER_NAMES

    check_assignments(read_arguments(argv), PARAMETER_NAMES)
    no_handlers = rclpy.signals.SignalHandlerOptions.NO
    try:
        rclpy.init(args=argv, signal_handler_options=no_handlers)
        others = rclpy.utilities.remove_ros_args(argv)[1:]
        if others:
            raise LegFKError(
                f'unknown argument {others[0]!r}; parameters go after --ros-args'
            )
        return FootPosePublisher()
    except START_ERRORS as error:
        raise LegFKError(_said_by_rclpy(error)) from error


def _said_by_rclpy(error: Exception) -> str:
    """Return a line of what rclpy raises, without the places in its sources."""
    line = re.sub(r',? at /\S+:\d+', '', ' '.join(str(error).split()))
    if type(error).__name__ == 'UnknownROSArgsError':
        return f'unknown argument {line.strip("[]")} after --ros-args'
    return line


def _executor() -> Any:
    """Return the cheapest executor there is: events, or wait sets if rclpy has no events one."""
    try:
        from rclpy.experimental.events_executor import EventsExecutor

        return EventsExecutor()
    except (ImportError, AttributeError, RuntimeError) as error:
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.logging import get_logger

        get_logger('foot_pose_publisher').info(
            f'no EventsExecutor ({error}); using the SingleThreadedExecutor'
        )
        return SingleThreadedExecutor()


if __name__ == '__main__':
    sys.exit(main())
