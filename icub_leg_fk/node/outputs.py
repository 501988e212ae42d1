"""The node's output topics: what becomes of the joint vectors that a message has made ready.

A topic that nobody subscribes to costs nothing: the middleware tells when a subscriber comes or
goes, and only then is it decided anew what a chain's joint vectors become.
"""

from collections.abc import Callable, Sequence
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TwistStamped
from icub_leg_fk.node.qos_overrides import OVERRIDABLE
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.stream.joint_input import Ready
from icub_leg_fk.stream.pose_stream import PoseStream, Send, Senders
from rclpy.event_handler import PublisherEventCallbacks, UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile

_DEPTH = 10
_TF_DEPTH = 100  # as tf2_ros.TransformBroadcaster has it
_TF, _SKELETON = '/tf', '~/skeleton'


class Outputs:
    """Publishers of all chains, kept while their topics are configured.

    Args:
        node: the node that owns the publishers.
        no_velocity: called with a chain's index when a twist could not be computed.
    """

    def __init__(self, node: Node, no_velocity: Callable[[int], None]) -> None:
        self._node = node
        self._no_velocity = no_velocity
        self._publishers: dict[str, Publisher] = {}
        self._events_supported = True
        self._configuration: Configuration | None = None
        self._stamp_now = False
        self._stream = PoseStream((), '', (), None, no_velocity)
        self._publish_skeleton: Callable[[Any], None] | None = None

    def configure(self, configuration: Configuration) -> None:
        """Create the publishers that are needed and destroy those that are not."""
        topics: dict[str, Any] = {}
        for chain in configuration.chains:
            topics[f'~/{chain.tip}/pose'] = PoseStamped
            if configuration.publish_twist:
                topics[f'~/{chain.tip}/twist'] = TwistStamped
        if configuration.publish_tf:
            from tf2_msgs.msg import TFMessage
            topics[_TF] = TFMessage
        if configuration.publish_markers:
            from visualization_msgs.msg import MarkerArray
            topics[_SKELETON] = MarkerArray
        if (skeleton := self._publishers.get(_SKELETON)) is not None:
            from icub_leg_fk.node.skeleton import no_skeletons
            skeleton.publish(no_skeletons())
        for topic in self._publishers.keys() - topics.keys():
            self._node.destroy_publisher(self._publishers.pop(topic))
        for topic, message_type in topics.items():
            if topic not in self._publishers:
                self._publishers[topic] = self._create(topic, message_type)
        self._configuration = configuration
        self._stamp_now = configuration.stamp_now
        self._connect()

    def publish(self, vectors: Sequence[Ready]) -> None:
        """Publish what one message has made ready."""
        if self._stamp_now:
            sec, nanosec = divmod(self._node.get_clock().now().nanoseconds, 1_000_000_000)
            vectors = [vector._replace(sec=sec, nanosec=nanosec) for vector in vectors]
        self._stream.send(vectors)
        if self._publish_skeleton is not None:
            for index, sec, nanosec, q, _ in vectors:
                self._publish_skeleton(self._skeleton(index, q, sec, nanosec))

    def _connect(self) -> None:
        """Decide what each chain's joint vectors become, by who subscribes."""
        configuration = self._configuration
        if configuration is None:
            return
        senders = [Senders(self._sender(f'~/{chain.tip}/pose'), self._sender(
            f'~/{chain.tip}/twist')) for chain in configuration.chains]
        self._stream = PoseStream(configuration.chains, configuration.frame_prefix, senders,
                                  self._sender(_TF), self._no_velocity)
        self._publish_skeleton = (self._publishers[_SKELETON].publish if self._wanted(_SKELETON)
                                  else None)

    def _skeleton(self, index: int, q: tuple[float, ...], sec: int, nanosec: int) -> Any:
        from icub_leg_fk.node.skeleton import skeleton_markers
        configuration = self._configuration
        assert configuration is not None
        return skeleton_markers(configuration.chains[index], q,
                                Time(sec=sec, nanosec=nanosec), configuration.frame_prefix)

    def _create(self, topic: str, message_type: Any) -> Publisher:
        options = {} if topic == _TF else {'qos_overriding_options': OVERRIDABLE}
        qos = QoSProfile(depth=_TF_DEPTH if topic == _TF else _DEPTH)
        if self._events_supported:
            events = PublisherEventCallbacks(matched=lambda info: self._connect())
            try:
                return self._node.create_publisher(message_type, topic, qos,
                                                   event_callbacks=events, **options)
            except UnsupportedEventTypeError:
                self._events_supported = False
        return self._node.create_publisher(message_type, topic, qos, **options)

    def _wanted(self, topic: str) -> bool:
        publisher = self._publishers.get(topic)
        if publisher is None:
            return False
        for_late_ones = publisher.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
        return (for_late_ones or not self._events_supported
                or publisher.get_subscription_count() > 0)

    def _sender(self, topic: str) -> Send | None:
        """Return what sends serialized messages on a topic; None if nobody listens.

        It is `publish` without its checks of every message, where rclpy has that.
        """
        if not self._wanted(topic):
            return None
        publisher = self._publishers[topic]
        send: Send = getattr(publisher.handle, 'publish_raw', publisher.publish)
        return send
