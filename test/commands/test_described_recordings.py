"""The robot's own URDF in recordings, and a prefix of its joints: bag, poses and plot."""

from pathlib import Path

from icub_leg_fk import add_foot_poses, LegFKError
from icub_leg_fk.tools.recorded_robot import Described
from icub_leg_fk.tools.tracks import read_tracks
import numpy as np
import pytest
from support.bag_files import (
    JOINT_STATE,
    joint_state,
    LEFT_POSE,
    LEGS,
    poses_of,
    read_bag,
    RIGHT_POSE,
    SECOND,
    START,
    STRING,
    string,
    TF,
    walk,
    write_topics,
)
from support.described_robots import own_description, pinocchio_pose
from support.leg_fk_process import assert_one_line_complaint, run_main
from support.robots import joint as a_joint
from support.robots import robot as robot_of

COUNT = 20
MIDDLE = START + SECOND // 10
FIRST = own_description('v2_5')
SECOND_ROBOT = own_description('v1')
CRANE = robot_of([a_joint(0), a_joint(1)])
FEET = {LEFT_POSE: 'l_foot_dh_frame', RIGHT_POSE: 'r_foot_dh_frame'}


@pytest.fixture(autouse=True)
def in_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def bag_of(*descriptions, topic='/robot_description', prefix='', namespace=''):
    """Write a bag of a walk of 0.2 s with descriptions (time, text)."""
    names = [prefix + name for name in LEGS]
    joints = [
        (time, joint_state(time, names, 0.06 * np.sin(i + np.arange(12))))
        for i, (time, _) in enumerate(walk(COUNT))
    ]
    texts = [(time, string(text)) for time, text in descriptions]
    topics = {f'{namespace}/joint_states': (JOINT_STATE, [], joints)}
    if texts:
        topics[topic] = (STRING, [], texts)
    return write_topics(Path('in'), topics)


def assert_poses_of(messages, text_at):
    """Check the poses of a bag beside Pinocchio, with the description that holds at a time."""
    for topic, frame in FEET.items():
        poses = poses_of(messages, topic)
        assert len(poses) == COUNT
        for i, (time, message) in enumerate(poses):
            positions = dict(zip(LEGS, 0.06 * np.sin(i + np.arange(12))))
            T = pinocchio_pose(text_at(time), 'root_link', frame, positions)
            p = message.pose.position
            np.testing.assert_allclose([p.x, p.y, p.z], T[:3, 3], rtol=0, atol=1e-9)


def test_the_first_description_counts_from_the_beginning_wherever_it_is():
    bag_of((START + SECOND, FIRST))
    done = run_main('bag', 'in', 'out', '--description-from-topic', '--tf')
    assert (
        'note: computing with the description of robot_v2_5 on /robot_description'
        in done.stdout
    )
    _, messages = read_bag('out')
    assert_poses_of(messages, lambda time: FIRST)
    assert len(poses_of(messages, '/tf', TF)) == COUNT


