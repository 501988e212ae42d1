"""A URDF read and made a table: on every robot there is beside Pinocchio, and on random ones."""

from functools import cache, partial
import importlib.util
from pathlib import Path
import re
import sys

from hypothesis import given
from hypothesis import strategies as st
from icub_leg_fk.errors import InputFileError, LegFKError, UnknownNameError
from icub_leg_fk.kinematics import chain_from_urdf, Urdf
from icub_leg_fk.kinematics.difference import difference, postures
from icub_leg_fk.kinematics.table_from_urdf import almost_parallel, as_modified, TIDY
import numpy as np
import pytest
from support.robots import joint, robot

SHARED = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'urdf'
EXACT = 1e-9  # m and rad


@cache
def robots():
    """Return the URDFs of example-robot-data, which pip installs beside Pinocchio."""
    found = importlib.util.find_spec('pinocchio')
    folders = Path(found.origin).parents if found and found.origin else ()
    for folder in folders:
        if (folder / 'share' / 'example-robot-data').is_dir():
            return sorted((folder / 'share' / 'example-robot-data').rglob('*.urdf'))
    return []


@cache
def icubs():
    """Return the URDFs of icub-models, and those beside the project."""
    installed = Path(sys.prefix, 'share', 'iCub', 'robots')
    return [*sorted(installed.glob('*/model.urdf')), *sorted(SHARED.glob('*.urdf'))]


class Robot:
    """A URDF in Pinocchio."""

    def __init__(self, text):
        self.pin = pytest.importorskip('pinocchio')
        try:
            self.model = self.pin.buildModelFromXML(text, mimic=True)
            self.mimics = {}
        except (
            ValueError
        ):  # a joint that mimics one that is not there, which we give it by hand
            self.model = self.pin.buildModelFromXML(text)
            self.mimics = {joint.name: joint.texts for joint in load(text).joints}
        self.data = self.model.createData()

    def forward(self, root, tip, names, Q):
        return np.array(
            [self._pose(root, tip, dict(zip(names, row, strict=True))) for row in Q]
        )

    def _pose(self, root, tip, positions):
        q = self.pin.neutral(self.model)
        for name, texts in self.mimics.items():
            if ('mimic', 'joint') in texts:
                master = positions.get(texts['mimic', 'joint'], 0.0)
                positions[name] = float(
                    texts.get(('mimic', 'multiplier'), 1)
                ) * master + float(texts.get(('mimic', 'offset'), 0))
        for name, value in positions.items():
            if self.model.existJointName(name):
                joint = self.model.joints[self.model.getJointId(name)]
                turns = [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
                q[joint.idx_q : joint.idx_q + joint.nq] = turns
        self.pin.framesForwardKinematics(self.model, self.data, q)
        body = self.pin.FrameType.BODY
        T_root, T_tip = (
            self.data.oMf[self.model.getFrameId(link, body)] for link in (root, tip)
        )
        return np.array((T_root.inverse() * T_tip).homogeneous)


@cache
def pinocchio_robot(file):
    return Robot(
        file.read_text().replace('<robot>', '<robot name="unnamed">')
    )  # it wants one


def check(file, urdf, oracle, tip):
    """Check a chain in both conventions, and that none of its numbers is large."""
    root = urdf.root()
    chain = chain_from_urdf(urdf, root, tip)
    Q = np.random.default_rng(4).uniform(-1.5, 1.5, (3, chain.n))
    expected = oracle.forward(root, tip, chain.joint_names, Q)
    for table in (chain, as_modified(chain)):
        assert np.abs(table.forward(Q) - expected).max() < EXACT, (file, tip)
        assert np.abs(table.poses(Q)[:, :3] - expected[:, :3, 3]).max() < EXACT, (
            file,
            tip,
        )
    assert longest(chain) < 10, (file, tip)


@pytest.mark.parametrize('tip', ['l_sole', 'r_foot_dh_frame', 'imu_frame', 'l_hand'])
def test_the_chains_of_the_icubs_are_pinocchios(tip):
    if not icubs():
        pytest.skip('icub-models is not installed, and ../shared is not there')
    for file in icubs():
        urdf = Urdf.load(file)
        if tip in urdf.links:
            check(file, urdf, pinocchio_robot(file), tip)


def test_every_chain_of_every_example_robot_is_pinocchios():
    if not robots():
        pytest.skip('example-robot-data is not installed')
    done, refused = 0, []
    for file in robots():
        urdf = Urdf.load(file)
        if not urdf.links:  # ur3.urdf of example-robot-data holds nothing
            continue
        for tip in urdf.ends():
            try:
                check(file, urdf, pinocchio_robot(file), tip)
                done += 1
            except InputFileError as error:
                refused.append(error.fault)
    print(f'{done} chains of {len(robots())} files')
    assert done >= 585
    for (
        fault
    ) in refused:  # what cannot be a table: a link that is fixed, or a joint's type
        assert (
            fault.startswith('no joint moves')
            or ' is floating' in fault
            or (' is planar' in fault)
        ), fault


def load(text):
    return Urdf.parse(text.encode(), 'robot.urdf')


def table(*joints):
    """Return the chain that some joints make, from the first link to the last."""
    return chain_from_urdf(load(robot(joints)), 'l0', f'l{len(joints)}')


def longest(chain):
    """Return the largest a or d of a chain [m]."""
    return max(max(abs(link.a), abs(link.d)) for link in chain.links)


NUMBERS = st.one_of(st.sampled_from([0.0, 0.1, -0.25]), st.floats(-0.5, 0.5))
ANGLES = st.one_of(
    st.sampled_from(
        [0.0, np.pi / 2, -np.pi / 2, np.pi, 1e-3, -3e-2, 5e-5, np.pi - 1e-3, 1e-7]
    ),
    st.floats(-3.2, 3.2),
)
AXES = st.one_of(
    st.sampled_from(['1 0 0', '0 1 0', '0 0 1', '-1 0 0', '0 0 -1']),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.2, 1)).map(
        lambda axis: ' '.join(map(repr, axis))
    ),
)


