"""From serialized JointStates to joint vectors: `JointInput`'s rules, at a fraction of the cost.

A robot sends the same names in the same order a thousand times a second. The first message of a
kind is decoded in full and its layout remembered: the bytes from frame_id to the first position,
and where its numbers lie. A message that repeats these bytes is unpacked in one go; the padding
among them may differ, for publishers leave in it whatever their buffer held before. Whenever
anything is out of the ordinary (another layout, time not moving on, a number that cannot be
computed with, a chain brought in parts) the message goes the plain way, through
`decode_joint_state` and `JointInput.update`, which alone decide the rules.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import math
from operator import itemgetter
import struct
from typing import Any

from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.ros.joint_input import JointInput
from icub_leg_fk.ros.joint_state_cdr import decode_joint_state, JointStateMessage, STAMP_END
from icub_leg_fk.ros.joint_vector import are_usable, LARGEST_VALUE

_REMEMBERED_LAYOUTS = 8
_LARGEST_REMEMBERED = 65536  # bytes of a message; what a stranger sends may be larger
_LARGEST = math.nextafter(LARGEST_VALUE, 0.0)
_LAST_SECOND = (1 << 31) - 1  # that a stamp can hold
_FIRST = 3  # fields before the joints: encapsulation, sec, nanosec

Fields = tuple[Any, ...]
OnReady = Callable[[int, int, Sequence[float], Sequence[float] | None], None]
"""Called with stamp sec, nanosec, positions and velocities (None if unknown or not wanted)."""


class _Layout:
    """The shape of a message that brings some chains whole and touches no other."""

    def __init__(self, data: bytes, message: JointStateMessage, chains: Sequence[Chain],
                 velocities: bool) -> None:
        wanted = {name for chain in chains for name in chain.joint_names}
        joints = {name: index for index, name in enumerate(message.names) if name in wanted}
        places = {name: _FIRST + i for i, name in enumerate(joints)}
        moving = velocities and len(message.velocities) >= len(message.names)
        self.names = tuple(joints)
        self.positions = slice(_FIRST, _FIRST + len(joints))
        self.velocities = slice(self.positions.stop + 1, -1) if moving else None
        self.chains = tuple(
            (index, _picker([places[name] for name in chain.joint_names]),
             _picker([places[name] + len(joints) + 1 for name in chain.joint_names])
             if moving else None)
            for index, chain in enumerate(chains) if joints.keys() >= set(chain.joint_names))
        self.bounds = tuple(_bounds(name, chains) for name in self.names)
        self.size = len(data)
        self.head = data[STAMP_END:message.positions_at]
        self._mask = int.from_bytes(_head_mask(message), 'little')
        self._masked_head = int.from_bytes(self.head, 'little') & self._mask
        self.pick_fixed = itemgetter(0, self.positions.stop, -1)
        self.fixed = (data[:4], len(message.velocities), message.efforts)
        self.unpack = _struct(data, message, tuple(joints.values()), moving).unpack
        self.repeats = 0
        self.last: tuple[int, int, Fields] | None = None

    def adopt(self, data: bytes) -> bool:
        """Return whether the head of data differs in padding only; if so, it is the head now."""
        head = data[STAMP_END:STAMP_END + len(self.head)]
        same = int.from_bytes(head, 'little') & self._mask == self._masked_head
        if same:
            self.head = head
        return same


def _head_mask(message: JointStateMessage) -> bytes:
    """Return 255 for each byte from frame_id to the first position, but 0 where padding is."""
    mask = bytearray(b'\xff' * message.positions_at)
    for at, size in message.padding:
        if at < message.positions_at:
            mask[at:at + size] = bytes(size)
    return bytes(mask[STAMP_END:])


def _struct(data: bytes, message: JointStateMessage, indices: Sequence[int],
            moving: bool) -> struct.Struct:
    """Return what unpacks encapsulation, stamp, positions, a count, velocities and a count."""
    items = [(message.positions_at + 8 * index, 'd', 8) for index in indices]
    items += [(message.velocity_count_at, 'I', 4)]
    items += [(message.velocities_at + 8 * index, 'd', 8) for index in indices if moving]
    items += [(message.effort_count_at, 'I', 4)]
    fmt, at = f'{message.byte_order}4siI', STAMP_END
    for offset, code, size in items:
        fmt += f'{offset - at}x{code}'
        at = offset + size
    return struct.Struct(f'{fmt}{len(data) - at}x')


def _picker(places: list[int]) -> Callable[[Fields], Fields]:
    """Return what picks the values at some places out of a tuple, as a tuple."""
    first, last = places[0], places[-1]
    if places == list(range(first, last + 1)):
        return itemgetter(slice(first, last + 1))
    return itemgetter(*places)


def _bounds(name: str, chains: Sequence[Chain]) -> tuple[float, float]:
    """Return the range of a joint that every chain agrees with, without infinities."""
    links = [link for chain in chains
             for joint, link in zip(chain.joint_names, chain.joints, strict=True) if joint == name]
    return (max(-_LARGEST, *(link.limits[0] for link in links)),
            min(_LARGEST, *(link.limits[1] for link in links)))


class JointStream:
    """Feeds serialized JointStates through the rules and calls one function per ready chain.

    Args:
        joint_input: the rules and what they hold.
        now: returns the present time [ns], for messages with a zero stamp.
        velocities: whether velocities are wanted.

    Attributes:
        on_ready: one function or None per chain; None where nobody wants its joint vectors.
    """

    def __init__(self, joint_input: JointInput, now: Callable[[], int],
                 velocities: bool = False) -> None:
        self.on_ready: list[OnReady | None] = [None] * len(joint_input.chains)
        self._input = joint_input
        self._now = now
        self._velocities = velocities
        self._layouts: list[_Layout] = []
        self._layout: _Layout | None = None
        self._newest: int | None = None
        self._fed = 0

    def want_velocities(self, wanted: bool) -> None:
        """Change whether velocities are wanted, from the next message on."""
        if wanted != self._velocities:
            self.settle()
            self._layouts.clear()
            self._layout = None
            self._velocities = wanted

    def feed(self, data: bytes) -> None:
        """Take one serialized JointState in."""
        layout = self._layout
        if (layout is None or len(data) != layout.size
                or not data.startswith(layout.head, STAMP_END)):
            layout = self._layout = self._known_layout(data)
            if layout is None:
                self._feed_plain(data)
                return
        fields = layout.unpack(data)
        sec = fields[1]
        nanosec = fields[2]
        stamp = sec * 1_000_000_000 + nanosec
        newest = self._newest
        if (newest is None or stamp < newest or stamp == 0
                or layout.pick_fixed(fields) != layout.fixed):
            self._feed_plain(data)
            return
        if layout.velocities is not None and not are_usable(fields[layout.velocities]):
            self._feed_plain(data)
            return
        for position, (lower, upper) in zip(fields[_FIRST:], layout.bounds):
            if not lower <= position <= upper:
                if not are_usable(fields[layout.positions]):
                    self._feed_plain(data)
                    return
                for index, pick, _ in layout.chains:
                    self._input.note_range(index, pick(fields))
                break
        self._fed += 1
        layout.repeats += 1
        layout.last = (self._fed, stamp, fields)
        on_ready = self.on_ready
        for index, pick, pick_velocities in layout.chains:
            self._newest = stamp
            handler = on_ready[index]
            if handler is not None:
                handler(sec, nanosec, pick(fields), pick_velocities and pick_velocities(fields))

    def settle(self) -> JointInput:
        """Return the rules' state with everything in it that came the fast way."""
        pending = [layout for layout in self._layouts if layout.last is not None]
        for layout in sorted(pending, key=_last_fed):
            _, stamp, fields = layout.last or (0, 0, ())
            velocities = fields[layout.velocities] if layout.velocities else ()
            self._input.hold(stamp, layout.names, fields[layout.positions], velocities,
                             layout.repeats, [index for index, _, _ in layout.chains])
            layout.repeats, layout.last = 0, None
        return self._input

    def _known_layout(self, data: bytes) -> _Layout | None:
        layouts = [layout for layout in self._layouts if layout.size == len(data)]
        for layout in layouts:
            if data.startswith(layout.head, STAMP_END):
                return layout
        return next((layout for layout in layouts if layout.adopt(data)), None)

    def _feed_plain(self, data: bytes) -> None:
        joint_input = self.settle()
        try:
            message = decode_joint_state(data)
        except MalformedMessageError as error:
            joint_input.reject_malformed(error)
            return
        sec, nanosec = message.sec, message.nanosec
        if sec == 0 and nanosec == 0:
            sec, nanosec = divmod(self._now(), 1_000_000_000)
            if sec > _LAST_SECOND:  # a bag may say it was recorded then
                joint_input.reject_malformed(MalformedMessageError(
                    f'stamp: found none at {sec} s, allowed: up to {_LAST_SECOND} s'))
                return
        vectors = joint_input.update(sec * 1_000_000_000 + nanosec, message.names,
                                     message.positions, message.velocities)
        self._newest = joint_input.newest
        if self._known_layout(data) is None:
            self._remember(data, message)
        for vector in vectors:
            handler = self.on_ready[vector.chain]
            if handler is not None:
                velocities = vector.velocities if self._velocities else None
                handler(sec, nanosec, vector.positions, velocities)

    def _remember(self, data: bytes, message: JointStateMessage) -> None:
        """Remember the layout of a message, if every chain it touches is wholly in it."""
        if len(data) > _LARGEST_REMEMBERED:
            return
        names = set(message.names)
        if len(names) != len(message.names) or not len(names) <= len(message.positions) > 0:
            return
        for chain in self._input.chains:
            if 0 < len(names.intersection(chain.joint_names)) < len(chain.joint_names):
                return
        if len(self._layouts) >= _REMEMBERED_LAYOUTS:
            self._layouts.clear()
        self._layout = _Layout(data, message, self._input.chains, self._velocities)
        self._layouts.append(self._layout)


def _last_fed(layout: _Layout) -> int:
    return layout.last[0] if layout.last else 0