def test_another_description_counts_from_its_time_on_in_bag_poses_and_plot():
    """Half a description, sent in between, changes nothing and is reported."""
    bag_of(
        (START, FIRST),
        (START + SECOND // 20, FIRST[:500]),
        (MIDDLE, SECOND_ROBOT),
    )
    summary = add_foot_poses('in', 'out', description_from_topic=True)
    assert summary.warnings[0].startswith(
        'description of the robot 0.050 s after the start not used: /robot_description: '
    )
    assert summary.notes[1] == (
        'from 0.100 s after the start on computing with the description of robot_v1 on '
        '/robot_description'
    )
    _, messages = read_bag('out')
    assert_poses_of(messages, lambda time: SECOND_ROBOT if time >= MIDDLE else FIRST)

    done = run_main('poses', 'in', '-o', 'feet.npz', '--description-from-topic')
    lines = [f'leg_fk: warning: {line}\n' for line in summary.warnings]
    lines += [f'leg_fk: note: {line}\n' for line in summary.notes]
    assert done.stderr == ''.join(lines)
    table = np.load('feet.npz')
    settings = {'chains': ('left_leg', 'right_leg')}
    tracks = read_tracks(['in'], Described(True, None, settings)).tracks
    left = [message.pose.position for _, message in poses_of(messages, LEFT_POSE)]
    expected = [(p.x, p.y, p.z) for p in left]
    found = np.stack([table[f'left_foot_{name}'] for name in 'xyz'], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)
    drawn = np.vstack([t.poses for t in tracks if t.chain.name == 'left_leg'])
    np.testing.assert_allclose(drawn[:, :3], expected, rtol=0, atol=1e-15)
    done = run_main('plot', 'in', '-o', 'x.svg', '--description-from-topic')
    assert done.stdout == 'x.svg: 20 poses of left_foot, 20 poses of right_foot\n'


def test_chains_of_any_robot_are_links_below_a_root():
    write_topics(
        Path('in'),
        {
            '/a/joint_states': (
                JOINT_STATE,
                [],
                [(START, joint_state(START, ['j0', 'j1'], [0.1, 0.2]))],
            ),
            '/a/robot_description': (STRING, [], [(START, string(CRANE))]),
        },
    )
    words = ('--description-from-topic', '--chains', 'l2', '--root', 'l0')
    assert (
        '1  added on /a/foot_pose_publisher/l2/pose'
        in run_main('bag', 'in', 'out', *words).stdout
    )
    assert run_main('poses', 'in', *words).stdout.startswith('time,l2_x,')
    assert_one_line_complaint(
        run_main('poses', 'in', *words[:2], 'l3', *words[3:]),
        'in: no description of the robot can be used: description of the robot 0.000 s '
        "after the start not used: unknown chain 'l3'; known: l2",
    )


def test_a_robot_with_other_tips_or_root_is_not_taken_for_the_same():
    bag_of((START, FIRST), (MIDDLE, FIRST.replace('root_link', 'base')))
    summary = add_foot_poses('in', 'out', description_from_topic=True)
    assert "unknown chain 'left_leg'" in summary.warnings[0]
    assert_poses_of(read_bag('out')[1], lambda time: FIRST)
    write_topics(
        Path('crane'),
        {
            '/joint_states': (
                JOINT_STATE,
                [],
                [(START, joint_state(START, ['j0', 'j1'], [0.1, 0.2]))],
            ),
            '/robot_description': (
                STRING,
                [],
                [(START, string(CRANE)), (START, string(CRANE.replace('l0', 'base')))],
            ),
        },
    )
    settings = {'chains': ['l2'], 'only_poses': True}
    summary = add_foot_poses('crane', 'c', description_from_topic=True, **settings)
    assert (
        'l2 goes from base to l2, and in the one before from l0 to l2; the one before '
        'stays'
    ) in summary.warnings[0]


@pytest.mark.parametrize('command', ['bag', 'poses', 'plot'])
def test_what_cannot_be_is_one_line(command):
    output = {'bag': ['out'], 'poses': [], 'plot': ['-o', 'x.svg']}[command]

    def refused(source, words, *options):
        done = run_main(command, source, *output, *options)
        assert_one_line_complaint(done, words)

    option = '--description-from-topic'
    bag_of((START, FIRST[:500]), topic='/urdf')
    refused(
        'in',
        'in: no description of the robot on /robot_description; topics of type '
        'std_msgs/msg/String are /urdf',
        option,
    )
    refused('in', 'no description of the robot can be used: desc', option, '/urdf')
    refused('in', "--version: found 'v1', allowed", option, '--version', 'v1')
    refused('in', 'goes without a kinematics file', option, '-k', 'robot.urdf')
    refused('in', "found 'urdf', allowed: a topic with a slash", option, 'urdf')
    Path('walk.csv').write_text('time\n0\n')
    refused('walk.csv', f'{option}: walk.csv has no topics', option)


def test_tables_are_held_against_a_description_that_is_there():
    bag_of((START, FIRST))
    summary = add_foot_poses('in', 'out')
    assert summary.warnings == []
    assert summary.notes[0].startswith(
        "left_leg: l_foot_dh_frame is up to 0.00 mm and 0.00 deg off the robot's own"
    )
    done = run_main('poses', 'in', '--version', 'v1', '-o', 'feet.csv')
    assert done.stderr.count('mm and') == 2
    assert (
        '; --description-from-topic computes with the description on /robot_description'
        in done.stderr
    )


def test_joint_names_may_have_a_prefix():
    bag_of((START, FIRST), prefix='icub1/', namespace='/icub1', topic='/icub1/urdf')
    for command in (
        ('bag', 'in', 'no'),
        ('poses', 'in'),
        ('plot', 'in', '-o', 'x.svg'),
    ):
        done = run_main(*command)
        assert_one_line_complaint(
            done, "'icub1/l_hip_pitch' is looked for with --joint-prefix icub1/"
        )
    prefix = ('--joint-prefix', 'icub1/')
    run_main('bag', 'in', 'tables', *prefix)
    run_main('bag', 'in', 'out', '--description-from-topic', '/icub1/urdf', *prefix)
    for name in ('tables', 'out'):
        _, messages = read_bag(name)
        renamed = [(topic.removeprefix('/icub1'), *rest) for topic, *rest in messages]
        assert_poses_of(renamed, lambda time: FIRST)
    for words in (prefix, ('--description-from-topic', '/icub1/urdf', *prefix)):
        assert len(run_main('poses', 'in', *words).stdout.splitlines()) == COUNT + 1
        done = run_main('plot', 'in', '-o', 'x.svg', '--force', *words)
        assert done.stdout == 'x.svg: 20 poses of left_foot, 20 poses of right_foot\n'


def test_columns_of_a_csv_file_may_have_a_prefix():
    for form in ('icub1/{}', '/joint_states/icub1/{}/position'):
        header = ['time', *(form.format(name) for name in LEGS)]
        Path('walk.csv').write_text(f'{",".join(header)}\n0{",0.1" * 12}\n')
        done = run_main('poses', 'walk.csv', '--joint-prefix', 'icub1/')
        assert done.stdout.count('\n') == 2, done.stderr
        done = run_main('poses', 'walk.csv', '--joint-prefix', 'icub2/')
        assert_one_line_complaint(done, 'column icub2/l_hip_pitch, ')
    Path('walk.csv').write_text('time,icub1/l_knee\n0,0\n')
    assert_one_line_complaint(
        run_main('poses', 'walk.csv'), 'is looked for with --joint-prefix icub1/'
    )


def test_the_library_refuses_two_sources():
    bag_of((START, FIRST))
    with pytest.raises(LegFKError, match='goes without a kinematics file'):
        add_foot_poses('in', 'out', kinematics_file='a', description_from_topic=True)
