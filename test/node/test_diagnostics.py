"""What the node says of its health, on /diagnostics and in its log.

What there is to say, and when, is held in memory by test_health.py and test/stream/test_notes.py.
"""

from functools import partial
from itertools import pairwise
import math
from statistics import median

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
import pytest
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from support.node_harness import (
    BOTH,
    ERROR,
    LEFT,
    lines,
    LOSSLESS,
    nanoseconds,
    NodeProcess,
    OK,
    RIGHT,
    Robot,
    SECOND,
    STALE,
    WARN,
)

REASONS = (
    'malformed',
    'empty_position',
    'position_length',
    'duplicate_name',
    'time_jump',
    'non_finite',
)
DEGREES = [0.0, 0.0, 0.0, -45.0, 0.0, 0.0] * 2
SILENCE = 'no JointState received on {}/joint_states for '
NO_TIME = 'use_sim_time is set, but no time has come on /clock'


@pytest.fixture(scope='module')
def waiting():
    """Return a node that waits for joint states and for time, and a robot that sends neither."""
    with (
        NodeProcess({'use_sim_time': True}, ['-r', '/clock:=clock']) as node,
        Robot(node) as robot,
    ):
        robot.node.destroy_publisher(robot.joints)
        robot.node.create_publisher(String, 'joint_states', 10)
        robot.everything = robot.listen(DiagnosticArray, '/diagnostics')
        yield node, robot


@pytest.fixture(scope='module')
def shared(waiting):
    """Return a busy node, beside which the other one is waiting, and a robot."""
    with NodeProcess(LOSSLESS) as node, Robot(node) as robot:
        yield node, robot


@pytest.fixture
def robot(shared):
    return shared[1]


def send_now(robot, names=BOTH, positions=None, ago=0.0, **more):
    """Send a joint state with a stamp so many seconds ago."""
    now = robot.node.get_clock().now().nanoseconds
    robot.send(now - round(ago * 1e9), names, positions, **more)


def levels(statuses):
    return [status.level for status in statuses.values()]


def are_ok(statuses):
    return levels(statuses) == [OK, OK]


def test_the_start_line_says_what_is_published_and_from_where(waiting):
    node, _ = waiting
    node.wait_for_log('publishing')
    assert lines(node, 'INFO') == [
        'publishing poses of left_foot (left_leg=v2_5, root_link to l_foot_dh_frame), right_foot '
        '(right_leg=v2_5, root_link to r_foot_dh_frame); joint states from '
        f'{node.namespace}/joint_states'
    ]


def test_stale_until_the_first_joint_state(waiting):
    node, robot = waiting
    statuses = robot.statuses(
        lambda statuses: 'only of' in statuses['left_leg'].message
    )
    assert [*statuses] == ['left_leg', 'right_leg']
    for level, message, _, values in statuses.values():
        assert level == STALE
        assert message.startswith(SILENCE.format(node.namespace))
        assert (
            '; it has no publisher of this type, only of std_msgs/msg/String; '
            in message
        )
        assert message.endswith(NO_TIME)
        assert (values['messages'], values['poses'], values['age (s)']) == (
            '0',
            '0',
            '',
        )


def test_ok_with_rate_age_and_counts(robot):
    status = robot.statuses(
        lambda statuses: float(statuses['left_leg'].values['rate (Hz)']) > 5,
        meanwhile=partial(send_now, robot),
    )['left_leg']
    assert (status.level, status.message) == (OK, 'publishing')
    assert status.hardware_id == 'left_leg=v2_5'
    values = status.values
    assert int(values['poses']) == int(values['messages']) > 0
    assert 0 <= float(values['age (s)']) < 1
    assert (values['version'], values['publishers']) == ('v2_5', '1')
    assert [values[reason] for reason in REASONS[:-1]] == ['0'] * 5


def test_the_age_of_a_dead_leg_beside_a_live_one_grows(robot):
    send_now(robot, ago=3)  # everything held is forgotten
    positions = [0.0] * 5 + [0.6]
    statuses = robot.statuses(
        lambda statuses: levels(statuses) == [WARN, ERROR],
        meanwhile=partial(send_now, robot, LEFT, positions),
    )
    _, message, _, values = statuses['left_leg']
    assert message.endswith('out of range: l_ankle_roll 0.6')
    assert values['out_of_range joints'] == 'l_ankle_roll 0.6'
    assert 0 <= float(values['age (s)']) < 1
    _, message, _, values = statuses['right_leg']
    assert f'({", ".join(RIGHT)}); names that came: l_hip_pitch' in message
    assert float(values['age (s)']) > 3


