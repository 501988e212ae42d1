"""Tip pose of a DH chain, fast: one joint vector in scalars, many joint vectors in numpy blocks.

Both walk from the tip to the root as `walk.py` describes. The result equals the product of the
4x4 matrices (`Chain.forward`), which the tests hold it to.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
import math
import reprlib
from typing import cast

from icub_leg_fk.errors import JointVectorError
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array, canonical_quaternion
from icub_leg_fk.kinematics.walk import Step, walk_to_root
import numpy as np

BLOCK = 4096  # rows worked on at once: a dozen such arrays stay in the L2 cache

Pose = tuple[float, float, float, float, float, float, float]
Scalars = Array | float

_INF = math.inf
_TOO_LARGE = 'joint vector: found values too large to compute with, allowed: finite numbers'


class PoseSolver:
    """Position and unit quaternion of a chain's tip in its root frame.

    Args:
        links: the links with a joint, root to tip.
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        T_n_tip: (4, 4) transform from the tip to the last link's frame.
    """

    def __init__(self, links: Sequence[DHLink], T_root_0: Array, T_n_tip: Array) -> None:
        self._steps, self._start, self._end = walk_to_root(links, T_root_0, T_n_tip)
        # Plain tuples, in spite of their type, for those unpack faster.
        self._rows = cast(tuple[Step, ...], tuple(tuple(step) for step in self._steps))

    def pose(self, q: Sequence[float]) -> Pose:
        """Return x, y, z [m] and qx, qy, qz, qw (norm 1, w >= 0) for one joint vector.

        Args:
            q: n joint positions [rad or m], root to tip, as Python floats.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        if len(q) != len(self._steps):
            raise self._refusal(q)
        x, y, z, qx, qy, qz, qw = self._start
        turned = 0.0
        cos, sin = math.cos, math.sin
        try:
            for qi, (turn, offset, d, a, right, ca, sa, ch, sh) in zip(reversed(q), self._rows):
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
                if right == 0.0:
                    y, z = ca * y - sa * z, sa * y + ca * z
                    qw, qx = ch * qw - sh * qx, sh * qw + ch * qx
                    qy, qz = ch * qy - sh * qz, sh * qy + ch * qz
                elif right > 0.0:
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
            if not -_INF < x + y + z < _INF:
                raise self._refusal(q)
        except (ArithmeticError, TypeError, ValueError) as error:
            raise self._refusal(q) from error
        # Adding to or taking from 0.0 leaves no negative zero.
        if qw > 0.0:
            return x, y, z, 0.0 + qx, 0.0 + qy, 0.0 + qz, qw
        if qw < 0.0:
            return x, y, z, 0.0 - qx, 0.0 - qy, 0.0 - qz, -qw
        qx, qy, qz, qw = canonical_quaternion((qx, qy, qz, qw)).tolist()
        return x, y, z, qx, qy, qz, qw

    def poses(self, Q: Array, *, libm: bool = False) -> Array:
        """Return the poses of many joint vectors.

        Args:
            Q: (N, n) joint positions [rad or m], finite.
            libm: take sine and cosine from the C library as `pose` does, not from numpy; slower,
                and each row is then bit-identical to `pose` of it.

        Returns:
            (N, 7) rows x, y, z [m], qx, qy, qz, qw.

        Raises:
            JointVectorError: a joint position is too large to compute with.
        """
        out = np.empty((len(Q), 7))
        with np.errstate(over='ignore', invalid='ignore'):
            for start in range(0, len(Q), BLOCK):
                rows = slice(start, start + BLOCK)
                poses = self._block(Q[rows].T.copy(), libm)
                if not np.isfinite(poses).all():
                    raise JointVectorError(_TOO_LARGE)
                out[rows] = poses.T
        return out

    def _block(self, Q: Array, libm: bool) -> Array:
        """Return the (7, N) poses of the (n, N) `Q`; the formulas of `pose`, term by term."""
        values: tuple[Scalars, ...] = self._start
        x, y, z, qx, qy, qz, qw = values
        turned: Scalars = 0.0
        c: Scalars
        s: Scalars
        for qi, step in zip(Q[::-1], self._steps, strict=True):
            if step.turn is None:
                theta = qi + step.offset
                turned = turned + theta
                c, s = cos_sin_many(theta, libm)
            else:
                c, s = step.turn
                z = z + qi
            x, y = _rotate(c, s, x, y)
            qx, qy = _rotate(c, s, qx, qy)
            z = z + step.d if step.d else z
            x = x + step.a if step.a else x
            y, z = _rotate(step.cos_alpha, step.sin_alpha, y, z)
            if step.right == 0.0:
                qw, qx = _rotate(step.cos_half_alpha, step.sin_half_alpha, qw, qx)
                qy, qz = _rotate(step.cos_half_alpha, step.sin_half_alpha, qy, qz)
            elif step.right > 0.0:
                qw, qx = qw - qx, qw + qx
                qy, qz = qy - qz, qy + qz
            else:
                qw, qx = qw + qx, qx - qw
                qy, qz = qy + qz, qz - qy
        c, s = cos_sin_many(np.full(Q.shape[1], 0.5) * turned, libm)
        qw, qz = _rotate(c, s, qw, qz)
        qx, qy = c * qx + s * qy, c * qy - s * qx
        c, s, tx, ty, tz = self._end
        qx, qy = _rotate(c, s, qx, qy)
        x, y = _rotate(c, s, x, y)
        out = np.empty((7, Q.shape[1]))
        for row, value in zip(out, (x + tx, y + ty, z + tz, qx, qy, qz, qw)):
            row[:] = value
        out[3:] *= np.copysign(1.0, out[6])
        out[3:] += 0.0
        zero = out[6] == 0
        if zero.any():
            out[3:, zero] = canonical_quaternion(out[3:, zero].T).T
        return out

    def _refusal(self, q: Sequence[float]) -> JointVectorError:
        return fault_of(q, len(self._steps)) or JointVectorError(_TOO_LARGE)


