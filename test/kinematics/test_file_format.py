"""What a kinematics file may say: gains, rows that follow, defaults, axes, soles, any names."""

from icub_leg_fk.errors import VersionNeededError
from icub_leg_fk.kinematics import Catalog, load_chain
import numpy as np
import pytest
from support.oracle import frames

FINGER = """
units: {length: mm, angle: deg}
default_version: small
chains:
  finger:
    tip: fingertip
    root_frame: hand
    root_axes: [left, up, forward]
    joints: [slide, spread, "robot::hand/curl (1)"]
    tip_frames:
      pad:
        frame: "the pad [left]"
        outline: &pad [[-10, 0], [10, 0], [0, 5]]
    versions:
      small:
        links: &rows
          - {a: 40, d: 0, alpha: 0, joint: "robot::hand/curl (1)", range: [0, 90]}
          - {a: 0, d: 0, alpha: -90}
          - {a: 30, d: 0, alpha: 0, joint: "robot::hand/curl (1)", gain: 0.5, offset: 5}
          - {a: 0, d: 1, alpha: 0, type: prismatic, joint: slide, gain: -2}
      large:
        root_axes: [forward, left, up]
        T_Ro0: [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links: *rows
  thumb:
    tip: thumb
    root_frame: hand
    joints: [twist]
    tip_frames: {dh: {frame: thumb, outline: *pad}}
    versions:
      only: {links: [{a: 40, d: 0, alpha: 0}]}
"""


@pytest.fixture
def finger(written):
    return Catalog.load(written(FINGER))


def test_rows_follow_the_joints_that_they_name(finger):
    chain = finger.chain('finger')
    curl = 'robot::hand/curl (1)'
    assert chain.joint_names == ('slide', 'spread', curl)
    assert [row[1:] for row in chain.rows()] == [
        (curl, 2, True),
        ('spread', 1, True),
        (curl, 2, False),
        ('slide', 0, True),
    ]
    assert [link.gain for link in chain.links] == [1, 1, 0.5, -2]
    for q in np.random.default_rng(31).uniform(-2, 2, (20, 3)):
        T = frames(chain, q)[-1]
        assert chain.forward(q) == pytest.approx(T, abs=1e-15)
        assert chain.pose(q)[:3] == pytest.approx(T[:3, 3], abs=1e-14)


def test_a_joint_has_the_range_of_the_first_row_that_it_moves(finger):
    chain = finger.chain('finger')
    assert [link.a for link in chain.joints] == [0, 0, 0.04]
    assert np.degrees(chain.upper) == pytest.approx([np.inf, np.inf, 90])
    curl = chain.joint_names[2]
    assert chain.out_of_range({curl: 2.0, 'slide': 9.0, 'spread': 0.0}) == (curl,)


def test_what_is_not_said_is_zero_and_the_identity(finger):
    chain = finger.chain('finger')
    assert [link.offset for link in chain.links] == [0, 0, np.radians(5), 0]
    assert np.array_equal(chain.T_root_0, np.eye(4)) and np.array_equal(
        chain.T_n_tip, np.eye(4)
    )
    assert finger.chain('finger', 'large').T_root_0[0, 3] == 0.005


def test_a_default_is_the_chains_own_the_files_or_the_only_version(finger, written):
    assert finger.chain('finger').version == 'small'
    assert finger.chain('thumb').version == 'only'
    file = written(FINGER.replace('  finger:', '  finger:\n    default_version: large'))
    assert load_chain('finger', file=file).version == 'large'
    file.write_text(FINGER.replace('default_version: small', ''))
    with pytest.raises(VersionNeededError) as error:
        load_chain('finger', file=file)
    assert str(error.value) == (
        'chain finger has several versions and no default; give one of small, large'
    )
    assert (error.value.chain, error.value.versions) == ('finger', ('small', 'large'))


def test_root_axes_are_a_versions_or_its_chains_and_conflict_with_none_given(finger):
    assert finger.chain('finger').root_axes == ('left', 'up', 'forward')
    assert finger.chain('finger=large').root_axes == ('forward', 'left', 'up')
    assert len(finger.select(['finger=large', 'thumb'])) == 2


def test_outlines_are_shared_by_an_alias(finger):
    for name in ('finger', 'thumb'):
        (frame,) = finger.chain(name).tip_frames.values()
        assert frame.outline == pytest.approx(
            np.array([[-0.01, 0], [0.01, 0], [0, 0.005]])
        )


def test_names_are_any_text(finger, written):
    assert finger.chain('finger').frame_id == 'the pad [left]'
    text = FINGER.replace('  thumb:', '  "the thumb=left, möglichst":')
    catalog = Catalog.load(written(text.replace('only:', '"2.5 new":')))
    assert catalog.chain('the thumb=left, möglichst').version == '2.5 new'
    assert catalog.chain('the thumb=left, möglichst=2.5 new').version == '2.5 new'
    assert catalog.chain('finger=large').version == 'large'


def test_the_scoped_names_of_simulators_are_read(written):
    file = written("""
units: {length: m, angle: deg}
chains:
  arm:
    tip: tool
    root_frame: base
    joints: ["robot::arm::j1", "Revolute 2"]
    tip_frames: {dh: {frame: tool0}}
    versions:
      v1: {links: [{a: 0.1, d: 0, alpha: 90}, {a: 0.2, d: 0, alpha: 0}]}
""")
    chain = load_chain('arm', 'v1', file=file)
    assert chain.pose({'Revolute 2': np.pi / 2, 'robot::arm::j1': 0.0})[
        :3
    ] == pytest.approx((0.1, 0, 0.2))
