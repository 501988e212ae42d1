"""Joint recordings: what joints and chains did over time, from a bag or a CSV file."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
import csv
from dataclasses import dataclass
from functools import cached_property
import math
from pathlib import Path
import struct
import sys
from typing import Any, NamedTuple

from icub_leg_fk.errors import InputFileError, LegFKError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.cdr import JOINT_STATE
from icub_leg_fk.stream.configuration import DEFAULT_TIMEOUT
from icub_leg_fk.stream.joint_input import JointInput, Look
from icub_leg_fk.stream.notes import Note, notes_of
from icub_leg_fk.tools.bags import (
    DEFAULT_TOPIC,
    import_rosbags,
    new_bag,
    open_bag,
)
from icub_leg_fk.tools.options import LARGEST, number
from icub_leg_fk.tools.progress import Progress
import numpy as np
from numpy.typing import NDArray

TIMES = ('time', 'Time', 'timestamp')
EPOCH = 1e8  # s; times beyond it count from 1970 and not from the start

_NANOSECONDS = 1_000_000_000  # in a second
_ENCAPSULATION = b'\x00\x01\x00\x00'  # CDR, little-endian

Messages = Iterable[
    tuple[int, bytes]
]  # time of recording [ns] and CDR bytes of a JointState


@dataclass(frozen=True)
class JointRecording:
    """Joint positions over time.

    Attributes:
        joint_names: n names.
        times: (N,) times [s], not decreasing.
        positions: (N, n) joint positions [rad or m].
    """

    joint_names: tuple[str, ...]
    times: Array
    positions: Array

    def first(self, seconds: float) -> JointRecording:
        """Return the part up to a time after the first sample [s]."""
        n = int(np.searchsorted(self.times, self.times[0] + seconds, side='right'))
        return JointRecording(self.joint_names, self.times[:n], self.positions[:n])

    def track(self, chain: Chain) -> ChainTrack:
        """Return what one chain did; its joints must be in the recording."""
        columns = [self.joint_names.index(name) for name in chain.joint_names]
        return ChainTrack(chain, self.times, self.positions[:, columns])


@dataclass(frozen=True)
class ChainTrack:
    """What one chain did over time.

    Attributes:
        chain: the chain.
        times: (N,) times [s].
        positions: (N, n) joint positions [rad or m].
        received: (N, 7) poses as a node sent them; None to compute them.
    """

    chain: Chain
    times: Array
    positions: Array
    received: Array | None = None

    @cached_property
    def poses(self) -> Array:
        """(N, 7) rows x, y, z [m], qx, qy, qz, qw of the tip in the root frame."""
        return (
            self.chain.poses(self.positions) if self.received is None else self.received
        )

    def nearest(self, time: float) -> int:
        """Return the index of the sample nearest to a time [s]."""
        return int(np.abs(self.times - time).argmin())

    def where(self, mask: NDArray[np.bool_]) -> ChainTrack:
        """Return the samples that an (N,) mask chooses."""
        received = None if self.received is None else self.received[mask]
        return ChainTrack(self.chain, self.times[mask], self.positions[mask], received)


class Reading(NamedTuple):
    """What chains did in a recording.

    Attributes:
        tracks: of the chains that have a pose.
        warnings: what there is to say of the joint states, and why other chains have no pose.
        notes: what there is to say of the file.
    """

    tracks: list[ChainTrack]
    warnings: list[str]
    notes: list[str]


def time_span(tracks: Sequence[ChainTrack]) -> tuple[float, float]:
    """Return the first and the last time of some tracks [s]."""
    first = min(float(track.times.min()) for track in tracks)
    last = max(float(track.times.max()) for track in tracks)
    return first, last


def read_tracks(
    path: str | Path,
    chains: Sequence[Chain],
    topic: str | None = None,
    progress: Progress | None = None,
) -> Reading:
    """Return what some chains did in a bag or a CSV file, by the node's own input rules.

    Args:
        path: a rosbag2 directory or one of its files, or a CSV file.
        chains: the chains.
        topic: topic of the joint states in a bag; `/joint_states`, or the only one there is, if
            None.
        progress: called now and then with the share that is done, 0 to 1.

    Raises:
        InputFileError: it cannot be read, or no chain has a pose.
        LegFKError: a topic is given for a CSV file.
    """
    if Path(path).suffix.lower() != '.csv':
        with open_bag(path) as bag:
            connections = bag.joint_connections(topic)
            messages = (
                (time, data) for _, time, data in bag.messages(connections, progress)
            )
            tracks, look = _follow(messages, chains)
        return _reading(path, tracks, notes_of(look, connections[0].topic), bag.notes)
    if topic is not None:
        raise LegFKError(f'--joint-topic: {path} is a CSV file, which has no topics')
    joint_names = dict.fromkeys(name for chain in chains for name in chain.joint_names)
    recording = read_csv(path, joint_names)
    tracks, look = _follow(joint_states(recording), chains, start=0)
    return _reading(path, tracks, notes_of(look), [])


def _follow(
    messages: Messages, chains: Sequence[Chain], start: int | None = None
) -> tuple[dict[str, ChainTrack], Look]:
    """Return what chains do by some messages, by name, and what there is to see of these.

    Times count from `start` [ns], or from the first pose.
    """
    now = 0
    joint_input = JointInput(lambda: now)
    joint_input.configure(chains, DEFAULT_TIMEOUT)
    stamps = {chain.name: array('q') for chain in chains}
    positions = {chain.name: array('d') for chain in chains}
    for now, data in messages:  # noqa: B007 (which a message without a stamp has instead)
        for ready in joint_input.feed(data):
            stamps[ready.chain.name].append(ready.stamp)
            positions[ready.chain.name].extend(ready.positions)
    if start is None:
        start = min(
            (of_chain[0] for of_chain in stamps.values() if of_chain), default=0
        )
    tracks = {}
    for chain in chains:
        times = (
            np.frombuffer(stamps[chain.name], dtype=np.int64) - start
        ) / _NANOSECONDS
        q = np.frombuffer(positions[chain.name]).reshape(-1, chain.n)
        tracks[chain.name] = ChainTrack(chain, times, q)
    return tracks, joint_input.take_look()


def _reading(
    path: str | Path,
    tracks: Mapping[str, ChainTrack],
    warnings: Sequence[Note],
    notes: Sequence[str],
) -> Reading:
    """Return the tracks that have poses, and of the others why they have none."""
    drawn = [track for track in tracks.values() if len(track.times)]
    if not drawn:
        faults = [str(note) for note in warnings] or ['no message of joint states']
        raise InputFileError(str(path), f'no chain has a pose: {"; ".join(faults)}')
    lines = []
    for note in warnings:
        is_drawn = note.chain == '' or len(tracks[note.chain].times)
        lines.append(
            str(note) if is_drawn else f'{note.chain} has no pose: {note.text}'
        )
    return Reading(drawn, lines, list(notes))


def read_csv(path: str | Path, joint_names: Iterable[str]) -> JointRecording:
    """Read a CSV file: a header, a column of times [s] and one column per joint [rad].

    Values are separated by commas, semicolons or tabs; the times are under `time`, `Time` or
    `timestamp`, and those since 1970 are taken from the first one on. Other columns are ignored.

    Raises:
        InputFileError: it cannot be read, or has a mistake; names its line.
    """
    joints = tuple(joint_names)
    values = array('d')
    try:
        with open(path, encoding='utf-8-sig', newline='') as stream:
            header = stream.readline()
            stream.seek(0)
            rows = csv.reader(stream, delimiter=max(',;\t', key=header.count))
            for row in _Rows(str(path), rows, joints):
                values.extend(row)
    except OSError as error:
        raise InputFileError(str(path), f'cannot be read: {error.strerror}') from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputFileError(
            str(path),
            f'is not CSV text ({error}); allowed: a header and rows of numbers',
        ) from error
    table = np.frombuffer(values).reshape(-1, 1 + len(joints))
    if not len(table):
        raise InputFileError(
            str(path), 'no rows; allowed: at least one after the header'
        )
    times = table[:, 0]
    if times[0] > EPOCH:
        times = times - times[0]
    return JointRecording(joints, times, table[:, 1:])


class _Rows:
    """The rows of a CSV file as numbers: time [s] and joint positions.

    Args:
        file: name of the file.
        rows: a `csv.reader`.
        joints: the names of the joints.
    """

    def __init__(self, file: str, rows: Any, joints: Sequence[str]) -> None:
        self._file = file
        self._rows = rows
        header = [name.strip() for name in next(rows, [])]
        self._width = len(header)
        self._names = (self._time_column(header, joints), *joints)
        self._places = [self._place(header, name) for name in self._names]

    def __iter__(self) -> Iterator[list[float]]:
        before = -math.inf
        for row in self._rows:
            if not row:  # an empty line
                continue
            numbers = self._numbers(row)
            if numbers[0] < before:
                raise self._fault(
                    f'column {self._names[0]}: {numbers[0]} after {before}',
                    'times in order',
                )
            before = numbers[0]
            yield numbers

    def _numbers(self, row: Sequence[str]) -> list[float]:
        if len(row) != self._width:
            raise self._fault(
                f'{len(row)} values under {self._width} columns', 'one value per column'
            )
        numbers = [number(row[place]) for place in self._places]
        largest = sys.float_info.max  # of the time, which stands first
        for name, place, value in zip(self._names, self._places, numbers):
            if not abs(value) <= largest:
                raise self._fault(
                    f'column {name}: {row[place]!r}',
                    f'a finite number up to {LARGEST:g}',
                )
            largest = LARGEST
        return numbers

    def _time_column(self, header: Sequence[str], joints: Sequence[str]) -> str:
        if not any(header):
            raise self._fault('no header', f'time, {", ".join(joints)}')
        for name in TIMES:
            if name in header:
                return name
        raise self._fault(
            f'no column of times in the header ({_shown(header)})', ' or '.join(TIMES)
        )

    def _place(self, header: Sequence[str], name: str) -> int:
        """Return where a column is."""
        if header.count(name) != 1:
            found = 'appears twice' if name in header else 'is missing'
            raise self._fault(
                f'column {name} {found} in the header ({_shown(header)})',
                ', '.join(self._names),
            )
        return header.index(name)

    def _fault(self, found: str, allowed: str) -> InputFileError:
        line = self._rows.line_num or 1
        return InputFileError(f'{self._file}:{line}', f'{found}; allowed: {allowed}')


def _shown(header: Sequence[str]) -> str:
    """Return the first columns of a header, as far as a message can hold them."""
    return ', '.join(repr(name)[1:-1][:40] for name in header[:20])


def joint_states(recording: JointRecording) -> Iterator[tuple[int, bytes]]:
    """Yield time [ns] and CDR bytes of a JointState per sample of a recording."""
    names = recording.joint_names
    head = _padded(_string(''), 4) + struct.pack('<I', len(names))
    for name in names:
        head += _padded(_string(name), 4)
    head += struct.pack('<I', len(names))
    head = _padded(head, 8)  # as it stands after a stamp of 8 bytes
    pack = struct.Struct(f'<4siI{len(head)}s{len(names)}dII').pack
    for time, q in zip(recording.times.tolist(), recording.positions.tolist()):
        stamp = round(time * _NANOSECONDS)
        yield stamp, pack(_ENCAPSULATION, *divmod(stamp, _NANOSECONDS), head, *q, 0, 0)


def _string(text: str) -> bytes:
    """Return a string as CDR has it."""
    data = text.encode() + b'\0'
    return struct.pack('<I', len(data)) + data


def _padded(data: bytes, size: int) -> bytes:
    """Return bytes filled up to a multiple of a size."""
    return data + bytes(-len(data) % size)


def write_joint_states(path: str | Path, sent: Messages, *, force: bool) -> None:
    """Write serialized JointStates, by stamp [ns], as a bag, whole or not at all."""
    typesys = import_rosbags().typesys
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    with new_bag(path, 'mcap', force=force) as writer:
        topic = writer.add_connection(DEFAULT_TOPIC, JOINT_STATE, typestore=store)
        for stamp, data in sent:
            writer.write(topic, stamp, data)
