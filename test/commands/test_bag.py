"""`leg_fk bag` copies a bag as it is and adds the poses: every storage and every compression."""

from collections import Counter
import os
from pathlib import Path
import pickle
import shutil

from icub_leg_fk import add_foot_poses
from icub_leg_fk.stream.joint_input import REJECTIONS, TIME_JUMP
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
    numbers_of,
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
from support.node_oracle import assert_same_pose
from support.recorded_walk import SHARED
import yaml

HEAD_POSE = '/foot_pose_publisher/head_imu/pose'
HEAD = ('torso_pitch', 'torso_roll', 'torso_yaw', 'neck_pitch', 'neck_roll', 'neck_yaw')
RECORDINGS = SHARED / 'rosbag2_jazzy'
FRAMES = ('l_foot_dh_frame', 'r_foot_dh_frame')
OF_BOTH = dict.fromkeys(FRAMES, 10)
ADDED = {LEFT_POSE: 10, RIGHT_POSE: 10}
WHOLE = sorted(path.parent for path in RECORDINGS.glob('*/metadata.yaml'))

needs_recordings = pytest.mark.skipif(
    not WHOLE, reason=f'the recordings of rosbag2 are not there: {RECORDINGS}'
)


@pytest.fixture(autouse=True)
def in_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope='module', params=STORAGES)
def recorded(request, tmp_path_factory):
    """Return a bag of ten joint states, of each storage."""
    return write_bag(
        tmp_path_factory.mktemp('recorded') / request.param, request.param, walk(10)
    )


def information_of(bag):
    text = Path(bag, 'metadata.yaml').read_text(encoding='utf-8')
    return yaml.safe_load(text)['rosbag2_bagfile_information']


def write_information(bag, information):
    metadata = {'rosbag2_bagfile_information': information}
    Path(bag, 'metadata.yaml').write_text(yaml.safe_dump(metadata))


def topics_of(bag):
    """Return what metadata.yaml tells of each topic, and how many messages it counts."""
    entries = information_of(bag)['topics_with_message_count']
    about = {entry['topic_metadata']['name']: entry for entry in entries}
    counts = {name: entry['message_count'] for name, entry in about.items()}
    return {name: entry['topic_metadata'] for name, entry in about.items()}, counts


def edit(bag, old, new):
    """Replace a part of a bag's metadata.yaml, as people do."""
    file = Path(bag, 'metadata.yaml')
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new), encoding='utf-8')


def assert_poses(messages, topic, expected, frame_id='root_link'):
    poses = [message for _, message in poses_of(messages, topic)]
    for message, (stamp, matrix) in zip(poses, expected, strict=True):
        header = message.header
        assert header.stamp.sec * SECOND + header.stamp.nanosec == stamp
        assert header.frame_id == frame_id
        assert_same_pose(message, matrix)


def assert_copied(source, target):
    """Check that a bag holds another one, unchanged and in order, and poses of both feet."""
    topics, messages = read_bag(source)
    new_topics, new_messages = read_bag(target)
    assert {name: new_topics[name] for name in topics} == topics
    assert set(new_topics) == {*topics, LEFT_POSE, RIGHT_POSE}
    assert [message for message in new_messages if message[0] in topics] == messages
    return new_messages


def assert_copied_with_poses(source, target, joints):
    """Check that a bag holds another one, and the right poses."""
    messages = assert_copied(source, target)
    for leg, topic in (('left_leg', LEFT_POSE), ('right_leg', RIGHT_POSE)):
        times = [time for name, time, _ in messages if name == topic]
        assert times == [time for time, _ in joints]
        assert_poses(messages, topic, expected_poses(joints, leg))


def order_of(target):
    return [topic for topic, _, _ in read_bag(target)[1]]


def refused(path, words):
    """Check that both `bag` and `plot` refuse a recording, in one line with these words."""
    for command in (('bag', path, 'out'), ('plot', path)):
        done = run_main(*command)
        assert_one_line_complaint(done, words)
        assert str(path) in done.stderr
    assert not Path('out').exists()


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
def test_every_kind_of_bag_is_copied_with_poses(storage, compression):
    joints = walk(300)
    write_bag('in', storage, joints, compression)
    done = run_main('bag', 'in', 'out')
    assert (done.returncode, done.stderr) == (0, '')
    assert '400  messages copied' in done.stdout
    assert f'300  added on {LEFT_POSE}' in done.stdout
    assert_copied_with_poses('in', 'out', joints)
    assert entries('.') == ['in', 'out']
    assert entries('out') == ['metadata.yaml', f'out{ENDINGS[storage]}']


