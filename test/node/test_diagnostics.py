"""What the node says of itself on /diagnostics."""

import math
import time

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import TwistStamped
import pytest
from support.node_harness import BOTH, LEFT, LOSSLESS, nanoseconds, NodeProcess, Robot, SECOND

MS = 1_000_000  # ns
OK, WARN, ERROR, STALE = (DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR,
                          DiagnosticStatus.STALE)
REASONS = ('malformed', 'empty_position', 'short_position', 'duplicate_name', 'time_jump')


class Traffic:
    """Sends joint states with stamps that go on by a millisecond each."""

    def __init__(self, robot):
        self.robot = robot
        self.stamp = SECOND

    def __call__(self, names=BOTH, positions=None, **fields):
        self.stamp += MS
        self.robot.send(self.stamp, names, positions, **fields)

    def sender(self, *arguments, **fields):
        return lambda: self(*arguments, **fields)


@pytest.fixture(scope='module')
def shared():
    """Return a robot beside a node, its diagnostics and its traffic."""
    with NodeProcess(LOSSLESS) as node, Robot(node) as robot:
        yield robot, robot.diagnostics(), Traffic(robot)


def level(wanted, *words, rate=0.0):
    """Return a condition: the level, words of the message, and more than a rate [Hz]."""
    return lambda status, values: (status.level == wanted and float(values['rate (Hz)']) >= rate
                                   and all(word in status.message for word in words))


def test_stale_until_the_first_joint_state(shared):
    robot, inbox, _ = shared
    for chain in ('left_leg', 'right_leg'):
        status, values = robot.status(inbox, chain, level(STALE))
        assert status.message.startswith('no JointState received')
        assert (values['messages'], values['poses'], values['age (s)']) == ('0', '0', '')


def test_ok_with_rate_age_and_counts(shared):
    robot, inbox, send = shared
    robot.status(inbox, 'right_leg', level(OK), meanwhile=send)
    status, values = robot.status(inbox, 'left_leg', level(OK, rate=5), meanwhile=send)
    assert status.hardware_id == 'left_leg v2_5'
    assert int(values['poses']) == int(values['messages']) > 0
    assert float(values['age (s)']) > 1e6  # stamps of the test begin in 1970
    assert [values[reason] for reason in REASONS] == ['0'] * len(REASONS)


def test_stale_again_when_the_joint_states_stop(shared):
    robot, inbox, _ = shared
    assert robot.status(inbox, 'left_leg', level(STALE))[1]['rate (Hz)'] == '0.0'


def test_warning_names_joints_out_of_range(shared):
    robot, inbox, send = shared
    positions = [0.0] * 5 + [0.6] + [0.0] * 6
    _, values = robot.status(inbox, 'left_leg', level(WARN, 'l_ankle_roll 0.6', rate=2),
                             meanwhile=send.sender(BOTH, positions))
    assert values['out_of_range joints'] == 'l_ankle_roll 0.6'


def test_rejected_messages_are_a_warning_once_and_stay_counted(shared):
    robot, inbox, send = shared
    values = robot.status(inbox, 'right_leg', level(OK), meanwhile=send)[1]
    before = {reason: int(values[reason]) for reason in REASONS}
    send(BOTH, [0.0] * 11)
    send((*BOTH, 'l_knee'), [0.0] * 13)
    send(BOTH, [])
    robot.joints.publish(b'\x00\x01\x00\x00')
    send.stamp -= SECOND // 100
    said = []

    def all_counted(status, values):  # the five may fall into two periods
        said.append(status.message)
        return all(int(values[reason]) > before[reason] for reason in REASONS)
    _, values = robot.status(inbox, 'right_leg', all_counted, meanwhile=send)
    for reason in REASONS:
        if reason != 'empty_position':  # is counted only
            assert sum(f'{reason} 1' in text for text in said) == 1, said
        assert int(values[reason]) == before[reason] + 1
    _, later = robot.status(inbox, 'right_leg', level(OK), meanwhile=send)
    assert {later[reason] for reason in REASONS} == {values[reason] for reason in REASONS}


