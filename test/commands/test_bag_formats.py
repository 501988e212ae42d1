"""What `leg_fk bag` writes, as libraries that are not ours see it: `mcap` and sqlite."""

from collections import Counter
from contextlib import closing, contextmanager
import sqlite3

from icub_leg_fk import add_foot_poses
import pytest
from support.bag_files import (
    JOINT_STATE,
    joint_state,
    LEFT_POSE,
    LEFT_TWIST,
    POSE,
    read_bag,
    RIGHT_POSE,
    RIGHT_TWIST,
    START,
    TF,
    TWIST,
    TYPES,
    walk,
    write_bag,
)
import yaml

reading = pytest.importorskip('mcap.reader')
writing = pytest.importorskip('mcap.writer')

ADDED = {
    LEFT_POSE: POSE,
    RIGHT_POSE: POSE,
    LEFT_TWIST: TWIST,
    RIGHT_TWIST: TWIST,
    '/tf': TF,
}


@pytest.fixture(scope='module', params=[None, 'storage'])
def bags(request, tmp_path_factory):
    """Return an mcap bag of several chunks, plain or compressed, and what was made of it."""
    folder = tmp_path_factory.mktemp('formats')
    source = write_bag(folder / 'in', joints=walk(1500), compression=request.param)
    add_foot_poses(source, folder / 'out', twist=True, tf=True)
    return source, folder / 'out'


@contextmanager
def mcap_reader(file):
    with file.open('rb') as stream:
        yield reading.SeekingReader(stream, validate_crcs=True)


def test_the_mcap_library_finds_every_message_with_its_index(bags):
    _, target = bags
    _, messages = read_bag(target)
    with mcap_reader(target / 'out.mcap') as reader:
        found = [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in reader.iter_messages(log_time_order=True)
        ]
        poses = [
            message.data for _, _, message in reader.iter_messages(topics=[LEFT_POSE])
        ]
        summary = reader.get_summary()
        assert reader.get_header().profile == 'ros2'
    assert found == messages
    assert poses == [data for topic, _, data in messages if topic == LEFT_POSE]
    statistics = summary.statistics
    assert statistics.message_count == len(messages)
    assert statistics.chunk_count == len(summary.chunk_indexes) >= 3
    times = [time for _, time, _ in messages]
    assert (statistics.message_start_time, statistics.message_end_time) == (
        times[0],
        times[-1],
    )
    counts = Counter(topic for topic, _, _ in messages)
    in_statistics = {
        summary.channels[number].topic: count
        for number, count in statistics.channel_message_counts.items()
    }
    assert in_statistics == {**counts, '/silent': 0}


def test_channels_and_schemas_are_as_rosbag2_writes_them(bags):
    source, target = bags
    with mcap_reader(source / 'in.mcap') as reader:
        old = reader.get_summary()
    with mcap_reader(target / 'out.mcap') as reader:
        new = reader.get_summary()
    by_topic = {channel.topic: channel for channel in new.channels.values()}
    for channel in old.channels.values():
        copy = by_topic[channel.topic]
        assert copy.message_encoding == channel.message_encoding == 'cdr'
        assert (
            copy.metadata['offered_qos_profiles']
            == channel.metadata['offered_qos_profiles']
        )
        schema, old_schema = new.schemas[copy.schema_id], old.schemas[channel.schema_id]
        for name in ('name', 'encoding', 'data'):
            assert getattr(schema, name) == getattr(old_schema, name)
    for topic, message_type in ADDED.items():
        schema = new.schemas[by_topic[topic].schema_id]
        assert (schema.name, schema.encoding) == (message_type, 'ros2msg')


@pytest.mark.parametrize('compression', ['ZSTD', 'LZ4'])
def test_bags_of_the_mcap_library_are_read(tmp_path, compression):
    """With publish times, sequence numbers, attachments and disorder, of which order is kept."""
    definition, _ = TYPES.generate_msgdef(JOINT_STATE, ros_version=2)
    writer = writing.Writer(
        str(tmp_path / 'in.mcap'),
        chunk_size=20_000,
        compression=writing.CompressionType[compression],
    )
    writer.start('ros2', 'a robot')
    schema = writer.register_schema(JOINT_STATE, 'ros2msg', definition.encode())
    topics = ('/joint_states', '/others')
    channels = [writer.register_channel(topic, 'cdr', schema) for topic in topics]
    expected = []
    for i in range(400):
        late = 7 if i % 10 == 0 else 0
        time = START + 1_000_000 * (i + late)
        data = joint_state(time)
        writer.add_message(channels[i % 2], time, data, time - 500, i)
        expected.append((time, topics[i % 2], data))
    writer.add_attachment(START, START, 'calibration.txt', 'text/plain', b'1 2 3')
    writer.finish()
    add_foot_poses(tmp_path / 'in.mcap', tmp_path / 'out.mcap')
    with mcap_reader(tmp_path / 'out.mcap') as reader:
        found = [
            (message.log_time, channel.topic, message.data)
            for _, channel, message in reader.iter_messages()
        ]
    expected.sort(key=lambda row: row[0])
    assert [row for row in found if row[1] in topics] == expected
    assert sum(topic == LEFT_POSE for _, topic, _ in found) == 200


def test_qos_in_the_numbers_of_older_recorders_becomes_names(tmp_path):
    """Up to Iron, metadata.yaml and the files held policies as numbers, in one text."""
    source = write_bag(tmp_path / 'in', 'sqlite3', joints=walk(3))
    metadata = yaml.safe_load((source / 'metadata.yaml').read_text())
    information = metadata['rosbag2_bagfile_information']
    information['version'] = 5
    infinite = {'sec': 9223372036, 'nsec': 854775807}
    profile = {
        'history': 1,
        'depth': 7,
        'reliability': 2,
        'durability': 1,
        'deadline': infinite,
        'lifespan': infinite,
        'liveliness': 1,
        'liveliness_lease_duration': infinite,
        'avoid_ros_namespace_conventions': False,
    }
    text = yaml.safe_dump([profile])
    for entry in information['topics_with_message_count']:
        entry['topic_metadata']['offered_qos_profiles'] = text
        del entry['topic_metadata']['type_description_hash']
    (source / 'metadata.yaml').write_text(yaml.safe_dump(metadata))
    with closing(sqlite3.connect(source / 'in.db3')) as database, database:
        database.execute('UPDATE topics SET offered_qos_profiles = ?', (text,))
    profile |= {
        'history': 'keep_last',
        'reliability': 'best_effort',
        'durability': 'transient_local',
        'liveliness': 'automatic',
    }
    topics, _ = read_bag(source)
    for storage in ('sqlite3', 'mcap'):
        add_foot_poses(source, tmp_path / storage, storage=storage)
        new_topics, _ = read_bag(tmp_path / storage)
        assert {name: new_topics[name] for name in topics} == topics
        new = yaml.safe_load((tmp_path / storage / 'metadata.yaml').read_text())
        for entry in new['rosbag2_bagfile_information']['topics_with_message_count'][
            :2
        ]:
            assert entry['topic_metadata']['offered_qos_profiles'] == [profile]
