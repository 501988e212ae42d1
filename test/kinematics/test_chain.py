"""Properties of any chain: random tables, sliding joints, right angles and odd twists."""

import copy
from math import pi
import pickle
import tracemalloc
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from icub_leg_fk.errors import JointVectorError, LegFKError
from icub_leg_fk.kinematics import Catalog, Chain, DHLink
import numpy as np
import pytest
from support.any_chain import chain_of, CHAINS, chains_and_positions
from support.oracle import product, quaternion_to_matrix


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
        assert not np.signbit(pose[pose == 0]).any()


@given(chains_and_positions())
def test_quaternions_are_those_nearer_to_that_at_zero(case: tuple[Chain, list]) -> None:
    chain, Q = case
    zero = np.array(chain.pose([0.0] * chain.n)[3:])
    if abs(zero[3]) > 2e-6:
        assert zero[3] > 0
    elif abs(zero[3]) < 1e-7:
        largest = np.abs(zero[:3]).max()
        assert any(value > largest - 1e-5 for value in zero[:3])
    for q in Q:
        assert np.dot(chain.pose(q)[3:], zero) > -1e-12


@given(chains_and_positions())
def test_many_poses_are_each_ones(case: tuple[Chain, list]) -> None:
    chain, Q = case
    T, poses = np.array([chain.forward(q) for q in Q]), chain.poses(Q)
    assert np.abs(poses[:, :3] - T[:, :3, 3]).max() < 1e-13
    assert np.abs(quaternion_to_matrix(poses[:, 3:]) - T[:, :3, :3]).max() < 1e-13
    assert np.abs(np.linalg.norm(poses[:, 3:], axis=1) - 1).max() < 1e-14
    assert not np.signbit(poses[poses == 0]).any()
    assert np.array_equal(chain.forward(Q), T)
    zero = chain.pose([0.0] * chain.n)[3:]
    for many, one in zip(poses[:, 3:], map(chain.pose, Q), strict=True):
        if abs(np.dot(many, zero)) > 1e-9:
            assert np.dot(many, one[3:]) > 0


@given(chains_and_positions(), st.data())
def test_a_twist_is_the_jacobian_times_the_velocities(case: tuple[Chain, list],
                                                      data: st.DataObject) -> None:
    chain, Q = case
    speeds = st.one_of(st.sampled_from([0.0, -0.0, 1.0]), st.floats(-20, 20))
    for q in Q:
        qdot = data.draw(st.lists(speeds, min_size=chain.n, max_size=chain.n))
        twist = np.array(chain.twist(q, qdot))
        assert np.abs(twist - chain.jacobian(q) @ qdot).max() < 1e-11
        assert not np.signbit(twist[twist == 0]).any()


def test_a_rotation_written_with_few_digits_stays_a_rotation() -> None:
    T = np.eye(4)
    T[:2, :2] = [[0.7071068, -0.7071068], [0.7071068, 0.7071068]]
    chain = chain_of([DHLink(1, 0, 0), DHLink(0, 1, pi / 2)], T, T)
    R = chain.forward([0.1, 0.2])[:3, :3]
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-15
    assert np.abs(quaternion_to_matrix(chain.pose([0.1, 0.2])[3:]) - R).max() < 1e-15


@given(chains_and_positions())
def test_the_jacobian_is_the_derivative_of_the_pose(case: tuple[Chain, list]) -> None:
    chain, Q = case
    step = 1e-5
    for q in Q:
        J, R = chain.jacobian(q), chain.forward(q)[:3, :3]
        steps = np.array(q) + step * np.vstack((np.eye(chain.n), -np.eye(chain.n)))
        for i, D in enumerate(np.subtract(*np.split(chain.forward(steps), 2)) / (2 * step)):
            spin = D[:3, :3] @ R.T  # the cross-product matrix of the angular velocity
            expected = [*D[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]]
            assert J[:, i] == pytest.approx(expected, abs=1e-7)


@given(chains_and_positions(), st.data())
def test_composing_equals_multiplying(case: tuple[Chain, list], data: st.DataObject) -> None:
    """A chain cut in two is the product of its halves, and its frames say where it was cut."""
    chain, Q = case
    cut = data.draw(st.integers(1, len(chain.links)))
    n = sum(link.joint_type != 'fixed' for link in chain.links[:cut])
    for q in Q:
        T = chain.frames(q)[cut]
        if n:
            assert np.abs(chain_of(chain.links[:cut], chain.T_root_0).forward(q[:n]) - T
                          ).max() < 1e-13
        if n < chain.n:
            rest = chain_of(chain.links[cut:], None, chain.T_n_tip)
            assert np.abs(T @ rest.forward(q[n:]) - chain.forward(q)).max() < 1e-13
            joined = chain_of(chain.links[cut:], T, chain.T_n_tip)
            assert np.abs(joined.forward(q[n:]) - chain.forward(q)).max() < 1e-13


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
    few, many = peak_beyond_result(10_000), peak_beyond_result(200_000)
    assert many < few + 100_000


