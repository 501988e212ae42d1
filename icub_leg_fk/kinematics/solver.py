"""Tip pose and twist of a DH chain, fast: one joint vector in scalars, many in numpy blocks.

Position p and quaternion q of the tip are carried from the tip to the root, where each rotation
about x or z turns planes:

    Rx(alpha):  (py, pz) by alpha;  (qw, qx) and (qy, qz) by alpha / 2
    Rz(theta):  (px, py) by theta;  (qx, qy) by theta,  then all of q by the factor below

The factor multiplies qw - i qz and qx + i qy by exp(-i theta / 2). It commutes with all that
follows, so the angles are summed and the factor is applied once, at the end. So does a number:
where alpha is a right angle, the common one is cos(45 deg), and is multiplied into the start.

It starts behind Rx and Tx of the last link and ends with T_root_0 taken apart into
Rz(phi) Rx(alpha) Rz(beta), of which Rz(beta) joins the first joint's offset. So each row is one
step: Rz and Tz of its own link, then Tx and Rx of the link before it, or the root's Rx.

The results equal the product of the 4x4 matrices, `Chain.forward`, and the Jacobian times the
joint velocities, which the tests hold them to.
"""

from collections.abc import Sequence
import math
import reprlib
from typing import Any, cast, NamedTuple

from icub_leg_fk.errors import JointVectorError
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import (
    Array,
    cos_sin,
    matrix_to_quaternion,
    reference_quaternion,
)
import numpy as np

BLOCK = 4096  # rows worked on at once: a dozen such arrays stay in the L2 cache

Pose = tuple[float, float, float, float, float, float, float]
Twist = tuple[float, float, float, float, float, float]
Scalars = Array | float

_INF = math.inf
_TOO_LARGE = 'values are too large to compute with; finite numbers are allowed'


class _Step(NamedTuple):
    """A row's turn or slide, then the length a and the twist alpha of the row before it."""

    turn: tuple[float, float] | None  # cosine and sine of a constant angle, if no joint turns
    offset: float
    d: float
    a: float
    right_angle: float  # sine of alpha if that is a right angle, else 0
    cos_alpha: float
    sin_alpha: float
    cos_half_alpha: float
    sin_half_alpha: float


