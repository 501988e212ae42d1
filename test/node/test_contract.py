"""Names, topics, frames, stamps and QoS of the node, as another participant sees them."""

import subprocess
import sys

from geometry_msgs.msg import PoseStamped
from icub_leg_fk.kinematics.catalog import config_file
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from support.node_harness import (
    BOTH,
    DEEP,
    FEET,
    HEAD,
    LEFT,
    LOSSLESS,
    NodeProcess,
    RIGHT,
    Robot,
    SECOND,
)
from support.node_oracle import assert_same_pose, oracle_pose

ANGLES = {name: 0.03 * (i + 1) * (-1) ** i for i, name in enumerate(BOTH)}


@pytest.fixture(scope='module')
def robot():
    """Return a robot beside a node that loses nothing, however long it is held up."""
    with NodeProcess(LOSSLESS) as node, Robot(node) as robot:
        robot.connect()
        yield robot


@pytest.fixture(scope='module')
def default_robot():
    """Return a robot beside a node with default parameters."""
    with NodeProcess(namespace='') as node, Robot(node) as robot:
        robot.connect()
        yield robot


BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
LATE = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def send_angles(robot, stamp, names):
    robot.send(stamp, names, [ANGLES.get(name, 9.0) for name in names])


def expected(chain, names, version='v2_5', foot_frame='dh'):
    return oracle_pose(chain, version, [ANGLES[name] for name in names], foot_frame)


def test_names_that_change_between_messages_are_picked_up_at_once(robot):
    start = robot.connect() + SECOND
    orders = [BOTH, RIGHT + LEFT, BOTH[::-1], ('a', *BOTH), BOTH, ('bb', *BOTH[::-1])]
    for i, names in enumerate(orders):
        send_angles(robot, start + i, names)
        pose = robot.take(robot.left, start + i)[-1]
        robot.take(robot.right, start + i)
        assert_same_pose(pose, expected('left_leg', LEFT))


def test_pose_has_the_stamp_of_its_message_and_the_frame_of_the_root(robot):
    stamp = robot.connect() + 123_456_789
    send_angles(robot, stamp, BOTH)
    for inbox in robot.poses.values():
        pose = robot.take(inbox, stamp)[-1]
        assert pose.header.frame_id == 'root_link'
        q = pose.pose.orientation
        assert q.w >= 0
        assert np.isclose(np.linalg.norm([q.x, q.y, q.z, q.w]), 1.0, rtol=0, atol=1e-15)


def endpoints(robot, topic, kind):
    lister = getattr(robot.node, f'get_{kind}_info_by_topic')
    found = []

    def there():
        found[:] = [info for info in lister(topic) if info.node_name == 'foot_pose_publisher']
        return bool(found)
    robot.until(there, f'{kind} of {topic}')
    return [(info.topic_type, info.qos_profile.reliability, info.qos_profile.durability)
            for info in found]


def test_topics_have_the_types_and_qos_of_the_contract(default_robot):
    robot = default_robot
    volatile = DurabilityPolicy.VOLATILE
    assert endpoints(robot, '/joint_states', 'subscriptions') == [
        ('sensor_msgs/msg/JointState', ReliabilityPolicy.BEST_EFFORT, volatile)]
    for foot in FEET:
        assert endpoints(robot, f'/foot_pose_publisher/{foot}/pose', 'publishers') == [
            ('geometry_msgs/msg/PoseStamped', ReliabilityPolicy.RELIABLE, volatile)]
    parameters = robot.parameters()
    depths = {'/joint_states.subscription': 5, '/foot_pose_publisher/left_foot/pose.publisher': 10}
    for topic, depth in depths.items():
        answer = robot.result(parameters.get_parameters([f'qos_overrides.{topic}.depth']))
        assert answer.values[0].integer_value == depth


@pytest.mark.parametrize('qos', [BEST_EFFORT, DEEP], ids=['best effort', 'reliable'])
def test_publishers_of_either_reliability_are_heard(default_robot, qos):
    robot = default_robot
    publisher = robot.node.create_publisher(JointState, 'joint_states', qos)
    stamp = robot.connect(publisher=publisher)
    assert stamp > 0
    robot.node.destroy_publisher(publisher)


