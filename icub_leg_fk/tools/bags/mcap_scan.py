"""Finds out what is in an MCAP file, whole or not.

The file is walked through from record to record, hopping over the contents of chunks, so that a
file without footer and summary (a recorder that was killed) is read like any other. What a
damaged part hides is found again with the chunk index, if there is one.
"""

from __future__ import annotations

from contextlib import suppress
from io import BytesIO
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from icub_leg_fk.tools.bags import mcap_records as mcap
from icub_leg_fk.tools.bags.compression import decompress
from icub_leg_fk.tools.bags.mcap_large import is_large, note_message, plain_file, records
from icub_leg_fk.tools.bags.topics import Topic

_LARGEST_DESCRIPTION = 1 << 26  # bytes of a schema or channel record
_LARGEST_CHUNK = 1 << 30
_CHUNK_HEAD = 64  # bytes, at least: times, size, CRC, name of the compression, size


class McapScan:
    """What is in an MCAP file.

    Args:
        file: the file.
        size: its size.
        scratch: directory for what has to be decompressed to be read.

    Attributes:
        topics: its topics by channel.
        spans: where its messages are, in the order of the file.
        damage: what is not readable.
        attachments: how many attachments it has.
    """

    def __init__(self, file: BinaryIO, size: int, scratch: Path) -> None:
        self.topics: dict[int, Topic] = {}
        self.spans: list[mcap.Span] = []
        self.damage: list[str] = []
        self.attachments = 0
        self._file = file
        self._size = size
        self._scratch = scratch
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._indexed: list[int] = []
        self._channels_expected: int | None = None
        self._scan()

    def _scan(self) -> None:
        start = self._file.read(len(mcap.MAGIC))
        if start != mcap.MAGIC:
            found = f'starts with {start.hex(" ")}' if start else 'is empty'
            self.damage.append(f'is no MCAP file: {found}')
        stopped = self._walk(len(mcap.MAGIC))
        if stopped is not None:
            self._use_index(stopped)
        if self._channels_expected is None or len(self.topics) < self._channels_expected:
            for span in self.spans:
                if span.plain_size:
                    self._describe_chunk(span)

    def _walk(self, at: int, records: int = -1) -> int | None:
        """Take note of all records, or some, from an offset on.

        Returns:
            None if the footer was reached; else the offset where nothing more could be read.
        """
        self._file.seek(min(at, self._size))
        while records:
            records -= 1
            head = self._file.read(mcap.RECORD.size)
            if len(head) < mcap.RECORD.size:
                break
            number, size = mcap.RECORD.unpack(head)
            if not mcap.HEADER <= number <= mcap.DATA_END:
                break
            end = at + mcap.RECORD.size + size
            if number == mcap.CHUNK:
                self._note_chunk(at + mcap.RECORD.size, size)
            if end > self._size:
                break
            if number == mcap.FOOTER:
                return None
            if number == mcap.MESSAGE:
                head += self._file.read(mcap.MESSAGE_HEAD.size - mcap.RECORD.size)
                note_message(self.spans, head, at, end)
            elif number == mcap.ATTACHMENT:
                self.attachments += 1
            elif number in (mcap.SCHEMA, mcap.CHANNEL, mcap.CHUNK_INDEX, mcap.STATISTICS):
                if size > _LARGEST_DESCRIPTION:
                    break
                self._note(number, self._file.read(size))
            at = end
            self._file.seek(at)
        return at

    def _note(self, number: int, data: bytes) -> None:
        fields = mcap.Fields(data)
        try:
            if number == mcap.SCHEMA:
                schema = fields.number('H')
                self._schemas[schema] = (fields.text(), fields.text(), fields.text())
            elif number == mcap.CHANNEL:
                channel = fields.number('H')
                name, encoding, definition = self._schemas.get(fields.number('H'), ('', '', ''))
                topic, serialization, extra = fields.text(), fields.text(), fields.texts()
                self.topics[channel] = Topic(
                    topic, name, serialization, extra.get('offered_qos_profiles', ''),
                    extra.get('topic_type_hash', ''), encoding, definition)
            elif number == mcap.CHUNK_INDEX:
                fields.number('Q')
                fields.number('Q')
                self._indexed.append(fields.number('Q'))
            elif number == mcap.STATISTICS:
                fields.number('Q')
                fields.number('H')
                self._channels_expected = fields.number('I')
        except ValueError as error:
            self.damage.append(f'record 0x{number:02x}: {error}')

    def _note_chunk(self, at: int, size: int) -> None:
        fields = mcap.Fields(self._file.read(min(size, _CHUNK_HEAD)))
        try:
            start, end, plain_size = (fields.number('Q') for _ in range(3))
            crc, compression, data_size = fields.number('I'), fields.text(), fields.number('Q')
        except ValueError:
            self.damage.append(f'chunk at byte {at}: its header is unreadable')
            return
        at += 40 + len(compression)
        present = min(data_size, self._size - at)
        if max(present, plain_size) > _LARGEST_CHUNK:
            self.damage.append(f'chunk at byte {at}: larger than {_LARGEST_CHUNK} bytes')
        elif present > 0:
            self.spans.append(mcap.Span(start, at, end, present, present == data_size,
                                        compression, plain_size, crc))

    def _use_index(self, stopped: int) -> None:
        """Find the chunks behind an unreadable place with the summary, if that can be read."""
        self._indexed.clear()
        if self._size >= 37:
            self._file.seek(-37, 2)
            footer = self._file.read()
            if footer[0] == mcap.FOOTER and footer.endswith(mcap.MAGIC):
                self._walk(struct.unpack_from('<Q', footer, mcap.RECORD.size)[0])
        behind = [at for at in self._indexed if at > stopped]
        for at in behind:
            self._walk(at, 1)
        if behind:
            self.damage.append(f'unreadable from byte {stopped} to {min(behind)}')
        elif stopped == self._size:
            self.damage.append('was not closed: everything up to its end has been read')
        else:
            self.damage.append(f'cut off or unreadable from byte {stopped} of {self._size} on')

    def _describe_chunk(self, span: mcap.Span) -> None:
        """Take note of the schemas and channels inside a chunk."""
        with suppress(ValueError):  # told when its messages are read
            if is_large(span):
                file, at, end = plain_file(self._file, span, self._scratch)
            else:
                data = span_data(self._file, span)
                file, at, end = BytesIO(data), 0, len(data)
            for number, start, behind in records(file, at, end):
                if number in (mcap.SCHEMA, mcap.CHANNEL):
                    file.seek(start + mcap.RECORD.size)
                    self._note(number, file.read(behind - start - mcap.RECORD.size))
            if file is not self._file:
                file.close()


def span_data(file: BinaryIO, span: mcap.Span) -> bytes:
    """Return the data of a span, decompressed.

    Raises:
        ValueError: it is not what was written.
    """
    file.seek(span.offset)
    try:
        data = decompress(span.compression, file.read(span.size), span.plain_size)
    except ValueError as error:
        raise ValueError(f'chunk at byte {span.offset}: {error}') from error
    if span.complete and span.plain_size and (
            len(data) != span.plain_size or (span.crc and zlib.crc32(data) != span.crc)):
        raise ValueError(f'chunk at byte {span.offset}: does not match its checksum or size')
    return data
