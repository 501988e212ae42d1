"""`leg_fk explain` in decimals, and what holds of every form of it."""

from dataclasses import replace
import re

from hypothesis import given, settings
from icub_leg_fk.kinematics.chain_text import joint_range
from icub_leg_fk.kinematics.link import standard_rows
from icub_leg_fk.tools.explanation import explain as explained
from icub_leg_fk.tools.explanation_latex import as_latex
from icub_leg_fk.tools.explanation_text import as_text
import numpy as np
import pytest
from support.any_chain import chains_and_positions
from support.explain_cases import (
    Case,
    every_chain,
    explain,
    HEAD,
    in_metres,
    LEG,
    ODD,
    one_chain_of_each_kind,
)
from support.robots import joint, robot

ORDERS = {'standard': ['Rz', 'tz', 'tx', 'Rx'], 'modified': ['Rx', 'tx', 'Rz', 'tz']}
V1_LEG = Case('left_leg=v1', 'dh')


def assert_near(one, other, tolerance=1e-10):
    assert np.abs(np.subtract(one, other)).max() < tolerance


@every_chain
def test_the_answer_is_the_chains_pose(case):
    chain, (q, words) = case.chain, case.radians(1)
    e = case.json(*words)
    assert_near(in_metres(e['T_root_tip']), chain.forward(q), 1e-12)
    about = [e[name] for name in ('chain', 'version', 'root_frame', 'frame_id')]
    assert about == [chain.name, chain.version, chain.root_frame, chain.frame_id]


@every_chain
def test_each_step_follows_from_the_one_before(case):
    _, words = case.radians(2)
    e = case.json(*words)
    T = np.eye(4)
    for link, product in zip(e['links'], e['running_products'], strict=True):
        assert list(link['factors']) == ORDERS[e['convention']]
        assert_near(np.linalg.multi_dot([*link['factors'].values()]), link['A'])
        T = T @ link['A']
        assert_near(T, product)
    for after in e['after_last_link'].values():
        T = T @ after
    assert_near(e['T_root_0'] @ T, e['T_root_tip'])


@every_chain
def test_the_frames_obey_the_first_four_steps_of_the_method(case):
    _, words = case.radians(3)
    e = case.json(*words)
    n = len(e['links']) + 1
    assert e['frame_names'][:n] == [str(i) for i in range(n)]
    assert len(e['frames']) == n + len(e['after_last_link'])
    frames = e['frames'][:n]
    for own, other in zip(frames[1:], frames, strict=False):
        if e['convention'] == 'modified':  # where x_i is orthogonal to the next axis
            own, other = other, own
        assert_near([np.dot(own['x'], z) for z in (other['z'], own['z'])], 0, 1e-12)
        assert_near(np.cross(own['z'], own['x']), own['y'], 1e-12)
        # x points along the common normal, so that from the other axis it meets the origin.
        reach = np.subtract(own['origin'], other['origin'])
        assert_near(np.dot(np.cross(other['z'], own['x']), reach), 0, 1e-9)


@settings(max_examples=30)
@given(chains_and_positions())
def test_any_table_in_either_convention_is_explained(drawn):
    standard, (q, *_) = drawn
    modified = replace(
        standard, links=standard_rows(standard.links), convention='modified'
    )
    for chain in (standard, modified):
        e = explained(chain, q)
        # Millimetres are rounded to 13 digits, and metres may add up.
        assert_near(in_metres(e.T_root_tip), chain.forward(q), 2e-11)
        assert as_text(e) and as_latex(e)


def numbers(words):
    return [float(word) for word in re.findall(r'-?\d+(?:\.\d+)?', words)]


