"""Numbers, tables and matrices as text that can be checked by eye."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import math
import re
import textwrap
from typing import Any, TYPE_CHECKING

from icub_leg_fk.errors import LegFKError

if TYPE_CHECKING:
    from icub_leg_fk.kinematics import Chain, DHLink

WIDTH = 98
_UNLIKELY = 10.0  # m; of a joint's position, which may have been meant in mm


def fixed(value: float, decimals: int) -> str:
    """Return a number with exactly so many decimals, and without a negative zero."""
    return f'{round(value, decimals) + 0.0:.{decimals}f}'


def short(value: float, decimals: int = 4) -> str:
    """Return a number with at most so many decimals: 0.5, -1, 17.3205."""
    text = fixed(value, decimals)
    return text.rstrip('0').rstrip('.') if '.' in text else text


def position(link: DHLink, value: float) -> str:
    """Return a joint position [rad or m] as `12.5 deg` or, if prismatic, `0.2 m`."""
    return (f'{short(value, 6)} m' if link.is_prismatic
            else f'{short(math.degrees(value))} deg')


def joint_range(link: DHLink) -> str:
    """Return the range that counts as `-44 .. 132 deg`; nothing if there is none."""
    lower, upper = (position(link, limit) for limit in link.limits)
    return f'{lower.split()[0]} .. {upper}' if math.isfinite(link.limits[0]) else ''


def range_notes(chain: Chain, q: Sequence[float]) -> list[str]:
    """Return a note for each joint that is outside its range, or hardly in metres."""
    outside = chain.out_of_range(q)
    notes = []
    for name, link, value in zip(chain.joint_names, chain.joints, q, strict=True):
        found = f'note: {name} = {position(link, value)}'
        if link.is_prismatic and abs(value) >= _UNLIKELY:
            notes.append(f'{found}: positions of prismatic joints are in metres; is it meant?')
        if name in outside:
            erratum = f' (known erratum of the table: {link.erratum})' if link.erratum else ''
            notes.append(f'{found} is outside its range {joint_range(link)}{erratum}; computed as '
                         'given, never clamped')
    return notes


def columns(rows: Sequence[Sequence[str]], gap: str = '  ', header: Sequence[str] = ()
            ) -> list[str]:
    """Return the rows as lines; numbers stand with their points under each other."""
    aligned = [_aligned(column) for column in zip(*rows, strict=True)]
    if header:
        aligned = [_aligned((title, *column)) for title, column in zip(header, aligned)]
    return [gap.join(cells).rstrip() for cells in zip(*aligned, strict=True)]


def matrix(rows: Sequence[Sequence[str]], gap: str = ' ') -> list[str]:
    """Return the lines of a matrix in brackets."""
    aligned = [_aligned(column, centred=True) for column in zip(*rows, strict=True)]
    return [f'[{gap.join(cells)}]' for cells in zip(*aligned, strict=True)]


def indented(lines: Iterable[str]) -> list[str]:
    """Return the lines moved to the right."""
    return [f'  {line}' for line in lines]


def wrapped(text: str) -> list[str]:
    """Return the lines of a sentence, all but the first moved to the right."""
    return textwrap.wrap(text, WIDTH, subsequent_indent='  ', break_long_words=False,
                         break_on_hyphens=False)


def as_json(value: Any) -> str:
    """Return JSON with its innermost lists of numbers or words on one line each."""
    import json
    try:
        text = json.dumps(value, indent=2, allow_nan=False)
    except ValueError as error:
        raise LegFKError('found lengths too large to compute with') from error
    return re.sub(r'\[\n\s*([^][{}]*?)\n\s*\]',
                  lambda found: re.sub(r'\n\s*', ' ', f'[{found[1]}]'), text)


def _aligned(column: Sequence[str], centred: bool = False) -> list[str]:
    """Pad the cells of a column to one width."""
    if all(cell.strip('-').replace('.', '', 1).isdigit() for cell in column if cell):
        decimals = [len(cell) - len(cell.partition('.')[0]) for cell in column]
        column = [cell + ' ' * (max(decimals) - own)
                  for cell, own in zip(column, decimals, strict=True)]
        return [cell.rjust(max(map(len, column))) for cell in column]
    width = max(map(len, column))
    if not centred:
        return [cell.ljust(width) for cell in column]
    # A minus sign hangs out to the left, so that s_0 and -s_0 stand under each other.
    return [(' ' * ((width - len(cell.lstrip('-'))) // 2 - cell.startswith('-')) + cell)
            .ljust(width) for cell in column]
