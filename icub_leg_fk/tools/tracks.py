"""What chains did over time, small enough to be drawn however long a recording is."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
import math
from pathlib import Path
from typing import NamedTuple

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.joint_input import Ready
from icub_leg_fk.tools.joint_states import SECOND
from icub_leg_fk.tools.progress import Progress
from icub_leg_fk.tools.recorded_robot import Described
from icub_leg_fk.tools.recording import follow, open_recording, warnings_of
import numpy as np
from numpy.typing import NDArray

COORDINATES = ('x', 'y', 'z', 'roll', 'pitch', 'yaw')

_BLOCK = 4096  # samples that are worked on at once
_MOST_ROWS = 1 << 16  # that are kept of a chain
_GAP = 5.0  # so many usual intervals without a pose are a gap
_MEDIAN = 100_000  # intervals by which the usual one is told


class OutOfRange(NamedTuple):
    """A joint beyond one end of its range.

    Attributes:
        chain: whose joint it is.
        joint: index of the joint.
        is_above: whether it is above its range, or else below.
        spans: when it was there, from and to [s].
    """

    chain: Chain
    joint: int
    is_above: bool
    spans: list[tuple[float, float]]


@dataclass(frozen=True)
class ChainTrack:
    """What one chain did over time: each row stands for a sample, or for some in a long recording.

    Attributes:
        chain: the chain.
        count: how many poses there were.
        times: (M,) time of each row's first sample [s].
        positions: (M, n) its joint positions [rad or m].
        poses: (M, 7) its x, y, z [m], qx, qy, qz, qw.
        lowest: (M, 6) the least of each row's x, y, z [m] and roll, pitch, yaw [rad], which turn
            the tip from its orientation at q = 0 about the axes of the root.
        highest: (M, 6) the largest of these.
        breaks: the rows that do not go on from the one before.
        gaps: when there was no pose although there should have been, from and to [s].
        outside: joints that were outside their ranges.
    """

    chain: Chain
    count: int
    times: Array
    positions: Array
    poses: Array
    lowest: Array
    highest: Array
    breaks: NDArray[np.intp]
    gaps: list[tuple[float, float]]
    outside: list[OutOfRange]

    def nearest(self, time: float) -> int:
        """Return the row nearest to a time [s]."""
        return int(np.abs(self.times - time).argmin())

    def positions_at(self, time: float) -> Array:
        """Return the (n,) joint positions nearest to a time [rad or m]."""
        return np.asarray(self.positions[self.nearest(time)])

    def points_at(self, time: float) -> Array:
        """Return the (K, 3) places of the chain's frames nearest to a time [m]."""
        return self.chain.frames(self.positions_at(time))[:, :3, 3]

    def covers(self, time: float) -> bool:
        """Return whether there are poses around a time [s], rather than before or after alone."""
        is_in_gap = any(begin < time < end for begin, end in self.gaps)
        return bool(self.times.min() <= time <= self.times.max()) and not is_in_gap

    def path_around(self, time: float, seconds: float) -> Array:
        """Return the (K, 3) places of the tip around a time, as far as there is no break."""
        row = self.nearest(time)
        runs = np.searchsorted(self.breaks, np.arange(len(self.times)), side='right')
        is_near = np.abs(self.times - self.times[row]) <= seconds
        return self.poses[is_near & (runs == runs[row]), :3]


class Reading(NamedTuple):
    """What chains did in a recording.

    Attributes:
        tracks: of the chains that have a pose; several of one whose description changes.
        warnings: what is doubtful, one line each.
        notes: what else a user should know, one line each.
    """

    tracks: list[ChainTrack]
    warnings: list[str]
    notes: list[str]


