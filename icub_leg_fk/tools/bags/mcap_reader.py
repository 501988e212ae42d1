"""Reads the messages of one MCAP file in blocks, whole or not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from operator import itemgetter
from pathlib import Path
from typing import BinaryIO, NamedTuple

from icub_leg_fk.tools.bags import mcap_records as mcap
from icub_leg_fk.tools.bags.compression import COMPRESSIONS
from icub_leg_fk.tools.bags.mcap_large import is_large, message_spans, plain_file
from icub_leg_fk.tools.bags.mcap_scan import McapScan, span_data
from icub_leg_fk.tools.bags.time_queue import TimeQueue
from icub_leg_fk.tools.bags.topics import Message

_LATEST = (1 << 63) - 1  # ns; ROS 2 has signed times
_log_time = itemgetter(2)


class _Source(NamedTuple):
    """A file, and which spans of it are still to be read: the earliest last."""

    file: BinaryIO
    spans: list[mcap.Span]


def _next_start(source: _Source) -> int:
    return source.spans[-1].start


class McapFile:
    """One MCAP file.

    Args:
        path: the file.
        scratch: directory for what has to be decompressed to be read.

    Attributes:
        path: the file.
        topics: its topics by channel.
        damage: what could not be read.
        compression: compression of its first chunk, of those that can be read.
        attachments: how many attachments it has; they are no messages, and not read.
        late: messages behind others that were recorded after them, too far off to be sorted.
        done: bytes read so far.
    """

    def __init__(self, path: Path, scratch: Path) -> None:
        self.path = path
        self.done = 0
        self.late = 0
        self._scratch = scratch
        self._nameless: set[int] = set()
        self._timeless = 0
        with path.open('rb') as file:
            scan = McapScan(file, path.stat().st_size, scratch)
        self.topics, self.damage, self.attachments = scan.topics, scan.damage, scan.attachments
        self._spans = scan.spans
        self.compression = next((span.compression for span in sorted(self._spans)
                                 if span.compression in COMPRESSIONS), '')

    def blocks(self, indices: Mapping[int, int]) -> Iterator[list[Message]]:
        """Yield the messages in order of their log time, some at a time.

        Args:
            indices: index that a message's topic is to have, by channel; others are left out.
        """
        queue = TimeQueue()
        with self.path.open('rb') as file:
            sources = [_Source(file, sorted(self._spans, reverse=True))]
            while sources := [source for source in sources if source.spans]:
                source = min(sources, key=_next_start)
                span = source.spans.pop()
                if is_large(span):
                    sources.append(self._taken_apart(file, span))
                else:
                    queue.put(self._messages(source.file, span, indices))
                    self.done += span.size if source.file is file else 0
                if not source.spans and source.file is not file:
                    source.file.close()
                coming = [_next_start(source) for source in sources if source.spans]
                if ready := queue.take(min(coming, default=None)):
                    yield ready
        self.late = queue.late
        if self._timeless:
            self.damage.append(f'{self._timeless} messages with an impossible time')
        if self._nameless:
            self.damage.append(f'messages without a topic, on {len(self._nameless)} channels')

    def _taken_apart(self, file: BinaryIO, span: mcap.Span) -> _Source:
        try:
            plain, start, end = plain_file(file, span, self._scratch)
        except ValueError as error:
            self.damage.append(str(error))
            return _Source(file, [])
        return _Source(plain, sorted(message_spans(plain, start, end), reverse=True))

    def _messages(self, file: BinaryIO, span: mcap.Span,
                  indices: Mapping[int, int]) -> list[Message]:
        """Return the messages of a span in order of their log time."""
        try:
            data = span_data(file, span)
        except ValueError as error:
            self.damage.append(str(error))
            return []
        size, head, at = len(data), mcap.MESSAGE_HEAD.size, 0
        unpack = mcap.MESSAGE_HEAD.unpack_from
        found: list[Message] = []
        latest, in_order = 0, True
        while at + head <= size:
            number, length, channel, sequence, log_time, publish_time = unpack(data, at)
            start, at = at + head, at + mcap.RECORD.size + length
            if number != mcap.MESSAGE or not start <= at <= size:
                continue
            if log_time > _LATEST:
                self._timeless += 1
            elif channel in indices:
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
