"""From serialized JointStates to the joint vectors of some chains; free of rclpy.

The rules:

- Joints are matched by name; joints of no chain are ignored.
- A message that brings some of a chain's joints updates those. The chain is then ready if each of
  its joints is known, finite and no older than `joint_timeout` beside the newest of them.
  (Finite is what leaves room to compute with: less than `LARGEST_VALUE`.)
- A message is rejected as a whole if `position` is shorter than `name` or a name appears twice; an
  empty `position` is counted only.
- Time has stepped back if a message is older than what is held of a joint it brings, or older by
  more than `joint_timeout` than anything held: then all held joints are forgotten and the message
  counts as the first. (Publishers of different joints may interleave slightly out of order.)

Everything refused is counted by reason, and reported with the joint or field it concerns.

A robot sends the same names in the same order a thousand times a second. So a `JointInput`
remembers, for the names and lengths that it has seen, which numbers are of concern and where they
lie, and unpacks just those. That is a cache: dropped, it costs time and nothing else.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, repeat
import math
from operator import itemgetter
import struct
from typing import Any, NamedTuple

from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.stream.cdr import HEADER, JointStateLayout, read_layout, STAMP_END

LARGEST_VALUE = 1e150  # of a position or velocity; beyond it sums and products overflow
MESSAGE_REASONS = ('malformed', 'empty_position', 'short_position', 'duplicate_name', 'time_jump')

_REMEMBERED_LAYOUTS = 8
_LARGEST_REMEMBERED = 16384  # bytes of names; what a stranger sends may be larger
_LAST_SECOND = (1 << 31) - 1  # that a stamp can hold
_LARGEST_USABLE = math.nextafter(LARGEST_VALUE, 0.0)
_UNKNOWN = math.nan


class Ready(NamedTuple):
    """A chain's joint vector, complete and fresh.

    Attributes:
        chain: index of the chain.
        sec: seconds of the stamp.
        nanosec: nanoseconds of the stamp.
        positions: n joint positions [rad or m].
        velocities: n joint velocities [rad/s or m/s]; None if they are not wanted, or one is not
            known, or not finite.
    """

    chain: int
    sec: int
    nanosec: int
    positions: tuple[float, ...]
    velocities: tuple[float, ...] | None


@dataclass
class ChainCounts:
    """What has happened to one chain since it was last asked.

    Attributes:
        ready: joint vectors that were complete and fresh.
        held_back: messages that touched the chain and gave none, by reason.
        joints: the joints concerned, by reason, with what was found of each.
    """

    ready: int = 0
    held_back: Counter[str] = field(default_factory=Counter)
    joints: dict[str, dict[str, str]] = field(default_factory=dict)

    def note(self, reason: str, joints: dict[str, str]) -> None:
        """Note the joints concerned by a reason."""
        self.joints.setdefault(reason, {}).update(joints)


class _Joints:
    """The joints of some chains: a slot for each, and what is held of it."""

    def __init__(self, chains: Sequence[Chain]) -> None:
        self.slots = {name: slot for slot, name in enumerate(
            dict.fromkeys(name for chain in chains for name in chain.joint_names))}
        self.of_chain = [tuple(self.slots[name] for name in chain.joint_names) for chain in chains]
        self.forget()

    def forget(self) -> None:
        """Hold nothing."""
        self.stamps: list[int | None] = [None] * len(self.slots)
        self.positions = [_UNKNOWN] * len(self.slots)
        self.velocities = [_UNKNOWN] * len(self.slots)


class _Layout:
    """What the messages of one list of names and of these lengths bring, and where."""

    def __init__(self, data: bytes, layout: JointStateLayout, joints: _Joints) -> None:
        self.names = layout.names
        self.last_message = 0  # number of the last message that had it
        self.refusal = _refusal(layout)
        order = layout.byte_order
        self._encapsulation = bytes(data[:2])
        self._names_end = layout.names_end
        self._size = layout.efforts.at + 8 * layout.efforts.n
        self._head = data[STAMP_END:layout.names_end]
        mask = bytearray(b'\xff' * layout.names_end)
        for at, size in layout.padding:
            mask[at:at + size] = bytes(size)
        self._mask = int.from_bytes(mask[STAMP_END:], 'little')
        self._masked_head = int.from_bytes(self._head, 'little') & self._mask
        counts_at = (layout.names_end, *(
            doubles.at + 8 * doubles.n for doubles in (layout.positions, layout.velocities)))
        self._counts = tuple(doubles.n for doubles in (
            layout.positions, layout.velocities, layout.efforts))
        gaps = [after - before - 4 for before, after in pairwise(counts_at)]
        self._read_counts = struct.Struct(f'{order}I{gaps[0]}xI{gaps[1]}xI').unpack_from
        self.stamp = struct.Struct(f'{order}iI').unpack_from
        self.positions_at = layout.positions.at
        self.velocities_at = (layout.velocities.at
                              if layout.velocities.n >= len(layout.names) else None)
        places: dict[int, int] = {}
        for index, name in enumerate(layout.names):
            if name in joints.slots:
                places.setdefault(joints.slots[name], index)
        self.slots = tuple(places)
        skips = [index - before - 1 for before, index in zip(
            (-1, *places.values()), places.values())]
        self.numbers = struct.Struct(order + ''.join(f'{8 * skip}xd' for skip in skips)
                                     ).unpack_from
        # Of each chain touched: what picks its joints, if they are all here.
        self.chains: list[tuple[int, Callable[[Any], Any] | None]] = []
        place = {slot: i for i, slot in enumerate(self.slots)}
        for chain, slots in enumerate(joints.of_chain):
            if touched := place.keys() & set(slots):
                self.chains.append((chain, _picker([place[slot] for slot in slots])
                                    if len(touched) == len(slots) else None))

    def fits(self, data: bytes) -> bool:
        """Return whether data has these names and lengths, whatever its padding holds."""
        if (len(data) < self._size or data[:2] != self._encapsulation
                or self._read_counts(data, self._names_end) != self._counts):
            return False
        if data.startswith(self._head, STAMP_END):
            return True
        head = data[STAMP_END:self._names_end]
        if int.from_bytes(head, 'little') & self._mask != self._masked_head:
            return False
        self._head = head
        return True

    def is_long(self) -> bool:
        """Return whether the names take too much room to be remembered."""
        return self._names_end > _LARGEST_REMEMBERED


class JointInput:
    """Takes JointStates in and says which chains they make ready.

    Args:
        chains: the chains; one joint may belong to several.
        joint_timeout: greatest age of a joint beside the newest of its chain [s]; 0 is none.
        now: returns the present time [ns], which stamps messages with a zero stamp.
        report: called with a reason and one line of text for everything worth a warning.
        velocities: whether velocities are wanted too.

    Attributes:
        messages: messages seen.
        counts: messages by reason of `MESSAGE_REASONS`.
        chain_counts: one `ChainCounts` per chain.
        newest: newest stamp held [ns], or None while nothing is.
    """

    def __init__(self, chains: Sequence[Chain], joint_timeout: float, now: Callable[[], int],
                 report: Callable[[str, str], None] = lambda reason, text: None,
                 velocities: bool = False) -> None:
        self.chains = tuple(chains)
        self.messages = 0
        self.counts: Counter[str] = Counter()
        self.chain_counts = [ChainCounts() for _ in self.chains]
        self.newest: int | None = None
        self._now = now
        self._report = report
        self._velocities = velocities
        self._timeout_ns = round(joint_timeout * 1e9)
        self._joints = _Joints(self.chains)
        self._bounds = [[(max(lower, -_LARGEST_USABLE), min(upper, _LARGEST_USABLE))
                         for lower, upper in zip(chain.lower.tolist(), chain.upper.tolist())]
                        for chain in self.chains]
        self._layouts: list[_Layout] = []
        self._latest: _Layout | None = None

    def feed(self, data: bytes) -> list[Ready]:
        """Take one serialized JointState in and return the joint vectors it makes ready."""
        self.messages += 1
        try:
            layout = self._layout(data)
        except MalformedMessageError as error:
            self._reject('malformed', f'{error}; message ignored')
            return []
        self._latest = layout
        layout.last_message = self.messages
        if layout.refusal is not None:
            self._reject(*layout.refusal)
            return []
        if not layout.slots:
            return []
        sec, nanosec = layout.stamp(data, HEADER)
        if sec == 0 and nanosec == 0:
            sec, nanosec = divmod(self._now(), 1_000_000_000)
            if sec > _LAST_SECOND:  # a bag may say it was recorded then
                self._reject('malformed', f'the stamp is zero and the time is {sec} s; allowed: '
                             f'up to {_LAST_SECOND} s; message ignored')
                return []
        stamp = sec * 1_000_000_000 + nanosec
        joints = self._joints
        if self.newest is None or stamp >= self.newest:
            self.newest = stamp
        elif self._stepped_back(stamp, layout):
            self._reject('time_jump', f'time stepped back to {stamp / 1e9:.3f} s; held joints are '
                         'forgotten')
            joints.forget()
            self.newest = stamp
        positions = layout.numbers(data, layout.positions_at)
        stamps, held = joints.stamps, joints.positions
        for slot, position in zip(layout.slots, positions):
            stamps[slot] = stamp
            held[slot] = position
        if self._velocities:
            velocities = (layout.numbers(data, layout.velocities_at)
                          if layout.velocities_at is not None else repeat(_UNKNOWN))
            for slot, velocity in zip(layout.slots, velocities):
                joints.velocities[slot] = velocity
        ready = []
        for chain, pick in layout.chains:
            if pick is not None:
                q = pick(positions)
            elif self._is_missing_or_stale(chain):
                continue
            else:
                q = tuple([held[slot] for slot in joints.of_chain[chain]])
            for value, (lower, upper) in zip(q, self._bounds[chain]):
                if not lower <= value <= upper:
                    usable = self._note_positions(chain, q)
                    break
            else:
                usable = True
            if usable:
                self.chain_counts[chain].ready += 1
                qdot = self._velocities_of(chain) if self._velocities else None
                ready.append(Ready(chain, sec, nanosec, q, qdot))
        return ready

    def note_no_velocity(self, chain: int) -> None:
        """Count a joint vector whose velocities are wanted and unknown."""
        found = {}
        for name, slot in zip(self.chains[chain].joint_names, self._joints.of_chain[chain]):
            velocity = self._joints.velocities[slot]
            if not _are_usable((velocity,)):
                found[name] = 'unknown' if math.isnan(velocity) else str(velocity)
        self._hold_back(chain, 'no_velocity', found, 'no twist: velocity of ')

    def take_counts(self, chain: int) -> ChainCounts:
        """Return what has happened to a chain since this was last called."""
        counts, self.chain_counts[chain] = self.chain_counts[chain], ChainCounts()
        return counts

    def take_over(self, previous: JointInput) -> None:
        """Go on with the joints and the counts of an input that this one replaces."""
        self.messages, self.counts = previous.messages, previous.counts
        counts = {chain.name: previous.take_counts(index)
                  for index, chain in enumerate(previous.chains)}
        self.chain_counts = [counts.get(chain.name, ChainCounts()) for chain in self.chains]
        ours, theirs = self._joints, previous._joints
        for name, slot in ours.slots.items():
            if (old := theirs.slots.get(name)) is not None:
                ours.stamps[slot] = theirs.stamps[old]
                ours.positions[slot] = theirs.positions[old]
                if previous._velocities:
                    ours.velocities[slot] = theirs.velocities[old]
        self.newest = max((stamp for stamp in ours.stamps if stamp is not None), default=None)

    def known_joints(self, chain: int) -> dict[str, int]:
        """Return the stamps [ns] of those joints of a chain that are held."""
        return {name: stamp for name, slot in zip(
            self.chains[chain].joint_names, self._joints.of_chain[chain])
            if (stamp := self._joints.stamps[slot]) is not None}

    def names_since(self, message: int = 0) -> tuple[str, ...]:
        """Return the joint names that came after so many messages, as far as is remembered."""
        layouts = [*self._layouts, *([self._latest] if self._latest else [])]
        return tuple(dict.fromkeys(name for layout in layouts if layout.last_message > message
                                   for name in layout.names))

    def _layout(self, data: bytes) -> _Layout:
        """Return what the names of a message mean, remembered or read anew."""
        layouts = self._layouts
        for index, layout in enumerate(layouts):
            if layout.fits(data):
                if index:  # the likeliest first
                    layouts.insert(0, layouts.pop(index))
                return layout
        layout = _Layout(data, read_layout(data), self._joints)
        if not layout.is_long():
            layouts.insert(0, layout)
            del layouts[_REMEMBERED_LAYOUTS:]
        return layout

    def _velocities_of(self, chain: int) -> tuple[float, ...] | None:
        """Return the velocities of a chain's joints; None if one is unknown or not finite."""
        qdot = tuple([self._joints.velocities[slot] for slot in self._joints.of_chain[chain]])
        return qdot if _are_usable(qdot) else None

    def _stepped_back(self, stamp: int, layout: _Layout) -> bool:
        assert self.newest is not None
        if self._timeout_ns and stamp < self.newest - self._timeout_ns:
            return True
        held = (self._joints.stamps[slot] for slot in layout.slots)
        return any(before is not None and before > stamp for before in held)

    def _is_missing_or_stale(self, chain: int) -> bool:
        """Tell whether a chain lacks joints, and count and report it if so."""
        names, slots = self.chains[chain].joint_names, self._joints.of_chain[chain]
        stamps = {name: self._joints.stamps[slot] for name, slot in zip(names, slots)}
        known = [stamp for stamp in stamps.values() if stamp is not None]
        newest = max(known)
        oldest_allowed = newest - self._timeout_ns if self._timeout_ns else min(known)
        missing = {name: 'never seen' for name, stamp in stamps.items() if stamp is None}
        stale = {name: f'{(newest - stamp) / 1e9:.3f} s old' for name, stamp in stamps.items()
                 if stamp is not None and stamp < oldest_allowed}
        self._hold_back(chain, 'missing_joint', missing)
        self._hold_back(chain, 'stale_joint', stale)
        if missing or stale:
            fresh = [self._joints.positions[slot] if name not in missing | stale else 0.0
                     for name, slot in zip(names, slots)]
            self._hold_back(chain, 'non_finite', self._not_finite(chain, fresh))
        return bool(missing or stale)

    def _note_positions(self, chain: int, q: Sequence[float]) -> bool:
        """Note which positions are not finite or out of range; tell whether the pose goes out."""
        bad = self._not_finite(chain, q)
        self._hold_back(chain, 'non_finite', bad)
        if bad:
            return False
        names = self.chains[chain].joint_names
        outside, turns = {}, {}
        for name, value, (lower, upper), link in zip(names, q, self._bounds[chain],
                                                     self.chains[chain].joints):
            if not lower <= value <= upper:
                outside[name] = f'{value:.6g}'
                beyond = max(lower - value, value - upper)
                if not link.is_prismatic and min(abs(value), beyond) > 2 * math.pi:
                    turns[name] = f'{value:.6g}'
        self.chain_counts[chain].note('out_of_range', outside)
        if turns:
            self.chain_counts[chain].note('looks_like_degrees', turns)
        return True

    def _not_finite(self, chain: int, q: Sequence[float]) -> dict[str, str]:
        return {name: str(value) for name, value in zip(self.chains[chain].joint_names, q)
                if not abs(value) < LARGEST_VALUE}

    def _hold_back(self, chain: int, reason: str, joints: dict[str, str],
                   what: str = 'no pose: ') -> None:
        """Count and report what keeps a chain from being published, if anything does."""
        if not joints:
            return
        self.chain_counts[chain].held_back[reason] += 1
        self.chain_counts[chain].note(reason, joints)
        listed = ', '.join(f'{name} {found}' for name, found in joints.items())
        self._report(reason, f'{self.chains[chain].name}: {what}{listed}')

    def _reject(self, reason: str, text: str) -> None:
        self.counts[reason] += 1
        if text:
            self._report(reason, text)


def _refusal(layout: JointStateLayout) -> tuple[str, str] | None:
    """Return why messages of a layout are refused as a whole, and what to report of it."""
    names, n = layout.names, len(layout.names)
    if layout.positions.n == 0:
        return 'empty_position', ''  # which is counted only
    if layout.positions.n < n:
        return 'short_position', (f'position has {layout.positions.n} values for {n} names; '
                                  'message ignored')
    if len(set(names)) < n:
        twice = next(name for name, count in Counter(names).items() if count > 1)
        return 'duplicate_name', f'name {twice[:60]!r} appears twice; message ignored'
    return None


def _are_usable(values: Sequence[float]) -> bool:
    """Return whether all values are finite, with room to compute with them."""
    for value in values:
        if not -LARGEST_VALUE < value < LARGEST_VALUE:
            return False
    return True


def _picker(places: list[int]) -> Callable[[Any], Any]:
    """Return what picks the values at some places out of a tuple, as a tuple."""
    first, last = places[0], places[-1]
    if places == list(range(first, last + 1)):
        return itemgetter(slice(first, last + 1))
    return itemgetter(*places)
