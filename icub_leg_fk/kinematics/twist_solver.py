"""Twist of a DH chain's tip, fast: the walk of `walk.py`, with velocities carried along.

From tip to root, each joint adds what it does to a tip at (x, y, z) in the frame before its link:

    revolute:   v += qdot (-y, x, 0)    w += qdot (0, 0, 1)
    prismatic:  v += qdot (0, 0, 1)

and all three vectors turn on together. The result equals `Chain.jacobian(q) @ qdot`, which the
tests hold it to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import math
from typing import Any, cast

from icub_leg_fk.errors import JointVectorError
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.kinematics.solver import BLOCK, cos_sin_many, fault_of, Scalars
from icub_leg_fk.kinematics.walk import Step, walk_to_root
import numpy as np

Twist = tuple[float, float, float, float, float, float]


class TwistSolver:
    """Linear and angular velocity of a chain's tip in the axes of its root frame.

    Args:
        links: the links with a joint, root to tip.
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        T_n_tip: (4, 4) transform from the tip to the last link's frame.
    """

    def __init__(self, links: Sequence[DHLink], T_root_0: Array, T_n_tip: Array) -> None:
        steps, self._start, self._end = walk_to_root(links, T_root_0, T_n_tip)
        self._rows = cast(tuple[Step, ...], tuple(map(tuple, steps)))

    def twist(self, q: Sequence[float], qdot: Sequence[float]) -> Twist:
        """Return vx, vy, vz [m/s], wx, wy, wz [rad/s] for one joint vector and its velocity.

        Args:
            q: n joint positions [rad or m], root to tip, as Python floats.
            qdot: n joint velocities [rad/s or m/s].

        Raises:
            JointVectorError: q or qdot has not n entries, or they are no numbers to compute with.
        """
        n = len(self._rows)
        if len(q) != n or len(qdot) != n:
            raise self._refusal(q, qdot)
        try:
            twist = cast(Twist, self._walk(reversed(q), reversed(qdot), _cos_sin))
        except (ArithmeticError, TypeError, ValueError) as error:
            raise self._refusal(q, qdot) from error
        if not all(map(math.isfinite, twist)):
            raise self._refusal(q, qdot)
        return twist

    def twists(self, Q: Array, Qdot: Array) -> Array:
        """Return the twists of many joint vectors, each bit-identical to `twist` of it.

        Args:
            Q: (N, n) joint positions [rad or m].
            Qdot: (N, n) joint velocities [rad/s or m/s].

        Returns:
            (N, 6) rows vx, vy, vz, wx, wy, wz.

        Raises:
            JointVectorError: a number is not finite, or too large to compute with.
        """
        out = np.empty((len(Q), 6))
        with np.errstate(over='ignore', invalid='ignore'):
            for start in range(0, len(Q), BLOCK):
                rows = slice(start, start + BLOCK)
                twists = self._walk(Q[rows].T[::-1].copy(), Qdot[rows].T[::-1].copy(),
                                    cos_sin_many)
                for column, values in zip(out[rows].T, twists, strict=True):
                    column[:] = values
        if not np.isfinite(out).all():
            row = int(np.argwhere(~np.isfinite(out))[0, 0])
            raise self._refusal(Q[row].tolist(), Qdot[row].tolist())
        return out

    def _walk(self, q: Iterable[Scalars], qdot: Iterable[Scalars],
              cos_sin: Callable[[Any], tuple[Scalars, Scalars]]) -> tuple[Scalars, ...]:
        """Return the twist for scalars, or for as many as the arrays hold, tip to root."""
        x: Scalars
        y: Scalars
        z: Scalars
        x, y, z = self._start[:3]
        vx: Scalars = 0.0
        vy, vz, wx, wy, wz = vx, vx, vx, vx, vx
        for qi, speed, (turn, offset, d, a, right, ca, sa, _, _) in zip(q, qdot, self._rows):
            c, s = turn or cos_sin(qi + offset)
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
            if right == 0.0:
                y, z = ca * y - sa * z, sa * y + ca * z
                vy, vz = ca * vy - sa * vz, sa * vy + ca * vz
                wy, wz = ca * wy - sa * wz, sa * wy + ca * wz
            elif right > 0.0:
                y, z, vy, vz, wy, wz = -z, y, -vz, vy, -wz, wy
            else:
                y, z, vy, vz, wy, wz = z, -y, vz, -vy, wz, -wy
        c, s, _, _, _ = self._end
        # Adding to 0.0 leaves no negative zero.
        return (0.0 + (c * vx - s * vy), 0.0 + (s * vx + c * vy), 0.0 + vz,
                0.0 + (c * wx - s * wy), 0.0 + (s * wx + c * wy), 0.0 + wz)

    def _refusal(self, q: Sequence[float], qdot: Sequence[float]) -> JointVectorError:
        n = len(self._rows)
        return fault_of(q, n) or fault_of(qdot, n, 'joint velocities', 'qdot') or JointVectorError(
            'joint vector and velocities: found values too large to compute with, allowed: finite '
            'numbers')


def _cos_sin(theta: float) -> tuple[float, float]:
    return math.cos(theta), math.sin(theta)
