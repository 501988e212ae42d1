"""An explanation as text, as a teacher writes it on the board."""

import re
import textwrap

from icub_leg_fk.tools import text
from icub_leg_fk.tools.explanation import Explanation
from icub_leg_fk.tools.explanation_steps import (
    Block,
    Entries,
    Equation,
    Heading,
    Note,
    Sentence,
    steps,
    Table,
)
from icub_leg_fk.tools.explanation_symbols import Matrix, plain

_NO_BREAK = '\xa0'  # a space at which no line ends


def as_text(e: Explanation) -> str:
    """Return the explanation as text of at most `text.WIDTH` characters a line."""
    paragraphs: list[list[str]] = []
    before: Block | None = None
    for block in steps(e):
        lines = _lines(block)
        is_under_heading = isinstance(before, Heading) and isinstance(block, Table)
        if isinstance(block, Note) or is_under_heading:
            paragraphs[-1] += lines
        else:
            paragraphs.append(lines)
        before = block
    return '\n\n'.join('\n'.join(lines) for lines in paragraphs)


def _lines(block: Block) -> list[str]:
    match block:
        case Heading() | Sentence():
            return text.wrapped(_without_marks(block.words))
        case Note():
            return text.indented(text.wrapped(_without_marks(block.words)))
        case Table():
            return _table(block)
        case Equation():
            return _equation(block)
        case Entries():
            return _entries(block)


def _without_marks(words: str) -> str:
    return words.replace('`', '')


def _table(table: Table) -> list[str]:
    rows = []
    for row in table.rows:
        rows.append([_without_marks(cell) for cell in row])
    header = [_without_marks(cell) for cell in table.header]
    return text.indented(text.columns(rows, '   ' if header else '  ', header))


def _equation(equation: Equation) -> list[str]:
    gap = '  ' if len(equation.matrices) == 1 else ' '
    matrices = [_matrix(T, gap) for T in equation.matrices]
    left = f'  {equation.name} =' if equation.name else '  ='
    margin = ' ' * len(left)
    return [' '.join(parts) for parts in zip((margin, left, margin, margin), *matrices)]


def _matrix(T: Matrix, gap: str) -> list[str]:
    rows = []
    for row in T.tolist():
        rows.append([plain(cell) for cell in row])
    return text.matrix(rows, gap)


def _entries(entries: Entries) -> list[str]:
    """Return the entries of a transform; a line that is full ends with a whole term."""
    lines = [f'  {entries.name} =']
    for name, cell in entries.by_name():
        left = f'    {name:4} = '
        words = re.sub(r' (?![+-] )', _NO_BREAK, plain(cell))
        lines += textwrap.wrap(
            words,
            text.WIDTH,
            initial_indent=left,
            subsequent_indent=' ' * len(left),
            break_long_words=False,
            break_on_hyphens=False,
        )
    return [line.replace(_NO_BREAK, ' ') for line in lines]
