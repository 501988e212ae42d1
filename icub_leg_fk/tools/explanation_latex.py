"""An explanation as a LaTeX document, which needs amsmath alone."""

from collections.abc import Sequence
import re

from icub_leg_fk.tools.explanation import Explanation
from icub_leg_fk.tools.explanation_steps import (
    Block,
    Entries,
    Equation,
    Heading,
    Remark,
    Sentence,
    steps,
    Table,
)
from icub_leg_fk.tools.explanation_symbols import Cell, latex, Matrix

_PREAMBLE = (
    r'\documentclass[10pt]{article}',
    r'\usepackage[a4paper,landscape,margin=15mm]{geometry}',
    r'\usepackage{amsmath}',
    r'\setlength{\parindent}{0pt}',
    r'\setlength{\parskip}{3pt}',
    r'\medmuskip=4mu',
    r'\begin{document}',
    r'\raggedright',
)
_ESCAPES = str.maketrans(
    {letter: f'\\{letter}' for letter in '_&%$#{}'}
    | {'\\': r'\textbackslash{}', '^': r'\^{}', '~': r'\~{}'}
)
_SYMBOLS = (
    (r'(?<=\d) {2,}(?=[-\d])', r',\\ '),  # between coordinates
    (r'\b([Rt])([xz])\(', r'\1_\2('),  # Rz(...)
    (r'_\(([^)]+)\)', r'_{\1}'),  # c_(3-4), z_(i+1)
    (r'_(\w*\(i\+1\)|[\w,]+)', r'_{\1}'),  # T_i(i+1), T_Ro0, T_0,10
    (r'(?<![a-z\\])(theta|alpha|pi|cos|sin)(?![a-z])', r'\\\1 '),
    (r' x ', r' \\times '),
    (r'->', r'\\to '),
    (r' deg', r'^\\circ'),
    (r'(?<=[\d})]) (?=[ARTqt])', r'\\,'),
)


def as_latex(e: Explanation) -> str:
    """Return the explanation as a document on landscape pages."""
    lines = list(_PREAMBLE)
    for block in steps(e):
        lines += _lines(block)
    return '\n'.join([*lines, r'\end{document}'])


def _lines(block: Block) -> list[str]:
    match block:
        case Heading():
            command = 'section' if block.is_title else 'subsection'
            return [rf'\{command}*{{{_words(block.words)}}}']
        case Sentence():
            return ['', _words(block.words)]
        case Remark():
            return [r'\par\nopagebreak', _words(block.words)]
        case Table():
            return _table(block)
        case Equation():
            matrices = ' '.join(map(_matrix, block.matrices))
            return [rf'\[ {_formula(block.name)} = {matrices} \]']
        case Entries():
            return _entries(block)


def _table(table: Table) -> list[str]:
    columns = 'l' * len(table.rows[0])
    lines = ['', rf'\begin{{tabular}}{{{columns}}}']
    if table.header:
        lines += [_table_row(table.header), r'\hline']
    lines += [_table_row(row) for row in table.rows]
    return [*lines, r'\end{tabular}']


def _table_row(cells: Sequence[str]) -> str:
    return ' & '.join(_words(cell) for cell in cells) + r' \\'


def _matrix(T: Matrix) -> str:
    rows = []
    for row in T.tolist():
        rows.append(' & '.join(_cell(cell) for cell in row))
    return r'\begin{bmatrix} ' + r' \\ '.join(rows) + r' \end{bmatrix}'


def _cell(cell: Cell) -> str:
    return _formula(cell) if isinstance(cell, str) else latex(cell)


def _entries(entries: Entries) -> list[str]:
    """Return a paragraph for each entry, in which LaTeX ends the lines after a sign."""
    lines = ['', f'${_formula(entries.name)}:$']
    for name, cell in entries.by_name():
        lines += ['', rf'\hangindent=4em ${_formula(name)} = {_cell(cell)}$']
    return lines


def _words(words: str) -> str:
    """Return words for LaTeX; what stands between backticks is a formula."""
    parts = words.split('`')
    for index, part in enumerate(parts):
        parts[index] = _escaped(part) if index % 2 == 0 else f'${_formula(part)}$'
    return ''.join(parts)


def _escaped(words: str) -> str:
    escaped = words.translate(_ESCAPES)
    escaped = escaped.replace('->', r'$\to$').replace('   ', r'\quad ')
    return re.sub(r'(?<!\w)-(?=\d)', '$-$', escaped)


def _formula(words: str) -> str:
    """Return `T_Ro0` or `cos(theta_3 - theta_4)` as LaTeX writes it."""
    for pattern, replacement in _SYMBOLS:
        words = re.sub(pattern, replacement, words)
    return words
