"""`leg_fk pose`."""

import json
import math
from pathlib import Path

from icub_leg_fk import load_chain
import numpy as np
import pytest
from support.leg_fk_process import assert_one_line_complaint, leg_fk

EXAMPLES = Path(__file__).parents[2] / 'config' / 'examples'
ARM = ['arm', '-k', EXAMPLES / 'cylindrical_arm.yaml', '--version', 'v1']
ZEROS = ['0'] * 6


def pose(*words):
    done = leg_fk('pose', *words, '--json')
    assert (done.returncode, done.stderr) == (0, '')
    return json.loads(done.stdout)


@pytest.mark.parametrize(('words', 'position'), [
    (['left_leg', '--version', 'v1'], (0, -0.0681, -0.5975)),
    (['right_leg', '--version', 'v1'], (0, 0.0681, -0.5975)),
    (['left_leg'], (0.0044175, -0.0681, -0.622995)),
    (['right_leg', '--version', 'v2_5'], (0.0044175, 0.0681, -0.622995)),
])
def test_the_golden_pose_at_zero(words, position):
    answer = pose(*words, '--degrees', *ZEROS)
    assert answer['position'] == pytest.approx(position, abs=1e-12)
    assert answer['quaternion'] == pytest.approx((0, -math.sqrt(0.5), 0, math.sqrt(0.5)))
    assert np.allclose(answer['matrix'], [[0, 0, -1, position[0]], [0, 1, 0, position[1]],
                                          [1, 0, 0, position[2]], [0, 0, 0, 1]], atol=1e-12)


def test_json_has_exactly_the_documented_keys():
    answer = pose('left_leg', '--degrees', *ZEROS)
    assert list(answer) == ['chain', 'version', 'root_frame', 'frame_id', 'position',
                            'quaternion', 'matrix']
    assert [answer[key] for key in list(answer)[:4]] == [
        'left_leg', 'v2_5', 'root_link', 'l_foot_dh_frame']


def test_the_quaternion_is_the_matrix_and_the_position_its_last_column():
    pin = pytest.importorskip('pinocchio')
    answer = pose('right_leg', '--degrees', '10', '-20', '30', '-40', '50', '-60')
    matrix = np.array(answer['matrix'])
    assert np.abs(pin.Quaternion(np.array(answer['quaternion'])).matrix()
                  - matrix[:3, :3]).max() < 1e-12
    assert answer['position'] == matrix[:3, 3].tolist()


def test_degrees_and_radians_mean_the_same():
    degrees = [10, -20, 30, -40, 50, -60]
    assert pose('left_leg', '--degrees', *degrees) == pose(
        'left_leg', '--radians', *map(math.radians, degrees))


def test_every_way_to_write_a_negative_number_is_read():
    plain = pose('left_leg', '--degrees', '0', '-10.5', '-0.001', '-0.5', '-2', '0')
    other = pose('left_leg', '--degrees', '0', '-10.5', '-1e-3', '-.5', '-2.', '-0')
    assert plain == other


def test_the_sole_is_level_and_faces_forward_at_zero():
    answer = pose('left_leg', '--degrees', *ZEROS, '--foot-frame', 'sole')
    assert answer['frame_id'] == 'l_sole'
    # root_link has x backward, the sole x forward; both have z up.
    assert np.allclose(np.array(answer['matrix'])[:3, :3], np.diag([-1, -1, 1]))


def test_a_slide_is_metres_beside_degrees_and_radians():
    # Spong, Hutchinson, Vidyasagar, example 3.2: (-s_1 d_3, c_1 d_3, d_1 + d_2).
    expected = (-0.5 * 0.25, math.sqrt(0.75) * 0.25, 0.6)
    assert pose(*ARM, '--degrees', 30, 0.2, 0.1)['position'] == pytest.approx(expected)
    assert pose(*ARM, '--radians', math.pi / 6, 0.2, 0.1)['position'] == pytest.approx(expected)
    text = leg_fk('pose', *ARM, '--degrees', 30, 0.2, 0.1).stdout
    assert 'lift     0.2  m    range 0 .. 0.5 m' in text


def test_a_ur5_stands_where_its_makers_table_puts_it():
    answer = pose('ur5', '-k', EXAMPLES / 'ur5.yaml', '--version', 'series_3', '--degrees', *ZEROS)
    # a_2 + a_3, -(d_4 + d_6), d_1 - d_5
    assert answer['position'] == pytest.approx((-0.81725, -0.19145, -0.005491))


