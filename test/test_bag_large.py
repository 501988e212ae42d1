"""`leg_fk bag` on bags that do not fit into memory: huge chunks, huge messages, wild disorder."""

import struct
import subprocess
import sys

from bag_files import (
    highlevel,
    joint_state,
    LEFT_POSE,
    LEGS,
    read_bag,
    SECOND,
    START,
    string,
    TYPES,
)
from icub_leg_fk.tools.bags.time_queue import TimeQueue
from leg_fk_process import assert_one_line_complaint, leg_fk
import pytest

mcap_writer = pytest.importorskip('mcap.writer')

LARGEST = 120  # MB of memory; 200 are promised
MB = 1_000_000
WITH_PEAK = ('import sys; from icub_leg_fk.tools.leg_fk import main; status = main(); '
             'peak, = (line for line in open("/proc/self/status") if line.startswith("VmHWM")); '
             'print(peak.split()[1], file=sys.stderr); sys.exit(status)')


def write_mcap(path, messages, chunk_size, compression='none'):
    """Write (topic, time, data) with the mcap library; topics are /joint_states or texts."""
    codec = mcap_writer.CompressionType[compression.upper()]
    writer = mcap_writer.Writer(str(path), chunk_size=chunk_size, compression=codec)
    writer.start('ros2', 'a robot')
    channels = {}
    for topic, time, data in messages:
        if topic not in channels:
            kind = 'sensor_msgs/msg/JointState' if topic == '/joint_states' else (
                'std_msgs/msg/String')
            definition, _ = TYPES.generate_msgdef(kind, ros_version=2)
            schema = writer.register_schema(kind, 'ros2msg', definition.encode())
            channels[topic] = writer.register_channel(topic, 'cdr', schema)
        writer.add_message(channels[topic], time, data, time)
    writer.finish()
    return path


def recording(count, text='x', every=10):
    """Yield joint states, and a text behind some of them."""
    for i in range(count):
        time = START + i * SECOND // 1000
        yield '/joint_states', time, joint_state(time, LEGS)
        if i % every == 0:
            yield '/text', time + 10, string(text)


def copied(source, target, *words, status=0):
    """Convert a bag, check that it needs little memory, and return what it printed."""
    done = subprocess.run([sys.executable, '-c', WITH_PEAK, 'bag', source, target, *words],
                          capture_output=True, text=True, timeout=120)
    assert done.returncode == status, done
    assert int(done.stderr) / 1000 < LARGEST, done
    return done.stdout


@pytest.mark.parametrize('compression', ['none', 'zstd', 'lz4'])
def test_a_huge_chunk_is_read_like_small_ones(tmp_path, compression):
    messages = [*recording(500, 'y' * 300_000), ('/text', START + SECOND, string('z' * 9 * MB))]
    one = write_mcap(tmp_path / 'one.mcap', messages, 100 * MB, compression)
    many = write_mcap(tmp_path / 'many.mcap', messages, MB, compression)
    for name, file in (('one', one), ('many', many)):
        copied(file, tmp_path / f'{name}_out.mcap')
    found = read_bag(tmp_path / 'one_out.mcap')
    assert found == read_bag(tmp_path / 'many_out.mcap')
    assert sum(topic == LEFT_POSE for topic, _, _ in found[1]) == 500
    assert [message for message in found[1] if 'foot' not in message[0]] == sorted(
        messages, key=lambda message: message[1])


