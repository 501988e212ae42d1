"""`leg_fk urdf`, read by Pinocchio, which knows nothing of DH tables."""

import math
from pathlib import Path
import re
from xml.etree import ElementTree as ET

from icub_leg_fk.__main__ import main
from icub_leg_fk.commands.urdf import xyz_rpy
from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
from support.leg_fk_process import assert_one_line_complaint, leg_fk

EXAMPLES = Path(__file__).parents[2] / 'config' / 'examples'
ARM, UR5 = EXAMPLES / 'cylindrical_arm.yaml', EXAMPLES / 'ur5.yaml'

ICUB = ['left_leg', 'right_leg', 'head_imu', '--chain-version', 'head_imu=v2', '--version']
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


@pytest.fixture
def write_urdf(tmp_path):
    def write(*words):
        path = tmp_path / 'robot.urdf'
        assert main(['urdf', *words, '-o', str(path)]) == 0
        return path.read_text()
    return write


def largest_difference(urdf, chain, configurations=1000):
    """Compare Pinocchio's pose of the tip frame with ours, over random configurations."""
    pin = pytest.importorskip('pinocchio')
    model = pin.buildModelFromXML(urdf)
    data = model.createData()
    frame = model.getFrameId(chain.frame_id)
    assert frame < model.nframes, f'no frame {chain.frame_id}'
    Q = np.random.default_rng(7).uniform(-3, 3, (configurations, chain.n))
    worst = 0.0
    for q in Q:
        q_model = pin.neutral(model)
        for name, position in zip(chain.joint_names, q, strict=True):
            joint = model.joints[model.getJointId(name)]
            # A joint without limits is a point on the circle there.
            q_model[joint.idx_q:joint.idx_q + joint.nq] = (
                position if joint.nq == 1 else (math.cos(position), math.sin(position)))
        pin.framesForwardKinematics(model, data, q_model)
        worst = max(worst, np.abs(data.oMf[frame].homogeneous - chain.forward(q)).max())
    return worst


@pytest.mark.parametrize('version', ['v1', 'v2_5', 'v3'])
@pytest.mark.parametrize('foot_frame', ['dh', 'sole'])
@pytest.mark.parametrize('name', ['left_leg', 'right_leg'])
def test_pinocchio_on_the_urdf_gives_our_foot_poses(write_urdf, name, version, foot_frame):
    chain = Catalog.load().chain(name, version, foot_frame)
    assert largest_difference(write_urdf(*ICUB, version), chain) < TOLERANCE


def test_pinocchio_on_the_urdf_gives_our_head_poses(write_urdf):
    chain = Catalog.load().chain('head_imu', 'v2')
    assert largest_difference(write_urdf(*ICUB, 'v2_5'), chain) < TOLERANCE


@pytest.mark.parametrize(('file', 'name', 'version'), [
    (ARM, 'arm', 'v1'), (UR5, 'ur5', 'series_3')])
def test_pinocchio_gives_our_poses_of_other_robots(write_urdf, file, name, version):
    chain = Catalog.load(file).chain(name, version)
    urdf = write_urdf('-k', str(file), '--version', version)
    assert largest_difference(urdf, chain) < TOLERANCE


def test_a_rotation_that_was_typed_rounded_is_the_same_in_the_urdf(write_urdf, tmp_path):
    file = tmp_path / 'scara.yaml'
    rounded = '[[0.8660254, -0.5, 0, 0], [0.5, 0.8660259, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]'
    file.write_text(re.sub(r'T_Ro0: .*', f'T_Ro0: {rounded}', SCARA))
    urdf = write_urdf('-k', str(file), '--version', 'v1')
    assert rounded in file.read_text()
    assert largest_difference(urdf, Catalog.load(file).chain('scara', 'v1')) < TOLERANCE


@pytest.mark.parametrize('foot_frame', ['dh', 'sole'])
def test_virtual_link_tip_transform_and_slide_are_in_the_urdf(write_urdf, tmp_path, foot_frame):
    file = tmp_path / 'scara.yaml'
    file.write_text(SCARA)
    chain = Catalog.load(file).chain('scara', 'v1', foot_frame)
    urdf = write_urdf('-k', str(file), '--version', 'v1')
    assert largest_difference(urdf, chain) < TOLERANCE


def test_limits_are_the_robots_ranges_and_the_erratum_stands_beside(write_urdf):
    urdf = write_urdf('left_leg')
    limit = ET.fromstring(urdf).find("joint[@name='l_hip_roll']/limit")
    lower, upper = (math.degrees(float(limit.get(key))) for key in ('lower', 'upper'))
    assert (lower, upper) == pytest.approx((-20, 120), abs=1e-12)
    assert float(limit.get('effort')) > 0 and float(limit.get('velocity')) > 0
    roll = urdf[urdf.index('name="l_hip_roll"'):urdf.index('name="l_hip_yaw"')]
    assert '<!-- Erratum of the printed table: sign slip' in roll


