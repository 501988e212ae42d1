"""`leg_fk urdf`, read by Pinocchio, which knows nothing of DH tables."""

import math
import re
from xml.etree import ElementTree as ET

from icub_leg_fk import Catalog, load_chain
from icub_leg_fk.kinematics import config_file
import numpy as np
import pytest
from support.described_robots import pinocchio_pose
from support.leg_fk_process import assert_one_line_complaint, run_main

LEGS = ['left_leg', 'right_leg']
ICUB = [*LEGS, 'head_imu=v2']
CHAINS = Catalog.load().select(ICUB)
TOLERANCE = 1e-9  # m, and each rotation entry

SCARA = """
units: {length: m, angle: rad}
chains:
  scara:
    tip: gripper
    root_frame: base
    joints: [shoulder, elbow, lift, wrist]
    tip_frames:
      dh: {frame: gripper}
      sole: {frame: pad, transform: [[0, 0, 1, 0.01], [0, -1, 0, 0], [1, 0, 0, 0.2], [0, 0, 0, 1]]}
    versions:
      v1:
        T_Ro0: [[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]]
        links:
          - {a: 0.3, d: 0.4, alpha: 0.2, offset: 0.3}
          - {a: 0.25, d: 0, alpha: 3.141592653589793, offset: -0.7, range: [-2, 2]}
          - {a: 0, d: 0.05, alpha: 1.5707963267948966, offset: 0.5, type: prismatic, range: [0, 1]}
          - {a: 0.01, d: 0.05, alpha: 0, offset: 0, range: [-3, 3]}
          - {a: 0.02, d: 0.1, alpha: 1.1, offset: 0.4, type: fixed}
        T_nIs: [[1, 0, 0, 0.3], [0, 0, -1, 0], [0, 1, 0, 0.5], [0, 0, 0, 1]]
"""


# Elbow and wrist move a second row each; the wrist counts backward.
MIMIC = (
    SCARA.replace('offset: -0.7, range', 'offset: -0.7, joint: elbow, range')
    .replace(
        'offset: 0.5, type: prismatic', 'offset: 0.5, type: prismatic, joint: lift'
    )
    .replace(
        'offset: 0, range: [-3, 3]}',
        """offset: 0, range: [-3, 3], joint: wrist, gain: -1}
          - {a: 0.1, d: 0.03, alpha: 0.6, offset: 0.1, joint: elbow, gain: -0.5}
          - {a: 0.1, d: 0.03, alpha: 0.6, type: prismatic, joint: wrist, gain: 0.02}""",
    )
)


