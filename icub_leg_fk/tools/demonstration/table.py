"""The demonstration's live table: redrawn in place on a terminal, plain lines elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
import os
import shutil
import sys
from typing import TextIO

from icub_leg_fk.tools.demonstration.replay import Answers
import numpy as np

_HEADER = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
_COLORS = {'left': '\x1b[38;5;97m', 'right': '\x1b[38;5;172m', 'faint': '\x1b[2m'}
_END, _BOLD = '\x1b[0m', '\x1b[1m'
_SPARKS = '▁▂▃▄▅▆▇█'
_SPARK_WIDTH = 40
_LIFT = 0.05  # m; of a full spark


class LiveTable:
    """Shows the newest poses; use as a context manager.

    Args:
        answers: the poses, filled in by somebody else.
        times: (N,) times of the messages [s].
        out: where to write; standard output if None.

    Attributes:
        period: how often `show` should be called [s].
    """

    def __init__(self, answers: Sequence[Answers], times: Sequence[float],
                 out: TextIO | None = None) -> None:
        self._answers = answers
        self._times = np.asarray(times) - times[0]
        self._out = out or sys.stdout
        self._live = self._out.isatty() and os.environ.get('TERM', 'dumb') != 'dumb'
        self._colored = self._live and not os.environ.get('NO_COLOR')
        self._sparks = (self._out.encoding or '').lower().replace('-', '') == 'utf8'
        self._lines = 0
        self.period = 0.1 if self._live else 1.0

    def __enter__(self) -> LiveTable:
        if self._live:
            self._write('\x1b[?25l')  # no cursor
        return self

    def __exit__(self, *_: object) -> None:
        if self._live:
            self._write('\x1b[?25h')

    def show(self, elapsed: float) -> None:
        """Show the state at a time since the start [s]."""
        if not self._live:
            self._write(self._plain(elapsed) + '\n')
            return
        width = shutil.get_terminal_size().columns - 1
        lines = [self._painted(line[:width], style) for line, style in self._table(elapsed)]
        up = f'\x1b[{self._lines}A' if self._lines else ''
        self._write(up + ''.join(f'\x1b[2K{line}\n' for line in lines))
        self._lines = len(lines)

    def _plain(self, elapsed: float) -> str:
        feet = []
        for answers in self._answers:
            name = answers.tip.replace('_', ' ')
            if answers.newest < 0:
                feet.append(f'{name}: no pose yet')
                continue
            x, y, z = answers.poses[answers.newest, :3]
            feet.append(f'{name}: x {x:+.4f}  y {y:+.4f}  z {z:+.4f} m')
        return f'{elapsed:7.2f} s   ' + '   '.join(feet)

    def _table(self, elapsed: float) -> list[tuple[str, str]]:
        total = float(self._times[-1])
        done = 1.0 if total <= 0 else min(1.0, elapsed / total)
        arrived = sum(answers.arrived for answers in self._answers)
        lines = [(f'{"m":<12}' + ''.join(f'{name:>9}' for name in _HEADER), 'faint')]
        for answers in self._answers:
            name = answers.tip.replace('_', ' ')
            newest = answers.poses[answers.newest].round(4) + 0.0  # no negative zeros
            numbers = ''.join(f'{value:9.4f}' for value in newest.tolist()) \
                if answers.newest >= 0 else '  no pose yet'
            lines.append((f'{name:<12}{numbers}', name.split()[0]))
        lines.append(('', ''))
        if self._sparks:
            for answers in self._answers:
                name = answers.tip.replace('_', ' ')
                lines.append((f'{name:<12}  {self._heights(answers)}  height, last 4 s',
                              name.split()[0]))
            lines.append(('', ''))
        bar = int(done * 40)
        full, rest = ('━', '─') if self._sparks else ('#', '.')
        lines.append((f'{elapsed:6.2f} s      {full * bar}{rest * (40 - bar)}  {arrived} poses',
                      'faint'))
        return lines

    def _heights(self, answers: Answers) -> str:
        """Return the foot's height over the last four seconds as a row of blocks."""
        if answers.newest < 0:
            return ' ' * _SPARK_WIDTH
        instants = self._times[answers.newest] + np.linspace(-3.9, 0, _SPARK_WIDTH)
        rows = np.searchsorted(self._times, instants).clip(0, answers.newest)
        low = min(np.nanmin(other.poses[:answers.newest + 1, 2]) for other in self._answers
                  if other.newest >= 0)
        levels = (answers.poses[rows, 2] - low) / _LIFT * (len(_SPARKS) - 1)
        return ''.join(_SPARKS[round(min(max(level, 0), len(_SPARKS) - 1))]
                       if instant >= 0 and level == level else ' '
                       for instant, level in zip(instants, levels.tolist(), strict=True))

    def _painted(self, line: str, style: str) -> str:
        color = _COLORS.get(style, '')
        return f'{color}{line}{_END}' if self._colored and color else line

    def _write(self, text: str) -> None:
        self._out.write(text)
        self._out.flush()
