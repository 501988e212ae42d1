"""What the node makes of the joint states that robots, and strangers, send over DDS.

The rules of the input, one by one, are held in memory by test/stream.
"""

from itertools import pairwise
import math
import time

import pytest
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from support.node_harness import (
    BOTH,
    DEEP,
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
LAST_TIME = (2**31 - 1) * SECOND + 999_999_999  # that a stamp can hold


@pytest.fixture(scope='module')
def shared():
    """Return a node and a robot beside it."""
    with NodeProcess(LOSSLESS, ['-r', '/clock:=clock']) as node, Robot(node) as robot:
        robot.start = 0
        yield node, robot


@pytest.fixture
def node(shared):
    return shared[0]


@pytest.fixture
def robot(shared):
    """Return the robot with its legs known and empty inboxes."""
    robot = shared[1]
    robot.start = robot.connect(start=robot.start + 1000 * SECOND)
    return robot


def check_left(pose, q, stamp):
    assert (pose.header.stamp.sec, pose.header.stamp.nanosec) == divmod(stamp, SECOND)
    assert_same_pose(pose, oracle_pose('left_leg', 'v2_5', q))


def take_both(robot, stamp):
    """Return the stamps of each foot's poses, once they have come up to a stamp."""
    return [robot.take(inbox, stamp).stamps() for inbox in (robot.left, robot.right)]


def test_one_message_per_leg_moves_that_leg_only(robot):
    t = robot.start + MS
    robot.send(t, LEFT, Q[:6])
    robot.send(
        t - 3000, RIGHT, Q[6:]
    )  # another part's controller, whose clock lags a little
    robot.send(t + MS, LEFT, Q[:6])
    assert robot.take(robot.left, t + MS).stamps() == [t, t + MS]
    assert robot.take(robot.right, t - 3000).stamps() == [t - 3000]


def test_parts_of_a_leg_combine_into_a_pose_for_every_message(robot):
    t = robot.start + MS
    robot.send(t, LEFT, Q[:6])
    robot.send(t + MS, LEFT[:3], [0.3, 0.2, 0.1])
    robot.send(t + 2 * MS, LEFT[5:2:-1], [0.15, -0.2, -0.5])
    _, second, third = robot.take(robot.left, t + 2 * MS)
    check_left(second, [0.3, 0.2, 0.1, *Q[3:6]], t + MS)
    check_left(third, [0.3, 0.2, 0.1, -0.5, -0.2, 0.15], t + 2 * MS)


def test_other_joints_and_all_other_fields_are_nobodys_business(robot):
    t = robot.start + MS
    robot.send(t, ('gripper', 'wheel'), [1.0, math.nan])
    names = ('neck', *LEFT, 'wheel', *RIGHT)
    positions = [math.nan, *Q[:6], math.inf, *Q[6:]]
    message = JointState(
        name=names, position=positions, velocity=[math.nan], effort=[1.0] * 3
    )
    message.header.frame_id = 'base_link'
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(t + 1, SECOND)
    robot.joints.publish(message)
    [pose] = robot.take(robot.left, t + 1)
    assert pose.header.frame_id == 'root_link'
    check_left(pose, Q[:6], t + 1)
    robot.take(robot.right, t + 1)


def hostile_bytes():
    """Return byte strings that are no JointState, from one byte to almost right ones.

    No empty one: Fast DDS drops it and, on a reliable connection, waits for it ever after.
    """
    good = serialize_message(JointState(name=BOTH, position=Q))
    yield from (b'\x00', b'\x00\x01', b'\x00\x01\x00\x00', bytes(4), b'\xff' * 64)
    for encapsulation in (b'\x00\x02', b'\x00\x03', b'\x00\x00'):
        yield encapsulation + good[2:]
    for size in range(5, len(good) - 8, 7):
        yield good[:size]
    for at in (12, 20, 24, 40):  # lengths of frame_id, of name and of the first names
        for length in (0x7FFFFFFF, 0xFFFFFFFF, 0x80000000, 1000):
            yield good[:at] + length.to_bytes(4, 'little') + good[at + 4 :]


def test_what_cannot_be_used_changes_nothing_and_is_said_without_flooding_the_log(
    node, robot
):
    began = time.monotonic()
    before = len(node.log())
    t = robot.start + MS
    robot.send(t, BOTH, Q)
    for data in hostile_bytes():
        robot.joints.publish(data)
    for _ in range(50):
        t += MS
        robot.send(t, BOTH, Q[:11])
        robot.send(t, BOTH, [9.0, *Q])
        robot.send(t, (*BOTH, 'l_knee'), [*Q, 0.1])
        robot.send(t, BOTH, [])
        robot.send(t, RIGHT, [*Q[:5], math.nan])
    robot.send(t, [f'joint_{i}' for i in range(100_000)])
    robot.send(t, ['x' * 3_000_000], [0.0])
    robot.send(t, ['l_hip_yaw'], [Q[2]])
    check_left(robot.take(robot.left, t)[-1], Q[:6], t)
    robot.send(t + MS, BOTH, Q)
    assert take_both(robot, t + MS) == [[t + MS], [robot.start + MS, t + MS]]
    words = (
        'messages rejected: JointState: ',
        'messages rejected: position has 13 values for 12',
        "messages rejected: name 'l_knee' appears twice",
        'r_ankle_roll nan',
    )
    for word in words:
        node.wait_for_log(word)
    said = [
        line
        for line in node.log()[before:].splitlines()
        if ' rejected: ' in line or ' no pose ' in line
    ]
    most = 1 + (time.monotonic() - began) // 5  # each is repeated after 5 s
    for word in words:
        assert 1 <= sum(word in line for line in said) <= most, (word, said)
    assert len(said) <= 4 * most, said


def test_publishers_come_and_go_and_are_all_heard(node, robot):
    other = robot.node.create_publisher(JointState, 'joint_states', DEEP)
    t = robot.connect(robot.start, publisher=other)
    sent = [t + MS * i for i in range(1, 21)]
    for i, stamp in enumerate(sent):
        robot.send(stamp, BOTH, Q, (robot.joints, other)[i % 2])
        robot.wait_for(robot.left, stamp)
        robot.wait_for(robot.right, stamp)
    assert robot.left.stamps() == robot.right.stamps() == sent
    robot.node.destroy_publisher(other)
    with Robot(node) as again:  # another participant, as a restarted bridge would be
        again.connect(robot.start + SECOND)
    robot.start = robot.connect(robot.start + 2 * SECOND)


def test_looping_bag_gives_every_pose_and_is_said_once_a_loop(node, robot):
    before = len(node.log())
    stamps = [robot.start + 10 * MS * i for i in range(1, 201)]
    for stamp in stamps * 2:
        robot.send(stamp)
    robot.until(lambda: len(robot.left) == len(robot.right) == 400, 'all poses')
    assert robot.left.stamps() == robot.right.stamps() == stamps * 2
    node.wait_for_log(f'time stepped back to {stamps[0] / 1e9:.3f} s')
    assert node.log()[before:].count('time stepped back') == 1


def test_zero_stamp_becomes_now(robot):
    before = robot.node.get_clock().now().nanoseconds
    robot.send(0)
    robot.until(lambda: robot.left and robot.right, 'both poses')
    now = robot.node.get_clock().now().nanoseconds
    assert before <= robot.left.stamps()[0] == robot.right.stamps()[0] <= now


def test_a_negative_and_the_last_stamp_are_stamps_like_others(robot):
    for stamp in (-5 * SECOND, LAST_TIME, robot.start):
        robot.send(stamp)
        assert take_both(robot, stamp) == [[stamp]] * 2


def test_simulated_time_stamps_what_has_no_stamp_and_may_step_back(robot):
    assert robot.change(use_sim_time=True).successful
    robot.statuses(lambda statuses: 'no time' in statuses['left_leg'].message)
    clock = robot.node.create_publisher(Clock, 'clock', DEEP)

    def stamped(stamp):
        """Tick until a message without stamp is given this simulated time."""
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(stamp, SECOND)

        def answered():
            clock.publish(message)
            robot.send(0)
            robot.spin(0.02)
            return stamp in robot.right.stamps()[-1:]

        robot.until(answered, f'poses at {stamp}')
        robot.until(lambda: len(robot.left) == len(robot.right), 'both feet')

    for stamp in (50 * SECOND, 51 * SECOND, 3 * SECOND, 4 * SECOND):
        stamped(stamp)
    assert (51 * SECOND, 3 * SECOND) in pairwise(dict.fromkeys(robot.right.stamps()))
    robot.statuses(lambda statuses: 'no time' not in statuses['left_leg'].message)
    robot.send(4 * SECOND + 1)  # the message's own stamp is kept as it is
    robot.wait_for(robot.right, 4 * SECOND + 1)
    assert robot.change(use_sim_time=False).successful