class Solver:
    """Position, unit quaternion and velocity of a chain's tip in its root frame.

    Args:
        links: the rows, root to tip.
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        T_n_tip: (4, 4) transform from the tip to the last row's frame.
        R_zero: (3, 3) orientation of the tip at q = 0, which decides the quaternions' sign.
    """

    def __init__(self, links: Sequence[DHLink], T_root_0: Array, T_n_tip: Array,
                 R_zero: Array) -> None:
        self._prepare(links, T_root_0, T_n_tip)
        self._reference = tuple(reference_quaternion(matrix_to_quaternion(R_zero)).tolist())
        # Which joint moves a row and in which direction, tip to root; None for a fixed row.
        self._inputs: list[tuple[int, int] | None] = []
        self._n = 0
        for link in links:
            self._inputs.insert(0, None if link.is_fixed else (self._n, link.sign))
            self._n += not link.is_fixed
        self._is_plain = all(given and given[1] == 1 for given in self._inputs)

    def _prepare(self, links: Sequence[DHLink], T_root_0: Array, T_n_tip: Array) -> None:
        phi, alpha, beta = _zxz_angles(T_root_0[:3, :3])
        factor = complex(*cos_sin(-phi / 2))
        before = DHLink(a=0.0, d=0.0, alpha=alpha)
        steps: list[_Step] = []
        for link in links:
            offset = link.offset if steps else link.offset + beta
            turn = None
            if link.is_prismatic or link.is_fixed:
                turn = cos_sin(offset)
                factor *= complex(*cos_sin(-offset / 2))
            cos_alpha, sin_alpha = cos_sin(before.alpha)
            right_angle = sin_alpha if cos_alpha == 0.0 else 0.0
            if right_angle:
                factor *= math.sqrt(0.5)
            steps.append(_Step(turn, offset, link.d, before.a, right_angle, cos_alpha, sin_alpha,
                               *cos_sin(before.alpha / 2)))
            before = link
        T = DHLink(a=before.a, d=0.0, alpha=before.alpha).transform() @ T_n_tip
        qx, qy, qz, qw = matrix_to_quaternion(T[:3, :3]).tolist()
        wz, xy = factor * complex(qw, -qz), factor * complex(qx, qy)
        x, y, z = T[:3, 3].tolist()
        tx, ty, tz = (T_root_0[:3, 3] + 0.0).tolist()
        # Plain tuples, in spite of their type, for those unpack faster.
        self._steps = cast(tuple[_Step, ...], tuple(tuple(step) for step in reversed(steps)))
        self._start = (x, y, z, xy.real, xy.imag, -wz.imag, wz.real)
        self._end = (*cos_sin(phi), tx, ty, tz)

    def pose(self, q: Sequence[float]) -> Pose | None:
        """Return x, y, z [m] and qx, qy, qz, qw for one joint vector.

        Args:
            q: n joint positions [rad or m], root to tip, as Python floats or integers. For other
                numbers, which would be computed with in their own precision, the answer is None.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        if len(q) != self._n:
            raise self._refusal(q)
        x, y, z, qx, qy, qz, qw = self._start
        turned = 0.0
        cos, sin = math.cos, math.sin
        try:
            rows = reversed(q) if self._is_plain else self._by_row(q)
            for qi, (turn, offset, d, a, right_angle, ca, sa, ch, sh) in zip(rows, self._steps):
                if turn is None:
                    theta = qi + offset
                    turned += theta
                    c = cos(theta)
                    s = sin(theta)
                else:
                    c, s = turn
                    z += qi
                x, y = c * x - s * y, s * x + c * y
                qx, qy = c * qx - s * qy, s * qx + c * qy
                z += d
                x += a
                if right_angle == 0.0:
                    y, z = ca * y - sa * z, sa * y + ca * z
                    qw, qx = ch * qw - sh * qx, sh * qw + ch * qx
                    qy, qz = ch * qy - sh * qz, sh * qy + ch * qz
                elif right_angle > 0.0:
                    y, z = -z, y
                    qw, qx = qw - qx, qw + qx
                    qy, qz = qy - qz, qy + qz
                else:
                    y, z = z, -y
                    qw, qx = qw + qx, qx - qw
                    qy, qz = qy + qz, qz - qy
            c = cos(0.5 * turned)
            s = sin(0.5 * turned)
            qw, qz = c * qw - s * qz, s * qw + c * qz
            qx, qy = c * qx + s * qy, c * qy - s * qx
            c, s, tx, ty, tz = self._end
            qx, qy = c * qx - s * qy, s * qx + c * qy
            x, y, z = c * x - s * y + tx, s * x + c * y + ty, z + tz
            size = x + y + z
            if not -_INF < size < _INF:
                raise self._refusal(q)
        except (ArithmeticError, TypeError, ValueError) as error:
            raise self._refusal(q) from error
        if type(size) is not float or type(turned) is not float:
            return None
        rx, ry, rz, rw = self._reference
        # Adding to or taking from 0.0 leaves no negative zero.
        if rx * qx + ry * qy + rz * qz + rw * qw >= 0.0:
            return x, y, z, 0.0 + qx, 0.0 + qy, 0.0 + qz, 0.0 + qw
        return x, y, z, 0.0 - qx, 0.0 - qy, 0.0 - qz, 0.0 - qw

    def poses(self, Q: Array) -> Array:
        """Return the poses of many joint vectors.

        Args:
            Q: (N, n) joint positions [rad or m], finite.

        Returns:
            (N, 7) rows x, y, z [m], qx, qy, qz, qw.

        Raises:
            JointVectorError: a joint position is too large to compute with.
        """
        out = np.empty((len(Q), 7))
        with np.errstate(over='ignore', invalid='ignore'):
            for start in range(0, len(Q), BLOCK):
                rows = slice(start, start + BLOCK)
                poses = self._block(Q[rows].T.copy())
                if not np.isfinite(poses).all():
                    raise JointVectorError(f'joint vector: {_TOO_LARGE}')
                out[rows] = poses.T
        return out

    def _block(self, Q: Array) -> Array:
        """Return the (7, N) poses of the (n, N) `Q`; the formulas of `pose`, term by term."""
        values: tuple[Scalars, ...] = self._start
        x, y, z, qx, qy, qz, qw = values
        turned: Scalars = 0.0
        c: Scalars
        s: Scalars
        for qi, step in zip(self._by_row(Q), self._steps, strict=True):
            turn, offset, d, a, right_angle, ca, sa, ch, sh = step
            if turn is None:
                theta = qi + offset
                turned = turned + theta
                c, s = _cos_sin_many(theta)
            else:
                c, s = turn
                z = z + qi
            x, y = _rotate(c, s, x, y)
            qx, qy = _rotate(c, s, qx, qy)
            z = z + d if d else z
            x = x + a if a else x
            y, z = _rotate(ca, sa, y, z)
            if right_angle == 0.0:
                qw, qx = _rotate(ch, sh, qw, qx)
                qy, qz = _rotate(ch, sh, qy, qz)
            elif right_angle > 0.0:
                qw, qx = qw - qx, qw + qx
                qy, qz = qy - qz, qy + qz
            else:
                qw, qx = qw + qx, qx - qw
                qy, qz = qy + qz, qz - qy
        c, s = _cos_sin_many(np.full(Q.shape[1], 0.5) * turned)
        qw, qz = _rotate(c, s, qw, qz)
        qx, qy = c * qx + s * qy, c * qy - s * qx
        c, s, tx, ty, tz = self._end
        qx, qy = _rotate(c, s, qx, qy)
        x, y = _rotate(c, s, x, y)
        out = np.empty((7, Q.shape[1]))
        for row, value in zip(out, (x + tx, y + ty, z + tz, qx, qy, qz, qw)):
            row[:] = value
        out[3:, np.asarray(self._reference) @ out[3:] < 0.0] *= -1.0
        out[3:] += 0.0
        return out

    def twist(self, q: Sequence[float], qdot: Sequence[float]) -> Twist | None:
        """Return vx, vy, vz [m/s], wx, wy, wz [rad/s] for one joint vector and its velocity.

        From tip to root, each joint adds what it does to a tip at (x, y, z) in the frame before
        its link, and all three vectors turn on together:

            revolute:   v += qdot (-y, x, 0)    w += qdot (0, 0, 1)
            prismatic:  v += qdot (0, 0, 1)

        Args:
            q: n joint positions [rad or m], root to tip, as Python floats or integers; None is
                the answer for other numbers, as in `pose`.
            qdot: n joint velocities [rad/s or m/s]; likewise.

        Raises:
            JointVectorError: q or qdot has not n entries, or they are no numbers to compute with.
        """
        if len(q) != self._n or len(qdot) != self._n:
            raise self._refusal(q, qdot)
        x, y, z = self._start[:3]
        vx = vy = vz = wx = wy = wz = 0.0
        cos, sin = math.cos, math.sin
        try:
            for qi, speed, (turn, offset, d, a, right_angle, ca, sa, _, _) in zip(
                    self._by_row(q), self._by_row(qdot), self._steps):
                if turn is None:
                    c, s = cos(qi + offset), sin(qi + offset)
                else:
                    c, s = turn
                x, y = c * x - s * y, s * x + c * y
                vx, vy = c * vx - s * vy, s * vx + c * vy
                wx, wy = c * wx - s * wy, s * wx + c * wy
                if turn is None:
                    vx, vy = vx - speed * y, vy + speed * x
                    wz = wz + speed
                else:
                    z = z + qi
                    vz = vz + speed
                x, z = x + a, z + d
                if right_angle == 0.0:
                    y, z = ca * y - sa * z, sa * y + ca * z
                    vy, vz = ca * vy - sa * vz, sa * vy + ca * vz
                    wy, wz = ca * wy - sa * wz, sa * wy + ca * wz
                elif right_angle > 0.0:
                    y, z, vy, vz, wy, wz = -z, y, -vz, vy, -wz, wy
                else:
                    y, z, vy, vz, wy, wz = z, -y, vz, -vy, wz, -wy
            c, s, _, _, _ = self._end
            # Adding to 0.0 leaves no negative zero.
            twist = (0.0 + (c * vx - s * vy), 0.0 + (s * vx + c * vy), 0.0 + vz,
                     0.0 + (c * wx - s * wy), 0.0 + (s * wx + c * wy), 0.0 + wz)
            if not all(map(math.isfinite, twist)):
                raise self._refusal(q, qdot)
        except (ArithmeticError, TypeError, ValueError) as error:
            raise self._refusal(q, qdot) from error
        if {*map(type, q), *map(type, qdot)} != {float}:
            return None
        return twist

    def _by_row(self, q: Any) -> Any:
        """Return what moves each row, tip to root: the joint's own number, its negative, or 0."""
        if self._is_plain:
            return q[::-1]
        return [0.0 if given is None else q[given[0]] if given[1] == 1 else -q[given[0]]
                for given in self._inputs]

    def _refusal(self, q: Sequence[float], qdot: Sequence[float] | None = None
                 ) -> JointVectorError:
        fault = _fault_of(q, self._n, 'joint vector', 'q')
        if not fault and qdot is not None:
            fault = _fault_of(qdot, self._n, 'joint velocities', 'qdot')
        what = 'joint vector' if qdot is None else 'joint positions and velocities'
        return JointVectorError(fault or f'{what}: {_TOO_LARGE}')


