"""Joint recordings: what joints did over time, from a bag or a CSV file."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
import csv
from dataclasses import dataclass
from functools import cached_property
import math
from pathlib import Path
import sys
from typing import Any

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.configuration import DEFAULT_TIMEOUT
from icub_leg_fk.stream.joint_input import JointInput
from icub_leg_fk.tools import bags
from icub_leg_fk.tools.options import LARGEST, number
from icub_leg_fk.tools.output_file import is_bag, whole_path
import numpy as np
from numpy.typing import NDArray

TIMES = ('time', 'Time', 'timestamp')
EPOCH = 1e8  # s; times beyond it count from 1970 and not from the start


@dataclass(frozen=True)
class JointRecording:
    """Joint positions over time."""

    joint_names: tuple[str, ...]
    times: Array  # (N,) [s], not decreasing
    positions: Array  # (N, n) [rad]

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
    """What one chain did over time."""

    chain: Chain
    times: Array  # (N,) [s]
    positions: Array  # (N, n) [rad or m]
    received: Array | None = None  # (N, 7) poses as a node sent them; None to compute them

    @cached_property
    def poses(self) -> Array:
        """(N, 7) rows x, y, z [m], qx, qy, qz, qw of the tip in the root frame."""
        return self.chain.poses(self.positions) if self.received is None else self.received

    def where(self, mask: NDArray[np.bool_]) -> ChainTrack:
        """Return the samples that an (N,) mask chooses."""
        return ChainTrack(self.chain, self.times[mask], self.positions[mask],
                          None if self.received is None else self.received[mask])


def time_span(tracks: Sequence[ChainTrack]) -> tuple[float, float]:
    """Return the first and the last time of some tracks [s]."""
    return (min(float(track.times.min()) for track in tracks),
            max(float(track.times.max()) for track in tracks))


def read_bag(path: Path, chains: Sequence[Chain], topic: str | None
             ) -> tuple[list[ChainTrack], list[str]]:
    """Return what some chains did in a bag, by the node's own input rules.

    Chains without a pose are in words, with what was missing.
    """
    stamps = [array('q') for _ in chains]
    positions = [array('d') for _ in chains]
    now = 0  # when the bag received the present message [ns], for one without a stamp
    joint_input = JointInput(chains, DEFAULT_TIMEOUT, lambda: now)
    with bags.open_bag(path) as reader:
        connections = bags.joint_connections(reader, path, topic)
        for _, received, data in bags.messages(reader, path, connections):
            now = received
            for vector in joint_input.feed(data):
                stamps[vector.chain].append(vector.sec * 1_000_000_000 + vector.nanosec)
                positions[vector.chain].extend(vector.positions)
    start = min((stamp[0] for stamp in stamps if stamp), default=0)
    tracks, poseless = [], []
    for index, chain in enumerate(chains):
        if stamps[index]:
            times = (np.frombuffer(stamps[index], dtype=np.int64) - start) / 1e9
            tracks.append(ChainTrack(
                chain, times, np.frombuffer(positions[index]).reshape(len(times), -1)))
        else:
            known = joint_input.known_joints(index)
            missing = ', '.join(name for name in chain.joint_names if name not in known)
            poseless.append(f'{chain.name} needs {missing or "joint positions that are finite"}')
    if not tracks:
        shown = ', '.join(joint_input.names_since()[:20]) or 'none'
        raise InputFileError(f'{path}: no pose in {joint_input.messages} joint states: '
                             f'{"; ".join(poseless)}; names found: {shown}')
    return tracks, poseless


def read_csv(path: str | Path, joint_names: Iterable[str]) -> JointRecording:
    """Read a CSV file: a header, a column of times [s] and one column per joint [rad].

    Values are separated by commas, semicolons or tabs; the times are under `time`, `Time` or
    `timestamp`, and those since 1970 are taken from the first one on. Other columns are ignored.
    """
    joints = tuple(joint_names)
    values = array('d')
    try:
        with open(path, encoding='utf-8-sig', newline='') as stream:
            header = stream.readline()
            stream.seek(0)
            reader = csv.reader(stream, delimiter=max(',;\t', key=header.count))
            for row in _rows(str(path), reader, joints):
                values.extend(row)
    except OSError as error:
        raise InputFileError(f'{path}: {error.strerror or error}') from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputFileError(f'{path}: is not CSV text ({error}); '
                             'allowed: a header and rows of numbers') from error
    table = np.frombuffer(values).reshape(-1, 1 + len(joints))
    times = table[:, 0] - (table[0, 0] if table[0, 0] > EPOCH else 0.0)
    return JointRecording(joints, times, table[:, 1:])


def _rows(file: str, reader: Any, joints: Sequence[str]) -> Iterator[list[float]]:
    """Yield time and joints of every row that a `csv.reader` gives, as numbers."""
    def wrong(what: str, allowed: str) -> InputFileError:
        return InputFileError(f'{file}:{reader.line_num or 1}: {what}; allowed: {allowed}')

    header = [name.strip() for name in next(reader, [])]
    if not any(header):
        raise wrong('no header', f'time, {", ".join(joints)}')
    shown = ', '.join(repr(name)[1:-1][:40] for name in header[:20])
    time = next((name for name in TIMES if name in header), None)
    if time is None:
        raise wrong(f'no column of times in the header ({shown})', ' or '.join(TIMES))
    columns = (time, *joints)
    for name in columns:
        if header.count(name) != 1:
            found = 'appears twice' if name in header else 'is missing'
            raise wrong(f'column {name} {found} in the header ({shown})', f'{", ".join(columns)}')
    places = [header.index(name) for name in columns]
    before = -math.inf
    for row in reader:
        if not row:  # an empty line
            continue
        if len(row) != len(header):
            raise wrong(f'{len(row)} values under {len(header)} columns', 'one value per column')
        numbers = [number(row[place]) for place in places]
        for name, place, value in zip(columns, places, numbers):
            if not abs(value) <= (sys.float_info.max if name == time else LARGEST):
                raise wrong(f'column {name}: {row[place]!r}', f'a finite number up to {LARGEST:g}')
        if numbers[0] < before:
            raise wrong(f'column {time}: {numbers[0]} after {before}', 'times in order')
        before = numbers[0]
        yield numbers
    if before == -math.inf:
        raise InputFileError(f'{file}: no rows; allowed: at least one after the header')


def write_joint_states(path: str | Path, sent: Iterable[tuple[int, bytes]], *, force: bool
                       ) -> None:
    """Write serialized JointStates, by stamp [ns], as a bag, whole or not at all."""
    rosbag2, typesys = bags.import_rosbags()
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    with whole_path(path, force=force, may_replace=is_bag) as place, \
            rosbag2.Writer(place, version=rosbag2.Writer.VERSION_LATEST,
                           storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
        topic = writer.add_connection(bags.DEFAULT_TOPIC, bags.JOINT_STATE,
                                      typestore=store)
        for stamp, data in sent:
            writer.write(topic, stamp, data)