def test_poses_stand_right_after_their_joint_state(recorded):
    add_foot_poses(recorded, 'out')
    order = order_of('out')
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
def test_storage_is_what_was_asked_for(recorded, storage):
    ending = ENDINGS[storage]
    add_foot_poses(recorded, 'out', storage=storage)
    assert_copied_with_poses(recorded, 'out', walk(10))
    assert entries('out') == ['metadata.yaml', f'out{ending}']
    (file,) = recorded.glob('*.[md][cb]*')
    add_foot_poses(file, f'file{ending}')
    assert_copied_with_poses(recorded, f'file{ending}', walk(10))
    assert entries('.') == [f'file{ending}', 'out']


@pytest.mark.parametrize('compression', [None, 'file', 'message'])
@pytest.mark.parametrize('storage', STORAGES)
def test_split_bags_become_one(storage, compression):
    """Eleven files, so that bag_10 must not come before bag_2."""
    joints = walk(220)
    split = Path('split')
    split.mkdir()
    names = []
    for part in range(11):
        start, end = 20 * part, 20 * part + 20
        piece = write_bag(f'part_{part}', storage, joints[start:end], compression)
        (file,) = (path for path in piece.iterdir() if path.name != 'metadata.yaml')
        names.append(f'split_{part}.{file.name.partition(".")[2]}')
        file.rename(split / names[-1])
    information = information_of('part_0')
    information |= {'relative_file_paths': names, 'message_count': 297, 'files': []}
    for entry in information['topics_with_message_count']:
        entry['message_count'] *= 11
    write_information(split, information)
    assert add_foot_poses(split, 'out').notes == []
    assert_copied_with_poses(split, 'out', joints)


def test_chains_versions_frames_and_prefix_are_those_asked_for():
    joints = walk(20, names=LEGS + HEAD)
    write_bag('in', joints=joints)
    words = 'bag in out --version v1 --foot-frame sole --frame-prefix icub/ --chains'
    done = run_main(*words.split(), 'right_leg', 'head_imu=v2')
    assert 'head_imu has no sole' in done.stdout
    topics, messages = read_bag('out')
    assert LEFT_POSE not in topics
    feet = expected_poses(joints, 'right_leg', 'v1', 'sole')
    assert_poses(messages, RIGHT_POSE, feet, 'icub/root_link')
    head = expected_poses(joints, 'head_imu', 'v2', None)
    assert_poses(messages, HEAD_POSE, head, 'icub/root_link')


def test_only_poses_leaves_everything_else_out(recorded):
    add_foot_poses(recorded, 'all')
    add_foot_poses(recorded, 'out', only_poses=True)
    topics, messages = read_bag('out')
    assert set(topics) == {LEFT_POSE, RIGHT_POSE}
    _, everything = read_bag('all')
    assert messages == [message for message in everything if message[0] in topics]


def test_twists_are_those_of_the_moving_feet():
    """Against central differences of the poses; velocities in these bags are true ones."""
    joints = walk(400, rate=1000.0)
    write_bag('in', joints=joints)
    add_foot_poses('in', 'out', twist=True)
    topics, messages = read_bag('out')
    assert topics[LEFT_TWIST][0] == TWIST
    twists = [message for _, message in poses_of(messages, LEFT_TWIST, TWIST)]
    T = np.array([matrix for _, matrix in expected_poses(joints)])
    difference = (T[2:] - T[:-2]) / 0.002
    spin = difference[:, :3, :3] @ T[1:-1, :3, :3].transpose(0, 2, 1)
    found = np.array([numbers_of(message.twist) for message in twists[1:-1]])
    np.testing.assert_allclose(found[:, :3], difference[:, :3, 3], atol=1e-5)
    expected = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    np.testing.assert_allclose(found[:, 3:], expected, atol=1e-4)
    assert {message.header.frame_id for message in twists} == {'root_link'}


