"""`leg_fk bag` copies a bag as it is and adds the poses: every storage and every compression."""

import os
from pathlib import Path
import pickle
import re

from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.tools import recording
from icub_leg_fk.tools.add_poses import add_foot_poses
import numpy as np
import pytest
from support.bag_files import (
    ENDINGS,
    entries,
    expected_poses,
    JOINT_STATE,
    joint_state,
    LEFT_POSE,
    LEGS,
    POSE,
    poses_of,
    read_bag,
    RIGHT_POSE,
    SECOND,
    START,
    STORAGES,
    TYPES,
    walk,
    write_bag,
)
from support.leg_fk_process import assert_one_line_complaint, leg_fk
import yaml

TWIST = 'geometry_msgs/msg/TwistStamped'
TF = 'tf2_msgs/msg/TFMessage'


def bag(*words, status=0):
    done = leg_fk('bag', *words)
    assert (done.returncode, done.stderr) == (status, ''), done.stderr
    return done.stdout


def assert_pose(message, matrix):
    p, q = message.pose.position, message.pose.orientation
    w, x, y, z = q.w, q.x, q.y, q.z
    R = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    np.testing.assert_allclose([p.x, p.y, p.z], matrix[:3, 3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(R, matrix[:3, :3], rtol=0, atol=1e-12)


def assert_copied_with_poses(source, target, joints):
    """Check that a bag holds another one, unchanged and in order, and the poses of both feet."""
    topics, messages = read_bag(source)
    new_topics, new_messages = read_bag(target)
    assert {name: new_topics[name] for name in topics} == topics
    assert set(new_topics) == {*topics, LEFT_POSE, RIGHT_POSE}
    assert [message for message in new_messages if message[0] in topics] == messages
    for leg, topic in (('left_leg', LEFT_POSE), ('right_leg', RIGHT_POSE)):
        poses = poses_of(new_messages, topic)
        expected = expected_poses(joints, leg)
        assert [time for time, _ in poses] == [time for time, _ in joints]
        for (_, message), (stamp, matrix) in zip(poses, expected, strict=True):
            header = message.header
            assert header.stamp.sec * SECOND + header.stamp.nanosec == stamp
            assert header.frame_id == 'root_link'
            assert_pose(message, matrix)


def order_of(target):
    return [topic for topic, _, _ in read_bag(target)[1]]


@pytest.mark.parametrize('compression', [None, 'message', 'file', 'storage'])
@pytest.mark.parametrize('storage', STORAGES)
def test_every_kind_of_bag_is_copied_with_poses(tmp_path, storage, compression):
    if storage == 'sqlite3' and compression == 'storage':
        pytest.skip('sqlite3 has no compression of its own')
    joints = walk(300)
    write_bag(tmp_path / 'in', storage, joints, compression)
    out = bag(tmp_path / 'in', tmp_path / 'out')
    assert_copied_with_poses(tmp_path / 'in', tmp_path / 'out', joints)
    assert entries(tmp_path) == ['in', 'out']
    assert entries(tmp_path / 'out') == ['metadata.yaml', f'out{ENDINGS[storage]}']
    assert '400  messages copied' in out
    assert f'300  added on {LEFT_POSE}' in out


def test_poses_stand_right_behind_their_joint_state(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(50))
    bag(tmp_path / 'in', tmp_path / 'out')
    order = order_of(tmp_path / 'out')
    assert order[:5] == ['/joint_states', LEFT_POSE, RIGHT_POSE, '/text', '/joint_states']
    for place, topic in enumerate(order):
        if topic == '/joint_states':
            assert order[place + 1:place + 3] == [LEFT_POSE, RIGHT_POSE]


@pytest.mark.parametrize('old', STORAGES)
@pytest.mark.parametrize('new', STORAGES)
def test_storage_is_what_was_asked_for(tmp_path, old, new):
    joints = walk(40)
    write_bag(tmp_path / 'in', old, joints)
    bag(tmp_path / 'in', tmp_path / 'out', '--storage', new)
    assert_copied_with_poses(tmp_path / 'in', tmp_path / 'out', joints)
    assert entries(tmp_path / 'out') == ['metadata.yaml', f'out{ENDINGS[new]}']


@pytest.mark.parametrize('storage', STORAGES)
def test_a_bare_file_becomes_a_bare_file(tmp_path, storage):
    joints = walk(40)
    write_bag(tmp_path / 'in', storage, joints)
    ending = ENDINGS[storage]
    (tmp_path / 'in' / f'in{ending}').rename(tmp_path / f'walk{ending}')
    bag(tmp_path / f'walk{ending}', tmp_path / f'out{ending}')
    assert_copied_with_poses(tmp_path / f'walk{ending}', tmp_path / f'out{ending}', joints)
    assert entries(tmp_path) == ['in', f'out{ending}', f'walk{ending}']


@pytest.mark.parametrize('compression', [None, 'file', 'message'])
@pytest.mark.parametrize('storage', STORAGES)
def test_split_bags_become_one(tmp_path, storage, compression):
    """Eleven files, so that bag_10 must not come before bag_2."""
    joints = walk(220)
    split = tmp_path / 'split'
    split.mkdir()
    names, every = [], []
    for part in range(11):
        piece = joints[20 * part:20 * part + 20]
        write_bag(tmp_path / f'part_{part}', storage, piece, compression)
        file = next(path for path in (tmp_path / f'part_{part}').iterdir()
                    if path.name != 'metadata.yaml')
        ending = file.name.partition('.')[2]
        names.append(f'split_{part}.{ending}')
        file.rename(split / names[-1])
        every.append(piece)
    metadata = yaml.safe_load((tmp_path / 'part_0' / 'metadata.yaml').read_text())
    information = metadata['rosbag2_bagfile_information']
    information['relative_file_paths'] = names
    information['message_count'] = 220 + 11 * 7
    information['files'] = []
    (split / 'metadata.yaml').write_text(yaml.safe_dump(metadata))
    bag(split, tmp_path / 'out')
    assert_copied_with_poses(split, tmp_path / 'out', joints)


def test_chains_versions_frames_and_prefix_are_those_asked_for(tmp_path):
    joints = walk(20, names=LEGS + ('torso_pitch', 'torso_roll', 'torso_yaw', 'neck_pitch',
                                    'neck_roll', 'neck_yaw'))
    write_bag(tmp_path / 'in', joints=joints)
    out = bag(tmp_path / 'in', tmp_path / 'out', '--chains', 'right_leg', 'head_imu', '--version',
              'v1', '--chain-version', 'head_imu=v2', '--foot-frame', 'sole', '--frame-prefix',
              'icub/')
    topics, messages = read_bag(tmp_path / 'out')
    assert LEFT_POSE not in topics
    head = '/foot_pose_publisher/head_imu/pose'
    for topic, expected in (
            (RIGHT_POSE, expected_poses(joints, 'right_leg', 'v1', 'sole')),
            (head, expected_poses(joints, 'head_imu', 'v2'))):
        for (_, message), (_, matrix) in zip(poses_of(messages, topic), expected, strict=True):
            assert message.header.frame_id == 'icub/root_link'
            assert_pose(message, matrix)
    assert 'head_imu has no sole' in out


def test_only_poses_leaves_everything_else_out(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(30))
    bag(tmp_path / 'in', tmp_path / 'all')
    bag(tmp_path / 'in', tmp_path / 'out', '--only-poses')
    topics, messages = read_bag(tmp_path / 'out')
    assert set(topics) == {LEFT_POSE, RIGHT_POSE}
    assert messages == [message for message in read_bag(tmp_path / 'all')[1]
                        if message[0] in topics]


def test_twists_are_those_of_the_moving_feet(tmp_path):
    """Against central differences of the poses; velocities in these bags are true ones."""
    joints = walk(400, rate=1000.0)
    write_bag(tmp_path / 'in', joints=joints)
    bag(tmp_path / 'in', tmp_path / 'out', '--twist')
    topics, messages = read_bag(tmp_path / 'out')
    topic = '/foot_pose_publisher/left_foot/twist'
    assert topics[topic][0] == TWIST
    twists = [TYPES.deserialize_cdr(data, TWIST) for name, _, data in messages if name == topic]
    matrices = np.array([matrix for _, matrix in expected_poses(joints)])
    for i in range(1, len(twists) - 1):
        linear, angular = twists[i].twist.linear, twists[i].twist.angular
        difference = (matrices[i + 1] - matrices[i - 1]) / 0.002
        spin = difference[:3, :3] @ matrices[i][:3, :3].T
        np.testing.assert_allclose([linear.x, linear.y, linear.z], difference[:3, 3], atol=1e-5)
        np.testing.assert_allclose([angular.x, angular.y, angular.z],
                                   [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-4)
        assert twists[i].header.frame_id == 'root_link'


def test_no_velocities_give_no_twist_and_are_counted(tmp_path):
    unknown = [0.1] * 3 + [float('nan')] + [0.1] * 8
    joints = [(START + i, joint_state(START + i, velocities=[0.1] * 12 if i % 2 else unknown))
              for i in range(10)]
    write_bag(tmp_path / 'in', joints=joints, others=False)
    out = bag(tmp_path / 'in', tmp_path / 'out', '--twist')
    order = order_of(tmp_path / 'out')
    assert order.count('/foot_pose_publisher/left_foot/twist') == 5
    assert order.count('/foot_pose_publisher/right_foot/twist') == 10
    assert order.count(LEFT_POSE) == 10
    assert '5  joint states gave no twist of left_leg: no_velocity (l_knee unknown)' in out
    assert 'twist of right_leg' not in out


def test_tf_gets_the_same_transforms(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(20))
    bag(tmp_path / 'in', tmp_path / 'out', '--tf')
    topics, messages = read_bag(tmp_path / 'out')
    assert topics['/tf'][0] == TF
    transforms = [TYPES.deserialize_cdr(data, TF).transforms for name, _, data in messages
                  if name == '/tf']
    assert [[t.child_frame_id for t in ts] for ts in transforms[:2]] == [
        ['l_foot_dh_frame', 'r_foot_dh_frame']] * 2
    left = [message for _, message in poses_of(messages, LEFT_POSE)]
    for (transform, _), pose in zip(transforms, left, strict=True):
        assert transform.header == pose.header
        t, r = transform.transform.translation, transform.transform.rotation
        p, q = pose.pose.position, pose.pose.orientation
        assert (t.x, t.y, t.z, r.x, r.y, r.z, r.w) == (p.x, p.y, p.z, q.x, q.y, q.z, q.w)


def test_tf_joins_a_tf_topic_that_is_there(tmp_path):
    """The joint states of a bag on one topic, its own transforms on /tf: both stay."""
    write_bag(tmp_path / 'first', joints=walk(10))
    bag(tmp_path / 'first', tmp_path / 'in', '--tf', '--chains', 'left_leg')
    bag(tmp_path / 'in', tmp_path / 'poses', '--only-poses', '--tf', '--chains', 'right_leg')
    assert order_of(tmp_path / 'poses') == [RIGHT_POSE, '/tf'] * 10
    bag(tmp_path / 'in', tmp_path / 'out', '--tf', '--chains', 'right_leg')
    _, messages = read_bag(tmp_path / 'out')
    children = [TYPES.deserialize_cdr(data, TF).transforms[0].child_frame_id
                for name, _, data in messages if name == '/tf']
    assert sorted(children) == ['l_foot_dh_frame'] * 10 + ['r_foot_dh_frame'] * 10


def test_poses_that_are_there_already_are_not_mixed_with_new_ones(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(10))
    bag(tmp_path / 'in', tmp_path / 'out')
    assert_one_line_complaint(leg_fk('bag', tmp_path / 'out', tmp_path / 'again'),
                              f'{LEFT_POSE}, {RIGHT_POSE} already; --replace-poses leaves')
    bag(tmp_path / 'out', tmp_path / 'replaced', '--replace-poses', '--version', 'v1')
    topics, messages = read_bag(tmp_path / 'replaced')
    assert len(messages) == 10 * 3 + 4 and set(topics) == {'/joint_states', '/text', '/silent',
                                                           LEFT_POSE, RIGHT_POSE}
    bag(tmp_path / 'out', tmp_path / 'again', '--only-poses')
    assert len(read_bag(tmp_path / 'again')[1]) == 20


def test_another_joint_topic(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(10), topic='/robot/joints')
    assert_one_line_complaint(
        leg_fk('bag', tmp_path / 'in', tmp_path / 'out', '--joint-topic', '/joint_states'),
        'no joint states on /joint_states; --joint-topic can be /robot/joints')
    bag(tmp_path / 'in', tmp_path / 'out')
    assert len(poses_of(read_bag(tmp_path / 'out')[1], LEFT_POSE)) == 10


def test_a_zero_stamp_becomes_the_time_of_recording(tmp_path):
    write_bag(tmp_path / 'in', joints=[(START + 7, joint_state(None))], others=False)
    bag(tmp_path / 'in', tmp_path / 'out')
    (time, message), = poses_of(read_bag(tmp_path / 'out')[1], LEFT_POSE)
    assert (time, message.header.stamp.sec, message.header.stamp.nanosec) == (
        START + 7, START // SECOND, 7)


def test_what_gives_no_pose_is_counted_by_reason(tmp_path):
    nan = [0.0] * 5 + [float('nan')] + [0.0] * 6
    stamps = iter(range(START, START + 10 ** 9, 10 ** 7))
    joints = [(stamp, data) for stamp in [next(stamps)] for data in [joint_state(stamp)]]
    for options in ({'positions': [0.1] * 11}, {'positions': []}, {'positions': nan},
                    {'names': LEGS[:-1] + LEGS[:1]}, {'names': LEGS[:6]}):
        stamp = next(stamps)
        joints.append((stamp, joint_state(stamp, **options)))
    joints.append((next(stamps), joint_state(START - 10 ** 10)))
    joints.append((next(stamps), b'\x00\x01\x00\x00nothing'))
    write_bag(tmp_path / 'in', joints=joints, others=False)
    out = bag(tmp_path / 'in', tmp_path / 'out')
    for line in ('joint states rejected: short_position', 'joint states rejected: empty_position',
                 'joint states rejected: duplicate_name', 'joint states rejected: malformed',
                 'time steps back: held joints forgotten',
                 'joint states gave no pose of left_leg: non_finite (l_ankle_roll nan)'):
        assert f'1  {line}' in out, out
    assert f'3  added on {LEFT_POSE}' in out


def test_metadata_is_that_of_the_new_bag(tmp_path):
    joints = walk(31)
    write_bag(tmp_path / 'in', joints=joints)
    old = yaml.safe_load((tmp_path / 'in' / 'metadata.yaml').read_text())
    old['rosbag2_bagfile_information']['custom_data'] = {'robot': 'iCubGenova04'}
    (tmp_path / 'in' / 'metadata.yaml').write_text(yaml.safe_dump(old))
    bag(tmp_path / 'in', tmp_path / 'out')
    new = yaml.safe_load((tmp_path / 'out' / 'metadata.yaml').read_text())
    information = new['rosbag2_bagfile_information']
    last = joints[-1][0] + 1000  # a text follows the last joint state
    span = {'starting_time': {'nanoseconds_since_epoch': joints[0][0]},
            'duration': {'nanoseconds': last - joints[0][0]}, 'message_count': 31 * 3 + 11}
    assert {key: information[key] for key in span} == span
    assert information['files'] == [{'path': 'out.mcap', **span}]
    assert information['relative_file_paths'] == ['out.mcap']
    assert information['custom_data'] == {'robot': 'iCubGenova04'}
    assert (information['version'], information['ros_distro']) == (9, 'rosbags')
    counts = {entry['topic_metadata']['name']: entry['message_count']
              for entry in information['topics_with_message_count']}
    assert counts == {'/joint_states': 31, '/text': 11, '/silent': 0, LEFT_POSE: 31,
                      RIGHT_POSE: 31}
    by_name = {entry['topic_metadata']['name']: entry['topic_metadata']
               for entry in information['topics_with_message_count']}
    for entry in old['rosbag2_bagfile_information']['topics_with_message_count']:
        topic = entry['topic_metadata']
        assert by_name[topic['name']] == topic
    assert by_name[LEFT_POSE]['type_description_hash'] == TYPES.hash_rihs01(POSE)
    assert by_name[LEFT_POSE]['offered_qos_profiles'][0]['reliability'] == 'reliable'


@pytest.mark.parametrize(('joints', 'found'), [
    ([], 'no message of joint states; left_leg needs l_hip_pitch'),
    ([(START, joint_state(START, ['L_KNEE', 'icub/l_knee']))],
     'l_ankle_roll; right_leg needs .*; names found: L_KNEE, icub/l_knee'),
])
def test_a_bag_without_a_joint_of_any_chain_is_refused_with_the_names_found(tmp_path, joints,
                                                                            found):
    write_bag(tmp_path / 'in', joints=joints)
    done = leg_fk('bag', tmp_path / 'in', tmp_path / 'out')
    assert (done.returncode, done.stdout, done.stderr.count('\n')) == (2, '', 1)
    assert re.search(found, done.stderr), done.stderr
    assert entries(tmp_path) == ['in']


def test_transforms_that_are_on_tf_already_are_refused_or_replaced(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(10), others=False)
    bag(tmp_path / 'in', tmp_path / 'once', '--tf')
    assert_one_line_complaint(
        leg_fk('bag', tmp_path / 'once', tmp_path / 'twice', '--tf'),
        '/tf with l_foot_dh_frame, r_foot_dh_frame already; --replace-poses leaves')
    bag(tmp_path / 'once', tmp_path / 'twice', '--tf', '--replace-poses')
    assert read_bag(tmp_path / 'twice')[1] == read_bag(tmp_path / 'once')[1]


LEG_CHAINS = [Catalog.load().chain(name, 'v2_5') for name in ('left_leg', 'right_leg')]
RECORDINGS = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'rosbag2_jazzy'
WHOLE = sorted(path.name for path in RECORDINGS.glob('*') if (path / 'metadata.yaml').is_file())


@pytest.mark.skipif(not WHOLE, reason=f'the recordings of rosbag2 are not there: {RECORDINGS}')
def test_recordings_of_rosbag2_are_taken_message_for_message(tmp_path):
    assert len(WHOLE) == 12
    for name in WHOLE:
        information = yaml.safe_load((RECORDINGS / name / 'metadata.yaml').read_text())[
            'rosbag2_bagfile_information']
        summary = add_foot_poses(RECORDINGS / name, tmp_path / name)
        count, = (entry['message_count'] for entry in information['topics_with_message_count']
                  if entry['topic_metadata']['name'] == '/joint_states')
        assert (summary.copied, summary.joint_states) == (information['message_count'], count)
        assert summary.added == {LEFT_POSE: count, RIGHT_POSE: count}
        tracks, _ = recording.read_bag(RECORDINGS / name, LEG_CHAINS, None)  # as for leg_fk plot
        assert [len(track.times) for track in tracks] == [count, count]
        topics, messages = read_bag(RECORDINGS / name)
        new_topics, new_messages = read_bag(tmp_path / name)
        assert {topic: new_topics[topic] for topic in topics} == topics
        assert [message for message in new_messages if message[0] in topics] == messages


@pytest.mark.skipif(not WHOLE, reason=f'the recordings of rosbag2 are not there: {RECORDINGS}')
def test_of_killed_recorders_the_sqlite_file_is_taken_and_the_mcap_file_explained(tmp_path):
    file = RECORDINGS / 'sqlite3_killed' / 'sqlite3_killed_0.db3'
    assert add_foot_poses(file, tmp_path / 'out').joint_states == 98
    assert_one_line_complaint(leg_fk('bag', file.parent, tmp_path / 'x'),
                              f'metadata.yaml, as when the recorder was killed; give its file '
                              f'alone, or let `ros2 bag reindex {file.parent}` write one')
    killed = RECORDINGS / 'mcap_killed'
    for path, words in ((killed, '`mcap recover` mends its file'),
                        (killed / 'mcap_killed_0.mcap', 'to be empty; `mcap recover` may mend')):
        for command in (('bag', path, tmp_path / 'x'), ('plot', path)):
            assert_one_line_complaint(leg_fk(*command), words)


def refused(tmp_path, path, words):
    for command in (('bag', path, tmp_path / 'out'), ('plot', path, '-o', tmp_path / 'x.png')):
        assert_one_line_complaint(leg_fk(*command), words)
    assert not (tmp_path / 'out').exists()


def test_what_is_no_recording_of_ros_2_is_called_by_its_name(tmp_path):
    (tmp_path / 'old.bag').write_bytes(b'#ROSBAG V2.0\n' + bytes(50))
    refused(tmp_path, tmp_path / 'old.bag', 'is a ROS 1 bag')
    writer_module = pytest.importorskip('mcap.writer')
    for profile, encoding, words in (('ros1', 'ros1', 'is an MCAP file of ROS 1 messages'),
                                     ('', 'json', '/joints (json) are not CDR'),
                                     ('ros2', 'json', '/joints (json) are not CDR')):
        file = tmp_path / f'{profile}_{encoding}.mcap'
        writer = writer_module.Writer(str(file))
        writer.start(profile)
        channel = writer.register_channel('/joints', encoding, 0)
        writer.add_message(channel, START, b'{}', START)
        writer.finish()
        refused(tmp_path, file, words)
    source = write_bag(tmp_path / 'in', joints=walk(5))
    metadata = source / 'metadata.yaml'
    metadata.write_text(metadata.read_text().replace('cdr', 'cbor', 1))
    refused(tmp_path, source, 'the messages of /joint_states (cbor) are not CDR')


def test_damage_and_missing_parts_end_in_one_line_with_what_mends_them(tmp_path):
    for storage, mend in (('mcap', 'mcap recover'), ('sqlite3', 'ros2 bag reindex')):
        source = write_bag(tmp_path / storage, storage, joints=walk(800))
        file = source / f'{storage}{ENDINGS[storage]}'
        data = file.read_bytes()
        for spoilt in (data[:len(data) // 2], data[:20], b'', b'x' * 5000):
            file.write_bytes(spoilt)
            refused(tmp_path, source, mend)
            refused(tmp_path, file, mend)
        file.unlink()
        refused(tmp_path, source, 'missing')
    source = write_bag(tmp_path / 'odd', joints=walk(5))
    good = (source / 'metadata.yaml').read_text()
    for field, text in (('message_count: 5', 'message_count: five'),
                        ('custom_data:', 'custom_data: text\n  more:')):
        assert field in good
        (source / 'metadata.yaml').write_text(good.replace(field, text))
        refused(tmp_path, source, 'metadata.yaml has values of the wrong type')
    (tmp_path / 'empty').mkdir()
    refused(tmp_path, tmp_path / 'empty', 'it is not a rosbag2 recording')
    refused(tmp_path, tmp_path / 'nothing', 'there is no such file or directory')


def test_messages_that_wait_in_a_write_ahead_log_are_not_passed_over(tmp_path):
    source = write_bag(tmp_path / 'in', 'sqlite3', joints=walk(5))
    (source / 'in.db3-wal').write_bytes(b'x' * 100)
    refused(tmp_path, source, "sqlite3 in.db3 'PRAGMA wal_checkpoint(TRUNCATE)'")


@pytest.mark.parametrize('name', ['a b', '100%', 'what?', 'a#b', b'caf\xe9'])
def test_awkward_paths_are_opened(tmp_path, name):
    folder = Path(os.fsdecode(name))
    for storage in STORAGES:
        source = write_bag(tmp_path / storage, storage, joints=walk(5))
        odd = tmp_path / storage / folder
        odd.mkdir()
        for file in ('metadata.yaml', f'{storage}{ENDINGS[storage]}'):
            (source / file).rename(odd / file)
        for path in (odd, odd / f'{storage}{ENDINGS[storage]}'):
            assert add_foot_poses(f'/{path}', tmp_path / 'out', force=True).joint_states == 5


def test_private_records_of_an_mcap_file_are_passed_over(tmp_path):
    """Kinds 0x80 to 0xFF are anybody's own; readers skip them (MCAP specification)."""
    writer_module = pytest.importorskip('mcap.writer')
    file = tmp_path / 'private.mcap'
    stream = file.open('wb')
    writer = writer_module.Writer(stream, use_chunking=False)
    writer.start('ros2')
    definition, _ = TYPES.generate_msgdef(JOINT_STATE, ros_version=2)
    schema = writer.register_schema(JOINT_STATE, 'ros2msg', definition.encode())
    channel = writer.register_channel('/joint_states', 'cdr', schema)
    for i in range(10):
        writer.add_message(channel, START + i, joint_state(START + i), START + i)
        stream.write(b'\x80' + (3).to_bytes(8, 'little') + b'abc')
    writer.finish()
    stream.close()
    assert add_foot_poses(file, tmp_path / 'out').joint_states == 10


def test_a_type_hash_that_is_not_recorded_comes_from_the_definition(tmp_path):
    source = write_bag(tmp_path / 'in', joints=walk(5))
    summary = add_foot_poses(source / 'in.mcap', tmp_path / 'out')
    metadata = yaml.safe_load((tmp_path / 'out' / 'metadata.yaml').read_text())
    hashes = {entry['topic_metadata']['type']: entry['topic_metadata']['type_description_hash']
              for entry in metadata['rosbag2_bagfile_information']['topics_with_message_count']}
    assert hashes == {kind: TYPES.hash_rihs01(kind) for kind in hashes}
    assert summary.notes == []


def test_add_foot_poses_can_be_sent_to_other_processes(tmp_path):
    again, arguments = pickle.loads(pickle.dumps((add_foot_poses, {'version': 'v1'})))
    summary = again(write_bag(tmp_path / 'in', joints=walk(5)), tmp_path / 'out', **arguments)
    assert pickle.loads(pickle.dumps(summary)) == summary
    assert summary.added == {LEFT_POSE: 5, RIGHT_POSE: 5}
