"""What `leg_fk bag` writes, as libraries that are not ours see it: `mcap` and sqlite."""

from collections import Counter
from contextlib import closing
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


def read_mcap(file, **settings):
    """Return the summary of an MCAP file, and its messages as (topic, time, data)."""
    with file.open('rb') as stream:
        reader = reading.SeekingReader(stream, validate_crcs=True)
        assert reader.get_header().profile == 'ros2'
        messages = [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in reader.iter_messages(**settings)
        ]
        return reader.get_summary(), messages


def test_the_mcap_library_finds_every_message_with_its_index(bags):
    _, target = bags
    _, messages = read_bag(target)
    summary, found = read_mcap(target / 'out.mcap')
    assert found == messages
    _, poses = read_mcap(target / 'out.mcap', topics=[LEFT_POSE])
    assert poses == [message for message in messages if message[0] == LEFT_POSE]
    statistics = summary.statistics
    assert statistics.message_count == len(messages)
    assert statistics.chunk_count == len(summary.chunk_indexes) >= 3
    span = statistics.message_start_time, statistics.message_end_time
    assert span == (messages[0][1], messages[-1][1])
    counts = Counter({'/silent': 0})
    counts.update(topic for topic, _, _ in messages)
    in_statistics = {
        summary.channels[number].topic: count
        for number, count in statistics.channel_message_counts.items()
    }
    assert in_statistics == counts


def test_channels_and_schemas_are_as_rosbag2_writes_them(bags):
    source, target = bags
    old, new = channels_of(source / 'in.mcap'), channels_of(target / 'out.mcap')
    assert {topic: new[topic] for topic in old} == old
    for topic, message_type in ADDED.items():
        assert new[topic][:3] == ('cdr', message_type, 'ros2msg')


def channels_of(file):
    """Return by topic: encoding, name, encoding and text of the schema, QoS."""
    summary, _ = read_mcap(file)
    found = {}
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        found[channel.topic] = (
            channel.message_encoding,
            schema.name,
            schema.encoding,
            schema.data,
            channel.metadata['offered_qos_profiles'],
        )
    return found


@pytest.mark.parametrize('compression', ['ZSTD', 'LZ4', ''])
def test_bags_of_the_mcap_library_are_read(tmp_path, compression):
    """With publish times, sequence numbers, attachments and disorder, of which order is kept.

    One without chunks has records of kind 0x80 between, which anybody may have.
    """
    definition, _ = TYPES.generate_msgdef(JOINT_STATE, ros_version=2)
    topics = ('/joint_states', '/others')
    expected = []
    with (tmp_path / 'in.mcap').open('wb') as stream:
        writer = writing.Writer(
            stream,
            chunk_size=20_000,
            compression=writing.CompressionType[compression or 'NONE'],
            use_chunking=bool(compression),
        )
        writer.start('ros2', 'a robot')
        schema = writer.register_schema(JOINT_STATE, 'ros2msg', definition.encode())
        channels = [writer.register_channel(topic, 'cdr', schema) for topic in topics]
        for i in range(400):
            late = 7 if compression and i % 10 == 0 else 0
            time = START + 1_000_000 * (i + late)
            data = joint_state(time)
            writer.add_message(channels[i % 2], time, data, time - 500, i)
            expected.append((topics[i % 2], time, data))
            if not compression:
                stream.write(b'\x80' + (3).to_bytes(8, 'little') + b'abc')
        writer.add_attachment(START, START, 'calibration.txt', 'text/plain', b'1 2 3')
        writer.finish()
    add_foot_poses(tmp_path / 'in.mcap', tmp_path / 'out.mcap')
    _, found = read_mcap(tmp_path / 'out.mcap')
    expected.sort(key=lambda row: row[1])
    assert [row for row in found if row[0] in topics] == expected
    assert sum(topic == LEFT_POSE for topic, _, _ in found) == 200


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
