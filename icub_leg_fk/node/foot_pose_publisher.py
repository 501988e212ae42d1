"""The node: subscribes to joint states and publishes the poses of the feet."""

from icub_leg_fk.node.health import Health
from icub_leg_fk.node.outputs import Outputs
from icub_leg_fk.node.parameters import NodeParameters
from icub_leg_fk.node.qos_overrides import OVERRIDABLE
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.stream.joint_input import JointInput
from icub_leg_fk.stream.notes import INFO, Note, WARNING
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

NODE_NAME = 'foot_pose_publisher'
START_ERRORS = (ParameterException, NameValidationException, RuntimeError)
"""What rclpy raises for values given at start that it cannot use itself."""

_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
"""SensorDataQoS, but deep enough for a pause of 15 ms at 1 kHz."""


class FootPosePublisher(Node):
    """Subscribes to `joint_states` and publishes `~/<tip>/pose` and what else is asked for.

    Raises:
        LegFKError: a parameter given at start cannot be used.
    """

    def __init__(self) -> None:
        super().__init__(NODE_NAME)
        parameters = NodeParameters(self, self._apply)
        self._input = JointInput(lambda: self.get_clock().now().nanoseconds)
        self._outputs = Outputs(self)
        self._joint_states = self.create_subscription(
            JointState, 'joint_states', self._take, _QOS, raw=True,
            qos_overriding_options=OVERRIDABLE)
        self._health = Health(self, self._input, self._joint_states.topic_name)
        self._apply(parameters.configuration)
        self._health.say_announcement()

    def _apply(self, configuration: Configuration) -> None:
        """Begin to work as configured, with the joints that are already known."""
        self._input.configure(configuration.chains, configuration.joint_timeout,
                              configuration.publish_twist)
        self._outputs.configure(configuration)
        self._health.announce(_announcement(configuration, self._joint_states.topic_name))

    def _take(self, data: bytes) -> None:
        """Take one serialized JointState in and publish what it makes ready."""
        vectors = self._input.feed(data)
        if vectors:
            self._outputs.publish(vectors)


def _announcement(configuration: Configuration, topic: str) -> list[Note]:
    """Return what there is to say of a configuration."""
    notes = [Note('kinematics', '', WARNING, text) for text in configuration.warnings]
    texts = [*configuration.notes, f'publishing {_kinds(configuration)} of '
             f'{_chains(configuration)}; joint states from {topic}']
    return notes + [Note('configuration', '', INFO, text) for text in texts]


def _kinds(configuration: Configuration) -> str:
    kinds = ['poses']
    if configuration.publish_twist:
        kinds.append('twists')
    if configuration.publish_tf:
        kinds.append('transforms')
    if configuration.publish_markers:
        kinds.append('skeletons')
    *first, last = kinds
    return f'{", ".join(first)} and {last}' if first else last


def _chains(configuration: Configuration) -> str:
    prefix = configuration.frame_prefix
    words = []
    for chain in configuration.chains:
        frames = f'{prefix}{chain.root_frame} to {prefix}{chain.frame_id}'
        words.append(f'{chain.tip} ({chain.name}={chain.version}, {frames})')
    return ', '.join(words)
