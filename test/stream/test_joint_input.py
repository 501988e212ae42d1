"""The rules of the joint input, one by one, on the iCub's legs."""

import math
import tracemalloc

from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.stream.joint_input import JointInput
import pytest
from support.joint_model import Message

LEFT, RIGHT = 0, 1
MS = 1_000_000  # ns
START = 1_700_000_000_000 * MS


def joint_state(ms, names, positions, velocities=(), **more):
    """Return the bytes of a message at a time [ms from the start]."""
    sec, nanosec = divmod(START + ms * MS, 1_000_000_000)
    return Message(sec, nanosec, tuple(names), tuple(positions), tuple(velocities), **more).cdr()


class Robot:
    """A joint input of both legs, with what it reported."""

    def __init__(self, joint_timeout=0.5, velocities=True):
        catalog = Catalog.load()
        self.chains = [catalog.chain(name, 'v2_5') for name in ('left_leg', 'right_leg')]
        self.left, self.right = (chain.joint_names for chain in self.chains)
        self.both = self.left + self.right
        self.reports = []
        self.input = JointInput(self.chains, joint_timeout, lambda: START,
                                lambda reason, text: self.reports.append((reason, text)),
                                velocities)

    def send(self, ms, names, positions=None, velocities=()):
        """Send a message at a time [ms from the start] and return what it made ready."""
        if positions is None:
            positions = [0.01 * i for i in range(len(names))]
        return self.input.feed(joint_state(ms, names, positions, velocities))

    def ready(self, *args, **kwargs):
        return [vector.chain for vector in self.send(*args, **kwargs)]

    def reported(self):
        """Return the only report since the last call."""
        [report] = self.reports
        self.reports.clear()
        return report


@pytest.fixture
def robot():
    return Robot()


def test_a_chain_is_ready_when_its_last_joint_came(robot):
    assert robot.ready(0, robot.left[:4]) == []
    reason, text = robot.reported()
    assert reason == 'missing_joint'
    assert text == ('left_leg: no pose: l_ankle_pitch never seen, l_ankle_roll never seen')
    assert robot.ready(1, robot.left[4:]) == [LEFT]
    assert robot.ready(2, robot.left[:1]) == [LEFT]


@pytest.mark.parametrize(('timeout', 'age', 'ready'), [
    (0.5, 500, True), (0.5, 501, False), (0.02, 20, True), (0.02, 21, False), (0, 10**8, True)])
def test_a_joint_older_than_the_timeout_beside_its_newest_peer_holds_the_chain_back(
        timeout, age, ready):
    robot = Robot(timeout)
    robot.send(0, robot.left)
    assert robot.ready(age, robot.left[1:]) == ([LEFT] if ready else [])
    if not ready:
        assert robot.reported() == (
            'stale_joint', f'left_leg: no pose: l_hip_pitch {age / 1000:.3f} s old')
        assert robot.ready(age + 1, robot.left[:1]) == [LEFT]


@pytest.mark.parametrize('short', [1, 5])
def test_positions_shorter_than_names_reject_the_message(robot, short):
    robot.send(0, robot.left, [0.1] * 6)
    assert robot.ready(1, robot.left, [0.2] * (6 - short)) == []
    assert robot.reported() == (
        'short_position', f'position has {6 - short} values for 6 names; message ignored')
    assert robot.send(2, robot.left[5:], [0.3])[0].positions == (0.1,) * 5 + (0.3,)


def test_an_empty_position_is_counted_only(robot):
    for names in (robot.both, (), ('a', 'a')):
        assert robot.ready(0, names, []) == []
    assert robot.reports == []
    assert robot.input.counts == {'empty_position': 3}


def test_a_name_that_stands_twice_rejects_the_message_even_a_strangers(robot):
    robot.send(0, robot.left, [0.1] * 6)
    for twice in ('l_knee', 'stranger'):
        assert robot.ready(1, (*robot.left, twice, 'stranger'), [0.2] * 8) == []
        assert robot.reported() == (
            'duplicate_name', f'name {twice!r} appears twice; message ignored')
    assert robot.send(2, robot.left[5:], [0.3])[0].positions == (0.1,) * 5 + (0.3,)


def test_a_very_long_name_does_not_fill_the_log(robot):
    robot.send(0, ('x' * 100_000,) * 2)
    assert len(robot.reported()[1]) < 120


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf, 1e200])
def test_an_angle_that_is_not_finite_holds_back_just_its_chain(robot, value):
    positions = [0.1] * 12
    positions[3] = value
    assert robot.ready(0, robot.both, positions) == [RIGHT]
    assert robot.reported() == ('non_finite', f'left_leg: no pose: l_knee {value}')
    assert robot.ready(1, robot.left[:3]) == []
    assert robot.ready(2, ['l_knee']) == [LEFT]


