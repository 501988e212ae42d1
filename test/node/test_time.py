"""Stamps, timeouts, looping bags and simulated time."""

from itertools import pairwise
import time

import pytest
from rosgraph_msgs.msg import Clock
from support.node_harness import BOTH, DEEP, LEFT, LOSSLESS, NodeProcess, Robot, SECOND

MS = 1_000_000  # ns
HALF = SECOND // 2


@pytest.fixture(scope='module')
def shared():
    """Return a node and a robot beside it."""
    with NodeProcess(LOSSLESS) as node, Robot(node) as robot:
        robot.start = 0
        yield node, robot


@pytest.fixture
def robot(shared):
    """Return the robot with its legs known and empty inboxes."""
    robot = shared[1]
    robot.start = robot.connect(start=robot.start + 1000 * SECOND)
    return robot


def test_zero_stamp_becomes_now(robot):
    before = robot.node.get_clock().now().nanoseconds
    robot.send(0)
    robot.until(lambda: robot.left and robot.right, 'both poses')
    now = robot.node.get_clock().now().nanoseconds
    assert before <= robot.left.stamps()[0] == robot.right.stamps()[0] <= now
    robot.send(robot.start)  # back in time, for the tests to come
    robot.take(robot.right, robot.start)


def test_timeout_of_zero_is_none():
    with NodeProcess({'joint_timeout': 0.0, **LOSSLESS}) as node, Robot(node) as robot:
        t = robot.connect() + 3600 * SECOND
        robot.send(t, LEFT[:1])
        assert robot.take(robot.left, t).stamps() == [t]


def test_looping_bag_gives_every_pose_in_every_loop_and_is_said_once():
    began = time.monotonic()
    with NodeProcess(LOSSLESS) as node, Robot(node) as robot:
        first = robot.connect() + 100 * SECOND
        stamps = [first + 10 * MS * i for i in range(200)]
        for stamp in stamps * 4:
            robot.send(stamp)
        robot.until(lambda: len(robot.left) == len(robot.right) == 800, 'all poses')
        assert robot.left.stamps() == robot.right.stamps() == stamps * 4
        said = [line for line in node.log().splitlines() if 'time stepped back' in line]
        assert 1 <= len(said) <= 1 + (time.monotonic() - began) // 5  # again after 5 s


def test_stamps_beyond_time_are_harmless(robot):
    """A negative and the last representable stamp are stamps like others."""
    for stamp in (-5 * SECOND, (2**31 - 1) * SECOND + 999_999_999):
        robot.send(stamp)
        assert robot.take(robot.left, stamp).stamps() == [stamp]
        robot.take(robot.right, stamp)
    robot.send(robot.start)
    assert robot.take(robot.right, robot.start).stamps() == [robot.start]


def test_simulated_time_stamps_what_has_no_stamp_and_may_step_back():
    parameters = {'use_sim_time': True, **LOSSLESS}
    with NodeProcess(parameters, ['-r', '/clock:=clock']) as node, Robot(node) as robot:
        robot.connect()  # of each foot alike, for their poses are counted
        clock = robot.node.create_publisher(Clock, 'clock', DEEP)

        def tick(stamp):
            message = Clock()
            message.clock.sec, message.clock.nanosec = divmod(stamp, SECOND)
            clock.publish(message)

        def stamped(stamp):
            """Tick until a message without stamp is given this simulated time."""
            def answered():
                tick(stamp)
                robot.send(0)
                robot.spin(0.02)
                return stamp in robot.right.stamps()[-1:]
            robot.until(answered, f'poses at {stamp}')
            robot.until(lambda: len(robot.left) == len(robot.right), 'both feet')

        for stamp in (50 * SECOND, 51 * SECOND, 3 * SECOND, 4 * SECOND):
            stamped(stamp)
        jumps = [(a, b) for a, b in pairwise(robot.right.stamps()) if b < a and a > 0]
        assert (51 * SECOND, 3 * SECOND) in jumps
        inbox = robot.diagnostics()  # no timer has stalled
        robot.status(inbox, 'left_leg', lambda status, values: int(values['time_jump']) > 0)
        robot.send(4 * SECOND + 1, BOTH)  # the message's own stamp is kept as it is
        robot.wait_for(robot.right, 4 * SECOND + 1)
