"""`leg_fk compare`: the robots that are known, beside the tables."""

import json
from pathlib import Path
import sys

import numpy as np
import pytest
from support.leg_fk_process import assert_one_line_complaint, run_main
from support.robots import joint, robot

SHARED = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'urdf'
# Robot: nearest version of the legs, largest difference [mm, deg] (FACTS of icub-models).
KNOWN = {
    'iCubLisboa01': ('v1', 0.006, 0.01),
    'iCubNancy01': ('v2_5', 0.46, 0.01),
    'iCubGenova04': ('v2_5', 11.1, 0.01),
    'iCubGenova02': ('v2_5', 24.4, 15.01),
    'iCubGenova09': ('v3', 0.114, 0.01),
}


def file_of(robot: str) -> Path:
    for file in (
        SHARED / f'{robot}.urdf',
        Path(sys.prefix, 'share', 'iCub', 'robots', robot, 'model.urdf'),
    ):
        if file.is_file():
            return file
    pytest.skip(f'neither ../shared nor icub-models has {robot}')


def compared(robot: str) -> dict:
    return json.loads(run_main('compare', file_of(robot), '--json').stdout)


@pytest.mark.parametrize('robot', KNOWN)
def test_the_nearest_version_of_each_known_robot(robot: str) -> None:
    version, mm, deg = KNOWN[robot]
    found = compared(robot)
    for leg in ('left_leg', 'right_leg'):
        (nearest,) = (
            row
            for row in found['differences']
            if row['nearest'] and row['chain'] == leg
        )
        assert nearest['version'] == version
        assert nearest['mm']['largest'] <= mm and nearest['deg']['largest'] <= deg
    left = next(row for row in found['differences'] if row['nearest'])
    assert left['mm']['largest'] > 0.8 * mm or mm < 0.01


def test_a_shifted_frame_is_told_from_another_leg() -> None:
    shifted = compared('iCubGenova04')
    row = next(row for row in shifted['differences'] if row['nearest'])
    assert (
        row['fitted_mm']['largest'] < 1.2
        and 'most of it a shift' in shifted['advice'][0]
    )
    other = compared('iCubGenova02')
    assert 'another mechanism' in other['advice'][0]
    assert other['advice'][-1].startswith('  leg_fk table ')


def test_a_pure_turn_of_axes_is_named_and_not_counted() -> None:
    """The sole of iCubLisboa01 has the axes of the table's last frame."""
    found = compared('iCubLisboa01')
    sole = next(
        row
        for row in found['differences']
        if (row['frame'], row['version']) == ('l_sole', 'v1')
    )
    assert sole['turn'] == '180 deg about x + z'
    assert sole['mm']['largest'] < 0.01 and sole['deg']['largest'] < 0.01


def test_the_text_marks_the_nearest_fits_80_columns_and_ends_with_what_to_run(
    tmp_path: Path,
) -> None:
    file = tmp_path / 'icub.urdf'
    file.write_bytes(file_of('iCubLisboa01').read_bytes())
    text = run_main('compare', file, '--chains', 'left_leg').stdout
    assert 'right_leg' not in text and text.count('<- nearest') == 1
    assert 'left_leg: use v1, which is this robot to 0.0' in text
    assert text.endswith('-p chains:="[left_leg=v1]"\n')
    text = run_main('compare', file).stdout
    own_lines = [line for line in text.splitlines() if str(tmp_path) not in line]
    assert max(map(len, own_lines)) <= 80
    assert text.endswith(f'leg_fk table {file} -o icub.yaml\n')
    assert (
        f'-p kinematics_file:={file}\n' in text
        and 'description_from_topic:=true' in text
    )
    assert 'its l_sole has other axes, turned by 180 deg' in ' '.join(text.split())


