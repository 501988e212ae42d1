"""Recordings of rosbag2, read and written by rosbags: each message, or one line on why not.

rosbags (https://ternaris.gitlab.io/rosbags/) reads rosbag2 directories and single .mcap and .db3
files. What it would pass over, or refuse without a name, is looked at first.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import islice
import os
from pathlib import Path
import re
import sqlite3
import sys
import tempfile
from types import ModuleType
from typing import Any

from icub_leg_fk.errors import (
    InputFileError,
    MalformedMessageError,
    MissingDependencyError,
    OutputFileError,
)
from icub_leg_fk.kinematics.input_bytes import first_bytes
from icub_leg_fk.stream.cdr import JOINT_STATE, read_layout
from icub_leg_fk.tools.output_file import is_bag, whole_path
from icub_leg_fk.tools.progress import Progress
import yaml

DEFAULT_TOPIC = '/joint_states'
STRING = 'std_msgs/msg/String'
METADATA = 'metadata.yaml'
STORAGES = {'.mcap': 'mcap', '.db3': 'sqlite3'}

Connection = Any  # of rosbags: a topic of a recording, its type and QoS

_MEND = {
    '.mcap': '`mcap recover` may mend it',
    '.db3': '`ros2 bag reindex` may mend it',
}
_BEGINNINGS = {  # of files, by which they are known
    '.mcap': ('an MCAP file', b'\x89MCAP0\r\n'),
    '.db3': ('an SQLite database', b'SQLite format 3\0'),
}
_CLEAN = re.compile(r'/?(?!/)[A-Za-z0-9._/ +@:,=-]*')  # what also sqlite takes as it is
_MOST_METADATA = 1 << 24  # bytes
_TAIL = 1 << 20  # bytes of an MCAP file, with its summary
_MCAP_TOPIC = re.compile(
    rb'([!-~]+)[\4\x08\x0a]\0\0\0(json|ros1|cbor|protobuf|flatbuffer)'
)
_PROGRESS = 1000  # messages between two looks


def import_rosbags() -> ModuleType:
    """Return the package rosbags, with its modules for bags, types of messages, and QoS."""
    try:
        import rosbags.interfaces
        import rosbags.rosbag2
        import rosbags.typesys
    except ImportError as error:
        raise MissingDependencyError(
            'rosbags',
            'a bag',
            'pip install "rosbags>=0.11.9,<0.12" (on Ubuntu in a virtual '
            'environment made with --system-site-packages)',
        ) from error
    return rosbags


@contextmanager
def open_bag(path: str | Path) -> Iterator[Bag]:
    """Give a rosbag2 directory, or one of its files, for reading.

    Raises:
        InputFileError: it is no recording of ROS 2, or it is damaged; says what mends it.
    """
    rosbag2 = import_rosbags().rosbag2
    path = Path(path)
    _refuse_other_recordings(path)
    with tempfile.TemporaryDirectory() as scratch:
        try:
            reader = rosbag2.Reader(_clean_path(path, Path(scratch)))
            reader.open()
        except Exception as error:
            raise _unreadable(path, error) from error
        try:
            yield Bag(path, reader)
        finally:
            reader.close()


class Bag:
    """A recording that is open for reading.

    People edit the QoS in metadata.yaml so that a bag plays. rosbags pairs the topics there with
    those of the files only where their QoS are equal, and passes over the messages of the others.
    So it is asked for the topics of the files, and what it gives goes by what metadata.yaml says.

    Attributes:
        path: path of the recording.
        connections: its topics as metadata.yaml describes them, or as the files do what it leaves
            out; each with the number of messages that the files hold.
        custom_data: what its metadata keeps by name.
        span: time of the first and the last message [ns].
        notes: what a user should know of it, one line each.
    """

    def __init__(self, path: Path, reader: Any) -> None:
        self.path = path
        self._reader = reader
        self._stored = stored = _stored_connections(reader)
        listed = list(reader.connections)
        _refuse_odd_metadata(path, reader)
        _refuse_other_than_cdr(
            path, {each.topic: each.ext.serialization_format for each in stored}
        )
        pairs = _paired(stored, listed)
        held = Counter[int]()
        for each in stored:
            held[pairs[each.id].id] += each.msgcount
        paired_ids = {each.id for each in pairs.values()}
        there = [each for each in listed if each.id in paired_ids or not each.msgcount]
        described = {each.id: each for each in (*there, *pairs.values())}
        counted = {
            id_: each._replace(msgcount=held[id_]) for id_, each in described.items()
        }
        self._connection_of = {id_: counted[each.id] for id_, each in pairs.items()}
        self.connections = list(counted.values())
        self.custom_data = dict(reader.storage.metadata.custom or {})
        self.span = (reader.start_time, max(reader.start_time, reader.end_time - 1))
        self.notes = _notes_on_counts(reader.message_count, listed, self.connections)

    def joint_connections(
        self, topics: Sequence[str], joints: Iterable[str]
    ) -> list[Connection]:
        """Return those of topics of joint states, or of `/joint_states`, or of the only one.

        Args:
            topics: the topics; the default if none is named.
            joints: the joints that are looked for; a refusal says on which topics they are.

        Raises:
            InputFileError: there are no joint states on one of them; lists the others.
        """
        known = self.topics(JOINT_STATE)
        chosen = list(topics) or (known if len(known) == 1 else [DEFAULT_TOPIC])
        for topic in chosen:
            if topic not in known:
                fault = f'no joint states on {topic}; {self.topics_of(joints)}'
                raise InputFileError(str(self.path), fault)
        return self.connections_of(JOINT_STATE, chosen)

    def topics_of(self, joints: Iterable[str]) -> str:
        """Return the topics of joint states in words, those with some joints by themselves."""
        known = self.topics(JOINT_STATE)
        if not known:
            return f'it has no topic of type {JOINT_STATE}'
        wanted = set(joints)
        fitting = [name for name in known if wanted & set(self.joint_names([name]))]
        if not fitting or fitting == known:
            return f'--joint-topic can be {", ".join(known)}'
        others = [name for name in known if name not in fitting]
        return (
            f'--joint-topic can be {", ".join(fitting)} (which has joints of these chains), '
            f'{", ".join(others)}'
        )

    def joint_names(self, topics: Collection[str]) -> tuple[str, ...]:
        """Return the joints that the first messages of some topics have."""
        names: dict[str, None] = {}
        for each in self.connections_of(JOINT_STATE, topics):
            for _, _, data in islice(self.messages([each]), 1):
                with suppress(MalformedMessageError):
                    names.update(dict.fromkeys(read_layout(data).names))
        return tuple(names)

    def topics(self, message_type: str) -> list[str]:
        """Return the topics of a type."""
        return sorted(
            {each.topic for each in self.connections if each.msgtype == message_type}
        )

    def connections_of(
        self, message_type: str, topics: Collection[str]
    ) -> list[Connection]:
        """Return those of some topics and a type."""
        return [
            each
            for each in self.connections
            if each.topic in topics and each.msgtype == message_type
        ]

    def messages(
        self, connections: Iterable[Connection], progress: Progress | None = None
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield connection, time of recording [ns] and CDR bytes of each message.

        Raises:
            InputFileError: the recording is damaged, or holds fewer messages than it counts.
        """
        wanted = {each.id: each.msgcount for each in connections}
        stored = [
            each for each in self._stored if self._connection_of[each.id].id in wanted
        ]
        if not stored:  # which rosbags would take for all
            return
        expected = sum(wanted.values())
        read = 0
        try:
            for connection, timestamp, data in self._reader.messages(stored):
                if progress is not None and read % _PROGRESS == 0:
                    progress(read / max(expected, read))
                yield self._connection_of[connection.id], timestamp, data
                read += 1
        except Exception as error:
            raise _unreadable(self.path, error) from error
        if read != expected:
            raise _unreadable(
                self.path,
                ValueError(
                    f'it counts {expected} messages on these topics, and {read} were read'
                ),
            )


