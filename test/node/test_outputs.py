"""Twists, skeletons and transforms that the node publishes on request."""

from functools import partial
from importlib.util import find_spec

from geometry_msgs.msg import TwistStamped
from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from support.node_harness import BOTH, FEET, LOSSLESS, NodeProcess, Robot, SECOND
from support.node_oracle import oracle_jacobian, oracle_pose, pose_matrix
from visualization_msgs.msg import Marker, MarkerArray

MS = 1_000_000  # ns
Q = np.array([0.2, 0.1, -0.1, -0.5, -0.3, 0.1, 0.15, 0.05, 0.1, -0.4, -0.2, -0.1])
CHAINS = dict(
    zip(FEET, (('left_leg', slice(6)), ('right_leg', slice(6, 12))), strict=True)
)
MARKER_TYPES = [
    Marker.LINE_STRIP,
    Marker.SPHERE_LIST,
    Marker.TEXT_VIEW_FACING,
    Marker.LINE_STRIP,
]
SOLE = [[-0.07, 0.04, 0.0], [0.12, 0.04, 0.0], [0.12, -0.04, 0.0], [-0.07, -0.04, 0.0]]
POSE_TOPICS = {f'{tip}/pose' for tip in FEET}
TWIST_TOPICS = {f'{tip}/twist' for tip in FEET}
TWIST_DEPTH = {
    f'qos_overrides.{{ns}}/foot_pose_publisher/{tip}/twist.publisher.depth': 5000
    for tip in FEET
}


@pytest.fixture(scope='module')
def shared():
    """Return a node that publishes poses alone, and a robot beside it."""
    with NodeProcess({**LOSSLESS, **TWIST_DEPTH}) as node, Robot(node) as robot:
        robot.connect()
        yield node, robot


class Twists:
    """A robot beside a node that publishes twists."""

    def __init__(self, node, robot):
        self.robot = robot
        self.inboxes = {
            tip: robot.listen(TwistStamped, node.topic(f'{tip}/twist')) for tip in FEET
        }
        self.stamp = robot.connect() + SECOND

        def answered():
            self.send(Q, np.zeros(12))
            robot.spin(0.02)
            return all(self.inboxes.values())

        robot.until(answered, 'twists of both feet')
        self.answers()

    def send(self, q, qdot, names=BOTH):
        self.stamp += MS
        self.robot.send(self.stamp, names, q, velocity=list(map(float, qdot)))

    def answers(self):
        """Return poses and twists by tip up to the answers to the last message."""
        take, last = self.robot.take, self.stamp
        poses = {tip: take(self.robot.poses[tip], last) for tip in FEET}
        return poses, {tip: take(self.inboxes[tip], last) for tip in FEET}


@pytest.fixture(scope='module')
def twists(shared):
    node, robot = shared
    assert robot.change(publish_twist=True).successful
    return Twists(node, robot)


def offers(node, robot, topics):
    """Return whether the node offers just these; it does not until its name is announced."""
    name, namespace = 'foot_pose_publisher', node.namespace
    if (name, namespace) not in robot.node.get_node_names_and_namespaces():
        return False
    found = robot.node.get_publisher_names_and_types_by_node(name, namespace)
    return {topic.removeprefix(node.topic('')) for topic, _ in found} == topics


def test_no_other_topic_is_offered_unless_asked_for(shared):
    node, robot = shared
    always = POSE_TOPICS | {'/diagnostics', '/rosout', '/parameter_events'}
    # Announcements come in order: once the twists are there, whatever was before them is.
    for wants_twists in (True, False):
        assert robot.change(publish_twist=wants_twists).successful
        wanted = always | (TWIST_TOPICS if wants_twists else set())
        robot.until(partial(offers, node, robot, wanted), wanted)


def vector(twist):
    linear, angular = twist.twist.linear, twist.twist.angular
    return np.array([linear.x, linear.y, linear.z, angular.x, angular.y, angular.z])


def test_twist_is_the_jacobian_times_the_velocities(twists):
    random = np.random.default_rng(7)
    for _ in range(20):
        q, qdot = random.uniform(-1, 1, 12), random.uniform(-5, 5, 12)
        order = random.permutation(12)
        twists.send(q[order], qdot[order], [BOTH[i] for i in order])
        poses, answers = twists.answers()
        for tip, (chain, part) in CHAINS.items():
            assert answers[tip].stamps() == poses[tip].stamps() == [twists.stamp]
            assert answers[tip][0].header.frame_id == 'root_link'
            J = oracle_jacobian(chain, 'v2_5', q[part])
            np.testing.assert_allclose(
                vector(answers[tip][0]), J @ qdot[part], rtol=0, atol=1e-12
            )


