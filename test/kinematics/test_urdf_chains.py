"""A URDF is a kinematics file: its links are chains, and the shipped chains go by their names."""

from pathlib import Path
import pickle

from icub_leg_fk.errors import InputFileError, LegFKError, UnknownNameError
from icub_leg_fk.kinematics import Catalog, load_chain, Urdf
from icub_leg_fk.kinematics.difference import difference, postures
from icub_leg_fk.kinematics.table_from_urdf import TIDY
from icub_leg_fk.tools.urdf_text import urdf_text
import numpy as np
import pytest
from support.robots import joint, robot

ROOT = Path(__file__).resolve().parents[2]
URDFS = ROOT.parent / 'shared' / 'data' / 'urdf'
ARM = robot(
    [
        joint(0),
        joint(1, xyz='0.3 0 0'),
        joint(2, 'fixed', xyz='0 0 0.1'),
        joint(3, 'floating'),
    ]
).replace('l3"', 'the tool [x]"')

needs_robots = pytest.mark.skipif(
    not URDFS.is_dir(), reason='../shared has the URDFs of iCubs'
)


@pytest.fixture
def arm(written):
    return written(ARM, 'arm.urdf')


def icub(name, **options):
    return Catalog.load(URDFS / f'{name}.urdf', **options)


def test_every_link_below_the_root_with_a_joint_between_is_a_chain(arm):
    chain = load_chain('the tool [x]', file=arm)
    assert (chain.name, chain.version, chain.root_frame) == (
        'the tool [x]',
        'urdf',
        'l0',
    )
    assert (chain.tip, chain.frame_id) == ('the_tool__x_', 'the tool [x]')
    assert chain.forward([0, np.pi / 2])[:3, 3] == pytest.approx([0.3, 0, 0.1])
    assert load_chain('l1', 'urdf', file=arm).joint_names == ('j0',)
    assert load_chain('l2=urdf', file=str(arm)).n == 2
    assert chain.root_axes == () and chain.source == 'arm.urdf'


def test_chains_whose_topics_would_have_one_name_are_not_used_together(written):
    file = written(ARM.replace('"l2"', '"the_tool__x_"'))
    with pytest.raises(
        LegFKError, match=r'chains the tool \[x\] and the_tool__x_ do not go'
    ):
        Catalog.load(file).select(['the tool [x]', 'the_tool__x_'])


def test_a_tip_given_as_a_chain_is_answered_without_a_table_made(written, monkeypatch):
    file = written(urdf_text('icub', Catalog.load().select(['left_leg'])))
    monkeypatch.delattr('icub_leg_fk.kinematics.urdf_chains.chain_from_urdf')
    with pytest.raises(UnknownNameError, match='left_foot is the tip of left_leg'):
        Catalog.load(file).chain('left_foot')


def test_another_root_may_be_named(arm):
    assert load_chain('l2', file=arm, root='l1').joint_names == ('j1',)
    with pytest.raises(UnknownNameError, match=r"unknown link 'l9' of .*; .*known: l4"):
        Catalog.load(arm, root='l9')
    catalog = Catalog.load(ROOT / 'config' / 'examples' / 'ur5.yaml', root='base')
    assert "is not a URDF; the root link 'base' is ignored" in catalog.warnings[0]


def test_what_is_no_chain_says_why(arm):
    catalog = Catalog.load(arm)
    with pytest.raises(InputFileError, match="joint 'j3' is floating"):
        catalog.chain('l4')
    with pytest.raises(InputFileError, match="no joint moves between 'l0' and 'l0'"):
        catalog.chain('l0')
    with pytest.raises(
        UnknownNameError, match="unknown version 'v1' of chain l1; known: urdf"
    ):
        catalog.chain('l1', 'v1')
    with pytest.raises(UnknownNameError, match="unknown chain 'l7'; known: none"):
        catalog.chain('l7')
    assert list(catalog.chains) == [] and 'l1' in catalog.chains


