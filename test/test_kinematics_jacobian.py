"""The Jacobian against central differences of the pose, for turning and sliding joints."""

from icub_leg_fk.kinematics import Catalog, Chain, DHLink
import numpy as np
import pytest

CATALOG = Catalog.load()
STEP = 1e-5


def mixed_arm() -> Chain:
    types = ('prismatic', 'revolute', 'revolute', 'prismatic', 'revolute')
    rng = np.random.default_rng(10)
    links = tuple(DHLink(*rng.uniform(-2, 2, 4), joint_type=t) for t in types)
    return Chain(name='mixed', version='', root_frame='base', tip='hand', tip_frame='hand',
                 joint_names=tuple('abcde'), links=links,
                 T_root_0=CATALOG.chain('head_imu', 'v2').T_root_0,
                 T_n_tip=DHLink(a=0.2, d=-0.1, alpha=0.7, offset=0.3).transform())


ARMS = [CATALOG.chain(name, version) for name, entry in CATALOG.chains.items()
        for version in entry.versions] + [CATALOG.chain('left_leg', 'v2_5', 'sole'), mixed_arm()]


@pytest.mark.parametrize('chain', ARMS, ids=lambda c: f'{c.name}-{c.version}-{c.tip_frame}')
def test_jacobian_is_the_derivative_of_the_pose(chain: Chain) -> None:
    n = len(chain.links)
    for q in np.random.default_rng(11).uniform(-2, 2, (20, n)):
        J = chain.jacobian(q)
        assert J.shape == (6, n)
        R = chain.forward(q)[:3, :3]
        for i in range(n):
            step = STEP * np.eye(n)[i]
            difference = (chain.forward(q + step) - chain.forward(q - step)) / (2 * STEP)
            spin = difference[:3, :3] @ R.T  # the cross-product matrix of the angular velocity
            assert J[:3, i] == pytest.approx(difference[:3, 3], abs=1e-8)
            assert J[3:, i] == pytest.approx((spin[2, 1], spin[0, 2], spin[1, 0]), abs=1e-8)


def test_a_sliding_joint_turns_nothing() -> None:
    chain = mixed_arm()
    J = chain.jacobian([0.1, 0.2, 0.3, 0.4, 0.5])
    assert np.array_equal(J[3:, [0, 3]], np.zeros((3, 2)))
    assert np.linalg.norm(J[:3, [0, 3]], axis=0) == pytest.approx(1)
