"""The robot's description, sent by another process: computed with, or held against the tables."""

from icub_leg_fk import load_chain
from icub_leg_fk.kinematics.difference import postures
import numpy as np
import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from support.described_robots import (
    needs_real_robots,
    own_description,
    pinocchio_pose,
    REAL,
)
from support.node_harness import (
    BOTH,
    ERROR,
    FEET,
    LEFT,
    lines,
    LOSSLESS,
    NodeProcess,
    OK,
    Robot,
    SECOND,
    STALE,
    WARN,
)
from support.node_oracle import oracle_pose, pose_matrix
from support.robots import joint as a_joint
from support.robots import robot as robot_of

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
Q = [0.2, 0.1, -0.1, -0.5, -0.3, 0.1, 0.15, 0.05, 0.1, -0.4, -0.2, -0.1]
CRANE = robot_of([a_joint(0), a_joint(1)])
GOOD = own_description('v2_5')
COMPUTING = 'computing with the description of {}'
UNUSED = 'description of the robot not used'


class DescribedRobot(Robot):
    """A robot that also sends descriptions of itself, and reads what the node says."""

    def __init__(self, node):
        super().__init__(node)
        self._node = node
        self._publisher = self.node.create_publisher(
            String, 'robot_description', LATCHED
        )
        self.topic = f'{node.namespace}/robot_description'
        self._text = None
        self._stamp = SECOND

    def describe(self, text, said):
        """Send a description that is not the last one, and wait until the node has said this."""
        if text != self._text:
            self._text = text
            before = self._node.log().count(said)
            self._publisher.publish(String(data=text))
            self.until(lambda: self._node.log().count(said) > before, said)

    def poses_now(self):
        """Return the (4, 4) poses of both feet that answer a joint state."""
        self._stamp = self.connect(self._stamp) + 1000
        self.send(self._stamp, BOTH, Q)
        poses = [self.take(self.poses[tip], self._stamp)[-1].pose for tip in FEET]
        return list(map(pose_matrix, poses))

    def left_leg(self, condition, joint_prefix=''):
        """Wait until the left leg's status meets a condition."""
        names = [joint_prefix + name for name in BOTH]

        def send():
            self.send(self.node.get_clock().now().nanoseconds, names, Q)

        self.statuses(lambda statuses: condition(statuses['left_leg']), meanwhile=send)

    def wait_for_status(self, level, words):
        """Wait until the left leg's status has this level and these words."""
        self.left_leg(lambda status: status.level == level and words in status.message)

    def said(self, severity):
        """Return what the node has said, from the text on."""
        return lines(self._node, severity)


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


@pytest.fixture(scope='module')
def waiting():
    """Return a robot whose node computes with the description that it sends."""
    with (
        NodeProcess({'description_from_topic': True, **LOSSLESS}) as node,
        DescribedRobot(node) as robot,
    ):
        yield robot


@pytest.fixture(scope='module')
def with_tables(waiting):
    """Return a robot whose node computes with tables, and looks for joints under a prefix.

    The other one waits meanwhile: for longer than the five seconds after which it warns.
    """
    with (
        NodeProcess({'joint_prefix': 'icub1/', **LOSSLESS}) as node,
        DescribedRobot(node) as robot,
    ):
        yield robot


def test_tables_are_held_against_the_description(with_tables):
    robot = with_tables
    near = "r_foot_dh_frame is up to 0.00 mm and 0.00 deg off the robot's own"
    robot.describe(GOOD, f'right_leg: {near}')
    far = f'_foot_dh_frame is up to {mm_between_versions():.2f} mm and 0.00 deg off the'
    way = (
        f'; description_from_topic:=true computes with the description on {robot.topic}'
    )
    robot.describe(own_description('v1'), f'right_leg: r{far}')
    left, right = [line for line in robot.said('WARN') if line.endswith(way)]
    assert left.startswith(f'left_leg: l{far}')
    assert right.startswith(f'right_leg: r{far}')
    robot.left_leg(  # no other level for that
        lambda status: far in status.values['description'] and status.level == OK,
        'icub1/',
    )
    assert robot.change(version='v1').successful
    robot.left_leg(lambda status: ' 0.00 mm' in status.values['description'])
    assert robot.change(version='').successful


