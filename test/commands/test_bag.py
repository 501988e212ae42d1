"""`leg_fk bag` copies a bag as it is and adds the poses: every storage and every compression."""

from collections import Counter
import os
import pickle
import shutil

from icub_leg_fk import add_foot_poses
import numpy as np
import pytest
from support.bag_files import (
    ENDINGS,
    entries,
    expected_poses,
    JOINT_STATE,
    joint_state,
    LEFT_POSE,
    LEFT_TWIST,
    LEGS,
    POSE,
    poses_of,
    read_bag,
    RIGHT_POSE,
    RIGHT_TWIST,
    SECOND,
    START,
    STORAGES,
    TF,
    TWIST,
    TYPES,
    walk,
    write_bag,
    write_topics,
)
from support.leg_fk_process import assert_one_line_complaint, leg_fk, run_main
from support.recorded_walk import SHARED
import yaml

HEAD_POSE = '/foot_pose_publisher/head_imu/pose'
HEAD = ('torso_pitch', 'torso_roll', 'torso_yaw', 'neck_pitch', 'neck_roll', 'neck_yaw')
RECORDINGS = SHARED / 'rosbag2_jazzy'
WHOLE = sorted(path.parent for path in RECORDINGS.glob('*/metadata.yaml'))

needs_recordings = pytest.mark.skipif(
    not WHOLE, reason=f'the recordings of rosbag2 are not there: {RECORDINGS}'
)


@pytest.fixture(scope='module', params=STORAGES)
def recorded(request, tmp_path_factory):
    """Return a bag of ten joint states, of each storage."""
    return write_bag(
        tmp_path_factory.mktemp('recorded') / request.param, request.param, walk(10)
    )


def information_of(bag):
    text = (bag / 'metadata.yaml').read_text(encoding='utf-8')
    return yaml.safe_load(text)['rosbag2_bagfile_information']


def edit(bag, old, new):
    """Replace a part of a bag's metadata.yaml, as people do."""
    file = bag / 'metadata.yaml'
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new), encoding='utf-8')


def assert_pose(message, matrix):
    position, q = message.pose.position, message.pose.orientation
    x, y, z, w = q.x, q.y, q.z, q.w
    R = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    np.testing.assert_allclose(
        [position.x, position.y, position.z], matrix[:3, 3], atol=1e-12
    )
    np.testing.assert_allclose(R, matrix[:3, :3], rtol=0, atol=1e-12)


def assert_poses(messages, topic, expected, frame_id='root_link'):
    poses = [message for _, message in poses_of(messages, topic)]
    for message, (stamp, matrix) in zip(poses, expected, strict=True):
        header = message.header
        assert header.stamp.sec * SECOND + header.stamp.nanosec == stamp
        assert header.frame_id == frame_id
        assert_pose(message, matrix)


def assert_copied_with_poses(source, target, joints):
    """Check that a bag holds another one, unchanged and in order, and the poses of both feet."""
    topics, messages = read_bag(source)
    new_topics, new_messages = read_bag(target)
    assert {name: new_topics[name] for name in topics} == topics
    assert set(new_topics) == {*topics, LEFT_POSE, RIGHT_POSE}
    assert [message for message in new_messages if message[0] in topics] == messages
    for leg, topic in (('left_leg', LEFT_POSE), ('right_leg', RIGHT_POSE)):
        times = [time for name, time, _ in new_messages if name == topic]
        assert times == [time for time, _ in joints]
        assert_poses(new_messages, topic, expected_poses(joints, leg))


def order_of(target):
    return [topic for topic, _, _ in read_bag(target)[1]]


def refused(tmp_path, path, words):
    """Check that both `bag` and `plot` refuse a recording, in one line with these words."""
    for command in (
        ('bag', path, tmp_path / 'out'),
        ('plot', path, '-o', tmp_path / 'x.png'),
    ):
        done = run_main(*command)
        assert_one_line_complaint(done, words)
        assert str(path) in done.stderr
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize(
    ('storage', 'compression'),
    [
        ('mcap', None),
        ('mcap', 'message'),
        ('mcap', 'file'),
        ('mcap', 'storage'),
        ('sqlite3', None),
        ('sqlite3', 'message'),
        ('sqlite3', 'file'),
    ],
)
def test_every_kind_of_bag_is_copied_with_poses(tmp_path, storage, compression):
    joints = walk(300)
    write_bag(tmp_path / 'in', storage, joints, compression)
    done = run_main('bag', tmp_path / 'in', tmp_path / 'out')
    assert (done.returncode, done.stderr) == (0, '')
    assert '400  messages copied' in done.stdout
    assert f'300  added on {LEFT_POSE}' in done.stdout
    assert_copied_with_poses(tmp_path / 'in', tmp_path / 'out', joints)
    assert entries(tmp_path) == ['in', 'out']
    assert entries(tmp_path / 'out') == ['metadata.yaml', f'out{ENDINGS[storage]}']


