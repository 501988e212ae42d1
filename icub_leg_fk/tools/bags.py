"""Opening a recording for `leg_fk bag` and `plot`: by rosbags, or one line on what is wrong.

rosbags (https://ternaris.gitlab.io/rosbags/) reads rosbag2 directories and single .mcap and .db3
files. What it would pass over, or refuse without a name, is looked at first.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
import os
from pathlib import Path
import re
import tempfile
from typing import Any

from icub_leg_fk.errors import InputFileError, MissingDependencyError
import yaml

DEFAULT_TOPIC = '/joint_states'
JOINT_STATE = 'sensor_msgs/msg/JointState'
METADATA = 'metadata.yaml'

_TAIL = 1 << 20  # bytes of an MCAP file, with its summary
_CLEAN = re.compile(r'/?(?!/)[A-Za-z0-9._/ +@:,=-]*')  # what also sqlite takes as it is
_MEND = {'.mcap': '`mcap recover` may mend it', '.db3': '`ros2 bag reindex` may mend it'}


def import_rosbags() -> tuple[Any, Any]:
    """Return rosbags' modules for bags and for message types."""
    try:
        from rosbags import rosbag2, typesys
    except ImportError as error:
        raise MissingDependencyError(
            'rosbags is not installed, and bags need it: pip install "rosbags>=0.11.9,<0.12" (on '
            'Ubuntu in a virtual environment made with --system-site-packages)') from error
    return rosbag2, typesys


@contextmanager
def open_bag(path: str | Path) -> Iterator[Any]:
    """Give a rosbags reader of a rosbag2 directory or of one of its files."""
    path, (rosbag2, _) = Path(path), import_rosbags()
    shown = os.fsencode(path).decode(errors='backslashreplace')
    _look_first(path, shown)
    with tempfile.TemporaryDirectory() as scratch:
        try:
            reader: Any = rosbag2.Reader(_clean(path, Path(scratch)))
            reader.open()
        except Exception as error:
            raise unreadable(path, error) from error
        try:
            _refuse_other_than_cdr(shown, {
                connection.topic: connection.ext.serialization_format
                for storage in getattr(reader.storage, 'storages', [reader.storage])
                for connection in storage.connections})
            if not isinstance(reader.storage.metadata.custom or {}, dict) or not all(
                    isinstance(connection.msgcount, int) for connection in reader.connections):
                raise unreadable(path, ValueError(f'{METADATA} has values of the wrong type'))
            yield reader
        finally:
            reader.close()


def messages(reader: Any, path: str | Path, connections: Sequence[Any]
             ) -> Iterator[tuple[Any, int, bytes]]:
    """Yield connection, time of recording [ns] and CDR bytes of each message."""
    try:
        yield from reader.messages(connections=connections)
    except Exception as error:
        raise unreadable(path, error) from error


def joint_connections(reader: Any, path: str | Path, topic: str | None) -> list[Any]:
    """Return the connections of a topic, or else `/joint_states`, or the only one there is."""
    connections = [connection for connection in reader.connections
                   if connection.msgtype == JOINT_STATE]
    known = sorted({connection.topic for connection in connections})
    name = topic or (known[0] if len(known) == 1 else DEFAULT_TOPIC)
    if name not in known:
        there = (f'--joint-topic can be {", ".join(known)}' if known
                 else f'it has no topic of type {JOINT_STATE}')
        raise InputFileError(f'{path}: no joint states on {name}; {there}')
    return [connection for connection in connections if connection.topic == name]


def unreadable(path: str | Path, error: Exception) -> InputFileError:
    """Return the one line on a recording that rosbags cannot read, with what mends it."""
    path = Path(path)
    reason = (' '.join(str(error).split()) or type(error).__name__).rstrip('.')
    mend = _MEND.get(path.suffix, 'allowed: a rosbag2 directory, or a .mcap or .db3 file')
    if path.is_dir():
        endings = {suffix for entry in path.iterdir() for suffix in entry.suffixes} & _MEND.keys()
        if not endings:
            reason, mend = f'it has no {METADATA}', 'it is not a rosbag2 recording'
        elif (path / METADATA).is_file():
            mend = _MEND[min(endings, key='.db3'.__eq__)]
        else:
            reason = f'it has no {METADATA}, as when the recorder was killed'
            mend = (f'give its file alone, or let `ros2 bag reindex {path}` write one'
                    if endings == {'.db3'} else '`mcap recover` mends its file, then '
                    f'`ros2 bag reindex {path}` writes one')
    return InputFileError(f'{path}: cannot be read: {reason}; {mend}')


