"""MCAP records (mcap.dev/spec): their numbers, and what this package reads and writes of them."""

from __future__ import annotations

from collections.abc import Iterable
import struct
from typing import NamedTuple

MAGIC = b'\x89MCAP0\r\n'
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = (
    0x09, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F)

RECORD = struct.Struct('<BQ')  # number of the record, length of what follows
MESSAGE_HEAD = struct.Struct('<BQHIQQ')  # and channel, sequence, log time, publish time


class Span(NamedTuple):
    """A stretch of a file that holds messages: the data of a chunk, or messages outside of any.

    Attributes:
        start: earliest log time [ns].
        offset: where the data begins.
        end: latest log time [ns].
        size: how much there is of it.
        complete: whether the file has all of it.
        compression: `zstd`, `lz4` or empty.
        plain_size: size when decompressed.
        crc: CRC-32 when decompressed; 0 if unknown.
    """

    start: int
    offset: int
    end: int
    size: int
    complete: bool = True
    compression: str = ''
    plain_size: int = 0
    crc: int = 0


class Fields:
    """Reads the fields of a record one after another.

    Every method raises ValueError where the record ends too early, or a text is no UTF-8.

    Args:
        data: the record, without its number and length.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def number(self, code: str) -> int:
        """Return the next number, of a `struct` format."""
        return int(struct.unpack(f'<{code}', self._take(struct.calcsize(f'<{code}')))[0])

    def text(self) -> str:
        """Return the next string."""
        return self.block().decode()

    def block(self) -> bytes:
        """Return the next bytes that their length stands before."""
        return self._take(self.number('I'))

    def texts(self) -> dict[str, str]:
        """Return the next map of strings."""
        fields = Fields(self.block())
        found = {}
        while fields._at < len(fields._data):
            key = fields.text()
            found[key] = fields.text()
        return found

    def rest(self) -> bytes:
        """Return everything that is left."""
        return self._take(len(self._data) - self._at)

    def _take(self, size: int) -> bytes:
        piece = self._data[self._at:self._at + size]
        if len(piece) < size:
            raise ValueError('a record is shorter than its fields')
        self._at += size
        return piece


def record(number: int, *fields: bytes) -> bytes:
    """Return the bytes of a record."""
    return RECORD.pack(number, sum(map(len, fields))) + b''.join(fields)


def text(value: str) -> bytes:
    """Return a string as it stands in a record."""
    return block(value.encode())


def texts(values: Iterable[tuple[str, str]]) -> bytes:
    """Return a map of strings as it stands in a record."""
    return block(b''.join(text(key) + text(value) for key, value in values))


def block(data: bytes) -> bytes:
    """Return bytes with their length before them."""
    return struct.pack('<I', len(data)) + data
