"""The node and `leg_fk bag` give the same poses on the same messages, bit for bit.

Every message goes to the real node over DDS, and into a bag; what comes back is compared with what
the tool adds to the bag as bytes.
"""

import math
import random

from geometry_msgs.msg import PoseStamped
from icub_leg_fk.tools.add_poses import add_foot_poses
import numpy as np
import pytest
from support.bag_files import (
    joint_state,
    LEGS,
    OTHERS,
    poses_of,
    read_bag,
    recorded_walk,
    SECOND,
    START,
    write_bag,
)
from support.leg_fk_process import leg_fk
from support.node_harness import FEET, LOSSLESS, NodeProcess, Robot
from support.recorded_walk import DATA

BURST = 50


def hostile(count, seed):
    """Return joint states of every good and bad kind, from robots and from strangers."""
    dice = random.Random(seed)
    stamp = START
    names = list(OTHERS[:10] + LEGS + OTHERS[10:])
    for _ in range(count):
        stamp += dice.choice((0, 1_000_000, 1_000_000, 10_000_000, 700_000_000))
        if dice.random() < 0.03:  # a bag loops, or another publisher lags behind
            stamp -= dice.choice((5_000_000, 3 * SECOND))
        kind = dice.choice(('plain', 'plain', 'plain', 'plain', 'shuffled', 'left', 'right', 'few',
                            'short', 'empty', 'twice', 'nan', 'infinite', 'huge', 'cut off',
                            'noise', 'velocities', 'no names', 'longer', 'wide'))
        used = list(names)
        if kind == 'shuffled':
            dice.shuffle(used)
        elif kind in ('left', 'right'):
            used = list(LEGS[:6] if kind == 'left' else LEGS[6:])
        elif kind == 'few':
            used = dice.sample(LEGS, 5)
        elif kind == 'twice':
            used[3] = used[14]
        elif kind == 'no names':
            used = []
        positions = [dice.uniform(-0.8, 0.8) for _ in used]
        if kind == 'short':
            positions = positions[:-2]
        elif kind == 'empty':
            positions = []
        elif kind == 'longer':
            positions.append(0.5)
        elif kind in ('nan', 'infinite', 'huge', 'wide'):
            positions[dice.randrange(10, 22)] = {
                'nan': math.nan, 'infinite': -math.inf, 'huge': 1e200, 'wide': 3.0}[kind]
        velocities = [dice.uniform(-2, 2) for _ in used] if kind == 'velocities' else []
        data = bytearray(joint_state(stamp, used, positions, velocities,
                                     dice.choice(('', 'base_link'))))
        if kind == 'cut off':
            del data[dice.randrange(12, len(data)):]
        elif kind == 'noise':
            place = dice.randrange(12, len(data))
            data[place] = dice.randrange(256)
        yield bytes(data)


class Exchange:
    """The node, and what it makes of messages.

    Attributes:
        sent: all messages sent, to become a bag.
    """

    def __init__(self, node):
        self.sent = []
        self._robot = Robot(node, tips=())
        self._poses = {tip: [] for tip in FEET}
        for tip, poses in self._poses.items():
            self._robot.node.create_subscription(
                PoseStamped, f'foot_pose_publisher/{tip}/pose', poses.append, 5000, raw=True)

    def __enter__(self):
        self._robot.__enter__()
        return self

    def __exit__(self, *error):
        self._robot.__exit__(*error)

    def send(self, data):
        self.sent.append(data)
        self._robot.joints.publish(data)
        self._robot.spin()

    def meet(self, stamp):
        """Send whole messages until one is answered on all topics; return the last stamp."""
        for _ in range(400):
            stamp += 1000
            self.send(joint_state(stamp))
            for _ in range(5):
                self._robot.spin(0.01)
            if self.answered(stamp):
                return stamp
        raise AssertionError('the node does not answer')

    def answered(self, stamp):
        """Return whether the newest pose of each foot has this stamp."""
        wanted = np.array(divmod(stamp, SECOND), dtype='<u4').tobytes()
        return all(poses and bytes(poses[-1])[4:12] == wanted for poses in self._poses.values())

    def wait_for(self, stamp):
        self._robot.until(lambda: self.answered(stamp), f'the answer to {stamp}')

    def poses(self):
        return {tip: [bytes(data) for data in poses] for tip, poses in self._poses.items()}


