"""`leg_fk bag` on unfinished and damaged bags: what can be read is there, the rest is told."""

from contextlib import closing
import os
import random
import shutil
import sqlite3
import struct

from bag_files import (
    entries,
    joint_state,
    LEFT_POSE,
    poses_of,
    read_bag,
    SECOND,
    START,
    walk,
    write_bag,
)
from icub_leg_fk.tools.bags import mcap_large
from icub_leg_fk.tools.bags import mcap_records as mcap
from icub_leg_fk.tools.leg_fk import main
from leg_fk_process import assert_one_line_complaint, leg_fk
import pytest

FOOTER = 37  # bytes of footer and magic
BAD_TEXT = (r'rosbag2_bagfile_information: {storage_identifier: "\ud800", '
            'topics_with_message_count: []}')


def messages_of(target):
    """Return a new bag's own messages, and how many poses of the left foot it has."""
    _, messages = read_bag(target)
    return ([message for message in messages if 'foot_pose' not in message[0]],
            len(poses_of(messages, LEFT_POSE)))


def is_prefix(part, whole):
    return part == whole[:len(part)]


def is_subsequence(part, whole):
    rest = iter(whole)
    return all(message in rest for message in part)


def records(data):
    """Return (offset, number, end) of the records of an MCAP file."""
    at, found = 8, []
    while at < len(data) - 8:
        number, size = struct.unpack_from('<BQ', data, at)
        found.append((at, number, at + 9 + size))
        at += 9 + size
    return found


@pytest.fixture(scope='module', params=[None, 'storage'])
def whole(request, tmp_path_factory):
    """Return a bag of several chunks, plain or compressed, its messages and its file's bytes."""
    folder = tmp_path_factory.mktemp('whole')
    write_bag(folder / 'in', joints=walk(2500), compression=request.param)
    _, messages = read_bag(folder / 'in')
    data = (folder / 'in' / 'in.mcap').read_bytes()
    assert sum(number == mcap.CHUNK for _, number, _ in records(data)) >= 3
    return folder / 'in', messages, data