def test_rejected_messages_are_a_warning_once_and_stay_counted(robot):
    def counts(statuses):
        values = statuses['right_leg'].values
        return [int(values.get(reason, 0)) for reason in REASONS]

    send = partial(send_now, robot)
    before = counts(robot.statuses(are_ok, meanwhile=send))
    send_now(robot, positions=[0.0] * 13)
    send_now(robot, (*BOTH, 'l_knee'))
    send_now(robot, positions=[])
    robot.joints.publish(b'\x00\x01\x00\x00')
    send_now(robot, ago=5)
    send_now(robot, positions=[0.0] * 11 + [math.nan])
    messages = []

    def all_are_counted(statuses):  # they may fall into two periods
        messages.append(statuses['right_leg'].message)
        return counts(statuses) == [count + 1 for count in before]

    robot.statuses(all_are_counted, meanwhile=send)
    text = '; '.join(messages)
    for words in (
        'position has 13 values for 12 names',
        "name 'l_knee' appears twice",
        'header.stamp ends at byte 12',
        'time stepped back to',
        'r_ankle_roll nan',
    ):
        assert text.count(words) == 1, text
    assert 'position is empty' not in text
    after = counts(robot.statuses(are_ok, meanwhile=send))
    assert after == [count + 1 for count in before]


def test_first_poses_degrees_and_publishers_of_the_same_joints_are_said_once(shared):
    node, robot = shared
    second = robot.node.create_publisher(JointState, 'joint_states', 10)

    def send():
        send_now(robot, positions=DEGREES)
        send_now(robot, positions=DEGREES, publisher=second)

    topic = f'{node.namespace}/joint_states'
    two = f'every message on {topic} brings its joints, and it has 2 publishers: '
    for _ in range(2):
        statuses = robot.statuses(
            lambda statuses: two in statuses['left_leg'].message, meanwhile=send
        )
        assert 'positions look like degrees' in statuses['left_leg'].message
    robot.node.destroy_publisher(second)
    said = lines(node, 'WARN')
    degrees = 'positions look like degrees, radians are expected: '
    assert said.count(f'left_leg: {degrees}l_knee -45') == 1
    assert sum(f'left_leg: {two}{node.namespace}/robot, ' in line for line in said) == 1
    said = lines(node, 'INFO')
    for foot in ('left_foot', 'right_foot'):
        assert said.count(f'first pose of {foot}; 1 publisher on {topic}') == 1


def test_another_node_of_the_same_name_is_a_warning(shared):
    node, robot = shared
    twin = Node(
        'foot_pose_publisher', namespace=node.namespace, context=robot.node.context
    )
    twin.create_publisher(PoseStamped, '~/left_foot/pose', 10)
    words = f'another node is called {node.namespace}/foot_pose_publisher'
    robot.statuses(
        lambda statuses: words in statuses['left_leg'].message,
        meanwhile=lambda: send_now(robot),
    )
    twin.destroy_node()


def test_a_change_of_parameters_is_said_once(shared):
    node, robot = shared
    before = len(lines(node, 'INFO'))
    for changes in (
        {'joint_timeout': 0.2},
        {'version': 'v1'},
        {'version': 'v3'},
        {'foot_frame': 'sole'},
        {'stamp_source': 'now'},
    ):
        assert robot.change(**changes).successful
    node.wait_for_log('l_sole')
    said = [line for line in lines(node, 'INFO')[before:] if 'publishing' in line]
    assert '(left_leg=v3, root_link to l_sole)' in said[-1]
    assert len(said) <= 3  # each second that had a change


def test_what_does_not_come_is_warned_of_after_five_seconds(waiting):
    node, _ = waiting
    node.wait_for_log('no JointState')
    node.wait_for_log('no time')
    silence, time_is_missing = lines(node, 'WARN')
    assert silence.startswith(SILENCE.format(node.namespace))
    assert time_is_missing == NO_TIME


def test_once_a_second_though_simulated_time_stands_still(waiting, shared):
    """Beside a node whose time goes on; any period may be uneven on a busy machine."""
    _, robot = waiting
    busy = shared[0].namespace.lstrip('/')
    began = robot.node.get_clock().now().nanoseconds
    stamps = []

    def are_up_to_date():
        stamps[:] = [
            nanoseconds(array.header.stamp)
            for array in robot.everything
            if array.status[0].name.startswith(busy)
        ]
        return stamps[-1:] > [began]

    robot.until(are_up_to_date, stamps)
    periods = [after - before for before, after in pairwise(stamps)]
    assert median(periods) == pytest.approx(SECOND, rel=0.1)
    others = [
        nanoseconds(array.header.stamp)
        for array in robot.everything
        if not array.status[0].name.startswith(busy)
    ]
    assert others == [0] * len(others)  # simulated time, which has not begun
    assert len(others) >= len(stamps) - 1
