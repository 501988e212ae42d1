"""`leg_fk explain` in decimals, and what holds of every form of it."""

import json
import re

import numpy as np
import pytest
from support.explain_cases import (
    every_chain,
    EXAMPLES,
    explain,
    in_metres,
    one_chain_of_each_kind,
    positions,
)
from support.leg_fk_process import assert_one_line_complaint, leg_fk


@every_chain
def test_the_answer_is_the_chains_pose(words, chain):
    q = positions(chain, 1)
    e = json.loads(explain(*words, '--json', '--radians', *q))
    assert np.abs(in_metres(e['T_root_tip']) - chain.forward(q)).max() < 1e-12
    assert (e['chain'], e['version']) == (chain.name, chain.version)
    assert (e['root_frame'], e['frame_id']) == (chain.root_frame, chain.frame_id)


@every_chain
def test_each_step_follows_from_the_one_before(words, chain):
    e = json.loads(explain(*words, '--json', '--radians', *positions(chain, 2)))
    T_0 = np.eye(4)
    for link, product in zip(e['links'], e['running_products'], strict=True):
        order = ['Rx', 'tx', 'Rz', 'tz'] if chain.convention == 'modified' else [
            'Rz', 'tz', 'tx', 'Rx']
        assert list(link['factors']) == order
        factors = [np.array(factor) for factor in link['factors'].values()]
        assert np.allclose(np.linalg.multi_dot(factors), link['A'], rtol=0, atol=1e-10)
        T_0 = T_0 @ link['A']
        assert np.allclose(T_0, product, rtol=0, atol=1e-10)
    T = np.array(e['T_root_0']) @ T_0
    for after in e['after_last_link'].values():
        T = T @ after
    assert np.allclose(T, e['T_root_tip'], rtol=0, atol=1e-10)


@every_chain
def test_the_frames_obey_the_first_four_steps_of_the_method(words, chain):
    e = json.loads(explain(*words, '--json', '--radians', *positions(chain, 3)))
    n = len(e['links']) + 1
    assert e['frame_names'][:n] == [str(i) for i in range(n)]
    assert len(e['frames']) == n + len(e['after_last_link'])
    frames = e['frames'][:n]
    for own, other in zip(frames[1:], frames, strict=False):
        if chain.convention == 'modified':  # where x_i is orthogonal to the axis behind it
            own, other = other, own
        assert abs(np.dot(own['x'], other['z'])) < 1e-12
        assert abs(np.dot(own['x'], own['z'])) < 1e-12
        assert np.allclose(np.cross(own['z'], own['x']), own['y'], atol=1e-12)
        # x points along the common normal, so that from the other axis it meets the origin.
        reach = np.subtract(own['origin'], other['origin'])
        assert abs(np.dot(np.cross(other['z'], own['x']), reach)) < 1e-9


@pytest.mark.parametrize(('words', 'position'), [
    (['left_leg', '--version', 'v1'], (0, -68.1, -597.5)),
    (['right_leg', '--version', 'v1'], (0, 68.1, -597.5)),
    (['left_leg', '--version', 'v2_5'], (4.4175, -68.1, -622.995)),
    (['right_leg', '--version', 'v2_5'], (4.4175, 68.1, -622.995)),
    (['head_imu', '--version', 'v2'], (13, 6.6, 375.6)),
])
def test_at_zero_the_text_ends_with_the_documented_position(words, position):
    text = explain(*words, '--degrees', *[0] * 6)
    x, y, z = position
    assert f'is at x = {x:g}, y = {y:g}, z = {z:g} mm in root_link.' in text.splitlines()[-1]


def test_numbers_stand_with_their_points_under_each_other():
    lines = explain('left_leg', '--degrees', 10, 12, 14, -30, -15, 5).splitlines()
    first = next(i for i, line in enumerate(lines) if 'T_RoLf = T_Ro0 T_06 = [' in line) - 1
    points = [[match.start() for match in re.finditer(r'\.', line)]
              for line in lines[first:first + 3]]
    assert len(points[0]) == 4 and points[0] == points[1] == points[2]


