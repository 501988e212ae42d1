"""Rotations: unit quaternions in ROS order (x, y, z, w), and exact right angles."""

import math
import reprlib

from icub_leg_fk.errors import LegFKError
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_ROUNDING = 2e-15  # what cosine and sine may be off at right angles within two turns
_EXACT = 1e-15  # below it an entry of a rotation matrix is 0 but for rounding
_ROUNDED = 1e-5  # what the rows of a matrix with five decimals may be too long or short, squared
_LIKELY = 1e-6  # components of a unit quaternion that differ by less may be equal but for rounding


def cos_sin(angle: ArrayLike) -> tuple[Array, Array]:
    """Return cosine and sine of (...) angles [rad], exact at right angles up to two turns.

    DH tables are full of right angles; cos(pi/2) must be 0 there and not 6e-17.
    """
    theta = np.asarray(angle, dtype=float)
    cosine, sine = np.cos(theta), np.sin(theta)
    return _without_rounding(cosine), _without_rounding(sine)


def _without_rounding(values: Array) -> Array:
    return np.where(np.abs(values) < _ROUNDING, 0.0, values)[()]  # a float for a float


def matrix_to_quaternion(rotation: ArrayLike) -> Array:
    """Convert rotation matrices to unit quaternions.

    Of the four equivalent formulas the one with the largest divisor is used, so the result is
    accurate at every rotation, half-turns included (Shepperd, J. Guidance and Control 1, 1978).

    Args:
        rotation: (..., 3, 3) rotation matrices.

    Returns:
        (..., 4) quaternions x, y, z, w with norm 1 and w >= 0, and no negative zeros.
    """
    R = np.asarray(rotation, dtype=float)
    r00, r11, r22 = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    yz = R[..., 2, 1] + R[..., 1, 2]
    xz = R[..., 0, 2] + R[..., 2, 0]
    xy = R[..., 1, 0] + R[..., 0, 1]
    wx = R[..., 2, 1] - R[..., 1, 2]
    wy = R[..., 0, 2] - R[..., 2, 0]
    wz = R[..., 1, 0] - R[..., 0, 1]
    # 4 q q^T: row k is the quaternion times four times its own component k.
    outer = np.stack(
        [
            np.stack([1 + r00 - r11 - r22, xy, xz, wx], axis=-1),
            np.stack([xy, 1 - r00 + r11 - r22, yz, wy], axis=-1),
            np.stack([xz, yz, 1 - r00 - r11 + r22, wz], axis=-1),
            np.stack([wx, wy, wz, 1 + r00 + r11 + r22], axis=-1),
        ],
        axis=-2,
    )
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, largest[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., 3:] < 0, -q, q) + 0.0)


def quaternion_to_matrix(quaternion: ArrayLike) -> Array:
    """Return the (3, 3) rotation of a (4,) unit quaternion x, y, z, w."""
    x, y, z, w = np.asarray(quaternion, dtype=float).tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def reference_quaternion(quaternion: ArrayLike) -> Array:
    """Return the one of q and -q from which the signs of a tip's other orientations are measured.

    It has w > 0 or, where w is 0 but for rounding, its largest component positive, the first of
    x, y, z that are equal but for rounding.

    Args:
        quaternion: (4,) unit quaternion x, y, z, w of the tip at q = 0.
    """
    q = np.array(quaternion, dtype=float)
    leading = q[3]
    if abs(leading) < _LIKELY:
        size = np.abs(q[:3])
        leading = q[np.argmax(size > size.max() - _LIKELY)]
    return -q if leading < 0 else q


def turns_about(axis: Array, angle: ArrayLike) -> Array:
    """Return the (..., 3, 3) rotations by (...) angles [rad] about a unit vector (Rodrigues)."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    cos, sin = cos_sin(np.asarray(angle, dtype=float)[..., None, None])
    return np.asarray(np.eye(3) + sin * K + (1 - cos) * (K @ K))


def roll_pitch_yaw(R: Array) -> Array:
    """Return the (3,) angles [rad] of a (3, 3) rotation Rz(yaw) Ry(pitch) Rx(roll), as in URDF.

    The yaw is taken out before the other two angles are read off, so they are as accurate at
    pitch = pi/2, where any yaw would do and 0 is taken, as elsewhere.
    """
    is_upright = math.hypot(R[0, 0], R[1, 0]) < _EXACT
    yaw = 0.0 if is_upright else math.atan2(R[1, 0], R[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    pitch = math.atan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([roll, pitch, yaw])


def angle_between(one: Array, two: Array) -> Array:
    """Return the (...) angles [rad] between (..., 3, 3) rotations, exact also where small."""
    # |R1 - R2| is 2 sqrt(2) sin(angle / 2).
    chord = np.linalg.norm(one - two, axis=(-2, -1)) / math.sqrt(8)
    return np.asarray(2 * np.arcsin(np.minimum(chord, 1.0)))


def rigid_transform(T: ArrayLike, name: str) -> Array:
    """Return a (4, 4) rigid transform in float64, its rotation corrected if it was rounded.

    Args:
        T: the matrix.
        name: what it is called in an error.

    Raises:
        LegFKError: it is none; shows it.
    """
    try:
        matrix = np.array(T, dtype=float)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if not is_rigid_transform(matrix):
        found = reprlib.repr(' '.join(str(T).split()))
        raise LegFKError(
            f'{name} is {found}; allowed: a (4, 4) rotation and translation with '
            'the last row 0 0 0 1'
        )
    matrix[:3, :3] = nearest_rotation(matrix[:3, :3])
    return matrix


def is_rigid_transform(T: Array, tolerance: float = 1e-6) -> bool:
    """Return whether a matrix is a proper rotation and a translation, and nothing else.

    Args:
        T: the matrix.
        tolerance: how far R R^T may be from the identity, beside rounded lengths of its rows.
    """
    if T.shape != (4, 4) or not np.isfinite(T).all():
        return False
    R = T[:3, :3]
    if np.abs(R).max() >= 2.0:  # larger ones may overflow below
        return False
    # np.allclose would do, but takes ten times as long at every start.
    excess = np.abs(R @ R.T - np.eye(3)) - _ROUNDED * np.eye(3)
    is_orthogonal = excess.max() <= tolerance
    return bool(
        is_orthogonal and np.linalg.det(R) > 0 and np.array_equal(T[3], (0, 0, 0, 1))
    )


def nearest_rotation(R: Array) -> Array:
    """Return the rotation nearest to a (3, 3) matrix that was rounded when it was written down.

    A matrix that is a rotation to the last digits of a float comes back untouched.
    """
    if np.abs(R @ R.T - np.eye(3)).max() <= 1e-14:
        return R
    U, _, Vt = np.linalg.svd(R)
    return np.asarray(U @ Vt)
