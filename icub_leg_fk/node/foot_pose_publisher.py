"""The node: subscribes to joint states and publishes the poses of the feet."""

import time

from icub_leg_fk.node.diagnostics import Diagnostics
from icub_leg_fk.node.outputs import Outputs
from icub_leg_fk.node.parameters import NodeParameters
from icub_leg_fk.node.qos_overrides import OVERRIDABLE
from icub_leg_fk.node.signs_of_life import SignsOfLife, ThrottledWarnings
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.stream.joint_input import JointInput
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
        topic = self.resolve_topic_name('joint_states')
        self._signs = SignsOfLife(self.get_logger(), topic)
        self._warnings = ThrottledWarnings(lambda text: self.get_logger().warning(text))
        self._input = JointInput((), 0.0, lambda: 0)
        self._heard: float | None = None
        self._outputs = Outputs(self, lambda chain: self._input.note_no_velocity(chain))
        self._joint_states = self.create_subscription(
            JointState, 'joint_states', self._take, qos_profile_sensor_data, raw=True,
            qos_overriding_options=OVERRIDABLE)
        self._configure(parameters.configuration)
        self._diagnostics = Diagnostics(self, topic, self._signs,
                                        lambda: (self._input, self._heard))

    def _take(self, data: bytes) -> None:
        """Take one serialized JointState in and publish what it makes ready."""
        self._heard = time.monotonic()
        if vectors := self._input.feed(data):
            self._outputs.publish(vectors)

    def _configure(self, configuration: Configuration) -> None:
        """Begin to work as configured, with the joints that are already known."""
        joint_input = JointInput(configuration.chains, configuration.joint_timeout,
                                 lambda: self.get_clock().now().nanoseconds, self._warnings,
                                 configuration.publish_twist)
        joint_input.take_over(self._input)
        self._input = joint_input
        self._outputs.configure(configuration)
        self._signs.configured([
            *configuration.notes,
            f'publishing {_published(configuration)}; joint states from '
            f'{self._joint_states.topic_name}'], configuration.warnings)


def _published(configuration: Configuration) -> str:
    """Say what is published in a line."""
    prefix = configuration.frame_prefix
    kinds = ['poses', *(kind for kind, wanted in (
        ('twists', configuration.publish_twist), ('transforms', configuration.publish_tf),
        ('skeletons', configuration.publish_markers)) if wanted)]
    chains = ', '.join(
        f'{chain.tip} ({chain.name} {chain.version}, {prefix}{chain.root_frame} to '
        f'{prefix}{chain.frame_id})' for chain in configuration.chains)
    kinds[-2:] = [' and '.join(kinds[-2:])]
    return f'{", ".join(kinds)} of {chains}'