@pytest.mark.parametrize('axis', ['1 0 0', '0 1 0', '0 0 1'])
@pytest.mark.parametrize('degrees', [45, 90, 180])
def test_a_turned_root_is_told_from_another_robot(
    axis: str, degrees: int, tmp_path: Path
) -> None:
    legs, turned = tmp_path / 'legs.urdf', tmp_path / 'turned.urdf'
    assert run_main('urdf', '--version', 'v2_5', '-o', legs).returncode == 0
    rpy = ' '.join(str(np.radians(degrees) * float(word)) for word in axis.split())
    old = legs.read_text().replace('"root_link"', '"old_root"')
    root = (
        '<link name="root_link"/><joint name="turn" type="fixed"><parent link="root_link"/>'
        f'<child link="old_root"/><origin xyz="0.1 0 0.2" rpy="{rpy}"/></joint></robot>'
    )
    turned.write_text(old.replace('</robot>', root))
    found = json.loads(
        run_main('compare', turned, '--chains', 'left_leg', '--json').stdout
    )
    (nearest,) = (row for row in found['differences'] if row['nearest'])
    assert nearest['version'] == 'v2_5' and nearest['fitted_mm']['largest'] < 0.001
    assert nearest['root_turn'].startswith(f'{degrees} deg about ')
    assert (
        "v2_5 fits to less than 0.001 mm, but the robot's root frame is turned by "
        in (found['advice'][0])
    )


def test_the_root_of_the_robot_may_have_another_name(tmp_path: Path) -> None:
    file = tmp_path / 'legs.urdf'
    assert run_main('urdf', 'left_leg', 'right_leg', '-o', file).returncode == 0
    file.write_text(file.read_text().replace('"root_link"', '"base_link"'))
    done = run_main('compare', file, '--root', 'base_link', '--json')
    found = json.loads(done.stdout)
    assert found['advice'][0].startswith('left_leg: use v2_5, which is this robot')
    assert '-p root_frame:=base_link' in found['advice'][-2] and not done.stderr
    assert '--root base_link --tips l_foot_dh_frame r_foot' in found['advice'][-1]
    unknown = run_main('compare', file, '--root', 'base_lnk')
    assert_one_line_complaint(unknown, "did you mean 'base_link'?")


def test_no_chain_is_dropped_without_its_reason(tmp_path: Path) -> None:
    file = tmp_path / 'legs.urdf'
    assert run_main('urdf', 'left_leg', 'right_leg', '-o', file).returncode == 0
    file.write_text(file.read_text().replace('"r_knee"', '"right_knee"'))
    advice = json.loads(run_main('compare', file, '--json').stdout)['advice']
    assert advice[0] == 'left_leg: use v2_5, which is this robot to less than 0.001 mm'
    assert advice[1:3] == [
        'right_leg: not compared: between root_link and r_foot_dh_frame the robot has no joint '
        'r_knee',
        'head_imu: not compared: the robot has no link imu_frame',
    ]


def test_a_joint_that_mimics_another_is_compared(tmp_path: Path) -> None:
    """As NAO's right leg, whose RHipYawPitch follows the left one's."""
    arm = tmp_path / 'arm.urdf'
    table = tmp_path / 'arm.yaml'
    joints = [
        joint(0),
        joint(1, xyz='0.3 0 0', rpy='1.5 0 0'),
        joint(2, xyz='0.2 0.1 0'),
    ]
    arm.write_text(robot(joints))
    assert run_main('table', arm, '--tips', 'l3', '-o', table).returncode == 0
    mimic = joint(
        1,
        xyz='0.3 0 0',
        rpy='1.5 0 0',
        more='<mimic joint="other" multiplier="-2" offset="1"/>',
    )
    arm.write_text(robot([joints[0], mimic, joints[2]]))
    found = json.loads(run_main('compare', arm, '-k', table, '--json').stdout)
    assert found['differences'][0]['mm']['largest'] < 1e-6
    assert found['advice'][-1].endswith(f'-p kinematics_file:={table}')


def test_a_robot_without_the_joints_says_what_it_has(tmp_path: Path) -> None:
    file = tmp_path / 'cart.urdf'
    file.write_text(robot([joint(0, 'continuous')]))
    assert_one_line_complaint(
        run_main('compare', file),
        'left_leg, right_leg, head_imu: not compared: the robot has no link root_link; --root ',
    )
    assert_one_line_complaint(
        run_main('compare', file, '--chains', 'left_lag'), "did you mean 'left_leg'?"
    )
    assert_one_line_complaint(
        run_main('compare', tmp_path / 'none.urdf'), 'no such file'
    )
