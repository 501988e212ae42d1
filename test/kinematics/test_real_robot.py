"""A real robot's walk, judged by the robot itself: its soles are on the floor where it stands.

That the node's poses of this walk are those of the library is for test_bag_node.py.
"""

from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
from support.recorded_walk import needs_recorded_walk, read_recorded_walk

STANDING = 80.0  # N; a foot with more than this on it stands


@needs_recorded_walk
def test_soles_are_parallel_and_level_while_both_feet_stand():
    names, _, positions, forces = read_recorded_walk()
    both = (forces > STANDING).all(axis=1)
    assert both.sum() > 200
    q = dict(zip(names, positions[both].T, strict=True))
    legs = Catalog.load().select(['left_leg', 'right_leg'], 'v2_5')
    left, right = [leg.with_frame('sole').forward(q) for leg in legs]
    up = left[:, :3, 2]
    angle_deg = np.degrees(np.arccos(np.sum(up * right[:, :3, 2], axis=1).clip(-1, 1)))
    # Of the right sole above the left one, on the floor that the left one is level with.
    height_mm = 1000 * np.sum((right[:, :3, 3] - left[:, :3, 3]) * up, axis=1)
    assert angle_deg.mean() == pytest.approx(0.54, abs=0.005)
    assert height_mm.mean() == pytest.approx(-0.10, abs=0.005)
    assert height_mm.std() == pytest.approx(0.49, abs=0.005)
    assert (up[:, 2] > 0.95).all()
    assert (left[:, 0, 0] < -0.8).all()  # x is forward: against the root's
