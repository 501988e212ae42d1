"""Start and stop of the node: `ros2 run icub_leg_fk foot_pose_publisher`."""

from __future__ import annotations

import os
import re
import signal
import sys
from types import FrameType
from typing import Any

_SPIN_PERIOD = 0.25  # s; how long a signal may wait
_HELP = """usage: foot_pose_publisher [--ros-args -p NAME:=VALUE ... --params-file FILE]

Subscribes to joint_states (sensor_msgs/JointState) and publishes the poses of the iCub's feet
(geometry_msgs/PoseStamped) on ~/left_foot/pose and ~/right_foot/pose in root_link.

examples:
  foot_pose_publisher --ros-args -p version:=v2_5
  foot_pose_publisher --ros-args -p chains:="[left_leg]" -p foot_frame:=sole
  foot_pose_publisher --ros-args --params-file foot_pose_publisher.yaml

parameters: chains, version, <chain>.version, kinematics_file, foot_frame, frame_prefix,
joint_timeout, stamp_source, publish_tf, publish_twist, publish_markers; the README has the table.
"""


def main() -> int:
    """Run the node until SIGINT or SIGTERM; return 0, or 1 after a line on what was wrong."""
    stop = _StopSignals()
    try:
        return _run(stop, sys.argv)
    finally:
        stop.ignore()


class _StopSignals:
    """Remembers that SIGINT or SIGTERM has come; before the node stands, they end the process.

    rclpy's own handlers raise out of whatever the interpreter is doing, and a second signal
    during shutdown ends in a traceback; `ros2 launch` sends SIGINT twice.
    """

    def __init__(self) -> None:
        self.requested = False
        self._starting = True
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._starting:
            os._exit(0)
        self.requested = True

    def started(self) -> None:
        """From now on there is something to take down in order."""
        self._starting = False

    def ignore(self) -> None:
        """From now on the process is on its way out by itself."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)


def _run(stop: _StopSignals, argv: list[str]) -> int:
    if {'-h', '--help'}.intersection(argv[1:]):
        print(_HELP, end='')
        return 0
    try:
        import rclpy
        from rclpy.logging import LoggingSeverity, set_logger_level
        from rclpy.signals import SignalHandlerOptions
        from rclpy.task import Future
        from rclpy.utilities import remove_ros_args
    except ImportError as error:
        return _refuse(f'rclpy cannot be imported ({error}); source ROS 2, or install '
                       'icub_leg_fk[ros]')
    from icub_leg_fk.errors import LegFKError
    from icub_leg_fk.ros.foot_pose_publisher import FootPosePublisher, START_ERRORS
    set_logger_level('rcl', LoggingSeverity.FATAL)  # what rcl would log comes as an exception
    try:
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
        if others := remove_ros_args(argv)[1:]:
            return _refuse(f'unknown argument {others[0]!r}; parameters go behind --ros-args')
    except RuntimeError as error:  # rclpy's errors for arguments it cannot parse
        unknown = type(error).__name__ == 'UnknownROSArgsError'
        return _refuse(f'unknown argument {error} behind --ros-args' if unknown else str(error))
    set_logger_level('rcl', LoggingSeverity.UNSET)
    stop.started()
    try:
        executor = _executor()
        try:
            executor.add_node(FootPosePublisher())
        except (LegFKError, *START_ERRORS) as error:
            return _refuse(str(error))
        while rclpy.ok() and not stop.requested:
            # Unlike spin_once, this takes message after message without coming back in between.
            executor.spin_until_future_complete(Future(), timeout_sec=_SPIN_PERIOD)
    finally:
        rclpy.try_shutdown()
    return 0


def _refuse(reason: str) -> int:
    line = re.sub(r',? at \S+:\d+', '', ' '.join(reason.split()))  # where in rcl's sources
    print(f'foot_pose_publisher: error: {line}', file=sys.stderr)
    return 1


def _executor() -> Any:
    """Return the cheapest executor there is: events, or wait sets if rclpy has no events one."""
    try:
        from rclpy.experimental.events_executor import EventsExecutor
        return EventsExecutor()
    except (ImportError, AttributeError, RuntimeError) as error:
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.logging import get_logger
        get_logger('foot_pose_publisher').info(
            f'no EventsExecutor ({error}); using the SingleThreadedExecutor')
        return SingleThreadedExecutor()


if __name__ == '__main__':
    sys.exit(main())
