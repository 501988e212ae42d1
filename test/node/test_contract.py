"""Names, topics, frames, stamps and QoS of the node, as another participant sees them."""

from geometry_msgs.msg import PoseStamped, TwistStamped
from icub_leg_fk.kinematics.catalog import config_file
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
    Robot,
    SECOND,
)
from support.node_oracle import assert_same_pose, oracle_pose

MS = 1_000_000  # ns
Q = [0.03 * (i + 1) * (-1) ** i for i in range(12)]
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
LATE = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
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
    file = ['--params-file', str(config_file('foot_pose_publisher.yaml'))]
    with NodeProcess(LOSSLESS | TWIST_QOS, file) as node, Robot(node) as robot:
        robot.connect()
        yield node, robot


@pytest.fixture(scope='module')
def default_robot():
    """Return a robot beside a node with default parameters."""
    with NodeProcess(namespace='') as node, Robot(node) as robot:
        robot.connect()
        yield robot


def endpoint(robot, kind, topic):
    """Return type, reliability and durability of the node's publisher or subscription."""
    lister = getattr(robot.node, f'get_{kind}_info_by_topic')
    found = []

    def is_there():
        found[:] = [
            (info.topic_type, info.qos_profile.reliability, info.qos_profile.durability)
            for info in lister(topic)
            if info.node_name == 'foot_pose_publisher'
        ]
        return len(found) == 1

    robot.until(is_there, f'{kind} of {topic}')
    return found[0]


def test_topics_have_the_types_and_qos_of_the_contract(default_robot):
    robot = default_robot
    volatile = DurabilityPolicy.VOLATILE
    assert endpoint(robot, 'subscriptions', '/joint_states') == (
        'sensor_msgs/msg/JointState',
        ReliabilityPolicy.BEST_EFFORT,
        volatile,
    )
    topics = [f'/foot_pose_publisher/{foot}/pose' for foot in FEET]
    for topic in topics:
        assert endpoint(robot, 'publishers', topic) == (
            'geometry_msgs/msg/PoseStamped',
            ReliabilityPolicy.RELIABLE,
            volatile,
        )
    names = ['/joint_states.subscription', *(f'{topic}.publisher' for topic in topics)]
    depths = [f'qos_overrides.{name}.depth' for name in names]
    answer = robot.result(robot.parameters().get_parameters(depths))
    assert [value.integer_value for value in answer.values] == [100, 10, 10]


def test_a_best_effort_publisher_is_heard_and_empty_bytes_are_dropped(default_robot):
    robot = default_robot
    publisher = robot.node.create_publisher(JointState, 'joint_states', BEST_EFFORT)
    stamp = robot.connect(publisher=publisher)
    publisher.publish(b'')
    robot.connect(stamp + SECOND, publisher=publisher)
    robot.node.destroy_publisher(publisher)


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
    robot.listen(TwistStamped, right, DEEP)
    node.wait_for_log(
        "subscription discovered on topic '~/right_foot/twist', requesting "
        'incompatible QoS'
    )


def test_nodes_in_namespaces_work_side_by_side(shared, default_robot):
    _, robot = shared
    assert robot.change(version='v1').successful
    assert default_robot.change(frame_prefix='blue/').successful
    for each, version, root in (
        (robot, 'v1', 'root_link'),
        (default_robot, 'v2_5', 'blue/root_link'),
    ):
        stamp = each.connect() + 1
        each.send(stamp, BOTH, Q)
        each.wait_for(each.left, stamp)
        pose = each.take(each.right, stamp)[-1]
        assert pose.header.frame_id == root
        assert_same_pose(pose, oracle_pose('right_leg', version, Q[6:]))
    assert {pose.header.frame_id for pose in robot.left} == {'root_link'}


def test_topics_and_node_can_be_renamed_and_any_chain_chosen():
    parameters = {
        'chains': ['head_imu=v2', 'left_leg=v1'],
        'foot_frame': 'sole',
        **RENAMED_QOS,
    }
    with (
        NodeProcess(parameters, RENAMED) as node,
        Robot(node, tips=['head_imu'], name='feet') as robot,
    ):
        joints = robot.node.create_publisher(JointState, '/yarp/state/joints', DEEP)
        left, head = robot.listen(PoseStamped, '/where/left'), robot.poses['head_imu']
        stamp = 1 + robot.connect(
            names=LEFT + HEAD, inboxes=[head, left], publisher=joints
        )
        robot.send(stamp, LEFT + HEAD, Q, joints)
        for inbox, expected in (
            (left, oracle_pose('left_leg', 'v1', Q[:6], 'sole')),
            (head, oracle_pose('head_imu', 'v2', Q[6:])),
        ):
            assert_same_pose(robot.take(inbox, stamp)[-1], expected)
        assert 'head_imu has no sole' in node.log()