@pytest.mark.parametrize('compression', ['none', 'zstd', 'lz4'])
def test_a_recorder_that_was_killed_in_a_huge_chunk(tmp_path, compression):
    """What there is of the chunk is read, its channels too, though there is no summary."""
    messages = list(recording(2000, ''.join(map(str, range(40_000))), every=40))
    file = write_mcap(tmp_path / 'in.mcap', messages, 100 * MB, compression)
    data = file.read_bytes()
    file.write_bytes(data[:3 * len(data) // 4])
    done = leg_fk('bag', file, tmp_path / 'out.mcap')
    assert (done.returncode, done.stderr) == (1, ''), done
    found = [row for row in read_bag(tmp_path / 'out.mcap')[1] if 'foot' not in row[0]]
    assert len(messages) / 2 < len(found) < len(messages)
    assert found == messages[:len(found)]


def test_a_huge_chunk_that_does_not_match_its_checksum_is_left_out(tmp_path):
    messages = list(recording(100, 'y' * 900_000))
    file = write_mcap(tmp_path / 'in.mcap', messages, 100 * MB)
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    done = leg_fk('bag', file, tmp_path / 'out.mcap')
    assert done.returncode == 1, done
    assert 'does not match its checksum' in done.stdout
    assert read_bag_count(tmp_path / 'out.mcap') == 0


@pytest.mark.parametrize('compression', ['none', 'zstd', 'lz4'])
def test_a_cut_off_huge_chunk_that_holds_more_than_it_says_is_refused(tmp_path, compression):
    """Its header is damaged: behind the record's number and length and two times is its size."""
    text = ''.join(map(str, range(20_000)))
    file = write_mcap(tmp_path / 'in.mcap', recording(2000, text, every=10), 100 * MB, compression)
    data = bytearray(file.read_bytes())
    chunk = data.index(b'\x06', 8 + 9 + struct.unpack_from('<Q', data, 9)[0])
    size, = struct.unpack_from('<Q', data, chunk + 9 + 16)
    assert size > 15 * MB
    struct.pack_into('<Q', data, chunk + 9 + 16, 9 * MB)
    file.write_bytes(data[:9 * len(data) // 10])
    done = leg_fk('bag', file, tmp_path / 'out.mcap')
    assert_one_line_complaint(done, 'nothing can be read')  # for its topics were in that chunk


@pytest.mark.parametrize(('compression', 'library'), [('zstd', 'zstandard'), ('lz4', 'lz4.frame')])
def test_a_small_chunk_that_holds_a_gigabyte_is_refused_in_little_memory(tmp_path, compression,
                                                                         library):
    compress = pytest.importorskip(library).compress
    write_mcap(tmp_path / 'in.mcap', recording(10), MB, compression)
    file = tmp_path / 'in.mcap'
    data = bytearray(file.read_bytes())
    chunk = data.index(b'\x06', 8 + 9 + struct.unpack_from('<Q', data, 9)[0])
    head = data[chunk + 9:chunk + 9 + 32 + len(compression)]  # up to the size of the data
    struct.pack_into('<Q', head, 16, 1000)
    bomb = compress(bytes(1 << 30))
    assert len(bomb) < 5 * MB
    record = head + struct.pack('<Q', len(bomb)) + bomb
    file.write_bytes(data[:chunk] + b'\x06' + struct.pack('<Q', len(record)) + record
                     + data[chunk:])
    told = copied(file, tmp_path / 'out.mcap', status=1)
    assert f'{compression} data of more than 1000 bytes' in told
    assert read_bag_count(tmp_path / 'out.mcap') == 10 + 1 + 20


def read_bag_count(path):
    with highlevel.AnyReader([path], default_typestore=TYPES) as reader:
        return reader.message_count


def test_a_huge_message_outside_of_any_chunk(tmp_path):
    file = tmp_path / 'in.mcap'
    messages = [*recording(20), ('/text', START + SECOND, string('z' * 20 * MB))]
    writer = mcap_writer.Writer(str(file), use_chunking=False)
    writer.start('ros2', 'a robot')
    definition, _ = TYPES.generate_msgdef('sensor_msgs/msg/JointState', ros_version=2)
    schema = writer.register_schema('sensor_msgs/msg/JointState', 'ros2msg', definition.encode())
    channels = {topic: writer.register_channel(topic, 'cdr', schema)
                for topic in ('/joint_states', '/text')}
    for topic, time, data in messages:
        writer.add_message(channels[topic], time, data, time)
    writer.finish()
    copied(file, tmp_path / 'out.mcap')
    found = [row for row in read_bag(tmp_path / 'out.mcap')[1] if 'foot' not in row[0]]
    assert found == messages


def test_a_topic_without_a_clock_does_not_hold_everything_back(tmp_path):
    """Each chunk begins at time 0, so that none seems to be over before the end."""
    messages = []
    for i, (topic, time, data) in enumerate(recording(1200, 'y' * 600_000)):
        messages.append((topic, time, data))
        if i % 5 == 0:
            messages.append(('/no_clock', 0, string('x')))
    file = write_mcap(tmp_path / 'in.mcap', messages, MB)
    printed = copied(file, tmp_path / 'out.mcap')
    assert '1200  added on /foot_pose_publisher/left_foot/pose' in printed
    assert 'messages stay behind others that were recorded after them' in printed
    found = [row for row in read_bag(tmp_path / 'out.mcap')[1] if 'foot' not in row[0]]
    assert sorted(found) == sorted(messages)


def message(time, size=10):
    return 0, 0, time, time, bytes(size)


def test_messages_wait_for_earlier_ones():
    queue = TimeQueue()
    queue.put([message(5), message(9)])
    assert queue.take(until=5) == [message(5)]
    queue.put([message(6), message(12)])
    assert queue.take(until=9) == [message(6), message(9)]
    assert queue.take(until=11) == []
    assert queue.take(until=None) == [message(12)]
    assert queue.take(until=None) == []
    assert queue.late == 0


def test_messages_of_one_time_keep_their_order():
    queue = TimeQueue()
    queue.put([message(1, 1), message(3, 1)])
    queue.put([message(1, 2), message(3, 2)])
    assert [len(data) for *_, data in queue.take(until=None)] == [1, 2, 1, 2]


def test_a_full_queue_gives_out_the_earlier_half_and_counts_who_comes_too_late():
    queue = TimeQueue()
    queue.put([message(time, 2_000_000) for time in range(10, 30)])
    assert [row[2] for row in queue.take(until=0)] == list(range(10, 20))
    queue.put([message(3), message(18), message(19), message(25)])
    assert queue.late == 2
    assert [row[2] for row in queue.take(until=None)] == [3, 18, 19, *range(20, 26),
                                                          *range(25, 30)]