GAINS = st.sampled_from([1.0, -1.0, 0.5, 0.0])


@st.composite
def random_robots(draw):
    kinds = draw(
        st.lists(
            st.sampled_from(['revolute', 'continuous', 'prismatic', 'fixed']),
            min_size=1,
            max_size=7,
        )
    )
    kinds[draw(st.integers(0, len(kinds) - 1))] = 'revolute'

    def triple(values):
        return ' '.join(repr(draw(values)) for _ in range(3))

    joints = []
    for i, kind in enumerate(kinds):
        mimic = ''
        if draw(st.integers(0, 3)) == 0 and kind != 'fixed':
            mimic = f'<mimic joint="m" multiplier="{draw(GAINS)}" offset="{draw(NUMBERS)}"/>'
        joints.append(
            joint(i, kind, triple(NUMBERS), triple(ANGLES), draw(AXES), mimic)
        )
    return robot(joints)


@given(random_robots())
def test_any_robot_is_its_urdf_multiplied_out_and_never_kilometres_long(text):
    urdf = load(text)
    root, tip = 'l0', urdf.links[-1]
    try:
        exact = chain_from_urdf(urdf, root, tip)
    except InputFileError as error:  # all that moves mimics with a multiplier of 0
        assert 'no joint moves' in error.fault
        return
    tidied = chain_from_urdf(urdf, root, tip, tolerance=TIDY)
    positions = postures(exact, 20, 2.0, whole_range=False)
    expected = urdf.forward(root, tip, positions)
    for chain in (exact, as_modified(exact)):
        assert np.abs(chain.forward(positions) - expected).max() < EXACT
    assert np.abs(tidied.forward(positions) - expected).max() < 100 * TIDY
    assert max(longest(exact), longest(tidied)) < 10