def test_an_mcap_file_cut_off_anywhere_gives_what_is_before(tmp_path, whole):
    _, messages, data = whole
    chunks = [(at, end) for at, number, end in records(data) if number == mcap.CHUNK]
    places = [chunks[0][1], chunks[1][0] + 5, chunks[1][0] + 60,
              (chunks[1][0] + chunks[1][1]) // 2, chunks[-1][1], len(data) - FOOTER,
              len(data) - 20]
    places += random.Random(1).sample(range(chunks[0][1], len(data)), 6)
    last = -1
    for number, place in enumerate(sorted(places)):
        (tmp_path / 'cut.mcap').write_bytes(data[:place])
        out = tmp_path / f'out{number}'
        done = leg_fk('bag', tmp_path / 'cut.mcap', out)
        assert (done.returncode, done.stderr) == (1, ''), (place, done)
        assert 'complete but for what could not be read:\n    cut.mcap ' in done.stdout
        found, poses = messages_of(out)
        assert is_prefix(found, messages), place
        assert poses == sum(topic == '/joint_states' for topic, _, _ in found)
        whole_chunks = sum(end <= place for _, end in chunks)
        assert len(found) >= (len(messages) if whole_chunks == len(chunks)
                              else len(messages) * whole_chunks // (len(chunks) + 1))
        assert len(found) >= last
        last = len(found)
    assert last == len(messages)


def test_a_cut_off_chunk_gives_the_messages_it_still_has(tmp_path, whole):
    _, messages, data = whole
    at, _, end = next(record for record in records(data) if record[1] == mcap.CHUNK)
    counts = []
    for place in ((at + end) // 2, (at + 4 * end) // 5):
        (tmp_path / 'cut.mcap').write_bytes(data[:place])
        leg_fk('bag', tmp_path / 'cut.mcap', tmp_path / f'out{place}')
        found, _ = messages_of(tmp_path / f'out{place}')
        assert is_prefix(found, messages)
        counts.append(len(found))
    assert 0 < counts[0] < counts[1]


def test_a_chunk_that_does_not_match_its_checksum_is_left_out(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(2500))
    leg_fk('bag', tmp_path / 'in', tmp_path / 'copy')  # rosbags writes no checksums
    file = tmp_path / 'copy' / 'copy_0.mcap'
    data = bytearray(file.read_bytes())
    at, _, end = [record for record in records(data) if record[1] == mcap.CHUNK][1]
    data[(at + end) // 2] ^= 1
    file.write_bytes(data)
    done = leg_fk('bag', tmp_path / 'copy', tmp_path / 'out', '--only-poses')
    assert done.returncode == 1, done
    assert f'chunk at byte {at + 49}: does not match its checksum' in done.stdout
    _, all_messages = read_bag(tmp_path / 'in')
    _, poses = read_bag(tmp_path / 'out')
    assert 0 < len(poses) // 2 < sum(topic == '/joint_states' for topic, _, _ in all_messages)


def test_chunks_behind_a_damaged_place_are_found_with_the_index(tmp_path, whole):
    _, messages, data = whole
    chunks = [(at, end) for at, number, end in records(data) if number == mcap.CHUNK]
    damaged = bytearray(data)
    damaged[chunks[1][0]:chunks[1][0] + 30] = bytes(30)
    (tmp_path / 'hole.mcap').write_bytes(damaged)
    done = leg_fk('bag', tmp_path / 'hole.mcap', tmp_path / 'out')
    assert done.returncode == 1, done
    assert f'unreadable from byte {chunks[1][0]} to {chunks[2][0]}' in done.stdout
    found, _ = messages_of(tmp_path / 'out')
    assert found[0] == messages[0] and found[-1] == messages[-1]
    assert len(messages) / 4 < len(found) < len(messages)
    assert is_subsequence(found, messages)


def damaged(data, dice):
    """Return a file's bytes with some of them changed, lost or added, near its ends above all."""
    data = bytearray(data)
    for _ in range(dice.choice((1, 1, 3, 30))):
        place = dice.choice((dice.randrange(len(data)), dice.randrange(min(400, len(data))),
                             len(data) - 1 - dice.randrange(min(1500, len(data)))))
        kind = dice.choice(('bit', 'number', 'number', 'lost', 'added'))
        if kind == 'bit':
            data[place] ^= 1 << dice.randrange(8)
        elif kind == 'number':
            data[place:place + 8] = dice.choice((b'\xff' * 8, bytes(8), dice.randbytes(8)))
        elif kind == 'lost':
            del data[place:place + dice.randrange(1, 300)]
        else:
            data[place:place] = dice.randbytes(dice.randrange(1, 50))
        data = data or bytearray(b'x')
    return bytes(data)


@pytest.mark.parametrize(('storage', 'compression', 'large'), [
    ('mcap', None, False), ('mcap', 'storage', False), ('mcap', 'file', False),
    ('mcap', None, True), ('mcap', 'storage', True),
    ('sqlite3', None, False), ('sqlite3', 'message', False)])
def test_no_damage_ends_in_an_exception(tmp_path, capsys, monkeypatch, storage, compression,
                                        large):
    """In this process, where an exception that is not one line for the user comes through."""
    if large:
        monkeypatch.setattr(mcap_large, '_LARGE', 1000)
    dice = random.Random(f'{storage} {compression}')
    write_bag(tmp_path / 'in', storage, joints=walk(60), compression=compression)
    file = next(path for path in (tmp_path / 'in').iterdir() if path.name != 'metadata.yaml')
    data = file.read_bytes()
    statuses = []
    for number in range(60):
        file.write_bytes(damaged(data, dice))
        status = main(['bag', str(tmp_path / 'in'), str(tmp_path / f'out{number}'), '--storage',
                       dice.choice(('mcap', 'sqlite3'))])
        statuses.append(status)
        output, errors = capsys.readouterr()
        assert errors.count('\n') == (status == 2), errors
        assert (tmp_path / f'out{number}').exists() == (status != 2), output
        assert '.partial' not in ' '.join(entries(tmp_path))
    assert len(set(statuses)) > 1 and set(statuses) <= {0, 1, 2}


@pytest.mark.parametrize('content', [b'', b'\x89MCAP', b'\x89MCAP0\r\n', b'nonsense' * 1000])
@pytest.mark.parametrize('name', ['bad.mcap', 'bad.db3', 'bad.mcap.zstd', 'bad.db3.zstd'])
def test_a_file_with_nothing_in_it_is_refused(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert_one_line_complaint(leg_fk('bag', tmp_path / name, tmp_path / 'out'),
                              f'{name}: nothing can be read')
    assert entries(tmp_path) == [name]


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_bag_without_metadata_is_read(tmp_path, storage):
    write_bag(tmp_path / 'in', storage, joints=walk(50))
    _, messages = read_bag(tmp_path / 'in')
    (tmp_path / 'in' / 'metadata.yaml').unlink()
    done = leg_fk('bag', tmp_path / 'in', tmp_path / 'out')
    assert done.returncode == 1
    assert 'metadata.yaml is missing' in done.stdout
    assert messages_of(tmp_path / 'out') == (messages, 50)


@pytest.mark.parametrize('text', ['', 'x: [', '- 1', 'rosbag2_bagfile_information: {version: 9}',
                                  '&a [*a]', '\x00', BAD_TEXT, 'rosbag2_bagfile_information: 5'])
def test_a_bag_with_broken_metadata_is_read(tmp_path, text):
    write_bag(tmp_path / 'in', joints=walk(5))
    _, messages = read_bag(tmp_path / 'in')
    (tmp_path / 'in' / 'metadata.yaml').write_text(text)
    done = leg_fk('bag', tmp_path / 'in', tmp_path / 'out')
    assert (done.returncode, done.stderr) == (1, ''), done
    assert 'metadata.yaml cannot be read' in done.stdout
    assert messages_of(tmp_path / 'out') == (messages, 5)


def test_a_missing_part_of_a_split_bag_is_told(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(5))
    metadata = tmp_path / 'in' / 'metadata.yaml'
    text = metadata.read_text().replace('- in.mcap', '- in.mcap\n  - in_1.mcap')
    metadata.write_text(text)
    done = leg_fk('bag', tmp_path / 'in', tmp_path / 'out')
    assert done.returncode == 1
    assert 'in_1.mcap is missing' in done.stdout
    assert messages_of(tmp_path / 'out')[1] == 5


def sqlite_bag(folder, count=3000):
    write_bag(folder / 'in', 'sqlite3', joints=walk(count))
    return folder / 'in' / 'in.db3', read_bag(folder / 'in')[1]


def test_a_sqlite_file_cut_off_gives_what_is_before(tmp_path):
    """But for the last pages: sqlite finds pages through others that it writes after them."""
    file, messages = sqlite_bag(tmp_path, 9000)
    data = file.read_bytes()
    for number, share in enumerate((0.4501, 0.7001, 0.9001)):
        file.write_bytes(data[:int(len(data) * share)])
        done = leg_fk('bag', tmp_path / 'in', tmp_path / f'out{number}')
        assert (done.returncode, done.stderr) == (1, ''), done
        assert 'in.db3 is cut off' in done.stdout
        assert 'in.db3 messages behind number' in done.stdout
        found, poses = messages_of(tmp_path / f'out{number}')
        assert is_subsequence(found, messages)
        assert poses == sum(topic == '/joint_states' for topic, _, _ in found)
        assert share - 0.2 < len(found) / len(messages) < share


@pytest.mark.parametrize('seed', range(4))
def test_overwritten_pages_of_a_sqlite_file_cost_little_more_than_themselves(tmp_path, seed):
    file, messages = sqlite_bag(tmp_path)
    data = bytearray(file.read_bytes())
    noise = random.Random(seed)
    for _ in range(5):
        page = noise.randrange(20, len(data) // 4096)
        data[4096 * page:4096 * (page + 1)] = noise.randbytes(4096)
    file.write_bytes(data)
    done = leg_fk('bag', tmp_path / 'in', tmp_path / 'out')
    assert (done.returncode, done.stderr) == (1, ''), done
    found, _ = messages_of(tmp_path / 'out')
    assert {message[0] for message in found} <= {'/joint_states', '/text'}
    assert len([message for message in found if message in set(messages)]) > 0.5 * len(messages)


def test_a_recorder_that_was_killed_leaves_its_write_ahead_log(tmp_path):
    """Messages that are only in the log are read too, and the recording is left as it is."""
    file, messages = sqlite_bag(tmp_path, 50)
    database = sqlite3.connect(file)
    database.execute('PRAGMA journal_mode = WAL')
    database.execute('INSERT INTO messages (topic_id, timestamp, data) '
                     'SELECT topic_id, timestamp + 1, data FROM messages')
    database.commit()
    shutil.copytree(tmp_path / 'in', tmp_path / 'killed')
    database.close()
    assert (tmp_path / 'killed' / 'in.db3-wal').stat().st_size
    (tmp_path / 'killed' / 'in.db3-shm').unlink()
    content = {file: file.read_bytes() for file in (tmp_path / 'killed').iterdir()}
    done = leg_fk('bag', tmp_path / 'killed', tmp_path / 'out')
    assert done.returncode == 0, done
    assert len(messages_of(tmp_path / 'out')[0]) == 2 * len(messages)
    assert {file: file.read_bytes() for file in (tmp_path / 'killed').iterdir()} == content


@pytest.mark.parametrize(('statement', 'status', 'told'), [
    ("UPDATE messages SET timestamp = 'abc' WHERE id = 5", 1, '1 messages have no topic, no time'),
    ('UPDATE messages SET timestamp = 1700000000.5 WHERE id = 5', 1, '1 messages have no topic'),
    ("UPDATE messages SET data = 'abc' WHERE id = 5", 1, '1 messages have no topic, no time'),
    ("UPDATE messages SET topic_id = 'x' WHERE id = 5", 1, '1 messages have no topic, no time'),
    ("UPDATE topics SET offered_qos_profiles = x'ff00'", 0, ''),
    ("UPDATE topics SET offered_qos_profiles = '- history: 1\n  depth: .inf\n'", 0, ''),
    ('UPDATE topics SET type_description_hash = 5', 0, ''),
    ("INSERT INTO topics VALUES (9, x'ff', 'a/msg/B', 'cdr', '', '')", 0, ''),
    ("UPDATE message_definitions SET encoded_message_definition = x'00ff'", 0, ''),
    ('CREATE TABLE t AS SELECT * FROM topics; DROP TABLE topics; ALTER TABLE t RENAME TO topics; '
     "INSERT INTO topics VALUES (9, NULL, 'a/msg/B', 'cdr', NULL, '')", 0, ''),
])
def test_values_of_a_wrong_type_cost_no_more_than_themselves(tmp_path, statement, status, told):
    file, messages = sqlite_bag(tmp_path, 30)
    with closing(sqlite3.connect(file)) as database:
        database.executescript(statement)
    for storage in ('sqlite3', 'mcap'):
        out = tmp_path / storage
        done = leg_fk('bag', tmp_path / 'in', out, '--storage', storage)
        assert (done.returncode, done.stderr) == (status, ''), done
        assert told in done.stdout
        found = len(list(out.iterdir())), done.stdout.split('\n')[1].split()
        assert found == (2, [str(len(messages) - status), 'messages', 'copied'])


def test_a_time_that_no_stamp_can_hold_gives_no_pose_and_is_copied(tmp_path):
    late = 5_000_000_000 * SECOND  # in 2128
    joints = [(late + i, joint_state(None if i % 2 else START)) for i in range(10)]
    write_bag(tmp_path / 'in', joints=joints, others=False)
    done = leg_fk('bag', tmp_path / 'in', tmp_path / 'out')
    assert (done.returncode, done.stderr) == (0, ''), done
    assert '5  joint states rejected: malformed' in done.stdout
    found, poses = messages_of(tmp_path / 'out')
    assert (len(found), poses) == (10, 5)


def flipped(tmp_path, compression, at):
    """Return a bag of two compressed chunks with one bit of the first one's header flipped."""
    write_bag(tmp_path / 'in', joints=walk(2500), compression='storage')
    file = tmp_path / 'in' / 'in.mcap'
    data = bytearray(file.read_bytes())
    data[data.index(compression) + at] ^= 1
    file.write_bytes(data)
    return file


def test_a_compression_with_a_misprint_is_not_passed_on(tmp_path):
    done = leg_fk('bag', flipped(tmp_path, b'zstd', 3), tmp_path / 'out')
    assert done.returncode == 1, done
    assert "unknown compression 'zste'" in done.stdout
    found, poses = messages_of(tmp_path / 'out')
    assert len(found) > 2000 and poses > 1000


def test_old_sqlite_bags_without_definitions_are_copied_as_they_are(tmp_path):
    """Schema 3, as up to Humble: no definitions, hashes or newer columns."""
    file, messages = sqlite_bag(tmp_path, 50)
    database = sqlite3.connect(file)
    database.executescript("""
        DROP TABLE message_definitions; DROP TABLE schema; DROP TABLE metadata;
        ALTER TABLE topics DROP COLUMN type_description_hash;
        CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
        INSERT INTO schema VALUES (3, 'humble');""")
    database.close()
    for storage in ('sqlite3', 'mcap'):
        done = leg_fk('bag', tmp_path / 'in', tmp_path / storage, '--storage', storage)
        assert done.returncode == 0, done
        assert messages_of(tmp_path / storage) == (messages, 50)


@pytest.mark.skipif(os.geteuid() == 0, reason='root may read everything')
def test_a_bag_that_may_not_be_read_is_one_line(tmp_path):
    write_bag(tmp_path / 'in', joints=walk(5))
    (tmp_path / 'in' / 'in.mcap').chmod(0)
    done = leg_fk('bag', tmp_path / 'in', tmp_path / 'out')
    assert (done.returncode, done.stderr.count('\n')) == (2, 1)
