"""Columns, matrices, notes and JSON: text that can be checked by eye."""

from collections.abc import Iterable, Sequence
import json
import re
import textwrap
from typing import Any

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.chain_text import joint_range, position, printable
from icub_leg_fk.kinematics.rotation import Array

WIDTH = 98
DECIMALS = 7  # of a pose
_UNLIKELY = 10.0  # m; of a joint's position, which may have been meant in mm
_INNERMOST_LIST = re.compile(r'\[\n\s*([^][{}]*?)\n\s*\]')


def fixed(value: float, decimals: int) -> str:
    """Return a number with a fixed number of decimals, without a negative zero."""
    return f'{round(value, decimals) + 0.0:.{decimals}f}'


def numbers(values: Iterable[float], decimals: int = DECIMALS) -> list[str]:
    """Return numbers as poses are shown."""
    return [fixed(value, decimals) for value in values]


def transform(T: Array) -> list[str]:
    """Return the lines of a (4, 4) transform."""
    return matrix([*map(numbers, T[:3]), ['0', '0', '0', '1']], '  ')


def range_notes(chain: Chain, q: Sequence[float]) -> list[str]:
    """Return a note for each joint that is outside its range, or hardly in metres.

    Args:
        chain: the chain.
        q: (n,) joint positions [rad or m].
    """
    outside = chain.out_of_range(q)
    notes = []
    for name, link, value in zip(chain.joint_names, chain.joints, q, strict=True):
        found = f'note: {name} = {position(link, value)}'
        if link.is_prismatic and abs(value) >= _UNLIKELY:
            notes.append(
                f'{found}: positions of prismatic joints are in metres, not in mm'
            )
        if name in outside:
            erratum = ''
            if (
                link.erratum and link.robot_range is None
            ):  # the printed range is what counts
                erratum = f' (known erratum of the table: {link.erratum})'
            notes.append(
                f'{found} is outside its range {joint_range(link)}{erratum}; computed as '
                'given, never clamped'
            )
    return notes


def columns(
    rows: Sequence[Sequence[str]], gap: str = '  ', header: Sequence[str] = ()
) -> list[str]:
    """Return the rows as lines; numbers stand with their points under each other."""
    aligned = [_aligned(column) for column in zip(*rows, strict=True)]
    if header:
        aligned = [_padded([title, *column]) for title, column in zip(header, aligned)]
    lines = [gap.join(cells).rstrip() for cells in zip(*aligned, strict=True)]
    return [printable(line) for line in lines]


def matrix(rows: Sequence[Sequence[str]], gap: str = ' ') -> list[str]:
    """Return the lines of a matrix in brackets."""
    centred = [_centred(column) for column in zip(*rows, strict=True)]
    return [f'[{gap.join(cells)}]' for cells in zip(*centred, strict=True)]


def indented(lines: Iterable[str]) -> list[str]:
    """Return the lines moved to the right."""
    return [f'  {line}' for line in lines]


def wrapped(text: str) -> list[str]:
    """Return the lines of a sentence, all but the first moved to the right."""
    return textwrap.wrap(
        text,
        WIDTH,
        subsequent_indent='  ',
        break_long_words=False,
        break_on_hyphens=False,
    )


def as_json(value: Any) -> str:
    """Return JSON with its innermost lists of numbers or words on one line each."""
    try:
        text = json.dumps(value, indent=2, allow_nan=False)
    except ValueError as error:
        raise LegFKError('found lengths too large to compute with') from error
    return _INNERMOST_LIST.sub(_on_one_line, text)


def _on_one_line(found: re.Match[str]) -> str:
    return re.sub(r'\n\s*', ' ', f'[{found[1]}]')


def _aligned(column: Sequence[str]) -> list[str]:
    """Return the cells of a column in one width: numbers by their points, words to the left."""
    if not _are_numbers(column):
        return _padded(column)
    decimals = [
        len(cell) - len(cell.partition('.')[0]) for cell in column
    ]  # and the point
    most = max(decimals)
    filled = [
        cell + ' ' * (most - own) for cell, own in zip(column, decimals, strict=True)
    ]
    width = max(map(len, filled))
    return [cell.rjust(width) for cell in filled]


def _centred(column: Sequence[str]) -> list[str]:
    """Return the cells of a column in one width: numbers by their points, words in the middle."""
    if _are_numbers(column):
        return _aligned(column)
    width = max(map(len, column))
    cells = []
    for cell in column:
        # A minus sign hangs out to the left, so that s_0 and -s_0 stand under each other.
        before = (width - len(cell.lstrip('-'))) // 2 - cell.startswith('-')
        cells.append((' ' * before + cell).ljust(width))
    return cells


def _padded(column: Sequence[str]) -> list[str]:
    width = max(map(len, column))
    return [cell.ljust(width) for cell in column]


def _are_numbers(column: Sequence[str]) -> bool:
    return all(cell.strip('-').replace('.', '', 1).isdigit() for cell in column if cell)