def fault_of(values: Sequence[float], n: int, kind: str = 'joint vector',
             symbol: str = 'q') -> JointVectorError | None:
    """Return the error for values that are not n finite numbers; None if they are."""
    if len(values) != n:
        return JointVectorError(f'{kind}: found {len(values)} values, allowed: {n}')
    bad = [i for i, value in enumerate(values)
           if not isinstance(value, (int, float)) or not -_INF < value < _INF]
    if not bad:
        return None
    where = ', '.join(f'{symbol}[{i}] = {reprlib.repr(values[i])}' for i in bad)
    return JointVectorError(f'{kind}: found {where}, allowed: finite numbers')


def cos_sin_many(theta: Array, libm: bool = True) -> tuple[Array, Array]:
    """Return cosines and sines, from the C library unless told otherwise."""
    if not libm:
        # numpy vectorises its tangent, but not its cosine and sine, which follow the C library.
        t = np.tan(0.5 * theta)
        versed = 2.0 / (1.0 + t * t)  # 1 + cos(theta)
        return versed - 1.0, t * versed
    if _numpy_is_libm():
        return np.cos(theta), np.sin(theta)
    angles = theta.tolist()
    return (np.fromiter(map(math.cos, angles), float, len(angles)),
            np.fromiter(map(math.sin, angles), float, len(angles)))


@cache
def _numpy_is_libm() -> bool:
    """Tell whether this numpy takes cosine and sine from the C library, to the last bit."""
    angles = np.linspace(-7.0, 7.0, 5000)
    cosines, sines = np.cos(angles).tolist(), np.sin(angles).tolist()
    return (cosines, sines) == ([*map(math.cos, angles)], [*map(math.sin, angles)])


def _rotate(c: Scalars, s: Scalars, x: Scalars, y: Scalars) -> tuple[Scalars, Scalars]:
    """Turn (x, y) by the angle of cosine c and sine s, which is often a right one."""
    if isinstance(c, float):
        if s == 0.0:
            return (x, y) if c == 1.0 else (-x, -y)
        if c == 0.0:
            return (-y, x) if s == 1.0 else (y, -x)
    return c * x - s * y, s * x + c * y
