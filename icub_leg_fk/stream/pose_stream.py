"""From joint vectors to serialized poses, twists and transforms; free of rclpy.

The node sends them to its topics, and `leg_fk bag` writes them into a recording.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.chain import solver_of
from icub_leg_fk.kinematics.solver import Pose
from icub_leg_fk.stream.cdr import (
    PoseStampedEncoder,
    TFMessageEncoder,
    TwistStampedEncoder,
)
from icub_leg_fk.stream.joint_input import Ready

Send = Callable[[bytes], None]
_Message = tuple[Send, bytes]


class Senders(NamedTuple):
    """What takes one chain's messages; None where nobody listens."""

    pose: Send | None
    twist: Send | None


class PoseStream:
    """Computes, serializes and sends what joint vectors become.

    Args:
        chains: the chains.
        frame_prefix: put before every frame id.
        senders: of each chain, by its name.
        send_tf: what takes one TFMessage per message of joint states; None if nobody listens.
    """

    def __init__(
        self,
        chains: Sequence[Chain],
        frame_prefix: str,
        senders: Mapping[str, Senders],
        send_tf: Send | None,
    ) -> None:
        self._send_tf = send_tf
        self._outputs: dict[str, _Output] = {}
        self._frames: dict[str, tuple[str, str]] = {}
        for chain in chains:
            root = frame_prefix + chain.root_frame
            self._frames[chain.name] = root, frame_prefix + chain.frame_id
            self._outputs[chain.name] = _Output(
                chain, root, senders[chain.name], is_in_tf=send_tf is not None
            )
        self._tf_encoders: dict[tuple[str, ...], TFMessageEncoder] = {}

    def send(self, vectors: Iterable[Ready]) -> None:
        """Send what one message has made ready.

        All is computed before the first message goes out, since its receiver may take the core.
        """
        messages: list[_Message] = []
        poses: dict[str, Pose] = {}
        for vector in vectors:
            pose = self._outputs[vector.chain.name].add_messages(vector, messages)
            if pose is not None:
                poses[vector.chain.name] = pose
        if self._send_tf is not None and poses:
            encode = self._tf_encoder(tuple(poses)).encode
            transforms = encode(vector.sec, vector.nanosec, [*poses.values()])
            messages.append((self._send_tf, transforms))
        for send, data in messages:
            send(data)

    def _tf_encoder(self, chains: tuple[str, ...]) -> TFMessageEncoder:
        """Return what encodes the transforms of some chains into one message."""
        if chains not in self._tf_encoders:
            frames = [self._frames[name] for name in chains]
            self._tf_encoders[chains] = TFMessageEncoder(frames)
        return self._tf_encoders[chains]


class _Output:
    """What becomes of one chain's joint vectors."""

    def __init__(
        self, chain: Chain, root_frame: str, senders: Senders, is_in_tf: bool
    ) -> None:
        self._solver = solver_of(chain)  # the joint input has looked at the numbers
        self._send_pose, self._send_twist = senders
        self._needs_pose = is_in_tf or self._send_pose is not None
        self._encode_pose = PoseStampedEncoder(root_frame).encode
        self._encode_twist = TwistStampedEncoder(root_frame).encode

    def add_messages(self, vector: Ready, messages: list[_Message]) -> Pose | None:
        """Add what a joint vector gives; return its pose, or None if nobody needs it."""
        pose = None
        if self._needs_pose:
            pose = self._solver.pose(vector.positions)
            if self._send_pose is not None:
                data = self._encode_pose(vector.sec, vector.nanosec, pose)
                messages.append((self._send_pose, data))
        if self._send_twist is not None and vector.velocities is not None:
            twist = self._solver.twist(vector.positions, vector.velocities)
            data = self._encode_twist(vector.sec, vector.nanosec, twist)
            messages.append((self._send_twist, data))
        return pose