def exchange(messages, parameters):
    """Return all messages sent to a node, those at first to meet it too, and its answers."""
    with NodeProcess({**LOSSLESS, **parameters}) as node, Exchange(node) as talk:
        stamp = talk.meet(START - 60 * SECOND)
        for number, data in enumerate(messages, 1):
            talk.send(data)
            if number % BURST == 0:  # a good message, whose answer shows that all are through
                stamp = START + (number + 10_000) * SECOND
                talk.send(joint_state(stamp))
                talk.wait_for(stamp)
        talk.send(joint_state(stamp + SECOND))
        talk.wait_for(stamp + SECOND)
        return talk.sent, talk.poses()


def poses_by_tool(tmp_path, sent, *options):
    """Return the bytes of the poses that `leg_fk bag` gives, by tip."""
    joints = [(START + 1000 * i, data) for i, data in enumerate(sent)]
    write_bag(tmp_path / 'in', joints=joints, others=False)
    done = leg_fk('bag', tmp_path / 'in', tmp_path / 'out', *options)
    assert (done.returncode, done.stderr) == (0, ''), done
    _, messages = read_bag(tmp_path / 'out')
    for tip in FEET:  # every one of them is a message that other libraries can read
        poses_of(messages, f'/foot_pose_publisher/{tip}/pose')
    return {tip: [data for topic, _, data in messages
                  if topic == f'/foot_pose_publisher/{tip}/pose'] for tip in FEET}, done.stdout


def assert_same(by_tool, by_node):
    """Compare poses as bytes; the first messages may have been sent before the node was met."""
    for tip in FEET:
        assert len(by_node[tip]) > 0
        assert by_tool[tip][-len(by_node[tip]):] == by_node[tip]


@pytest.mark.parametrize(('parameters', 'options'), [
    ({}, ()),
    ({'publish_twist': True}, ('--twist',)),
    ({'version': 'v1', 'foot_frame': 'sole', 'frame_prefix': 'icub/', 'joint_timeout': 0.02},
     ('--version', 'v1', '--foot-frame', 'sole', '--frame-prefix', 'icub/', '--joint-timeout',
      '0.02')),
])
def test_hostile_messages_give_the_same_poses_in_the_node_and_in_the_tool(tmp_path, parameters,
                                                                          options):
    messages = list(hostile(1500, seed=len(options)))
    sent, by_node = exchange(messages, parameters)
    by_tool, summary = poses_by_tool(tmp_path, sent, *options)
    assert_same(by_tool, by_node)
    assert len(by_node['left_foot']) > 500
    for reason in ('short_position', 'empty_position', 'duplicate_name', 'malformed',
                   'time steps back', 'non_finite', 'stale_joint'):
        assert reason in summary, summary


def test_a_recorded_walk_gives_the_same_poses_in_the_node_and_in_the_tool(tmp_path):
    messages = [data for _, data in recorded_walk()]
    sent, by_node = exchange(messages, {})
    by_tool, _ = poses_by_tool(tmp_path, sent)
    assert_same(by_tool, by_node)
    assert len(by_node['right_foot']) >= len(messages)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_the_projects_bags_give_the_same_poses_in_the_node_and_in_the_tool(tmp_path, storage):
    source = DATA / f'walk_{storage}'
    sent, by_node = exchange([data for topic, _, data in read_bag(source)[1]
                              if topic == '/joint_states'], {})
    summary = add_foot_poses(source, tmp_path / 'direct')
    direct = [data for topic, _, data in read_bag(tmp_path / 'direct')[1]
              if topic == '/foot_pose_publisher/left_foot/pose']
    assert summary.added == {f'/foot_pose_publisher/{tip}/pose': 25 for tip in FEET}
    assert_same(poses_by_tool(tmp_path, sent)[0], by_node)
    assert set(direct) <= set(by_node['left_foot'])


def test_a_zero_stamp_differs_only_in_the_time_that_is_now(tmp_path):
    """In the node that is the present time, in the tool the time of recording."""
    with NodeProcess(LOSSLESS) as node, Exchange(node) as talk:
        talk.meet(START - 60 * SECOND)
        before = {tip: len(poses) for tip, poses in talk.poses().items()}
        talk.send(joint_state(None))
        talk._robot.until(
            lambda: all(len(poses) > before[tip] for tip, poses in talk.poses().items()),
            'the answer to a zero stamp')
        by_node = talk.poses()
    by_tool, _ = poses_by_tool(tmp_path, talk.sent)
    for tip in FEET:
        node_pose, tool_pose = by_node[tip][-1], by_tool[tip][-1]
        assert node_pose[4:12] != tool_pose[4:12]
        assert node_pose[:4] + node_pose[12:] == tool_pose[:4] + tool_pose[12:]