def read_tracks(
    paths: Sequence[str | Path],
    chains: Sequence[Chain] | Described,
    topics: Sequence[str] = (),
    progress: Progress | None = None,
    *,
    time_unit: str = '',
    joint_prefix: str = '',
    begin: float | None = None,
    end: float | None = None,
) -> Reading:
    """Return what some chains did in a recording, by the node's own input rules.

    Times count from the first pose, unless they are those of a CSV file that count from something
    else than 1970.

    Args:
        paths: where the parts of the recording are, see `open_recording`.
        chains: the chains, or how those of the recording's own description are chosen.
        topics: topics of the joint states in bags.
        progress: called now and then with the share that is done, 0 to 1.
        time_unit: unit of the times in CSV files.
        joint_prefix: what is before the joint names of the chains.
        begin: time of the first pose that is wanted [s]; None for the first there is.
        end: time of the last [s]; None for the last there is.

    Raises:
        InputFileError: it cannot be read, or no chain has a pose.
        LegFKError: a chain has poses, but none at the times that are wanted.
    """
    with open_recording(paths, chains, topics, time_unit, joint_prefix) as recording:
        traces = _Traces(recording.start, begin, end)
        look = follow(recording, traces.take, progress=progress)
        poseless = [
            name for name, of_chain in look.chains.items() if not of_chain.ready
        ]
        warnings = warnings_of(recording, look, poseless)
    tracks: list[ChainTrack] = []
    for name in look.chains:
        if name not in poseless:
            tracks += traces.tracks(name)
    return Reading(tracks, warnings, recording.notes)


def time_span(tracks: Sequence[ChainTrack]) -> tuple[float, float]:
    """Return the first and the last time of some tracks [s]."""
    first = min(float(track.times.min()) for track in tracks)
    last = max(float(track.times.max()) for track in tracks)
    return first, last


def track_of(
    chain: Chain, times: Array, positions: Array, poses: Array | None = None
) -> ChainTrack:
    """Return what a chain did by its samples.

    Args:
        chain: the chain.
        times: (N,) times [s].
        positions: (N, n) joint positions [rad or m].
        poses: (N, 7) poses as they were received; computed if None.
    """
    trace = _Trace(chain)
    stamps = np.rint(np.asarray(times) * SECOND).astype(np.int64)
    trace.extend(stamps, positions, poses)
    return trace.track(0)


class _Traces:
    """Takes joint vectors, and gives what each chain did."""

    def __init__(
        self, start: int | None, begin: float | None, end: float | None
    ) -> None:
        self._traces: dict[str, list[_Trace]] = {}  # by the names of the chains
        self._start = start
        self._first = -math.inf if begin is None else begin * SECOND
        self._last = math.inf if end is None else end * SECOND
        self._span = (math.inf, -math.inf)  # of all poses, since the start [ns]

    def take(self, vectors: Sequence[Ready]) -> None:
        """Take what a message made ready."""
        for ready in vectors:
            stamp = ready.stamp
            if self._start is None:
                self._start = stamp
            since = stamp - self._start
            first, last = self._span
            self._span = (min(first, since), max(last, since))
            if self._first <= since <= self._last:
                traces = self._traces.setdefault(ready.chain.name, [])
                if not traces or traces[-1].chain is not ready.chain:
                    traces.append(_Trace(ready.chain))
                traces[-1].add(stamp, ready.positions)

    def tracks(self, name: str) -> list[ChainTrack]:
        """Return what a chain did: one track, or one for each of its descriptions.

        Raises:
            LegFKError: it has no pose at the times that are wanted.
        """
        if name not in self._traces:
            first, last = (time / SECOND for time in self._span)
            begin = max(self._first / SECOND, first)
            end = min(self._last / SECOND, last)
            raise LegFKError(
                f'--from, --to: found {begin:g} to {end:g} s, in which not every chain has a '
                f'pose; the recording goes from {first:g} to {last:g} s'
            )
        assert self._start is not None
        return [trace.track(self._start) for trace in self._traces[name]]


