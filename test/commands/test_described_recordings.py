"""The robot's own URDF in recordings, and a prefix of its joints: bag, poses and plot."""

from pathlib import Path

from icub_leg_fk import add_foot_poses, LegFKError
from icub_leg_fk.kinematics import Pose
from icub_leg_fk.tools.recorded_robot import Described
from icub_leg_fk.tools.tracks import read_tracks
import numpy as np
import pytest
from support.bag_files import (
    JOINT_STATE,
    joint_state,
    LEFT_POSE,
    LEGS,
    numbers_of,
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
from support.node_oracle import pose_matrix
from support.robots import joint as a_joint
from support.robots import robot as robot_of

OPTION = '--description-from-topic'
COUNT = 20
POSITIONS = 0.06 * np.sin(np.arange(COUNT)[:, None] + np.arange(12))
MIDDLE = START + SECOND // 10
FIRST = own_description('v2_5')
SECOND_ROBOT = own_description('v1')
CRANE = robot_of([a_joint(0), a_joint(1)])
DRAWN = 'x.svg: 20 poses of left_foot, 20 poses of right_foot\n'
FEET = {LEFT_POSE: 'l_foot_dh_frame', RIGHT_POSE: 'r_foot_dh_frame'}


@pytest.fixture(autouse=True)
def in_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def bag_of(*descriptions, topic='/robot_description', prefix='', namespace=''):
    """Write a bag of a walk of 0.2 s with descriptions (time, text)."""
    names = [prefix + name for name in LEGS]
    joints = [
        (time, joint_state(time, names, q))
        for (time, _), q in zip(walk(COUNT), POSITIONS)
    ]
    write(joints, descriptions, topic, namespace)


def crane_of(*descriptions):
    write([(START, joint_state(START, ['j0', 'j1'], [0.1, 0.2]))], descriptions)


def write(joints, descriptions, topic='/robot_description', namespace=''):
    topics = {f'{namespace}/joint_states': (JOINT_STATE, [], joints)}
    texts = [(time, string(text)) for time, text in descriptions]
    write_topics('in', {**topics, topic: (STRING, [], texts)})


def assert_poses_of(bag, text_at, namespace=''):
    """Check the poses of a bag beside Pinocchio, with the description that holds at a time."""
    _, messages = read_bag(bag)
    for topic, frame in FEET.items():
        poses = poses_of(messages, namespace + topic)
        for (time, message), q in zip(poses, POSITIONS, strict=True):
            text = text_at(time)
            T = pinocchio_pose(text, 'root_link', frame, dict(zip(LEGS, q)))
            found = pose_matrix(message.pose)
            np.testing.assert_allclose(found, T, rtol=0, atol=1e-9)


def test_the_first_description_counts_from_the_beginning_wherever_it_is():
    bag_of((START + SECOND, FIRST))
    done = run_main('bag', 'in', 'out', OPTION, '--tf')
    said = 'note: computing with the description of robot_v2_5 on /robot_description'
    assert said in done.stdout
    assert_poses_of('out', lambda time: FIRST)
    assert len(poses_of(read_bag('out')[1], '/tf', TF)) == COUNT


def test_another_description_counts_from_its_time_on_in_bag_poses_and_plot():
    """Half a description, sent in between, changes nothing and is reported."""
    half = FIRST[:500]
    bag_of((START, FIRST), (START + SECOND // 20, half), (MIDDLE, SECOND_ROBOT))
    summary = add_foot_poses('in', 'out', description_from_topic=True)
    assert summary.warnings[0].startswith(
        'description of the robot 0.050 s after the start not used: /robot_description: '
    )
    assert summary.notes[1] == (
        'from 0.100 s after the start on computing with the description of robot_v1 on '
        '/robot_description'
    )
    assert_poses_of('out', lambda time: SECOND_ROBOT if time >= MIDDLE else FIRST)

    done = run_main('poses', 'in', '-o', 'feet.npz', OPTION)
    lines = [f'leg_fk: warning: {line}\n' for line in summary.warnings]
    lines += [f'leg_fk: note: {line}\n' for line in summary.notes]
    assert done.stderr == ''.join(lines)
    left = poses_of(read_bag('out')[1], LEFT_POSE)
    expected = [numbers_of(message.pose) for _, message in left]
    table = np.load('feet.npz')
    found = [table[f'left_foot_{name}'] for name in Pose._fields]
    np.testing.assert_allclose(np.transpose(found), expected, rtol=0, atol=1e-15)
    described = Described(True, None, {'chains': ['left_leg']})
    tracks = read_tracks(['in'], described).tracks
    drawn = np.vstack([track.poses for track in tracks])
    np.testing.assert_allclose(drawn, expected, rtol=0, atol=1e-15)
    assert run_main('plot', 'in', '-o', 'x.svg', OPTION).stdout == DRAWN


def test_chains_of_any_robot_are_links_below_a_root():
    crane_of((START, CRANE))
    words = ('in', OPTION, '--root', 'l0', '--chains')
    done = run_main('bag', *words, 'l2', '--out-dir', 'out')
    assert '1  added on /foot_pose_publisher/l2/pose' in done.stdout
    assert run_main('poses', *words, 'l2').stdout.startswith('time,l2_x,')
    assert_one_line_complaint(
        run_main('poses', *words, 'l3'),
        'in: description of the robot 0.000 s '
        "after the start not used: unknown chain 'l3'; known: l2",
    )


@pytest.mark.parametrize(
    ('chain', 'fault'),
    [
        ('l2', 'l2 goes from base to l2, and in the one before from l0 to l2; the one'),
        ('l1', "unknown chain 'l1'"),
    ],
)
def test_a_robot_with_other_links_or_root_is_not_taken_for_the_same(chain, fault):
    other = CRANE.replace('l0', 'base').replace('l1', 'arm')
    crane_of((START, CRANE), (START, other))
    summary = add_foot_poses('in', 'out', description_from_topic=True, chains=[chain])
    assert fault in summary.warnings[0]
    assert summary.added == {f'/foot_pose_publisher/{chain}/pose': 1}


@pytest.mark.parametrize('command', ['bag', 'poses', 'plot'])
def test_what_cannot_be_is_one_line(command):
    output = {'bag': ['out'], 'poses': [], 'plot': ['-o', 'x.svg']}[command]
    bag_of((START, FIRST[:500]), topic='/urdf')
    Path('walk.csv').write_text('time\n0\n')
    for source, words, complaint in (
        (
            'in',
            '',
            'in: no description of the robot on /robot_description; topics of type '
            'std_msgs/msg/String: /urdf',
        ),
        (
            'in',
            '/urdf',
            'in: description of the robot 0.000 s after the start not used: /u',
        ),
        ('in', '--version v1', "--version: found 'v1', allowed"),
        ('in', '-k robot.urdf', 'goes without a kinematics file'),
        ('in', 'urdf', "found 'urdf', allowed: a topic with a slash"),
        ('walk.csv', '', f'{OPTION}: walk.csv has no topics'),
    ):
        done = run_main(command, source, *output, OPTION, *words.split())
        assert_one_line_complaint(done, complaint)


def test_tables_are_held_against_a_description_that_is_there():
    bag_of((START, FIRST))
    summary = add_foot_poses('in', 'out')
    assert summary.warnings == []
    assert summary.notes[0].startswith(
        "left_leg: l_foot_dh_frame is up to 0.00 mm and 0.00 deg off the robot's own"
    )
    done = run_main('poses', 'in', '--version', 'v1', '-o', 'feet.csv')
    assert done.stderr.count('mm and') == 2
    way = f'; {OPTION} computes with the description on /robot_description'
    assert way in done.stderr


def test_joint_names_may_have_a_prefix():
    bag_of((START, FIRST), prefix='icub1/', namespace='/icub1', topic='/icub1/urdf')
    for words in ('bag in no', 'poses in', 'plot in'):
        assert_one_line_complaint(
            run_main(*words.split()),
            "'icub1/l_hip_pitch' is looked for with --joint-prefix icub1/",
        )
    for words in ((), (OPTION, '/icub1/urdf')):
        words = ('in', '--joint-prefix', 'icub1/', *words)
        run_main('bag', *words, '--out-dir', 'out', '--force')
        assert_poses_of('out/in', lambda time: FIRST, '/icub1')
        assert len(run_main('poses', *words).stdout.splitlines()) == COUNT + 1
        assert run_main('plot', *words, '-o', 'x.svg', '--force').stdout == DRAWN


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
