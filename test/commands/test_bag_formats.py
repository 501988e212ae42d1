"""What `leg_fk bag` writes, as libraries that are not ours see it: `mcap` and sqlite."""

from collections import Counter
import sqlite3

import pytest
from support.bag_files import (
    joint_state,
    LEFT_POSE,
    LEGS,
    POSE,
    read_bag,
    RIGHT_POSE,
    START,
    TYPES,
    walk,
    write_bag,
)
from support.leg_fk_process import leg_fk

ADDED = {LEFT_POSE: POSE, RIGHT_POSE: POSE,
         '/foot_pose_publisher/left_foot/twist': 'geometry_msgs/msg/TwistStamped',
         '/foot_pose_publisher/right_foot/twist': 'geometry_msgs/msg/TwistStamped',
         '/tf': 'tf2_msgs/msg/TFMessage'}


@pytest.fixture(scope='module', params=[None, 'storage'])
def bag(request, tmp_path_factory):
    """Return an mcap bag of several chunks, plain or compressed, and what was made of it."""
    folder = tmp_path_factory.mktemp('formats')
    source = write_bag(folder / 'in', joints=walk(1500), compression=request.param)
    done = leg_fk('bag', source, folder / 'out', '--twist', '--tf')
    assert done.returncode == 0, done
    return source, folder / 'out'


def test_the_mcap_library_finds_every_message_with_its_index(bag):
    reader_module = pytest.importorskip('mcap.reader')
    _, target = bag
    _, messages = read_bag(target)
    with (target / 'out.mcap').open('rb') as file:
        reader = reader_module.SeekingReader(file, validate_crcs=True)
        found = [(channel.topic, message.log_time, message.data)
                 for _, channel, message in reader.iter_messages(log_time_order=True)]
        assert found == messages
        summary = reader.get_summary()
        assert reader.get_header().profile == 'ros2'
    statistics = summary.statistics
    assert statistics.message_count == len(messages)
    assert statistics.chunk_count == len(summary.chunk_indexes) >= 3
    times = [time for _, time, _ in messages]
    assert (statistics.message_start_time, statistics.message_end_time) == (times[0], times[-1])
    counts = Counter(topic for topic, _, _ in messages)
    assert {summary.channels[number].topic: count
            for number, count in statistics.channel_message_counts.items()} == {
                **counts, '/silent': 0}
    with (target / 'out.mcap').open('rb') as file:
        poses = [message.data for _, _, message in
                 reader_module.SeekingReader(file).iter_messages(topics=[LEFT_POSE])]
    assert poses == [data for topic, _, data in messages if topic == LEFT_POSE]


def test_channels_and_schemas_are_as_rosbag2_writes_them(bag):
    reader_module = pytest.importorskip('mcap.reader')
    source, target = bag
    with (source / 'in.mcap').open('rb') as file:
        old = reader_module.SeekingReader(file).get_summary()
    with (target / 'out.mcap').open('rb') as file:
        new = reader_module.SeekingReader(file).get_summary()
    by_topic = {channel.topic: channel for channel in new.channels.values()}
    for channel in old.channels.values():
        copy = by_topic[channel.topic]
        assert copy.message_encoding == channel.message_encoding == 'cdr'
        assert copy.metadata['offered_qos_profiles'] == channel.metadata['offered_qos_profiles']
        old_schema, schema = old.schemas[channel.schema_id], new.schemas[copy.schema_id]
        assert (schema.name, schema.encoding, schema.data) == (
            old_schema.name, old_schema.encoding, old_schema.data)
    for topic, message_type in ADDED.items():
        schema = new.schemas[by_topic[topic].schema_id]
        assert (schema.name, schema.encoding) == (message_type, 'ros2msg')


@pytest.mark.parametrize('compression', ['zstd', 'lz4'])
def test_bags_of_the_mcap_library_are_read(tmp_path, compression):
    """With publish times, sequence numbers, attachments and disorder, of which order is kept."""
    writer_module = pytest.importorskip('mcap.writer')
    codec = writer_module.CompressionType[compression.upper()]
    file = tmp_path / 'in.mcap'
    writer = writer_module.Writer(str(file), chunk_size=20_000, compression=codec)
    writer.start('ros2', 'a robot')
    definition, _ = TYPES.generate_msgdef('sensor_msgs/msg/JointState', ros_version=2)
    schema = writer.register_schema('sensor_msgs/msg/JointState', 'ros2msg',
                                    definition.encode())
    channels = [writer.register_channel('/joint_states', 'cdr', schema),
                writer.register_channel('/others', 'cdr', schema)]
    expected = []
    for i in range(400):
        time = START + 1_000_000 * (i + (7 if i % 10 == 0 else 0))  # out of order by up to 7
        data = joint_state(time, LEGS)
        writer.add_message(channels[i % 2], time, data, time - 500, i)
        expected.append((time, ('/joint_states', '/others')[i % 2], data))
    writer.add_attachment(START, START, 'calibration.txt', 'text/plain', b'1 2 3')
    writer.finish()
    done = leg_fk('bag', file, tmp_path / 'out.mcap')
    assert (done.returncode, done.stderr) == (0, ''), done
    reader_module = pytest.importorskip('mcap.reader')
    with (tmp_path / 'out.mcap').open('rb') as stream:
        reader = reader_module.SeekingReader(stream, validate_crcs=True)
        found = [(message.log_time, channel.topic, message.data)
                 for _, channel, message in reader.iter_messages()]
    assert [row for row in found if 'foot_pose' not in row[1]] == sorted(
        expected, key=lambda row: row[0])
    assert sum(row[1] == LEFT_POSE for row in found) == 200


def test_qos_in_the_numbers_of_older_recorders_becomes_names(tmp_path):
    """Up to Iron, metadata.yaml and the files held policies as numbers, in one text."""
    import yaml
    write_bag(tmp_path / 'in', 'sqlite3', joints=walk(3))
    file = tmp_path / 'in' / 'metadata.yaml'
    metadata = yaml.safe_load(file.read_text())
    information = metadata['rosbag2_bagfile_information']
    information['version'] = 5
    infinite = {'sec': 9223372036, 'nsec': 854775807}
    profile = {'history': 1, 'depth': 7, 'reliability': 2, 'durability': 1, 'deadline': infinite,
               'lifespan': infinite, 'liveliness': 1, 'liveliness_lease_duration': infinite,
               'avoid_ros_namespace_conventions': False}
    text = yaml.safe_dump([profile])
    for entry in information['topics_with_message_count']:
        entry['topic_metadata']['offered_qos_profiles'] = text
        del entry['topic_metadata']['type_description_hash']
    file.write_text(yaml.safe_dump(metadata))
    database = sqlite3.connect(tmp_path / 'in' / 'in.db3')
    database.execute('UPDATE topics SET offered_qos_profiles = ?', (text,))
    database.commit()
    database.close()
    before = read_bag(tmp_path / 'in')
    for storage in ('sqlite3', 'mcap'):
        done = leg_fk('bag', tmp_path / 'in', tmp_path / storage, '--storage', storage)
        assert done.returncode == 0, done
        topics, _ = read_bag(tmp_path / storage)
        assert {name: topics[name] for name in before[0]} == before[0]
        new = yaml.safe_load((tmp_path / storage / 'metadata.yaml').read_text())
        for entry in new['rosbag2_bagfile_information']['topics_with_message_count'][:2]:
            assert entry['topic_metadata']['offered_qos_profiles'] == [{
                **profile, 'history': 'keep_last', 'reliability': 'best_effort',
                'durability': 'transient_local', 'liveliness': 'automatic'}]
