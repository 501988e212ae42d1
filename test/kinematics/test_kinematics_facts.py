"""What is known of the documented chains without computing: zeros, mirrors, axes, frames."""

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
from support.described_robots import needs_real_robots, pinocchio_pose, REAL

CATALOG = Catalog.load()
MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])  # left and right, in the root frame


FOOT_AT_ZERO = [[0, 0, -1], [0, 1, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    ('name', 'position_mm', 'rotation'),
    [
        ('left_leg=v1', (0, -68.1, -597.5), FOOT_AT_ZERO),
        ('right_leg=v1', (0, 68.1, -597.5), FOOT_AT_ZERO),
        ('left_leg=v2_5', (4.4175, -68.1, -622.995), FOOT_AT_ZERO),
        ('right_leg=v2_5', (4.4175, 68.1, -622.995), FOOT_AT_ZERO),
        ('head_imu=v2', (13.0, 6.6, 375.6), np.eye(3)),
    ],
)
def test_a_tip_at_zero_is_where_it_is_known_to_be(name, position_mm, rotation):
    T = CATALOG.chain(name).forward([0] * 6)
    assert T[:3, 3] * 1000 == pytest.approx(position_mm, abs=1e-10)
    assert np.array_equal(T[:3, :3], rotation)


def test_version_3_serves_the_whole_robot():
    names = ['left_leg', 'right_leg', 'head_imu']
    chains = CATALOG.select(names, 'v3')
    assert [(chain.root_frame, chain.root_axes) for chain in chains] == [
        ('root_link', ('forward', 'left', 'up'))
    ] * 3
    with pytest.raises(LegFKError, match='head_imu=v2 do not go together'):
        CATALOG.select([*names[:2], 'head_imu=v2'], 'v3')


@needs_real_robots
def test_the_head_of_version_3_is_that_of_its_robot():
    text = REAL['iCubGenova09'].read_text()
    head = CATALOG.chain('head_imu', 'v3')
    for q in np.random.default_rng(8).uniform(-1.5, 1.5, (100, 6)):
        positions = dict(zip(head.joint_names, q, strict=True))
        expected = pinocchio_pose(text, 'root_link', 'imu_frame', positions)
        assert head.forward(q) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize('version', ['v1', 'v2_5', 'v3'])
def test_right_foot_mirrors_left_foot(version):
    left, right = CATALOG.select(['left_leg', 'right_leg'], version)
    Q = np.random.default_rng(3).uniform(-3, 3, (1000, 6))
    mirrored = MIRROR @ left.forward(Q) @ MIRROR
    assert np.abs(right.forward(Q) - mirrored).max() < 1e-14


@pytest.mark.parametrize('name', ['left_leg', 'right_leg'])
def test_sole_points_forward_left_and_up_when_standing(name):
    for version in CATALOG.chains[name].versions:
        T = CATALOG.chain(name, version, 'sole').forward([0] * 6)
        # The root frame's x points backward and its y to the robot's right, but on the iCub 3.
        forward = 1 if version == 'v3' else -1
        assert np.array_equal(
            T[:3, :3].T, [[forward, 0, 0], [0, forward, 0], [0, 0, 1]]
        )


def test_out_of_range_names_the_joints_and_clamps_nothing():
    chain = CATALOG.chain('left_leg', 'v2_5')
    within, outside = [0.0] * 6, [0.0, np.radians(-30), 0.0, 0.1, 0.0, 0.0]
    assert chain.out_of_range(within) == ()
    assert chain.out_of_range(outside) == ('l_hip_roll', 'l_knee')
    clamped = [0.0, np.radians(-20), 0.0, np.radians(4), 0.0, 0.0]
    assert (
        np.linalg.norm(chain.forward(outside)[:3, 3] - chain.forward(clamped)[:3, 3])
        > 0.08
    )
