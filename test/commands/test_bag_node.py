"""The node and `leg_fk bag` give the same poses on the same messages, bit for bit.

Every message goes to the real node over DDS, and into a bag; what comes back is compared with what
the tool adds to the bag as bytes.
"""

from itertools import islice
import math
import random

from geometry_msgs.msg import PoseStamped
from icub_leg_fk import add_foot_poses
from icub_leg_fk.stream.joint_input import REJECTIONS, TIME_JUMP
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
from support.node_harness import FEET, LOSSLESS, NodeProcess, Robot
from support.recorded_walk import DATA

BURST = 50
BEFORE = START - 60 * SECOND
NAMES = OTHERS[:10] + LEGS + OTHERS[10:]
KINDS = (
    'plain',
    'plain',
    'plain',
    'plain',
    'shuffled',
    'left',
    'right',
    'few',
    'twice',
    'no names',
    'short',
    'long',
    'empty',
    'nan',
    'infinite',
    'huge',
    'wide',
    'velocities',
    'cut off',
    'noise',
)
VALUES = {'nan': math.nan, 'infinite': -math.inf, 'huge': 1e200, 'wide': 3.0}


def hostile(seed):
    """Yield joint states of every good and bad kind, from robots and from strangers."""
    dice = random.Random(seed)
    stamp = START
    while True:
        stamp += dice.choice((0, 1_000_000, 1_000_000, 10_000_000, 700_000_000))
        if dice.random() < 0.03:  # a bag loops, or another publisher lags behind
            stamp -= dice.choice((5_000_000, 3 * SECOND))
        kind = dice.choice(KINDS)
        names = names_of(kind, dice)
        positions = positions_of(kind, names, dice)
        velocities = []
        if kind == 'velocities':
            velocities = [dice.uniform(-2, 2) for _ in names]
        frame_id = dice.choice(('', 'base_link'))
        data = joint_state(stamp, names, positions, velocities, frame_id)
        place = dice.randrange(12, len(data))
        if kind == 'cut off':
            data = data[:place]
        elif kind == 'noise':
            data = data[:place] + bytes([dice.randrange(256)]) + data[place + 1 :]
        yield data


def names_of(kind, dice):
    choices = {
        'shuffled': dice.sample(NAMES, len(NAMES)),
        'left': LEGS[:6],
        'right': LEGS[6:],
        'few': dice.sample(LEGS, 5),
        'twice': (*NAMES[:-1], NAMES[12]),
        'no names': (),
    }
    return choices.get(kind, NAMES)


def positions_of(kind, names, dice):
    positions = [dice.uniform(-0.8, 0.8) for _ in names]
    if kind in VALUES:
        positions[dice.randrange(10, 22)] = VALUES[kind]
    choices = {'short': positions[:-2], 'long': [*positions, 0.5], 'empty': []}
    return choices.get(kind, positions)


class Exchange:
    """A node, and what it makes of messages.

    Attributes:
        sent: all messages sent, to become a bag.
        poses: of each tip the bytes of the poses that came.
    """

    def __init__(self, node):
        self.sent = []
        self.poses = {tip: [] for tip in FEET}
        self.robot = Robot(node, tips=())
        for tip, poses in self.poses.items():
            self.robot.node.create_subscription(
                PoseStamped,
                f'foot_pose_publisher/{tip}/pose',
                poses.append,
                5000,
                raw=True,
            )

    def send(self, data):
        self.sent.append(data)
        self.robot.joints.publish(data)
        self.robot.spin()

    def meet(self):
        """Send whole messages until one is answered on all topics."""
        for i in range(400):
            self.send(joint_state(BEFORE + 1000 * i))
            for _ in range(5):
                self.robot.spin(0.01)
            if self.is_answered(BEFORE + 1000 * i):
                return
        raise AssertionError('the node does not answer')

    def is_answered(self, stamp):
        """Return whether the newest pose of each foot has this stamp."""
        wanted = np.array(divmod(stamp, SECOND), dtype='<u4').tobytes()
        return all(
            poses and bytes(poses[-1])[4:12] == wanted for poses in self.poses.values()
        )

    def ask(self, stamp):
        """Send a whole message and wait for its answer: all that was sent before is through."""
        self.send(joint_state(stamp))
        self.robot.until(lambda: self.is_answered(stamp), f'the answer to {stamp}')


