"""Tip pose of a DH chain, fast: one joint vector in scalars, many joint vectors in numpy blocks.

A rotation is held as the first column (u, v) of its SU(2) matrix, with the quaternion
w = Re u, z = -Im u, y = Re v, x = -Im v. Walking from the tip to the root, link i acts on it as

    Rx(alpha):  (u, v) <- (u + k v, v + k u)      k = -i tan(alpha / 2)
    Rz(theta):  (u, v) <- (u, E v)                E = exp(i theta)

times the common factor cos(alpha / 2) exp(-i theta / 2). Common factors commute with everything
that follows, so they are collected and applied once at the end. Where |tan| > 1 the roles of u
and v are swapped and k = i cot(alpha / 2), so that nothing overflows at alpha = pi.

This equals the product of the 4x4 matrices (`Chain.forward`), which the tests hold it to.
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence
import math
from typing import NamedTuple

from icub_leg_fk.errors import JointVectorError
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import (
    Array,
    canonical_quaternion,
    cos_sin,
    matrix_to_quaternion,
)
import numpy as np

BLOCK = 4096  # rows worked on at once: a dozen such arrays stay in the L2 cache

Pose = tuple[float, float, float, float, float, float, float]


class _Step(NamedTuple):
    """What one link does on the way from tip to root; `E` is None if its joint turns."""

    E: complex | None
    offset: float
    k: complex
    swap: bool
    cos_alpha: float
    sin_alpha: float
    a: float
    d: float


def _step(link: DHLink) -> tuple[_Step, complex]:
    """Return the step of a link and the constant factor it leaves for the end."""
    half_cos, half_sin = cos_sin(link.alpha / 2)
    swap = abs(half_sin) > abs(half_cos)
    if swap:
        k, factor = complex(0.0, half_cos / half_sin), complex(0.0, -half_sin)
    elif abs(half_sin) == abs(half_cos):
        k, factor = complex(0.0, -math.copysign(1.0, half_sin * half_cos)), complex(half_cos, 0.0)
    else:
        k, factor = complex(0.0, -half_sin / half_cos), complex(half_cos, 0.0)
    E = None
    if link.is_prismatic:
        E = complex(*cos_sin(link.offset))
        factor *= cmath.rect(1.0, -link.offset / 2)
    return _Step(E, link.offset, k, swap, *cos_sin(link.alpha), link.a, link.d), factor


def _su2_column(rotation: Array) -> tuple[complex, complex]:
    x, y, z, w = matrix_to_quaternion(rotation).tolist()
    return complex(w, -z), complex(y, -x)


class PoseSolver:
    """Position and unit quaternion of a chain's tip in its root frame.

    Args:
        links: the links with a joint, root to tip.
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        T_n_tip: (4, 4) transform from the tip to the last link's frame.
    """

    def __init__(self, links: Sequence[DHLink], T_root_0: Array, T_n_tip: Array) -> None:
        steps, factors = zip(*map(_step, reversed(links)), strict=True)
        self._steps: tuple[_Step, ...] = steps
        self._tip = (*T_n_tip[:3, 3].tolist(), *_su2_column(T_n_tip[:3, :3]))
        self._root = tuple(map(tuple, T_root_0[:3].tolist()))
        u, v = _su2_column(T_root_0[:3, :3])
        factor = math.prod(factors, start=complex(1.0))
        self._su2_root = (factor * u, -factor * v.conjugate(), factor * v, factor * u.conjugate())

    def pose(self, q: Sequence[float]) -> Pose:
        """Return x, y, z [m] and qx, qy, qz, qw (norm 1, w >= 0) for one joint vector.

        Args:
            q: n joint positions [rad or m], root to tip, as Python floats.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        if len(q) != len(self._steps):
            raise self._refusal(q)
        x, y, z, u, v = self._tip
        turned = 0.0
        rect = cmath.rect
        try:
            for qi, (E, offset, k, swap, ca, sa, a, d) in zip(reversed(q), self._steps):
                if swap:
                    u, v = v, u
                u, v = u + k * v, v + k * u
                y, z = ca * y - sa * z, sa * y + ca * z
                if E is None:
                    theta = qi + offset
                    turned += theta
                    E = rect(1.0, theta)
                else:
                    z += qi
                v *= E
                c = E.real
                s = E.imag
                x += a
                x, y = c * x - s * y, s * x + c * y
                z += d
        except (ValueError, TypeError) as error:
            raise self._refusal(q) from error
        (r00, r01, r02, tx), (r10, r11, r12, ty), (r20, r21, r22, tz) = self._root
        m00, m01, m10, m11 = self._su2_root
        phase = rect(1.0, -0.5 * turned)
        u, v = (m00 * u + m01 * v) * phase, (m10 * u + m11 * v) * phase
        x, y, z = (r00 * x + r01 * y + r02 * z + tx, r10 * x + r11 * y + r12 * z + ty,
                   r20 * x + r21 * y + r22 * z + tz)
        w = u.real
        if not -math.inf < x + y + z + w < math.inf:
            raise self._refusal(q)
        # Adding 0.0 turns a negative zero into zero.
        if w > 0.0:
            return (x + 0.0, y + 0.0, z + 0.0,
                    0.0 - v.imag, v.real + 0.0, 0.0 - u.imag, w)
        if w < 0.0:
            return x + 0.0, y + 0.0, z + 0.0, v.imag + 0.0, 0.0 - v.real, u.imag + 0.0, -w
        qx, qy, qz, w = canonical_quaternion((-v.imag, v.real, -u.imag, w)).tolist()
        return x + 0.0, y + 0.0, z + 0.0, qx, qy, qz, w

    def poses(self, Q: Array, *, libm: bool = False) -> Array:
        """Return the poses of many joint vectors.

        Args:
            Q: (N, n) joint positions [rad or m], finite.
            libm: take sine and cosine from the C library as `pose` does, not from numpy; slower,
                and each row is then bit-identical to `pose` of it.

        Returns:
            (N, 7) rows x, y, z [m], qx, qy, qz, qw.
        """
        out = np.empty((len(Q), 7))
        for start in range(0, len(Q), BLOCK):
            rows = slice(start, start + BLOCK)
            self._block(np.ascontiguousarray(Q[rows].T), out[rows].T, libm)
        return out

    def _block(self, Q: Array, out: Array, libm: bool) -> None:
        """Fill the (7, N) `out` from the (n, N) `Q`; the formulas of `pose`, term by term."""
        x, y, z, u, v = self._tip
        ur, ui, vr, vi = u.real, u.imag, v.real, v.imag
        turned = 0.0
        for qi, step in zip(Q[::-1], self._steps, strict=True):
            if step.swap:
                ur, ui, vr, vi = vr, vi, ur, ui
            ur, ui, vr, vi = _mix(step.k.imag, ur, ui, vr, vi)
            y, z = _rotate(step.cos_alpha, step.sin_alpha, y, z)
            if step.E is None:
                theta = qi + step.offset
                turned = turned + theta
                c, s = _cos_sin_many(theta, libm)
            else:
                c, s = step.E.real, step.E.imag
                z = z + qi
            vr, vi = vr * c - vi * s, vr * s + vi * c
            x = x + step.a if step.a else x
            x, y = c * x - s * y, s * x + c * y
            z = z + step.d if step.d else z
        c, s = _cos_sin_many(np.broadcast_to(-0.5 * turned, Q.shape[1:]), libm)
        m00, m01, m10, m11 = self._su2_root
        ur, ui, vr, vi = (*_combine(m00, ur, ui, m01, vr, vi), *_combine(m10, ur, ui, m11, vr, vi))
        for row, (rx, ry, rz, t) in zip(out, self._root):
            row[:] = rx * x + ry * y + rz * z + t
        out[3] = -(vr * s + vi * c)
        out[4] = vr * c - vi * s
        out[5] = -(ur * s + ui * c)
        out[6] = ur * c - ui * s
        flip = out[6] < 0
        np.negative(out[3:], out=out[3:], where=flip)
        out += 0.0
        zero = out[6] == 0
        if zero.any():
            out[3:, zero] = canonical_quaternion(out[3:, zero].T).T

    def _refusal(self, q: Sequence[float]) -> JointVectorError:
        n = len(self._steps)
        if len(q) != n:
            return JointVectorError(f'joint vector: found {len(q)} values, allowed: {n}')
        bad = [i for i, value in enumerate(q)
               if not isinstance(value, (int, float)) or not math.isfinite(value)]
        where = ', '.join(f'q[{i}] = {q[i]!r}' for i in bad) or 'values too large to compute with'
        return JointVectorError(f'joint vector: found {where}, allowed: finite numbers')


