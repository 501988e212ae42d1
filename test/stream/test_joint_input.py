"""The joint input beyond its rules, which test_joint_input_sequences.py holds it to."""

import math
import tracemalloc

import pytest
from support.joint_model import Message
from support.leg_input import BOTH, LEFT, LegInput, LEGS, RIGHT


@pytest.fixture
def robot():
    return LegInput()


def left_leg(robot):
    return robot.take_look().chains['left_leg']


@pytest.mark.parametrize(
    ('names', 'positions', 'reason', 'fault'),
    [
        (LEFT, [0.2] * 5, 'position_length', 'position has 5 values for 6 names'),
        (LEFT, [0.2] * 7, 'position_length', 'position has 7 values for 6 names'),
        ((), [0.2], 'position_length', 'position has 1 values for 0 names'),
        ((*LEFT, 'l_knee'), [0.2] * 7, 'duplicate_name', "name 'l_knee' appears twice"),
        (
            (*LEFT, 'wheel', 'wheel'),
            [0.2] * 8,
            'duplicate_name',
            "name 'wheel' appears twice",
        ),
        (LEFT, [], 'empty_position', 'position is empty'),
        ((), [], 'empty_position', 'position is empty'),
        (('a', 'a'), [], 'empty_position', 'position is empty'),
    ],
)
def test_a_message_is_rejected_as_a_whole(robot, names, positions, reason, fault):
    robot.send(0, LEFT, [0.1] * 6)
    assert robot.ready(1, names, positions) == []
    look = robot.take_look()
    assert look.rejected == {reason: 1}
    assert look.faults == {reason: fault}
    assert robot.send(2, LEFT[5:], [0.3])[0].positions == (0.1,) * 5 + (0.3,)


def test_a_very_long_name_does_not_fill_the_log(robot):
    robot.send(0, ('x' * 100_000,) * 2)
    assert len(robot.take_look().faults['duplicate_name']) < 100


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf, 1e150, 1e200])
def test_an_angle_that_is_not_finite_holds_back_just_its_chain(robot, value):
    positions = [-0.1] * 12
    positions[3] = value
    assert robot.ready(0, BOTH, positions) == ['right_leg']
    look = left_leg(robot)
    assert look.held_back == {'non_finite': 1}
    assert str(look.joints['non_finite']) == str({'l_knee': value})


@pytest.mark.parametrize(
    ('knee', 'noted'),
    [(-2.0, False), (-7.0, False), (-8.5, True), (6.2, False), (-45.0, True)],
)
def test_a_position_a_whole_turn_out_of_range_looks_like_degrees(robot, knee, noted):
    robot.send(0, LEFT, [0.0, 0.0, 0.0, knee, 0.0, 0.0])
    expected = {'l_knee': knee} if noted else None
    assert left_leg(robot).joints.get('looks_like_degrees') == expected


@pytest.mark.parametrize(
    ('timeout', 'stamps', 'steps'),
    [
        (0.5, (0, 10, 0), 0),
        (0.5, (1, 10, 0), 1),
        (0.5, (None, 500, 0), 0),
        (0.5, (None, 501, 0), 1),
        (0, (None, 10**8, 0), 0),
    ],
)
def test_time_has_stepped_back_from_what_is_held_of_a_joint_or_from_all_by_the_timeout(
    timeout, stamps, steps
):
    robot = LegInput(timeout)
    before, other, now = stamps
    if before is not None:
        robot.send(before, LEFT)
    robot.send(other, RIGHT)
    assert robot.ready(now, LEFT) == ['left_leg']
    assert robot.take_look().rejected['time_jump'] == steps
    assert len(robot.held_stamps(LEGS[1])) == 6 * (1 - steps)


def test_velocities_are_known_only_from_when_they_are_wanted():
    robot = LegInput(velocities=False)
    [vector] = robot.send(0, LEFT, [0.1] * 6, [1.0] * 6)
    assert vector.velocities is None
    robot.configure(LEGS, 0.5, velocities=True)
    assert robot.send(1, LEFT[:5], [0.1] * 5, [1.0] * 5)[0].velocities is None
    assert left_leg(robot).held_back == {'no_velocity': 1}
    assert robot.send(2, LEFT[5:], [0.1], [2.0])[0].velocities == (1.0,) * 5 + (2.0,)


def test_another_configuration_goes_on_with_what_is_held_and_counted(robot):
    robot.send(0, BOTH, [0.1] * 12)
    robot.configure(LEGS[::-1], 0.5)
    [vector] = robot.send(1, LEFT[:1], [0.2])
    assert vector.positions == (0.2,) + (0.1,) * 5
    look = robot.take_look()
    assert (
        look.messages,
        look.chains['left_leg'].ready,
        look.chains['right_leg'].ready,
    ) == (2, 2, 1)


def test_joints_of_chains_that_are_gone_do_not_move_time(robot):
    robot.send(0, LEFT)
    robot.send(400, RIGHT)
    robot.configure(LEGS[:1], 0.1)
    assert robot.ready(0, LEFT[:1]) == ['left_leg']
    assert robot.take_look().rejected == {}
    robot.configure(LEGS, 0.1)
    assert robot.held_stamps(LEGS[1]) == {}


def test_what_strangers_send_is_not_hoarded(robot):
    """Name lists are remembered for speed, but neither too many nor too long ones."""
    robot.send(0, BOTH)
    tracemalloc.start()
    for i in range(20):
        many_names = (*LEFT, f'{i}', *(f'{i}.{j}' for j in range(500)))
        assert robot.ready(1, many_names, frame_id='y' * (50_000 + i)) == ['left_leg']
        assert robot.ready(1, (*LEFT, f'{i}', 'x' * (100_000 + i))) == ['left_leg']
        assert robot.ready(1, (*LEFT[:3], f'{i}')) == ['left_leg']
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < 1_000_000


def test_equal_bytes_in_another_order_are_told_apart(robot):
    data = Message(1, 0, LEFT, (0.1,) * 6, order='>').cdr()
    assert robot.feed(data)[0].positions == (0.1,) * 6
    assert robot.feed(b'\x00\x01' + data[2:]) == []
    assert robot.take_look().rejected == {'malformed': 1}


def test_a_message_cut_short_does_not_blur_what_is_remembered_of_others(robot):
    data = Message(1, 0, ('turn', 'lift', 'reach', 'tilt'), (0.1, 0.2, 0.3, 0.4)).cdr()
    robot.feed(data[:20] + bytes(4) + data[24:])  # no names, and their text as numbers
    robot.feed(data[:13])
    robot.feed(data)
    assert robot.take_look().rejected == {'position_length': 1, 'malformed': 1}


def test_a_look_has_the_names_that_came_of_every_publisher(robot):
    robot.send(0, ['L_KNEE', 'icub/l_knee'])
    robot.send(1, ['wheel', 'l_knee'], [])
    robot.send(2, ['L_KNEE', 'icub/l_knee'])
    robot.feed(b'')
    look = robot.take_look()
    assert [*look.names] == ['L_KNEE', 'icub/l_knee', 'wheel', 'l_knee']
    assert look.joints == {'l_knee'}
    robot.send(3, ['wheel'])
    assert [*robot.take_look().names] == ['wheel']
    assert [*robot.take_look().names] == []
