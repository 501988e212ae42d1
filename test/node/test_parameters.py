"""The node's parameters, changed while it runs through the standard services."""

import itertools

from icub_leg_fk.kinematics import config_file
from icub_leg_fk.node.parameters import PARAMETERS
import pytest
from rcl_interfaces.msg import ParameterType
from rclpy.parameter import Parameter, parameter_value_to_python
from support.node_harness import BOTH, LEFT, LOSSLESS, NodeProcess, Robot, SECOND
from support.node_oracle import assert_same_pose, oracle_pose
import yaml

MS = 1_000_000  # ns
Q = [0.2, 0.1, -0.1, -0.5, -0.3, 0.1, 0.15, 0.05, 0.1, -0.4, -0.2, -0.1]
DEFAULTS = {parameter.name: parameter.default for parameter in PARAMETERS}
READ_ONLY = (
    'chains',
    'kinematics_file',
    'description_from_topic',
    'root_frame',
    'joint_prefix',
)
LIVE = {name: value for name, value in DEFAULTS.items() if name not in READ_ONLY}
SIDES = {'left_foot': ('left_leg', Q[:6]), 'right_foot': ('right_leg', Q[6:])}


class Feet:
    """A robot whose every message has a stamp of its own."""

    def __init__(self, robot):
        self.robot = robot
        self.stamp = robot.connect()

    def send(self):
        """Send one message; return its stamp."""
        self.stamp += MS
        self.robot.send(self.stamp, BOTH, Q)
        return self.stamp

    def check(self, version='v2_5'):
        """Check that the next poses are those of a version."""
        stamp = self.send()
        for tip, (chain, q) in SIDES.items():
            pose = self.robot.take(self.robot.poses[tip], stamp)[-1]
            assert_same_pose(pose, oracle_pose(chain, version, q))
            assert pose.header.frame_id == 'root_link'

    def values(self):
        """Return the values that the node has, by name."""
        client = self.robot.parameters()
        values = self.robot.result(client.get_parameters(list(DEFAULTS))).values
        return dict(zip(DEFAULTS, map(parameter_value_to_python, values), strict=True))


@pytest.fixture(scope='module')
def shared():
    with NodeProcess(LOSSLESS) as node, Robot(node) as robot:
        yield Feet(robot)


@pytest.fixture
def feet(shared):
    """Return the feet beside a node that has its default parameters."""
    yield shared
    result = shared.robot.change(**LIVE)
    assert result.successful, result.reason


def test_joint_timeout_and_stamps_change_live(feet):
    feet.check()
    robot, late = feet.robot, feet.stamp + SECOND
    robot.send(late, LEFT[:3], Q[:3])  # the others are too old now
    assert robot.change(joint_timeout=2.0).successful
    robot.send(late + 1, LEFT[:3], Q[:3])
    assert robot.take(robot.left, late + 1).stamps() == [late + 1]
    feet.stamp = late + 1
    assert robot.change(stamp_source='now').successful
    before = robot.node.get_clock().now().nanoseconds
    feet.send()
    robot.until(lambda: robot.left and robot.right, 'both poses')
    assert robot.left.stamps()[0] >= before
    robot.left.clear()
    robot.right.clear()


@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'version': 'v2.5'}, "'v2.5' of chain left_leg; did you mean 'v2_5'?"),
        ({'version': 'v1', 'foot_frame': 'toe'}, 'allowed: dh or sole'),
        ({'joint_timeout': float('nan')}, 'joint_timeout'),
        ({'joint_timeout': -0.1}, 'joint_timeout'),
        ({'version': 'v1', 'chains': ['left_leg']}, 'read-only'),
        ({'version': 3}, 'type'),
        ({'versoin': 'v1'}, 'undeclared'),
        ({'version': 'v1', 'joint_timeout': None}, 'cannot be undeclared'),
    ],
    ids=str,
)
def test_bad_set_is_refused_with_a_reason_and_changes_nothing(feet, changes, words):
    result = feet.robot.change(**changes)
    assert not result.successful
    assert words in result.reason
    assert '\n' not in result.reason
    feet.check()
    assert feet.values() == DEFAULTS


def test_qos_is_read_only(feet):
    name = f'qos_overrides.{feet.robot.node.get_namespace()}/joint_states.subscription.depth'
    changes = [Parameter(name, value=1), Parameter('version', value='v1')]
    results = feet.robot.result(feet.robot.parameters().set_parameters(changes)).results
    assert [result.successful for result in results] == [False, True]
    feet.check('v1')


def test_every_parameter_is_described(feet):
    client = feet.robot.parameters()
    names = feet.robot.result(client.list_parameters()).result.names
    own = {name for name in names if not name.startswith('qos_overrides.')}
    # test_launch.py has each of them among the launch file's arguments.
    assert own == {*DEFAULTS, 'use_sim_time', 'start_type_description_service'}
    answer = feet.robot.result(client.describe_parameters(list(DEFAULTS)))
    described = {descriptor.name: descriptor for descriptor in answer.descriptors}
    for descriptor in described.values():
        assert descriptor.description.endswith('.'), descriptor.name
        assert descriptor.additional_constraints, descriptor.name
        assert descriptor.type != ParameterType.PARAMETER_NOT_SET
        assert descriptor.read_only == (descriptor.name in READ_ONLY)
    [bounds] = described['joint_timeout'].floating_point_range
    assert (bounds.from_value, bounds.to_value) == (0.0, 1e6)


def test_no_pose_is_lost_or_mixed_while_parameters_change(feet):
    robot = feet.robot
    settings = list(itertools.product(('v1', 'v2_5', 'v3'), ('dh', 'sole')))
    sent = []
    for version, frame in settings * 3:
        changes = [
            Parameter('version', value=version),
            Parameter('foot_frame', value=frame),
            Parameter('frame_prefix', value=f'{version}/{frame}/'),
        ]
        future = robot.parameters().set_parameters_atomically(changes)
        for _ in range(30):
            sent.append(feet.send())
            robot.spin()
        assert robot.result(future).result.successful
    frame_ids = []
    for tip, (chain, q) in SIDES.items():
        poses = robot.take(robot.poses[tip], sent[-1])
        assert poses.stamps() == sent
        frame_ids.append([pose.header.frame_id for pose in poses])
        for pose in poses:  # its prefix names what it must be computed with
            version, frame, _ = f'v2_5/dh/{pose.header.frame_id}'.split('/')[-3:]
            assert_same_pose(pose, oracle_pose(chain, version, q, frame))
    assert frame_ids[0] == frame_ids[1]
    assert len(set(frame_ids[0])) >= len(settings)


def test_chains_with_versions_of_another_file_are_given_at_start(tmp_path):
    text = config_file('icub_kinematics.yaml').read_text()
    (tmp_path / 'mine.yaml').write_text(text.replace('l_foot_dh_frame', 'l_toe'))
    parameters = {
        'kinematics_file': '~/mine.yaml',
        'chains': ['left_leg=v1', 'right_leg'],
    }
    with NodeProcess(parameters, environment={'HOME': str(tmp_path)}) as node:
        node.wait_for_log(
            'publishing poses of left_foot (left_leg=v1, root_link to l_toe), '
            'right_foot (right_leg=v2_5, root_link to r_foot_dh_frame)'
        )


def test_the_shipped_file_has_every_parameter_at_its_default():
    shipped = yaml.safe_load(config_file('foot_pose_publisher.yaml').read_text())
    assert shipped == {'/**/foot_pose_publisher': {'ros__parameters': DEFAULTS}}
