"""geometry_msgs/TwistStamped to its CDR bytes, little-endian."""

from __future__ import annotations

import struct

from icub_leg_fk.kinematics.solver import Twist
from icub_leg_fk.ros.pose_cdr import aligned, ENCAPSULATION, STAMP_SIZE, string


class TwistStampedEncoder:
    """Serializes TwistStamped messages of one frame id.

    Args:
        frame_id: the frame in whose axes the twists are given.
    """

    def __init__(self, frame_id: str) -> None:
        self._frame_id = aligned(STAMP_SIZE, string(frame_id))
        self._pack = struct.Struct(f'<4siI{len(self._frame_id)}s6d').pack

    def encode(self, sec: int, nanosec: int, twist: Twist) -> bytes:
        """Return the bytes of one message.

        Args:
            sec: seconds of the stamp.
            nanosec: nanoseconds of the stamp.
            twist: vx, vy, vz [m/s], wx, wy, wz [rad/s].
        """
        return self._pack(ENCAPSULATION, sec, nanosec, self._frame_id, *twist)
