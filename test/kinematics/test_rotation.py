"""Rotations to quaternions and back, at every rotation there is, and exact right angles."""

import math

from hypothesis import example, given
from hypothesis import strategies as st
from icub_leg_fk.kinematics import matrix_to_quaternion
from icub_leg_fk.kinematics.rotation import (
    cos_sin,
    is_rigid_transform,
    nearest_rotation,
    roll_pitch_yaw,
)
import numpy as np
import pytest
from support.oracle import quaternion_to_matrix

EPS = np.finfo(float).eps
COMPONENT = st.one_of(
    st.floats(-1, 1), st.sampled_from([0.0, -0.0, 1.0, -1.0, 1e-9, -1e-9, 1e-200])
)


@st.composite
def axes(draw):
    axis = np.array([draw(COMPONENT) for _ in range(3)])
    length = np.linalg.norm(axis)
    return axis / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])


def rodrigues(axis, angle):
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * (K @ K)


def check_unit_with_positive_w(q):
    assert np.linalg.norm(q) == pytest.approx(1, abs=4 * EPS)
    assert q[3] >= 0
    assert not np.signbit(q[q == 0]).any()


@given(axes(), st.floats(-2 * math.pi, 2 * math.pi))
@example(np.array([1.0, 0.0, 0.0]), math.pi)
@example(np.array([0.0, -1.0, 0.0]), math.pi)
@example(np.array([0.0, 0.0, 1.0]), -math.pi)
@example(np.array([0.6, 0.0, 0.8]), math.pi - 1e-9)
@example(np.array([0.6, 0.0, -0.8]), math.pi + 1e-9)
@example(np.array([0.0, 0.0, 1.0]), 0.0)
def test_quaternion_is_the_axis_and_half_the_angle(axis, angle):
    q = matrix_to_quaternion(rodrigues(axis, angle))
    expected = np.array([*(math.sin(angle / 2) * axis), math.cos(angle / 2)])
    assert min(np.abs(q - expected).max(), np.abs(q + expected).max()) < 1e-14
    check_unit_with_positive_w(q)


def test_arrays_of_rotations_are_converted_one_by_one():
    rng = np.random.default_rng(12)
    q = rng.normal(size=(4, 5, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True) * np.sign(q[..., 3:])
    R = quaternion_to_matrix(q)
    assert R.shape == (4, 5, 3, 3)
    assert np.abs(matrix_to_quaternion(R) - q).max() < 1e-14


@pytest.mark.parametrize('quarters', range(-8, 9))
def test_right_angles_are_exact(quarters):
    exact = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarters % 4]
    assert cos_sin(quarters * math.pi / 2) == exact
    assert cos_sin(math.radians(90 * quarters)) == exact
    assert cos_sin(math.radians(90) * (quarters - 1) + math.radians(90)) == exact


@given(st.floats(-1e300, 1e300))
def test_other_angles_are_the_c_librarys(angle):
    c, s = cos_sin(angle)
    assert c == pytest.approx(math.cos(angle), abs=3e-15)
    assert s == pytest.approx(math.sin(angle), abs=3e-15)


@pytest.mark.parametrize(
    'T',
    [
        np.diag([2.0, 1, 1, 1]),
        np.diag([-1.0, 1, 1, 1]),
        np.diag([1.0, 1, 1, 2]),
        np.diag([1e200, 1, 1, 1]),
        np.full((4, 4), np.nan),
        np.eye(4) + 1e-3 * np.eye(4, k=1),
        np.eye(3),
    ],
)
def test_what_is_no_rotation_is_no_rigid_transform(T):
    assert not is_rigid_transform(T)


def test_a_rounded_rotation_is_corrected_and_an_exact_one_is_untouched():
    rounded = np.round(rodrigues(np.array([0.6, 0.0, 0.8]), 0.7), 7)
    corrected = nearest_rotation(rounded)
    assert np.abs(corrected - rounded).max() < 1e-7
    assert np.abs(corrected @ corrected.T - np.eye(3)).max() < 10 * EPS
    exact = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    assert nearest_rotation(exact) is exact


def rotation(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll), as the URDF specification defines rpy."""
    x, y, z = np.eye(3)
    return rodrigues(z, yaw) @ rodrigues(y, pitch) @ rodrigues(x, roll)


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize(
    'nudge', [0, 1e-16, 1e-12, 1e-9, 1e-8, 1e-7, 1e-5, 1e-3, 0.5, 1.5]
)
def test_roll_pitch_yaw_turn_back_into_the_rotation(nudge, sign):
    pitch = sign * (math.pi / 2 - nudge)
    for roll, yaw in np.random.default_rng(3).uniform(-math.pi, math.pi, (50, 2)):
        R = rotation(roll, pitch, yaw)
        angles = roll_pitch_yaw(R)
        assert np.abs(rotation(*angles) - R).max() < 4e-15
        if nudge == 0:
            assert angles[2] == 0.0  # where any yaw would do
        if nudge >= 1e-3:
            np.testing.assert_allclose(angles, [roll, pitch, yaw], atol=1e-6)
