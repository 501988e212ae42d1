"""What the node makes of the joint states that robots, and strangers, send over DDS.

The rules of the input are held in memory by test/stream; test_bag_node.py sends every kind of
message to the node.
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


def take_both(robot, stamp):
    """Return the stamps of each foot's poses, once they have come up to a stamp."""
    return [robot.take(inbox, stamp).stamps() for inbox in (robot.left, robot.right)]


def test_what_cannot_be_used_changes_nothing_and_is_said_without_flooding_the_log(
    node, robot
):
    began = time.monotonic()
    before = len(node.log())
    t = robot.start + MS
    robot.send(t, BOTH, Q)
    # No empty bytes: on a reliable connection Fast DDS waits for them ever after.
    for data in (b'\x00', bytes(4), b'\xff' * 64, serialize_message(JointState())[:9]):
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
    assert_same_pose(
        robot.take(robot.left, t)[-1], oracle_pose('left_leg', 'v2_5', Q[:6])
    )
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
