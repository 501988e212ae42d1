"""A URDF read and made a table: on every robot there is beside Pinocchio, and on random ones."""

from collections.abc import Sequence
from functools import cache, partial
import importlib.util
from pathlib import Path
import sys
import tempfile

from hypothesis import given, settings
from hypothesis import strategies as st
from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics import chain_from_urdf, Urdf
from icub_leg_fk.kinematics.difference import difference, postures
from icub_leg_fk.kinematics.table_from_urdf import almost_parallel
import numpy as np
import pytest
from support.robots import joint, robot

SHARED = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'urdf'
MOVING = {'revolute', 'continuous', 'prismatic'}
EXACT, ROUNDED = 1e-9, 1e-5  # m and rad


@cache
def robots() -> list[Path]:
    """Return the URDFs of example-robot-data, which pip installs beside Pinocchio."""
    found = importlib.util.find_spec('pinocchio')
    folders = Path(found.origin).parents if found and found.origin else ()
    for folder in folders:
        if (folder / 'share' / 'example-robot-data').is_dir():
            return sorted((folder / 'share' / 'example-robot-data').rglob('*.urdf'))
    return []


@cache
def icubs() -> list[Path]:
    """Return the URDFs of icub-models, and those beside the project."""
    installed = Path(sys.prefix, 'share', 'iCub', 'robots')
    return [*sorted(installed.glob('*/model.urdf')), *sorted(SHARED.glob('*.urdf'))]


def pinocchio_poses(file: Path, root: str, tip: str, names: Sequence[str], Q: np.ndarray
                    ) -> np.ndarray:
    pin = pytest.importorskip('pinocchio')
    model, data = pinocchio_model(file)
    poses = []
    for row in Q:
        q = pin.neutral(model)
        for name, value in zip(names, row, strict=True):
            joint = model.joints[model.getJointId(name)]
            turns = [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
            q[joint.idx_q:joint.idx_q + joint.nq] = turns
        pin.framesForwardKinematics(model, data, q)
        T = [data.oMf[model.getFrameId(link, pin.FrameType.BODY)] for link in (root, tip)]
        poses.append((T[0].inverse() * T[1]).homogeneous)
    return np.array(poses)


@cache
def pinocchio_model(file: Path) -> tuple:
    pin = pytest.importorskip('pinocchio')
    text = file.read_text()
    if '<robot>' in text:  # urdfdom wants a name
        text = text.replace('<robot>', '<robot name="robot">')
    model = pin.buildModelFromXML(text)
    return model, model.createData()


def check(file: Path, urdf: Urdf, root: str, tip: str) -> None:
    chain = chain_from_urdf(urdf, root, tip)
    Q = np.random.default_rng(4).uniform(-1.5, 1.5, (20, chain.n))
    off = np.abs(chain.forward(Q) - pinocchio_poses(file, root, tip, chain.joint_names, Q)).max()
    assert off < (ROUNDED if almost_parallel(urdf, root, tip) else EXACT), (file, tip, off)
    assert max(max(abs(link.a), abs(link.d)) for link in chain.links) < 10, (file, tip)


def test_every_chain_of_every_example_robot_is_pinocchios() -> None:
    if not robots():
        pytest.skip('example-robot-data is not installed')
    done, refused = 0, {}
    for file in robots():
        urdf = Urdf.load(file)
        if not urdf.links:  # ur3.urdf of example-robot-data holds nothing
            continue
        root, = urdf.tops()
        for tip in urdf.ends():
            try:
                joints = urdf.path(root, tip)
            except InputFileError as error:
                refused[file.name, tip] = str(error)
                continue
            if any(joint.moves for joint in joints):
                check(file, urdf, root, tip)
                done += 1
    # What cannot be done is a chain with a mimic joint on itself, such as those of fingers.
    assert all(' mimics ' in reason for reason in refused.values()), refused
    assert done > 480 and len(refused) < 0.2 * done


@pytest.mark.parametrize('tip', ['l_sole', 'r_foot_dh_frame', 'imu_frame', 'l_hand'])
def test_the_chains_of_the_icubs_are_pinocchios(tip: str) -> None:
    files = icubs()
    if not files:
        pytest.skip('icub-models is not installed, and ../shared is not there')
    for file in files:
        urdf = Urdf.load(file)
        if {'root_link', tip} <= {*urdf.links}:
            check(file, urdf, 'root_link', tip)


def load(text: str) -> Urdf:
    with tempfile.NamedTemporaryFile('w', suffix='.urdf') as file:
        file.write(text)
        file.flush()
        return Urdf.load(file.name)


NUMBERS = st.one_of(st.sampled_from([0.0, 0.1, -0.25]), st.floats(-0.5, 0.5))
ANGLES = st.one_of(
    st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi, 1e-3, -3e-2, 5e-5, np.pi - 1e-3, 1e-7]),
    st.floats(-3.2, 3.2))
