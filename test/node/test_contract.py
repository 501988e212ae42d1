"""Names, topics, frames, stamps and QoS of the node, as another participant sees them."""

import subprocess
import sys

from geometry_msgs.msg import PoseStamped, TwistStamped
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
import yaml

MS = 1_000_000  # ns
ANGLES = {name: 0.03 * (i + 1) * (-1) ** i for i, name in enumerate(BOTH)}
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
LATE = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PARAMETERS = config_file('foot_pose_publisher.yaml')
NODE = 'qos_overrides.{ns}/foot_pose_publisher'
TWIST_QOS = {
    NODE + '/left_foot/twist.publisher.durability': 'transient_local',
    NODE + '/right_foot/twist.publisher.reliability': 'best_effort',
}
RENAMED = [
    '-r',
    '__node:=feet',
    '-r',
    'joint_states:=/yarp/state/joints',
    '-r',
    '~/left_foot/pose:=/where/left',
]
RENAMED_QOS = {
    'qos_overrides./yarp/state/joints.subscription.reliability': 'reliable',
    'qos_overrides./yarp/state/joints.subscription.depth': 5000,
}


@pytest.fixture(scope='module')
def shared():
    """Return a node that loses nothing, with the shipped parameter file, and a robot beside it."""
    parameters = {**LOSSLESS, **TWIST_QOS}
    with (
        NodeProcess(parameters, ['--params-file', str(PARAMETERS)]) as node,
        Robot(node) as robot,
    ):
        robot.connect()
        yield node, robot


@pytest.fixture
def robot(shared):
    return shared[1]


@pytest.fixture(scope='module')
def default_robot():
    """Return a robot beside a node with default parameters."""
    with NodeProcess(namespace='') as node, Robot(node) as robot:
        robot.connect()
        yield robot


def send_angles(robot, stamp, names=BOTH):
    robot.send(stamp, names, [ANGLES.get(name, 9.0) for name in names])


def expected(chain, names, version='v2_5'):
    return oracle_pose(chain, version, [ANGLES[name] for name in names])


def test_names_that_change_between_messages_are_picked_up_at_once(robot):
    start = robot.connect() + SECOND
    orders = [BOTH, RIGHT + LEFT, BOTH[::-1], ('a', *BOTH), BOTH, ('bb', *BOTH[::-1])]
    for stamp, names in enumerate(orders, start):
        send_angles(robot, stamp, names)
        pose = robot.take(robot.left, stamp)[-1]
        robot.take(robot.right, stamp)
        assert_same_pose(pose, expected('left_leg', LEFT))


def test_pose_has_the_stamp_of_its_message_and_the_frame_of_the_root(robot):
    stamp = robot.connect() + 123_456_789
    send_angles(robot, stamp)
    for inbox in robot.poses.values():
        pose = robot.take(inbox, stamp)[-1]
        assert pose.header.frame_id == 'root_link'
        q = pose.pose.orientation
        assert q.w >= 0
        assert np.isclose(np.linalg.norm([q.x, q.y, q.z, q.w]), 1.0, rtol=0, atol=1e-15)


def endpoint(robot, kind, topic):
    """Return type, reliability and durability of the node's publisher or subscription."""
    lister = getattr(robot.node, f'get_{kind}_info_by_topic')
    found = []

    def is_there():
        found[:] = [
            info for info in lister(topic) if info.node_name == 'foot_pose_publisher'
        ]
        return bool(found)

    robot.until(is_there, f'{kind} of {topic}')
    [info] = found
    return info.topic_type, info.qos_profile.reliability, info.qos_profile.durability


def test_topics_have_the_types_and_qos_of_the_contract(default_robot):
    robot = default_robot
    volatile = DurabilityPolicy.VOLATILE
    assert endpoint(robot, 'subscriptions', '/joint_states') == (
        'sensor_msgs/msg/JointState',
        ReliabilityPolicy.BEST_EFFORT,
        volatile,
    )
    for foot in FEET:
        assert endpoint(robot, 'publishers', f'/foot_pose_publisher/{foot}/pose') == (
            'geometry_msgs/msg/PoseStamped',
            ReliabilityPolicy.RELIABLE,
            volatile,
        )
    pose = '/foot_pose_publisher/left_foot/pose.publisher'
    names = [
        f'qos_overrides.{topic}.depth' for topic in ('/joint_states.subscription', pose)
    ]
    answer = robot.result(robot.parameters().get_parameters(names))
    assert [value.integer_value for value in answer.values] == [100, 10]


def test_shipped_parameter_file_holds_the_defaults(default_robot):
    robot = default_robot
    [in_file] = yaml.safe_load(PARAMETERS.read_text()).values()
    defaults = in_file['ros__parameters']
    answer = robot.result(robot.parameters().get_parameters([*defaults]))
    for value, default in zip(answer.values, defaults.values(), strict=True):
        given = (
            value.bool_value,
            value.double_value,
            value.string_value,
            list(value.string_array_value),
        )
        assert default in given


@pytest.mark.parametrize('qos', [BEST_EFFORT, DEEP], ids=['best effort', 'reliable'])
def test_publishers_of_either_reliability_are_heard(default_robot, qos):
    robot = default_robot
    publisher = robot.node.create_publisher(JointState, 'joint_states', qos)
    robot.connect(publisher=publisher)
    robot.node.destroy_publisher(publisher)


