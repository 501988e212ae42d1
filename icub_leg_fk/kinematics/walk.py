"""The walk from a chain's tip to its root, prepared once so that each joint is one cheap step.

Position p and quaternion q of the tip are carried to the root, where each rotation about x or z
turns planes:

    Rx(alpha):  (py, pz) by alpha;  (qw, qx) and (qy, qz) by alpha / 2
    Rz(theta):  (px, py) by theta;  (qx, qy) by theta,  then all of q by the factor below

The factor multiplies qw - i qz and qx + i qy by exp(-i theta / 2). It commutes with all that
follows, so the angles are summed and the factor is applied once, at the end. So does a number:
where alpha is a right angle, the common one is cos(45 deg), and is multiplied into the start.

The walk starts behind Rx and Tx of the last link and ends with T_root_0 taken apart into
Rz(phi) Rx(alpha) Rz(beta), of which Rz(beta) joins the first joint's offset. So each joint is one
step: Rz and Tz of its own link, then Tx and Rx of the link before it, or the root's Rx.
"""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import NamedTuple

from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array, cos_sin, matrix_to_quaternion


class Step(NamedTuple):
    """A joint's turn or slide, then the length a and the twist alpha before it."""

    turn: tuple[float, float] | None  # cosine and sine of a prismatic joint's constant angle
    offset: float
    d: float
    a: float
    right: float  # sine of alpha if that is a right angle, else 0
    cos_alpha: float
    sin_alpha: float
    cos_half_alpha: float
    sin_half_alpha: float


class Walk(NamedTuple):
    """The steps, the (px, py, pz, qx, qy, qz, qw) they start from, and what ends them."""

    steps: tuple[Step, ...]
    start: tuple[float, float, float, float, float, float, float]
    end: tuple[float, float, float, float, float]  # cosine and sine of phi, translation


def walk_to_root(links: Sequence[DHLink], T_root_0: Array, T_n_tip: Array) -> Walk:
    """Prepare the walk.

    Args:
        links: the links with a joint, root to tip.
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        T_n_tip: (4, 4) transform from the tip to the last link's frame.
    """
    phi, alpha, beta = _zxz_angles(T_root_0[:3, :3])
    factor = complex(*cos_sin(-phi / 2))
    before = DHLink(a=0.0, d=0.0, alpha=alpha)
    steps: list[Step] = []
    for link in links:
        offset = link.offset if steps else link.offset + beta
        turn = None
        if link.is_prismatic:
            turn = cos_sin(offset)
            factor *= complex(*cos_sin(-offset / 2))
        cos_alpha, sin_alpha = cos_sin(before.alpha)
        right = sin_alpha if cos_alpha == 0.0 else 0.0
        if right:
            factor *= math.sqrt(0.5)
        steps.append(Step(turn, offset, link.d, before.a, right, cos_alpha, sin_alpha,
                          *cos_sin(before.alpha / 2)))
        before = link
    T = DHLink(a=before.a, d=0.0, alpha=before.alpha).transform() @ T_n_tip
    qx, qy, qz, qw = matrix_to_quaternion(T[:3, :3]).tolist()
    wz, xy = factor * complex(qw, -qz), factor * complex(qx, qy)
    x, y, z = T[:3, 3].tolist()
    tx, ty, tz = (T_root_0[:3, 3] + 0.0).tolist()
    return Walk(tuple(reversed(steps)), (x, y, z, xy.real, xy.imag, -wz.imag, wz.real),
                (*cos_sin(phi), tx, ty, tz))


def _zxz_angles(R: Array) -> tuple[float, float, float]:
    """Return phi, alpha, beta with R = Rz(phi) Rx(alpha) Rz(beta); phi is 0 where it is free."""
    sin_alpha = math.hypot(R[0, 2], R[1, 2])
    phi = math.atan2(R[0, 2], -R[1, 2]) if sin_alpha else 0.0
    c, s = cos_sin(phi)
    beta = math.atan2(-c * R[0, 1] - s * R[1, 1], c * R[0, 0] + s * R[1, 0])
    return phi, math.atan2(sin_alpha, R[2, 2]), beta
