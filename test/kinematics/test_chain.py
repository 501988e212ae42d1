"""Properties of any chain: random tables, rows that follow, sliding joints, odd twists."""

import copy
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from math import inf, nan, pi
import pickle
import tracemalloc

from hypothesis import given
from hypothesis import strategies as st
from icub_leg_fk.errors import JointVectorError, LegFKError, UnknownNameError
from icub_leg_fk.kinematics import Catalog, DHLink, TipFrame
import numpy as np
import pytest
from support.any_chain import chain_of, CHAINS, chains_and_positions
from support.oracle import frames, quaternion_to_matrix

LEG = Catalog.load().chain('left_leg', 'v2_5')


LARGE_ANGLES = st.lists(st.floats(-1e300, 1e300), min_size=6, max_size=6)
ANY = st.one_of(
    chains_and_positions(),
    st.tuples(st.just(LEG), st.lists(LARGE_ANGLES, min_size=1, max_size=3)),
)


@given(ANY)
def test_frames_and_forward_are_the_products_of_the_basic_transforms(case):
    chain, Q = case
    for q in Q:
        found = chain.frames(q)
        assert np.abs(found - frames(chain, q)).max() < 1e-13
        assert np.array_equal(found[-1], chain.forward(q))


@given(ANY)
def test_one_pose_and_many_are_forward(case):
    """Their quaternion is the one nearer to that at zero."""
    chain, Q = case
    zero = np.array(chain.pose([0.0] * chain.n)[3:])
    T, ones = chain.forward(Q), np.array([chain.pose(q) for q in Q])
    assert np.array_equal(T, [chain.forward(q) for q in Q])
    for poses in (ones, chain.poses(Q)):
        positions, quaternions = poses[:, :3], poses[:, 3:]
        assert np.abs(positions - T[:, :3, 3]).max() < 1e-13
        assert np.abs(quaternion_to_matrix(quaternions) - T[:, :3, :3]).max() < 1e-13
        assert np.abs(np.linalg.norm(quaternions, axis=1) - 1).max() < 1e-14
        assert (quaternions @ zero).min() > -1e-12
        assert not np.signbit(poses[poses == 0]).any()
        is_clear = np.abs(quaternions @ zero) > 1e-9
        assert (np.abs(poses - ones)[is_clear] < 1e-13).all()


@given(chains_and_positions(), st.data())
def test_a_twist_is_the_jacobian_times_the_velocities(case, data):
    chain, Q = case
    speeds = st.one_of(st.sampled_from([0.0, -0.0, 1.0]), st.floats(-20, 20))
    for q in Q:
        qdot = data.draw(st.lists(speeds, min_size=chain.n, max_size=chain.n))
        twist = np.array(chain.twist(q, qdot))
        assert np.abs(twist - chain.jacobian(q) @ qdot).max() < 1e-11
        assert not np.signbit(twist[twist == 0]).any()


@given(chains_and_positions())
def test_the_jacobian_is_the_derivative_of_the_pose(case):
    chain, Q = case
    step = 1e-5
    for q in Q:
        J, R = chain.jacobian(q), chain.forward(q)[:3, :3]
        steps = np.array(q) + step * np.vstack((np.eye(chain.n), -np.eye(chain.n)))
        ahead, behind = np.split(chain.forward(steps), 2)
        for column, D in zip(J.T, (ahead - behind) / (2 * step), strict=True):
            spin = D[:3, :3] @ R.T  # the cross-product matrix of the angular velocity
            expected = [*D[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]]
            assert column == pytest.approx(expected, abs=1e-7)


@given(chains_and_positions())
def test_a_mapping_is_as_good_as_a_list_and_may_hold_more(case):
    chain, Q = case
    for q in Q:
        named = {'other': nan, **dict(zip(chain.joint_names, q, strict=True))}
        assert chain.pose(named) == chain.pose(q)
        assert np.array_equal(chain.forward(named), chain.forward(q))
    columns = dict(zip(chain.joint_names, np.array(Q).T, strict=True))
    assert np.array_equal(chain.poses(columns), chain.poses(Q))
    assert np.array_equal(chain.forward(columns), chain.forward(Q))


@given(CHAINS)
def test_the_quaternion_at_zero_has_the_sign_of_its_own_rule(chain):
    *xyz, w = chain.pose([0.0] * chain.n)[3:]
    if abs(w) > 2e-6:
        assert w > 0
    elif abs(w) < 1e-7:
        assert max(xyz) > max(map(abs, xyz)) - 1e-5