def test_empty_bytes_over_the_default_qos_are_dropped(default_robot):
    t = default_robot.connect()
    default_robot.joints.publish(b'')
    default_robot.connect(t + SECOND)


def test_qos_can_be_overridden_by_parameters_and_a_mismatch_is_said(shared):
    node, robot = shared
    left, right = (node.topic(f'{foot}/twist') for foot in FEET)
    assert robot.change(publish_twist=True).successful
    joints = endpoint(robot, 'subscriptions', f'{node.namespace}/joint_states')
    assert joints[1] == ReliabilityPolicy.RELIABLE
    assert endpoint(robot, 'publishers', left)[2] == DurabilityPolicy.TRANSIENT_LOCAL
    assert endpoint(robot, 'publishers', right)[1] == ReliabilityPolicy.BEST_EFFORT
    stamp = robot.connect() + MS
    robot.send(stamp, velocity=[0.1] * 12)
    robot.take(robot.right, stamp)
    # Whoever subscribes late to a transient-local topic gets the last message all the same.
    robot.wait_for(robot.listen(TwistStamped, left, LATE), stamp)
    robot.node.create_publisher(JointState, 'joint_states', BEST_EFFORT)
    node.wait_for_log(
        "publisher discovered on topic 'joint_states', offering incompatible QoS"
    )
    robot.listen(TwistStamped, right, DEEP)
    node.wait_for_log(
        "subscription discovered on topic '~/right_foot/twist', requesting "
        'incompatible QoS'
    )


def test_nodes_in_namespaces_work_side_by_side(robot, default_robot):
    assert robot.change(version='v1').successful
    assert default_robot.change(frame_prefix='blue/').successful
    for each, version, root in (
        (robot, 'v1', 'root_link'),
        (default_robot, 'v2_5', 'blue/root_link'),
    ):
        stamp = each.connect() + 1
        send_angles(each, stamp)
        each.wait_for(each.left, stamp)
        pose = each.take(each.right, stamp)[-1]
        assert pose.header.frame_id == root
        assert_same_pose(pose, expected('right_leg', RIGHT, version))
    assert {pose.header.frame_id for pose in robot.left} == {'root_link'}


@pytest.fixture(scope='module')
def renamed():
    """Return a robot beside a node of other names and chains, and the last stamp it sent."""
    parameters = {
        'chains': ['head_imu=v2', 'left_leg=v1'],
        'foot_frame': 'sole',
        **RENAMED_QOS,
    }
    with (
        NodeProcess(parameters, RENAMED) as node,
        Robot(node, tips=['head_imu'], name='feet') as robot,
    ):
        robot.torso = robot.node.create_publisher(
            JointState, '/yarp/state/joints', DEEP
        )
        robot.left = robot.listen(PoseStamped, '/where/left')
        robot.head = robot.poses['head_imu']
        stamp = robot.connect(
            names=LEFT + HEAD, inboxes=[robot.head, robot.left], publisher=robot.torso
        )
        assert 'head_imu has no sole' in node.log()
        yield node, robot, stamp


def test_topics_and_node_can_be_renamed_and_any_chain_chosen(renamed):
    _, robot, stamp = renamed
    q = [0.1, 0.2, -0.1, -0.3, 0.2, 0.1]
    head_q = [0.1 * i for i in range(6)]
    robot.send(stamp + 1, LEFT + HEAD, q + head_q, robot.torso)
    assert_same_pose(
        robot.take(robot.left, stamp + 1)[-1], oracle_pose('left_leg', 'v1', q, 'sole')
    )
    assert_same_pose(
        robot.take(robot.head, stamp + 1)[-1], oracle_pose('head_imu', 'v2', head_q)
    )


def test_torso_and_neck_from_two_publishers_interleave_out_of_order(renamed):
    node, robot, stamp = renamed
    neck = robot.node.create_publisher(JointState, '/yarp/state/joints', DEEP)
    start = robot.connect(stamp + MS, HEAD, [robot.head], neck)
    torso_q = neck_q = [0.0] * 3
    for i in range(1, 6):
        torso_at = start + 10 * i * MS
        torso_q = [0.01 * (i + k) for k in range(3)]
        robot.send(torso_at, HEAD[:3], torso_q, robot.torso)
        pose = robot.take(robot.head, torso_at)[-1]
        if i > 1:
            assert_same_pose(pose, oracle_pose('head_imu', 'v2', torso_q + neck_q))
        neck_q = [0.01 * (i + k) for k in range(3, 6)]
        robot.send(torso_at - MS, HEAD[3:], neck_q, neck)
        pose = robot.take(robot.head, torso_at - MS)[-1]
        assert_same_pose(pose, oracle_pose('head_imu', 'v2', torso_q + neck_q))
    assert 'time stepped back' not in node.log()


def test_help_is_shown_without_a_node():
    run = subprocess.run(
        [sys.executable, '-m', 'icub_leg_fk.node.main', '--help'],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert (run.returncode, run.stderr) == (0, '')
    assert 'version' in run.stdout