@given(random_robots())
def test_any_robot_is_pinocchios(text):
    urdf, tip = load(text), f'l{text.count("<joint")}'
    try:
        chain = chain_from_urdf(urdf, 'l0', tip)
    except InputFileError:
        return
    Q = np.random.default_rng(7).uniform(-2, 2, (5, chain.n))
    expected = Robot(text).forward('l0', tip, chain.joint_names, Q)
    assert np.abs(chain.forward(Q) - expected).max() < EXACT


def test_axes_that_truly_are_a_little_apart_get_a_fixed_row():
    """A calibrated UR5 gets d = 574 m from its maker's tool."""
    urdf = load(
        robot(
            [
                joint(0, axis='0 0 1'),
                joint(1, xyz='0.4 0 0.1', rpy='0.0007 0.0003 0'),
                joint(2, xyz='0.4 0 0', rpy='0 0.0005 0'),
            ]
        )
    )
    chain = chain_from_urdf(urdf, 'l0', 'l3', tolerance=TIDY)
    assert [link.joint_type for link in chain.links].count('fixed') == 2
    assert longest(chain) < 1
    found = difference(
        chain.forward, partial(urdf.forward, 'l0', 'l3'), postures(chain, 50)
    )
    assert max(found) < 1e-6  # mm and deg


def test_a_tidied_table_has_right_angles_parallel_axes_and_no_nanometres():
    urdf = load(
        robot(
            [
                joint(0),
                joint(1, xyz='0.4 0 5e-9', rpy='1.57083 0.00003 0'),
                joint(2, xyz='0.3 0 0', rpy='0.00005 0 0'),
            ]
        )
    )
    tidied = chain_from_urdf(urdf, 'l0', 'l3', tolerance=TIDY)
    assert [link.a for link in tidied.links] == pytest.approx([0.4, 0.3, 0], abs=1e-5)
    assert [link.d for link in tidied.links[:2]] == [0, 0]
    assert [link.alpha for link in tidied.links] == [np.pi / 2, 0, 0]
    assert almost_parallel(urdf, 'l0', 'l3', TIDY) == [
        ('j1', 'j2', pytest.approx(5e-5))
    ]
    found = difference(
        tidied.forward, partial(urdf.forward, 'l0', 'l3'), postures(tidied, 100)
    )
    assert 0.001 < found.mm < 0.1
    exact = chain_from_urdf(urdf, 'l0', 'l3')
    assert almost_parallel(urdf, 'l0', 'l3', 0.0) == []
    at_zero = {name: np.zeros(1) for name in exact.joint_names}
    assert max(difference(exact.forward, tidied.forward, at_zero)) < 1e-9


def test_opposed_parallel_axes_are_told_from_equal_ones():
    """In OpenRAVE they are not (its issue 366)."""
    opposed = joint(1, xyz='0.3 0 0', axis='0 0 -1')
    chain = table(joint(0), opposed, joint(2, xyz='0.3 0 0'))
    assert np.degrees([link.alpha for link in chain.links[:2]]) == pytest.approx(
        [180, 180]
    )
    assert chain.forward([0.3, 0.3, 0.0])[:3, :3] == pytest.approx(np.eye(3), abs=1e-15)


def test_a_joint_without_bounds_has_no_range():
    bounds = 'lower="-2" upper="2" '
    chain = table(joint(0).replace(bounds, ''), joint(1))
    assert chain.lower == pytest.approx([-np.inf, -2])
    assert chain.upper == pytest.approx([np.inf, 2])
    one = joint(0).replace('lower="-2" ', '')  # of which the default is 0
    assert table(one).lower == pytest.approx([0])


def test_what_is_not_on_the_way_may_be_nonsense():
    eye = joint(0, axis='0 0 0', xyz='a b c').replace('j0', 'pan').replace('l1', 'eye')
    text = robot([joint(0), eye.replace('lower="-2"', 'lower="3"'), joint(1)])
    assert chain_from_urdf(load(text), 'l0', 'l2').joint_names == ('j0', 'j1')


