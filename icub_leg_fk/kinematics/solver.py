"""Pose and twist of a chain's tip: one recurrence, for one joint vector and for many.

Position p and unit quaternion q of the tip are carried from the tip to the root. Each row is
Rx(alpha), Tx(a), Tz(d), Rz(theta), applied in this order: a rotation turns two components of p by
its angle, and the quaternion by half of it,

    Rx(alpha):  (py, pz) by alpha;  (qw, qx) and (qy, qz) by alpha / 2
    Rz(theta):  (px, py) by theta;  (qw, qz) and (qx, qy) by theta / 2

and T_root_0 comes last. Where alpha is a right angle, as most are, cos(alpha) is 0 and half of it
has a cosine and a sine of sqrt(1/2), a factor that the quaternion has from the start. The
arithmetic is the same for floats and for arrays of N of them; only cosine and sine are handed in.
The results equal the product of the 4x4 matrices, `Chain.forward`, and the Jacobian times the
joint velocities, to which the tests hold them.
"""

from collections.abc import Callable, Sequence
import math
from typing import Any, NamedTuple

from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import (
    Array,
    cos_sin,
    matrix_to_quaternion,
    reference_quaternion,
)
import numpy as np

BLOCK = 8192  # rows worked on at once: a dozen such arrays stay in the L2 cache

Numbers = Any  # a float, or an (N,) array of them

_NEW_TUPLE = tuple.__new__  # takes half the time of calling a named tuple


class Pose(NamedTuple):
    """Position [m] and unit quaternion of a tip in its root frame."""

    x: float
    y: float
    z: float
    qx: float
    qy: float
    qz: float
    qw: float

    def __repr__(self) -> str:
        return _short_repr(self)


class Twist(NamedTuple):
    """Linear [m/s] and angular [rad/s] velocity of a tip in the axes of its root frame."""

    vx: float
    vy: float
    vz: float
    wx: float
    wy: float
    wz: float

    def __repr__(self) -> str:
        return _short_repr(self)


class _Row(NamedTuple):
    """The constants of a row, and which joint moves it; 0 is the gain of what does not move."""

    cos_alpha: float
    sin_alpha: float
    cos_half_alpha: float
    sin_half_alpha: float
    a: float
    d: float
    half_theta: float
    joint: int
    half_turn_gain: float
    slide_gain: float


def _short_repr(numbers: Pose | Twist) -> str:
    """Return the numbers by name, with at most six decimals each."""
    fields = zip(numbers._fields, numbers, strict=True)
    shown = ', '.join(f'{name}={round(value, 6) + 0.0:.10g}' for name, value in fields)
    return f'{type(numbers).__name__}({shown})'


