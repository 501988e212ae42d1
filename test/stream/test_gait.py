"""The gait that the demonstration plays: both feet walk, joints stay in their printed ranges."""

from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.kinematics.catalog import config_file
from icub_leg_fk.tools.recording import read_csv
import numpy as np
import pytest
from support.gait import PERIOD, walk

RATE = 160.0  # Hz; a period is 200 samples, half a period 100
# The legs' ranges as printed [deg], hip_roll narrowed by the erratum -17 .. 119.
PRINTED = np.radians([(-44, 132), (-17, 17), (-79, 79), (-125, 0), (-42, 21), (-24, 24)])


@pytest.fixture(scope='module')
def catalog():
    return Catalog.load()


@pytest.fixture(scope='module')
def gait(catalog):
    return walk(catalog, 'v2_5', seconds=2 * PERIOD, rate=RATE)


@pytest.fixture(scope='module')
def soles(catalog, gait):
    """Left and right sole, (N, 4, 4), by the plain product of the DH matrices."""
    left, right = (catalog.chain(name, 'v2_5', 'sole') for name in ('left_leg', 'right_leg'))
    return (np.array([left.forward(q) for q in gait.positions[:, :6]]),
            np.array([right.forward(q) for q in gait.positions[:, 6:]]))


@pytest.mark.parametrize('version', ['v1', 'v2_5'])
def test_every_joint_stays_in_its_documented_range(catalog, version):
    legs = walk(catalog, version).positions.reshape(-1, 6)
    assert (legs >= PRINTED[:, 0]).all()
    assert (legs <= PRINTED[:, 1]).all()


def test_every_joint_moves_in_every_version(catalog):
    for version in catalog.entry('left_leg').versions:
        assert (np.ptp(walk(catalog, version).positions, axis=0) > np.radians(2)).all(), version


def test_soles_stay_level_and_face_forward(soles):
    for sole in soles:
        assert np.abs(sole[:, :3, :3] - np.diag([-1, -1, 1])).max() < 1e-6


def test_each_foot_lifts_about_four_centimetres_above_the_standing_one(soles):
    left, right = (sole[:, 2, 3] for sole in soles)
    assert 0.035 < (left - right).max() < 0.045
    assert 0.035 < (right - left).max() < 0.045


def test_one_foot_stands_at_any_time_and_both_for_a_while(soles):
    """A foot on the ground is as low as the lower one, and moves back as fast as its peer."""
    left, right = (sole[:, :3, 3] for sole in soles)
    both = np.abs(left[:, 2] - right[:, 2]) < 1e-9
    assert 0.1 < both.mean() < 0.4
    steps = np.diff(left - right, axis=0)[both[1:] & both[:-1]]
    assert np.abs(steps).max() < 1e-9


def test_standing_foot_moves_backward_and_swinging_foot_forward(soles):
    for foot, other in (soles, soles[::-1]):
        dx = np.gradient(foot[:, 0, 3])
        swinging = foot[:, 2, 3] - other[:, 2, 3] > 0.02
        assert (dx[swinging] < 0).all()
        assert (dx[foot[:, 2, 3] < other[:, 2, 3] - 0.02] > 0).all()


def test_pelvis_sways_over_the_standing_foot_and_feet_never_collide(soles):
    left, right = (sole[:, :3, 3] for sole in soles)
    middle = (left[:, 1] + right[:, 1]) / 2  # y is to the right
    left_swings, right_swings = left[:, 2] > right[:, 2] + 0.03, right[:, 2] > left[:, 2] + 0.03
    assert (middle[left_swings] < -0.01).all()  # the pelvis is right of the middle
    assert (middle[right_swings] > 0.01).all()
    assert (right[:, 1] - left[:, 1]).min() > 0.1


def test_the_walk_that_is_shipped_is_this_gait(catalog):
    made = walk(catalog, 'v2_5', 5.0)
    shipped = read_csv(config_file('examples/synthetic_walk.csv'), made.joint_names)
    assert np.allclose(shipped.times, made.times)
    assert np.abs(shipped.positions - made.positions).max() < 1e-5