AXES = st.one_of(st.sampled_from(['1 0 0', '0 1 0', '0 0 1', '-1 0 0', '0 0 -1']),
                 st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.2, 1)).map(
                     lambda axis: ' '.join(map(repr, axis))))


@st.composite
def random_robots(draw: st.DrawFn) -> str:
    kinds = draw(st.lists(st.sampled_from(['revolute', 'continuous', 'prismatic', 'fixed']),
                          min_size=1, max_size=7))
    kinds[draw(st.integers(0, len(kinds) - 1))] = 'revolute'

    def triple(values: st.SearchStrategy) -> str:
        return ' '.join(repr(draw(values)) for _ in range(3))
    return robot([joint(i, kind, triple(NUMBERS), triple(ANGLES), draw(AXES))
                  for i, kind in enumerate(kinds)])


@settings(max_examples=300)
@given(random_robots(), st.sampled_from(['standard', 'modified']))
def test_any_robot_is_its_urdf_multiplied_out_and_never_kilometres_long(text: str,
                                                                        convention: str) -> None:
    urdf = load(text)
    root, tip = 'l0', urdf.links[-1]
    chain = chain_from_urdf(urdf, root, tip, convention=convention)
    exact = chain_from_urdf(urdf, root, tip, convention=convention, tolerance=0.0)
    cost = sum(angle for _, _, angle in almost_parallel(urdf, root, tip))
    positions = postures(chain, 20, 2.0, whole_range=False)
    expected = urdf.forward(root, tip, positions)
    assert np.abs(chain.forward(positions) - expected).max() < 1e-9 + 30 * cost
    assert np.abs(exact.forward(positions) - expected).max() < 1e-8
    for link in (*chain.links, *exact.links):
        assert max(abs(link.a), abs(link.d)) < 10


def test_axes_that_truly_are_a_little_apart_get_a_fixed_row() -> None:
    """A calibrated UR5 gets d = 574 m from its maker's tool."""
    urdf = load(robot([joint(0, axis='0 0 1'), joint(1, xyz='0.4 0 0.1', rpy='0.0007 0.0003 0'),
                       joint(2, xyz='0.4 0 0', rpy='0 0.0005 0')]))
    chain = chain_from_urdf(urdf, 'l0', 'l3')
    assert [link.joint_type for link in chain.links].count('fixed') == 2
    assert max(max(abs(link.a), abs(link.d)) for link in chain.links) < 1
    found = difference(chain.forward, partial(urdf.forward, 'l0', 'l3'), postures(chain, 50))
    assert max(found) < 1e-9


def test_opposed_parallel_axes_are_told_from_equal_ones() -> None:
    """In OpenRAVE they are not (its issue 366)."""
    urdf = load(robot([joint(0), joint(1, xyz='0.3 0 0', axis='0 0 -1'),
                       joint(2, xyz='0.3 0 0')]))
    chain = chain_from_urdf(urdf, 'l0', 'l3')
    assert np.degrees([link.alpha for link in chain.links[:2]]) == pytest.approx([180, 180])
    assert chain.forward([0.3, 0.3, 0.0])[:3, :3] == pytest.approx(np.eye(3), abs=1e-15)