def test_frames_and_joints_are_named_as_in_the_robots_own_urdf(write_urdf):
    robot = ET.fromstring(write_urdf(*ICUB, 'v2_5'))
    links = {link.get('name') for link in robot.findall('link')}
    assert {'root_link', 'l_foot_dh_frame', 'l_sole', 'r_foot_dh_frame', 'r_sole',
            'imu_frame'} <= links
    moving = {joint.get('name') for joint in robot.findall('joint')
              if joint.get('type') != 'fixed'}
    catalog = Catalog.load()
    assert moving == {name for chain in (catalog.chain('left_leg', 'v2_5'),
                                         catalog.chain('right_leg', 'v2_5'),
                                         catalog.chain('head_imu', 'v2'))
                      for name in chain.joint_names}


def test_the_urdf_is_a_tree_with_the_root_frame_as_root(write_urdf):
    robot = ET.fromstring(write_urdf(*ICUB, 'v2_5'))
    links = [link.get('name') for link in robot.findall('link')]
    children = [joint.find('child').get('link') for joint in robot.findall('joint')]
    assert sorted(links) == sorted([*children, 'root_link'])
    materials = {material.get('name') for material in robot.findall('material')}
    used = {material.get('name') for material in robot.findall('link/visual/material')}
    assert used == materials


def test_bones_reach_from_joint_to_joint(write_urdf):
    robot = ET.fromstring(write_urdf('left_leg'))
    lengths = [float(cylinder.get('length'))
               for cylinder in robot.findall("link[@name='l_knee_link']/visual/geometry/cylinder")]
    assert lengths == pytest.approx([0.2005])


def test_roll_pitch_yaw_are_accurate_at_and_near_gimbal_lock():
    rng = np.random.default_rng(3)
    for pitch in (math.pi / 2, -math.pi / 2):
        for nudge in (0, 1e-16, 1e-12, 1e-9, 1e-8, 1e-7, 1e-5, 1e-3):
            for roll, yaw in rng.uniform(-math.pi, math.pi, (50, 2)):
                T = np.eye(4)
                T[:3, :3] = rotation(roll, pitch - nudge, yaw)
                _, rpy = xyz_rpy(T)
                assert np.abs(rotation(*rpy) - T[:3, :3]).max() < 4e-15


def rotation(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll), as the URDF specification defines rpy."""
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return Rz @ Ry @ Rx


def test_without_chains_all_of_the_version_are_written(capsys):
    assert main(['urdf']) == 0
    robot = ET.fromstring(capsys.readouterr().out)
    assert robot.get('name') == 'icub'
    links = {link.get('name') for link in robot.findall('link')}
    assert {'l_sole', 'r_sole'} <= links and 'imu_frame' not in links


def test_an_existing_file_is_replaced_whole_or_not_at_all(tmp_path):
    path = tmp_path / 'robot.urdf'
    path.write_text('old')
    assert main(['urdf', 'no_such_chain', '-o', str(path)]) == 2
    assert path.read_text() == 'old'
    assert main(['urdf', 'left_leg', '-o', str(path), '--force']) == 0
    assert path.read_text().startswith('<?xml')
    assert [entry.name for entry in tmp_path.iterdir()] == ['robot.urdf']


def broken(tmp_path, old, new):
    file = tmp_path / 'robot.yaml'
    text = SCARA.replace(old, new)
    assert text != SCARA
    file.write_text(text)
    return ['-k', str(file), '--version', 'v1']


@pytest.mark.parametrize(('words', 'complaint'), [
    (['elbow'], "unknown chain 'elbow'"),
    (['left_leg', '--version', 'v9'], "'v9'; did you mean 'v1'? known: v1, v2_5, v3"),
    (['head_imu'], 'known: v2'),
    (['--version', 'v9'], "unknown version 'v9'"),
    (['--chain-version', 'head_imu'], 'CHAIN=VERSION'),
    (['--chain-version', 'tail=v2'], 'found tail, allowed: left_leg, right_leg, head_imu'),
    (['left_leg', '--chain-version', 'head_imu=v2'], 'found head_imu, allowed: left_leg'),
    (['-k', 'no_such_file.yaml'], 'no_such_file.yaml'),
    (['--name', 'a\x01b'], "--name: found 'a\\x01b', allowed: printable text"),
    (['-o', '-1.urdf'], 'unknown option -1.urdf'),
    (['left_leg', '-o', '/dev/null'], '/dev/null'),
    (['left_leg', '-o', '/no/such/folder/x.urdf'], 'there is no directory'),
])
def test_a_mistake_is_one_line_and_exit_2(words, complaint):
    assert_one_line_complaint(leg_fk('urdf', *words), complaint)


def test_a_slide_without_range_is_refused(tmp_path, capsys):
    assert main(['urdf', *broken(tmp_path, ', range: [0, 1]', '')]) == 2
    assert 'joint lift: found no range' in capsys.readouterr().err


def test_a_name_that_stands_twice_is_refused(tmp_path, capsys):
    assert main(['urdf', *broken(tmp_path, 'frame: pad', 'frame: lift_link')]) == 2
    assert 'found link lift_link twice' in capsys.readouterr().err


def test_chains_of_different_roots_are_refused(tmp_path, capsys):
    chain = SCARA[SCARA.index('  scara:'):]
    other = chain.replace('scara:', 'other:').replace('tip: gripper', 'tip: other').replace(
        'root_frame: base', 'root_frame: table')
    file = tmp_path / 'robots.yaml'
    file.write_text(SCARA + other)
    assert main(['urdf', '-k', str(file), '--version', 'v1']) == 2
    assert 'one root: found base, table' in capsys.readouterr().err