class Solver:
    """Position, unit quaternion and velocity of a chain's tip in its root frame.

    Joint vectors are taken as they are: what is not finite gives a result that is not finite, or
    the ValueError of `math.cos`.

    Args:
        links: m rows, root to tip.
        joints: index of the joint that moves each row; of no meaning for a fixed one.
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        T_n_tip: (4, 4) transform from the tip to the last row's frame.
        R_zero: (3, 3) orientation of the tip at q = 0, which decides the quaternions' sign.
    """

    def __init__(
        self,
        links: Sequence[DHLink],
        joints: Sequence[int],
        T_root_0: Array,
        T_n_tip: Array,
        R_zero: Array,
    ) -> None:
        rows = [_row(link, joint) for link, joint in zip(links, joints, strict=True)]
        right_angles = sum(row.cos_alpha == 0.0 for row in rows)
        q_tip = matrix_to_quaternion(T_n_tip[:3, :3]) * 2.0 ** (-right_angles / 2)
        self._start = (*T_n_tip[:3, 3].tolist(), *q_tip.tolist())
        # Plain tuples unpack faster than named ones.
        self._rows: list[Any] = [tuple(row) for row in reversed(rows)]
        self._R_root = tuple(T_root_0[:3, :3].ravel().tolist())
        self._t_root = tuple(T_root_0[:3, 3].tolist())
        self._q_root = tuple(matrix_to_quaternion(T_root_0[:3, :3]).tolist())
        self._reference = tuple(
            reference_quaternion(matrix_to_quaternion(R_zero)).tolist()
        )

    def pose(self, q: Sequence[float]) -> Pose:
        """Return the pose for one joint vector of n floats [rad or m]."""
        x, y, z, qx, qy, qz, qw = self._tip(q, math.cos, math.sin)
        rx, ry, rz, rw = self._reference
        # Adding to 0.0 or taking from it leaves no negative zero.
        if rx * qx + ry * qy + rz * qz + rw * qw >= 0.0:
            values = 0.0 + x, 0.0 + y, 0.0 + z, 0.0 + qx, 0.0 + qy, 0.0 + qz, 0.0 + qw
        else:
            values = 0.0 + x, 0.0 + y, 0.0 + z, 0.0 - qx, 0.0 - qy, 0.0 - qz, 0.0 - qw
        return _NEW_TUPLE(Pose, values)

    def poses(self, Q: Array) -> Array:
        """Return the (N, 7) rows x, y, z [m], qx, qy, qz, qw for (N, n) joint positions."""
        out = np.empty((len(Q), 7))
        with np.errstate(over='ignore', invalid='ignore'):
            for start in range(0, len(Q), BLOCK):
                rows = slice(start, start + BLOCK)
                out[rows] = self._block(np.ascontiguousarray(Q[rows].T)).T
        return out

    def _block(self, Q: Array) -> Array:
        """Return the (7, N) poses for (n, N) joint positions."""
        poses = np.empty((7, Q.shape[1]))
        for row, values in zip(poses, self._tip(Q, np.cos, np.sin), strict=True):
            row[:] = values
        is_other = np.asarray(self._reference) @ poses[3:] < 0.0
        poses[3:] *= np.where(is_other, -1.0, 1.0)
        poses += 0.0  # leaves no negative zero
        return poses

    def _tip(
        self,
        q: Any,
        cos: Callable[[Numbers], Numbers],
        sin: Callable[[Numbers], Numbers],
    ) -> tuple[Numbers, ...]:
        """Return x, y, z, qx, qy, qz, qw for n joint positions, which are floats or arrays."""
        x, y, z, qx, qy, qz, qw = self._start
        for ca, sa, ch, sh, a, d, half, joint, half_gain, slide_gain in self._rows:
            if not ca:  # a right angle
                y, z = -sa * z, sa * y
                qw, qx = qw - sa * qx, qx + sa * qw
                qy, qz = qy - sa * qz, qz + sa * qy
            elif sh:
                y, z = ca * y - sa * z, sa * y + ca * z
                qw, qx = ch * qw - sh * qx, ch * qx + sh * qw
                qy, qz = ch * qy - sh * qz, ch * qz + sh * qy
            if a:
                x = x + a
            if d:
                z = z + d
            if half_gain:
                half = half + half_gain * q[joint]
            elif slide_gain:
                z = z + slide_gain * q[joint]
            c = cos(half)
            s = sin(half)
            qw, qz = c * qw - s * qz, c * qz + s * qw
            qx, qy = c * qx - s * qy, c * qy + s * qx
            c, s = c * c - s * s, 2.0 * c * s
            x, y = c * x - s * y, s * x + c * y
        r00, r01, r02, r10, r11, r12, r20, r21, r22 = self._R_root
        tx, ty, tz = self._t_root
        ax, ay, az, aw = self._q_root
        return (
            r00 * x + r01 * y + r02 * z + tx,
            r10 * x + r11 * y + r12 * z + ty,
            r20 * x + r21 * y + r22 * z + tz,
            aw * qx + ax * qw + ay * qz - az * qy,
            aw * qy - ax * qz + ay * qw + az * qx,
            aw * qz + ax * qy - ay * qx + az * qw,
            aw * qw - ax * qx - ay * qy - az * qz,
        )

    def twist(self, q: Sequence[float], qdot: Sequence[float]) -> Twist:
        """Return the twist for n joint positions [rad or m] and their velocities.

        From tip to root, each row adds what it does to a tip at (x, y, z) in the frame before it,
        and all three vectors turn on together:

            revolute:   v += rate (-y, x, 0)    w += rate (0, 0, 1)
            prismatic:  v += rate (0, 0, 1)
        """
        x, y, z = self._start[:3]
        vx = vy = vz = wx = wy = wz = 0.0
        for ca, sa, _, _, a, d, half, joint, half_gain, slide_gain in self._rows:
            y, z = ca * y - sa * z, sa * y + ca * z
            vy, vz = ca * vy - sa * vz, sa * vy + ca * vz
            wy, wz = ca * wy - sa * wz, sa * wy + ca * wz
            x = x + a
            z = z + d
            if half_gain:
                half = half + half_gain * q[joint]
            c = math.cos(2.0 * half)
            s = math.sin(2.0 * half)
            x, y = c * x - s * y, s * x + c * y
            vx, vy = c * vx - s * vy, s * vx + c * vy
            wx, wy = c * wx - s * wy, s * wx + c * wy
            if half_gain:
                rate = 2.0 * half_gain * qdot[joint]
                vx = vx - rate * y
                vy = vy + rate * x
                wz = wz + rate
            elif slide_gain:
                z = z + slide_gain * q[joint]
                vz = vz + slide_gain * qdot[joint]
        r00, r01, r02, r10, r11, r12, r20, r21, r22 = self._R_root
        return Twist(
            0.0 + (r00 * vx + r01 * vy + r02 * vz),
            0.0 + (r10 * vx + r11 * vy + r12 * vz),
            0.0 + (r20 * vx + r21 * vy + r22 * vz),
            0.0 + (r00 * wx + r01 * wy + r02 * wz),
            0.0 + (r10 * wx + r11 * wy + r12 * wz),
            0.0 + (r20 * wx + r21 * wy + r22 * wz),
        )


def _row(link: DHLink, joint: int) -> _Row:
    """Return a row's constants as Python floats."""
    cosines, sines = cos_sin([link.alpha, link.alpha / 2])
    cos_alpha, cos_half_alpha = cosines.tolist()
    sin_alpha, sin_half_alpha = sines.tolist()
    return _Row(
        cos_alpha,
        sin_alpha,
        cos_half_alpha,
        sin_half_alpha,
        link.a,
        link.d,
        link.offset / 2,
        joint,
        half_turn_gain=link.gain / 2 if link.joint_type == 'revolute' else 0.0,
        slide_gain=link.gain if link.joint_type == 'prismatic' else 0.0,
    )
