"""What is read off processes, and how many readings become one figure with its spread."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import statistics
import time
from typing import NamedTuple


class Figure(NamedTuple):
    """Median, smallest and largest of some readings."""

    median: float
    low: float
    high: float
    readings: int


def figure(readings: Sequence[float]) -> Figure:
    """Return the figure of some readings."""
    return Figure(statistics.median(readings), min(readings), max(readings), len(readings))


def ratio(ours: Sequence[float], reference: Sequence[float]) -> Figure:
    """Return the figure of the ratios of readings taken side by side."""
    return figure([a / b for a, b in zip(ours, reference, strict=True)])


def difference(ours: Sequence[float], reference: Sequence[float]) -> Figure:
    """Return the figure of the differences of readings taken side by side."""
    return figure([a - b for a, b in zip(ours, reference, strict=True)])


def percentile(values: Sequence[float], percent: float) -> float:
    """Return the value below which `percent` of the values lie."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * percent / 100))]


def cpu_ns(pid: int) -> int:
    """Return the CPU time that all threads of a process have used [ns].

    Linux builds the clock's id from the process id as clock_getcpuclockid(3) does.
    """
    return time.clock_gettime_ns((~pid << 3) | 2)


def resident_bytes(pid: int) -> int:
    """Return the resident size of a process [bytes]; 0 if it has ended."""
    return _status_bytes(pid, 'VmRSS:')


def peak_resident_bytes(pid: int) -> int:
    """Return the largest resident size that a process has had [bytes]; 0 if it has ended."""
    return _status_bytes(pid, 'VmHWM:')


def _status_bytes(pid: int, key: str) -> int:
    _, found, value = Path(f'/proc/{pid}/status').read_text(encoding='ascii').partition(key)
    return int(value.split()[0]) * 1024 if found else 0