@one_chain_of_each_kind
def test_every_line_fits_a_terminal(words, chain):
    for values in ([], ['--radians', *positions(chain, 4)]):
        for line in explain(*words, *values).splitlines():
            assert len(line) <= 100, line


def test_a_prismatic_arm_is_explained_as_the_textbook_has_it():
    text = explain('arm', '-k', EXAMPLES / 'cylindrical_arm.yaml', '--version', 'v1')
    # T_03 of Spong, Hutchinson and Vidyasagar's example 3.2, with d_1 = 400 and their d_2, d_3.
    assert text.count('T_RoE = T_Ro0 T_03 =') == 1
    rows = [' '.join(row.split()) for row in re.findall(r'\[([^]]*)\]', text)[-4:]]
    assert rows == ['c_0 0 -s_0 -d_2 s_0', 's_0 0 c_0 c_0 d_2', '0 -1 0 d_1 + 400', '0 0 0 1']
    assert 'd_2      = q_2 + 150' in text and 'lift slides along it' in text


def test_the_steps_are_walked_in_order():
    text = explain('left_leg', '--degrees', *[0] * 6)
    places = [text.index(f'Step {i}.') for i in range(1, 7)]
    assert places == sorted(places)
    for words in ('A_5 = T_56 = Rz(theta_5) tz(d_5) tx(a_5) Rx(alpha_5)', 'T_06 = T_05 A_5',
                  'T_Ro0 =', 'T_RoLf = T_Ro0 T_06'):
        assert words in text
    assert 'z_2 ends, 0.9175 mm away' in text and 'z_0 and z_1 meet here' in text
    assert 'z_4 parallel to z_3, 200.5 mm away' in text


@pytest.mark.parametrize(('words', 'complaint'), [
    ([], 'CHAIN'),
    (['left_foot'], "unknown chain 'left_foot'; known: left_leg, right_leg, head_imu"),
    (['left_leg', '--version', 'v4'], 'known: v1, v2_5, v3'),
    (['left_leg', '--foot-frame', 'toe'], 'known: dh, sole'),
    (['left_leg', '--degrees', '1', '2'], 'found 2, allowed: 6, in the order l_hip_pitch'),
    (['left_leg', '--degrees', 'x'], "found 'x', allowed: finite numbers"),
    (['left_leg', '--json', '--latex'], 'not allowed with'),
    (['left_leg', '--degrees', '1', '--radians', '1'], 'not allowed with'),
    (['left_leg', '-k', 'missing.yaml'], 'missing.yaml'),
])
def test_a_mistake_is_one_line_and_exit_2(words, complaint):
    assert_one_line_complaint(leg_fk('explain', *words), complaint)


def test_joints_outside_their_range_are_said_as_in_pose():
    text = explain('left_leg', '--degrees', 0, -30, 0, 0, 0, 0)
    note = ' '.join(text[text.index('note:'):].split())
    assert note.startswith('note: l_hip_roll = -30 deg is outside its range -20 .. 120 deg')
    assert 'never clamped' in note
    assert 'never clamped' in explain('left_leg', '--latex', '--degrees', 0, -30, 0, 0, 0, 0)
    assert 'note:' not in explain('left_leg', '--degrees', 0, 30, 0, 0, 0, 0)


def test_the_head_sensors_transform_is_told_as_the_fixed_row_of_its_document():
    text = ' '.join(explain('head_imu', '--version', 'v2', '--degrees', *[0] * 6).split())
    assert ('T_nIs is what a last fixed row would be, whose joint stays at 0: a = 0, d = 6.6, '
            'alpha = pi/2, theta = 0') in text
    assert 'z_Is = ( 0 0 1) as T_nIs has it' in text


def test_latex_ends_with_the_sentence_that_the_text_ends_with():
    words = ['left_leg', '--degrees', 0, 10, 0, -30, -15, 5]
    sentence = explain(*words).splitlines()[-1]
    assert sentence.replace('_', r'\_') in explain(*words, '--latex')
