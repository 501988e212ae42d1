"""The table on the terminal and the JSON file behind it."""

from __future__ import annotations

from argparse import ArgumentParser
from datetime import datetime, timezone
import json
import os
from pathlib import Path
import platform
from typing import Any

from bench.measure import Figure
from icub_leg_fk.tools.output_file import write_text


class Report:
    """Collects rows and prints each as it comes.

    Attributes:
        rows: one dict per row: section, name, median, low, high, readings, unit, at_most,
            at_least, holds (None where nothing was promised).
        growth: series for the picture, by panel and curve: lists of (x, Figure).
    """

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self.notes: list[str] = []
        self.growth: dict[str, dict[str, list[tuple[float, Figure]]]] = {}
        self.machine = machine()
        self._section = ''
        print(f'{self.machine}\n\n{"":58}{"median":>10}{"lowest":>10}{"highest":>10}'
              f'      promised')

    def section(self, title: str) -> None:
        """Begin a part of the table."""
        self._section = title
        print(f'\n{title}')

    def row(self, name: str, value: Figure, unit: str, at_most: float | None = None,
            at_least: float | None = None) -> None:
        """Add a row; what is promised is promised of the median."""
        holds: bool | None = None
        promised = ''
        if at_most is not None:
            holds, promised = value.median <= at_most, f'<= {at_most:g}'
        elif at_least is not None:
            holds, promised = value.median >= at_least, f'>= {at_least:g}'
        self.rows.append({'section': self._section, 'name': name, **value._asdict(), 'unit': unit,
                          'at_most': at_most, 'at_least': at_least, 'holds': holds})
        verdict = {None: '', True: 'yes', False: 'NO'}[holds]
        figures = ''.join(f'{_shown(part):>10}' for part in value[:3])
        print(f'  {name:56}{figures} {unit:4} {promised:9} {verdict}'.rstrip(), flush=True)

    def note(self, text: str) -> None:
        """Add a line of text."""
        self.notes.append(text)
        print(f'  {text}', flush=True)

    def grow(self, panel: str, curve: str, x: float, value: Figure) -> None:
        """Add a point to a curve of the picture."""
        self.growth.setdefault(panel, {}).setdefault(curve, []).append((x, value))

    def write(self, path: Path) -> None:
        """Write everything as JSON."""
        growth = {panel: {curve: [{'x': x, **value._asdict()} for x, value in points]
                          for curve, points in curves.items()}
                  for panel, curves in self.growth.items()}
        write_text(path, json.dumps({
            'date': datetime.now(timezone.utc).isoformat(timespec='seconds'),
            'machine': self.machine, 'rows': self.rows, 'growth': growth,
            'notes': self.notes}, indent=1) + '\n', force=True)

    def broken_promises(self) -> list[str]:
        """Return the names of the rows whose promise does not hold."""
        return [row['name'] for row in self.rows if row['holds'] is False]


def make_room(parser: ArgumentParser, *files: Path) -> None:
    """Make the directories of what is to be written, before any time is spent on it."""
    try:
        for file in files:
            file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f'{error.filename}: {error.strerror}')


def machine() -> str:
    """Return a line on the machine: cores, processor class, Python, numpy."""
    import numpy as np
    date = datetime.now(timezone.utc).date().isoformat()
    cores = len(os.sched_getaffinity(0))
    return (f'{date}, {cores} cores {platform.machine()} ({_processor()}), Linux, '
            f'Python {platform.python_version()}, numpy {np.__version__}')


def _processor() -> str:
    for line in Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines():
        if line.startswith('model name'):
            return line.split(':', 1)[1].strip()
    return 'unknown processor'


def _shown(value: float) -> str:
    return f'{value:.0f}' if abs(value) >= 1000 else f'{value:.3g}'
