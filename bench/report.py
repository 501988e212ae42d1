"""Figures with their spread, printed as they come; promises kept and missed."""

from collections.abc import Sequence
import os
from pathlib import Path
import platform
import re
import statistics
import time


class Report:
    """Prints rows of median, lowest and highest reading, and remembers the promises among them."""

    def __init__(self) -> None:
        self.kept: list[str] = []
        self.missed: list[str] = []
        print(
            f'{machine()}\n\n{"":52}{"median":>10}{"lowest":>10}{"highest":>10}'
            f'      promised'
        )

    def row(
        self,
        name: str,
        readings: Sequence[float],
        unit: str,
        at_most: float | None = None,
        at_least: float | None = None,
    ) -> None:
        """Add a row; what is promised is promised of the median."""
        median = statistics.median(readings)
        promise = ''
        if at_most is not None:
            promise = self._judge(name, median, '≤', at_most, median <= at_most)
        if at_least is not None:
            promise = self._judge(name, median, '≥', at_least, median >= at_least)
        figures = ''.join(map(_figure, (median, min(readings), max(readings))))
        print(f'  {name:50}{figures} {unit:4} {promise}'.rstrip(), flush=True)

    def _judge(
        self, name: str, median: float, sign: str, limit: float, is_kept: bool
    ) -> str:
        """Remember a promise, and return what its row says of it."""
        promises = self.kept if is_kept else self.missed
        promises.append(f'{name} {median:.3g} ({sign} {limit:g})')
        return (
            f'{sign} {limit:g}' if is_kept else f'{sign} {limit:g}'.ljust(9) + 'missed'
        )

    def note(self, text: str) -> None:
        """Add a line of text, such as the title of a part."""
        print(text, flush=True)

    def verdict(self) -> str:
        """Return a line on the promises kept and missed."""
        return (
            f'{len(self.kept)} promises kept: {"; ".join(self.kept) or "none"}. '
            f'{len(self.missed)} missed{": " * bool(self.missed)}{"; ".join(self.missed)}.'
        )


def _figure(value: float) -> str:
    return f'{value:>10.0f}' if abs(value) >= 1000 else f'{value:>10.3g}'


def ratio(ours: Sequence[float], reference: Sequence[float]) -> list[float]:
    """Return the ratios of readings taken side by side."""
    return [a / b for a, b in zip(ours, reference, strict=True)]


def cpu_ns(pid: int) -> int:
    """Return the CPU time that all threads of a process have used [ns]."""
    return time.clock_gettime_ns(
        (~pid << 3) | 2
    )  # as clock_getcpuclockid(3) builds the id


def resident_bytes(pid: int, key: str = 'VmRSS:') -> int:
    """Return the resident size of a process, or with VmHWM: its peak [bytes]; 0 if it ended."""
    _, found, value = (
        Path(f'/proc/{pid}/status').read_text(encoding='ascii').partition(key)
    )
    return int(value.split()[0]) * 1024 if found else 0


def machine() -> str:
    """Return a line on the machine: cores, processor, Python, numpy."""
    import numpy as np

    found = re.search(
        'model name.*: (.*)', Path('/proc/cpuinfo').read_text(encoding='utf-8')
    )
    return (
        f'{time.strftime("%Y-%m-%d")}, {len(os.sched_getaffinity(0))} cores '
        f'{platform.machine()} ({found[1] if found else "unknown processor"}), Linux, '
        f'Python {platform.python_version()}, numpy {np.__version__}'
    )