def test_an_empty_position_is_counted_only(shared):
    robot, inbox, send = shared
    before = robot.status(inbox, 'right_leg', level(OK), meanwhile=send)[1]['empty_position']
    send(BOTH, [])
    status, _ = robot.status(
        inbox, 'right_leg', lambda status, values: values['empty_position'] != before,
        meanwhile=send)
    assert status.level != WARN


def test_stale_joint_is_named_in_a_warning_while_some_poses_go_out(shared):
    robot, inbox, send = shared

    def now_and_then_all():
        send()
        send.stamp += SECOND
        send([name for name in BOTH if name != 'l_hip_yaw'])
    _, values = robot.status(inbox, 'left_leg', level(WARN, 'stale: l_hip_yaw 1.001 s old'),
                             meanwhile=now_and_then_all)
    assert values['stale_joint joints'] == 'l_hip_yaw 1.001 s old'
    assert int(values['stale_joint']) > 0


def test_stale_joint_is_named_in_an_error_while_none_goes_out(shared):
    robot, inbox, send = shared
    send.stamp += 10 * SECOND
    names = [name for name in BOTH if name != 'l_hip_yaw']
    robot.status(inbox, 'left_leg', level(ERROR, 'stale: l_hip_yaw'), meanwhile=send.sender(names))


def test_error_names_the_joints_that_are_missing(shared):
    robot, inbox, send = shared
    send.stamp -= 5 * SECOND  # everything held is forgotten
    ankle = ('l_ankle_pitch', 'l_ankle_roll')
    _, values = robot.status(inbox, 'left_leg', level(ERROR, *ankle),
                             meanwhile=send.sender(LEFT[:4]))
    for name in ankle:
        assert name in values['missing_joint joints']
    robot.status(inbox, 'right_leg', level(ERROR, 'r_knee'), meanwhile=send.sender(LEFT[:4]))


def test_error_names_the_joint_that_is_not_a_number(shared):
    robot, inbox, send = shared
    status, values = robot.status(
        inbox, 'left_leg', lambda status, values: 'l_knee nan' in status.message,
        meanwhile=send.sender(LEFT, [0, 0, 0, math.nan, 0, 0]))
    assert status.level == ERROR
    assert values['non_finite joints'] == 'l_knee nan'


def test_poses_without_velocity_are_counted_where_twists_are_wanted():
    with NodeProcess({'publish_twist': True}) as node, Robot(node) as robot:
        twists = robot.listen(TwistStamped, 'foot_pose_publisher/left_foot/twist')
        send, inbox = Traffic(robot), robot.diagnostics()
        _, values = robot.status(inbox, 'left_leg', level(WARN), meanwhile=send)
        assert int(values['no_velocity']) > 0
        assert values['no_velocity joints'] == ', '.join(f'{joint} unknown' for joint in LEFT)
        robot.status(inbox, 'left_leg', level(OK),
                     meanwhile=send.sender(BOTH, velocity=[0.1] * 12))
        robot.until(lambda: twists, 'twists')


def test_once_a_second_though_simulated_time_stands_still():
    with NodeProcess({'use_sim_time': True}) as node, Robot(node) as robot:
        times, stamps = [], []
        inbox = robot.diagnostics()

        def take():
            for array in inbox:
                if array.status[0].name.startswith(node.namespace[1:]):
                    times.append(time.monotonic())
                    stamps.append(nanoseconds(array.header.stamp))
                    assert [status.name for status in array.status] == [
                        f'{node.namespace[1:]}/foot_pose_publisher: {chain}'
                        for chain in ('left_leg', 'right_leg')]
            inbox.clear()
            # Any may come late on a busy machine, which makes two periods uneven: three will not.
            return any(abs(third - first - 2) < 0.4 for first, third in zip(times, times[2:]))
        robot.until(take, times)
        assert stamps == [0] * len(stamps)  # simulated time, which has not begun
