"""A table from a URDF: on every robot there is, beside Pinocchio; read by every command."""

from functools import cache
import importlib.util
from pathlib import Path
import tempfile
from xml.sax.saxutils import quoteattr

from hypothesis import given, settings
from hypothesis import strategies as st
from icub_leg_fk.__main__ import main
from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics import Catalog, chain_from_urdf, Urdf
from icub_leg_fk.kinematics.table_from_urdf import almost_parallel
import numpy as np
import pytest
from support.leg_fk_process import assert_one_line_complaint, leg_fk

SHARED = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'urdf'
MOVING = {'revolute', 'continuous', 'prismatic'}
EXACT, ROUNDED = 1e-9, 1e-5  # m and rad


@cache
def robots() -> list[Path]:
    """Return the URDFs of example-robot-data, which pip installs beside Pinocchio."""
    found = importlib.util.find_spec('pinocchio')
    if found is None or found.origin is None:
        return []
    prefix = next((folder for folder in Path(found.origin).parents
                   if (folder / 'share' / 'example-robot-data').is_dir()), None)
    return sorted((prefix / 'share' / 'example-robot-data').rglob('*.urdf')) if prefix else []


@cache
def icubs() -> list[Path]:
    """Return the URDFs of icub-models, and those beside the project."""
    import sys
    return [*sorted(Path(sys.prefix, 'share', 'iCub', 'robots').glob('*/model.urdf')),
            *sorted(SHARED.glob('*.urdf'))]


def ends(urdf: Urdf) -> list[tuple[str, str]]:
    """Return root and tip of every chain from a root to a leaf."""
    parents = {joint.parent for joint in urdf.joints.values()}
    if not urdf.links:  # ur3.urdf of example-robot-data holds nothing
        return []
    root, = (link for link in urdf.links if link not in urdf.joints)
    return [(root, link) for link in urdf.links if link not in parents and link != root]


def pinocchio_poses(file: Path, root: str, tip: str, names: tuple[str, ...], Q: np.ndarray
                    ) -> np.ndarray:
    pin = pytest.importorskip('pinocchio')
    model, data = pinocchio_model(file)
    poses = []
    for row in Q:
        q = pin.neutral(model)
        for name, value in zip(names, row, strict=True):
            joint = model.joints[model.getJointId(name)]
            q[joint.idx_q:joint.idx_q + joint.nq] = (
                [np.cos(value), np.sin(value)] if joint.nq == 2 else [value])
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
        for root, tip in ends(urdf):
            try:
                joints = urdf.path(root, tip)
            except InputFileError as error:
                refused[file.name, tip] = str(error)
                continue
            if any(joint.kind in MOVING for joint in joints):
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


def robot(joints: list[str], links: int | None = None) -> str:
    names = ''.join(f'<link name="l{i}"/>' for i in range(
        len(joints) + 1 if links is None else links))
    return f'<robot name="made">{names}{"".join(joints)}</robot>'


def joint(i: int, kind: str = 'revolute', xyz: object = '0 0 0', rpy: object = '0 0 0',
          axis: object = '0 0 1', more: str = '') -> str:
    return (f'<joint name="j{i}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
            f'<limit lower="-2" upper="2" effort="1" velocity="1"/>{more}</joint>')


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
    Q = np.random.default_rng(5).uniform(-2, 2, (20, chain.n))
    expected = urdf.forward(root, tip, dict(zip(chain.joint_names, Q.T, strict=True)))
    cost = sum(angle for _, _, angle in almost_parallel(urdf, root, tip))
    assert np.abs(chain.forward(Q) - expected).max() < 1e-9 + 30 * cost
    assert max(max(abs(link.a), abs(link.d)) for link in chain.links) < 10
    exact = chain_from_urdf(urdf, root, tip, convention=convention, tolerance=0.0)
    assert np.abs(exact.forward(Q) - expected).max() < 1e-8
    assert max(max(abs(link.a), abs(link.d)) for link in exact.links) < 10


def test_axes_that_truly_are_a_little_apart_get_a_fixed_row() -> None:
    """A calibrated UR5 gets d = 574 m from its maker's tool."""
    urdf = load(robot([joint(0, axis='0 0 1'), joint(1, xyz='0.4 0 0.1', rpy='0.0007 0.0003 0'),
                       joint(2, xyz='0.4 0 0', rpy='0 0.0005 0')]))
    chain = chain_from_urdf(urdf, 'l0', 'l3')
    assert [link.joint_type for link in chain.links].count('fixed') == 2
    assert max(max(abs(link.a), abs(link.d)) for link in chain.links) < 1
    Q = np.random.default_rng(6).uniform(-2, 2, (50, 3))
    expected = urdf.forward('l0', 'l3', dict(zip(chain.joint_names, Q.T, strict=True)))
    assert np.abs(chain.forward(Q) - expected).max() < 1e-12


