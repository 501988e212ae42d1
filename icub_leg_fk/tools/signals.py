"""Signals that ask a process to stop: as an exception that lets it clean up, or held back."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import signal
import threading
from types import FrameType

_STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def stop_on_signals() -> Iterator[None]:
    """Raise SystemExit on SIGTERM and SIGHUP, with the status that a shell reports for them.

    One that is ignored, as `nohup` wants it, stays so.
    """
    before = {number: signal.signal(number, _stop) for number in (signal.SIGTERM, signal.SIGHUP)
              if signal.getsignal(number) != signal.SIG_IGN}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def held_signals() -> Iterator[None]:
    """While it lasts, the signals that end the process wait; they are the main thread's alone."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    arrived: list[int] = []
    before = {number: signal.signal(number, lambda number, frame: arrived.append(number))
              for number in _STOPS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if arrived:
            signal.raise_signal(arrived[0])


def _stop(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)
