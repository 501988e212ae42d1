"""sensor_msgs/JointState from its CDR bytes, bounds-checked.

The bytes come from the network: every length is checked against what is there before anything is
read or allocated. Layout (OMG CDR, rosidl): encapsulation (4 bytes), stamp sec and nanosec,
frame_id, name[], position[], velocity[], effort[]; alignment counts from the fifth byte. Padding
may hold anything: Fast CDR leaves in it what was in the buffer before.

What Fast CDR takes and this refuses: encapsulations other than plain CDR, in which no ROS
middleware sends a JointState; a string without NUL at its end, or with one before it.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from icub_leg_fk.errors import MalformedMessageError

_BYTE_ORDER = {b'\x00\x01': '<', b'\x00\x00': '>'}
_UINT32 = {order: struct.Struct(f'{order}I').unpack_from for order in '<>'}
STAMP_END = 12  # encapsulation and stamp; frame_id follows


class JointStateMessage(NamedTuple):
    """The fields of a JointState that matter here, and where its numbers lie in the bytes.

    Attributes:
        sec: seconds of the stamp.
        nanosec: nanoseconds of the stamp.
        names: joint names.
        positions: positions [rad or m].
        velocities: velocities [rad/s or m/s].
        byte_order: `<` or `>`.
        positions_at: offset of the first position.
        velocity_count_at: offset of the count of velocities.
        velocities_at: offset of the first velocity.
        effort_count_at: offset of the count of efforts.
        efforts: number of efforts.
        padding: offset and size of what is skipped for alignment.
    """

    sec: int
    nanosec: int
    names: tuple[str, ...]
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    byte_order: str
    positions_at: int
    velocity_count_at: int
    velocities_at: int
    effort_count_at: int
    efforts: int
    padding: tuple[tuple[int, int], ...]


def decode_joint_state(data: bytes) -> JointStateMessage:
    """Decode a serialized JointState.

    Raises:
        MalformedMessageError: the bytes end too early, a length is absurd, or the encoding is
            not plain CDR; names the field.
    """
    byte_order = _BYTE_ORDER.get(bytes(data[:2]))
    if byte_order is None:
        raise MalformedMessageError(
            f'JointState: encapsulation found 0x{bytes(data[:2]).hex()}, allowed: 0x0000, 0x0001')
    reader = _Reader(data, byte_order)
    sec, nanosec = reader.stamp()
    reader.string('header.frame_id')
    # A string takes at least its length field, so the count cannot exceed a quarter of the rest.
    names = tuple([reader.string('name') for _ in range(reader.count('name', 4))])
    positions_at, positions = reader.doubles('position')
    velocity_count_at = reader.align(4)
    velocities_at, velocities = reader.doubles('velocity')
    effort_count_at = reader.align(4)
    _, efforts = reader.doubles('effort')
    return JointStateMessage(sec, nanosec, names, positions, velocities, byte_order,
                             positions_at, velocity_count_at, velocities_at, effort_count_at,
                             len(efforts), tuple(reader.padding))


class _Reader:
    """A position in CDR bytes that refuses to move past their end."""

    def __init__(self, data: bytes, byte_order: str) -> None:
        self.padding: list[tuple[int, int]] = []
        self._data = data
        self._size = len(data)
        self._order = byte_order
        self._uint32 = _UINT32[byte_order]
        self._at = 4

    def align(self, size: int) -> int:
        """Return the next offset that is a multiple of size, and go there."""
        padding = (4 - self._at) % size
        if padding:
            self.padding.append((self._at, padding))
            self._at += padding
        return self._at

    def stamp(self) -> tuple[int, int]:
        """Return seconds and nanoseconds."""
        sec, nanosec = struct.unpack_from(
            f'{self._order}iI', self._data, self._take('header.stamp', 8))
        return sec, nanosec

    def count(self, field: str, item_size: int) -> int:
        """Return the count of items that follow; they fit in what is left."""
        self.align(4)
        count: int = self._uint32(self._data, self._take(field, 4))[0]
        if count * item_size > self._size - self._at:
            raise MalformedMessageError(
                f'JointState: {field} found {count} items, '
                f'allowed: what fits in {self._size - self._at} bytes')
        return count

    def string(self, field: str) -> str:
        """Return a string, which takes its length and that many bytes, the last one NUL."""
        size = self.count(field, 1)
        start = self._take(field, size)
        text = self._data[start:self._at]
        if size and text.find(0) != size - 1:
            raise MalformedMessageError(f'JointState: {field} is no string that ends with NUL')
        return text[:-1].decode('utf-8', 'replace')

    def doubles(self, field: str) -> tuple[int, tuple[float, ...]]:
        """Return the offset of the first number, and the numbers."""
        count = self.count(field, 8)
        if count:
            self.align(8)
        start = self._take(field, 8 * count)
        return start, struct.unpack_from(f'{self._order}{count}d', self._data, start)

    def _take(self, field: str, size: int) -> int:
        """Return the present offset and go on behind as many bytes."""
        start = self._at
        self._at = end = start + size
        if end > self._size:
            raise MalformedMessageError(
                f'JointState: {field} found to end at byte {end}, allowed: {self._size}')
        return start
