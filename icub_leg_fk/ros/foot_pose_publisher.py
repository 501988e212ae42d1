"""The node: subscribes to joint states and publishes the poses of the feet."""

from __future__ import annotations

from icub_leg_fk.ros.configuration import Configuration
from icub_leg_fk.ros.diagnostics import Diagnostics
from icub_leg_fk.ros.joint_input import JointInput
from icub_leg_fk.ros.joint_stream import JointStream
from icub_leg_fk.ros.outputs import Outputs
from icub_leg_fk.ros.parameters import NodeParameters
from icub_leg_fk.ros.qos_overrides import OVERRIDABLE
from icub_leg_fk.ros.throttle import ThrottledWarnings
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

NODE_NAME = 'foot_pose_publisher'
START_ERRORS = (ParameterException, NameValidationException, RuntimeError)
"""What rclpy raises for values given at start that it cannot use itself."""


class FootPosePublisher(Node):
    """Subscribes to `joint_states` and publishes `~/<tip>/pose` and what else is asked for.

    Raises:
        LegFKError: a parameter given at start cannot be used.
    """

    def __init__(self) -> None:
        super().__init__(NODE_NAME)
        parameters = NodeParameters(self, self._configure)
        self._warnings = ThrottledWarnings(lambda text: self.get_logger().warning(text))
        self._stream: JointStream | None = None
        self._outputs = Outputs(self, self._connect,
                                lambda chain: self._settled().note_no_velocity(chain))
        self._diagnostics = Diagnostics(self)
        self._joint_states = self.create_subscription(
            JointState, 'joint_states', lambda data: None, qos_profile_sensor_data, raw=True,
            qos_overriding_options=OVERRIDABLE)
        self._configure(parameters.configuration)

    def _configure(self, configuration: Configuration) -> None:
        """Begin to work as configured, with the joints that are already known."""
        joint_input = JointInput(configuration.chains, configuration.joint_timeout, self._warnings)
        if self._stream is not None:
            joint_input.take_over(self._stream.settle())
        self._outputs.configure(configuration)
        self._stream = JointStream(joint_input, lambda: self.get_clock().now().nanoseconds)
        self._joint_states.callback = self._stream.feed
        self._diagnostics.watch(self._stream)
        self._connect()
        for note in configuration.notes:
            self.get_logger().info(note)
        self.get_logger().info('publishing ' + ', '.join(
            f'{chain.tip} ({chain.name} {chain.version}, {configuration.frame_prefix}'
            f'{chain.root_frame} to {configuration.frame_prefix}{chain.tip_frame})'
            for chain in configuration.chains))

    def _connect(self) -> None:
        """Give each chain's joint vectors to the topics that somebody subscribes to."""
        if self._stream is not None:
            self._stream.on_ready = self._outputs.handlers()
            self._stream.want_velocities(self._outputs.want_velocities())

    def _settled(self) -> JointInput:
        assert self._stream is not None
        return self._stream.settle()
