"""Figures with their spread, printed as they come; promises kept and missed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timezone
import os
from pathlib import Path
import platform
import statistics
import time
from typing import NamedTuple


class Promise(NamedTuple):
    """A ratio that was promised, and what was found of it."""

    name: str
    found: float
    limit: float
    at_least: bool

    @property
    def is_kept(self) -> bool:
        """Whether the figure is on the right side of its limit."""
        return self.found >= self.limit if self.at_least else self.found <= self.limit

    def __str__(self) -> str:
        return f'{self.name} {self.found:.3g} ({"≥" if self.at_least else "≤"} {self.limit:g})'


class Report:
    """Prints rows of median, lowest and highest reading, and remembers the promises among them."""

    def __init__(self) -> None:
        self.promises: list[Promise] = []
        print(f'{machine()}\n\n{"":52}{"median":>10}{"lowest":>10}{"highest":>10}'
              f'      promised')

    def section(self, title: str) -> None:
        """Begin a part of the table."""
        print(f'\n{title}')

    def row(self, name: str, readings: Sequence[float], unit: str, at_most: float | None = None,
            at_least: float | None = None) -> None:
        """Add a row; what is promised is promised of the median."""
        median, promised = statistics.median(readings), ''
        limit = at_least if at_most is None else at_most
        if limit is not None:
            promise = Promise(name, median, limit, at_most is None)
            self.promises.append(promise)
            promised = (f'{"≤" if at_least is None else "≥"} {limit:g}'.ljust(9)
                        + ('' if promise.is_kept else 'missed'))
        figures = ''.join(f'{_shown(value):>10}'
                          for value in (median, min(readings), max(readings)))
        print(f'  {name:50}{figures} {unit:4} {promised}'.rstrip(), flush=True)

    def note(self, text: str) -> None:
        """Add a line of text."""
        print(f'  {text}', flush=True)

    def verdict(self) -> str:
        """Return a line on the promises kept and missed."""
        kept = [str(promise) for promise in self.promises if promise.is_kept]
        missed = [str(promise) for promise in self.promises if not promise.is_kept]
        return (f'{len(kept)} promises kept: {"; ".join(kept) or "none"}. '
                f'{len(missed)} missed{": " * bool(missed)}{"; ".join(missed)}.')


def ratio(ours: Sequence[float], reference: Sequence[float]) -> list[float]:
    """Return the ratios of readings taken side by side."""
    return [a / b for a, b in zip(ours, reference, strict=True)]


def cpu_ns(pid: int) -> int:
    """Return the CPU time that all threads of a process have used [ns]."""
    return time.clock_gettime_ns((~pid << 3) | 2)  # as clock_getcpuclockid(3) builds the id


def resident_bytes(pid: int, key: str = 'VmRSS:') -> int:
    """Return the resident size of a process, or with VmHWM: its peak [bytes]; 0 if it ended."""
    _, found, value = Path(f'/proc/{pid}/status').read_text(encoding='ascii').partition(key)
    return int(value.split()[0]) * 1024 if found else 0


def machine() -> str:
    """Return a line on the machine: cores, processor, Python, numpy."""
    import numpy as np

    processor = next((line.split(':', 1)[1].strip() for line in
                      Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
                      if line.startswith('model name')), 'unknown processor')
    return (f'{datetime.now(timezone.utc).date()}, {len(os.sched_getaffinity(0))} cores '
            f'{platform.machine()} ({processor}), Linux, Python {platform.python_version()}, '
            f'numpy {np.__version__}')


def _shown(value: float) -> str:
    return f'{value:.0f}' if abs(value) >= 1000 else f'{value:.3g}'