def test_joint_names_without_the_prefix_are_explained(with_tables):
    with_tables.wait_for_status(
        ERROR, '; \'l_hip_pitch\' is looked for with joint_prefix:=""'
    )


@pytest.fixture
def described(waiting):
    """Return that robot, once the node computes with a good description."""
    waiting.describe(GOOD, COMPUTING.format('robot_v2_5'))
    return waiting


def test_it_waits_aloud(waiting):
    topic = waiting.topic
    silence = f'no description of the robot has come on {topic}; it has 1 publisher'
    waiting.wait_for_status(STALE, silence)
    waiting.until(lambda: silence in waiting.said('WARN'), silence)
    words = (
        f'the robot on {topic} to publish poses of left_leg, right_leg; joint states'
    )
    assert f'waiting for the description of {words}' in waiting.said('INFO')[0]
    assert not waiting.left
    result = waiting.change(version='v1')
    assert not result.successful
    assert "'v1', allowed with description_from_topic: none" in result.reason


def test_poses_are_those_of_the_description_and_a_new_one_takes_effect(described):
    assert_poses(described.poses_now(), GOOD)
    other = own_description('v1')
    described.describe(other, COMPUTING.format('robot_v1'))
    poses = described.poses_now()
    assert_poses(poses, other)
    expected = oracle_pose('left_leg', 'v1', Q[:6])
    np.testing.assert_allclose(poses[0], expected, rtol=0, atol=1e-9)
    words = '(left_leg=urdf, root_link to l_foot_dh_frame)'
    assert any(words in line for line in described.said('INFO'))


@needs_real_robots
@pytest.mark.parametrize('name', ['iCubGenova04', 'iCubGenova09'])
def test_poses_of_real_robots(described, name):
    text = REAL[name].read_text()
    assert described.change(foot_frame='sole').successful
    described.describe(text, COMPUTING.format('iCub'))
    assert_poses(described.poses_now(), text, ('l_sole', 'r_sole'))
    assert described.change(foot_frame='dh').successful


@pytest.mark.parametrize(
    ('bad', 'fault'),
    [
        (GOOD[: len(GOOD) // 2], 'robot_description:'),
        ('', 'robot_description:'),
        (CRANE, "unknown chain 'left_leg'; known: l2"),
        (own_description('v2_5', 'left_leg'), "unknown chain 'right_leg'"),
    ],
    ids=['half', 'empty', 'another robot', 'one leg'],
)
def test_one_that_cannot_be_used_changes_nothing(described, bad, fault):
    described.describe(bad, UNUSED)
    error = described.said('ERROR')[-1]
    assert fault in error
    assert error.endswith('; the one before stays')
    assert_poses(described.poses_now(), GOOD)


def test_diagnostics_show_the_error_as_long_as_it_lasts(described):
    described.describe(CRANE, UNUSED)
    described.wait_for_status(ERROR, UNUSED)
    described.describe(GOOD, COMPUTING.format('robot_v2_5'))
    described.wait_for_status(OK, 'publishing')


def test_a_second_publisher_is_a_warning(described):
    namespace = described.node.get_namespace()
    other = Node('other', namespace=namespace, context=described.node.context)
    other.create_publisher(String, 'robot_description', LATCHED)
    described.wait_for_status(
        WARN,
        f'{described.topic} has 2 publishers, and the last '
        f'description counts: {namespace}/other, {namespace}/robot',
    )
    other.destroy_node()


def test_a_urdf_is_a_kinematics_file(tmp_path):
    robots, parameters = tmp_path / 'robot.urdf', tmp_path / 'parameters.yaml'
    robots.write_text(GOOD)
    parameters.write_text('/**: {ros__parameters: {root_frame: odom}}')
    file = ['--params-file', str(parameters)]
    with NodeProcess({'kinematics_file': str(robots)}, file) as node:
        node.wait_for_log('publishing poses of left_foot (left_leg=urdf, root_link to')
        [warning] = lines(node, 'WARN')
    fault = f"root_frame not used: unknown link 'odom' of {robots}; known: "
    assert warning.startswith(fault)
