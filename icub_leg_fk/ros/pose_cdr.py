"""geometry_msgs/PoseStamped to its CDR bytes, little-endian, and what such encoders share."""

from __future__ import annotations

import struct

from icub_leg_fk.kinematics.solver import Pose

ENCAPSULATION = b'\x00\x01\x00\x00'
STAMP_SIZE = 8


class PoseStampedEncoder:
    """Serializes PoseStamped messages of one frame id: everything but stamp and pose is ready.

    Args:
        frame_id: the frame the poses are given in.
    """

    def __init__(self, frame_id: str) -> None:
        self._frame_id = aligned(STAMP_SIZE, string(frame_id))
        self._pack = struct.Struct(f'<4siI{len(self._frame_id)}s7d').pack

    def encode(self, sec: int, nanosec: int, pose: Pose) -> bytes:
        """Return the bytes of one message.

        Args:
            sec: seconds of the stamp.
            nanosec: nanoseconds of the stamp.
            pose: x, y, z [m], qx, qy, qz, qw.
        """
        return self._pack(ENCAPSULATION, sec, nanosec, self._frame_id, *pose)


def string(text: str) -> bytes:
    """Return the bytes of a string: length, text and NUL."""
    data = text.encode() + b'\x00'
    return struct.pack('<I', len(data)) + data


def aligned(before: int, data: bytes) -> bytes:
    """Return data, which so many bytes stand before, padded so that doubles can follow."""
    return data + bytes(-(before + len(data)) % 8)
