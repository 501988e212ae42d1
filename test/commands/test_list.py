"""`leg_fk list`."""

import json

from icub_leg_fk.kinematics import config_file
import pytest
from support.leg_fk_process import assert_one_line_complaint, run_main
from support.robots import joint, robot

ARM = config_file('examples/cylindrical_arm.yaml')


def test_the_text_names_chains_versions_axes_joints_and_tip_frames():
    text = run_main('list').stdout
    for chain in ('left_leg', 'right_leg', 'head_imu'):
        assert f'\n{chain}\n' in text
    for words in (
        'l_hip_pitch  l_hip_roll  l_hip_yaw  l_knee  l_ankle_pitch  l_ankle_roll',
        'dh: l_foot_dh_frame',
        'sole: r_sole',
        'dh: imu_frame',
        'v2_5  (default)',
        'v1, v2_5: x backward, y right, z up',
        'v3: x forward, y left, z up',
    ):
        assert words in text
    assert (
        text.count('v3  (iKin, versions from 3.0 on, in the root frame of iCubGenova09')
        == 2
    )
    assert text.count('(default)') == 3
    assert max(map(len, text.splitlines()[1:])) <= 100


def test_json_holds_the_same():
    listed = json.loads(run_main('list', '--json').stdout)
    names = [chain['name'] for chain in listed['chains']]
    assert names == ['left_leg', 'right_leg', 'head_imu']
    left = listed['chains'][0]
    versions = left.pop('versions')
    parts = ('hip_pitch', 'hip_roll', 'hip_yaw', 'knee', 'ankle_pitch', 'ankle_roll')
    assert left == {
        'name': 'left_leg',
        'tip': 'left_foot',
        'root_frame': 'root_link',
        'joints': [f'l_{part}' for part in parts],
        'tip_frames': {'dh': 'l_foot_dh_frame', 'sole': 'l_sole'},
    }
    assert [(version['name'], version['default']) for version in versions] == [
        ('v1', False),
        ('v2_5', True),
        ('v3', False),
    ]
    assert [bool(version['source']) for version in versions] == [False, False, True]
    assert versions[1]['root_axes'] == ['backward', 'right', 'up']
    assert versions[2]['root_axes'] == ['forward', 'left', 'up']


def test_a_file_of_ones_own_is_listed():
    for option in ('-k', '--kinematics-file'):
        listed = json.loads(run_main('list', option, ARM, '--json').stdout)
        assert listed['file'] == str(ARM)
        (arm,) = listed['chains']
        assert arm['versions'][0]['joint_types'] == [
            'revolute',
            'prismatic',
            'prismatic',
        ]
    assert (
        'axes' not in run_main('list', '-k', ARM).stdout
    )  # of which the file says nothing


def test_names_that_cannot_be_printed_are_shown_as_escapes(tmp_path):
    file = tmp_path / 'odd.urdf'
    odd = robot([joint(0)]).replace('j0', 'j&#9;0').replace('"l1"', '"l&#10;1"')
    file.write_text(odd)
    text = run_main('list', '-k', file).stdout
    assert '\nl\\n1\n' in text and 'l_1: l\\n1\n' in text and text.endswith('j\\t0\n')


@pytest.mark.parametrize(
    ('old', 'new', 'complaint'),
    [
        ('units:', 'unit:', 'unit'),
        ('prismatic', 'sliding', "'sliding', allowed: revolute or prismatic"),
        ('range: [0, 500]', 'range: [500, 0]', 'lower at most upper'),
    ],
)
def test_a_mistake_in_the_file_is_one_line(tmp_path, old, new, complaint):
    file = tmp_path / 'arm.yaml'
    file.write_text(ARM.read_text().replace(old, new))
    assert_one_line_complaint(run_main('list', '-k', file), complaint)