def test_a_mapping_that_lacks_a_joint_is_refused_by_its_name():
    with pytest.raises(
        JointVectorError, match=r'q lacks l_knee, l_ankle_pitch; allowed'
    ):
        LEG.pose(dict.fromkeys((*LEG.joint_names[:3], LEG.joint_names[5]), 0.0))


def test_a_slide_that_follows_a_turn_is_a_screw():
    screw = chain_of(
        [
            DHLink(0, 0, 0, joint='nut'),
            DHLink(0.3, 0, 0, joint='nut', joint_type='prismatic', gain=0.01),
        ],
        joint_names=['nut'],
    )
    assert screw.forward([pi / 2])[:3, 3] == pytest.approx([0, 0.3, 0.01 * pi / 2])
    assert screw.jacobian([0.0])[:, 0] == pytest.approx([0, 0.3, 0.01, 0, 0, 1])


def test_memory_beyond_the_result_does_not_grow_with_the_number_of_poses():
    def peak_beyond_result(rows):
        Q = np.random.default_rng(14).uniform(-1, 1, (rows, 6))
        tracemalloc.start()
        result = LEG.poses(Q)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak - result.nbytes

    peak_beyond_result(10)
    few, many = peak_beyond_result(10_000), peak_beyond_result(200_000)
    assert many < few + 1_000_000


NOT_NUMBERS = [
    [0.0] * 5,
    [0.0] * 7,
    [],
    [0.0, 0.0, nan, 0.0, 0.0, 0.0],
    [inf] + [0.0] * 5,
    [None] * 6,
    [Decimal(1), '2'] * 3,
    ['0'] * 6,
    ['a\nb'] * 6,
    [1j] * 6,
    [10**400] * 6,
    [[0.0]] * 6,
    ['x' * 1000] * 6,
    'abcdef',
    None,
    0.0,
    np.zeros(6, complex),
    np.array(['0'] * 6),
    {0.0},
    b'123456',
    {'l_knee': 0.0},
    dict.fromkeys(LEG.joint_names, 'x'),
    iter([0.0] * 6),
    np.ma.array([0.0] * 6, mask=True),
]
DOORS = {
    'forward': LEG.forward,
    'frames': LEG.frames,
    'jacobian': LEG.jacobian,
    'pose': LEG.pose,
    'out_of_range': LEG.out_of_range,
    'poses': lambda q: LEG.poses([q]),
    'twist': lambda q: LEG.twist(q, [0.0] * 6),
    'velocities': lambda qdot: LEG.twist([0.0] * 6, qdot),
}


@pytest.mark.parametrize('door', DOORS)
@pytest.mark.parametrize('q', NOT_NUMBERS, ids=lambda q: repr(q)[:20])
def test_a_bad_joint_vector_is_refused_by_every_door_in_one_line(q, door):
    if door == 'poses' and type(q) is np.ma.MaskedArray:
        q = np.ma.array([q])
    with pytest.raises(JointVectorError, match=r'; allowed: ') as refusal:
        DOORS[door](q)
    assert str(refusal.value).isprintable() and len(str(refusal.value)) < 700
    assert pickle.loads(pickle.dumps(refusal.value)).fault == refusal.value.fault


@pytest.mark.parametrize('value', [nan, inf, -inf])
def test_a_bad_entry_is_named_by_its_place(value):
    with pytest.raises(
        JointVectorError, match=r'q\[2\] is (nan|-?inf); allowed: finite numbers'
    ):
        LEG.pose([0.0, 0.0, value, 0.0, 0.0, 0.0])
    with pytest.raises(JointVectorError, match=r'qdot\[2\] is (nan|-?inf)'):
        LEG.twist([0.0] * 6, np.array([0.0, 0.0, value, 0.0, 0.0, 0.0]))
    Q = np.zeros((5000, 6))
    Q[4321, 5] = value
    for refuse in (LEG.poses, LEG.forward):
        with pytest.raises(JointVectorError, match=r'q\[4321, 5\] is (nan|-?inf)'):
            refuse(Q)


