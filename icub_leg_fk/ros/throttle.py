"""Warnings that are heard and do not flood the log."""

from __future__ import annotations

from collections.abc import Callable
import time

_PERIOD = 5.0  # s


class ThrottledWarnings:
    """Passes on at most one warning per reason and period, and says how many it held back.

    Args:
        warn: called with the text of a warning.
    """

    def __init__(self, warn: Callable[[str], object]) -> None:
        self._warn = warn
        self._last: dict[str, float] = {}
        self._held_back: dict[str, int] = {}

    def __call__(self, reason: str, text: str) -> None:
        """Warn, unless this reason has been warned about a moment ago."""
        now = time.monotonic()
        if now - self._last.get(reason, -_PERIOD) < _PERIOD:
            self._held_back[reason] = self._held_back.get(reason, 0) + 1
            return
        self._last[reason] = now
        more = self._held_back.pop(reason, 0)
        self._warn(f'{reason}: {text}' + (f' (and {more} more)' if more else ''))
