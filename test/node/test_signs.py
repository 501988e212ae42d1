"""Signs of life in the log of a real node: nothing is silent."""

from contextlib import ExitStack
import time

import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from support.node_harness import BOTH, LOSSLESS, NodeProcess, Robot, SECOND


@pytest.fixture(scope='module')
def nodes():
    """Return nodes that wait for what does not come, side by side for time, and what they say.

    By name: nobody publishes, somebody publishes another type, or other names.
    """
    with ExitStack() as stack:
        nodes = {name: stack.enter_context(NodeProcess()) for name in ('nobody', 'type', 'names')}
        wrong, other = (stack.enter_context(Robot(nodes[name])) for name in ('type', 'names'))
        wrong.node.destroy_publisher(wrong.joints)
        wrong.node.create_publisher(String, 'joint_states', 10)
        sent = [SECOND]

        def all_have_warned():
            sent[0] += SECOND // 100
            other.send(sent[0], ['icub/l_knee', 'R_KNEE', 'wheel'])
            return all('[WARN]' in node.log() for node in nodes.values())
        other.until(all_have_warned, 'warnings')
        yield nodes


def lines(node, severity='WARN'):
    """Return what a node has said, from the text on."""
    return [line.partition('foot_pose_publisher]: ')[2] for line in node.log().splitlines()
            if f'[{severity}]' in line]


def test_the_start_line_tells_what_is_published_and_from_where(nodes):
    node = nodes['nobody']
    assert lines(node, 'INFO') == [
        'publishing poses of left_foot (left_leg v2_5, root_link to l_foot_dh_frame), right_foot '
        '(right_leg v2_5, root_link to r_foot_dh_frame); joint states from '
        f'{node.namespace}/joint_states']


@pytest.mark.parametrize(('name', 'there'), [
    ('nobody', 'no publisher'), ('type', 'no publisher, but one of type std_msgs/msg/String')])
def test_silence_is_told_after_five_seconds_with_its_reason(nodes, name, there):
    node = nodes[name]
    [said] = lines(node)
    topic = f'{node.namespace}/joint_states'
    assert said in [f'no JointState on {topic} for {seconds} s; {there} there'
                    for seconds in range(5, 15)]


def test_names_of_no_chain_are_told_with_those_that_are_near(nodes):
    left, right = lines(nodes['names'])
    assert 'has a joint of left_leg (l_hip_pitch, ' in left
    assert left.endswith("names that came: icub/l_knee, R_KNEE, wheel; 'icub/l_knee' is nearly "
                         "'l_knee', but names must be equal")
    assert right.endswith("'R_KNEE' is nearly 'r_knee', but names must be equal")


def test_first_poses_degrees_and_quarrelling_publishers_are_told_once():
    with NodeProcess({**LOSSLESS, 'publish_twist': True}) as node, Robot(node) as robot:
        second = robot.node.create_publisher(JointState, 'joint_states', 10)
        stamp = robot.connect()
        robot.connect(stamp, publisher=second)
        degrees = [0.0, 0.0, 0.0, -45.0, 0.0, 0.0] * 2

        def said(*texts):
            stamp = time.monotonic_ns()
            robot.send(stamp, BOTH, degrees)
            robot.send(stamp - SECOND, BOTH, degrees, publisher=second)
            log = node.log()
            return all(text in log for text in texts)
        topic = f'{node.namespace}/joint_states'
        robot.until(lambda: said(
            'publishing poses and twists of left_foot',
            f'first pose of left_foot; 2 publishers on {topic}', 'first pose of right_foot',
            f'2 publishers on {topic}, and their stamps step back',
            'left_leg: positions look like degrees, radians are expected: l_knee -45'), node.log)
        began = time.monotonic()
        robot.until(lambda: said() and time.monotonic() > began + 2.5, 'two more looks')
        for text in ('first pose of left_foot', 'their stamps step back',
                     'left_leg: positions look like degrees'):
            assert node.log().count(text) == 1


def test_a_change_of_parameters_is_said_once():
    with NodeProcess() as node, Robot(node) as robot:
        node.wait_for_log('publishing')
        for changes in ({'joint_timeout': 0.2}, {'version': 'v1'}, {'version': 'v3'},
                        {'foot_frame': 'sole'}, {'stamp_source': 'now'}):
            assert robot.change(**changes).successful
        robot.until(lambda: 'l_sole' in node.log(), 'the change')
        *_, last = said = [line for line in lines(node, 'INFO') if 'publishing' in line]
        assert '(left_leg v3, root_link to l_sole)' in last
        assert len(said) <= 4  # each second that had a change