@one_chain_of_each_kind
def test_text_latex_and_json_give_the_same_answer(case):
    _, words = case.radians(4)
    text, latex = case.explain(*words), case.explain('--latex', *words)
    in_text = ' '.join(re.findall(r'\[(.*)\]', text)[-4:])
    in_latex = re.findall(r'\\begin\{bmatrix\}(.*)\\end\{bmatrix\}', latex)[-1]
    assert_near(numbers(in_text), np.ravel(case.json(*words)['T_root_tip']), 6e-5)
    assert numbers(in_latex) == numbers(in_text)
    sentence = next(line for line in text.splitlines() if ' is at x = ' in line)
    assert sentence.replace('_', r'\_') in latex.replace('$-$', '-')


@one_chain_of_each_kind
def test_every_line_fits_a_terminal(case):
    _, words = case.radians(5)
    for text in (case.explain(), case.explain(*words)):
        assert max(map(len, text.splitlines())) <= 100


@pytest.mark.parametrize('case', [LEG, V1_LEG, ODD])
def test_text_and_json_give_the_same_ranges(case):
    zeros = ['--degrees', *[0] * case.chain.n]
    text = ' '.join(case.explain(*zeros).split())
    for link, row in zip(case.json(*zeros)['links'], case.chain.rows(), strict=True):
        if link['printed_range']:
            lower, upper = np.degrees(link['printed_range']).tolist()
            assert f'({lower:g} -> {upper:+g})' in text
        if link['range'] != link['printed_range']:
            assert link['range'] == list(row.link.limits)
            assert f'{row.joint} {joint_range(row.link)}' in text
    assert ('Ranges of robots' in text) == (case is LEG)


def test_rows_that_follow_another_joint_are_named_as_such():
    lines = [' '.join(line.split()) for line in ODD.explain().splitlines()]
    for line in (
        'i = 1 250 0 pi -40.107 - (-90 -> +90) elbow',
        'i = 5 30 0 -pi/2 5.7296 + 0.5 q follows elbow',
        'i = 6 0 200 + 0.349066 q 0 0 follows shoulder',  # mm per degree
        'theta_5 = 0.5 q_1 + 0.1',
        'd_6 = 20 q_0 + 200',
    ):
        assert line in lines
    assert 'a row that follows elbow turns about it' in ' '.join(lines)


def test_joints_outside_their_range_are_said_as_in_pose():
    outside = ['--degrees', 0, -30, 0, 0, 0, 0]
    text = LEG.explain(*outside)
    note = ' '.join(text[text.index('note:') :].split())
    assert note.startswith(
        'note: l_hip_roll = -30 deg is outside its range -20 .. 120 deg'
    )
    assert 'never clamped' in note
    assert 'never clamped' in LEG.explain('--latex', *outside)
    assert 'note:' not in LEG.explain('--degrees', 0, 30, 0, 0, 0, 0)


def test_the_head_sensors_transform_is_the_fixed_row_of_its_document():
    text = HEAD.explain('--degrees', *[0] * 6)
    assert (
        'T_nIs equals a last fixed row: a = 0, d = 6.6, alpha = pi/2, theta = 0' in text
    )
    assert 'z_Is = ( 0 0 1) as T_nIs has it' in ' '.join(text.split())


@pytest.mark.parametrize(
    ('tilt', 'source'),
    [
        (
            '0.00001',
            'arm.urdf, tidied, which costs at most 0.0050 mm, 0.0010 deg in 1000',
        ),
        ('0', 'arm.urdf'),
    ],
)
def test_of_a_urdf_the_tidied_table_is_shown_and_what_that_costs(tilt, source, written):
    joints = [joint(0), joint(1, xyz='0.3 0 0', rpy=f'{tilt} 0 0')]
    text = robot([*joints, joint(2, 'fixed', xyz='0.5 0 0')])
    file = written(text, 'arm.urdf')
    text = ' '.join(explain('l3', '-k', file, '--degrees', 10, 20).split())
    assert 'i = 0 300 0 0 0 + (-114.5916 -> +114.5916) j0' in text
    assert f'Table from: {source}' in text
    assert Case('l3', 'l3', file).json()['source'].startswith(source)
