"""What one foot has been promised, and what has come of it."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple


class Promise(NamedTuple):
    """A pose that the rules of the input promise.

    Attributes:
        stamp: its stamp [ns].
        certain: False while it is open whether the message has reached the node at all.
        sent: when its message was sent [ns].
        sample: which sample of the gait it shows.
        doing: what was being done to the node then.
    """

    stamp: int
    certain: bool
    sent: int
    sample: int
    doing: str


class Ledger:
    """Promises of one foot, kept in order.

    Attributes:
        kept: poses that arrived as promised.
        lost: promises that were passed over.
        unexpected: poses that nothing had promised.
        examples: the first few of both, in words.
    """

    def __init__(self, name: str) -> None:
        self.kept = self.lost = self.unexpected = 0
        self.examples: list[str] = []
        self._name = name
        self._open: deque[Promise] = deque()

    def promise(self, promise: Promise) -> None:
        """Note what has to arrive next."""
        self._open.append(promise)

    def arrived(self, stamp: int) -> Promise | None:
        """Return the promise that a pose keeps, or None if there is none."""
        for passed_over, promise in enumerate(self._open):
            if promise.stamp == stamp:
                for _ in range(passed_over):
                    self._miss(self._open.popleft())
                self.kept += 1
                return self._open.popleft()
        self.unexpected += 1
        self._say(f'unexpected pose at {stamp}')
        return None

    def waits(self) -> bool:
        """Return whether a certain promise is open."""
        return any(promise.certain for promise in self._open)

    def close(self) -> None:
        """Count what is still open as lost."""
        while self._open:
            self._miss(self._open.popleft())

    def _miss(self, promise: Promise) -> None:
        if promise.certain:
            self.lost += 1
            self._say(f'lost pose at {promise.stamp} during {promise.doing}')

    def _say(self, text: str) -> None:
        if len(self.examples) < 10:
            self.examples.append(f'{self._name}: {text}')
