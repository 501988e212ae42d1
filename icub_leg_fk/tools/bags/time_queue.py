"""Brings the messages of overlapping stretches of a recording in the order of their time."""

from __future__ import annotations

from bisect import bisect_right
from operator import itemgetter

from icub_leg_fk.tools.bags.topics import Message

_MOST_HELD = 1 << 25  # bytes
_OVERHEAD = 256  # bytes that a message takes beside its data
_log_time = itemgetter(2)


class TimeQueue:
    """Holds messages until nothing earlier can come, or until it holds too much.

    Attributes:
        late: messages that came when later ones had been given out already.
    """

    def __init__(self) -> None:
        self.late = 0
        self._held: list[Message] = []
        self._given_out = -1  # time up to which messages had to be given out before their turn

    def put(self, messages: list[Message]) -> None:
        """Add messages that are in the order of their time."""
        if messages and messages[0][2] < self._given_out:
            self.late += sum(message[2] < self._given_out for message in messages)
        overlap = self._held and messages and messages[0][2] < self._held[-1][2]
        self._held += messages
        if overlap:
            self._held.sort(key=_log_time)

    def take(self, until: int | None) -> list[Message]:
        """Return the messages up to a time, before which nothing more comes; all if that is None.

        Args:
            until: the time [ns].
        """
        held = self._held
        if until is None or not held or held[-1][2] <= until:
            self._held = []
            return held
        count = bisect_right(held, until, key=_log_time)
        if self._size() > _MOST_HELD:
            count = max(count, len(held) // 2)
            self._given_out = held[count - 1][2]
        self._held = held[count:]
        return held[:count]

    def _size(self) -> int:
        return sum(len(message[4]) + _OVERHEAD for message in self._held)
