"""The node's parameters, changed while it runs through the standard services."""

from geometry_msgs.msg import PoseStamped
from icub_leg_fk.kinematics.catalog import config_file
import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rclpy.parameter import Parameter, parameter_value_to_python
from support.node_harness import BOTH, FEET, HEAD, LEFT, LOSSLESS, NodeProcess, Robot, SECOND
from support.node_oracle import assert_same_pose, oracle_pose

MS = 1_000_000  # ns
Q = [0.2, 0.1, -0.1, -0.5, -0.3, 0.1, 0.15, 0.05, 0.1, -0.4, -0.2, -0.1]
DEFAULTS = {
    'chains': ['left_leg', 'right_leg'], 'version': 'v2_5', 'left_leg.version': '',
    'right_leg.version': '', 'head_imu.version': '', 'kinematics_file': '', 'foot_frame': 'dh',
    'frame_prefix': '', 'joint_timeout': 0.5, 'stamp_source': 'message', 'publish_tf': False,
    'publish_twist': False, 'publish_markers': False,
}


class Feet:
    """A robot whose every message has a stamp of its own."""

    def __init__(self, robot):
        self.robot = robot
        self.stamp = robot.connect()

    def poses(self):
        """Send one message and return the pose of each foot that answers to it, by tip."""
        self.stamp += MS
        self.robot.send(self.stamp, BOTH, Q)
        return {tip: self.robot.take(self.robot.poses[tip], self.stamp)[-1] for tip in FEET}

    def check(self, left='v2_5', right='v2_5', foot_frame='dh', frame_prefix=''):
        """Check that the feet are those of these versions."""
        poses = self.poses()
        for tip, chain, version, q in (('left_foot', 'left_leg', left, Q[:6]),
                                       ('right_foot', 'right_leg', right, Q[6:])):
            assert_same_pose(poses[tip], oracle_pose(chain, version, q, foot_frame))
            assert poses[tip].header.frame_id == f'{frame_prefix}root_link'


@pytest.fixture(scope='module')
def shared():
    """Return a node, a robot beside it and its feet."""
    with NodeProcess(LOSSLESS) as node, Robot(node) as robot:
        yield node, robot, Feet(robot)


@pytest.fixture
def feet(shared):
    """Return the feet beside a node that has its default parameters."""
    _, robot, feet = shared
    yield feet
    changes = [Parameter(name, value=value) for name, value in DEFAULTS.items()]
    result = robot.result(robot.parameters().set_parameters_atomically(changes)).result
    assert result.successful, result.reason


@pytest.mark.parametrize('changes, expected', [
    ({'version': 'v1'}, {'left': 'v1', 'right': 'v1'}),
    ({'left_leg__version': 'v1'}, {'left': 'v1'}),
    ({'version': 'v1', 'right_leg__version': 'v2_5'}, {'left': 'v1'}),
    ({'foot_frame': 'sole'}, {'foot_frame': 'sole'}),
    ({'frame_prefix': 'icub1/'}, {'frame_prefix': 'icub1/'}),
    ({'foot_frame': 'sole', 'version': 'v3'}, {'left': 'v3', 'right': 'v3', 'foot_frame': 'sole'}),
], ids=str)
def test_change_shows_in_the_very_next_poses(feet, changes, expected):
    feet.check()
    result = feet.robot.change(**changes)
    assert result.successful, result.reason
    feet.check(**expected)


def test_joint_timeout_changes_live(feet):
    feet.poses()
    robot, late = feet.robot, feet.stamp + SECOND
    robot.send(late, LEFT[:3], Q[:3])  # the others are too old now
    assert robot.change(joint_timeout=2.0).successful
    robot.send(late + 1, LEFT[:3], Q[:3])
    assert robot.take(robot.left, late + 1).stamps() == [late + 1]
    feet.stamp = late + 1


def test_stamps_change_live(feet):
    robot = feet.robot
    assert robot.change(stamp_source='now').successful
    before = robot.node.get_clock().now().nanoseconds
    robot.send(feet.stamp)
    robot.until(lambda: robot.left and robot.right, 'both poses')
    assert robot.left.stamps()[0] >= before
    for inbox in robot.poses.values():
        inbox.clear()


def publishers(robot, topic):
    return [info for info in robot.node.get_publishers_info_by_topic(topic)
            if info.node_name == 'foot_pose_publisher']