@needs_robots
@pytest.mark.parametrize('robot_name', ['iCubGenova04', 'iCubLisboa01', 'iCubNancy01'])
def test_the_legs_go_by_their_names_with_both_frames(robot_name):
    catalog = icub(robot_name)
    assert (
        list(catalog.chains)[:3]
        == ['left_leg', 'right_leg', 'head_imu']
        == [*catalog.known()]
    )
    leg, shipped = catalog.chain('left_leg'), load_chain('left_leg')
    assert (leg.tip, leg.root_frame, [*leg.tip_frames], leg.joint_names) == (
        'left_foot',
        'root_link',
        ['dh', 'sole'],
        shipped.joint_names,
    )
    urdf = Urdf.load(catalog.file)
    positions = postures(leg, 20)
    for frame, link in (('dh', 'l_foot_dh_frame'), ('sole', 'l_sole')):
        expected = urdf.forward('root_link', link, positions)
        assert np.abs(leg.with_frame(frame).forward(positions) - expected).max() < 1e-10
        assert leg.with_frame(frame).frame_id == link
    assert (leg.sole_outline([0.0] * 6) is None) == (
        robot_name == 'iCubLisboa01'
    )  # other axes


@needs_robots
def test_an_icub_3_has_only_its_soles():
    catalog = icub('iCubGenova09')
    leg = catalog.chain('left_leg')
    assert (leg.frame, leg.frame_id, leg.tip) == ('sole', 'l_sole', 'left_foot')
    assert leg.sole_outline([0.0] * 6).shape == (4, 3)
    shipped = load_chain('left_leg', 'v3', frame='sole')
    assert difference(leg.forward, shipped.forward, postures(leg, 100)).mm < 0.12
    with pytest.raises(UnknownNameError, match="'dh' of chain left_leg; known: sole"):
        catalog.chain('left_leg', frame='dh')
    assert len(catalog.select(['left_leg', 'right_leg', 'l_sole'])) == 3


@needs_robots
def test_a_root_that_is_not_the_shipped_one_has_no_shipped_chains():
    catalog = icub('iCubGenova04', root='l_hip_1')
    assert not catalog.known() and 'left_leg' not in catalog.chains
    assert catalog.chain('l_sole').n < 6


@needs_robots
def test_tables_are_tidied_for_people_on_request():
    exact = icub('iCubNancy01').chain('left_leg')
    tidied = icub('iCubNancy01', tolerance=TIDY).chain('left_leg')
    offsets = np.degrees([link.offset for link in tidied.links])
    assert offsets == pytest.approx([0, 90, -90, 90, 0, 0], abs=1e-12)
    assert (
        1e-5 < difference(exact.forward, tidied.forward, postures(exact, 100)).mm < 0.01
    )


@needs_robots
def test_a_catalog_of_a_urdf_is_a_value():
    catalog = icub('iCubGenova04')
    again = pickle.loads(pickle.dumps(catalog))
    assert again == catalog and again.chain('l_sole') == catalog.chain('l_sole')
    assert repr(catalog).startswith(
        '<Catalog iCubGenova04.urdf: left_leg, right_leg, head_imu'
    )


def test_degrees_in_a_urdf_are_computed_and_reported(written):
    file = written(
        robot([joint(0, rpy='-90 0 0'), joint(1)])
        .replace('"-2"', '"-180"')
        .replace('"2"', '"180"')
        .replace('name="j1" type="revolute"', 'name="j1" type="continuous"')
    )
    rpy, limits = Catalog.load(file).warnings
    assert rpy == f'{file}: joint j0: an rpy of -90 0 0 is unlikely; it is in rad'
    assert (
        limits == f'{file}: joint j0: a limit of -180 and 180 is unlikely; it is in rad'
    )
    with pytest.warns(UserWarning, match='is unlikely'):
        load_chain('l2', file=file)
    file.write_text(robot([joint(i, xyz='0 0 300') for i in range(3)]))
    assert Catalog.load(file).warnings == (
        f'{file}: joint j0: an xyz of 0 0 300 is unlikely; it is in m (and 2 more joints like '
        'this)',
    )


@needs_robots
def test_no_real_robot_is_doubted():
    for file in URDFS.glob('*.urdf'):
        assert Catalog.load(file).warnings == ()
