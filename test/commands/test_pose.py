"""`leg_fk pose`."""

import json
import math

from icub_leg_fk import load_chain
from icub_leg_fk.kinematics import config_file
import numpy as np
import pytest
from support.leg_fk_process import run_main

ARM = f'arm -k {config_file("examples/cylindrical_arm.yaml")}'
UR5 = f'ur5 -k {config_file("examples/ur5.yaml")}'
AT_ZERO = '--degrees 0 0 0 0 0 0'


def printed(typed):
    done = run_main('pose', *typed.split())
    assert (done.returncode, done.stderr) == (0, '')
    return done.stdout


def pose(typed):
    return json.loads(printed(f'{typed} --json'))


def notes(typed):
    """Return what is noted below the pose, in one line."""
    return ' '.join(printed(typed).partition('note:')[2].split())


@pytest.mark.parametrize(
    ('chain', 'position'),
    [
        ('left_leg=v1', (0, -0.0681, -0.5975)),
        ('right_leg --version v1', (0, 0.0681, -0.5975)),
        ('left_leg', (0.0044175, -0.0681, -0.622995)),
        ('right_leg --version v2_5', (0.0044175, 0.0681, -0.622995)),
    ],
)
def test_the_golden_pose_at_zero(chain, position):
    answer = pose(f'{chain} {AT_ZERO}')
    rotation = np.array(answer['matrix'])[:3, :3]
    assert np.allclose(rotation, [[0, 0, -1], [0, 1, 0], [1, 0, 0]], atol=1e-12)
    assert answer['position'] == pytest.approx(position, abs=1e-12)
    half = math.sqrt(0.5)
    assert answer['quaternion'] == pytest.approx((0, -half, 0, half))


def test_json_has_exactly_the_documented_keys():
    answer = pose(f'left_leg {AT_ZERO}')
    about = ['left_leg', 'v2_5', 'root_link', 'l_foot_dh_frame']
    assert [*answer.values()][:4] == about
    keys = 'chain version root_frame frame_id position quaternion matrix'
    assert [*answer] == keys.split()


def test_the_quaternion_is_the_matrix_and_the_position_its_last_column():
    pin = pytest.importorskip('pinocchio')
    answer = pose('right_leg --degrees 10 -20 30 -40 50 -60')
    matrix = np.array(answer['matrix'])
    rotation = pin.Quaternion(np.array(answer['quaternion'])).matrix()
    assert np.abs(rotation - matrix[:3, :3]).max() < 1e-12
    assert answer['position'] == matrix[:3, 3].tolist()


def test_degrees_and_radians_mean_the_same():
    degrees = [10, -20, 30, -40, 50, -60]
    radians = ' '.join(str(math.radians(angle)) for angle in degrees)
    in_degrees = pose('left_leg --degrees 10 -20 30 -40 50 -60')
    assert in_degrees == pose(f'left_leg --radians {radians}')


def test_every_way_to_write_a_negative_number_is_read():
    plain = pose('left_leg --degrees 0 -10.5 -0.001 -0.5 -2 0')
    assert plain == pose('left_leg --degrees 0 -10.5 -1e-3 -.5 -2. -0')


def test_a_slide_is_metres_beside_degrees_and_radians():
    # Spong, Hutchinson, Vidyasagar, example 3.2: (-s_1 d_3, c_1 d_3, d_1 + d_2).
    expected = pytest.approx((-0.5 * 0.25, math.sqrt(0.75) * 0.25, 0.6))
    assert pose(f'{ARM} --degrees 30 0.2 0.1')['position'] == expected
    assert pose(f'{ARM} --radians {math.pi / 6} 0.2 0.1')['position'] == expected
    shown = printed(f'{ARM} --degrees 30 0.2 0.1')
    assert 'lift     0.2  m    range 0 .. 0.5 m' in shown


def test_a_ur5_stands_where_its_makers_table_puts_it():
    # a_2 + a_3, -(d_4 + d_6), d_1 - d_5
    expected = pytest.approx((-0.81725, -0.19145, -0.005491))
    assert pose(f'{UR5} {AT_ZERO}')['position'] == expected


@pytest.mark.parametrize('seed', range(5))
def test_the_pose_of_a_sole_and_its_sign_are_the_librarys(seed):
    q = np.random.default_rng(seed).uniform(-0.6, 0.6, 6).tolist()
    typed = ' '.join(map(str, q))
    answer = pose(f'left_leg --foot-frame sole --radians {typed}')
    sole = load_chain('left_leg', 'v2_5', frame='sole')
    assert answer['frame_id'] == 'l_sole'
    assert answer['quaternion'] == pytest.approx(sole.pose(q)[3:], abs=1e-12)
    assert np.allclose(answer['matrix'], sole.forward(q), rtol=0, atol=1e-12)


def test_the_text_shows_matrix_position_and_quaternion():
    typed = 'left_leg --degrees 10 5 0 -30 15 5'
    text, answer = printed(typed), pose(typed)
    rows = [line.strip(' []') for line in text.splitlines() if line.startswith('  [')]
    matrix = np.array(' '.join(rows).split(), dtype=float).reshape(4, 4)
    assert np.abs(matrix - answer['matrix']).max() <= 0.5e-7
    for value in (*answer['position'], *answer['quaternion']):
        assert f'{value:.7f}' in text
    assert 'left_leg v2_5: l_foot_dh_frame in root_link' in text and 'note' not in text
    assert max(map(len, text.splitlines())) <= 100


def test_a_joint_outside_its_range_is_noted_and_not_clamped():
    note = notes('left_leg=v1 --degrees 0 30 0 0 0 0')
    assert 'l_hip_roll = 30 deg is outside its range -119 .. 17 deg' in note
    assert 'never clamped' in note
    moved = pose('left_leg --degrees 0 30 0 0 0 0')['position']
    clamped = pose('left_leg --degrees 0 17 0 0 0 0')['position']
    assert math.dist(moved, clamped) == pytest.approx(0.114, abs=0.001)


def test_an_erratum_of_the_printed_range_is_noted_where_that_range_counts():
    typed = '--degrees 0 130 0 0 0 0'
    assert 'sign slip' in notes(f'left_leg=v1 {typed}')
    assert 'range -20 .. 120 deg; computed as given' in notes(f'left_leg=v2_5 {typed}')


def test_metres_that_may_be_millimetres_are_noted():
    note = notes(f'{ARM} --degrees 0 200 0.1')
    assert 'lift = 200 m: positions of prismatic joints are in metres' in note