def test_without_all_velocities_the_pose_goes_out_alone(twists):
    assert twists.robot.change(frame_prefix='a/').successful
    bad = twists.stamp + MS
    twists.send(Q, [np.inf] + [0.1] * 11)
    twists.send(Q, np.ones(12))
    poses, answers = twists.answers()
    for tip, stamps in zip(FEET, ([twists.stamp], [bad, twists.stamp]), strict=True):
        assert poses[tip].stamps() == [bad, twists.stamp]
        assert answers[tip].stamps() == stamps
        assert answers[tip][-1].header.frame_id == 'a/root_link'
    assert twists.robot.change(publish_twist=False, frame_prefix='').successful


def points_of(marker):
    return np.array([[point.x, point.y, point.z] for point in marker.points])


def test_skeletons_go_through_the_frames_to_the_sole_and_viewers_forget_old_ones(
    shared,
):
    node, robot = shared
    values = {'publish_markers': True, 'frame_prefix': 'x/', 'foot_frame': 'sole'}
    assert robot.change(**values).successful
    by_chain = {}

    def receive(array):
        by_chain[array.markers[0].ns] = array.markers

    robot.node.create_subscription(MarkerArray, node.topic('skeleton'), receive, 10)

    def both_skeletons():
        robot.send(SECOND, BOTH, Q)
        robot.spin(0.02)
        return by_chain.keys() >= {'left_leg', 'right_leg'}

    robot.until(both_skeletons, 'skeletons')
    for chain, part in CHAINS.values():
        bones, joints, name, sole = by_chain[chain]
        for marker in by_chain[chain]:
            assert marker.header.frame_id == 'x/root_link'
            assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == (1, 0)
            assert (marker.action, marker.color.a) == (Marker.ADD, 1.0)
        assert [bones.type, joints.type, name.type, sole.type] == MARKER_TYPES
        frames = Catalog.load().chain(chain, 'v2_5', 'sole').frames(Q[part])
        T = oracle_pose(chain, 'v2_5', Q[part], 'sole')  # x forward, y left, z up
        points = np.array([np.zeros(3), *frames[:, :3, 3]])
        np.testing.assert_allclose(points[-1], T[:3, 3], rtol=0, atol=1e-12)
        for marker in (bones, joints):
            np.testing.assert_allclose(points_of(marker), points, rtol=0, atol=1e-12)
        corners = (points_of(sole) - T[:3, 3]) @ T[:3, :3]
        np.testing.assert_allclose(corners, [*SOLE, SOLE[0]], rtol=0, atol=1e-12)
    values = {'publish_markers': False, 'frame_prefix': '', 'foot_frame': 'dh'}
    assert robot.change(version='v1').successful
    robot.until(lambda: '' in by_chain, 'removal of the skeletons')
    [marker] = by_chain['']
    assert marker.action == Marker.DELETEALL
    assert robot.change(version='v2_5', **values).successful


@pytest.mark.skipif(find_spec('tf2_msgs') is not None, reason='tf2_msgs is installed')
def test_transforms_are_refused_in_one_line_where_tf2_msgs_is_missing(shared):
    result = shared[1].change(publish_tf=True)
    assert not result.successful
    assert 'tf2_msgs' in result.reason
    assert '\n' not in result.reason


@pytest.mark.parametrize(
    ('foot_frame', 'children'),
    [('dh', ['l_foot_dh_frame', 'r_foot_dh_frame']), ('sole', ['l_sole', 'r_sole'])],
)
def test_transforms_are_those_of_the_poses(shared, foot_frame, children):
    messages = pytest.importorskip(
        'tf2_msgs.msg', reason='tf2_msgs is not installed, nothing can be sent to /tf'
    )
    _, robot = shared
    assert robot.change(
        publish_tf=True, frame_prefix='x/', foot_frame=foot_frame
    ).successful
    inbox = []
    robot.node.create_subscription(messages.TFMessage, '/tf', inbox.append, 10)
    found = {}

    def both_transforms():
        robot.send(SECOND, BOTH, Q)
        for message in inbox:
            assert len(message.transforms) == 2
            found.update({item.child_frame_id: item for item in message.transforms})
        return len(found) >= 2

    robot.until(both_transforms, 'transforms')
    qos = robot.node.get_publishers_info_by_topic('/tf')[0].qos_profile
    assert (qos.reliability, qos.durability) == (
        ReliabilityPolicy.RELIABLE,
        DurabilityPolicy.VOLATILE,
    )
    for child, (chain, part) in zip(children, CHAINS.values(), strict=True):
        transform = found[f'x/{child}']
        assert transform.header.frame_id == 'x/root_link'
        assert transform.header.stamp.sec == 1
        np.testing.assert_allclose(
            pose_matrix(transform.transform),
            oracle_pose(chain, 'v2_5', Q[part], foot_frame),
            rtol=0,
            atol=1e-12,
        )
    assert robot.change(publish_tf=False, frame_prefix='', foot_frame='dh').successful
