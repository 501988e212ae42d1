"""Properties of any chain: random tables, sliding joints, right angles and odd twists."""

from math import pi
import tracemalloc

from any_chain import chain_of, chains_and_positions
from hypothesis import given
from hypothesis import strategies as st
from icub_leg_fk.errors import JointVectorError, LegFKError
from icub_leg_fk.kinematics import Catalog, Chain, DHLink, quaternion_to_matrix, solver
import numpy as np
from oracle import product
import pytest


@given(chains_and_positions())
def test_forward_is_the_product_of_the_basic_transforms(case: tuple[Chain, list]) -> None:
    chain, Q = case
    for q in Q:
        assert np.abs(chain.forward(q) - product(chain, q)).max() < 1e-13


@given(chains_and_positions())
def test_pose_is_forward(case: tuple[Chain, list]) -> None:
    chain, Q = case
    for q in Q:
        T, pose = chain.forward(q), np.array(chain.pose(q))
        assert np.abs(pose[:3] - T[:3, 3]).max() < 1e-13
        assert np.abs(quaternion_to_matrix(pose[3:]) - T[:3, :3]).max() < 1e-13
        assert np.linalg.norm(pose[3:]) == pytest.approx(1, abs=1e-14)
        assert pose[6] >= 0
        assert not np.signbit(pose[pose == 0]).any()


@given(chains_and_positions())
def test_many_poses_are_each_ones(case: tuple[Chain, list]) -> None:
    chain, Q = case
    T, poses = np.array([chain.forward(q) for q in Q]), chain.poses(Q)
    assert np.abs(poses[:, :3] - T[:, :3, 3]).max() < 1e-13
    assert np.abs(quaternion_to_matrix(poses[:, 3:]) - T[:, :3, :3]).max() < 1e-13
    assert np.abs(np.linalg.norm(poses[:, 3:], axis=1) - 1).max() < 1e-14
    assert (poses[:, 6] >= 0).all()
    assert not np.signbit(poses[poses == 0]).any()
    assert np.abs(chain.forward_many(Q) - T).max() < 1e-13


