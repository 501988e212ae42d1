"""A real robot's walk through the node, at 800 Hz, judged by another participant."""

import time

import numpy as np
import pytest
from support.node_harness import FEET, LOSSLESS, NodeProcess, Robot, SECOND
from support.node_oracle import oracle_pose, pose_matrix
from support.recorded_walk import needs_recorded_walk, read_recorded_walk

pytestmark = needs_recorded_walk

STANDING = 80.0  # N; a foot with more than this on it stands
START = 1_700_000_000 * SECOND
FASTER = 8  # than the robot walked


@pytest.fixture(scope='module')
def walk():
    """Play the recording; return it and, by foot, what came out."""
    names, times, positions, forces = read_recorded_walk()
    stamps = [START + round(t * 1e9) for t in times]
    with NodeProcess({'foot_frame': 'sole', **LOSSLESS}) as node, Robot(node) as robot:
        robot.connect()
        begin = time.monotonic()
        for t, stamp, row in zip(times, stamps, positions, strict=True):
            left = begin + t / FASTER - time.monotonic()
            while left > 0:
                robot.spin(left)
                left = begin + t / FASTER - time.monotonic()
            robot.send(stamp, names, row)
        poses = {foot: robot.take(robot.poses[foot], stamps[-1]) for foot in FEET}
    return stamps, positions, forces, poses


@pytest.mark.parametrize(
    ('foot', 'chain', 'part'),
    [
        ('left_foot', 'left_leg', slice(6)),
        ('right_foot', 'right_leg', slice(6, 12)),
    ],
)
def test_every_pose_arrives_once_in_order_and_is_pinocchios(walk, foot, chain, part):
    stamps, positions, _, poses = walk
    assert len(stamps) == 1188
    assert poses[foot].stamps() == stamps
    expected = [oracle_pose(chain, 'v2_5', row[part], 'sole') for row in positions]
    np.testing.assert_allclose(matrices(poses[foot]), expected, rtol=0, atol=1e-12)


def matrices(poses):
    return np.array([pose_matrix(message.pose) for message in poses])


def test_soles_are_parallel_and_level_while_both_feet_stand(walk):
    _, _, forces, poses = walk
    both = (forces > STANDING).all(axis=1)
    assert both.sum() > 200
    left = matrices(poses['left_foot'])[both]
    right = matrices(poses['right_foot'])[both]
    normals = np.einsum('ij,ij->i', left[:, :3, 2], right[:, :3, 2])
    angle_deg = np.degrees(np.arccos(np.clip(normals, -1, 1)))
    # Of the right sole above the left one, on the floor that the left one is level with.
    height_mm = 1000 * np.einsum(
        'ij,ij->i', right[:, :3, 3] - left[:, :3, 3], left[:, :3, 2]
    )
    assert angle_deg.mean() == pytest.approx(0.54, abs=0.005)
    assert height_mm.mean() == pytest.approx(-0.10, abs=0.005)
    assert height_mm.std() == pytest.approx(0.49, abs=0.005)
    up = np.array([0, 0, 1])
    assert (left[:, :3, 2] @ up > 0.95).all()  # z of a sole points up,
    assert (left[:, 0, 0] < -0.8).all()  # and x forward: against the root's