@pytest.mark.parametrize(
    'number',
    [
        float,
        int,
        bool,
        np.bool_,
        np.float64,
        np.float32,
        np.float16,
        np.longdouble,
        np.int64,
        np.uint8,
        Decimal,
        Fraction,
    ],
)
@pytest.mark.parametrize('several', [list, tuple, np.array])
def test_numbers_of_any_type_are_computed_in_float64(number, several):
    for table in (LEG, chain_of([DHLink(0.3, 0.1, 0.4, joint_type='prismatic')] * 6)):
        q = several([number(value) for value in (1, 0.3, 2, 0.7, 0, 1.1)])
        exact = [float(value) for value in q]
        assert table.pose(q) == table.pose(exact)
        assert table.twist(q, q) == table.twist(exact, exact)
        assert {type(value) for value in (*table.pose(q), *table.twist(q, q))} == {
            float
        }
        assert np.array_equal(table.forward(q), table.forward(exact))
        assert table.poses([q]).dtype == np.float64


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('door', ['forward', 'frames', 'pose', 'poses', 'jacobian'])
@pytest.mark.parametrize('gain', [1.0, 2.0])
def test_values_too_large_to_compute_with_are_refused(door, gain):
    slide = DHLink(0, 1e308, 0, joint_type='prismatic', gain=gain)
    for chain in (chain_of([slide] * 2), chain_of([slide, DHLink(0, 0, 0, gain=1e10)])):
        q = [1.7e308] * 2
        with pytest.raises(JointVectorError, match='too large to compute with'):
            getattr(chain, door)([[0.0] * 2, q] if door == 'poses' else q)