@pytest.mark.parametrize('seed', range(5))
def test_the_quaternion_has_the_sign_that_library_and_node_give(seed):
    q = np.random.default_rng(seed).uniform(-0.6, 0.6, 6).tolist()
    answer = pose('left_leg', '--foot-frame', 'sole', '--radians', *q)
    assert answer['quaternion'] == pytest.approx(
        load_chain('left_leg', 'v2_5', frame='sole').pose(q)[3:], abs=1e-12)


def test_the_text_shows_matrix_position_and_quaternion():
    text = leg_fk('pose', 'left_leg', '--degrees', 10, 5, 0, -30, 15, 5).stdout
    answer = pose('left_leg', '--degrees', 10, 5, 0, -30, 15, 5)
    rows = [[float(word) for word in line.strip(' []').split()]
            for line in text.splitlines() if line.startswith('  [')]
    assert np.abs(np.array(rows) - answer['matrix']).max() <= 0.5e-7
    for value in (*answer['position'], *answer['quaternion']):
        assert f'{value:.7f}' in text
    assert 'l_foot_dh_frame in root_link' in text and 'note' not in text
    assert max(map(len, text.splitlines())) <= 100


def test_a_joint_outside_its_range_is_noted_and_not_clamped():
    done = leg_fk('pose', 'left_leg', '--version', 'v1', '--degrees', 0, 30, 0, 0, 0, 0)
    assert done.returncode == 0
    note = ' '.join(done.stdout[done.stdout.index('note:'):].split())
    assert 'l_hip_roll = 30 deg is outside its range -119 .. 17 deg' in note
    assert 'sign slip' in note and 'never clamped' in note
    clamped = pose('left_leg', '--degrees', 0, 17, 0, 0, 0, 0)['position']
    moved = math.dist(pose('left_leg', '--degrees', 0, 30, 0, 0, 0, 0)['position'], clamped)
    assert moved == pytest.approx(0.114, abs=0.001)


@pytest.mark.parametrize(('words', 'complaint'), [
    (['left_leg'], 'one of the arguments --degrees --radians is required'),
    (['left_leg', '--degrees'], 'expected at least one argument'),
    (['left_leg', '--degrees', *ZEROS, '--radians', *ZEROS], 'not allowed with'),
    (['left_leg', '--degrees', *ZEROS[:5]], 'found 5, allowed: 6, in the order l_hip_pitch l_hip'),
    (['left_leg', '--degrees', *ZEROS, '0'], 'found 7, allowed: 6'),
    (['left_leg', '--degrees', *ZEROS[:5], 'zero'], "found 'zero', allowed: finite numbers"),
    (['left_leg', '--degrees', *ZEROS[:5], 'nan'], "found 'nan', allowed: finite numbers"),
    (['left_leg', '--degrees', *ZEROS[:5], '-inf'], "found '-inf', allowed: finite numbers"),
    (['left_leg', '--degrees', *ZEROS[:5], '1e999'], "found '1e999', allowed: finite numbers"),
    (['--degrees', *ZEROS, 'left_leg'], "found 'left_leg', allowed: finite numbers"),
    (['left_arm', '--degrees', *ZEROS], "'left_arm'; known: left_leg, right_leg, head_imu"),
    (['left_leg', '--version', 'V2_5', '--degrees', *ZEROS],
     "'V2_5'; did you mean 'v2_5'? known: v1, v2_5, v3"),
    (['head_imu', '--degrees', *ZEROS], 'give --version; known: v2'),
    (['head_imu', '--version', 'v2', '--foot-frame', 'sole', '--degrees', *ZEROS], 'known: dh'),
    ([*ARM, '--degrees', '0', '1e308', '0'], "found '1e308', allowed: finite numbers up to 1e+09"),
    (['left_leg', '--foot-frame', 'toe', '--degrees', *ZEROS], 'known: dh, sole'),
    (['left_leg', '-k', 'none.yaml', '--degrees', *ZEROS], 'none.yaml'),
])
def test_a_mistake_is_one_line_and_exit_2(words, complaint):
    assert_one_line_complaint(leg_fk('pose', *words), complaint)


def test_metres_that_may_be_millimetres_are_asked_about():
    done = leg_fk('pose', *ARM, '--degrees', 0, 200, 0.1)
    assert done.returncode == 0
    assert 'lift = 200 m: positions of prismatic joints are in metres' in done.stdout + done.stderr