def _fault_of(values: Sequence[float], n: int, kind: str, symbol: str) -> str:
    """Say what keeps values from being n finite numbers; nothing if they are."""
    if len(values) != n:
        return f'{kind} has {len(values)} values; {n} are allowed, one per joint'
    bad = [f'{symbol}[{i}] is {reprlib.repr(value)}' for i, value in enumerate(values)
           if not isinstance(value, (int, float, np.integer, np.floating))
           or not -_INF < value < _INF]
    return f'{kind}: {", ".join(bad)}; finite numbers are allowed' if bad else ''


def _zxz_angles(R: Array) -> tuple[float, float, float]:
    """Return phi, alpha, beta with R = Rz(phi) Rx(alpha) Rz(beta); phi is 0 where it is free."""
    sin_alpha = math.hypot(R[0, 2], R[1, 2])
    phi = math.atan2(R[0, 2], -R[1, 2]) if sin_alpha else 0.0
    c, s = cos_sin(phi)
    beta = math.atan2(-c * R[0, 1] - s * R[1, 1], c * R[0, 0] + s * R[1, 0])
    return phi, math.atan2(sin_alpha, R[2, 2]), beta


def _cos_sin_many(theta: Array) -> tuple[Array, Array]:
    """Return cosines and sines; numpy vectorises its tangent, but not its cosine and sine."""
    t = np.tan(0.5 * theta)
    versed = 2.0 / (1.0 + t * t)  # 1 + cos(theta)
    return versed - 1.0, t * versed


def _rotate(c: Scalars, s: Scalars, x: Scalars, y: Scalars) -> tuple[Scalars, Scalars]:
    """Turn (x, y) by the angle of cosine c and sine s, which is often a right one."""
    if isinstance(c, float):
        if s == 0.0:
            return (x, y) if c == 1.0 else (-x, -y)
        if c == 0.0:
            return (-y, x) if s == 1.0 else (y, -x)
    return c * x - s * y, s * x + c * y