def test_opposed_parallel_axes_are_told_from_equal_ones() -> None:
    """In OpenRAVE they are not (its issue 366)."""
    urdf = load(robot([joint(0), joint(1, xyz='0.3 0 0', axis='0 0 -1'),
                       joint(2, xyz='0.3 0 0')]))
    chain = chain_from_urdf(urdf, 'l0', 'l3')
    assert np.degrees([link.alpha for link in chain.links[:2]]) == pytest.approx([180, 180])
    assert chain.forward([0.3, 0.3, 0.0])[:3, :3] == pytest.approx(np.eye(3), abs=1e-15)


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
    'a ring': (robot([joint(0), joint(1).replace('l2', 'l0')]), 'l0', 'l1', 'is above itself'),
    'link not there': (robot([joint(0)], links=1), 'l0', 'l0', "names the link 'l1', which is"),
    'limits reversed': (robot([joint(0).replace('"-2"', '"3"')]), 'l0', 'l1', 'is above upper'),
    'xacro': ('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="a"/></robot>',
              'a', 'b', 'is a xacro file'),
    'entities': ('<!DOCTYPE r [' + ''.join(f'<!ENTITY e{i} "x">' for i in range(3000))
                 + ']><robot/>', 'a', 'b', 'declares a document type or entities'),
    'sdf': ('<sdf/>', 'a', 'b', 'is not a URDF: its root is <sdf>'),
    'no xml': ('left_leg', 'a', 'b', 'is not XML'),
    'nothing': ('', 'a', 'b', 'is not XML'),
}


@pytest.mark.parametrize('kind', REFUSED)
def test_what_is_no_table_is_refused_in_one_line_by_name(kind: str, tmp_path: Path) -> None:
    text, root, tip, words = REFUSED[kind]
    file = tmp_path / 'robot.urdf'
    file.write_text(text)
    assert_one_line_complaint(leg_fk('table', file, '--root', root, '--tips', tip), words)


def test_the_file_is_taken_by_every_command_and_comes_back_from_its_urdf(
        tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    joints = [joint(0, 'prismatic', '0 0.1 0.2'),
              joint(1, xyz='0.3 0 0', rpy='1.5707963267948966 0 0'),
              joint(2, xyz='0.2 0.1 0', rpy='0.3 -0.2 0.1', axis='0 1 0'),
              joint(3, 'fixed', '0 0 1')]
    (tmp_path / 'robot.urdf').write_text(robot(joints).replace('l4', 'tool'))
    table, again = tmp_path / 'table.yaml', tmp_path / 'again.yaml'
    words = ['--root', 'l0', '--tips', 'tool', '--name', 'arm']
    assert main(['table', str(tmp_path / 'robot.urdf'), *words, '-o', str(table)]) == 0
    assert 'arm: 3 joints; largest difference from the URDF in 1000 postures' in (
        capsys.readouterr().out)
    chain = Catalog.load(table).chain('arm', 'urdf')
    options = ['-k', str(table), '--version', 'urdf']
    for command in (['pose', 'arm', *options, '--radians', '0.1', '0.2', '0.3'],
                    ['explain', 'arm', *options, '--radians', '0.1', '0.2', '0.3'],
                    ['list', '-k', str(table)],
                    ['urdf', 'arm', *options, '-o', str(tmp_path / 'made.urdf')]):
        assert main(command) == 0, capsys.readouterr().err
    assert main(['table', str(tmp_path / 'made.urdf'), *words, '-o', str(again)]) == 0
    back = Catalog.load(again).chain('arm', 'urdf')
    Q = np.random.default_rng(8).uniform(-2, 2, (100, 3))
    assert np.abs(back.forward(Q) - chain.forward(Q)).max() < 1e-9
    assert (back.joint_names, back.root_frame, back.tip_frame) == (
        chain.joint_names, 'l0', 'tool')
    assert back.lower == pytest.approx(chain.lower, abs=1e-12)
    assert_one_line_complaint(leg_fk('table', tmp_path / 'robot.urdf', *words, '-o', table),
                              'exists already; --force replaces it')


def test_chains_that_share_joints_go_into_one_urdf(tmp_path: Path) -> None:
    branch = joint(2, xyz='0 0.3 0', rpy='0 1 0').replace('j2', 'k2').replace('l3', 'm3')
    text = robot([joint(0), joint(1, xyz='0.3 0 0', rpy='1.5707963267948966 0 0'),
                  joint(2, xyz='0.2 0 0.1', axis='0 1 0'), branch])
    (tmp_path / 'robot.urdf').write_text(text.replace('l4', 'm3'))
    assert leg_fk('table', tmp_path / 'robot.urdf', '--root', 'l0', '--tips', 'l3', 'm3', '-o',
                  tmp_path / 'table.yaml').returncode == 0
    done = leg_fk('urdf', '-k', tmp_path / 'table.yaml', '--version', 'urdf', '-o',
                  tmp_path / 'both.urdf')
    assert done.returncode == 0, done.stderr
    old, new = (Urdf.load(tmp_path / name) for name in ('robot.urdf', 'both.urdf'))
    assert len([joint for joint in new.joints.values() if joint.kind == 'revolute']) == 4
    for tip in ('l3', 'm3'):
        chain = chain_from_urdf(old, 'l0', tip)
        Q = np.random.default_rng(9).uniform(-2, 2, (20, chain.n))
        positions = dict(zip(chain.joint_names, Q.T, strict=True))
        assert np.abs(new.forward('l0', tip, positions)
                      - old.forward('l0', tip, positions)).max() < 1e-9


def test_names_that_no_kinematics_file_can_have_are_refused(tmp_path: Path) -> None:
    file = tmp_path / 'robot.urdf'
    file.write_text(robot([joint(0)]).replace('"j0"', quoteattr('the joint: 1')))
    assert_one_line_complaint(leg_fk('table', file, '--root', 'l0', '--tips', 'l1'),
                              'cannot be written as a kinematics file')