def test_an_origin_may_have_a_quaternion():
    turned = joint(0, xyz='0.1 0 0').replace('rpy="0 0 0"', 'quat_xyzw="0 2 0 2"')
    chain = table(turned, joint(1, xyz='0 0 0.3'))
    assert chain.forward([0, 0])[:3, 3] == pytest.approx([0.4, 0, 0])


def test_rows_follow_what_a_joint_mimics_even_by_another():
    first, last = joint(0), joint(4, xyz='0.1 0 0')
    follower = joint(
        1, xyz='0.2 0 0', more='<mimic joint="j2" multiplier="2" offset="0.1"/>'
    )
    middle = joint(
        2, 'prismatic', more='<mimic joint="j4" multiplier="-0.5" offset="0.3"/>'
    )
    still = joint(
        3, 'prismatic', more='<mimic joint="j0" multiplier="0" offset="0.7"/>'
    )
    chain = table(first, follower, middle, still, last)
    assert chain.joint_names == ('j0', 'j4')
    assert [(row.joint, row.link.gain) for row in chain.rows()] == [
        ('j0', 1),
        ('j4', -1),
        ('j4', -0.5),
        ('j4', 1),
    ]
    assert [row.is_first for row in chain.rows()] == [True, True, False, False]
    assert chain.upper == pytest.approx([2, 2])
    for q0, q4 in np.random.default_rng(8).uniform(-2, 2, (20, 2)):
        turned = q0 + 0.7 - q4
        assert chain.forward([q0, q4])[:3, 3] == pytest.approx(
            [
                0.2 * np.cos(q0) + 0.1 * np.cos(turned),
                0.2 * np.sin(q0) + 0.1 * np.sin(turned),
                0.3 - 0.5 * q4 + 0.7,
            ]
        )


def test_every_repr_fits_a_line():
    urdf = load(robot([joint(0)]).replace('j0', 'j' * 200))
    for thing in (urdf, urdf.joints[0], urdf.path('l0', 'l1')[0]):
        assert len(repr(thing)) < 99


def test_a_joint_may_follow_one_that_only_messages_have():
    """As robot_state_publisher moves it."""
    chain = table(joint(0, more='<mimic joint="elsewhere"/>'), joint(1))
    assert chain.joint_names == ('elsewhere', 'j1') and chain.upper[0] == np.inf


def test_a_root_may_hang_beside_the_chain_by_fixed_joints():
    """As UR's `base`."""
    base = (
        '<link name="base"/><joint name="b" type="fixed"><parent link="l0"/>'
        '<child link="base"/><origin rpy="0 0 3.141592653589793" xyz="0 0 0.1"/></joint>'
    )
    text = robot([joint(0), joint(1, xyz='0.3 0 0')])
    urdf = load(text.replace('</robot>', f'{base}</robot>'))
    chain = chain_from_urdf(urdf, 'base', 'l2')
    assert chain.forward([0, 0])[:3, 3] == pytest.approx([-0.3, 0, -0.1])
    with pytest.raises(
        InputFileError, match=r"'base' is not below 'l1', and joint 'j0' above"
    ):
        chain_from_urdf(urdf, 'l1', 'base')


def test_an_unknown_link_lists_the_links_at_the_ends():
    urdf = load(robot([joint(0), joint(1)]).replace('"l1"', '"the_elbow"'))
    with pytest.raises(UnknownNameError) as error:
        chain_from_urdf(urdf, 'l0', 'elbow')
    assert str(error.value) == (
        "unknown link 'elbow' of robot.urdf; known: l2; did you mean 'the_elbow'?"
    )
    with pytest.raises(UnknownNameError, match="did you mean 'l2'"):
        chain_from_urdf(urdf, 'l0', 'l22')