@given(st.lists(st.integers(0, 3), max_size=3))
def test_forward_and_frames_broadcast(shape):
    Q = np.random.default_rng(15).uniform(-1, 1, (*shape, 6))
    T = LEG.forward(Q)
    assert T.shape == (*shape, 4, 4)
    assert LEG.frames(Q).shape == (*shape, 8, 4, 4)
    assert LEG.poses(Q.reshape(-1, 6)).shape == (Q.size // 6, 7)
    for index in np.ndindex(*shape):
        assert np.array_equal(T[index], LEG.forward(Q[index]))


@pytest.mark.parametrize(
    'Q', [[0.0] * 6, [[0.0] * 5], [[[0.0] * 6]], 3.0, [[0.0] * 6, [0.0]]], ids=repr
)
def test_arrays_of_another_shape_are_refused(Q):
    with pytest.raises(JointVectorError, match=r'\(N, 6\)'):
        LEG.poses(Q)


TURN, FIXED = DHLink(0, 0, 0), DHLink(0, 0, 0, joint_type='fixed')
ONE_JOINT = chain_of([TURN])


@pytest.mark.parametrize(
    'mistake',
    [
        {'links': ()},
        {'links': (FIXED,)},
        {'links': (TURN, TURN)},
        {'joint_names': ()},
        {'joint_names': ('j', 'k')},
        {'links': (TURN, TURN), 'joint_names': ('j', 'j')},
        {'links': (replace(TURN, joint='j'),) * 2, 'joint_names': ('j', 'k')},
        {'T_root_0': np.diag([2.0, 1, 1, 1])},
        {'T_root_0': np.eye(3)},
        {'T_root_0': 'nothing'},
        {'T_n_tip': np.zeros((4, 4))},
        {'convention': 'craig'},
        {'convention': 'modified', 'links': (DHLink(1, 0, 0),)},
    ],
    ids=repr,
)
def test_a_chain_that_cannot_be_is_refused(mistake):
    with pytest.raises(LegFKError, match=r'; allowed( in .*)?: .'):
        replace(ONE_JOINT, **mistake)


@pytest.mark.parametrize(
    'mistake',
    [
        {'gain': 0},
        {'d': nan},
        {'joint': 'j', 'joint_type': 'fixed'},
        {'joint_type': 'screw'},
        {'robot_range': (1, 0)},
        {'lower': 1, 'upper': -1},
    ],
    ids=repr,
)
def test_a_row_that_cannot_be_is_refused(mistake):
    with pytest.raises(LegFKError, match=r'; allowed: .'):
        replace(TURN, **mistake)


def test_a_tip_frame_that_cannot_be_is_refused():
    with pytest.raises(LegFKError, match=r'transform of tip frame sole is .*; allowed'):
        TipFrame('sole', np.zeros((4, 4)))


def test_a_row_of_an_unknown_joint_is_refused():
    with pytest.raises(
        UnknownNameError, match="unknown joint 'knee' of chain any; known: hip"
    ):
        chain_of([DHLink(0, 0, 0, joint='knee')], joint_names=['hip'])


@given(CHAINS)
def test_a_chain_is_a_value(chain):
    """It copies, pickles, compares and hashes by what it holds, and nobody can write to it."""
    before = chain.pose([0.1] * chain.n)
    for again in (
        pickle.loads(pickle.dumps(chain)),
        copy.deepcopy(chain),
        copy.copy(chain),
    ):
        assert again == chain and hash(again) == hash(chain)
        tip_frame = again.tip_frames[again.frame]
        for array in (
            again.T_root_0,
            again.T_n_tip,
            again.lower,
            again.upper,
            tip_frame.T_tip_frame,
        ):
            with pytest.raises(ValueError, match='read-only'):
                array[...] = 1
        with pytest.raises(TypeError):
            again.tip_frames['other'] = tip_frame  # type: ignore[index]
        assert again.pose([0.1] * chain.n) == before
    assert chain != chain_of(
        [*chain.links, DHLink(0, 0, 0)],
        chain.T_root_0,
        chain.T_n_tip,
        [*chain.joint_names, 'more'],
    )
    assert chain != 'chain'


def test_what_is_handed_out_does_not_change_a_chain():
    before = LEG.pose([0.1] * 6)
    sole = LEG.sole_outline([0.0] * 6)
    for mine in (
        LEG.forward([0.0] * 6),
        LEG.frames([0.0] * 6),
        LEG.jacobian([0.0] * 6),
        sole,
    ):
        mine[...] = 7
    assert LEG.pose([0.1] * 6) == before
    assert np.abs(LEG.sole_outline([0.0] * 6)).max() < 1


def test_a_chain_in_another_frame_of_its_tip():
    sole = LEG.with_frame('sole')
    assert (LEG.frame, LEG.frame_id) == ('dh', 'l_foot_dh_frame')
    assert (sole.frame, sole.frame_id) == ('sole', 'l_sole')
    assert sole.with_frame('dh') == LEG and LEG.with_frame('dh') is LEG
    with pytest.raises(
        UnknownNameError, match="'toe' of chain left_leg; known: dh, sole"
    ):
        LEG.with_frame('toe')


def test_the_sole_is_where_the_sole_frame_is_whatever_frame_poses_are_in():
    q = [0.1, 0.2, -0.3, -0.4, 0.2, 0.1]
    corners = np.array(
        [[-0.07, 0.04, 0], [0.12, 0.04, 0], [0.12, -0.04, 0], [-0.07, -0.04, 0]]
    )
    T = LEG.with_frame('sole').forward(q)
    expected = corners @ T[:3, :3].T + T[:3, 3]
    for chain in (LEG, LEG.with_frame('sole')):
        assert chain.sole_outline(q) == pytest.approx(expected, abs=1e-15)
    assert Catalog.load().chain('head_imu').sole_outline([0.0] * 6) is None


def test_a_chain_prints_as_its_table():
    heading, titles, *rows = str(LEG).splitlines()
    assert 'mm, deg' in heading and 'standard' in heading
    assert titles.split() == ['i', 'joint', 'a', 'd', 'alpha', 'theta', 'range']
    assert rows[2].split() == [
        '2',
        'l_hip_yaw',
        '-0.9175',
        '-234.545',
        '90',
        '-90',
        '+',
        'q',
        '-80',
        '..',
        '80',
        'deg',
    ]


def test_a_notebook_shows_the_table_with_names_of_any_text():
    odd = chain_of(
        [DHLink(0, 0, 0), DHLink(0, 0.2, 0, joint_type='prismatic', gain=-0.5)],
        joint_names=['a<b>', '&c'],
    )
    html = odd._repr_html_()
    assert html.startswith('<table>') and html.endswith('</table>')
    assert html.count('<tr>') == 3 and html.count('<th>') == 7
    assert '<td>a&lt;b&gt;</td>' in html and '<td>&amp;c</td>' in html
    assert '<td>200 - 0.5 q</td>' in html


@given(CHAINS)
def test_every_repr_fits_a_line(chain):
    shown = [
        chain,
        chain.rows()[0],
        chain.links[-1],
        chain.tip_frames['tip'],
        chain.pose([0.1] * chain.n),
        chain.twist([0.1] * chain.n, [1 / 3] * chain.n),
    ]
    for thing in shown:
        assert len(repr(thing)) < 120 and repr(thing).isprintable()


def test_limits_are_the_robots_where_known_and_else_the_printed_ones():
    assert np.degrees(LEG.lower) == pytest.approx([-45, -20, -80, -124, -35, -25])
    old = Catalog.load().chain('left_leg', 'v1')
    assert np.degrees(old.upper) == pytest.approx([132, 17, 79, 0, 21, 24])
    assert (LEG.n, old.n) == (6, 6)
