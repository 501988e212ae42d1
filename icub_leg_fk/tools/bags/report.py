"""What `leg_fk bag` tells: a progress bar on a terminal, and a closing summary."""

from __future__ import annotations

from pathlib import Path
import sys
import time

from icub_leg_fk.tools.bags.conversion import Summary
from icub_leg_fk.tools.text import columns, indented

_REFRESH_PERIOD = 0.1  # s
_WIDTH = 40
_MOST_DAMAGE = 20  # lines


class ProgressBar:
    """A bar on stderr, if that is a terminal.

    Attributes:
        span: the part of the bar that `show` is about, as shares of the whole.
    """

    def __init__(self) -> None:
        self.span = (0.0, 1.0)
        self._terminal = sys.stderr is not None and sys.stderr.isatty()
        self._began = self._shown = time.monotonic()
        self._visible = False

    def show(self, share: float) -> None:
        """Show the share that is done, 0 to 1."""
        share = self.span[0] + share * (self.span[1] - self.span[0])
        now = time.monotonic()
        if not self._terminal or now - self._shown < _REFRESH_PERIOD:
            return
        self._shown = now
        self._visible = True
        done = round(share * _WIDTH)
        left = (now - self._began) * (1 - share) / share if share else 0.0
        bar = '#' * done + '.' * (_WIDTH - done)
        print(f'\r[{bar}] {100 * share:3.0f} %, {left:.0f} s left \033[K', end='',
              file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Take the bar away."""
        if self._visible:
            print('\r\033[K', end='', file=sys.stderr, flush=True)
            self._visible = False


def summary_lines(source: Path, summary: Summary) -> list[str]:
    """Return the closing summary, line by line."""
    rows = [(str(summary.copied), 'messages copied')]
    rows += [(str(count), f'added on {topic}') for topic, count in summary.added.items()]
    rows += [(str(count), 'time steps back: held joints forgotten' if reason == 'time_jump'
              else f'joint states rejected: {reason}')
             for reason, count in summary.rejected.items()]
    rows += [(str(count), f'joint states gave no {_what(reason)} of {chain}: {reason} ({joints})')
             for chain, reasons in summary.held_back.items()
             for reason, (count, joints) in reasons.items()]
    lines = [f'{source} -> {summary.target}', *indented(columns(rows))]
    lines += indented([f'note: {note}' for note in summary.notes])
    speed = summary.recorded / max(summary.took, 1e-9)
    lines += [f'  {summary.recorded:.3f} s of recording in {summary.took:.3f} s, '
              f'{speed:.1f} seconds of recording per second']
    if summary.damage:
        lines += ['  complete but for what could not be read:']
        lines += indented(summary.damage[:_MOST_DAMAGE], 4)
        if (more := len(summary.damage) - _MOST_DAMAGE) > 0:
            lines += [f'    and {more} more']
    return lines


def _what(reason: str) -> str:
    return 'twist' if reason == 'no_velocity' else 'pose'