LEG = Catalog.load().chain('left_leg', 'v2_5')
SLIDE = chain_of([DHLink(0, 0, 0, joint_type='prismatic')] * 2)
NOT_NUMBERS = [
    [0.0] * 5, [0.0] * 7, [], [0.0, 0.0, float('nan'), 0.0, 0.0, 0.0],
    [float('inf')] + [0.0] * 5, [float('-inf')] * 6, [None] * 6, ['0'] * 6, ['a\nb'] * 6,
    [1j] * 6, [10 ** 400] * 6, [[0.0]] * 6, ['x' * 1000] * 6, 'abcdef', None, 0.0,
    np.zeros(6, complex), np.array(['0'] * 6), {0.0}, b'123456',
]


DOORS = {
    'forward': LEG.forward, 'frames': LEG.frames, 'jacobian': LEG.jacobian, 'pose': LEG.pose,
    'poses': lambda q: LEG.poses([q]), 'twist': lambda q: LEG.twist(q, [0.0] * 6),
    'velocities': lambda qdot: LEG.twist([0.0] * 6, qdot),
}


@pytest.mark.parametrize('door', DOORS)
@pytest.mark.parametrize('q', NOT_NUMBERS, ids=lambda q: repr(q)[:30])
def test_a_bad_joint_vector_is_refused_by_every_door_in_one_line(q: object, door: str) -> None:
    with pytest.raises(JointVectorError, match=r'allowed') as refusal:
        DOORS[door](q)
    assert '\n' not in str(refusal.value) and len(str(refusal.value)) < 700


@pytest.mark.parametrize('door', DOORS)
def test_an_iterator_is_refused_by_every_door(door: str) -> None:
    with pytest.raises(JointVectorError, match='allowed'):
        DOORS[door](iter([0.0] * 6))


@pytest.mark.parametrize('door', [LEG.forward, LEG.pose, lambda q: LEG.poses(q[None])])
def test_a_masked_array_is_refused_for_its_gaps(door: Any) -> None:
    with pytest.raises(JointVectorError, match='MaskedArray'):
        door(np.ma.array([0.0] * 6, mask=[True] + [False] * 5))


@pytest.mark.parametrize('value', [float('nan'), float('inf'), float('-inf')])
def test_a_bad_entry_is_named_by_its_place(value: float) -> None:
    with pytest.raises(JointVectorError, match=r'q\[2\] is (nan|-?inf); finite numbers are allow'):
        LEG.pose([0.0, 0.0, value, 0.0, 0.0, 0.0])
    Q = np.zeros((5000, 6))
    Q[4321, 5] = value
    for refuse in (LEG.poses, LEG.forward):
        with pytest.raises(JointVectorError, match=r'q\[4321, 5\] is (nan|-?inf)'):
            refuse(Q)


@pytest.mark.parametrize('number', [float, int, np.float64, np.float32, np.float16, np.longdouble,
                                    np.int64, np.uint8])
@pytest.mark.parametrize('several', [list, tuple, np.array])
def test_numbers_of_any_type_are_computed_in_float64(number: type, several: Any) -> None:
    for table in (LEG, chain_of([DHLink(0.3, 0.1, 0.4, joint_type='prismatic')] * 6)):
        q = several([number(value) for value in (1, 0.3, 2, 0.7, 0, 1.1)])
        exact = [float(value) for value in q]
        assert table.pose(q) == table.pose(exact)
        assert table.twist(q, q) == table.twist(exact, exact)
        assert {type(value) for value in (*table.pose(q), *table.twist(q, q))} == {float}
        assert np.array_equal(table.forward(q), table.forward(exact))
        assert table.poses([q]).dtype == np.float64


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('chain', [LEG, SLIDE], ids=['turning', 'sliding'])
def test_values_too_large_to_compute_with_are_refused(chain: Chain) -> None:
    q = [1.7e308] * len(chain.links)
    with pytest.raises(JointVectorError, match='too large to compute with'):
        chain.pose(q)
    with pytest.raises(JointVectorError, match='too large to compute with'):
        chain.poses([[0.0] * len(q), q])