def test_a_joint_without_bounds_has_no_range() -> None:
    bounds = 'lower="-2" upper="2" '
    chain = chain_from_urdf(load(robot([joint(0).replace(bounds, ''), joint(1)])), 'l0', 'l2')
    assert chain.lower == pytest.approx([-np.inf, -2])
    assert chain.upper == pytest.approx([np.inf, 2])
    one = joint(0).replace('lower="-2" ', '')  # of which the default is 0
    assert chain_from_urdf(load(robot([one])), 'l0', 'l1').lower == pytest.approx([0])


def test_what_is_not_on_the_way_may_be_nonsense() -> None:
    eye = joint(0, axis='0 0 0', xyz='a b c').replace('j0', 'pan').replace('l1', 'eye')
    text = robot([joint(0), eye.replace('lower="-2"', 'lower="3"'), joint(1)])
    assert chain_from_urdf(load(text), 'l0', 'l2').joint_names == ('j0', 'j1')


REFUSED = {
    'unknown link': (robot([joint(0)]), 'l0', 'l11', "unknown link 'l11'; did you mean 'l1'?"),
    'not below': (robot([joint(0)]), 'l1', 'l0', "link 'l0' is not below 'l1'; above it is 'l0'"),
    'nothing moves': (robot([joint(0, 'fixed')]), 'l0', 'l1', "no joint moves between 'l0' and"),
    'floating': (robot([joint(0, 'floating')]), 'l0', 'l1', "joint 'j0' is floating; allowed"),
    'planar': (robot([joint(0, 'planar')]), 'l0', 'l1', "joint 'j0' is planar; allowed"),
    'mimic': (robot([joint(0), joint(1, more='<mimic joint="j0"/>')]), 'l0', 'l2',
              "joint 'j1' mimics 'j0'"),
    'no axis': (robot([joint(0, axis='0 0 0')]), 'l0', 'l1', "joint 'j0': axis is 0 0 0"),
    'nan': (robot([joint(0, xyz='0 nan 0')]), 'l0', 'l1', "joint 'j0': origin xyz is '0 nan 0'"),
    'two numbers': (robot([joint(0, rpy='0 0')]), 'l0', 'l1', 'allowed: 3 finite numbers'),
    'two parents': (robot([joint(0), joint(0).replace('j0', 'k0')]), 'l0', 'l1',
                    "link 'l1' has two parents"),
    'a ring': (robot([joint(0), joint(1).replace('l2', 'l0')], links=3), 'l2', 'l1',
               'is above itself'),
    'link not there': (robot([joint(0)], links=2).replace('<link name="l0"/>', ''), 'l2', 'l1',
                       "unknown link 'l2'"),
    'parent not there': (robot([joint(0), joint(1)]).replace('<link name="l1"/>', ''), 'l0', 'l2',
                         "names the link 'l1', which is"),
    'limits reversed': (robot([joint(0).replace('"-2"', '"3"')]), 'l0', 'l1', 'is above upper'),
    'xacro': ('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="a"/></robot>',
              'a', 'b', 'is a xacro file'),
    'sdf': ('<sdf/>', 'a', 'b', 'is not a URDF: its root is <sdf>'),
    'no xml': ('left_leg', 'a', 'b', 'is not XML'),
    'nothing': ('', 'a', 'b', 'is not XML'),
}


@pytest.mark.parametrize('kind', REFUSED)
def test_what_is_no_table_is_refused_in_one_line_by_name(kind: str) -> None:
    text, root, tip, words = REFUSED[kind]
    with pytest.raises(InputFileError) as refusal:
        chain_from_urdf(load(text), root, tip)
    assert words in str(refusal.value) and str(refusal.value).isprintable()
