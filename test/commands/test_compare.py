"""`leg_fk compare`: the robots that are known, beside the tables."""

import json
from pathlib import Path
import sys

import pytest
from support.leg_fk_process import assert_one_line_complaint, run_main
from support.robots import joint, robot

SHARED = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'urdf'
# Robot: nearest version of the legs, largest difference [mm, deg] (FACTS of icub-models).
KNOWN = {
    'iCubLisboa01': ('v1', 0.006, 0.01), 'iCubNancy01': ('v2_5', 0.46, 0.01),
    'iCubGenova04': ('v2_5', 11.1, 0.01), 'iCubGenova02': ('v2_5', 24.4, 15.01),
    'iCubGenova09': ('v3', 0.114, 0.01)}


def file_of(robot: str) -> Path:
    for file in (SHARED / f'{robot}.urdf',
                 Path(sys.prefix, 'share', 'iCub', 'robots', robot, 'model.urdf')):
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
        nearest, = (row for row in found['differences'] if row['nearest'] and row['chain'] == leg)
        assert nearest['version'] == version
        assert nearest['mm']['largest'] <= mm and nearest['deg']['largest'] <= deg
    left = next(row for row in found['differences'] if row['nearest'])
    assert left['mm']['largest'] > 0.8 * mm or mm < 0.01


def test_a_shifted_frame_is_told_from_another_leg() -> None:
    shifted = compared('iCubGenova04')
    row = next(row for row in shifted['differences'] if row['nearest'])
    assert row['fitted_mm']['largest'] < 1.2 and 'most of it a shift' in shifted['advice'][0]
    other = compared('iCubGenova02')
    assert 'another mechanism' in other['advice'][0] and 'leg_fk table' in other['advice'][0]


def test_a_pure_turn_of_axes_is_named_and_not_counted() -> None:
    """The sole of iCubLisboa01 has the axes of the table's last frame."""
    found = compared('iCubLisboa01')
    sole = next(row for row in found['differences']
                if (row['frame'], row['version']) == ('l_sole', 'v1'))
    assert sole['turn'] == '180 deg about x + z'
    assert sole['mm']['largest'] < 0.01 and sole['deg']['largest'] < 0.01


def test_the_text_marks_the_nearest_and_ends_with_advice() -> None:
    text = run_main('compare', file_of('iCubLisboa01'), '--chains', 'left_leg').stdout
    assert 'right_leg' not in text
    assert text.count('<- nearest') == 1
    assert text.splitlines()[-1].startswith('left_leg: use v1, which is this robot to 0.0')


def test_a_robot_without_the_joints_says_what_it_has(tmp_path: Path) -> None:
    file = tmp_path / 'cart.urdf'
    file.write_text(robot([joint(0, 'continuous')]))
    assert_one_line_complaint(run_main('compare', file),
                              'has the joints and frames of none of left_leg, right_leg, '
                              'head_imu; its joints are j0')
    assert_one_line_complaint(run_main('compare', file, '--chains', 'left_lag'),
                              "did you mean 'left_leg'?")
    assert_one_line_complaint(run_main('compare', tmp_path / 'none.urdf'), 'no such file')
