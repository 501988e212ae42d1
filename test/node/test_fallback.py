"""The node where rclpy has no EventsExecutor: it falls back to the SingleThreadedExecutor."""

import signal

from support.node_harness import BOTH, FEET, LOSSLESS, NodeProcess, Robot
from support.node_oracle import assert_same_pose, oracle_pose

MS = 1_000_000  # ns
Q = [-0.1] * 6


def test_it_says_so_once_and_all_else_is_the_same():
    with NodeProcess(LOSSLESS, events_executor=False) as node:
        with Robot(node) as robot:
            start = robot.connect()
            sent = [start + MS * i for i in range(1, 301)]
            for stamp in sent:
                robot.send(stamp, BOTH, Q * 2)
                robot.spin()
            for foot in FEET:
                assert robot.take(robot.poses[foot], sent[-1]).stamps() == sent
            robot.joints.publish(b'\x00\x01\x00\x00')
            assert robot.change(version='v1').successful
            robot.send(sent[-1] + 1, BOTH, Q * 2)
            [pose] = robot.take(robot.left, sent[-1] + 1)
            assert_same_pose(pose, oracle_pose('left_leg', 'v1', Q))
            robot.statuses(
                lambda statuses: statuses['left_leg'].values['malformed'] == '1'
            )
        with Robot(node) as late:  # topics that nobody subscribed to for a while
            late.connect(sent[-1] + MS)
        node.stop(signal.SIGTERM, signal.SIGINT)
        assert node.log().count('SingleThreadedExecutor') == 1