def test_no_velocities_give_no_twist_and_are_counted():
    known = [0.1] * 12
    unknown = [0.1] * 3 + [float('nan')] + [0.1] * 8
    joints = [
        (START + i, joint_state(START + i, velocities=velocities))
        for i, velocities in enumerate([unknown, known] * 5)
    ]
    write_bag('in', joints=joints, others=False)
    summary = add_foot_poses('in', 'out', twist=True)
    assert summary.added == {**ADDED, LEFT_TWIST: 5, RIGHT_TWIST: 10}
    assert Counter(order_of('out')) == {'/joint_states': 10, **summary.added}
    assert summary.held_back == {'left_leg': {'no_velocity': 5}, 'right_leg': {}}
    warning = summary.warnings[0]
    assert 'left_leg: no twist from 5 messages' in warning and 'l_knee' in warning


def test_tf_gets_the_same_transforms(recorded):
    add_foot_poses(recorded, 'out', tf=True)
    _, messages = read_bag('out')
    sent = poses_of(messages, '/tf', TF)
    for i, topic in enumerate((LEFT_POSE, RIGHT_POSE)):
        for (_, pose), (_, transforms) in zip(
            poses_of(messages, topic), sent, strict=True
        ):
            transform = transforms.transforms[i]
            assert transform.child_frame_id == FRAMES[i]
            assert transform.header == pose.header
            assert numbers_of(transform.transform) == numbers_of(pose.pose)


def test_tf_joins_a_tf_topic_that_is_there(recorded):
    """The joint states of a bag on one topic, its own transforms on /tf: both stay."""
    add_foot_poses(recorded, 'in', tf=True, chains=['left_leg'])
    right = {'tf': True, 'chains': ['right_leg']}
    add_foot_poses('in', 'poses', only_poses=True, **right)
    assert order_of('poses') == [RIGHT_POSE, '/tf'] * 10
    add_foot_poses('in', 'out', **right)
    assert frames_on('/tf', 'out') == OF_BOTH


def frames_on(topic, bag):
    """Return how often each frame is on a topic of transforms."""
    _, messages = read_bag(bag)
    counts = Counter()
    for _, message in poses_of(messages, topic, TF):
        counts.update(transform.child_frame_id for transform in message.transforms)
    return counts


def test_transforms_that_are_there_already_are_refused_or_replaced(recorded):
    add_foot_poses(recorded, 'once', tf=True)
    assert_one_line_complaint(
        run_main('bag', 'once', 'twice', '--tf'),
        '/tf with l_foot_dh_frame, r_foot_dh_frame already; --replace-poses leaves',
    )
    again = {'tf': True, 'replace_poses': True}
    add_foot_poses('once', 'twice', **again)
    assert read_bag('twice')[1] == read_bag('once')[1]
    notes = add_foot_poses('once', 'left', chains=['left_leg'], **again).notes
    assert f'left out: {LEFT_POSE} of the recording' in notes
    assert 'left out: /tf with l_foot_dh_frame of the recording' in notes
    assert frames_on('/tf', 'left') == OF_BOTH


def test_static_transforms_count_and_frames_that_only_contain_ours_do_not(recorded):
    """What comes on /tf displaces in tf2 what a robot_state_publisher put on /tf_static."""
    add_foot_poses(recorded, 'a', tf=True, frame_prefix='a/')
    add_foot_poses(recorded, 'left', tf=True, chains=['left_leg'])
    topics = {'/joint_states': (JOINT_STATE, [], walk(10))}
    for topic, bag in (('/tf', 'a'), ('/tf_static', 'left')):
        sent = [row[1:] for row in read_bag(bag)[1] if row[0] == '/tf']
        topics[topic] = (TF, [], sent)
    write_topics('in', topics)
    assert_one_line_complaint(
        run_main('bag', 'in', 'out', '--tf'),
        'in: has /tf_static with l_foot_dh_frame already; --replace-poses',
    )
    summary = add_foot_poses('in', 'out', tf=True, replace_poses=True)
    assert summary.notes == [
        'left out: /tf_static with l_foot_dh_frame of the recording'
    ]
    assert frames_on('/tf_static', 'out') == {}
    others = {f'a/{frame}': 10 for frame in FRAMES}
    assert frames_on('/tf', 'out') == {**others, **OF_BOTH}


