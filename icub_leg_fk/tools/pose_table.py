"""Poses as a table: a row per time and columns per tip, as CSV text or for numpy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
import shutil
import tempfile
from typing import BinaryIO, Protocol, TextIO
import zipfile

from icub_leg_fk.kinematics import Chain, Pose, Twist
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.joint_input import Ready
from icub_leg_fk.tools.joint_states import SECOND
import numpy as np
from numpy.typing import NDArray

_WAITING = 64  # rows that may still get the pose of another chain
_BLOCK = 4096  # rows that are written at once

_Row = dict[str, Ready]  # by the names of the chains


class Sink(Protocol):
    """Takes the rows of a table."""

    def write(self, stamps: NDArray[np.int64], values: Array) -> None:
        """Write (N,) times [ns] and (N, K) values, of which NaN are none."""


class PoseTable:
    """Makes a table of joint vectors: those of one time are one row, in the order they came.

    Args:
        chains: the chains, in the order of their columns.
        twist: whether there are velocities, too.
        sink: takes the rows.

    Attributes:
        counts: poses of each chain, by its name.
        rows: rows that there are.
    """

    def __init__(self, chains: Sequence[Chain], twist: bool, sink: Sink) -> None:
        self.counts = {chain.name: 0 for chain in chains}
        self.rows = 0
        self._width = len(_quantities(twist))
        self._waiting: dict[int, _Row] = {}  # by their times
        self._done: list[tuple[int, _Row]] = []
        self._sink = sink

    def take(self, vectors: Sequence[Ready]) -> None:
        """Take what a message made ready."""
        for ready in vectors:
            name = ready.chain.name
            row = self._waiting.get(ready.stamp)
            if row is None or name in row:
                row = self._new_row(ready.stamp)
            row[name] = ready
            self.counts[name] += 1

    def finish(self) -> None:
        """Write the rows that are left."""
        self._done += self._waiting.items()
        self._waiting.clear()
        if self._done:
            self._write()

    def _new_row(self, stamp: int) -> _Row:
        if stamp in self._waiting:  # time goes round in a loop
            self._done += self._waiting.items()
            self._waiting.clear()
        if len(self._waiting) == _WAITING:
            first = next(iter(self._waiting))
            self._done.append((first, self._waiting.pop(first)))
        if len(self._done) >= _BLOCK:
            self._write()
        self.rows += 1
        row: _Row = {}
        self._waiting[stamp] = row
        return row

    def _write(self) -> None:
        """Write the rows that are done."""
        stamps = np.array([stamp for stamp, _ in self._done], dtype=np.int64)
        rows = [row for _, row in self._done]
        values = np.full((len(rows), len(self.counts), self._width), np.nan)
        for i, name in enumerate(self.counts):
            for there in _places(rows, name):
                vectors = [rows[place][name] for place in there]
                values[there, i] = self._values(vectors)
        self._sink.write(stamps, values.reshape(len(rows), -1))
        self._done.clear()

    def _values(self, vectors: Sequence[Ready]) -> Array:
        """Return the (N, 7) poses, or (N, 13) poses and twists, of a chain's N joint vectors."""
        chain = vectors[0].chain
        poses = chain.poses(np.array([ready.positions for ready in vectors]))
        if self._width == poses.shape[1]:
            return poses
        twists = np.full((len(vectors), len(Twist._fields)), np.nan)
        for twist, ready in zip(twists, vectors):
            if ready.velocities is not None:
                twist[:] = chain.twist(ready.positions, ready.velocities)
        return np.hstack([poses, twists])


def _places(rows: Sequence[_Row], name: str) -> Iterable[list[int]]:
    """Return the rows that have a chain of some name, by themselves those of each description."""
    places: dict[int, list[int]] = {}
    for place, row in enumerate(rows):
        if name in row:
            places.setdefault(id(row[name].chain), []).append(place)
    return places.values()


class CsvTable:
    """Writes a table as CSV text, with the time in seconds to the last nanosecond.

    Args:
        stream: takes the text; the header with the first row.
        columns: names of the columns after the time.
    """

    def __init__(self, stream: TextIO, columns: Sequence[str]) -> None:
        self._stream = stream
        self._header = ','.join(('time', *columns)) + '\n'

    def write(self, stamps: NDArray[np.int64], values: Array) -> None:
        """Write (N,) times [ns] and (N, K) values, of which NaN are none."""
        lines = [self._header]
        self._header = ''
        for stamp, row in zip(stamps.tolist(), values.tolist()):
            sign = '-' if stamp < 0 else ''
            sec, nanosec = divmod(abs(stamp), SECOND)
            cells = [
                repr(value) if value == value else '' for value in row
            ]  # NaN is not itself
            lines.append(f'{sign}{sec}.{nanosec:09d},{",".join(cells)}\n')
        self._stream.write(''.join(lines))


class NpzTable:
    """Writes a table as arrays for numpy: `time_ns`, `time` [s], and one of each column.

    Args:
        columns: names of the columns after the time.
        folder: where the arrays are kept until all rows are known.
    """

    def __init__(self, columns: Sequence[str], folder: Path) -> None:
        self._files: dict[str, BinaryIO] = {}
        self._stack = ExitStack()
        self._rows = 0
        for name in ('time_ns', 'time', *columns):
            file = tempfile.TemporaryFile(dir=folder)
            self._files[name] = self._stack.enter_context(file)

    def write(self, stamps: NDArray[np.int64], values: Array) -> None:
        """Write (N,) times [ns] and (N, K) values, of which NaN are none."""
        sec, nanosec = np.divmod(stamps, SECOND)
        columns = (stamps, sec + nanosec / SECOND, *values.T)  # rounded once
        for file, column in zip(self._files.values(), columns, strict=True):
            file.write(column.tobytes())
        self._rows += len(stamps)

    def save(self, path: Path) -> None:
        """Write the file."""
        with zipfile.ZipFile(path, 'w', allowZip64=True) as archive:
            for name, file in self._files.items():
                kind = '<i8' if name == 'time_ns' else '<f8'
                about = {'descr': kind, 'fortran_order': False, 'shape': (self._rows,)}
                entry = zipfile.ZipInfo(f'{name}.npy')
                with archive.open(entry, 'w', force_zip64=True) as target:
                    np.lib.format.write_array_header_1_0(target, about)
                    file.seek(0)
                    shutil.copyfileobj(file, target)

    def close(self) -> None:
        """Forget the arrays."""
        self._stack.close()


def column_names(chains: Sequence[Chain], twist: bool) -> list[str]:
    """Return the names of the columns after the time, such as `left_foot_x`."""
    return [f'{chain.tip}_{name}' for chain in chains for name in _quantities(twist)]


def _quantities(twist: bool) -> tuple[str, ...]:
    return Pose._fields + Twist._fields if twist else Pose._fields
