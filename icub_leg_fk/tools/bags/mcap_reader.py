"""Reads the messages of one MCAP file in blocks, whole or not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from operator import itemgetter
from pathlib import Path
from typing import BinaryIO

from icub_leg_fk.tools.bags import mcap_records as mcap
from icub_leg_fk.tools.bags.mcap_scan import McapScan, span_data
from icub_leg_fk.tools.bags.topics import Message

_LATEST = (1 << 63) - 1  # ns; ROS 2 has signed times
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
        self.done = 0
        self._nameless: set[int] = set()
        self._timeless = 0
        with path.open('rb') as file:
            scan = McapScan(file, path.stat().st_size)
        self.topics, self.damage, self.attachments = scan.topics, scan.damage, scan.attachments
        self._spans = sorted(scan.spans)
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
        if self._timeless:
            self.damage.append(f'{self._timeless} messages with an impossible time')
        if self._nameless:
            self.damage.append(f'messages without a topic, on {len(self._nameless)} channels')

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
