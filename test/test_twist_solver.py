"""Twists: the Jacobian's for any chain, Pinocchio's for the shipped ones, many as one by one."""

from any_chain import ANGLES, CHAINS
from hypothesis import given
from hypothesis import strategies as st
from icub_leg_fk.errors import JointVectorError
from icub_leg_fk.kinematics import Catalog, Chain
import numpy as np
from oracle import CASES, PinocchioArm
import pytest

CATALOG = Catalog.load()
LEG = CATALOG.chain('left_leg', 'v2_5')
SPEEDS = st.one_of(st.sampled_from([0.0, -0.0, 1.0]), st.floats(-20, 20))


@st.composite
def moving_chains(draw: st.DrawFn) -> tuple[Chain, list[list[float]], list[list[float]]]:
    chain = draw(CHAINS)
    n, count = len(chain.links), draw(st.integers(1, 3))
    vectors = (st.lists(st.lists(values, min_size=n, max_size=n), min_size=count, max_size=count)
               for values in (ANGLES, SPEEDS))
    return chain, *map(draw, vectors)


@given(moving_chains())
def test_a_twist_is_the_jacobian_times_the_velocities(case: tuple[Chain, list, list]) -> None:
    chain, Q, Qdot = case
    for q, qdot in zip(Q, Qdot, strict=True):
        twist = np.array(chain.twist(q, qdot))
        assert np.abs(twist - chain.jacobian(q) @ qdot).max() < 1e-11
        assert not np.signbit(twist[twist == 0]).any()


@given(moving_chains())
def test_many_twists_are_each_ones_to_the_bit(case: tuple[Chain, list, list]) -> None:
    chain, Q, Qdot = case
    twists = chain.twist_solver.twists(np.array(Q), np.array(Qdot))
    assert twists.tolist() == [list(chain.twist(q, v)) for q, v in zip(Q, Qdot, strict=True)]
    assert not np.signbit(twists[twists == 0]).any()


def test_many_twists_across_blocks_are_each_ones_to_the_bit() -> None:
    Q, Qdot = np.random.default_rng(2).uniform(-3, 3, (2, 10_000, 6))
    expected = [LEG.twist(q, v) for q, v in zip(Q.tolist(), Qdot.tolist(), strict=True)]
    assert list(map(tuple, LEG.twist_solver.twists(Q, Qdot).tolist())) == expected


@pytest.mark.parametrize(('name', 'version', 'frame'), CASES)
def test_twists_are_pinocchios(name: str, version: str, frame: str) -> None:
    pin = pytest.importorskip('pinocchio')
    arm, chain = PinocchioArm(name, version, frame), CATALOG.chain(name, version, frame)
    rng = np.random.default_rng(3)
    for q, qdot in rng.uniform(-3, 3, (200, 2, len(chain.links))):
        pin.forwardKinematics(arm.model, arm.data, q, qdot)
        pin.updateFramePlacements(arm.model, arm.data)
        expected = pin.getFrameVelocity(arm.model, arm.data, arm.tip,
                                        pin.ReferenceFrame.LOCAL_WORLD_ALIGNED).vector
        assert chain.twist(q.tolist(), qdot.tolist()) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(('q', 'qdot', 'found'), [
    ([0.0] * 5, [0.0] * 6, 'joint vector: found 5 values, allowed: 6'),
    ([0.0] * 6, [0.0] * 7, 'joint velocities: found 7 values, allowed: 6'),
    ([0.0] * 5 + [float('nan')], [0.0] * 6, r'joint vector: found q\[5\] = nan, allowed: finite'),
    ([0.0] * 6, [0.0] * 5 + [float('inf')], r'joint velocities: found qdot\[5\] = inf'),
    ([float('inf')] * 6, [0.0] * 6, r'found q\[0\] = inf, .*q\[5\] = inf'),
    ([0.0] * 6, [1.7e308] * 6, 'found values too large to compute with'),
    ([0.0] * 5 + ['1'], [0.0] * 6, r"found q\[5\] = '1'"),
    ([0.0] * 6, [None] * 6, r'found qdot\[0\] = None'),
])
def test_what_is_no_velocity_is_refused(q: list, qdot: list, found: str) -> None:
    with pytest.raises(JointVectorError, match=found):
        LEG.twist(q, qdot)


def test_many_twists_refuse_what_is_not_finite() -> None:
    Qdot = np.ones((5, 6))
    Qdot[3, 2] = np.nan
    with pytest.raises(JointVectorError, match=r'found qdot\[2\] = nan'):
        LEG.twist_solver.twists(np.zeros((5, 6)), Qdot)