def test_poses_stand_right_after_their_joint_state(tmp_path, recorded):
    add_foot_poses(recorded, tmp_path / 'out')
    order = order_of(tmp_path / 'out')
    assert order[:5] == [
        '/joint_states',
        LEFT_POSE,
        RIGHT_POSE,
        '/text',
        '/joint_states',
    ]
    for place, topic in enumerate(order):
        if topic == '/joint_states':
            _, *after = order[place:]
            assert after[:2] == [LEFT_POSE, RIGHT_POSE]


@pytest.mark.parametrize('storage', STORAGES)
def test_storage_is_what_was_asked_for(tmp_path, recorded, storage):
    ending = ENDINGS[storage]
    add_foot_poses(recorded, tmp_path / 'out', storage=storage)
    assert_copied_with_poses(recorded, tmp_path / 'out', walk(10))
    assert entries(tmp_path / 'out') == ['metadata.yaml', f'out{ending}']
    (file,) = recorded.glob('*.[md][cb]*')
    add_foot_poses(file, tmp_path / f'file{ending}')
    assert_copied_with_poses(recorded, tmp_path / f'file{ending}', walk(10))
    assert entries(tmp_path) == [f'file{ending}', 'out']


@pytest.mark.parametrize('compression', [None, 'file', 'message'])
@pytest.mark.parametrize('storage', STORAGES)
def test_split_bags_become_one(tmp_path, storage, compression):
    """Eleven files, so that bag_10 must not come before bag_2."""
    joints = walk(220)
    split = tmp_path / 'split'
    split.mkdir()
    names = []
    for part in range(11):
        start, end = 20 * part, 20 * part + 20
        piece = write_bag(
            tmp_path / f'part_{part}', storage, joints[start:end], compression
        )
        (file,) = (path for path in piece.iterdir() if path.name != 'metadata.yaml')
        names.append(f'split_{part}.{file.name.partition(".")[2]}')
        file.rename(split / names[-1])
    information = information_of(tmp_path / 'part_0')
    information |= {'relative_file_paths': names, 'message_count': 297, 'files': []}
    for entry in information['topics_with_message_count']:
        entry['message_count'] *= 11
    metadata = {'rosbag2_bagfile_information': information}
    (split / 'metadata.yaml').write_text(yaml.safe_dump(metadata))
    assert add_foot_poses(split, tmp_path / 'out').notes == []
    assert_copied_with_poses(split, tmp_path / 'out', joints)


def test_chains_versions_frames_and_prefix_are_those_asked_for(tmp_path):
    joints = walk(20, names=LEGS + HEAD)
    write_bag(tmp_path / 'in', joints=joints)
    done = run_main(
        'bag',
        tmp_path / 'in',
        tmp_path / 'out',
        '--chains',
        'right_leg',
        'head_imu=v2',
        '--version',
        'v1',
        '--foot-frame',
        'sole',
        '--frame-prefix',
        'icub/',
    )
    assert 'head_imu has no sole' in done.stdout
    topics, messages = read_bag(tmp_path / 'out')
    assert LEFT_POSE not in topics
    feet = expected_poses(joints, 'right_leg', 'v1', 'sole')
    assert_poses(messages, RIGHT_POSE, feet, 'icub/root_link')
    assert_poses(
        messages,
        HEAD_POSE,
        expected_poses(joints, 'head_imu', 'v2', None),
        'icub/root_link',
    )


def test_only_poses_leaves_everything_else_out(tmp_path, recorded):
    add_foot_poses(recorded, tmp_path / 'all')
    add_foot_poses(recorded, tmp_path / 'out', only_poses=True)
    topics, messages = read_bag(tmp_path / 'out')
    assert set(topics) == {LEFT_POSE, RIGHT_POSE}
    _, everything = read_bag(tmp_path / 'all')
    assert messages == [message for message in everything if message[0] in topics]