@contextmanager
def new_bag(path: str | Path, storage: str, *, force: bool) -> Iterator[Any]:
    """Give a writer of rosbags; the recording takes its place, whole, when the block ends well.

    Args:
        path: directory to make, or a file if its name ends in .mcap or .db3.
        storage: `mcap` or `sqlite3`.
        force: whether a recording that is there is replaced.

    Raises:
        OutputFileError: it cannot be written, or must not be.
    """
    rosbag2 = import_rosbags().rosbag2
    with whole_path(path, force=force, may_replace=is_bag) as place:
        is_file = place.suffix in STORAGES
        directory = place.with_name(f'{place.stem}.directory') if is_file else place
        try:
            with rosbag2.Writer(
                directory,
                version=rosbag2.Writer.VERSION_LATEST,
                storage_plugin=rosbag2.StoragePlugin[storage.upper()],
            ) as writer:
                yield writer
        except (sqlite3.Error, rosbag2.WriterError) as error:
            raise OutputFileError(str(path), f'cannot be written: {error}') from error
        if is_file:
            (file,) = directory.glob(f'*{place.suffix}')
            file.rename(place)


def namespace_of(topics: Iterable[str]) -> str:
    """Return the namespace that topics share: empty, or with a slash before it."""
    return os.path.commonpath([os.path.dirname(topic) for topic in topics]).rstrip('/')