def test_qos_can_be_overridden_by_parameters_and_a_mismatch_is_said():
    pose = 'foot_pose_publisher/{}/pose'.format
    overrides = {
        'qos_overrides.{ns}/joint_states.subscription.reliability': 'reliable',
        f'qos_overrides.{{ns}}/{pose("left_foot")}.publisher.durability': 'transient_local',
        f'qos_overrides.{{ns}}/{pose("right_foot")}.publisher.reliability': 'best_effort',
    }
    with NodeProcess(overrides) as node, Robot(node, tips=()) as robot:
        joints, left = f'{node.namespace}/joint_states', node.topic('left_foot/pose')
        assert endpoints(robot, joints, 'subscriptions')[0][1] == ReliabilityPolicy.RELIABLE
        assert endpoints(robot, left, 'publishers')[0][2] == DurabilityPolicy.TRANSIENT_LOCAL
        right = endpoints(robot, node.topic('right_foot/pose'), 'publishers')
        assert right[0][1] == ReliabilityPolicy.BEST_EFFORT
        diagnostics = robot.diagnostics()
        robot.status(diagnostics, 'left_leg', lambda status, values: values['poses'] != '0',
                     meanwhile=lambda: robot.send(SECOND))
        # Whoever subscribes late to a transient-local topic gets the last pose all the same.
        inbox = robot.listen(PoseStamped, left, LATE)
        robot.wait_for(inbox, SECOND)
        robot.node.create_publisher(JointState, 'joint_states', BEST_EFFORT)
        node.wait_for_log("publisher discovered on topic 'joint_states', "
                          'offering incompatible QoS')
        robot.listen(PoseStamped, node.topic('right_foot/pose'), DEEP)
        node.wait_for_log("subscription discovered on topic '~/right_foot/pose', requesting "
                          'incompatible QoS')


def test_nodes_in_namespaces_work_side_by_side():
    parameters = {'version': 'v1', **LOSSLESS}, {'frame_prefix': 'blue/', **LOSSLESS}
    with NodeProcess(parameters[0]) as red_node, Robot(red_node) as red, \
            NodeProcess(parameters[1]) as blue_node, Robot(blue_node) as blue:
        for robot, version, frame in ((red, 'v1', 'root_link'), (blue, 'v2_5', 'blue/root_link')):
            stamp = robot.connect() + 1
            send_angles(robot, stamp, BOTH)
            robot.wait_for(robot.left, stamp)
            pose = robot.take(robot.right, stamp)[-1]
            assert pose.header.frame_id == frame
            assert_same_pose(pose, expected('right_leg', RIGHT, version))
        assert {pose.header.frame_id for pose in red.left} == {'root_link'}


def test_topics_and_node_can_be_renamed_and_any_chain_chosen():
    arguments = ['-r', '__node:=feet', '-r', 'joint_states:=/yarp/state/joints',
                 '-r', '~/left_foot/pose:=/where/left']
    parameters = {'chains': ['head_imu', 'left_leg'], 'head_imu.version': 'v2',
                  'left_leg.version': 'v1', 'foot_frame': 'sole',
                  'qos_overrides./yarp/state/joints.subscription.reliability': 'reliable'}
    with NodeProcess(parameters, arguments) as node, \
            Robot(node, tips=['head_imu'], name='feet') as robot:
        publisher = robot.node.create_publisher(JointState, '/yarp/state/joints', DEEP)
        left = robot.listen(PoseStamped, '/where/left')
        names = (*LEFT, *HEAD)
        stamp = robot.connect(names=names, inboxes=[robot.poses['head_imu'], left],
                              publisher=publisher) + 1
        positions = [0.1, 0.2, -0.1, -0.3, 0.2, 0.1, *[0.1 * i for i in range(6)]]
        robot.send(stamp, names, positions, publisher)
        assert_same_pose(robot.take(left, stamp)[-1],
                         oracle_pose('left_leg', 'v1', positions[:6], 'sole'))
        assert_same_pose(robot.take(robot.poses['head_imu'], stamp)[-1],
                         oracle_pose('head_imu', 'v2', positions[6:]))
        assert 'head_imu has no sole' in node.log()


def test_shipped_parameter_file_is_taken_and_holds_the_defaults(default_robot):
    robot = default_robot
    file = str(config_file('foot_pose_publisher.yaml'))
    names = ['chains', 'version', 'left_leg.version', 'right_leg.version', 'kinematics_file',
             'foot_frame', 'frame_prefix', 'joint_timeout', 'stamp_source', 'publish_tf',
             'publish_twist', 'publish_markers']
    defaults = robot.result(robot.parameters().get_parameters(names)).values
    with NodeProcess(arguments=['--params-file', file]) as node, \
            Robot(node) as other:
        assert other.result(other.parameters().get_parameters(names)).values == defaults
        own = other.result(other.parameters().get_parameters(['head_imu.version'])).values
        assert own[0].string_value == 'v2'


def test_help_is_shown_without_a_node():
    run = subprocess.run([sys.executable, '-m', 'icub_leg_fk.node.main', '--help'],
                         capture_output=True, text=True, timeout=30, check=False)
    assert (run.returncode, run.stderr) == (0, '')
    assert 'version' in run.stdout