def test_twists_are_those_of_the_moving_feet(tmp_path):
    """Against central differences of the poses; velocities in these bags are true ones."""
    joints = walk(400, rate=1000.0)
    write_bag(tmp_path / 'in', joints=joints)
    add_foot_poses(tmp_path / 'in', tmp_path / 'out', twist=True)
    topics, messages = read_bag(tmp_path / 'out')
    assert topics[LEFT_TWIST][0] == TWIST
    twists = [message for _, message in poses_of(messages, LEFT_TWIST, TWIST)]
    matrices = np.array([matrix for _, matrix in expected_poses(joints)])
    for before, matrix, after, message in zip(
        matrices, matrices[1:], matrices[2:], twists[1:]
    ):
        linear, angular = message.twist.linear, message.twist.angular
        difference = (after - before) / 0.002
        spin = difference[:3, :3] @ matrix[:3, :3].T
        np.testing.assert_allclose(
            [linear.x, linear.y, linear.z], difference[:3, 3], atol=1e-5
        )
        np.testing.assert_allclose(
            [angular.x, angular.y, angular.z],
            [spin[2, 1], spin[0, 2], spin[1, 0]],
            atol=1e-4,
        )
        assert message.header.frame_id == 'root_link'


def test_no_velocities_give_no_twist_and_are_counted(tmp_path):
    unknown = [0.1] * 3 + [float('nan')] + [0.1] * 8
    joints = [
        (START + i, joint_state(START + i, velocities=[0.1] * 12 if i % 2 else unknown))
        for i in range(10)
    ]
    write_bag(tmp_path / 'in', joints=joints, others=False)
    summary = add_foot_poses(tmp_path / 'in', tmp_path / 'out', twist=True)
    assert summary.added == {
        LEFT_POSE: 10,
        LEFT_TWIST: 5,
        RIGHT_POSE: 10,
        RIGHT_TWIST: 10,
    }
    assert Counter(order_of(tmp_path / 'out')) == {'/joint_states': 10, **summary.added}
    assert summary.held_back == {'left_leg': {'no_velocity': 5}, 'right_leg': {}}
    assert 'left_leg: no twist from 5 messages' in summary.warnings[0]
    assert 'l_knee' in summary.warnings[0]


def test_tf_gets_the_same_transforms(tmp_path, recorded):
    add_foot_poses(recorded, tmp_path / 'out', tf=True)
    topics, messages = read_bag(tmp_path / 'out')
    assert topics['/tf'][0] == TF
    left = poses_of(messages, LEFT_POSE)
    for (_, pose), (_, sent) in zip(left, poses_of(messages, '/tf', TF), strict=True):
        transform, other = sent.transforms
        assert transform.child_frame_id == 'l_foot_dh_frame'
        assert other.child_frame_id == 'r_foot_dh_frame'
        assert transform.header == pose.header
        t, r = transform.transform.translation, transform.transform.rotation
        p, q = pose.pose.position, pose.pose.orientation
        assert (t.x, t.y, t.z, r.x, r.y, r.z, r.w) == (
            p.x,
            p.y,
            p.z,
            q.x,
            q.y,
            q.z,
            q.w,
        )


def test_tf_joins_a_tf_topic_that_is_there(tmp_path, recorded):
    """The joint states of a bag on one topic, its own transforms on /tf: both stay."""
    add_foot_poses(recorded, tmp_path / 'in', tf=True, chains=['left_leg'])
    add_foot_poses(
        tmp_path / 'in',
        tmp_path / 'poses',
        tf=True,
        chains=['right_leg'],
        only_poses=True,
    )
    assert order_of(tmp_path / 'poses') == [RIGHT_POSE, '/tf'] * 10
    add_foot_poses(tmp_path / 'in', tmp_path / 'out', tf=True, chains=['right_leg'])
    assert frames_on('/tf', tmp_path / 'out') == {
        'l_foot_dh_frame': 10,
        'r_foot_dh_frame': 10,
    }


def frames_on(topic, bag):
    """Return how often each frame is on a topic of transforms."""
    _, messages = read_bag(bag)
    counts = Counter()
    for _, message in poses_of(messages, topic, TF):
        counts.update(transform.child_frame_id for transform in message.transforms)
    return counts


