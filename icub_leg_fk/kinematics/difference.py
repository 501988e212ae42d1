"""How far one chain is from another: directly, after a turn of axes, and after the best fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import permutations, product
import math
from typing import NamedTuple

from icub_leg_fk.kinematics.chain import Chain
from icub_leg_fk.kinematics.rotation import (
    angle_between,
    Array,
    matrix_to_quaternion,
    nearest_rotation,
    turns_about,
)
import numpy as np

Forward = Callable[[Mapping[str, Array]], Array]
"""Returns (N, 4, 4) transforms for (N,) positions by joint, as `Chain.forward` does."""

_SEED = 2955
_ARM = 0.3  # m; weighs angles against lengths in the fit
_HALF_TURN = 2.8  # rad; beyond it the axis of a turn may come out the other way round
_MOST_STEPS = 20


class Difference(NamedTuple):
    """How far tips are from others, over some postures.

    Attributes:
        mm: largest distance [mm].
        mean_mm: mean distance [mm].
        deg: largest angle [deg].
        mean_deg: mean angle [deg].
    """

    mm: float
    mean_mm: float
    deg: float
    mean_deg: float


def postures(
    chain: Chain, count: int, reach: float = math.pi, *, whole_range: bool = True
) -> dict[str, Array]:
    """Return seeded random joint positions, the same at every call.

    Args:
        chain: the chain whose joints are moved.
        count: number of postures.
        reach: where a joint without a range goes to on either side [rad or m].
        whole_range: whether a joint with a range goes through all of it and no farther; else it
            goes as far as one without.

    Returns:
        (count,) positions by joint [rad or m].
    """
    lower, upper = np.full(chain.n, -reach), np.full(chain.n, reach)
    if whole_range:
        lower = np.where(np.isfinite(chain.lower), chain.lower, lower)
        upper = np.where(
            np.isfinite(chain.upper), chain.upper, np.maximum(upper, lower)
        )
        lower = np.minimum(lower, upper)
    Q = np.random.default_rng(_SEED).uniform(lower, upper, (count, chain.n))
    return dict(zip(chain.joint_names, Q.T, strict=True))


def difference(
    one: Forward, other: Forward, positions: Mapping[str, Array]
) -> Difference:
    """Return how far two chains are apart.

    Args:
        one: `forward` of the one, such as `Chain.forward`.
        other: `forward` of the other.
        positions: (N,) positions by joint [rad or m].
    """
    return distance(one(positions), other(positions))


def distance(one: Array, other: Array) -> Difference:
    """Return how far (N, 4, 4) transforms are from others."""
    mm = 1000 * np.linalg.norm(one[:, :3, 3] - other[:, :3, 3], axis=1)
    deg = np.degrees(angle_between(one[:, :3, :3], other[:, :3, :3]))
    return Difference(
        float(mm.max()), float(mm.mean()), float(deg.max()), float(deg.mean())
    )


def turn_of_axes(ours: Array, theirs: Array) -> Array:
    """Return the (4, 4) turn by right angles that brings our (N, 4, 4) axes nearest to theirs."""
    mean = _mean_rotation(ours, theirs)
    turns = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = np.eye(3)[list(order)] * signs
        if np.linalg.det(turn) > 0:
            turns.append(turn)
    T = np.eye(4)
    T[:3, :3] = max(turns, key=lambda turn: float((turn * mean).sum()))
    return T


def turn_in_words(R: Array) -> str:
    """Return a (3, 3) rotation as `180 deg about x + z`; nothing if it is less than half a degree.

    The axis is rounded to a tenth.
    """
    *axis, w = matrix_to_quaternion(R).tolist()
    angle = round(2 * math.degrees(math.acos(min(w, 1.0))))
    if angle == 0:
        return ''
    longest = max(axis, key=abs)
    if angle < 180 and longest < 0:
        longest = -longest  # a half turn about an axis is one about its opposite
    words = []
    for value, name in zip(axis, 'xyz', strict=True):
        share = round(value / longest, 1)
        if share:
            factor = '' if abs(share) == 1.0 else f'{abs(share):g} '
            words.append(f'{"-" if share < 0 else "+"} {factor}{name}')
    return f'{angle} deg about {" ".join(words).removeprefix("+ ")}'


def fit(ours: Array, theirs: Array) -> tuple[Array, Array]:
    """Return the constants X, Y with which X ours Y is nearest to theirs.

    They start in closed form: from R_theirs,i R_theirs,j^T = X (R_ours,i R_ours,j^T) X^T the
    rotation of X is that between the rotation vectors (Kabsch), then Y's is a mean, and the
    translations are linear. From there Gauss-Newton; directions that a joint can make up for stay
    as they are.

    Args:
        ours: (N, 4, 4) transforms of at least three joints in many postures.
        theirs: (N, 4, 4) transforms to fit them to.

    Returns:
        (4, 4) transforms X and Y.
    """
    X, Y = _start_of_fit(ours, theirs)
    best, least = (X, Y), math.inf
    for _ in range(_MOST_STEPS):
        T = X @ ours @ Y
        error = _error(T, theirs)
        size = float((error**2).sum())
        if size >= least:
            break
        best, least = (X, Y), size
        step = _least_squares(_slopes(T, theirs), -error.ravel())
        X, Y = _small(step[:6]) @ X, Y @ _small(step[6:])
    return best


def _start_of_fit(ours: Array, theirs: Array) -> tuple[Array, Array]:
    X, Y = np.eye(4), np.eye(4)
    own, other = _turns_between(ours), _turns_between(theirs)
    angles = np.linalg.norm(own, axis=1), np.linalg.norm(other, axis=1)
    is_clear = np.maximum(*angles) < _HALF_TURN
    X[:3, :3] = _kabsch(own[is_clear], other[is_clear])
    Y[:3, :3] = nearest_rotation(_mean_rotation(X @ ours, theirs))
    # p_theirs = R_X (p_ours + R_ours t_Y) + t_X
    R_X = X[:3, :3]
    columns = np.concatenate(
        (np.broadcast_to(np.eye(3), (len(ours), 3, 3)), R_X @ ours[:, :3, :3]), axis=2
    )
    rest = theirs[:, :3, 3] - ours[:, :3, 3] @ R_X.T
    t = _least_squares(columns.reshape(-1, 6), rest.ravel())
    X[:3, 3], Y[:3, 3] = t[:3], t[3:]
    return X, Y


def _turns_between(T: Array) -> Array:
    """Return the (N - 1, 3) rotation vectors from each posture to the next, in the root."""
    R = T[1:, :3, :3] @ np.swapaxes(T[:-1, :3, :3], 1, 2)
    quaternions = matrix_to_quaternion(R)
    vectors, w = quaternions[:, :3], quaternions[:, 3]
    sines = np.linalg.norm(vectors, axis=1)
    angles = 2 * np.arctan2(sines, w)
    return np.asarray(vectors * (angles / np.maximum(sines, 1e-12))[:, None])


def _kabsch(ours: Array, theirs: Array) -> Array:
    """Return the rotation that brings (N, 3) vectors nearest to others."""
    U, _, Vt = np.linalg.svd(theirs.T @ ours)
    handed = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(U @ Vt)))])
    return np.asarray(U @ handed @ Vt)


def _mean_rotation(ours: Array, theirs: Array) -> Array:
    return np.asarray(
        (np.swapaxes(ours[:, :3, :3], 1, 2) @ theirs[:, :3, :3]).mean(axis=0)
    )


def _least_squares(A: Array, b: Array) -> Array:
    """Return the smallest x with which A x is nearest to b."""
    return np.asarray(np.linalg.pinv(A.T @ A, rcond=1e-12, hermitian=True) @ (A.T @ b))


def _slopes(T: Array, theirs: Array) -> Array:
    """Return the (6 N, 12) derivatives of the error by a small step of X and of Y."""
    size = 1e-6
    error = _error(T, theirs)
    columns = []
    for k in range(12):
        step = np.zeros(12)
        step[k] = size
        moved = _small(step[:6]) @ T @ _small(step[6:])
        columns.append((_error(moved, theirs) - error).ravel() / size)
    return np.array(columns).T


def _error(T: Array, theirs: Array) -> Array:
    """Return the (N, 6) differences: positions [m], and small angles times an arm's length."""
    turn = np.cross(T[:, :3, :3], theirs[:, :3, :3], axis=1).sum(axis=2) / 2
    return np.hstack((T[:, :3, 3] - theirs[:, :3, 3], _ARM * turn))


def _small(step: Array) -> Array:
    """Return the transform of a translation and a rotation vector, (6,)."""
    angle = float(np.linalg.norm(step[3:]))
    T = np.eye(4)
    T[:3, 3] = step[:3]
    if angle:
        T[:3, :3] = turns_about(step[3:] / angle, angle)
    return T