def _look_first(path: Path, shown: str) -> None:
    """Refuse what is no recording of ROS 2, or not all of one, where rosbags would not say so."""
    def wrong(reason: str) -> InputFileError:
        return InputFileError(f'{shown}: {reason}')

    if not path.exists():
        raise wrong('there is no such file or directory')
    files = [path]
    if path.is_dir():
        files = sorted(entry for entry in path.iterdir() if entry.suffix in _MEND)
    elif path.suffix == '.zstd':
        raise wrong('is a compressed file alone; give its directory, or decompress it: zstd -d')
    else:
        with path.open('rb') as stream:
            if stream.read(7) == b'#ROSBAG':
                raise wrong('is a ROS 1 bag; `rosbags-convert` makes a ROS 2 recording of it')
    encodings: dict[str, str] = {}
    for file in files:
        log = file.with_name(f'{file.name}-wal')
        if file.suffix == '.db3' and log.is_file() and log.stat().st_size:
            raise wrong(f'{log.name} holds messages that are not in {file.name} yet; this brings '
                        f"them in: sqlite3 {file.name} 'PRAGMA wal_checkpoint(TRUNCATE)'")
        if file.suffix == '.mcap':
            encodings |= _encodings_of_other_mcap(file)
    if 'ros1' in encodings.values():
        raise wrong('is an MCAP file of ROS 1 messages; allowed: of ROS 2')
    with suppress(Exception):  # of a damaged file rosbags will say what is wrong
        bag = yaml.safe_load((path / METADATA).read_text(encoding='utf-8'))
        for topic in bag['rosbag2_bagfile_information']['topics_with_message_count']:
            about = topic['topic_metadata']
            encodings[about['name']] = about['serialization_format']
    _refuse_other_than_cdr(shown, encodings)


def _refuse_other_than_cdr(shown: str, encodings: Mapping[str, str]) -> None:
    """Refuse a recording that has other encodings, which are given by topic, than ROS 2's."""
    if odd := sorted(f'{topic} ({encoding})' for topic, encoding in encodings.items()
                     if encoding != 'cdr'):
        raise InputFileError(f'{shown}: the messages of {", ".join(odd)} are not CDR; allowed: '
                             'recordings of ROS 2, which are')


def _encodings_of_other_mcap(file: Path) -> dict[str, str]:
    """Return the encodings by topic that an MCAP file has that is not of ROS 2, by their looks.

    rosbags tells no more of such a file than that its profile is another.
    """
    with file.open('rb') as stream:
        head = stream.read(4096)
        stream.seek(max(0, stream.seek(0, os.SEEK_END) - _TAIL))
        tail = stream.read()
    profile = head[21:21 + int.from_bytes(head[17:21], 'little')]
    if profile == b'ros2' or not head.startswith(b'\x89MCAP0\r\n'):
        return {}
    return {topic.decode(): encoding.decode() for topic, encoding in re.findall(
        rb'([!-~]+)[\4\x08\x0a]\0\0\0(json|ros1|cbor|protobuf|flatbuffer)', tail)}


def _clean(path: Path, scratch: Path) -> Path:
    """Return a path that every library takes: itself, or links to it in a scratch directory."""
    if _CLEAN.fullmatch(str(path)):
        return path
    clean = scratch / f'bag{path.suffix if path.suffix in _MEND else ""}'
    if path.is_dir():
        clean.mkdir()
        for entry in path.iterdir():
            (clean / entry.name).symlink_to(entry.resolve())
    else:
        clean.symlink_to(path.resolve())
    return clean
