"""What the node makes of the joint states that robots, and strangers, send."""

import math
import time

import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from support.node_harness import (
    BOTH,
    DEEP,
    HEAD,
    LEFT,
    LOSSLESS,
    NodeProcess,
    RIGHT,
    Robot,
    SECOND,
)
from support.node_oracle import assert_same_pose, oracle_pose

MS = 1_000_000  # ns
Q = [0.1 * (i + 1) * (-1) ** i for i in range(12)]


@pytest.fixture(scope='module')
def shared():
    """Return a node and a robot beside it."""
    with NodeProcess(LOSSLESS) as node, Robot(node) as robot:
        robot.connect()
        yield node, robot


@pytest.fixture
def robot(shared):
    """Return the robot with its legs known and empty inboxes."""
    robot = shared[1]
    robot.start = robot.connect(start=getattr(robot, 'start', 0) + SECOND)
    return robot


def check_left(pose, q, stamp):
    assert (pose.header.stamp.sec, pose.header.stamp.nanosec) == divmod(stamp, SECOND)
    assert_same_pose(pose, oracle_pose('left_leg', 'v2_5', q))


def only_sentinel(robot, stamp):
    """Check that nothing but the answer to a good message sent last has arrived."""
    robot.send(stamp, BOTH, Q)
    for inbox in robot.poses.values():
        assert robot.take(inbox, stamp).stamps() == [stamp]


def test_one_message_per_leg_moves_that_leg_only(robot):
    t = robot.start + MS
    robot.send(t, LEFT, Q[:6])
    robot.send(t - 3000, RIGHT, Q[6:])  # another part's controller, whose clock lags a little
    robot.send(t + MS, LEFT, Q[:6])
    assert robot.take(robot.left, t + MS).stamps() == [t, t + MS]
    assert robot.take(robot.right, t - 3000).stamps() == [t - 3000]


def test_parts_of_a_leg_combine_into_a_pose_for_every_message(robot):
    t = robot.start + MS
    robot.send(t, LEFT, Q[:6])
    robot.send(t + MS, LEFT[:3], [0.3, 0.2, 0.1])
    robot.send(t + 2 * MS, LEFT[5:2:-1], [0.15, -0.2, -0.5])
    poses = robot.take(robot.left, t + 2 * MS)
    assert len(poses) == 3
    check_left(poses[1], [0.3, 0.2, 0.1, *Q[3:6]], t + MS)
    check_left(poses[2], [0.3, 0.2, 0.1, -0.5, -0.2, 0.15], t + 2 * MS)


def test_torso_and_neck_from_two_publishers_interleave_out_of_order():
    parameters = {'chains': ['head_imu'], 'version': 'v2', **LOSSLESS}
    with NodeProcess(parameters) as node, Robot(node, tips=['head_imu']) as robot:
        inbox = robot.poses['head_imu']
        start = robot.connect(names=HEAD)
        neck = robot.node.create_publisher(JointState, 'joint_states', DEEP)
        start = robot.connect(start, HEAD, publisher=neck)
        torso_q, neck_q = [0.0] * 3, [0.0] * 3
        for i in range(1, 6):
            for names, at, publisher, offset in ((HEAD[:3], start + 10 * i * MS, robot.joints, 0),
                                                 (HEAD[3:], start + 10 * i * MS - MS, neck, 3)):
                values = [0.01 * (i + offset + k) for k in range(3)]
                (neck_q if offset else torso_q)[:] = values
                robot.send(at, names, values, publisher)
                pose = robot.take(inbox, at)[-1]
                if i > 1:
                    assert_same_pose(pose, oracle_pose('head_imu', 'v2', torso_q + neck_q))
        assert 'time stepped back' not in node.log()


def test_other_joints_and_all_other_fields_are_nobodys_business(robot):
    t = robot.start + MS
    robot.send(t, ('gripper', 'wheel'), [1.0, math.nan])
    names = ('neck', *LEFT, 'wheel', *RIGHT)
    message = JointState(name=list(names), position=[math.nan, *Q[:6], math.inf, *Q[6:], 7.0, 8.0],
                         velocity=[math.nan], effort=[math.inf] * 3)
    message.header.frame_id = 'base_link'
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(t + 1, SECOND)
    robot.joints.publish(message)
    poses = robot.take(robot.left, t + 1)
    assert poses.stamps() == [t + 1]
    assert poses[0].header.frame_id == 'root_link'
    check_left(poses[0], Q[:6], t + 1)
    robot.take(robot.right, t + 1)


@pytest.mark.parametrize('names, positions', [
    (BOTH, Q[:11]), (BOTH, []), ((*BOTH, 'wheel', 'wheel'), [*Q, 0.1, 0.2]),
], ids=['one position too few', 'no position', 'a duplicate name'])
def test_message_is_refused_as_a_whole(robot, names, positions):
    t = robot.start + MS
    robot.send(t, names, positions)
    only_sentinel(robot, t + MS)
    # Nothing of it has been kept either.
    robot.send(t + 2 * MS, ['l_hip_yaw'], [Q[2]])
    check_left(robot.take(robot.left, t + 2 * MS)[-1], Q[:6], t + 2 * MS)


