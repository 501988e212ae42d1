"""geometry_msgs/PoseStamped to its CDR bytes, little-endian."""

from __future__ import annotations

import struct

from icub_leg_fk.kinematics.solver import Pose

_ENCAPSULATION = b'\x00\x01\x00\x00'


class PoseStampedEncoder:
    """Serializes PoseStamped messages of one frame id: everything but stamp and pose is ready.

    Args:
        frame_id: the frame the poses are given in.
    """

    def __init__(self, frame_id: str) -> None:
        text = frame_id.encode() + b'\x00'
        padding = -(8 + 4 + len(text)) % 8  # stamp, length, text; then doubles, aligned to 8
        self._frame_id = struct.pack('<I', len(text)) + text + bytes(padding)
        self._pack = struct.Struct(f'<4siI{len(self._frame_id)}s7d').pack

    def encode(self, sec: int, nanosec: int, pose: Pose) -> bytes:
        """Return the bytes of one message.

        Args:
            sec: seconds of the stamp.
            nanosec: nanoseconds of the stamp.
            pose: x, y, z [m], qx, qy, qz, qw.
        """
        return self._pack(_ENCAPSULATION, sec, nanosec, self._frame_id, *pose)
