"""Every documented chain, in every version and tip frame, against Pinocchio and by hand."""

from typing import Any

from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
from support.oracle import (
    CASES,
    HandMadeArm,
    PinocchioArm,
    quaternion_to_matrix,
    TABLES,
)

CONFIGURATIONS = 400
TOLERANCE = 1e-12

CATALOG = Catalog.load()
ORACLES = [
    pytest.param(('pinocchio', PinocchioArm), id='pinocchio'),
    pytest.param(('numpy', HandMadeArm), id='by-hand'),
]


def random_configurations(chain: Any, seed: int) -> np.ndarray:
    """Half of them inside the documented ranges, half anywhere, and the zero."""
    rng = np.random.default_rng(seed)
    inside = rng.uniform(chain.lower, chain.upper, (CONFIGURATIONS // 2, chain.n))
    anywhere = rng.uniform(-2 * np.pi, 2 * np.pi, (CONFIGURATIONS // 2, chain.n))
    return np.vstack((inside, anywhere, np.zeros((1, chain.n))))


def test_every_shipped_table_has_an_oracle() -> None:
    shipped = {
        (name, version)
        for name, entry in CATALOG.chains.items()
        for version in entry.versions
    }
    assert shipped == set(TABLES)
    assert len(CASES) == sum(
        len(CATALOG.chains[name].versions[version].tip_frames)
        for name, version in TABLES
    )


@pytest.mark.parametrize('oracle', ORACLES)
@pytest.mark.parametrize(('name', 'version', 'frame'), CASES)
def test_poses_are_the_oracles(
    name: str, version: str, frame: str, oracle: Any
) -> None:
    module, arm_class = oracle
    pytest.importorskip(module)
    arm, chain = arm_class(name, version, frame), CATALOG.chain(name, version, frame)
    Q = random_configurations(chain, seed=1)
    expected = np.array([arm.forward(q) for q in Q])

    assert np.abs(chain.forward(Q) - expected).max() < TOLERANCE

    for poses in (np.array([chain.pose(q) for q in Q.tolist()]), chain.poses(Q)):
        assert np.abs(poses[:, :3] - expected[:, :3, 3]).max() < TOLERANCE
        rotations = quaternion_to_matrix(poses[:, 3:])
        assert np.abs(rotations - expected[:, :3, :3]).max() < TOLERANCE


@pytest.mark.parametrize(('name', 'version', 'frame'), CASES)
def test_jacobians_are_pinocchios(name: str, version: str, frame: str) -> None:
    pytest.importorskip('pinocchio')
    arm, chain = PinocchioArm(name, version, frame), CATALOG.chain(name, version, frame)
    for q in random_configurations(chain, seed=2)[::8]:
        assert np.abs(chain.jacobian(q) - arm.jacobian(q)).max() < TOLERANCE


@pytest.mark.parametrize(('name', 'version', 'frame'), CASES)
def test_twists_are_pinocchios(name: str, version: str, frame: str) -> None:
    pin = pytest.importorskip('pinocchio')
    arm, chain = PinocchioArm(name, version, frame), CATALOG.chain(name, version, frame)
    for q, qdot in np.random.default_rng(3).uniform(-3, 3, (50, 2, chain.n)):
        pin.forwardKinematics(arm.model, arm.data, q, qdot)
        pin.updateFramePlacements(arm.model, arm.data)
        expected = pin.getFrameVelocity(
            arm.model, arm.data, arm.tip, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        ).vector
        assert chain.twist(q.tolist(), qdot.tolist()) == pytest.approx(
            expected, abs=1e-12
        )
