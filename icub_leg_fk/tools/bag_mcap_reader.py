"""Reads the messages of one MCAP file in blocks, whole or not.

The file is walked through from record to record, hopping over the contents of chunks, so that a
file without footer and summary (a recorder that was killed) is read like any other. What a
damaged part hides is found again with the chunk index, if there is one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from operator import itemgetter
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from icub_leg_fk.tools import bag_mcap_records as mcap
from icub_leg_fk.tools.bag_codecs import decompress
from icub_leg_fk.tools.bag_topics import Message, Topic

_BLOCK = 1 << 20
_LARGEST_DESCRIPTION = 1 << 26  # bytes of a schema or channel record
_LARGEST_CHUNK = 1 << 30
_CHUNK_HEAD = 64  # bytes, at least: times, size, CRC, name of the compression, size
_log_time = itemgetter(2)


class McapFile:
    """One MCAP file.

    Attributes:
        path: the file.
        topics: its topics by channel.
        damage: what could not be read.
        compression: compression of its first chunk.
        attachments: how many attachments it has; they are no messages, and not read.
        done: bytes read so far.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[int, Topic] = {}
        self.damage: list[str] = []
        self.attachments = 0
        self.done = 0
        self._nameless: set[int] = set()
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._spans: list[mcap.Span] = []
        self._indexed: list[int] = []
        self._channels_expected: int | None = None
        self._size = path.stat().st_size
        with path.open('rb') as file:
            self._scan(file)
        self._spans.sort()
        self.compression = self._spans[0].compression if self._spans else ''

    def blocks(self, indices: Mapping[int, int]) -> Iterator[list[Message]]:
        """Yield the messages in order of their log time, some at a time.

        Args:
            indices: index that a message's topic is to have, by channel; others are left out.
        """
        held: list[Message] = []
        spans = self._spans
        with self.path.open('rb') as file:
            for position, span in enumerate(spans):
                found = self._messages(file, span, indices)
                self.done += span.size
                overlap = held and found and found[0][2] < held[-1][2]
                held += found
                if overlap:
                    held.sort(key=_log_time)
                until = spans[position + 1].start if position + 1 < len(spans) else None
                if until is None or not held or held[-1][2] <= until:
                    ready, held = held, []
                else:
                    count = sum(1 for message in held if message[2] <= until)
                    ready, held = held[:count], held[count:]
                if ready:
                    yield ready
        if self._nameless:
            self.damage.append(f'messages without a topic, on {len(self._nameless)} channels')

    def _scan(self, file: BinaryIO) -> None:
        start = file.read(len(mcap.MAGIC))
        if start != mcap.MAGIC:
            found = f'starts with {start.hex(" ")}' if start else 'is empty'
            self.damage.append(f'is no MCAP file: {found}')
            return
        stopped = self._walk(file, len(mcap.MAGIC))
        if stopped is not None:
            self._use_index(file, stopped)
        if self._channels_expected is None or len(self.topics) < self._channels_expected:
            for span in self._spans:
                if span.plain_size:
                    self._describe_chunk(file, span)

    def _walk(self, file: BinaryIO, at: int, records: int = -1) -> int | None:
        """Take note of all records, or some, from an offset on.

        Returns:
            None if the footer was reached; else the offset where nothing more could be read.
        """
        file.seek(at)
        while records:
            records -= 1
            head = file.read(mcap.RECORD.size)
            if len(head) < mcap.RECORD.size:
                break
            number, size = mcap.RECORD.unpack(head)
            if not mcap.HEADER <= number <= mcap.DATA_END:
                break
            end = at + mcap.RECORD.size + size
            if number == mcap.CHUNK:
                self._note_chunk(file, at + mcap.RECORD.size, size)
            if end > self._size:
                break
            if number == mcap.FOOTER:
                return None
            if number == mcap.MESSAGE:
                head += file.read(mcap.MESSAGE_HEAD.size - mcap.RECORD.size)
                self._note_message(head, at, end)
            elif number == mcap.ATTACHMENT:
                self.attachments += 1
            elif number in (mcap.SCHEMA, mcap.CHANNEL, mcap.CHUNK_INDEX, mcap.STATISTICS):
                if size > _LARGEST_DESCRIPTION:
                    break
                self._note(number, file.read(size))
            at = end
            file.seek(at)
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

    def _note_chunk(self, file: BinaryIO, at: int, size: int) -> None:
        fields = mcap.Fields(file.read(min(size, _CHUNK_HEAD)))
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
            self._spans.append(mcap.Span(start, at, end, present, present == data_size,
                                         compression, plain_size, crc))

    def _note_message(self, head: bytes, at: int, end: int) -> None:
        if len(head) < mcap.MESSAGE_HEAD.size:
            return
        time = mcap.MESSAGE_HEAD.unpack(head)[4]
        last = self._spans[-1] if self._spans else None
        if last and not last.plain_size and last.offset + last.size == at and last.size < _BLOCK:
            self._spans[-1] = last._replace(start=min(last.start, time), end=max(last.end, time),
                                            size=end - last.offset)
        else:
            self._spans.append(mcap.Span(time, at, time, end - at))

    def _use_index(self, file: BinaryIO, stopped: int) -> None:
        """Find the chunks behind an unreadable place with the summary, if that can be read."""
        self._indexed.clear()
        if self._size >= 37:
            file.seek(-37, 2)
            footer = file.read()
            if footer[0] == mcap.FOOTER and footer.endswith(mcap.MAGIC):
                self._walk(file, struct.unpack_from('<Q', footer, mcap.RECORD.size)[0])
        behind = [at for at in self._indexed if at > stopped]
        for at in behind:
            self._walk(file, at, 1)
        if behind:
            self.damage.append(f'unreadable from byte {stopped} to {min(behind)}')
        elif stopped == self._size:
            self.damage.append('was not closed: everything up to its end has been read')
        else:
            self.damage.append(f'cut off or unreadable from byte {stopped} of {self._size} on')

    def _describe_chunk(self, file: BinaryIO, span: mcap.Span) -> None:
        """Take note of the schemas and channels inside a chunk."""
        data, at = self._data(file, span, []), 0
        while at + mcap.RECORD.size <= len(data):
            number, size = mcap.RECORD.unpack_from(data, at)
            end = at + mcap.RECORD.size + size
            if number in (mcap.SCHEMA, mcap.CHANNEL) and end <= len(data):
                self._note(number, data[at + mcap.RECORD.size:end])
            at = end

    def _data(self, file: BinaryIO, span: mcap.Span, damage: list[str]) -> bytes:
        """Return the data of a span, decompressed; nothing if it is not what was written."""
        file.seek(span.offset)
        try:
            data = decompress(span.compression, file.read(span.size))
        except ValueError as error:
            damage.append(f'chunk at byte {span.offset}: {error}')
            return b''
        if span.complete and span.plain_size and (
                len(data) != span.plain_size or (span.crc and zlib.crc32(data) != span.crc)):
            damage.append(f'chunk at byte {span.offset}: its contents do not match their '
                          'checksum or size')
            return b''
        return data

    def _messages(self, file: BinaryIO, span: mcap.Span,
                  indices: Mapping[int, int]) -> list[Message]:
        """Return the messages of a span in order of their log time."""
        data = self._data(file, span, self.damage)
        size, head, at = len(data), mcap.MESSAGE_HEAD.size, 0
        unpack = mcap.MESSAGE_HEAD.unpack_from
        found: list[Message] = []
        latest, in_order = 0, True
        while at + head <= size:
            number, length, channel, sequence, log_time, publish_time = unpack(data, at)
            start, at = at + head, at + mcap.RECORD.size + length
            if number != mcap.MESSAGE or not start <= at <= size:
                continue
            if channel in indices:
                if log_time < latest:
                    in_order = False
                latest = log_time
                found.append((indices[channel], sequence, log_time, publish_time, data[start:at]))
            elif channel not in self.topics:
                self._nameless.add(channel)
        if at > size and span.complete and data:
            self.damage.append(f'chunk at byte {span.offset}: its last record is cut off')
        if not in_order:
            found.sort(key=_log_time)
        return found