@pytest.fixture(params=[False, True], ids=['numpy as it is', 'numpy with a sine of its own'])
def _sines(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param:
        monkeypatch.setattr(solver, '_numpy_is_libm', lambda: False)


@pytest.mark.usefixtures('_sines')
def test_poses_as_one_by_one_are_bit_identical() -> None:
    @given(chains_and_positions())
    def check(case: tuple[Chain, list]) -> None:
        chain, Q = case
        expected = np.array([chain.pose(q) for q in Q])
        assert chain.poses_as_one_by_one(Q).tobytes() == expected.tobytes()

    check()


@pytest.mark.usefixtures('_sines')
@pytest.mark.parametrize(('name', 'version'), [
    ('left_leg', 'v2_5'), ('right_leg', 'v3'), ('head_imu', 'v2')])
def test_poses_as_one_by_one_are_bit_identical_over_blocks(name: str, version: str) -> None:
    chain = Catalog.load().chain(name, version)
    Q = np.random.default_rng(13).uniform(-3, 3, (solver.BLOCK + 1500, 6))
    Q[::7] = np.round(Q[::7] / (pi / 2)) * (pi / 2)
    expected = np.array([chain.pose(q) for q in Q.tolist()])
    assert chain.poses_as_one_by_one(Q).tobytes() == expected.tobytes()
    assert np.abs(chain.poses(Q)[:, :3] - expected[:, :3]).max() < 1e-14
    # At w = 0 rounding decides which of the two equal quaternions it is.
    R = quaternion_to_matrix(chain.poses(Q)[:, 3:])
    assert np.abs(R - quaternion_to_matrix(expected[:, 3:])).max() < 1e-14


@given(chains_and_positions())
def test_a_rotation_stays_a_rotation(case: tuple[Chain, list]) -> None:
    chain, Q = case
    for T in (*chain.frames(Q[0]), *chain.forward_many(Q)):
        R = T[:3, :3]
        assert np.abs(R @ R.T - np.eye(3)).max() < 1e-13
        assert np.linalg.det(R) == pytest.approx(1, abs=1e-13)
        assert np.array_equal(T[3], (0, 0, 0, 1))


def test_a_rotation_written_with_few_digits_stays_a_rotation() -> None:
    T = np.eye(4)
    T[:2, :2] = [[0.7071068, -0.7071068], [0.7071068, 0.7071068]]
    chain = chain_of([DHLink(1, 0, 0), DHLink(0, 1, pi / 2)], T, None, T)
    R = chain.forward([0.1, 0.2])[:3, :3]
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-15
    assert np.abs(quaternion_to_matrix(chain.pose([0.1, 0.2])[3:]) - R).max() < 1e-15


@given(chains_and_positions(), st.data())
def test_composing_equals_multiplying(case: tuple[Chain, list], data: st.DataObject) -> None:
    """A chain cut in two is the product of its halves, and its frames say where it was cut."""
    chain, Q = case
    cut = data.draw(st.integers(1, len(chain.links)))
    first = chain_of(chain.links[:cut], chain.T_root_0)
    for q in Q:
        T = first.forward(q[:cut])
        assert np.abs(chain.frames(q)[cut] - T).max() < 1e-13
        if cut < len(q):
            rest = chain_of(chain.links[cut:], None, chain.virtual_link, chain.T_n_tip)
            assert np.abs(T @ rest.forward(q[cut:]) - chain.forward(q)).max() < 1e-13
            joined = chain_of(chain.links[cut:], T, chain.virtual_link, chain.T_n_tip)
            assert np.abs(joined.forward(q[cut:]) - chain.forward(q)).max() < 1e-13


@given(chains_and_positions())
def test_whole_turns_change_nothing(case: tuple[Chain, list]) -> None:
    chain, Q = case
    turns = np.array([0 if link.is_prismatic else 2 * pi for link in chain.links])
    moved = chain.forward_many(np.array(Q) + turns)
    assert np.abs(moved - chain.forward_many(Q)).max() < 1e-13


def test_memory_beyond_the_result_does_not_grow_with_the_number_of_poses() -> None:
    chain = Catalog.load().chain('left_leg', 'v2_5')

    def peak_beyond_result(rows: int) -> int:
        Q = np.random.default_rng(14).uniform(-1, 1, (rows, 6))
        tracemalloc.start()
        result = chain.poses(Q)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak - result.nbytes

    peak_beyond_result(10)
    few, many = peak_beyond_result(2 * solver.BLOCK), peak_beyond_result(40 * solver.BLOCK)
    assert many < few + 100_000


LEG = Catalog.load().chain('left_leg', 'v2_5')
SLIDE = chain_of([DHLink(0, 0, 0, joint_type='prismatic')] * 2)
NOT_NUMBERS = [
    [0.0] * 5, [0.0] * 7, [], [0.0, 0.0, float('nan'), 0.0, 0.0, 0.0],
    [float('inf')] + [0.0] * 5, [float('-inf')] * 6, [None] * 6, ['0'] * 6, ['a\nb'] * 6,
    [1j] * 6, [10 ** 400] * 6, [[0.0]] * 6, ['x' * 1000] * 6,
]


@pytest.mark.parametrize('q', NOT_NUMBERS, ids=lambda q: repr(q)[:30])
def test_a_bad_joint_vector_is_refused_in_one_line(q: list) -> None:
    if q != ['0'] * 6:  # numpy reads numbers in text
        for refuse in (LEG.forward, LEG.frames, LEG.jacobian):
            with pytest.raises(JointVectorError) as refusal:
                refuse(q)
            assert '\n' not in str(refusal.value) and len(str(refusal.value)) < 700
    with pytest.raises(JointVectorError, match=r'found .* allowed: ') as refusal:
        LEG.pose(q)
    assert '\n' not in str(refusal.value) and len(str(refusal.value)) < 700


@pytest.mark.parametrize('value', [float('nan'), float('inf'), float('-inf')])
def test_a_bad_entry_is_named_by_its_place(value: float) -> None:
    with pytest.raises(JointVectorError, match=r'found q\[2\] = (nan|-?inf), allowed: finite'):
        LEG.pose([0.0, 0.0, value, 0.0, 0.0, 0.0])
    Q = np.zeros((5000, 6))
    Q[4321, 5] = value
    for refuse in (LEG.poses, LEG.poses_as_one_by_one, LEG.forward_many):
        with pytest.raises(JointVectorError, match=r'found q\[4321, 5\] = (nan|-?inf)'):
            refuse(Q)


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('chain', [LEG, SLIDE], ids=['turning', 'sliding'])
def test_values_too_large_to_compute_with_are_refused(chain: Chain) -> None:
    q = [1.7e308] * len(chain.links)
    with pytest.raises(JointVectorError, match='too large to compute with'):
        chain.pose(q)
    for refuse in (chain.poses, chain.poses_as_one_by_one):
        with pytest.raises(JointVectorError, match='too large to compute with'):
            refuse([[0.0] * len(q), q])


def test_no_joint_vectors_give_no_poses() -> None:
    assert LEG.poses(np.empty((0, 6))).shape == (0, 7)
    assert LEG.forward_many(np.empty((0, 6))).shape == (0, 4, 4)


@pytest.mark.parametrize('Q', [[0.0] * 6, [[0.0] * 5], [[[0.0] * 6]], 3.0, [[0.0] * 6, [0.0]]],
                         ids=repr)
def test_arrays_of_another_shape_are_refused(Q: object) -> None:
    with pytest.raises(JointVectorError, match=r'allowed: \(N, 6\)'):
        LEG.poses(Q)


def test_a_joint_vector_of_another_length_is_not_looked_up_in_the_ranges() -> None:
    with pytest.raises(JointVectorError, match='found 5 values, allowed: 6'):
        LEG.out_of_range([0.0] * 5)


def test_numpy_and_integer_joint_vectors_are_welcome() -> None:
    expected = LEG.pose([1.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    for q in (np.array([1, 0, -1, 0, 0, 0]), (1, 0, -1, 0, 0, 0), np.array([1.0, 0, -1, 0, 0, 0])):
        assert LEG.pose(q) == expected
        assert all(type(value) is float for value in LEG.pose(q))


@pytest.mark.parametrize('mistake', [
    lambda: chain_of([]),
    lambda: chain_of([DHLink(0, 0, 0)], np.diag([2.0, 1, 1, 1])),
    lambda: chain_of([DHLink(0, 0, 0)], np.eye(3)),
    lambda: chain_of([DHLink(0, 0, 0)], None, None, np.zeros((4, 4))),
    lambda: Chain('a', '', 'r', 't', 'f', ('j',), (DHLink(0, 0, 0),) * 2, np.eye(4)),
    lambda: Chain('a', '', 'r', 't', 'f', ('j', 'j'), (DHLink(0, 0, 0),) * 2, np.eye(4)),
    lambda: DHLink(0, float('nan'), 0),
    lambda: DHLink(0, 0, 0, joint_type='screw'),
    lambda: DHLink(0, 0, 0, lower=1, upper=-1),
])
def test_a_chain_that_cannot_be_is_refused(mistake: object) -> None:
    with pytest.raises(LegFKError, match=r'found .*allowed: .'):
        mistake()  # type: ignore[operator]