Scalars = Array | float


def _cos_sin_many(theta: Array, libm: bool) -> tuple[Array, Array]:
    if not libm:
        return np.cos(theta), np.sin(theta)
    angles = theta.tolist()
    return (np.fromiter(map(math.cos, angles), float, len(angles)),
            np.fromiter(map(math.sin, angles), float, len(angles)))


def _mix(k: float, ur: Scalars, ui: Scalars, vr: Scalars, vi: Scalars) -> tuple[Scalars, ...]:
    """(u + i k v, v + i k u), without the multiplications that change nothing."""
    if k == 0.0:
        return ur, ui, vr, vi
    if k == 1.0:
        return ur - vi, ui + vr, vr - ui, vi + ur
    if k == -1.0:
        return ur + vi, ui - vr, vr + ui, vi - ur
    return ur - k * vi, ui + k * vr, vr - k * ui, vi + k * ur


def _rotate(c: float, s: float, y: Scalars, z: Scalars) -> tuple[Scalars, Scalars]:
    """Rotate (y, z) by the angle of cosine c and sine s, which is often a right one."""
    if s == 0.0:
        return (y, z) if c == 1.0 else (-y, -z)
    if c == 0.0:
        return (-z, y) if s == 1.0 else (z, -y)
    return c * y - s * z, s * y + c * z


def _combine(m: complex, ur: Scalars, ui: Scalars, n: complex, vr: Scalars,
             vi: Scalars) -> tuple[Scalars, Scalars]:
    """Real and imaginary part of m u + n v, in the order in which complex numbers do it."""
    return ((m.real * ur - m.imag * ui) + (n.real * vr - n.imag * vi),
            (m.real * ui + m.imag * ur) + (n.real * vi + n.imag * vr))
