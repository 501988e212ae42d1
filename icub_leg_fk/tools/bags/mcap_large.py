"""MCAP chunks too large to be held in memory: taken apart, on disk if they are compressed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryFile
from typing import BinaryIO, cast
import zlib

from icub_leg_fk.tools.bags import mcap_records as mcap
from icub_leg_fk.tools.bags.compression import decompress_pieces

_LARGE = 1 << 23
_PART = 1 << 20
_PIECE = 1 << 16
_MISMATCH = 'does not match its checksum or size'


def is_large(span: mcap.Span) -> bool:
    """Return whether a span is a chunk that is not to be read at once."""
    return span.plain_size > 0 and max(span.size, span.plain_size) > _LARGE


def plain_file(file: BinaryIO, span: mcap.Span, scratch: Path) -> tuple[BinaryIO, int, int]:
    """Return a file with a large chunk's data, decompressed, and where they begin and end in it.

    Args:
        file: the file that the chunk is in.
        span: the chunk.
        scratch: directory for a file without a name, if the data have to be decompressed.

    Raises:
        ValueError: the data are not what was written.
    """
    plain = cast(BinaryIO, TemporaryFile(dir=scratch)) if span.compression else None
    crc = size = 0
    try:
        for piece in decompress_pieces(span.compression, _pieces(file, span)):
            crc = zlib.crc32(piece, crc)
            size += len(piece)
            if size > span.plain_size:
                raise ValueError(_MISMATCH)
            if plain:
                plain.write(piece)
        if span.complete and (size != span.plain_size or (span.crc and crc != span.crc)):
            raise ValueError(_MISMATCH)
    except ValueError as error:
        if plain:
            plain.close()
        raise ValueError(f'chunk at byte {span.offset}: {error}') from error
    return (plain, 0, size) if plain else (file, span.offset, span.offset + size)


def records(file: BinaryIO, at: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Yield each record's number, where it begins and where it ends, from an offset to another."""
    while at + mcap.RECORD.size <= end:
        file.seek(at)
        number, size = mcap.RECORD.unpack(file.read(mcap.RECORD.size))
        start, at = at, at + mcap.RECORD.size + size
        if at <= end:
            yield number, start, at


def message_spans(file: BinaryIO, at: int, end: int) -> list[mcap.Span]:
    """Return where the messages between two offsets are, in parts of about a megabyte."""
    spans: list[mcap.Span] = []
    for number, start, behind in records(file, at, end):
        if number == mcap.MESSAGE:
            file.seek(start)
            note_message(spans, file.read(mcap.MESSAGE_HEAD.size), start, behind)
    return spans


def note_message(spans: list[mcap.Span], head: bytes, at: int, end: int) -> None:
    """Add a message to the last span, if that goes on here and has room, or else to a new one.

    Args:
        spans: the spans.
        head: the message up to its data.
        at: where it begins.
        end: where it ends.
    """
    if len(head) < mcap.MESSAGE_HEAD.size:
        return
    time = mcap.MESSAGE_HEAD.unpack(head)[4]
    last = spans[-1] if spans else None
    if last and not last.plain_size and last.offset + last.size == at and last.size < _PART:
        spans[-1] = last._replace(start=min(last.start, time), end=max(last.end, time),
                                  size=end - last.offset)
    else:
        spans.append(mcap.Span(time, at, time, end - at))


def _pieces(file: BinaryIO, span: mcap.Span) -> Iterator[bytes]:
    file.seek(span.offset)
    left = span.size
    while left and (piece := file.read(min(left, _PIECE))):
        left -= len(piece)
        yield piece
