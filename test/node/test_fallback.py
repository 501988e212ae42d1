"""The node where rclpy has no EventsExecutor: it falls back to the SingleThreadedExecutor."""

import signal

import pytest
from support.node_harness import BOTH, FEET, LEFT, LOSSLESS, NodeProcess, Robot
from support.node_oracle import assert_same_pose, oracle_pose

MS = 1_000_000  # ns


@pytest.fixture(scope='module')
def shared():
    """Return a node without the EventsExecutor and a robot beside it."""
    with NodeProcess(LOSSLESS, events_executor=False) as node:
        with Robot(node) as robot:
            robot.connect()
            yield node, robot
        node.stop(signal.SIGTERM, signal.SIGINT)


def test_it_says_so_once_and_publishes_every_pose(shared):
    node, robot = shared
    start = robot.connect()
    sent = [start + MS * i for i in range(1, 1001)]
    for i, stamp in enumerate(sent):
        robot.send(stamp, BOTH, [-1e-4 * i] * 12)
        robot.spin()
    for foot, chain in zip(FEET, ('left_leg', 'right_leg'), strict=True):
        poses = robot.take(robot.poses[foot], sent[-1])
        assert poses.stamps() == sent
        for i in range(0, 1000, 50):
            assert_same_pose(poses[i], oracle_pose(chain, 'v2_5', [-1e-4 * i] * 6))
    assert node.log().count('SingleThreadedExecutor') == 1


def test_rules_parameters_and_diagnostics_are_the_same(shared):
    _, robot = shared
    start = robot.connect(robot.connect() + MS)
    robot.send(start + MS, LEFT, [0.1] * 6)
    robot.send(start + MS + 1, BOTH, [0.1] * 11)
    robot.joints.publish(b'\x00\x01\x00\x00')
    assert robot.change(version='v1').successful
    robot.send(start + MS + 2, BOTH, [0.1] * 12)
    first, second = robot.take(robot.left, start + MS + 2)
    assert_same_pose(first, oracle_pose('left_leg', 'v2_5', [0.1] * 6))
    assert_same_pose(second, oracle_pose('left_leg', 'v1', [0.1] * 6))
    assert robot.take(robot.right, start + MS + 2).stamps() == [start + MS + 2]
    robot.statuses(lambda statuses: statuses['left_leg'].values['malformed'] == '1')


def test_topics_that_nobody_subscribes_to_begin_when_somebody_does(shared):
    node, robot = shared
    start = robot.connect(robot.connect() + 100 * MS)
    with Robot(node) as late:
        late.connect(start + 100 * MS)
    robot.connect(start + 200 * MS)
