"""The node's output topics: what becomes of the joint vectors that a message has made ready.

A topic that nobody subscribes to costs nothing: the middleware tells when a subscriber comes or
goes, and only then is it decided anew what a chain's joint vectors become.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TwistStamped
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.solver import Pose
from icub_leg_fk.ros.cdr import PoseStampedEncoder, TFMessageEncoder, TwistStampedEncoder
from icub_leg_fk.ros.configuration import Configuration
from icub_leg_fk.ros.joint_input import Ready
from icub_leg_fk.ros.qos_overrides import OVERRIDABLE
from rclpy.event_handler import PublisherEventCallbacks, UnsupportedEventTypeError
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile

_DEPTH = 10
_TF_DEPTH = 100  # as tf2_ros.TransformBroadcaster has it
_TF, _SKELETON = '/tf', '~/skeleton'

Send = Callable[[bytes], None]


class _ChainOutput(NamedTuple):
    """What one chain's joint vectors become; None where nobody listens."""

    chain: Chain
    send_pose: Send | None
    encode_pose: Callable[[int, int, Pose], bytes]
    send_twist: Send | None
    encode_twist: Callable[..., bytes]


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
        self._chains: list[_ChainOutput | None] = []
        self._send_tf: Send | None = None
        self._tf_encoders: dict[tuple[int, ...], TFMessageEncoder] = {}
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
            from icub_leg_fk.ros.skeleton import no_skeletons
            skeleton.publish(no_skeletons())
        for topic in self._publishers.keys() - topics.keys():
            self._node.destroy_publisher(self._publishers.pop(topic))
        for topic, message_type in topics.items():
            if topic not in self._publishers:
                self._publishers[topic] = self._create(topic, message_type)
        self._configuration = configuration
        self._stamp_now = configuration.stamp_now
        self._connect()

    def publish(self, vectors: Iterable[Ready]) -> None:
        """Publish what one message has made ready."""
        chains, send_tf = self._chains, self._send_tf
        tf_chains: list[int] = []
        tf_poses: list[Pose] = []
        if self._stamp_now:
            sec, nanosec = divmod(self._node.get_clock().now().nanoseconds, 1_000_000_000)
            vectors = [vector._replace(sec=sec, nanosec=nanosec) for vector in vectors]
        for index, sec, nanosec, q, qdot in vectors:
            output = chains[index]
            if output is None:
                continue
            if output.send_pose is not None or send_tf is not None:
                pose = output.chain.pose(q)
                if output.send_pose is not None:
                    output.send_pose(output.encode_pose(sec, nanosec, pose))
                tf_chains.append(index)
                tf_poses.append(pose)
            if output.send_twist is not None:
                if qdot is None:
                    self._no_velocity(index)
                else:
                    twist = output.chain.twist(q, qdot)
                    output.send_twist(output.encode_twist(sec, nanosec, twist))
            if self._publish_skeleton is not None:
                self._publish_skeleton(self._skeleton(index, q, sec, nanosec))
        if send_tf is not None and tf_chains:
            encoder = self._tf_encoder(tuple(tf_chains))
            send_tf(encoder.encode(sec, nanosec, tf_poses))

    def _connect(self) -> None:
        """Decide what each chain's joint vectors become, by who subscribes."""
        if self._configuration is None:
            return
        prefix = self._configuration.frame_prefix
        self._send_tf = self._sender(_TF)
        self._tf_encoders.clear()
        self._publish_skeleton = (self._publishers[_SKELETON].publish if self._wanted(_SKELETON)
                                  else None)
        self._chains = []
        for chain in self._configuration.chains:
            frame_id = prefix + chain.root_frame
            output = _ChainOutput(
                chain,
                self._sender(f'~/{chain.tip}/pose'), PoseStampedEncoder(frame_id).encode,
                self._sender(f'~/{chain.tip}/twist'), TwistStampedEncoder(frame_id).encode)
            watched = (output.send_pose, output.send_twist, self._send_tf, self._publish_skeleton)
            self._chains.append(output if any(watched) else None)

    def _tf_encoder(self, chains: tuple[int, ...]) -> TFMessageEncoder:
        """Return what encodes the transforms of some chains into one message."""
        if chains not in self._tf_encoders:
            assert self._configuration is not None
            prefix = self._configuration.frame_prefix
            self._tf_encoders[chains] = TFMessageEncoder([
                (prefix + chain.root_frame, prefix + chain.tip_frame)
                for chain in (self._configuration.chains[index] for index in chains)])
        return self._tf_encoders[chains]

    def _skeleton(self, index: int, q: tuple[float, ...], sec: int, nanosec: int) -> Any:
        from icub_leg_fk.ros.skeleton import skeleton_markers
        configuration = self._configuration
        assert configuration is not None
        return skeleton_markers(configuration.chains[index], configuration.soles[index], q,
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