def test_publishers_of_dropped_chains_go_and_those_of_new_ones_come(shared, feet):
    node, robot, _ = shared
    left, head = node.topic('left_foot/pose'), node.topic('head_imu/pose')
    result = robot.change(chains=['head_imu', 'right_leg'], head_imu__version='v2')
    assert result.successful, result.reason
    robot.until(lambda: not publishers(robot, left), 'left foot gone')
    robot.until(lambda: publishers(robot, head), 'head there')
    inbox = robot.listen(PoseStamped, head)
    feet.stamp = robot.connect(feet.stamp, (*BOTH, *HEAD), [robot.right, inbox])
    assert robot.left == []
    assert robot.change(chains=['left_leg', 'right_leg']).successful
    robot.until(lambda: publishers(robot, left) and not publishers(robot, head), 'feet again')
    feet.stamp = robot.connect(feet.stamp)
    feet.check()


def test_another_kinematics_file_is_taken_and_a_broken_one_refused(shared, feet, tmp_path):
    robot = feet.robot
    text = config_file('icub_kinematics.yaml').read_text()
    longer = tmp_path / 'longer.yaml'
    longer.write_text(text.replace('[0,  0, 1,  -68.1]', '[0,  0, 1, -168.1]'))
    before = feet.poses()['left_foot']
    assert robot.change(kinematics_file=str(longer)).successful
    after = feet.poses()['left_foot']
    assert after.pose.position.y == pytest.approx(before.pose.position.y - 0.1, abs=1e-12)
    broken = tmp_path / 'broken.yaml'
    broken.write_text(text.replace('alpha: -90', 'alpha: left'))
    result = robot.change(kinematics_file=str(broken))
    assert not result.successful
    assert 'left_leg' in result.reason
    assert '\n' not in result.reason
    assert feet.poses()['left_foot'].pose == after.pose


ARM = """
units: {length: mm, angle: deg}
chains:
  arm:
    tip: hand
    root_frame: base
    joints: [lift]
    tip_frames: {dh: {frame: h}}
    versions:
      a:
        T_Ro0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        links:
          - {type: prismatic, a: 0, d: 100, alpha: 0, offset: 0, range: [0, 200]}
"""


def test_kinematics_file_with_other_chains_needs_them_named_at_once(shared, feet, tmp_path):
    node, robot, _ = shared
    file = tmp_path / 'arm.yaml'
    file.write_text(ARM)
    result = robot.change(kinematics_file=str(file))
    assert not result.successful
    assert "unknown chain 'left_leg'; known: arm" in result.reason
    result = robot.change(kinematics_file=str(file), chains=['arm'], version='a')
    assert result.successful, result.reason
    hand = robot.listen(PoseStamped, node.topic('hand/pose'))
    feet.stamp = robot.connect(feet.stamp, ['lift'], [hand])
    assert hand[-1].pose.position.z == pytest.approx(0.1 - 0.01, abs=1e-12)
    assert robot.change(arm__version='a').successful
    result = robot.change(kinematics_file='', chains=['left_leg', 'right_leg'], version='v2_5')
    assert result.successful, result.reason
    feet.stamp = robot.connect(feet.stamp)
    assert not robot.change(arm__version='a').successful  # gone with its chain


def test_parameters_of_a_chain_that_goes_and_comes_back_say_what_holds(tmp_path):
    arm, renamed = tmp_path / 'arm.yaml', tmp_path / 'renamed.yaml'
    arm.write_text(ARM)
    text = config_file('icub_kinematics.yaml').read_text()
    renamed.write_text(text.replace('      v1:\n', '      v1b:\n'))
    with NodeProcess({'left_leg.version': 'v1', **LOSSLESS}) as node, Robot(node) as robot:
        feet = Feet(robot)
        feet.check(left='v1')
        assert robot.change(kinematics_file=str(arm), chains=['arm'], version='a').successful
        assert robot.change(kinematics_file='', chains=['left_leg', 'right_leg'],
                            version='v2_5').successful
        feet.stamp = robot.connect(feet.stamp)
        feet.check()
        values = robot.result(robot.parameters().get_parameters(['left_leg.version'])).values
        assert values[0].string_value == ''
        assert robot.change(kinematics_file=str(renamed)).successful
        described = robot.result(robot.parameters().describe_parameters(['left_leg.version']))
        assert described.descriptors[0].additional_constraints.startswith('v1b, v2_5')