def exchange(messages, parameters):
    """Return all messages sent to a node, those at first to meet it too, and its answers."""
    with NodeProcess({**LOSSLESS, **parameters}) as node:
        talk = Exchange(node)
        with talk.robot:
            talk.meet()
            stamp = START + 10_000 * SECOND
            for number, data in enumerate(messages, 1):
                talk.send(data)
                if number % BURST == 0:
                    talk.ask(stamp + number * SECOND)
            talk.ask(2 * stamp - START)
    return talk.sent, {
        tip: list(map(bytes, poses)) for tip, poses in talk.poses.items()
    }


def poses_by_tool(tmp_path, sent, **settings):
    """Return the bytes of the poses that `leg_fk bag` gives, by tip, and its summary."""
    joints = [(START + 1000 * i, data) for i, data in enumerate(sent)]
    source = write_bag(tmp_path / 'in', joints=joints, others=False)
    summary = add_foot_poses(source, tmp_path / 'out', **settings)
    _, messages = read_bag(tmp_path / 'out')
    by_tip = {}
    for tip in FEET:
        topic = f'/foot_pose_publisher/{tip}/pose'
        assert poses_of(messages, topic)  # which others can read
        by_tip[tip] = data_on(topic, tmp_path / 'out')
    return by_tip, summary


def assert_same(by_tool, by_node):
    """Compare poses as bytes; the first messages may have been sent before the node was met."""
    for tip in FEET:
        count = len(by_node[tip])
        assert count > 0
        assert by_tool[tip][-count:] == by_node[tip]


SOLES = {
    'version': 'v1',
    'foot_frame': 'sole',
    'frame_prefix': 'icub/',
    'joint_timeout': 0.02,
}


@pytest.mark.parametrize(
    ('parameters', 'settings'),
    [({}, {}), ({'publish_twist': True}, {'twist': True}), (SOLES, SOLES)],
)
def test_hostile_messages_give_the_same_poses_in_the_node_and_in_the_tool(
    tmp_path, parameters, settings
):
    messages = list(islice(hostile(seed=len(settings)), 1500))
    sent, by_node = exchange(messages, parameters)
    by_tool, summary = poses_by_tool(tmp_path, sent, **settings)
    assert_same(by_tool, by_node)
    assert len(by_node['left_foot']) > 500
    assert summary.rejected.keys() == {*REJECTIONS, TIME_JUMP}
    assert {'non_finite', 'stale_joint'} <= summary.held_back['left_leg'].keys()


def test_a_recorded_walk_gives_the_same_poses_in_the_node_and_in_the_tool(tmp_path):
    messages = [data for _, data in recorded_walk()]
    sent, by_node = exchange(messages, {})
    by_tool, _ = poses_by_tool(tmp_path, sent)
    assert_same(by_tool, by_node)
    assert len(by_node['right_foot']) >= len(messages)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_the_projects_bags_give_the_same_poses_in_the_node_and_in_the_tool(
    tmp_path, storage
):
    source = DATA / f'walk_{storage}'
    sent, by_node = exchange(data_on('/joint_states', source), {})
    by_tool, _ = poses_by_tool(tmp_path, sent)
    assert_same(by_tool, by_node)
    summary = add_foot_poses(source, tmp_path / 'direct')
    assert summary.added == {f'/foot_pose_publisher/{tip}/pose': 25 for tip in FEET}
    direct = data_on('/foot_pose_publisher/left_foot/pose', tmp_path / 'direct')
    assert {*direct} <= {*by_node['left_foot']}


def data_on(topic, bag):
    return [data for name, _, data in read_bag(bag)[1] if name == topic]


def test_a_zero_stamp_differs_only_in_the_time_that_is_now(tmp_path):
    """In the node that is the present time, in the tool the time of recording."""
    with NodeProcess(LOSSLESS) as node:
        talk = Exchange(node)
        with talk.robot:
            talk.meet()
            counts = {tip: len(poses) for tip, poses in talk.poses.items()}
            talk.send(joint_state(None))
            talk.robot.until(
                lambda: all(
                    len(poses) > counts[tip] for tip, poses in talk.poses.items()
                ),
                'the answer to a zero stamp',
            )
    by_tool, _ = poses_by_tool(tmp_path, talk.sent)
    for tip in FEET:
        node_pose, tool_pose = bytes(talk.poses[tip][-1]), by_tool[tip][-1]
        assert node_pose[4:12] != tool_pose[4:12]
        assert node_pose[:4] + node_pose[12:] == tool_pose[:4] + tool_pose[12:]
