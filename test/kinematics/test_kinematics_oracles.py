"""Every documented chain, in every version and tip frame, against Pinocchio or by hand."""

from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
from support.node_oracle import oracle_jacobian, oracle_pose
from support.oracle import CASES, quaternion_to_matrix

CATALOG = Catalog.load()
TOLERANCE = 1e-12

every_case = pytest.mark.parametrize(('name', 'version', 'frame'), CASES)


def configurations(chain, count):
    """Return joint vectors inside the documented ranges, as many anywhere, and the zero."""
    rng = np.random.default_rng(1)
    inside = rng.uniform(chain.lower, chain.upper, (count, chain.n))
    anywhere = rng.uniform(-2 * np.pi, 2 * np.pi, (count, chain.n))
    return np.vstack((inside, anywhere, np.zeros((1, chain.n))))


def test_every_shipped_table_has_an_oracle():
    shipped = [
        (chain.name, version, frame)
        for entry in CATALOG.chains.values()
        for version, chain in entry.versions.items()
        for frame in chain.tip_frames
    ]
    assert shipped == CASES


@every_case
def test_poses_are_the_oracles(name, version, frame):
    chain = CATALOG.chain(name, version, frame)
    Q = configurations(chain, 200)
    expected = np.array([oracle_pose(name, version, q, frame) for q in Q])
    assert np.abs(chain.forward(Q) - expected).max() < TOLERANCE
    for poses in (np.array([chain.pose(q) for q in Q.tolist()]), chain.poses(Q)):
        assert np.abs(poses[:, :3] - expected[:, :3, 3]).max() < TOLERANCE
        rotations = quaternion_to_matrix(poses[:, 3:])
        assert np.abs(rotations - expected[:, :3, :3]).max() < TOLERANCE


@every_case
def test_jacobians_and_twists_are_pinocchios(name, version, frame):
    chain = CATALOG.chain(name, version, frame)
    qdot = np.linspace(-3, 2, chain.n)
    for q in configurations(chain, 25):
        expected = oracle_jacobian(name, version, q, frame)
        assert np.abs(chain.jacobian(q) - expected).max() < TOLERANCE
        twist = chain.twist(q.tolist(), qdot.tolist())
        assert twist == pytest.approx(expected @ qdot, abs=1e-12)