def test_poses_that_are_there_already_are_not_mixed_with_new_ones(recorded):
    add_foot_poses(recorded, 'in')
    assert_one_line_complaint(
        run_main('bag', 'in', 'out'),
        f'{LEFT_POSE}, {RIGHT_POSE} already; --replace-poses leaves',
    )
    add_foot_poses('in', 'replaced', replace_poses=True, version='v1')
    topics, messages = read_bag('replaced')
    assert set(topics) == {'/joint_states', '/text', '/silent', *ADDED}
    assert len(messages) == 10 * 3 + 4
    assert_poses(messages, LEFT_POSE, expected_poses(walk(10), version='v1'))
    assert add_foot_poses('in', 'out', only_poses=True).copied == 0


def test_another_joint_topic_and_its_namespace():
    write_bag('in', joints=walk(10), topic='/robot/joints')
    assert_one_line_complaint(
        run_main('bag', 'in', 'out', '--joint-topic', '/joint_states'),
        'no joint states on /joint_states; --joint-topic can be /robot/joints',
    )
    added = {f'/robot{topic}': count for topic, count in ADDED.items()}
    assert add_foot_poses('in', 'out').added == added
    assert add_foot_poses('in', 'root', namespace='').added == ADDED


def test_two_robots_fit_into_one_bag():
    source = 'in'
    topics = {f'/icub{i}/joint_states': (JOINT_STATE, [], walk(10)) for i in (1, 2)}
    write_topics(source, topics)
    for topic, target in zip(topics, ('one', 'two')):
        added = add_foot_poses(source, target, joint_topics=[topic]).added
        source = target
    assert added == {f'/icub2{topic}': count for topic, count in ADDED.items()}
    _, messages = read_bag('two')
    for name in ('/icub1', '/icub2'):
        assert_poses(messages, f'{name}{LEFT_POSE}', expected_poses(walk(10)))


