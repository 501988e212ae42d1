"""Start and stop of the node: `ros2 run icub_leg_fk foot_pose_publisher`."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import os
import re
import signal
import socket
import sys
import tempfile
from types import FrameType
from typing import Any

_HIGHEST_DOMAIN = 232  # whose ports still are ports
_SPIN_PERIOD = 0.25  # s; how long a signal may wait
LOOPBACK_IS_DOWN = (
    'the loopback interface is down, over which ROS nodes of one machine find each other; this '
    'brings it up: sudo ip link set lo up')
_HELP = """usage: foot_pose_publisher [--ros-args -p NAME:=VALUE ... --params-file FILE]

Subscribes to joint_states (sensor_msgs/JointState) and publishes the poses of the iCub's feet
(geometry_msgs/PoseStamped) on ~/left_foot/pose and ~/right_foot/pose in root_link.

examples:
  foot_pose_publisher --ros-args -p version:=v2_5
  foot_pose_publisher --ros-args -p chains:="[left_leg]" -p foot_frame:=sole
  foot_pose_publisher --ros-args --params-file foot_pose_publisher.yaml

parameters: chains, version, <chain>.version, kinematics_file, foot_frame, frame_prefix,
joint_timeout, stamp_source, publish_tf, publish_twist, publish_markers.
The package's docs/node.md explains them, and of a running node:
  ros2 param describe /foot_pose_publisher NAME
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
        from rclpy.signals import SignalHandlerOptions
        from rclpy.task import Future
        from rclpy.utilities import remove_ros_args
    except ImportError as error:
        return _refuse(f'rclpy cannot be imported ({error}); source ROS 2, or install '
                       'icub_leg_fk[ros]')
    from icub_leg_fk.errors import LegFKError
    from icub_leg_fk.node.foot_pose_publisher import FootPosePublisher, START_ERRORS
    if fault := _bare_assignment(argv[1:]) or unusable_domain():
        return _refuse(fault)
    try:
        with _stderr_unless_it_raises():
            rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
        if others := remove_ros_args(argv)[1:]:
            return _refuse(f'unknown argument {others[0]!r}; parameters go behind --ros-args')
    except RuntimeError as error:  # rclpy's errors for arguments it cannot parse
        if type(error).__name__ == 'UnknownROSArgsError':
            return _refuse(f'unknown argument {str(error).strip("[]")} behind --ros-args')
        return _refuse(str(error).removesuffix('. Error: error not set'))
    stop.started()
    try:
        executor = _executor()
        try:
            node = FootPosePublisher()
        except (LegFKError, *START_ERRORS) as error:
            return _refuse(str(error))
        if not loopback_is_up():
            node.get_logger().warning(LOOPBACK_IS_DOWN)
        executor.add_node(node)
        while rclpy.ok() and not stop.requested:
            # Unlike spin_once, this takes message after message without coming back in between.
            executor.spin_until_future_complete(Future(), timeout_sec=_SPIN_PERIOD)
    finally:
        rclpy.try_shutdown()
    return 0


def _bare_assignment(arguments: Sequence[str]) -> str | None:
    """Say how to write an assignment outside of --ros-args, which rcl takes for a remapping."""
    from icub_leg_fk.node.parameters import is_parameter_name
    behind_ros_args = False
    for argument in arguments:
        if argument in ('--ros-args', '--'):
            behind_ros_args = argument == '--ros-args'
        elif not behind_ros_args and ':=' in argument:
            name, _, value = argument.partition(':=')
            parameter = name.removeprefix('_')
            meant = (f'-p {parameter}' if is_parameter_name(parameter) else f'-r {name}')
            return f'unknown argument {argument!r}; did you mean --ros-args {meant}:={value}?'
    return None


@contextmanager
def _stderr_unless_it_raises() -> Iterator[None]:
    """Let what C writes to stderr pass, but for the report of an error that is raised as well."""
    if sys.stderr is None:  # it was closed before the start
        yield
        return
    sys.stderr.flush()
    stderr = os.dup(2)
    with tempfile.TemporaryFile() as written:
        os.dup2(written.fileno(), 2)
        try:
            yield
        except BaseException:
            written.truncate(0)
            raise
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)
            written.seek(0)
            while block := written.read(65536):
                os.write(2, block)


def _refuse(reason: str) -> int:
    line = re.sub(r',? at \S+:\d+', '', ' '.join(reason.split()))  # where in rcl's sources
    print(f'foot_pose_publisher: error: {line}', file=sys.stderr)
    return 1


def loopback_is_up() -> bool:
    """Return whether processes of this machine can reach each other."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        return probe.connect_ex(('127.0.0.1', 9)) == 0  # sends nothing


def unusable_domain() -> str:
    """Say what is wrong with ROS_DOMAIN_ID; for one too high Fast DDS ends the process."""
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    if domain.isdecimal() and int(domain) > _HIGHEST_DOMAIN:
        return f'ROS_DOMAIN_ID: found {domain}, allowed: 0 to {_HIGHEST_DOMAIN}'
    return ''


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
