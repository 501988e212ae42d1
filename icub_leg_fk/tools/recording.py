"""Joint recordings: what joints did over time, from a CSV file or made, and a chain's share."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
import csv
from dataclasses import dataclass
from functools import cached_property
import math
from pathlib import Path
from typing import Any

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
import numpy as np

TIME = 'time'


@dataclass(frozen=True)
class JointRecording:
    """Joint positions over time.

    Attributes:
        joint_names: n joint names.
        times: (N,) times [s], not decreasing.
        positions: (N, n) joint positions [rad].
        velocities: (N, n) joint velocities [rad/s], or None if unknown.
    """

    joint_names: tuple[str, ...]
    times: Array
    positions: Array
    velocities: Array | None = None

    def first(self, seconds: float) -> JointRecording:
        """Return the part up to a time after the first sample [s]."""
        n = int(np.searchsorted(self.times, self.times[0] + seconds, side='right'))
        return JointRecording(self.joint_names, self.times[:n], self.positions[:n],
                              None if self.velocities is None else self.velocities[:n])

    def track(self, chain: Chain) -> ChainTrack:
        """Return what one chain did; its joints must be in the recording."""
        columns = [self.joint_names.index(name) for name in chain.joint_names]
        return ChainTrack(chain, self.times, self.positions[:, columns])


@dataclass(frozen=True)
class ChainTrack:
    """What one chain did over time.

    Attributes:
        chain: the chain, with its n joints.
        times: (N,) times [s].
        positions: (N, n) joint positions [rad or m].
    """

    chain: Chain
    times: Array
    positions: Array

    @cached_property
    def poses(self) -> Array:
        """(N, 7) rows x, y, z [m], qx, qy, qz, qw of the tip in the root frame."""
        return self.chain.poses(self.positions)


def read_csv(path: str | Path, joint_names: Iterable[str]) -> JointRecording:
    """Read a CSV file: a header, a column `time` [s] and one column per joint [rad].

    Other columns are ignored; there may be any, in any order.

    Args:
        path: the file.
        joint_names: the joints wanted, each once.

    Raises:
        InputFileError: the file cannot be read, a column is missing or stands twice, or a value
            is not what it must be; names file, line and column.
    """
    joints = tuple(joint_names)
    values = array('d')
    try:
        with open(path, encoding='utf-8-sig', newline='') as stream:
            for row in _rows(str(path), csv.reader(stream), (TIME, *joints)):
                values.extend(row)
    except OSError as error:
        raise InputFileError(f'{path}: {error.strerror or error}') from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputFileError(f'{path}: found no CSV text ({error}), '
                             'allowed: a header and rows of numbers') from error
    table = np.frombuffer(values).reshape(-1, 1 + len(joints))
    return JointRecording(joints, table[:, 0], table[:, 1:])


def _rows(file: str, reader: Any, columns: Sequence[str]) -> Iterator[list[float]]:
    """Yield the wanted columns of every row that a `csv.reader` gives, as numbers."""
    header = [name.strip() for name in next(reader, [])]
    if not any(header):
        raise InputFileError(f'{file}:1: found no header, allowed: {", ".join(columns)}')
    for name in columns:
        if header.count(name) != 1:
            found = 'the column twice' if name in header else 'no such column'
            raise InputFileError(
                f'{file}:1: column {name}: found {found}, allowed: {", ".join(columns)}')
    places = [header.index(name) for name in columns]
    before = -math.inf
    for row in reader:
        if not row:  # an empty line
            continue
        numbers = []
        for name, place in zip(columns, places, strict=True):
            number = _number(row, place)
            if number is None:
                found = repr(row[place]) if place < len(row) else f'a row of {len(row)} values'
                raise InputFileError(f'{file}:{reader.line_num}: column {name}: found {found}, '
                                     'allowed: a finite number')
            numbers.append(number)
        if numbers[0] < before:
            raise InputFileError(f'{file}:{reader.line_num}: column {TIME}: found {numbers[0]} '
                                 f'after {before}, allowed: times that do not decrease')
        before = numbers[0]
        yield numbers
    if before == -math.inf:
        raise InputFileError(f'{file}: found no rows, allowed: at least one after the header')


def _number(row: list[str], place: int) -> float | None:
    """Return the number at a place, or None if there is no finite one."""
    try:
        number = float(row[place])
    except (ValueError, IndexError):
        return None
    return number if math.isfinite(number) else None