@pytest.mark.parametrize('changes, words', [
    ({'version': 'v2.5'}, ['v1', 'v2_5', 'v3']),
    ({'left_leg__version': 'V1'}, ['v1', 'v2_5', 'v3']),
    ({'head_imu__version': 'v1'}, ['v2']),
    ({'chains': ['left']}, ['left_leg', 'right_leg', 'head_imu']),
    ({'chains': []}, ['left_leg', 'right_leg', 'head_imu']),
    ({'chains': ['left_leg', 'left_leg']}, ['each once']),
    ({'chains': ['head_imu']}, ['v2', 'head_imu.version']),
    ({'foot_frame': 'toe'}, ['dh', 'sole']),
    ({'frame_prefix': 'a b'}, ['printable']),
    ({'joint_timeout': -0.1}, ['joint_timeout', '0']),
    ({'joint_timeout': float('nan')}, ['joint_timeout', '0']),
    ({'joint_timeout': float('inf')}, ['joint_timeout', '0']),
    ({'stamp_source': 'later'}, ['message', 'now']),
    ({'kinematics_file': '/no/such.yaml'}, ['/no/such.yaml']),
    ({'version': 3}, ['type']),
    ({'versoin': 'v1'}, ['undeclared']),
    ({'version': 'v1', 'frame_prefix': 'x/', 'foot_frame': 'toe'}, ['dh', 'sole']),
    ({'use_sim_time': 3}, ['type']),
    ({'version': None}, ['cannot be undeclared']),
    ({'version': 'v1', 'joint_timeout': None}, ['cannot be undeclared']),
    ({'use_sim_time': None}, ['cannot be undeclared']),
], ids=str)
def test_bad_set_is_refused_with_the_choices_and_changes_nothing(feet, changes, words):
    result = feet.robot.change(**changes)
    assert not result.successful
    for word in words:
        assert word in result.reason
    assert '\n' not in result.reason
    feet.check()
    names = list(DEFAULTS)
    values = feet.robot.result(feet.robot.parameters().get_parameters(names)).values
    assert list(map(parameter_value_to_python, values)) == list(DEFAULTS.values())


@pytest.mark.parametrize('kind', [ParameterType.PARAMETER_BOOL_ARRAY,
                                  ParameterType.PARAMETER_BYTE_ARRAY])
def test_empty_list_of_chains_is_refused_whatever_type_it_comes_with(feet, kind):
    client = feet.robot.parameters()
    empty = ParameterMessage(name='chains', value=ParameterValue(type=kind))
    result = feet.robot.result(client.set_parameters_atomically([empty])).result
    assert not result.successful
    assert 'left_leg, right_leg, head_imu' in result.reason


def test_qos_is_read_only(feet):
    name = f'qos_overrides.{feet.robot.node.get_namespace()}/joint_states.subscription.depth'
    result = feet.robot.result(feet.robot.parameters().set_parameters(
        [Parameter(name, value=1), Parameter('version', value='v1')])).results
    assert [entry.successful for entry in result] == [False, True]
    feet.check(left='v1', right='v1')


def test_every_parameter_is_described(feet):
    robot = feet.robot
    names = robot.result(robot.parameters().list_parameters()).result.names
    assert set(DEFAULTS) <= set(names)
    descriptors = {entry.name: entry for entry in robot.result(
        robot.parameters().describe_parameters(names)).descriptors}
    for name in DEFAULTS:
        descriptor = descriptors[name]
        assert descriptor.description.endswith('.'), name
        assert not descriptor.read_only
        bounded = descriptor.additional_constraints or descriptor.floating_point_range
        assert bounded or descriptor.type == ParameterType.PARAMETER_BOOL, name
    for name in names:
        assert descriptors[name].description or name in ('use_sim_time',), name
        assert descriptors[name].read_only == name.startswith(('qos_', 'start_type_')), name
    assert 'such as dh or sole' in descriptors['foot_frame'].additional_constraints
    for version in ('v1', 'v2_5', 'v3'):
        assert version in descriptors['left_leg.version'].additional_constraints
    bounds = descriptors['joint_timeout'].floating_point_range[0]
    assert (bounds.from_value, bounds.to_value) == (0.0, 1e6)


def test_no_pose_is_lost_or_mixed_while_parameters_change(feet):
    robot = feet.robot
    settings = [{'version': version, 'foot_frame': frame, 'frame_prefix': f'{version}_{frame}/'}
                for version in ('v1', 'v2_5', 'v3') for frame in ('dh', 'sole')]
    sent = []
    for change in settings * 3:
        future = robot.parameters().set_parameters_atomically(
            [Parameter(name, value=value) for name, value in change.items()])
        for _ in range(30):
            feet.stamp += MS
            robot.send(feet.stamp, BOTH, Q)
            sent.append(feet.stamp)
            robot.spin()
        assert robot.result(future).result.successful
    allowed = {f'{change["version"]}_{change["foot_frame"]}/root_link': change
               for change in settings} | {'root_link': {'version': 'v2_5', 'foot_frame': 'dh'}}
    frames = []
    for tip, chain, q in (('left_foot', 'left_leg', Q[:6]), ('right_foot', 'right_leg', Q[6:])):
        poses = robot.take(robot.poses[tip], sent[-1])
        assert poses.stamps() == sent
        frames.append([pose.header.frame_id for pose in poses])
        for pose in poses:
            change = allowed[pose.header.frame_id]
            assert_same_pose(pose, oracle_pose(chain, change['version'], q, change['foot_frame']))
    assert frames[0] == frames[1]
    assert len(set(frames[0])) >= len(settings)