def test_transforms_that_are_there_already_are_refused_or_replaced(tmp_path, recorded):
    add_foot_poses(recorded, tmp_path / 'once', tf=True)
    done = run_main('bag', tmp_path / 'once', tmp_path / 'twice', '--tf')
    assert_one_line_complaint(
        done,
        '/tf with l_foot_dh_frame, r_foot_dh_frame already; --replace-poses leaves',
    )
    add_foot_poses(tmp_path / 'once', tmp_path / 'twice', tf=True, replace_poses=True)
    assert read_bag(tmp_path / 'twice')[1] == read_bag(tmp_path / 'once')[1]
    summary = add_foot_poses(
        tmp_path / 'once',
        tmp_path / 'left',
        tf=True,
        replace_poses=True,
        chains=['left_leg'],
    )
    assert f'left out: {LEFT_POSE} of the recording' in summary.notes
    assert 'left out: /tf with l_foot_dh_frame of the recording' in summary.notes
    assert frames_on('/tf', tmp_path / 'left') == {
        'l_foot_dh_frame': 10,
        'r_foot_dh_frame': 10,
    }


def test_static_transforms_count_and_frames_that_only_contain_ours_do_not(
    tmp_path, recorded
):
    """What comes on /tf displaces in tf2 what a robot_state_publisher put on /tf_static."""
    add_foot_poses(recorded, tmp_path / 'a', tf=True, frame_prefix='a/')
    add_foot_poses(recorded, tmp_path / 'left', tf=True, chains=['left_leg'])
    moving = [row[1:] for row in read_bag(tmp_path / 'a')[1] if row[0] == '/tf']
    fixed = [row[1:] for row in read_bag(tmp_path / 'left')[1] if row[0] == '/tf']
    source = write_topics(
        tmp_path / 'in',
        {
            '/joint_states': (JOINT_STATE, [], walk(10)),
            '/tf': (TF, [], moving),
            '/tf_static': (TF, [], fixed),
        },
    )
    assert_one_line_complaint(
        run_main('bag', source, tmp_path / 'out', '--tf'),
        'in: has /tf_static with l_foot_dh_frame already; --replace-poses',
    )
    summary = add_foot_poses(source, tmp_path / 'out', tf=True, replace_poses=True)
    assert summary.notes == [
        'left out: /tf_static with l_foot_dh_frame of the recording'
    ]
    assert frames_on('/tf_static', tmp_path / 'out') == {}
    assert frames_on('/tf', tmp_path / 'out') == dict.fromkeys(
        [
            'a/l_foot_dh_frame',
            'a/r_foot_dh_frame',
            'l_foot_dh_frame',
            'r_foot_dh_frame',
        ],
        10,
    )


def test_poses_that_are_there_already_are_not_mixed_with_new_ones(tmp_path, recorded):
    add_foot_poses(recorded, tmp_path / 'in')
    assert_one_line_complaint(
        run_main('bag', tmp_path / 'in', tmp_path / 'out'),
        f'{LEFT_POSE}, {RIGHT_POSE} already; --replace-poses leaves',
    )
    add_foot_poses(
        tmp_path / 'in', tmp_path / 'replaced', replace_poses=True, version='v1'
    )
    topics, messages = read_bag(tmp_path / 'replaced')
    assert set(topics) == {'/joint_states', '/text', '/silent', LEFT_POSE, RIGHT_POSE}
    assert len(messages) == 10 * 3 + 4
    assert_poses(messages, LEFT_POSE, expected_poses(walk(10), version='v1'))
    assert (
        add_foot_poses(tmp_path / 'in', tmp_path / 'out', only_poses=True).copied == 0
    )


def test_another_joint_topic_and_its_namespace(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(10), topic='/robot/joints')
    assert_one_line_complaint(
        run_main(
            'bag', tmp_path / 'in', tmp_path / 'out', '--joint-topic', '/joint_states'
        ),
        'no joint states on /joint_states; --joint-topic can be /robot/joints',
    )
    added = add_foot_poses(tmp_path / 'in', tmp_path / 'out').added
    assert added == {f'/robot{LEFT_POSE}': 10, f'/robot{RIGHT_POSE}': 10}
    added = add_foot_poses(tmp_path / 'in', tmp_path / 'root', namespace='').added
    assert added == {LEFT_POSE: 10, RIGHT_POSE: 10}


