"""The robot's description, sent by another process: computed with, or held against the tables."""

from diagnostic_msgs.msg import DiagnosticStatus
from icub_leg_fk import load_chain
from icub_leg_fk.kinematics.difference import postures
import numpy as np
import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from support.described_robots import needs_real_robots, own_description, pinocchio_pose, REAL
from support.node_harness import BOTH, FEET, LEFT, LOSSLESS, NodeProcess, Robot, SECOND
from support.node_oracle import oracle_pose, pose_matrix
from support.robots import joint, robot as robot_of

OK, WARN, ERROR, STALE = (
    DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
Q = [0.2, 0.1, -0.1, -0.5, -0.3, 0.1, 0.15, 0.05, 0.1, -0.4, -0.2, -0.1]
CRANE = robot_of([joint(0), joint(1)])
GOOD = own_description('v2_5')


class DescribedRobot(Robot):
    """A robot that also sends descriptions of itself."""

    def __init__(self, node):
        super().__init__(node)
        self.descriptions = self.node.create_publisher(String, 'robot_description', LATCHED)
        self.stamp = SECOND

    def describe(self, text):
        self.descriptions.publish(String(data=text))

    def poses_now(self):
        """Send a joint state; return the (4, 4) poses of both feet that answer it."""
        self.stamp += SECOND // 1000
        self.send(self.stamp, BOTH, Q)
        return [pose_matrix(self.take(self.poses[tip], self.stamp)[-1].pose) for tip in FEET]

    def now(self):
        self.send(self.node.get_clock().now().nanoseconds, BOTH, Q)

    def wait_for_status(self, level, words):
        """Return the values of the left leg's status, once it has this level and these words."""
        def is_so(statuses):
            status = statuses['left_leg']
            return status.level == level and words in status.message
        return self.statuses(is_so, meanwhile=self.now)['left_leg'].values


def assert_poses(found, text, tips=('l_foot_dh_frame', 'r_foot_dh_frame')):
    """Check the poses of both feet against Pinocchio's of a description."""
    positions = dict(zip(BOTH, Q, strict=True))
    for pose, tip in zip(found, tips, strict=True):
        expected = pinocchio_pose(text, 'root_link', tip, positions)
        np.testing.assert_allclose(pose, expected, rtol=0, atol=1e-9)


def mm_between_versions():
    """Return how far the left foot of v1 is from that of v2_5, by the printed tables [mm]."""
    positions = postures(load_chain('left_leg', 'v2_5'), 100)
    off = []
    for q in np.array([positions[joint] for joint in LEFT]).T:
        one, other = [oracle_pose('left_leg', version, q) for version in ('v1', 'v2_5')]
        off.append(1000 * np.linalg.norm(one[:3, 3] - other[:3, 3]))
    return max(off)


def lines(node, severity):
    marked = [line for line in node.log().splitlines() if f'[{severity}]' in line]
    return [line.partition('foot_pose_publisher]: ')[2] for line in marked]


@pytest.fixture(scope='module')
def waiting():
    """Return a node that computes with the description, and a robot."""
    with NodeProcess({'description_from_topic': True, **LOSSLESS}) as node, \
            DescribedRobot(node) as robot:
        yield node, robot


@pytest.fixture
def described(waiting):
    """Return that node and that robot, once poses come."""
    node, robot = waiting
    robot.describe(GOOD)
    robot.stamp = robot.connect(robot.stamp)
    return node, robot


def test_it_waits_aloud(waiting):
    node, robot = waiting
    topic = f'{node.namespace}/robot_description'
    node.wait_for_log(f'waiting for the description of the robot on {topic} to publish poses of '
                      'left_leg, right_leg')
    robot.wait_for_status(STALE, f'no description of the robot has come on {topic}; it has 1 pub')
    node.wait_for_log('WARN')
    assert any('no description of the robot has come' in line for line in lines(node, 'WARN'))
    assert not robot.left
    result = robot.change(version='v1')
    assert not result.successful
    assert "version: found 'v1', allowed with description_from_topic: none, or urdf" in \
        result.reason


def test_poses_are_those_of_the_description_and_a_new_one_takes_effect(described):
    node, robot = described
    assert_poses(robot.poses_now(), GOOD)
    robot.describe(own_description('v1'))
    robot.statuses(lambda statuses: statuses['left_leg'].values['description'] == 'robot_v1',
                   meanwhile=robot.now)
    robot.stamp = robot.connect(robot.stamp)
    poses = robot.poses_now()
    assert_poses(poses, own_description('v1'))
    np.testing.assert_allclose(poses[0], oracle_pose('left_leg', 'v1', Q[:6]), rtol=0, atol=1e-9)
    said = lines(node, 'INFO')
    assert any('(left_leg=urdf, root_link to l_foot_dh_frame)' in line for line in said)
    for name in ('robot_v2_5', 'robot_v1'):
        assert f'computing with the description of {name} on {node.namespace}/robot_description' \
            in said


@needs_real_robots
@pytest.mark.parametrize('name', ['iCubGenova04', 'iCubGenova09'])
def test_poses_of_real_robots(described, name):
    node, robot = described
    text = REAL[name].read_text()
    assert robot.change(foot_frame='sole').successful
    robot.describe(text)
    robot.statuses(lambda statuses: statuses['left_leg'].values['description'] == 'iCub',
                   meanwhile=robot.now)
    robot.stamp = robot.connect(robot.stamp)
    assert_poses(robot.poses_now(), text, ('l_sole', 'r_sole'))
    assert robot.change(foot_frame='dh').successful


@pytest.mark.parametrize(('bad', 'fault'), [
    (GOOD[:len(GOOD) // 2], 'robot_description:'),
    ('', 'robot_description:'),
    (CRANE, "unknown chain 'left_leg'; known: l2"),
    (own_description('v2_5', 'left_leg'), "unknown chain 'right_leg'"),
], ids=['half', 'empty', 'another robot', 'one leg'])
def test_one_that_cannot_be_used_changes_nothing(described, bad, fault):
    node, robot = described
    before = robot.poses_now()
    errors = len(lines(node, 'ERROR'))
    robot.describe(bad)
    robot.wait_for_status(ERROR, 'description of the robot not used')
    error, = lines(node, 'ERROR')[errors:]
    assert fault in error
    assert error.endswith('; the one before stays')
    robot.stamp = robot.connect(robot.stamp)
    np.testing.assert_array_equal(robot.poses_now(), before)
    robot.describe(GOOD)
    robot.wait_for_status(OK, 'publishing')


def test_a_second_publisher_is_a_warning(described):
    node, robot = described
    other = Node('other', namespace=node.namespace, context=robot.node.context)
    other.create_publisher(String, 'robot_description', LATCHED)
    robot.wait_for_status(WARN, f'{node.namespace}/robot_description has 2 publishers, and the '
                          f'last description counts: {node.namespace}/other, ')
    other.destroy_node()


@pytest.fixture(scope='module')
def with_tables():
    """Return a node that computes with tables, and a robot."""
    with NodeProcess({'joint_prefix': 'icub1/', **LOSSLESS}) as node, \
            DescribedRobot(node) as robot:
        yield node, robot


def test_tables_are_held_against_the_description(with_tables):
    node, robot = with_tables
    robot.describe(GOOD)
    node.wait_for_log("right_leg: r_foot_dh_frame is up to 0.00 mm and 0.00 deg off the robot's")
    robot.describe(own_description('v1'))
    way = (f'; description_from_topic:=true computes with the description on {node.namespace}'
           '/robot_description')
    node.wait_for_log(f'right_leg: r_foot_dh_frame is up to {mm_between_versions():.2f} mm')
    node.wait_for_log(way)
    far = [line for line in lines(node, 'WARN') if way in line]
    assert [line.partition(':')[0] for line in far] == ['left_leg', 'right_leg']
    assert f'l_foot_dh_frame is up to {mm_between_versions():.2f} mm and 0.00 deg off' in far[0]
    assert robot.change(version='v1').successful
    node.wait_for_log('left_leg=v1')
    values = robot.statuses(lambda statuses: True)['left_leg'].values
    assert values['description'].startswith('l_foot_dh_frame is up to 0.00 mm')
    assert robot.change(version='').successful


def test_a_difference_from_the_description_changes_no_level(with_tables):
    node, robot = with_tables
    robot.describe(own_description('v1'))

    def send():
        names = [f'icub1/{name}' for name in BOTH]
        robot.send(robot.node.get_clock().now().nanoseconds, names, Q)

    far = f'up to {mm_between_versions():.2f} mm'

    def are_compared(statuses):
        status = statuses['left_leg']
        return far in status.values['description'] and status.level == OK
    robot.statuses(are_compared, meanwhile=send)


def test_joint_names_without_the_prefix_are_explained(with_tables):
    node, robot = with_tables
    robot.statuses(lambda statuses: 'never seen' not in statuses['left_leg'].message
                   and 'is looked for with joint_prefix:=""' in statuses['left_leg'].message,
                   meanwhile=lambda: robot.send(SECOND, LEFT, Q[:6]))
