"""Signals that ask a process to stop: as an exception that lets it clean up, or held back."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
import signal
import sys
import threading

_STOPPING = [signal.SIGTERM]
if hasattr(signal, 'SIGHUP'):  # Windows has none
    _STOPPING.append(signal.SIGHUP)


@contextmanager
def stop_on_signals() -> Iterator[None]:
    """Raise SystemExit on SIGTERM and SIGHUP, with the status that a shell reports for them.

    One that is ignored, as `nohup` wants it, stays so.
    """
    numbers = [
        number for number in _STOPPING if signal.getsignal(number) != signal.SIG_IGN
    ]
    with _handled(numbers, lambda number, frame: sys.exit(128 + number)):
        yield


@contextmanager
def held_signals() -> Iterator[None]:
    """While it lasts, the signals that end the process wait."""
    arrived: list[int] = []
    try:
        with _handled(
            [signal.SIGINT, *_STOPPING], lambda number, frame: arrived.append(number)
        ):
            yield
    finally:
        if arrived:
            signal.raise_signal(arrived[0])


@contextmanager
def _handled(numbers: Iterable[int], handler: Callable[..., None]) -> Iterator[None]:
    if (
        threading.current_thread() is not threading.main_thread()
    ):  # signals are that one's alone
        numbers = ()
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, previous in before.items():
            signal.signal(number, previous)