class _Trace:
    """Takes the samples of one chain, and keeps as many rows of them as can be drawn.

    Attributes:
        chain: the chain.
        stamps: times of all samples [ns].
    """

    def __init__(self, chain: Chain) -> None:
        self.stamps = array('q')
        self.chain = chain
        self._waiting = array('d')  # positions of samples that are in no row yet
        self._rows: list[Array] = []
        self._size = 1  # samples of a row
        self._outside: list[NDArray[np.uint8]] = []  # (K, 2 n), a bit per sample
        x, y, z, w = chain.pose(np.zeros(chain.n))[3:]
        # The product of a quaternion and the inverse of that at q = 0.
        self._from_zero = np.array(
            [[w, -z, y, -x], [z, w, -x, -y], [-y, x, w, -z], [x, y, z, w]]
        )

    def add(self, stamp: int, positions: Sequence[float]) -> None:
        """Take a sample: time [ns] and n joint positions."""
        self.stamps.append(stamp)
        self._waiting.extend(positions)
        if len(self._waiting) == _BLOCK * self.chain.n:
            self._keep_waiting()

    def extend(self, stamps: NDArray[np.int64], Q: Array, poses: Array | None) -> None:
        """Take (N,) times [ns], (N, n) joint positions and (N, 7) poses, if they are known."""
        self.stamps.extend(stamps.tolist())
        poses = self.chain.poses(Q) if poses is None else poses
        for start in range(0, len(Q), _BLOCK):
            rows = slice(start, start + _BLOCK)
            self._keep(Q[rows], poses[rows])

    def track(self, start: int) -> ChainTrack:
        """Return what the chain did, in times since a start [ns]."""
        self._keep_waiting()
        rows = np.concatenate(self._rows)
        n = self.chain.n
        stamps = np.frombuffer(self.stamps, dtype=np.int64)
        after = _breaks(stamps)  # samples, of which some may be within a row
        breaks = np.unique(-(-after // self._size))
        gaps = []
        for sample in after:
            first, last = _seconds(stamps[[sample - 1, sample]], start)
            if last > first:
                gaps.append((first, last))
        return ChainTrack(
            chain=self.chain,
            count=len(stamps),
            times=(stamps[:: self._size] - start) / SECOND,
            positions=rows[:, :n],
            poses=rows[:, n:-12],
            lowest=rows[:, -12:-6],
            highest=rows[:, -6:],
            breaks=breaks[breaks < len(rows)],
            gaps=gaps,
            outside=self._outside_ranges(stamps, start),
        )

    def _keep_waiting(self) -> None:
        if self._waiting:
            Q = np.frombuffer(self._waiting).reshape(-1, self.chain.n)
            self._waiting = array('d')
            self._keep(Q, self.chain.poses(Q))

    def _keep(self, Q: Array, poses: Array) -> None:
        """Keep rows of a block of samples; where there are too many, each two become one."""
        is_outside = np.hstack([Q < self.chain.lower, Q > self.chain.upper])
        self._outside.append(np.packbits(is_outside, axis=0))
        coordinates = np.hstack([poses[:, :3], self._turns(poses[:, 3:])])
        samples = np.hstack([Q, poses, coordinates, coordinates])
        self._rows.append(_merged(samples, self._size))
        if sum(map(len, self._rows)) > _MOST_ROWS:
            self._rows = [_merged(np.concatenate(self._rows), 2)]
            self._size *= 2

    def _turns(self, quaternions: Array) -> Array:
        """Return (N, 3) roll, pitch and yaw [rad] from the orientation at q = 0."""
        x, y, z, w = self._from_zero @ quaternions.T
        roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
        yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return np.stack([roll, pitch, yaw], axis=1)

    def _outside_ranges(
        self, stamps: NDArray[np.int64], start: int
    ) -> list[OutOfRange]:
        """Return when joints were outside their ranges, up to the sample after."""
        bits = np.concatenate(self._outside)
        found = []
        for place in np.flatnonzero(bits.any(axis=0)).tolist():
            joint = place % self.chain.n
            is_above = place >= self.chain.n
            is_outside = np.unpackbits(bits[:, place], count=len(stamps)).astype(bool)
            ends = np.flatnonzero(np.diff(is_outside, prepend=False, append=False))
            times = _seconds(stamps[np.minimum(ends, len(stamps) - 1)], start)
            spans = list(zip(times[::2], times[1::2]))
            found.append(OutOfRange(self.chain, joint, is_above, spans))
        return sorted(found, key=lambda each: (each.joint, each.is_above))


def _merged(rows: Array, size: int) -> Array:
    """Return each so many rows as one: the first, but the least and largest of its coordinates."""
    if size == 1:
        return rows
    starts = np.arange(0, len(rows), size)
    merged = rows[starts]
    merged[:, -12:-6] = np.minimum.reduceat(rows[:, -12:-6], starts)
    merged[:, -6:] = np.maximum.reduceat(rows[:, -6:], starts)
    return merged


def _breaks(stamps: NDArray[np.int64]) -> NDArray[np.intp]:
    """Return the indices of the samples that do not go on from the one before."""
    steps = np.diff(stamps)
    forward = steps[:: len(steps) // _MEDIAN + 1]
    forward = forward[forward > 0]
    usual = np.median(forward) if len(forward) > 1 else np.inf
    return np.flatnonzero((steps > _GAP * usual) | (steps < 0)) + 1


def _seconds(stamps: NDArray[np.int64], start: int) -> list[float]:
    """Return times since a start [s]."""
    seconds: list[float] = ((stamps - start) / SECOND).tolist()
    return seconds
