"""tf2_msgs/TFMessage to its CDR bytes, little-endian."""

from __future__ import annotations

import struct

from icub_leg_fk.kinematics.solver import Pose
from icub_leg_fk.ros.pose_cdr import aligned, ENCAPSULATION, string


class TransformEncoder:
    """Serializes TFMessages that hold one transform between two frames.

    Args:
        frame_id: the frame the poses are given in.
        child_frame_id: the frame whose poses they are.
    """

    def __init__(self, frame_id: str, child_frame_id: str) -> None:
        names = string(frame_id)
        names += bytes(-len(names) % 4) + string(child_frame_id)
        self._names = aligned(12, names)
        self._pack = struct.Struct(f'<4sIiI{len(self._names)}s7d').pack

    def encode(self, sec: int, nanosec: int, pose: Pose) -> bytes:
        """Return the bytes of one message.

        Args:
            sec: seconds of the stamp.
            nanosec: nanoseconds of the stamp.
            pose: x, y, z [m], qx, qy, qz, qw.
        """
        return self._pack(ENCAPSULATION, 1, sec, nanosec, self._names, *pose)
