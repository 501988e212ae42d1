"""The node's output topics: what becomes of the joint vectors that a message has made ready.

A topic that nobody subscribes to costs nothing: the middleware reports when a subscriber comes or
goes, and only then is it decided anew what a chain's joint vectors become.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TwistStamped
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.node.qos_overrides import OVERRIDABLE
from icub_leg_fk.node.rclpy_private import raw_publish
from icub_leg_fk.node.skeleton import no_skeletons, skeleton_markers
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.stream.joint_input import Ready
from icub_leg_fk.stream.pose_stream import PoseStream, Send, Senders
from rclpy.event_handler import PublisherEventCallbacks, UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from visualization_msgs.msg import MarkerArray

_DEPTH = 10
_TF_DEPTH = 100  # as tf2_ros.TransformBroadcaster has it
_TF = '/tf'
_SKELETON = '~/skeleton'


class Outputs:
    """Publishers of all chains, kept while their topics are configured.

    Args:
        node: the node that owns the publishers.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publishers: dict[str, Publisher] = {}
        self._events_supported = True

    def configure(self, configuration: Configuration) -> None:
        """Create the publishers that are needed and destroy those that are not."""
        self._configuration = configuration
        if _SKELETON in self._publishers:
            self._publishers[_SKELETON].publish(no_skeletons())
        topics = _topics(configuration)
        for topic in self._publishers.keys() - topics.keys():
            self._node.destroy_publisher(self._publishers.pop(topic))
        for topic, message_type in topics.items():
            if topic not in self._publishers:
                self._publishers[topic] = self._create(topic, message_type)
        self._connect()

    def publish(self, vectors: Sequence[Ready]) -> None:
        """Publish what one message has made ready."""
        if self._configuration.stamp_now:
            sec, nanosec = divmod(
                self._node.get_clock().now().nanoseconds, 1_000_000_000
            )
            vectors = [replace(vector, sec=sec, nanosec=nanosec) for vector in vectors]
        self._stream.send(vectors)
        if self._wants_skeletons:
            self._publish_skeletons(vectors)

    def _publish_skeletons(self, vectors: Sequence[Ready]) -> None:
        prefix = self._configuration.frame_prefix
        for vector in vectors:
            stamp = Time(sec=vector.sec, nanosec=vector.nanosec)
            markers = skeleton_markers(vector.chain, vector.positions, stamp, prefix)
            self._publishers[_SKELETON].publish(markers)

    def _connect(self) -> None:
        """Decide what each chain's joint vectors become, by who subscribes."""
        configuration = self._configuration
        senders = {}
        for chain in configuration.chains:
            pose = self._sender(pose_topic(chain))
            twist = self._sender(_twist_topic(chain))
            senders[chain.name] = Senders(pose, twist)
        self._stream = PoseStream(
            configuration.chains, configuration.frame_prefix, senders, self._sender(_TF)
        )
        self._wants_skeletons = self._is_wanted(_SKELETON)

    def _create(self, topic: str, message_type: Any) -> Publisher:
        qos = QoSProfile(depth=_DEPTH)
        options: dict[str, Any] = {'qos_overriding_options': OVERRIDABLE}
        if topic == _TF:
            qos = QoSProfile(depth=_TF_DEPTH)
            options = {}
        if self._events_supported:
            options['event_callbacks'] = PublisherEventCallbacks(
                matched=lambda info: self._connect()
            )
        try:
            return self._node.create_publisher(message_type, topic, qos, **options)
        except UnsupportedEventTypeError:
            self._events_supported = False
            return self._create(topic, message_type)

    def _sender(self, topic: str) -> Send | None:
        """Return what sends serialized messages on a topic; None if nobody listens."""
        if not self._is_wanted(topic):
            return None
        return raw_publish(self._publishers[topic])

    def _is_wanted(self, topic: str) -> bool:
        """Return whether messages on a topic are for anybody."""
        publisher = self._publishers.get(topic)
        if publisher is None:
            return False
        for_late_ones = (
            publisher.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
        )
        if for_late_ones or not self._events_supported:
            return True
        return bool(publisher.get_subscription_count())


def pose_topic(chain: Chain) -> str:
    """Return the topic of a chain's poses."""
    return f'~/{chain.tip}/pose'


def _twist_topic(chain: Chain) -> str:
    return f'~/{chain.tip}/twist'


def _topics(configuration: Configuration) -> dict[str, Any]:
    """Return the message types of the topics that are wanted."""
    topics: dict[str, Any] = {}
    for chain in configuration.chains:
        topics[pose_topic(chain)] = PoseStamped
        if configuration.publish_twist:
            topics[_twist_topic(chain)] = TwistStamped
    if configuration.publish_tf:
        topics[_TF] = _tf_message()
    if configuration.publish_markers:
        topics[_SKELETON] = MarkerArray
    return topics


def _tf_message() -> Any:
    """Return the type of messages on /tf; PyPI lacks it, and `publish_tf` is refused there."""
    from tf2_msgs.msg import TFMessage

    return TFMessage