def changed(text, *changes):
    """Return a text with something else in some places."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def urdf_of(*words):
    done = run_main('urdf', *words)
    assert (done.returncode, done.stderr) == (0, '')
    return done.stdout


def check_with_pinocchio(urdf, *chains, configurations=200):
    """Compare Pinocchio's poses of tip frames with ours, over random configurations."""
    for chain in chains:
        for q in np.random.default_rng(7).uniform(-3, 3, (configurations, chain.n)):
            positions = dict(zip(chain.joint_names, q, strict=True))
            T = pinocchio_pose(urdf, chain.root_frame, chain.frame_id, positions)
            np.testing.assert_allclose(T, chain.forward(q), rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize('foot_frame', ['dh', 'sole'])
@pytest.mark.parametrize('version', ['v1', 'v2_5', 'v3'])
def test_pinocchio_on_the_urdf_gives_our_foot_poses(version, foot_frame):
    urdf = urdf_of(*LEGS, '--version', version)
    check_with_pinocchio(
        urdf, *(load_chain(name, version, frame=foot_frame) for name in LEGS)
    )


def test_pinocchio_on_the_urdf_gives_our_head_poses():
    check_with_pinocchio(urdf_of(*ICUB), load_chain('head_imu'))


@pytest.mark.parametrize(
    ('file', 'name'),
    [('cylindrical_arm.yaml', 'arm'), ('ur5.yaml', 'ur5'), ('panda.yaml', 'panda')],
)
def test_pinocchio_gives_our_poses_of_other_robots(file, name):
    path = config_file(f'examples/{file}')
    check_with_pinocchio(urdf_of('-k', path), load_chain(name, file=path))


@pytest.mark.parametrize('foot_frame', ['dh', 'sole'])
@pytest.mark.parametrize('text', [SCARA, MIMIC])
def test_fixed_rows_tip_transform_slides_and_followers_are_in_the_urdf(
    written, text, foot_frame
):
    file = written(text)
    chain = load_chain('scara', file=file, frame=foot_frame)
    check_with_pinocchio(urdf_of('-k', file), chain)


def test_a_rotation_that_was_typed_rounded_is_the_same_in_the_urdf(written):
    rounded = (
        '[[0.8660254, -0.5, 0, 0], [0.5, 0.8660259, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]'
    )
    file = written(re.sub(r'T_Ro0: .*', f'T_Ro0: {rounded}', SCARA))
    done = run_main('urdf', '-k', file)
    assert 'corrected' in done.stderr
    check_with_pinocchio(done.stdout, load_chain('scara', file=file))


def test_a_row_that_follows_is_a_mimic_joint_with_its_own_limits(written):
    robot = ET.fromstring(urdf_of('-k', written(MIMIC)))
    follower = robot.find("joint[@name='elbow_2']")
    assert follower.find('mimic').attrib == {'joint': 'elbow', 'multiplier': '-0.5'}
    limit = follower.find('limit')
    assert (limit.get('lower'), limit.get('upper')) == ('-1.0', '1.0')
    assert robot.find("joint[@name='wrist']/axis").get('xyz') == '0 0 -1'


def test_limits_are_the_robots_ranges_and_the_erratum_stands_beside():
    urdf = urdf_of('left_leg')
    limit = ET.fromstring(urdf).find("joint[@name='l_hip_roll']/limit")
    lower, upper = (math.degrees(float(limit.get(key))) for key in ('lower', 'upper'))
    assert (lower, upper) == pytest.approx((-20, 120), abs=1e-12)
    assert float(limit.get('effort')) > 0 and float(limit.get('velocity')) > 0
    roll = urdf[urdf.index('name="l_hip_roll"') : urdf.index('name="l_hip_yaw"')]
    assert '<!-- Erratum of the printed table: sign slip' in roll


def names_of(robot, path):
    return [element.get('name') for element in robot.findall(path)]


def test_frames_and_joints_are_named_as_in_the_robots_own_urdf_and_make_a_tree():
    robot = ET.fromstring(urdf_of(*ICUB))
    links = names_of(robot, 'link')
    assert {
        'root_link',
        'l_foot_dh_frame',
        'l_sole',
        'r_foot_dh_frame',
        'r_sole',
        'imu_frame',
    } <= set(links)
    joints = [name for chain in CHAINS for name in chain.joint_names]
    moving = [joint for joint in robot.findall('joint') if joint.get('type') != 'fixed']
    assert sorted(joint.get('name') for joint in moving) == sorted(joints)
    children = [child.get('link') for child in robot.findall('joint/child')]
    assert sorted(links) == sorted([*children, 'root_link'])
    used = names_of(robot, 'link/visual/material')
    assert set(used) == set(names_of(robot, 'material'))


def test_bones_reach_from_joint_to_joint():
    robot = ET.fromstring(urdf_of('left_leg'))
    bone = robot.find("link[@name='l_knee_link']/visual/geometry/cylinder")
    assert float(bone.get('length')) == pytest.approx(0.2005)


def test_without_chains_all_of_the_version_are_written():
    robot = ET.fromstring(urdf_of())
    assert robot.get('name') == 'icub'
    links = names_of(robot, 'link')
    assert {'l_sole', 'r_sole'} <= set(links) and 'imu_frame' not in links


def test_the_file_written_is_whole_and_named_with_what_is_in_it(tmp_path):
    path = tmp_path / 'robot.urdf'
    path.write_text('old')
    assert_one_line_complaint(
        run_main('urdf', 'no_such_chain', '-o', path), 'no_such_chain'
    )
    assert_one_line_complaint(run_main('urdf', 'left_leg', '-o', path), '--force')
    assert path.read_text() == 'old'
    done = run_main('urdf', 'left_leg', 'head_imu', '-o', path, '--force')
    assert done.stdout == f'{path}: robot icub with left_leg=v2_5, head_imu=v2\n'
    assert path.read_text() == urdf_of('left_leg', 'head_imu')
    assert [entry.name for entry in tmp_path.iterdir()] == ['robot.urdf']
    assert run_main('urdf', 'left_leg', '-o', '-').stdout == urdf_of('left_leg')


def other_chain(*changes):
    """Return SCARA with a second chain of the same joints, changed in places."""
    names = (
        ('scara:', 'other:'),
        ('tip: gripper', 'tip: hand'),
        ('gripper}', 'hand}'),
        ('frame: pad', 'frame: palm'),
    )
    return SCARA + changed(SCARA[SCARA.index('  scara:') :], *names, *changes)


def test_a_joint_that_two_chains_share_is_there_once(written):
    # The lift is elsewhere along its axis in the other table, which makes no difference.
    file = written(
        other_chain(
            ('d: 0, alpha: 3.14', 'd: 0.02, alpha: 3.14'),
            ('d: 0.05, alpha: 1.57', 'd: 0.07, alpha: 1.57'),
        )
    )
    urdf = urdf_of('-k', file)
    assert urdf.count('<joint name="lift"') == 1
    check_with_pinocchio(
        urdf, *(load_chain(name, file=file) for name in ('scara', 'other'))
    )


@pytest.mark.parametrize(
    ('text', 'complaint'),
    [
        (
            changed(SCARA, (', range: [0, 1]', '')),
            'joint lift of chain scara has no range',
        ),
        (
            changed(SCARA, ('frame: pad', 'frame: lift_link')),
            'link lift_link is there 2 times',
        ),
        (changed(MIMIC, ('gain: -1', 'gain: -3')), 'moves its first row by -3 times'),
        (
            changed(MIMIC, ('range: [-3, 3], ', '')),
            'joint wrist_2 of chain scara has no range',
        ),
        (
            other_chain(('root_frame: base', 'root_frame: table')),
            'the roots base, table',
        ),
        (
            other_chain(('a: 0.3, d', 'a: 0.3001, d')),
            "joint 'elbow' of chain other is elsewhere",
        ),
    ],
)
def test_what_a_urdf_cannot_say_is_refused(written, text, complaint):
    assert_one_line_complaint(run_main('urdf', '-k', written(text)), complaint)
