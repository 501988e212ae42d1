"""A chain as people read it: its Denavit-Hartenberg table as text and as HTML, and its numbers."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
import math
from typing import TYPE_CHECKING

from icub_leg_fk.kinematics.link import DHLink

if TYPE_CHECKING:
    from icub_leg_fk.kinematics.chain import Chain

HEADER = ('i', 'joint', 'a', 'd', 'alpha', 'theta', 'range')


def short(value: float, decimals: int = 4) -> str:
    """Return a rounded number without zeros at its end: 0.5, -1, 17.3205; never -0."""
    text = f'{round(value, decimals) + 0.0:.{decimals}f}'
    return text.rstrip('0').rstrip('.') if '.' in text else text


def printable(text: str) -> str:
    """Return text with what cannot be printed, such as a tab in a name, as its escape."""
    return ''.join(char if char.isprintable() else repr(char)[1:-1] for char in text)


def position(link: DHLink, value: float) -> str:
    """Return a joint position [rad or m] as `12.5 deg` or, if prismatic, `0.2 m`."""
    if link.is_prismatic:
        return f'{short(value, 6)} m'
    return f'{short(math.degrees(value))} deg'


def joint_range(link: DHLink) -> str:
    """Return the range that counts as `-44 .. 132 deg`; nothing if there is none."""
    if link.is_fixed or not link.has_limits:
        return ''
    lower, upper = (position(link, limit) for limit in link.limits)
    return f'{lower.split()[0]} .. {upper}'


def table_rows(chain: Chain) -> list[tuple[str, ...]]:
    """Return the rows of a chain's table in its own convention; lengths in mm, angles in deg."""
    rows: list[tuple[str, ...]] = []
    for index, row in enumerate(chain.rows()):
        link = row.link
        d = short(1000 * link.d, 6)
        theta = short(math.degrees(link.offset), 6)
        if link.is_prismatic:
            d = f'{d} {_motion(link)}'
        elif not link.is_fixed:
            theta = f'{theta} {_motion(link)}'
        bounds = joint_range(link) if row.is_first else ''
        rows.append(
            (
                str(index),
                printable(row.joint) or '(fixed)',
                short(1000 * link.a, 6),
                d,
                short(math.degrees(link.alpha), 6),
                theta,
                bounds,
            )
        )
    return rows


def as_text(chain: Chain) -> str:
    """Return a heading and the table, its columns under each other."""
    table = [HEADER, *table_rows(chain)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = [_title(chain)]
    for cells in table:
        padded = [cell.ljust(width) for cell, width in zip(cells, widths, strict=True)]
        lines.append('  '.join(padded).rstrip())
    return '\n'.join(lines)


def as_html(chain: Chain) -> str:
    """Return the table as a notebook shows it."""
    lines = [
        '<table>',
        f'<caption>{escape(_title(chain))}</caption>',
        _html_row('th', HEADER),
    ]
    lines += [_html_row('td', cells) for cells in table_rows(chain)]
    return '\n'.join([*lines, '</table>'])


def _title(chain: Chain) -> str:
    return printable(
        f'{chain.name} {chain.version}: {chain.root_frame} to {chain.frame_id}, '
        f'{chain.convention} Denavit-Hartenberg table in mm, deg'
    )


def _motion(link: DHLink) -> str:
    """Return how a row moves with its joint: `+ q`, `- q`, `+ 0.5 q`."""
    sign = '-' if link.gain < 0 else '+'
    factor = '' if abs(link.gain) == 1.0 else f'{abs(link.gain):.10g} '
    return f'{sign} {factor}q'


def _html_row(tag: str, cells: Sequence[str]) -> str:
    return (
        '<tr>' + ''.join(f'<{tag}>{escape(cell)}</{tag}>' for cell in cells) + '</tr>'
    )