def test_two_robots_fit_into_one_bag(tmp_path):
    topics = {f'/icub{i}/joint_states': (JOINT_STATE, [], walk(10)) for i in (1, 2)}
    write_topics(tmp_path / 'in', topics)
    add_foot_poses(
        tmp_path / 'in', tmp_path / 'one', joint_topics=['/icub1/joint_states']
    )
    added = add_foot_poses(
        tmp_path / 'one', tmp_path / 'two', joint_topics=['/icub2/joint_states']
    ).added
    assert added == {f'/icub2{LEFT_POSE}': 10, f'/icub2{RIGHT_POSE}': 10}
    _, messages = read_bag(tmp_path / 'two')
    for name in ('/icub1', '/icub2'):
        assert_poses(messages, f'{name}{LEFT_POSE}', expected_poses(walk(10)))


def test_a_zero_stamp_becomes_the_time_of_recording(tmp_path):
    write_bag(tmp_path / 'in', joints=[(START + 7, joint_state(None))], others=False)
    add_foot_poses(tmp_path / 'in', tmp_path / 'out')
    ((time, message),) = poses_of(read_bag(tmp_path / 'out')[1], LEFT_POSE)
    stamp = message.header.stamp
    assert (time, stamp.sec, stamp.nanosec) == (START + 7, START // SECOND, 7)


def test_what_gives_no_pose_is_counted_by_reason_and_said(tmp_path):
    nan = [0.0] * 5 + [float('nan')] + [0.0] * 6
    bad = [
        {},
        {'positions': [0.1] * 11},
        {'positions': [0.1] * 13},
        {'positions': []},
        {'positions': nan},
        {'names': LEGS[:-1] + LEGS[:1]},
        {'names': LEGS[:6]},
    ]
    stamps = [START + 10**7 * i for i in range(9)]
    joints = [
        (stamp, joint_state(stamp, **options)) for stamp, options in zip(stamps, bad)
    ]
    joints.append((stamps[7], joint_state(START - 10**10)))
    joints.append((stamps[8], b'\x00\x01\x00\x00nothing'))
    write_bag(tmp_path / 'in', joints=joints, others=False)
    summary = add_foot_poses(tmp_path / 'in', tmp_path / 'out')
    assert summary.rejected == {
        'position_length': 2,
        'empty_position': 1,
        'duplicate_name': 1,
        'malformed': 1,
        'time_jump': 1,
    }
    assert summary.held_back == {'left_leg': {'non_finite': 1}, 'right_leg': {}}
    assert summary.added == {LEFT_POSE: 3, RIGHT_POSE: 3}
    done = run_main('bag', tmp_path / 'in', tmp_path / 'again')
    for warning in summary.warnings:
        assert f'  warning: {warning}\n' in done.stdout
    for words in (
        '2 messages rejected: position has 13',
        'l_ankle_roll nan',
        'time stepped back',
    ):
        assert words in done.stdout


def test_what_the_node_warns_of_is_said_of_a_recording_too(tmp_path):
    joints = walk(20, names=LEGS)
    degrees = [(time, joint_state(time, positions=[60.0] * 12)) for time, _ in joints]
    two_robots = [
        (time, joint_state(time, frame_id=f'robot{i % 2}/base'))
        for i, (time, _) in enumerate(joints)
    ]
    for name, rows, words in (
        (
            'degrees',
            degrees,
            'positions look like degrees, radians are expected: l_hip_p',
        ),
        ('two_robots', two_robots, "frame ids 'robot0/base' and 'robot1/base'"),
    ):
        source = write_bag(tmp_path / name, joints=rows)
        assert words in run_main('bag', source, tmp_path / f'{name}_out').stdout
        done = run_main('plot', source, '-o', tmp_path / f'{name}.svg')
        assert words in done.stderr


def test_metadata_is_that_of_the_new_bag(tmp_path):
    joints = walk(31)
    source = write_bag(tmp_path / 'in', joints=joints)
    edit(source, 'custom_data:', 'custom_data: {robot: iCubGenova04} #')
    add_foot_poses(source, tmp_path / 'out')
    information = information_of(tmp_path / 'out')
    last = joints[-1][0] + 1000  # a text follows the last joint state
    span = {
        'starting_time': {'nanoseconds_since_epoch': joints[0][0]},
        'duration': {'nanoseconds': last - joints[0][0]},
        'message_count': 31 * 3 + 11,
    }
    expected = {
        **span,
        'files': [{'path': 'out.mcap', **span}],
        'relative_file_paths': ['out.mcap'],
        'custom_data': {'robot': 'iCubGenova04'},
        'version': 9,
        'ros_distro': 'rosbags',
    }
    assert {key: information[key] for key in expected} == expected
    topics = {}
    counts = {}
    for entry in information['topics_with_message_count']:
        name = entry['topic_metadata']['name']
        topics[name] = entry['topic_metadata']
        counts[name] = entry['message_count']
    assert counts == {
        '/joint_states': 31,
        '/text': 11,
        '/silent': 0,
        LEFT_POSE: 31,
        RIGHT_POSE: 31,
    }
    for entry in information_of(source)['topics_with_message_count']:
        assert topics[entry['topic_metadata']['name']] == entry['topic_metadata']
    assert topics[LEFT_POSE]['type_description_hash'] == TYPES.hash_rihs01(POSE)
    assert topics[LEFT_POSE]['offered_qos_profiles'][0]['reliability'] == 'reliable'


@pytest.mark.parametrize(
    ('joints', 'found'),
    [
        ([], 'no message of joint states; left_leg needs l_hip_pitch'),
        (
            [(START, joint_state(START, ['L_KNEE', 'icub/l_knee']))],
            'found: L_KNEE, icub/l_knee',
        ),
    ],
)
def test_a_bag_without_a_joint_of_any_chain_is_refused_with_the_names_found(
    tmp_path, joints, found
):
    write_bag(tmp_path / 'in', joints=joints)
    done = run_main('bag', tmp_path / 'in', tmp_path / 'out')
    assert_one_line_complaint(done, found)
    assert 'l_ankle_roll; right_leg needs r_hip_pitch' in done.stderr
    assert entries(tmp_path) == ['in']


EDITS = {  # of metadata.yaml, as people make them so that a bag plays, or by mistake
    'qos of a topic': ('transient_local', 'volatile'),
    'a count': ('message_count: 4', 'message_count: 7'),
    'name of a topic': ('name: /text', 'name: /words'),
    'type of a topic': ('type: std_msgs/msg/String', 'type: std_msgs/msg/Text'),
    'qos of all': ('offered_qos_profiles:', 'left_out:'),
}


@pytest.mark.parametrize('compression', [None, 'message', 'file'])
@pytest.mark.parametrize('storage', STORAGES)
def test_every_message_is_read_whatever_metadata_says_of_it(
    tmp_path, storage, compression
):
    source = write_bag(tmp_path / 'in', storage, walk(10), compression)
    _, messages = read_bag(source)
    for number, (what, (old, new)) in enumerate(EDITS.items()):
        edited = shutil.copytree(source, tmp_path / f'edited_{number}')
        edit(edited, old, new)
        summary = add_foot_poses(edited, tmp_path / f'out_{number}')
        assert summary.copied == 14, what
        _, copied = read_bag(tmp_path / f'out_{number}')
        assert [
            each for each in copied if each[0] in ('/joint_states', '/text')
        ] == messages
        has_note = any(
            'counts other messages than its files' in note for note in summary.notes
        )
        assert has_note == ('count' in what or 'name' in what), (what, summary.notes)


def test_messages_are_read_whose_type_hash_has_been_edited(tmp_path):
    source = write_bag(tmp_path / 'in', 'sqlite3', walk(10))
    edit(source, 'RIHS01_df668c', 'RIHS01_000000')
    assert add_foot_poses(source, tmp_path / 'out').copied == 14


def test_a_topic_that_metadata_leaves_out_is_read_and_said(tmp_path):
    source = write_bag(tmp_path / 'in', joints=walk(10))
    information = information_of(source)
    del information['topics_with_message_count'][1]
    metadata = {'rosbag2_bagfile_information': information}
    (source / 'metadata.yaml').write_text(yaml.safe_dump(metadata))
    summary = add_foot_poses(source, tmp_path / 'out')
    assert summary.copied == 14
    (note,) = summary.notes
    assert '/text 0 and 4' in note
    done = run_main('plot', source, '-o', tmp_path / 'x.svg')
    assert note in done.stderr


@needs_recordings
@pytest.mark.parametrize('source', WHOLE, ids=lambda path: path.name)
def test_recordings_of_rosbag2_are_taken_message_for_message(tmp_path, source):
    assert len(WHOLE) == 12
    information = information_of(source)
    (count,) = (
        entry['message_count']
        for entry in information['topics_with_message_count']
        if entry['topic_metadata']['name'] == '/joint_states'
    )
    summary = add_foot_poses(source, tmp_path / 'out')
    assert (summary.copied, summary.joint_states) == (
        information['message_count'],
        count,
    )
    assert summary.added == {LEFT_POSE: count, RIGHT_POSE: count}
    assert summary.notes == []
    topics, messages = read_bag(source)
    new_topics, new_messages = read_bag(tmp_path / 'out')
    assert {topic: new_topics[topic] for topic in topics} == topics
    assert [message for message in new_messages if message[0] in topics] == messages
    done = run_main('plot', source, '-o', tmp_path / 'x.svg')
    assert f'{count} poses of left_foot, {count} poses of right_foot' in done.stdout


@needs_recordings
def test_of_killed_recorders_the_sqlite_file_is_taken_and_the_mcap_file_explained(
    tmp_path,
):
    file = RECORDINGS / 'sqlite3_killed' / 'sqlite3_killed_0.db3'
    assert add_foot_poses(file, tmp_path / 'out').joint_states == 98
    shutil.rmtree(tmp_path / 'out')
    refused(
        tmp_path,
        file.parent,
        'metadata.yaml, as when the recorder was killed; give its file '
        f'alone, or let `ros2 bag reindex {file.parent}` write one',
    )
    killed = RECORDINGS / 'mcap_killed'
    refused(tmp_path, killed, 'mcap_killed: mcap_killed_0.mcap in it is empty')
    refused(tmp_path, killed / 'mcap_killed_0.mcap', '_0.mcap: is empty')
    write_bag(tmp_path / 'in', joints=walk(5))
    (tmp_path / 'in' / 'metadata.yaml').unlink()
    refused(tmp_path, tmp_path / 'in', '`mcap recover` mends its file')


def test_what_is_no_recording_of_ros_2_is_called_by_its_name(tmp_path):
    (tmp_path / 'old.bag').write_bytes(b'#ROSBAG V2.0\n' + bytes(50))
    refused(tmp_path, tmp_path / 'old.bag', 'is a ROS 1 bag')
    writer_module = pytest.importorskip('mcap.writer')
    for profile, encoding, words in (
        ('ros1', 'ros1', 'is an MCAP file of ROS 1 messages'),
        ('', 'json', '/joints (json) are not CDR'),
        ('ros2', 'json', '/joints (json) are not CDR'),
    ):
        file = tmp_path / f'{profile}_{encoding}.mcap'
        writer = writer_module.Writer(str(file))
        writer.start(profile)
        channel = writer.register_channel('/joints', encoding, 0)
        writer.add_message(channel, START, b'{}', START)
        writer.finish()
        refused(tmp_path, file, words)
    source = write_bag(tmp_path / 'in', joints=walk(5), others=False)
    edit(source, 'cdr', 'cbor')
    refused(tmp_path, source, 'the messages of /joint_states (cbor) are not CDR')


@pytest.mark.parametrize(
    ('storage', 'mend'),
    [('mcap', '`mcap recover` may'), ('sqlite3', '`ros2 bag reindex` may')],
)
def test_damage_and_missing_files_end_in_one_line_with_what_mends_them(
    tmp_path, storage, mend
):
    source = write_bag(tmp_path / 'in', storage, walk(800))
    file = source / f'in{ENDINGS[storage]}'
    data = file.read_bytes()
    for spoilt, words in (
        (data[: len(data) // 2], mend),
        (data[:20], mend),
        (b'', 'is empty'),
        (b'x' * 5000, 'is not an '),
    ):
        file.write_bytes(spoilt)
        refused(tmp_path, source, words)
        refused(tmp_path, file, words)
    file.unlink()
    refused(tmp_path, source, 'files are missing')
    refused(tmp_path, file, 'there is no such file or directory')


@pytest.mark.parametrize(
    ('old', 'new'),
    [
        ('message_count: 5', 'message_count: five'),
        ('custom_data:', 'custom_data: text\n  more:'),
    ],
)
def test_odd_values_in_metadata_are_refused(tmp_path, old, new):
    source = write_bag(tmp_path / 'in', joints=walk(5))
    edit(source, old, new)
    refused(tmp_path, source, 'metadata.yaml has values of the wrong type')


def test_metadata_of_a_newer_version_is_called_so(tmp_path):
    source = write_bag(tmp_path / 'in', joints=walk(5))
    edit(source, 'version: 9', 'version: 10')
    refused(
        tmp_path,
        source,
        'version 10 not supported; please report issue; a newer rosbags',
    )
    assert add_foot_poses(source / 'in.mcap', tmp_path / 'out').joint_states == 5


def test_metadata_is_read_in_any_locale(tmp_path):
    source = write_bag(tmp_path / 'in', joints=walk(5))
    edit(source, 'custom_data:', 'custom_data: {robot: caf\u00e9} #')
    locale = {'LC_ALL': 'C', 'PYTHONUTF8': '0', 'PYTHONCOERCECLOCALE': '0'}
    done = leg_fk('bag', source, tmp_path / 'out', environment=locale)
    assert (done.returncode, done.stderr) == (0, '')
    assert information_of(tmp_path / 'out')['custom_data'] == {'robot': 'caf\u00e9'}


def test_a_directory_without_a_recording_is_refused(tmp_path):
    (tmp_path / 'empty').mkdir()
    refused(tmp_path, tmp_path / 'empty', 'it is not a rosbag2 recording')


def test_messages_that_wait_in_a_write_ahead_log_are_not_passed_over(tmp_path):
    source = write_bag(tmp_path / 'in', 'sqlite3', joints=walk(5))
    (source / 'in.db3-wal').write_bytes(b'x' * 100)
    refused(tmp_path, source, "sqlite3 in.db3 'PRAGMA wal_checkpoint(TRUNCATE)'")


@pytest.mark.parametrize('name', ['a b', '100%', 'what?', 'a#b', b'caf\xe9'])
def test_awkward_paths_are_opened(tmp_path, recorded, name):
    odd = shutil.copytree(recorded, tmp_path / os.fsdecode(name))
    (file,) = odd.glob('*.[md][cb]*')
    for path in (odd, file):
        summary = add_foot_poses(f'/{path}', tmp_path / 'out', force=True)
        assert summary.joint_states == 10


def test_private_records_of_an_mcap_file_are_passed_over(tmp_path):
    """Kinds 0x80 to 0xFF are anybody's own; readers skip them (MCAP specification)."""
    writer_module = pytest.importorskip('mcap.writer')
    file = tmp_path / 'private.mcap'
    definition, _ = TYPES.generate_msgdef(JOINT_STATE, ros_version=2)
    with file.open('wb') as stream:
        writer = writer_module.Writer(stream, use_chunking=False)
        writer.start('ros2')
        schema = writer.register_schema(JOINT_STATE, 'ros2msg', definition.encode())
        channel = writer.register_channel('/joint_states', 'cdr', schema)
        for i in range(10):
            writer.add_message(channel, START + i, joint_state(START + i), START + i)
            stream.write(b'\x80' + (3).to_bytes(8, 'little') + b'abc')
        writer.finish()
    assert add_foot_poses(file, tmp_path / 'out').joint_states == 10


def test_a_type_hash_that_is_not_recorded_comes_from_the_definition(tmp_path):
    source = write_bag(tmp_path / 'in', joints=walk(5))
    assert add_foot_poses(source / 'in.mcap', tmp_path / 'out').notes == []
    for entry in information_of(tmp_path / 'out')['topics_with_message_count']:
        about = entry['topic_metadata']
        assert about['type_description_hash'] == TYPES.hash_rihs01(about['type'])


def test_add_foot_poses_can_be_sent_to_other_processes(tmp_path, recorded):
    again, arguments = pickle.loads(pickle.dumps((add_foot_poses, {'version': 'v1'})))
    summary = again(recorded, tmp_path / 'out', **arguments)
    assert pickle.loads(pickle.dumps(summary)) == summary
    assert summary.added == {LEFT_POSE: 10, RIGHT_POSE: 10}
