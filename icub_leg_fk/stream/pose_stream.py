"""From joint vectors to serialized poses, twists and transforms; free of rclpy.

The node sends them to its topics, and `leg_fk bag` writes them into a recording.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.solver import Pose
from icub_leg_fk.stream.cdr import PoseStampedEncoder, TFMessageEncoder, TwistStampedEncoder
from icub_leg_fk.stream.joint_input import Ready

Send = Callable[[bytes], None]


class Senders(NamedTuple):
    """What takes one chain's messages; None where nobody listens."""

    pose: Send | None
    twist: Send | None


class PoseStream:
    """Computes, serializes and sends what joint vectors become.

    Args:
        chains: the chains, by whose index a vector names its own.
        frame_prefix: put before every frame id.
        senders: of each chain.
        send_tf: what takes one TFMessage per message of joint states; None if nobody listens.
        no_velocity: called with a chain's index when a twist could not be computed.
    """

    def __init__(self, chains: Sequence[Chain], frame_prefix: str, senders: Sequence[Senders],
                 send_tf: Send | None, no_velocity: Callable[[int], None]) -> None:
        self._frames = [(frame_prefix + chain.root_frame, frame_prefix + chain.frame_id)
                        for chain in chains]
        self._outputs = [
            (chain, *send, PoseStampedEncoder(root).encode, TwistStampedEncoder(root).encode)
            if any(send) or send_tf else None
            for chain, send, (root, _) in zip(chains, senders, self._frames, strict=True)]
        self._send_tf = send_tf
        self._no_velocity = no_velocity
        self._tf_encoders: dict[tuple[int, ...], TFMessageEncoder] = {}

    def send(self, vectors: Iterable[Ready]) -> None:
        """Send what one message has made ready."""
        send_tf = self._send_tf
        tf_chains: list[int] = []
        tf_poses: list[Pose] = []
        for index, sec, nanosec, q, qdot in vectors:
            output = self._outputs[index]
            if output is None:
                continue
            chain, send_pose, send_twist, encode_pose, encode_twist = output
            if send_pose is not None or send_tf is not None:
                pose = chain.pose(q)
                if send_pose is not None:
                    send_pose(encode_pose(sec, nanosec, pose))
                tf_chains.append(index)
                tf_poses.append(pose)
            if send_twist is not None:
                if qdot is None:
                    self._no_velocity(index)
                else:
                    send_twist(encode_twist(sec, nanosec, chain.twist(q, qdot)))
        if send_tf is not None and tf_chains:
            send_tf(self._tf_encoder(tuple(tf_chains)).encode(sec, nanosec, tf_poses))

    def _tf_encoder(self, chains: tuple[int, ...]) -> TFMessageEncoder:
        """Return what encodes the transforms of some chains into one message."""
        if chains not in self._tf_encoders:
            self._tf_encoders[chains] = TFMessageEncoder([self._frames[i] for i in chains])
        return self._tf_encoders[chains]