# What is said, the URDF or its joints, and from where to where if not from l0 to l1.
REFUSED = [
    ("link 'l0' is not below 'l1', and joint 'j0' a", [joint(0)], 'l1', 'l0'),
    (
        "'l1' is not below 'l2'; above it is 'l0'",
        robot([joint(0)], links=3),
        'l2',
        'l1',
    ),
    ("no joint moves between 'l0' and", [joint(0, 'fixed')]),
    ("joint 'j0' is floating; allowed", [joint(0, 'floating')]),
    ("joint 'j0' is planar; allowed", [joint(0, 'planar')]),
    (
        "joint 'j0' mimics itself, by j0 and j1",
        [joint(0, more='<mimic joint="j1"/>'), joint(1, more='<mimic joint="j0"/>')],
        'l0',
        'l2',
    ),
    ("joint 'j0': mimic has no joint", [joint(0, more='<mimic multiplier="2"/>')]),
    ("joint 'j0': mimic has no joint", [joint(0, more='<mimic/>')]),
    ('origin has rpy and quat_xyzw', [joint(0, rpy='0 0 0" quat_xyzw="0 0 0 1')]),
    ('quat_xyzw is 0 0 0 0', [joint(0).replace('rpy="0 0 0"', 'quat_xyzw="0 0 0 0"')]),
    ("joint 'j0' is screw; allowed", [joint(0, 'screw')]),
    (
        "two joints of the name 'j0'",
        [joint(0), joint(1).replace('j1', 'j0')],
        'l0',
        'l2',
    ),
    (
        "two links of the name 'l0'",
        robot([joint(0)]).replace('l1"/>', 'l0"/>', 1),
        'l0',
        'l0',
    ),
    (
        "is a URDF of version '2.0'; allowed: 1.0, 1.1, 1.2",
        robot([joint(0)]).replace('<robot', '<robot version="2.0"'),
    ),
    ("origin xyz is '1_0 0 0'", [joint(0, xyz='1_0 0 0')]),
    ('allowed: up to 1e+09', [joint(0, xyz='1e10 0 0')]),
    ('a byte that is no', robot([joint(0)]).replace('j0', 'j\x01')),
    ("joint 'j0': axis is 0 0 0", [joint(0, axis='0 0 0')]),
    ("joint 'j0': origin xyz is '0 nan 0'", [joint(0, xyz='0 nan 0')]),
    ('allowed: 3 finite numbers', [joint(0, rpy='0 0')]),
    ("link 'l1' has two parents", [joint(0), joint(0).replace('j0', 'k0')]),
    (
        'is above itself',
        robot([joint(0), joint(1).replace('l2', 'l0')], links=3),
        'l2',
        'l1',
    ),
    (
        "the joint from 'l0' to 'l1' has no name",
        [joint(0).replace('j0', ''), joint(1)],
        'l0',
        'l2',
    ),
    (
        "names the link 'l1', which is",
        robot([joint(0), joint(1)]).replace('<link name="l1"/>', ''),
        'l0',
        'l2',
    ),
    ('is above upper', [joint(0).replace('"-2"', '"3"')]),
    ("joint 'j0' has no limit with effort", [re.sub('<limit.*?/>', '', joint(0))]),
    ("joint 'j0' has no limit with velocity", [joint(0).replace('velocity', 'speed')]),
    ("joint 'j0': limit effort", [joint(0).replace('effort="1"', 'effort="x"')]),
    (
        'is a xacro file',
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="a"/></robot>',
    ),
    ('is a xacro file', '<robot name="a"><property name="mass" value="1"/></robot>'),
    ('is not a URDF: its root is <sdf>', '<sdf/>'),
]


@pytest.mark.parametrize('row', REFUSED, ids=[row[0] for row in REFUSED])
def test_what_is_no_table_is_refused_in_one_line_by_name(row):
    words, given, *ends = row
    text = given if isinstance(given, str) else robot(given)
    root, tip = ends or ('l0', 'l1')
    with pytest.raises(LegFKError) as refusal:
        chain_from_urdf(load(text), root, tip)
    assert words in str(refusal.value) and str(refusal.value).isprintable()