def reliable_qos(depth: int) -> Any:
    """Return the QoS with which the node offers its topics."""
    interfaces = import_rosbags().interfaces
    forever = interfaces.QosTime(2147483647, 4294967295)
    return interfaces.Qos(
        interfaces.QosHistory.KEEP_LAST,
        depth,
        interfaces.QosReliability.RELIABLE,
        interfaces.QosDurability.VOLATILE,
        forever,
        forever,
        interfaces.QosLiveliness.AUTOMATIC,
        forever,
        False,
    )


def _stored_connections(reader: Any) -> list[Connection]:
    """Return the topics of the files: of several that are alike one, with the messages of all."""
    if not hasattr(reader.storage, 'storages'):  # a single file
        return list(reader.connections)
    merged: dict[tuple[str, ...], Connection] = {}
    for storage in reader.storage.storages:
        for each in storage.connections:
            key = each.topic, each.msgtype, repr(each.ext)
            if key in merged:
                total = merged[key].msgcount + each.msgcount
                merged[key] = merged[key]._replace(msgcount=total)
            else:  # with an id that metadata.yaml does not have
                merged[key] = each._replace(id=-1 - len(merged))
    return list(merged.values())


def _paired(
    stored: Iterable[Connection], listed: Iterable[Connection]
) -> dict[int, Connection]:
    """Return by the ids of the files' topics what metadata.yaml lists them as, or themselves."""
    by_topic: dict[tuple[str, str], list[Connection]] = {}
    for each in listed:
        by_topic.setdefault((each.topic, each.msgtype), []).append(each)
    pairs = {}
    for each in stored:
        same_topic = by_topic.get((each.topic, each.msgtype), [each])
        same_qos = [other for other in same_topic if other.ext == each.ext]
        pairs[each.id] = (same_qos or same_topic)[0]
    return pairs


def _notes_on_counts(
    total: int, listed: Iterable[Connection], held: Iterable[Connection]
) -> list[str]:
    """Return a note if metadata.yaml counts other messages than the files hold."""
    in_metadata = Counter({'in all': total})
    in_files = Counter({'in all': sum(each.msgcount for each in held)})
    for each in listed:
        in_metadata[each.topic] += each.msgcount
    for each in held:
        in_files[each.topic] += each.msgcount
    faults = [
        f'{topic} {in_metadata[topic]} and {in_files[topic]}'
        for topic in in_metadata | in_files
        if in_metadata[topic] != in_files[topic]
    ]
    if not faults:
        return []
    return [
        f'{METADATA} counts other messages than its files hold ({", ".join(faults)}); all of '
        'the files were read'
    ]


def _unreadable(path: Path, error: Exception) -> InputFileError:
    """Return the one line on a recording that rosbags cannot read, with what mends it."""
    reason = ' '.join(str(error).split()).rstrip('.') or type(error).__name__
    is_other_name = not reason.isascii() and sys.getfilesystemencoding() != 'utf-8'
    if isinstance(error, UnicodeError) or is_other_name:
        mend = 'where the locale is not UTF-8, set PYTHONUTF8=1'
    elif path.is_dir():
        reason, mend = _reason_and_mend(path, reason)
    else:
        mend = _MEND.get(
            path.suffix, 'allowed: a rosbag2 directory, or a .mcap or .db3 file'
        )
    return InputFileError(str(path), f'cannot be read: {reason}; {mend}')


def _reason_and_mend(directory: Path, reason: str) -> tuple[str, str]:
    """Return why a directory cannot be read, and what mends it; `reason` is what rosbags says."""
    names = [entry.name for entry in directory.iterdir()]
    is_mcap = any('.mcap' in name for name in names)
    is_sqlite = any('.db3' in name for name in names)
    if METADATA in names:
        if 'version' in reason:
            return reason, 'a newer rosbags may read it; its files alone can be given'
        if not is_mcap and not is_sqlite:
            return reason, 'its files must be in the same directory'
        return reason, _MEND['.mcap' if is_mcap else '.db3']
    if not is_mcap and not is_sqlite:
        return f'it has no {METADATA}', 'it is not a rosbag2 recording'
    reindex = f'`ros2 bag reindex {directory}`'
    mend = f'`mcap recover` mends its file, then {reindex} writes one'
    if not is_mcap:
        mend = f'give its file alone, or let {reindex} write one'
    return f'it has no {METADATA}, as when the recorder was killed', mend


