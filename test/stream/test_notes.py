"""Notes: what there is to say of messages, joints and names."""

import math

from icub_leg_fk.stream.notes import notes_of
import pytest
from support.leg_input import BOTH, LEFT, LegInput, RIGHT

STANDING = [0.0] * 12


@pytest.fixture
def robot():
    return LegInput(velocities=False)


def lines(robot):
    return [str(note) for note in notes_of(robot.take_look(), '/joint_states')]


def test_malformed_messages(robot):
    robot.feed(b'\x00\x01\x00\x00')
    assert lines(robot) == [
        '1 message rejected: JointState: header.stamp ends at byte 12; allowed: 4'
    ]


def test_empty_positions_only_if_nothing_else_comes(robot):
    robot.send(0, BOTH, [])
    assert lines(robot) == [
        'no message on /joint_states has positions: position is empty'
    ]
    robot.send(1, BOTH, [])
    robot.send(2)
    assert lines(robot) == []


def test_joints_that_hold_a_chain_back(robot):
    robot.send(0, RIGHT[:5])
    robot.send(0, RIGHT[:5])
    assert 'right_leg: no pose from 2 messages: r_ankle_roll never seen' in lines(robot)
    robot.send(1)
    robot.send(1002, (*LEFT[1:], *RIGHT))
    robot.send(1003, BOTH, [math.nan] + [0.0] * 11)
    assert lines(robot) == [
        'left_leg: no pose from 1 message: l_hip_pitch 1.001 s old',
        'left_leg: no pose from 1 message: l_hip_pitch nan',
    ]


def test_velocities_that_are_wanted_and_do_not_come():
    robot = LegInput()
    robot.send(0, LEFT, STANDING[:6], [0.1] * 5 + [math.inf])
    robot.send(1, RIGHT)
    unknown = ', '.join(f'{joint} unknown' for joint in RIGHT)
    assert lines(robot) == [
        'left_leg: no twist from 1 message: velocity of l_ankle_roll inf',
        f'right_leg: no twist from 1 message: velocity of {unknown}',
    ]


def test_a_loop_is_told_from_publishers_that_contradict_each_other(robot):
    def loop(times):
        for ms in [*range(100)] * times:
            robot.send(ms)

    loop(1)
    assert lines(robot) == []
    for _ in range(2):
        loop(1)
        assert lines(robot) == [
            'time stepped back to 1700000000.000 s; held joints are forgotten'
        ]
    loop(5)
    assert lines(robot) == [
        'time stepped back 5 times, last to 1700000000.000 s; held joints are forgotten'
    ]
    for ms in range(100):
        robot.send(100 + ms)
        robot.send(99 + ms)
    assert lines(robot) == [
        'time stepped back 100 times in 200 messages, last to 1700000000.198 s: do several '
        'publishers bring the same joints?'
    ]


NEAR = "; '{}' is nearly 'l_knee', but names must be equal"
PREFIX = "; '{}' is looked for with joint_prefix:={}"


@pytest.mark.parametrize(
    ('name', 'hint'),
    [
        ('L_KNEE', NEAR),
        ('l_knee_joint', NEAR),
        ('ICUB_L_KNEE', NEAR),
        ('icub/l_knee_1', NEAR),
        ('icub/l_knee', PREFIX.format('icub/l_knee', 'icub/')),
        ('icub::l_knee', PREFIX.format('icub::l_knee', 'icub::')),
        ('r_knee', ''),
        ('special_knee', ''),
        ('l_kneecap', ''),
    ],
)
def test_names_that_match_nothing_with_those_that_are_near(robot, name, hint):
    robot.send(0, ('wheel', name, *RIGHT[4:]))
    assert lines(robot)[0] == (
        f'left_leg: no message on /joint_states has one of its joints ({", ".join(LEFT)}); names '
        f'that came: wheel, {name}, r_ankle_pitch, r_ankle_roll{hint.format(name)}'
    )


@pytest.mark.parametrize(
    ('name', 'prefix'), [('icub1/l_knee', 'icub1/'), ('l_knee', '""')]
)
def test_names_under_another_prefix(name, prefix):
    robot = LegInput(velocities=False, joint_prefix='icub2/')
    robot.send(0, [name])
    [left, right] = [
        note.text for note in notes_of(robot.take_look(), joint_prefix='icub2/')
    ]
    assert 'has one of its joints (icub2/l_hip_pitch, icub2/l_hip_roll' in left
    assert left.endswith(PREFIX.format(name, prefix))
    assert right.endswith(f'names that came: {name}')


def test_many_long_names_fit_a_line(robot):
    robot.send(0, [f'{i}{"x" * 9999}' for i in range(2000)])
    for line in lines(robot):
        assert len(line) < 1000
        assert line.endswith('x, ...')


def test_a_joint_that_came_in_any_message_is_not_missed(robot):
    robot.send(0, ['wheel'])
    robot.send(1, BOTH, [])
    assert lines(robot) == []


def test_joints_of_one_name_from_two_robots(robot):
    """As `mk.py two_robots` of the cases beside the project has it."""
    for ms in range(4):
        robot.send(ms, frame_id=f'robot{ms % 2 + 1}/base')
    for line, side in zip(lines(robot), ('left', 'right'), strict=True):
        assert line == (
            f'{side}_leg: {side[0]}_hip_pitch comes under the frame ids '
            "'robot1/base' and 'robot2/base': from 2 robots?"
        )


def test_two_frame_ids_of_different_joints_are_no_conflict(robot):
    robot.send(0, LEFT, frame_id='left')
    robot.send(0, RIGHT, frame_id='right')
    robot.send(0, ['wheel'], frame_id='base')
    assert lines(robot) == []