def test_out_of_range_goes_out_as_it_is_and_is_noted(robot):
    [vector] = robot.send(0, robot.left, [0.0, 0.0, 0.0, 9.0, 0.0, -8.0])
    assert vector.positions == (0.0, 0.0, 0.0, 9.0, 0.0, -8.0)
    counts = robot.input.chain_counts[LEFT]
    assert counts.joints['out_of_range'] == {'l_knee': '9', 'l_ankle_roll': '-8'}
    assert counts.ready == 1


def test_a_looping_bag_goes_on_with_the_very_message_and_says_so_once(robot):
    for _ in range(3):
        for ms in range(0, 20_000, 100):
            assert robot.ready(ms, robot.both) == [LEFT, RIGHT]
    assert [reason for reason, _ in robot.reports] == ['time_jump'] * 2
    assert robot.reports[0][1] == (
        'time stepped back to 1700000000.000 s; held joints are forgotten')


def test_velocities_that_nobody_wants_are_none_and_none_are_known_when_they_are_wanted_again():
    unwanting = Robot(velocities=False)
    [vector] = unwanting.send(0, unwanting.left, [0.1] * 6, [1.0] * 6)
    assert vector.velocities is None
    wanting = Robot()
    wanting.input.take_over(unwanting.input)
    assert wanting.send(1, wanting.left[:5], [0.1] * 5, [1.0] * 5)[0].velocities is None
    assert wanting.send(2, wanting.left[5:], [0.1], [2.0])[0].velocities == (1.0,) * 5 + (2.0,)


def test_what_strangers_send_is_not_hoarded(robot):
    """Name lists are remembered for speed, but neither too many nor too long ones."""
    robot.send(0, robot.both)
    tracemalloc.start()
    for i in range(100):
        assert robot.ready(1, (*robot.left, f'{i}', *(f'{i}.{j}' for j in range(2000)))) == [LEFT]
        assert robot.ready(1, (*robot.left, f'{i}', 'x' * (100_000 + i))) == [LEFT]
        assert robot.ready(1, (*robot.left, f'{i}')) == [LEFT]
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < 1_000_000


def test_a_new_input_takes_over_what_is_held(robot):
    robot.send(0, robot.both, [0.1] * 12)
    successor = JointInput(robot.chains[::-1], 0.5, lambda: START)
    successor.take_over(robot.input)
    [vector] = successor.feed(joint_state(1, robot.left[:1], [0.2]))
    assert vector.positions == (0.2,) + (0.1,) * 5
    assert successor.messages == 2


def test_joints_that_are_not_taken_over_do_not_move_time():
    before, catalog = Robot(), Catalog.load()
    before.send(0, before.left)
    before.send(400, before.right)
    successor = JointInput([catalog.chain('left_leg', 'v1')], 0.1, lambda: START)
    successor.take_over(before.input)
    assert successor.newest == START
    assert [vector.chain for vector in successor.feed(joint_state(0, before.left[:1], [0.2]))
            ] == [0]
    assert successor.counts == {}


def test_big_endian_messages_are_read_and_equal_bytes_in_another_order_are_told_apart(robot):
    data = joint_state(0, robot.left, [0.1] * 6, order='>')
    [vector] = robot.input.feed(data)
    assert vector.positions == (0.1,) * 6
    assert robot.input.feed(b'\x00\x01' + data[2:]) == []
    assert robot.reported()[0] == 'malformed'


def test_degrees_for_radians_are_noted(robot):
    robot.send(0, robot.left, [7.0, 5.0, 0.0, -45.0, 3.0, 0.0])
    assert list(robot.input.chain_counts[LEFT].joints['looks_like_degrees']) == ['l_knee']
    robot.send(1, robot.left, [math.radians(value) for value in (130, 100, 70, -120, 30, 20)])
    assert robot.input.take_counts(LEFT).ready == 2


def test_the_names_that_came_are_known_of_every_publisher(robot):
    robot.send(0, ['L_KNEE', 'icub/l_knee'])
    robot.send(1, ['wheel'], [])
    robot.send(2, ['L_KNEE', 'icub/l_knee'])
    robot.input.feed(b'')
    assert set(robot.input.names_since()) == {'L_KNEE', 'icub/l_knee', 'wheel'}
    assert set(robot.input.names_since(2)) == {'L_KNEE', 'icub/l_knee'}
    assert robot.input.names_since(3) == ()
    long = ('x' * 100_000, 'l_knee')
    robot.send(3, long)
    assert robot.input.names_since(4) == long