def test_a_zero_stamp_becomes_the_time_of_recording():
    write_bag('in', joints=[(START + 7, joint_state(None))], others=False)
    add_foot_poses('in', 'out')
    ((time, message),) = poses_of(read_bag('out')[1], LEFT_POSE)
    stamp = message.header.stamp
    assert (time, stamp.sec, stamp.nanosec) == (START + 7, START // SECOND, 7)


def test_what_gives_no_pose_is_counted_by_reason_and_said():
    bad = [
        {},
        {'positions': [0.1] * 11},
        {'positions': [0.1] * 13},
        {'positions': []},
        {'positions': [0.0] * 5 + [float('nan')] + [0.0] * 6},
        {'names': LEGS[:-1] + LEGS[:1]},
        {'names': LEGS[:6]},
    ]
    joints = [
        (START + i, joint_state(START + i, **options)) for i, options in enumerate(bad)
    ]
    joints.append((START + 7, joint_state(START - 10**10)))
    joints.append((START + 8, b'\x00\x01\x00\x00nothing'))
    write_bag('in', joints=joints, others=False)
    summary = add_foot_poses('in', 'out')
    expected = dict.fromkeys((*REJECTIONS, TIME_JUMP), 1)
    assert summary.rejected == {**expected, 'position_length': 2}
    assert summary.held_back == {'left_leg': {'non_finite': 1}, 'right_leg': {}}
    assert summary.added == {LEFT_POSE: 3, RIGHT_POSE: 3}
    done = run_main('bag', 'in', 'again')
    for warning in summary.warnings:
        assert f'  warning: {warning}\n' in done.stdout
    for words in ('rejected: position has 13', 'l_ankle_roll nan', 'time stepped back'):
        assert words in done.stdout


def test_what_the_node_warns_of_is_said_of_a_recording_too():
    times = [time for time, _ in walk(20)]
    degrees = [(time, joint_state(time, positions=[60.0] * 12)) for time in times]
    two_robots = [
        (time, joint_state(time, frame_id=f'robot{i % 2}/base'))
        for i, time in enumerate(times)
    ]
    for name, rows, words in (
        ('one', degrees, 'look like degrees, radians are expected: l_hip_p'),
        ('two', two_robots, "frame ids 'robot0/base' and 'robot1/base'"),
    ):
        write_bag(name, joints=rows)
        assert words in run_main('bag', name, f'{name}_out').stdout
        assert words in run_main('plot', name, '-o', f'{name}.svg').stderr


def test_metadata_is_that_of_the_new_bag():
    joints = walk(31)
    write_bag('in', joints=joints)
    edit('in', 'custom_data:', 'custom_data: {robot: iCubGenova04} #')
    add_foot_poses('in', 'out')
    information = information_of('out')
    start = joints[0][0]
    last = joints[-1][0] + 1000  # a text follows the last joint state
    span = {
        'starting_time': {'nanoseconds_since_epoch': start},
        'duration': {'nanoseconds': last - start},
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
    topics, counts = topics_of('out')
    copied = {'/joint_states': 31, '/text': 11, '/silent': 0}
    assert counts == {**copied, LEFT_POSE: 31, RIGHT_POSE: 31}
    assert {name: topics[name] for name in copied} == topics_of('in')[0]
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
    joints, found
):
    write_bag('in', joints=joints)
    done = run_main('bag', 'in', 'out')
    assert_one_line_complaint(done, found)
    assert 'l_ankle_roll; right_leg needs r_hip_pitch' in done.stderr
    assert entries('.') == ['in']


EDITS = {  # of metadata.yaml, as people make them so that a bag plays, or by mistake
    'qos of a topic': ('transient_local', 'volatile'),
    'a count': ('message_count: 4', 'message_count: 7'),
    'name of a topic': ('name: /text', 'name: /words'),
    'type of a topic': ('type: std_msgs/msg/String', 'type: std_msgs/msg/Text'),
    'qos of all': ('offered_qos_profiles:', 'left_out:'),
}


@pytest.mark.parametrize('compression', [None, 'message', 'file'])
@pytest.mark.parametrize('storage', STORAGES)
def test_every_message_is_read_whatever_metadata_says_of_it(storage, compression):
    source = write_bag('in', storage, walk(10), compression)
    _, messages = read_bag(source)
    for what, (old, new) in EDITS.items():
        edited = shutil.copytree(source, what)
        edit(edited, old, new)
        summary = add_foot_poses(edited, f'{what} out')
        assert summary.copied == 14, what
        _, copied = read_bag(f'{what} out')
        assert [each for each in copied if each[0] in ('/joint_states', '/text')] == (
            messages
        )
        counts = [note for note in summary.notes if 'counts other messages' in note]
        assert len(counts) == (what in ('a count', 'name of a topic')), what


def test_messages_are_read_whose_type_hash_has_been_edited():
    write_bag('in', 'sqlite3', walk(10))
    edit('in', 'RIHS01_df668c', 'RIHS01_000000')
    assert add_foot_poses('in', 'out').copied == 14


def test_a_topic_that_metadata_leaves_out_is_read_and_said():
    write_bag('in', joints=walk(10))
    information = information_of('in')
    del information['topics_with_message_count'][1]
    write_information('in', information)
    summary = add_foot_poses('in', 'out')
    assert summary.copied == 14
    (note,) = summary.notes
    assert '/text 0 and 4' in note
    assert note in run_main('plot', 'in', '-o', 'x.svg').stderr


@needs_recordings
@pytest.mark.parametrize('source', WHOLE, ids=lambda path: path.name)
def test_recordings_of_rosbag2_are_taken_message_for_message(source):
    assert len(WHOLE) == 12
    count = topics_of(source)[1]['/joint_states']
    summary = add_foot_poses(source, 'out')
    assert summary.copied == information_of(source)['message_count']
    assert summary.joint_states == count
    assert summary.added == {LEFT_POSE: count, RIGHT_POSE: count}
    assert summary.notes == []
    assert_copied(source, 'out')
    done = run_main('plot', source, '-o', 'x.svg')
    assert f'{count} poses of left_foot, {count} poses of right_foot' in done.stdout


@needs_recordings
def test_of_killed_recorders_the_sqlite_file_is_taken_and_the_mcap_file_explained():
    file = RECORDINGS / 'sqlite3_killed' / 'sqlite3_killed_0.db3'
    assert add_foot_poses(file, 'out').joint_states == 98
    shutil.rmtree('out')
    refused(
        file.parent,
        'metadata.yaml, as when the recorder was killed; give its file '
        f'alone, or let `ros2 bag reindex {file.parent}` write one',
    )
    killed = RECORDINGS / 'mcap_killed'
    refused(killed, 'mcap_killed: mcap_killed_0.mcap in it is an empty file')
    refused(killed / 'mcap_killed_0.mcap', '_0.mcap: is an empty file')
    write_bag('in', joints=walk(5))
    Path('in/metadata.yaml').unlink()
    refused('in', '`mcap recover` mends its file')


def test_what_is_no_recording_of_ros_2_is_called_by_its_name():
    Path('old.bag').write_bytes(b'#ROSBAG V2.0\n' + bytes(50))
    refused('old.bag', 'is a ROS 1 bag')
    writer_module = pytest.importorskip('mcap.writer')
    for profile, encoding, words in (
        ('ros1', 'ros1', 'is an MCAP file of ROS 1 messages'),
        ('', 'json', '/joints (json) are not CDR'),
        ('ros2', 'json', '/joints (json) are not CDR'),
    ):
        file = f'{profile}_{encoding}.mcap'
        writer = writer_module.Writer(str(file))
        writer.start(profile)
        channel = writer.register_channel('/joints', encoding, 0)
        writer.add_message(channel, START, b'{}', START)
        writer.finish()
        refused(file, words)
    Path('empty').mkdir()
    refused('empty', 'it is not a rosbag2 recording')


@pytest.mark.parametrize(
    ('storage', 'mend'),
    [('mcap', '`mcap recover` may'), ('sqlite3', '`ros2 bag reindex` may')],
)
def test_damage_and_missing_files_end_in_one_line_with_what_mends_them(storage, mend):
    source = write_bag('in', storage, walk(800))
    file = source / f'in{ENDINGS[storage]}'
    data = file.read_bytes()
    for spoilt, words in (
        (data[: len(data) // 2], mend),
        (data[:20], mend),
        (b'', 'is an empty file'),
        (b'x' * 5000, 'is not an '),
    ):
        file.write_bytes(spoilt)
        refused(source, words)
        refused(file, words)
    file.unlink()
    refused(source, 'files are missing')
    refused(file, 'there is no such file or directory')


@pytest.mark.parametrize(
    ('old', 'new', 'words'),
    [
        ('message_count: 5', 'message_count: five', 'has values of the wrong type'),
        ('\n  message_count: 5', '\n  message_count: five', 'values of the wrong type'),
        ('custom_data:', 'custom_data: text\n  more:', 'has values of the wrong type'),
        (
            'version: 9',
            'version: 10',
            'version 10 not supported; please report issue; a newer rosbags',
        ),
        ('cdr', 'cbor', 'the messages of /joint_states (cbor) are not CDR'),
    ],
)
def test_odd_metadata_is_refused(old, new, words):
    write_bag('in', joints=walk(5), others=False)
    edit('in', old, new)
    refused('in', words)
    assert add_foot_poses('in/in.mcap', 'out').joint_states == 5


def test_metadata_is_read_in_any_locale():
    source = write_bag('in', joints=walk(5))
    edit(source, 'custom_data:', 'custom_data: {robot: caf\u00e9} #')
    locale = {'LC_ALL': 'C', 'PYTHONUTF8': '0', 'PYTHONCOERCECLOCALE': '0'}
    done = leg_fk('bag', source, 'out', environment=locale)
    assert (done.returncode, done.stderr) == (0, '')
    assert information_of('out')['custom_data'] == {'robot': 'caf\u00e9'}


def test_messages_that_wait_in_a_write_ahead_log_are_not_passed_over():
    source = write_bag('in', 'sqlite3', joints=walk(5))
    (source / 'in.db3-wal').write_bytes(b'x' * 100)
    refused(source, "sqlite3 in.db3 'PRAGMA wal_checkpoint(TRUNCATE)'")


@pytest.mark.parametrize('name', ['a b', '100%', 'what?', 'a#b', b'caf\xe9'])
def test_awkward_paths_are_opened(recorded, name):
    odd = shutil.copytree(recorded, Path(os.fsdecode(name)).resolve())
    (file,) = odd.glob('*.[md][cb]*')
    for path in (odd, file):
        summary = add_foot_poses(f'/{path}', 'out', force=True)
        assert summary.joint_states == 10


def test_a_type_hash_that_is_not_recorded_comes_from_the_definition():
    write_bag('in', joints=walk(5))
    assert add_foot_poses('in/in.mcap', 'out').notes == []
    for about in topics_of('out')[0].values():
        assert about['type_description_hash'] == TYPES.hash_rihs01(about['type'])


def test_add_foot_poses_can_be_sent_to_other_processes(recorded):
    again, arguments = pickle.loads(pickle.dumps((add_foot_poses, {'version': 'v1'})))
    summary = again(recorded, 'out', **arguments)
    assert pickle.loads(pickle.dumps(summary)) == summary
    assert summary.added == ADDED