def _refuse_other_recordings(path: Path) -> None:
    """Refuse what is no recording of ROS 2, or not all of one, where rosbags would not say so."""
    files = [path]
    if path.is_dir():
        files = sorted(entry for entry in path.iterdir() if entry.suffix in STORAGES)
    elif path.suffix == '.zstd':
        raise InputFileError(
            str(path),
            'is a compressed file alone; give its directory, or decompress it: zstd -d',
        )
    elif first_bytes(path, 7) == b'#ROSBAG':
        raise InputFileError(
            str(path), 'is a ROS 1 bag; `rosbags-convert` makes a ROS 2 recording of it'
        )
    encodings = _encodings_in_metadata(path / METADATA)
    for file in files:
        _refuse_other_content(path, file)
        if file.suffix == '.db3':
            _refuse_waiting_messages(path, file)
        if file.suffix == '.mcap':
            encodings |= _encodings_of_other_mcap(file)
    if 'ros1' in encodings.values():
        raise InputFileError(
            str(path), 'is an MCAP file of ROS 1 messages; allowed: of ROS 2'
        )
    _refuse_other_than_cdr(path, encodings)


def _refuse_other_content(path: Path, file: Path) -> None:
    """Refuse a file that has nothing of what its name says, and which nothing mends."""
    if file.suffix not in _BEGINNINGS:
        return
    kind, beginning = _BEGINNINGS[file.suffix]
    head = first_bytes(file, len(beginning))
    if head == beginning:
        return
    place = '' if file == path else f'{file.name} in it '
    found = f'is not {kind}' if head else 'is an empty file'
    raise InputFileError(str(path), place + found)


def _refuse_waiting_messages(path: Path, file: Path) -> None:
    """Refuse a database some of whose messages are in the log beside it still."""
    log = file.with_name(f'{file.name}-wal')
    if log.is_file() and log.stat().st_size:
        raise InputFileError(
            str(path),
            (
                f'{log.name} holds messages that are not in {file.name} yet; this brings them in: '
                f"sqlite3 {file.name} 'PRAGMA wal_checkpoint(TRUNCATE)'"
            ),
        )


def _refuse_other_than_cdr(path: Path, encodings: Mapping[str, str]) -> None:
    """Refuse a recording that has other encodings, which are given by topic, than ROS 2's."""
    odd = [
        f'{topic} ({encoding})'
        for topic, encoding in encodings.items()
        if encoding != 'cdr'
    ]
    if odd:
        raise InputFileError(
            str(path),
            f'the messages of {", ".join(sorted(odd))} are not CDR; '
            'allowed: recordings of ROS 2, which are',
        )


def _refuse_odd_metadata(path: Path, reader: Any) -> None:
    """Refuse values in metadata.yaml that rosbags takes as they are, but are of no use."""
    counts = [each.msgcount for each in reader.connections]
    counts.append(reader.message_count)
    is_usable = isinstance(reader.storage.metadata.custom or {}, dict)
    if not is_usable or not all(isinstance(count, int) for count in counts):
        raise _unreadable(path, ValueError(f'{METADATA} has values of the wrong type'))


def _encodings_in_metadata(file: Path) -> dict[str, str]:
    """Return the encodings by topic that metadata.yaml names, if it can be read."""
    encodings = {}
    with suppress(Exception):
        bag = yaml.safe_load(file.read_text(encoding='utf-8'))[
            'rosbag2_bagfile_information'
        ]
        for topic in bag['topics_with_message_count']:
            about = topic['topic_metadata']
            encodings[about['name']] = about['serialization_format']
    return encodings


def _encodings_of_other_mcap(file: Path) -> dict[str, str]:
    """Return the encodings by topic that an MCAP file has that is not of ROS 2, by their looks.

    rosbags tells no more of such a file than that its profile is another.
    """
    head = first_bytes(file, 4096)
    profile_end = 21 + int.from_bytes(head[17:21], 'little')
    profile = head[21:profile_end]
    if profile == b'ros2' or not head.startswith(b'\x89MCAP0\r\n'):
        return {}
    with file.open('rb') as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(0, size - _TAIL))
        tail = stream.read()
    return {
        topic.decode(): encoding.decode()
        for topic, encoding in _MCAP_TOPIC.findall(tail)
    }


def _clean_path(path: Path, scratch: Path) -> Path:
    """Return a path that every library takes: itself, or links to it in a scratch directory."""
    metadata = path / METADATA
    is_plain = not metadata.is_file() or first_bytes(metadata, _MOST_METADATA).isascii()
    if is_plain and _CLEAN.fullmatch(str(path)):
        return path
    ending = path.suffix if path.suffix in STORAGES else ''
    clean = scratch / f'bag{ending}'
    if not path.is_dir():
        clean.symlink_to(path.resolve())
        return clean
    clean.mkdir()
    for entry in path.iterdir():
        (clean / entry.name).symlink_to(entry.resolve())
    if not is_plain:  # rosbags reads it in the encoding of the locale, whatever that is
        with suppress(yaml.YAMLError):
            escaped = yaml.safe_dump(yaml.safe_load(metadata.read_bytes()))
            (clean / METADATA).unlink()
            (clean / METADATA).write_text(escaped)
    return clean