def test_no_joint_vectors_give_no_poses() -> None:
    assert LEG.poses(np.empty((0, 6))).shape == (0, 7)
    assert LEG.forward(np.empty((0, 6))).shape == (0, 4, 4)


@given(st.lists(st.integers(0, 3), max_size=3))
def test_forward_and_frames_broadcast(shape: list[int]) -> None:
    Q = np.random.default_rng(15).uniform(-1, 1, (*shape, 6))
    T = LEG.forward(Q)
    assert T.shape == (*shape, 4, 4)
    assert LEG.frames(Q).shape == (*shape, 8, 4, 4)
    for index in np.ndindex(*shape):
        assert np.array_equal(T[index], LEG.forward(Q[index]))


@pytest.mark.parametrize('Q', [[0.0] * 6, [[0.0] * 5], [[[0.0] * 6]], 3.0, [[0.0] * 6, [0.0]]],
                         ids=repr)
def test_arrays_of_another_shape_are_refused(Q: object) -> None:
    with pytest.raises(JointVectorError, match=r'\(N, 6\)'):
        LEG.poses(Q)


def test_a_joint_vector_of_another_length_is_not_looked_up_in_the_ranges() -> None:
    with pytest.raises(JointVectorError, match='6 numbers are allowed'):
        LEG.out_of_range([0.0] * 5)
    with pytest.raises(JointVectorError, match='6 numbers are allowed'):
        LEG.out_of_range('abcdef')  # type: ignore[arg-type]


@pytest.mark.parametrize('mistake', [
    lambda: chain_of([]),
    lambda: chain_of([DHLink(0, 0, 0)], np.diag([2.0, 1, 1, 1])),
    lambda: chain_of([DHLink(0, 0, 0)], np.eye(3)),
    lambda: chain_of([DHLink(0, 0, 0)], None, np.zeros((4, 4))),
    lambda: chain_of([DHLink(0, 0, 0, joint_type='fixed')]),
    lambda: DHLink(0, 0, 0, sign=2),
    lambda: DHLink(0, 0, 0, robot_range=(1, 0)),
    lambda: Chain('a', '', 'r', 't', 'f', ('j',), (DHLink(0, 0, 0),) * 2, np.eye(4)),
    lambda: Chain('a', '', 'r', 't', 'f', ('j', 'j'), (DHLink(0, 0, 0),) * 2, np.eye(4)),
    lambda: DHLink(0, float('nan'), 0),
    lambda: DHLink(0, 0, 0, joint_type='screw'),
    lambda: DHLink(0, 0, 0, lower=1, upper=-1),
])
def test_a_chain_that_cannot_be_is_refused(mistake: object) -> None:
    with pytest.raises(LegFKError, match=r'; allowed: .'):
        mistake()  # type: ignore[operator]


@given(CHAINS)
def test_a_chain_is_a_value(chain: Chain) -> None:
    """It copies, pickles, compares and hashes by what it holds, and nobody can write to it."""
    for again in (pickle.loads(pickle.dumps(chain)), copy.deepcopy(chain), copy.copy(chain)):
        assert again == chain and hash(again) == hash(chain)
        for array in (again.T_root_0, again.T_n_tip, again.lower, again.upper):
            with pytest.raises(ValueError, match='read-only'):
                array[...] = 1
    assert chain != chain_of([*chain.links, DHLink(0, 0, 0)], chain.T_root_0, chain.T_n_tip)


def test_what_is_handed_out_does_not_change_a_chain() -> None:
    before = LEG.pose([0.1] * 6)
    for mine in (LEG.forward([0.0] * 6), LEG.frames([0.0] * 6), LEG.jacobian([0.0] * 6)):
        mine[...] = 7
    assert LEG.pose([0.1] * 6) == before


def test_a_chain_prints_as_its_table() -> None:
    heading, titles, *rows = str(LEG).splitlines()
    assert 'mm, deg' in heading and 'standard' in heading
    assert titles.split() == ['i', 'joint', 'a', 'd', 'alpha', 'theta', 'range']
    assert rows[2].split() == ['2', 'l_hip_yaw', '-0.9175', '-234.545', '90', '-90', '+', 'q',
                               '-80', '..', '80']
    assert '\n' not in repr(LEG) and 'left_leg v2_5' in repr(LEG)


def test_limits_are_the_robots_where_known_and_else_the_printed_ones() -> None:
    assert np.degrees(LEG.lower) == pytest.approx([-45, -20, -80, -124, -35, -25])
    old = Catalog.load().chain('left_leg', 'v1')
    assert np.degrees(old.upper) == pytest.approx([132, 17, 79, 0, 21, 24])
    assert (LEG.n, old.n) == (6, 6)
