"""The node's output topics: one function per chain that turns joint vectors into messages.

A topic that nobody subscribes to costs nothing: the middleware tells when a subscriber comes or
goes, and only then is it decided anew which messages a chain's joint vectors become.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TransformStamped, TwistStamped
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.ros.configuration import Configuration
from icub_leg_fk.ros.joint_stream import OnReady
from icub_leg_fk.ros.pose_cdr import PoseStampedEncoder
from icub_leg_fk.ros.qos_overrides import OVERRIDABLE
from icub_leg_fk.ros.twist_cdr import TwistStampedEncoder
from rclpy.event_handler import PublisherEventCallbacks, UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile

_DEPTH = 10


class Outputs:
    """Publishers of all chains, kept while their topics are configured.

    Args:
        node: the node that owns the publishers.
        on_change: called when a subscriber has come or gone.
        no_velocity: called with a chain's index when a twist could not be computed.
    """

    def __init__(self, node: Node, on_change: Callable[[], None],
                 no_velocity: Callable[[int], None]) -> None:
        self._node = node
        self._on_change = on_change
        self._no_velocity = no_velocity
        self._publishers: dict[str, Publisher] = {}
        self._events_supported = True
        self._broadcaster: Any = None
        self._configuration: Configuration | None = None

    def configure(self, configuration: Configuration) -> None:
        """Create the publishers that are needed and destroy those that are not."""
        topics: dict[str, Any] = {}
        for chain in configuration.chains:
            topics[f'~/{chain.tip}/pose'] = PoseStamped
            if configuration.publish_twist:
                topics[f'~/{chain.tip}/twist'] = TwistStamped
        if configuration.publish_markers:
            from visualization_msgs.msg import MarkerArray
            topics['~/skeleton'] = MarkerArray
        if (skeleton := self._publishers.get('~/skeleton')) is not None:
            from icub_leg_fk.ros.skeleton import no_skeletons
            skeleton.publish(no_skeletons())
        for topic in self._publishers.keys() - topics.keys():
            self._node.destroy_publisher(self._publishers.pop(topic))
        for topic, message_type in topics.items():
            if topic not in self._publishers:
                self._publishers[topic] = self._create(topic, message_type)
        if configuration.publish_tf and self._broadcaster is None:
            from tf2_ros import TransformBroadcaster
            self._broadcaster = TransformBroadcaster(self._node)
        elif not configuration.publish_tf and self._broadcaster is not None:
            self._node.destroy_publisher(self._broadcaster.pub_tf)
            self._broadcaster = None
        self._configuration = configuration

    def handlers(self) -> list[OnReady | None]:
        """Return what to do with each chain's joint vectors, None where nobody wants them."""
        if self._configuration is None:
            return []
        return [self._handler(index, chain, self._configuration)
                for index, chain in enumerate(self._configuration.chains)]

    def want_velocities(self) -> bool:
        """Return whether somebody subscribes to a twist."""
        return any(self._wanted(topic) for topic in self._publishers if topic.endswith('/twist'))

    def _create(self, topic: str, message_type: Any) -> Publisher:
        qos = QoSProfile(depth=_DEPTH)
        if self._events_supported:
            events = PublisherEventCallbacks(matched=lambda info: self._on_change())
            try:
                return self._node.create_publisher(message_type, topic, qos,
                                                   event_callbacks=events,
                                                   qos_overriding_options=OVERRIDABLE)
            except UnsupportedEventTypeError:
                self._events_supported = False
        return self._node.create_publisher(message_type, topic, qos,
                                           qos_overriding_options=OVERRIDABLE)

    def _wanted(self, topic: str) -> bool:
        publisher = self._publishers.get(topic)
        if publisher is None:
            return False
        for_late_ones = publisher.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
        return (for_late_ones or not self._events_supported
                or publisher.get_subscription_count() > 0)

    def _handler(self, index: int, chain: Chain, configuration: Configuration) -> OnReady | None:
        steps: list[OnReady] = []
        if self._wanted(topic := f'~/{chain.tip}/pose'):
            steps.append(self._pose_step(chain, configuration, _sender(self._publishers[topic])))
        if self._wanted(topic := f'~/{chain.tip}/twist'):
            steps.append(self._twist_step(index, chain, configuration,
                                          _sender(self._publishers[topic])))
        if configuration.publish_tf:
            steps.append(self._tf_step(chain, configuration))
        if self._wanted('~/skeleton'):
            steps.append(self._skeleton_step(chain, configuration))
        if not steps:
            return None
        step = steps[0] if len(steps) == 1 else _all_of(steps)
        return self._restamped(step) if configuration.stamp_now else step

    def _restamped(self, step: OnReady) -> OnReady:
        now = self._node.get_clock().now

        def restamped(sec: int, nanosec: int, q: Sequence[float],
                      qdot: Sequence[float] | None) -> None:
            sec, nanosec = divmod(now().nanoseconds, 1_000_000_000)
            step(sec, nanosec, q, qdot)
        return restamped

    def _pose_step(self, chain: Chain, configuration: Configuration,
                   send: Callable[[bytes], None]) -> OnReady:
        encode = PoseStampedEncoder(configuration.frame_prefix + chain.root_frame).encode
        pose = chain.pose

        def publish_pose(sec: int, nanosec: int, q: Sequence[float],
                         qdot: Sequence[float] | None) -> None:
            send(encode(sec, nanosec, pose(q)))
        return publish_pose

    def _twist_step(self, index: int, chain: Chain, configuration: Configuration,
                    send: Callable[[bytes], None]) -> OnReady:
        encode = TwistStampedEncoder(configuration.frame_prefix + chain.root_frame).encode
        twist = chain.twist

        def publish_twist(sec: int, nanosec: int, q: Sequence[float],
                          qdot: Sequence[float] | None) -> None:
            if qdot is None:
                self._no_velocity(index)
            else:
                send(encode(sec, nanosec, twist(q, qdot)))
        return publish_twist

    def _tf_step(self, chain: Chain, configuration: Configuration) -> OnReady:
        prefix = configuration.frame_prefix
        send = self._broadcaster.sendTransform
        subscribers = self._broadcaster.pub_tf.get_subscription_count

        def broadcast(sec: int, nanosec: int, q: Sequence[float],
                      qdot: Sequence[float] | None) -> None:
            if subscribers() == 0:  # of this publisher the middleware tells nothing
                return
            message = TransformStamped(child_frame_id=prefix + chain.tip_frame)
            message.header.frame_id = prefix + chain.root_frame
            message.header.stamp = Time(sec=sec, nanosec=nanosec)
            translation, rotation = message.transform.translation, message.transform.rotation
            (translation.x, translation.y, translation.z,
             rotation.x, rotation.y, rotation.z, rotation.w) = chain.pose(q)
            send(message)
        return broadcast

    def _skeleton_step(self, chain: Chain, configuration: Configuration) -> OnReady:
        from icub_leg_fk.ros.skeleton import skeleton_markers
        publish = self._publishers['~/skeleton'].publish

        def publish_skeleton(sec: int, nanosec: int, q: Sequence[float],
                             qdot: Sequence[float] | None) -> None:
            publish(skeleton_markers(chain, q, Time(sec=sec, nanosec=nanosec),
                                     configuration.frame_prefix))
        return publish_skeleton


def _sender(publisher: Publisher) -> Callable[[bytes], None]:
    """Return what sends serialized messages: `publish` without its checks, where rclpy has it."""
    send: Callable[[bytes], None] = getattr(publisher.handle, 'publish_raw', publisher.publish)
    return send


def _all_of(steps: Sequence[OnReady]) -> OnReady:
    def do_all(sec: int, nanosec: int, q: Sequence[float],
               qdot: Sequence[float] | None) -> None:
        for step in steps:
            step(sec, nanosec, q, qdot)
    return do_all