@pytest.mark.parametrize('value', [math.nan, -math.inf])
def test_angle_that_is_no_number_holds_back_its_own_leg_until_it_is_one_again(robot, value):
    t = robot.start + MS
    robot.send(t, BOTH, [*Q[:3], value, *Q[4:]])
    robot.send(t + 1, LEFT[:3], Q[:3])  # the knee is still unknown
    robot.send(t + 2, RIGHT, Q[6:])
    assert robot.take(robot.right, t + 2).stamps() == [t, t + 2]
    robot.send(t + 3, ['l_knee'], [-0.2])
    poses = robot.take(robot.left, t + 3)
    assert poses.stamps() == [t + 3]
    check_left(poses[0], [*Q[:3], -0.2, *Q[4:6]], t + 3)


def test_angles_out_of_range_are_not_clamped(robot):
    t = robot.start + MS
    q = [3.0, 0.8, -2.9, 1.0, -1.5, 50.0]  # each beyond the printed range
    robot.send(t, LEFT, q)
    check_left(robot.take(robot.left, t)[0], q, t)


def hostile_bytes():
    """Return byte strings that are no JointState, from one byte to almost right ones.

    No empty one: Fast DDS drops it and, on a reliable connection, waits for it ever after.
    """
    message = JointState(name=list(BOTH), position=Q)
    good = serialize_message(message)
    yield from (b'\x00', b'\x00\x01', b'\x00\x01\x00\x00', bytes(4), b'\xff' * 64,
                b'\x00\x02' + good[2:], b'\x00\x03' + good[2:], b'\x00\x00' + good[2:])
    yield from (good[:size] for size in range(5, len(good) - 8, 7))
    for at in (12, 20, 24, 40):  # lengths of frame_id, of name and of the first names
        for length in (0x7fffffff, 0xffffffff, 0x80000000, 1000):
            yield good[:at] + length.to_bytes(4, 'little') + good[at + 4:]


def test_malformed_bytes_are_refused_and_change_nothing(robot):
    t = robot.start + MS
    for data in hostile_bytes():
        robot.joints.publish(data)
    only_sentinel(robot, t)


def test_huge_messages_do_no_harm(robot):
    t = robot.start + MS
    robot.send(t, [f'joint_{i}' for i in range(100_000)])
    robot.send(t, ['x' * 3_000_000], [0.0])
    only_sentinel(robot, t)


def test_empty_bytes_over_the_default_qos_are_dropped():
    with NodeProcess() as node, Robot(node) as robot:
        t = robot.connect()
        robot.joints.publish(b'')
        robot.connect(t + SECOND)


def test_two_publishers_on_one_topic_are_both_heard(robot):
    other = robot.node.create_publisher(JointState, 'joint_states', DEEP)
    t = robot.connect(robot.start, publisher=other)
    sent = [t + MS * i for i in range(1, 21)]
    for i, stamp in enumerate(sent):
        robot.send(stamp, BOTH, Q, (robot.joints, other)[i % 2])
        robot.wait_for(robot.left, stamp)
        robot.wait_for(robot.right, stamp)
    assert robot.left.stamps() == robot.right.stamps() == sent
    robot.node.destroy_publisher(other)


def test_publishers_go_and_come_back(shared, robot):
    node, _ = shared
    for i in range(1, 3):
        with Robot(node) as again:  # another participant, as a restarted bridge would be
            assert again.connect(robot.start + i * SECOND) > robot.start
    robot.start = robot.connect(robot.start + 4 * SECOND)


def test_warnings_name_what_is_wrong_and_do_not_flood_the_log():
    began = time.monotonic()
    with NodeProcess(LOSSLESS) as node, Robot(node) as robot:
        t = robot.connect()
        for i in range(1, 50):
            t += MS
            robot.send(t, BOTH, Q[:11])
            robot.send(t, (*BOTH, 'l_knee'), [*Q, 0.1])
            robot.send(t, BOTH, [*Q[:11], math.nan])
            robot.joints.publish(b'\x00\x01\x00\x00' + bytes(i))
            robot.send(t, BOTH, [])
        only = robot.take(robot.left, t)
        assert len(only) == 49  # of the messages whose right ankle alone is no number
        robot.send(t - 10 * SECOND, ['r_knee'], [0.0])
        robot.send(t - 10 * SECOND, LEFT, Q[:6])
        robot.wait_for(robot.left, t - 10 * SECOND)
        warnings = [line for line in node.log().splitlines() if '[WARN]' in line]
    most = 1 + (time.monotonic() - began) // 5  # each is repeated after 5 s
    for word in ('11 values for 12 names', "'l_knee' appears twice", 'r_ankle_roll nan',
                 'header.stamp', 'time stepped back', 'r_hip_pitch never seen'):
        assert 1 <= sum(word in line for line in warnings) <= most, (word, warnings)
    assert len(warnings) <= 6 * most, warnings
