"""The node: subscribes to joint states and publishes the poses of the feet."""

from icub_leg_fk.node.health import Health
from icub_leg_fk.node.outputs import Outputs
from icub_leg_fk.node.parameters import NodeParameters
from icub_leg_fk.node.qos_overrides import OVERRIDABLE
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.stream.description import Description
from icub_leg_fk.stream.joint_input import JointInput
from icub_leg_fk.stream.notes import INFO, Note
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import String

NODE_NAME = 'foot_pose_publisher'
START_ERRORS = (ParameterException, NameValidationException, RuntimeError)
"""What rclpy raises for values given at start that it cannot use itself."""

_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
"""SensorDataQoS, but deep enough for a pause at 1 kHz in which a description is read."""

_DESCRIPTION_QOS = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""As robot_state_publisher sends it: the last one comes, however late one listens."""


class FootPosePublisher(Node):
    """Subscribes to `joint_states` and publishes `~/<tip>/pose` and what else is asked for.

    Raises:
        LegFKError: a parameter given at start cannot be used.
    """

    def __init__(self) -> None:
        super().__init__(NODE_NAME)
        self._node_parameters = NodeParameters(self, self._apply)
        self._input = JointInput(lambda: self.get_clock().now().nanoseconds)
        self._outputs = Outputs(self)
        self._joint_states = self.create_subscription(
            JointState,
            'joint_states',
            self._take,
            _QOS,
            raw=True,
            qos_overriding_options=OVERRIDABLE,
        )
        descriptions = self.create_subscription(
            String,
            'robot_description',
            self._take_description,
            _DESCRIPTION_QOS,
            raw=True,
        )
        use = None
        if self._node_parameters.description_is_source:
            use = self._node_parameters.use
        self._description = Description(descriptions.topic_name, use)
        self._health = Health(
            self, self._input, self._joint_states.topic_name, self._description
        )
        self._apply(self._node_parameters.configuration)
        self._health.say_announcement()

    def _apply(self, configuration: Configuration) -> None:
        """Begin to work as configured, with the joints that are already known."""
        self._input.configure(
            configuration.chains,
            configuration.joint_timeout,
            configuration.publish_twist,
        )
        self._outputs.configure(configuration)
        self._description.configure(configuration)
        self._announce(configuration)

    def _announce(self, configuration: Configuration) -> None:
        topics = self._joint_states.topic_name, self._description.topic
        notes = _announcement(configuration, *topics)
        notes += self._description.announcement()
        self._health.configure(configuration, notes)

    def _take(self, data: bytes) -> None:
        """Take one serialized JointState in and publish what it makes ready."""
        vectors = self._input.feed(data)
        if vectors:
            self._outputs.publish(vectors)

    def _take_description(self, data: bytes) -> None:
        """Take one serialized description of the robot in, and say what follows from it."""
        self._description.take(data)
        self._announce(self._node_parameters.configuration)
        self._health.say_announcement()


def _announcement(
    configuration: Configuration, topic: str, description_topic: str
) -> list[Note]:
    """Return what there is to say of a configuration.

    Args:
        configuration: what is published.
        topic: the topic of the joint states.
        description_topic: the topic of the robot's description.
    """
    kinds = _kinds(configuration)
    if configuration.awaited:
        doing = (
            f'waiting for the description of the robot on {description_topic} to publish '
            f'{kinds} of {", ".join(configuration.awaited)}'
        )
    else:
        doing = f'publishing {kinds} of {_chains(configuration)}'
    notes = [Note('kinematics', text) for text in configuration.warnings]
    for text in (*configuration.notes, f'{doing}; joint states from {topic}'):
        notes.append(Note('configuration', text, level=INFO))
    return notes


def _kinds(configuration: Configuration) -> str:
    wanted = {
        'poses': True,
        'twists': configuration.publish_twist,
        'transforms': configuration.publish_tf,
        'skeletons': configuration.publish_markers,
    }
    *first, last = [kind for kind, is_wanted in wanted.items() if is_wanted]
    return f'{", ".join(first)} and {last}' if first else last


def _chains(configuration: Configuration) -> str:
    prefix = configuration.frame_prefix
    words = []
    for chain in configuration.chains:
        frames = f'{prefix}{chain.root_frame} to {prefix}{chain.frame_id}'
        words.append(f'{chain.tip} ({chain.name}={chain.version}, {frames})')
    return ', '.join(words)
