"""`leg_fk pose`."""

import json
import math

from icub_leg_fk import load_chain
from icub_leg_fk.kinematics import config_file
import numpy as np
import pytest
from support.leg_fk_process import run_main

ARM = ['arm', '-k', config_file('examples/cylindrical_arm.yaml')]
UR5 = ['ur5', '-k', config_file('examples/ur5.yaml')]
ZEROS = ['0'] * 6


def pose(*words):
    done = run_main('pose', *words, '--json')
    assert (done.returncode, done.stderr) == (0, '')
    return json.loads(done.stdout)


def notes(*words):
    """Return what is noted below the pose, in one line."""
    done = run_main('pose', *words)
    assert (done.returncode, done.stderr) == (0, '')
    return ' '.join(done.stdout.partition('note:')[2].split())


@pytest.mark.parametrize(
    ('words', 'position'),
    [
        (['left_leg=v1'], (0, -0.0681, -0.5975)),
        (['right_leg', '--version', 'v1'], (0, 0.0681, -0.5975)),
        (['left_leg'], (0.0044175, -0.0681, -0.622995)),
        (['right_leg', '--version', 'v2_5'], (0.0044175, 0.0681, -0.622995)),
    ],
)
def test_the_golden_pose_at_zero(words, position):
    answer = pose(*words, '--degrees', *ZEROS)
    x, y, z = position
    assert answer['position'] == pytest.approx(position, abs=1e-12)
    assert answer['quaternion'] == pytest.approx(
        (0, -math.sqrt(0.5), 0, math.sqrt(0.5))
    )
    expected = [[0, 0, -1, x], [0, 1, 0, y], [1, 0, 0, z], [0, 0, 0, 1]]
    assert np.allclose(answer['matrix'], expected, atol=1e-12)


def test_json_has_exactly_the_documented_keys():
    answer = pose('left_leg', '--degrees', *ZEROS)
    assert list(answer) == [
        'chain',
        'version',
        'root_frame',
        'frame_id',
        'position',
        'quaternion',
        'matrix',
    ]
    named = [answer[key] for key in ('chain', 'version', 'root_frame', 'frame_id')]
    assert named == ['left_leg', 'v2_5', 'root_link', 'l_foot_dh_frame']


def test_the_quaternion_is_the_matrix_and_the_position_its_last_column():
    pin = pytest.importorskip('pinocchio')
    answer = pose('right_leg', '--degrees', '10', '-20', '30', '-40', '50', '-60')
    matrix = np.array(answer['matrix'])
    rotation = pin.Quaternion(np.array(answer['quaternion'])).matrix()
    assert np.abs(rotation - matrix[:3, :3]).max() < 1e-12
    assert answer['position'] == matrix[:3, 3].tolist()


def test_degrees_and_radians_mean_the_same():
    degrees = [10, -20, 30, -40, 50, -60]
    radians = map(math.radians, degrees)
    assert pose('left_leg', '--degrees', *degrees) == pose(
        'left_leg', '--radians', *radians
    )


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
    assert pose(*ARM, '--radians', math.pi / 6, 0.2, 0.1)['position'] == pytest.approx(
        expected
    )
    text = run_main('pose', *ARM, '--degrees', 30, 0.2, 0.1).stdout
    assert 'lift     0.2  m    range 0 .. 0.5 m' in text


def test_a_ur5_stands_where_its_makers_table_puts_it():
    answer = pose(*UR5, '--degrees', *ZEROS)
    # a_2 + a_3, -(d_4 + d_6), d_1 - d_5
    assert answer['position'] == pytest.approx((-0.81725, -0.19145, -0.005491))


@pytest.mark.parametrize('seed', range(5))
def test_the_quaternion_has_the_sign_that_library_and_node_give(seed):
    q = np.random.default_rng(seed).uniform(-0.6, 0.6, 6).tolist()
    answer = pose('left_leg', '--foot-frame', 'sole', '--radians', *q)
    expected = load_chain('left_leg', 'v2_5', frame='sole').pose(q)[3:]
    assert answer['quaternion'] == pytest.approx(expected, abs=1e-12)


def test_the_text_shows_matrix_position_and_quaternion():
    words = ['left_leg', '--degrees', 10, 5, 0, -30, 15, 5]
    text = run_main('pose', *words).stdout
    answer = pose(*words)
    rows = [
        line.strip(' []').split()
        for line in text.splitlines()
        if line.startswith('  [')
    ]
    assert np.abs(np.array(rows, dtype=float) - answer['matrix']).max() <= 0.5e-7
    for value in (*answer['position'], *answer['quaternion']):
        assert f'{value:.7f}' in text
    assert 'left_leg v2_5: l_foot_dh_frame in root_link' in text and 'note' not in text
    assert max(map(len, text.splitlines())) <= 100


def test_a_joint_outside_its_range_is_noted_and_not_clamped():
    note = notes('left_leg=v1', '--degrees', 0, 30, 0, 0, 0, 0)
    assert 'l_hip_roll = 30 deg is outside its range -119 .. 17 deg' in note
    assert 'never clamped' in note
    moved = pose('left_leg', '--degrees', 0, 30, 0, 0, 0, 0)['position']
    clamped = pose('left_leg', '--degrees', 0, 17, 0, 0, 0, 0)['position']
    assert math.dist(moved, clamped) == pytest.approx(0.114, abs=0.001)


def test_an_erratum_of_the_printed_range_is_noted_where_that_range_counts():
    roll = ['--degrees', 0, 130, 0, 0, 0, 0]
    assert 'sign slip' in notes('left_leg=v1', *roll)
    assert 'range -20 .. 120 deg; computed as given' in notes('left_leg=v2_5', *roll)


def test_metres_that_may_be_millimetres_are_noted():
    assert 'lift = 200 m: positions of prismatic joints are in metres' in notes(
        *ARM, '--degrees', 0, 200, 0.1
    )
