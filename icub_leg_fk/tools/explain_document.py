r"""`leg_fk explain` as a document: the six steps of the method, in text or in LaTeX.

What is said stands here once; a writer says how. Formulas within sentences and tables stand
between backticks. Entries of matrices are written by sympy's own printers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
import math
import re
from typing import Any

from icub_leg_fk.tools.explain_steps import Cell, Explanation, Matrix, Step
from icub_leg_fk.tools.text import (
    beside,
    columns,
    indented,
    matrix,
    position_text,
    range_notes,
    short,
    WIDTH,
    wrapped,
)

_STANDARD = [
    ['cos theta_i', '-sin theta_i cos alpha_i', 'sin theta_i sin alpha_i', 'a_i cos theta_i'],
    ['sin theta_i', 'cos theta_i cos alpha_i', '-cos theta_i sin alpha_i', 'a_i sin theta_i'],
    ['0', 'sin alpha_i', 'cos alpha_i', 'd_i'],
    ['0', '0', '0', '1'],
]
_CRAIGS = [
    ['cos theta_i', '-sin theta_i', '0', 'a_i'],
    ['sin theta_i cos alpha_i', 'cos theta_i cos alpha_i', '-sin alpha_i', '-d_i sin alpha_i'],
    ['sin theta_i sin alpha_i', 'cos theta_i sin alpha_i', 'cos alpha_i', 'd_i cos alpha_i'],
    ['0', '0', '0', '1'],
]
_ENTRIES = [[f'r_{i}{j}' for j in '123'] + [f'p_{axis}'] for i, axis in zip('123', 'xyz')]
_WIDE = 330  # characters of a matrix in LaTeX that still fit on a line
_LINE = 260  # characters of a sum
_ESCAPES = {letter: f'\\{letter}' for letter in '_&%$#{}'} | {
    '\\': r'\textbackslash{}', '^': r'\^{}', '~': r'\~{}'}


def document(e: Explanation, write: Text | Latex) -> str:
    """Return the whole explanation."""
    chain, last = e.chain, len(e.steps)
    write.start(f'{chain.name} {chain.version}: the transform `T_Ro{e.tip}`   '
                f'(Ro = {chain.root_frame}, {e.tip} = {chain.tip_frame})')
    if e.source:
        write.words(f'Table from: {e.source}')
    values = 'symbols `q_i`' if e.q is None else ', '.join(
        f'{name} {position_text(link, value)}' for name, link, value
        in zip(chain.joint_names, chain.joints, e.q, strict=True))
    write.words(f'Joint positions: {values}. Lengths in mm.')
    _frames(e, write)
    write.heading('Step 5. The Denavit-Hartenberg table, and each link as four basic transforms')
    _table(e, write)
    for step in e.steps:
        i = step.index
        write.words(f'`A_{i} = T_{i}{i + 1} = {_factor_names(e, i)}`   {step.joint or "fixed"}')
        write.words('   '.join(f'`{value}`' for value in _values(e, step)))
        write.equation('', *step.factors)
        write.equation('', step.A)
    write.heading('Step 6. Multiply')
    write.equation('T_01 = A_0', e.steps[0].T_0)
    for i, step in enumerate(e.steps[1:], start=1):
        write.equation(f'T_0{i + 1} = T_0{i} A_{i}', step.T_0)
    write.equation('T_Ro0', e.T_root_0)
    for name, T in e.tips:
        write.equation(name, T)
    factors = ' '.join(['T_Ro0', f'T_0{last}', *(name for name, _ in e.tips)])
    write.equation(f'T_Ro{e.tip} = {factors}', e.T_root_tip)
    if e.q is not None:
        x, y, z = (short(e.value(row[3]) or 0.0) for row in e.T_root_tip[:3])
        write.words(f'{chain.tip_frame} is at x = {x}, y = {y}, z = {z} mm in {chain.root_frame}.')
        for note in range_notes(chain, e.q):
            write.words(' '.join(note.split()))
    return write.end()


def _frames(e: Explanation, write: Text | Latex) -> None:
    """Write steps 1 to 4: the axes and origins of all frames."""
    n, modified = len(e.steps), e.is_modified
    at = f'coordinates in {e.chain.root_frame}, at {"q = 0" if e.q is None else "this q"}'
    other = '`z_(i+1)`' if modified else '`z_(i-1)`'
    axes = []
    for step in e.steps:
        verb = 'slides along' if step.link.is_prismatic else 'turns about'
        axes.append(f'{step.joint} {verb} it' if step.joint else 'a fixed row')
    axes.insert(0 if modified else n,
                f'no joint: {"frame 0" if modified else "the last frame"}')
    orthogonal = [f'orthogonal to `z_{i}` and `z_{i + 1}`' for i in range(n)]
    for title, letter, column, remarks in (
            (f'Step 1. The z axis of each joint   ({at})', 'z', 2, axes),
            (f'Step 2. The origin of each frame, on `z_i` where it meets {other}   (mm)', 'o', 3,
             [_origin(e, i) for i in range(n + 1)]),
            (f'Step 3. The x axis of each frame, orthogonal to {other} and `z_i`', 'x', 0,
             [*orthogonal, 'free'] if modified else ['as `T_Ro0` has it', *orthogonal]),
            ('Step 4. The y axis of each frame, by the right-hand rule: `y_i = z_i x x_i`', 'y', 1,
             [''] * (n + 1))):
        write.heading(title)
        vectors = matrix([[short(value) for value in T[:3, column]] for T in e.frames.values()],
                         gap='  ')
        remarks = [*remarks, *(f'as `{name}` has it' for name, _ in e.tips)]
        write.table([[f'`{letter}_{name}`', f'= ({vector[1:-1]})', remark] for name, vector, remark
                     in zip(e.frames, vectors, remarks, strict=True)])


def _origin(e: Explanation, i: int) -> str:
    """Say why the origin of frame i is where it is."""
    if e.is_modified:
        if i == len(e.steps):
            return 'where the last row puts it'
        link, above = e.steps[i].link, f'`z_{i + 1}`'
    elif i == 0:
        return 'where `T_Ro0` puts it'
    else:
        link, above = e.steps[i - 1].link, f'`z_{i - 1}`'
    apart = f'{short(1000 * abs(link.a))} mm'
    if abs(math.sin(link.alpha)) < 1e-12:
        relation = f'parallel to {above}, {apart} away' if link.a else f'lies on {above}'
        return f'`z_{i}` {relation}'
    if link.a == 0:
        return f'{above} and `z_{i}` meet here'
    return f'where the common normal from {above} ends, {apart} away'


def _table(e: Explanation, write: Text | Latex) -> None:
    """Write step 5: the table as the documents print it, its errata, the general matrix."""
    rows = []
    for step in e.steps:
        link, sign = step.link, '+' if step.link.sign == 1 else '-'
        d, theta = short(1000 * link.d), short(math.degrees(link.offset))
        if link.is_prismatic:
            d += f' {sign} {_range(1000 * link.lower, 1000 * link.upper)}'
        elif step.joint:
            theta += f' {sign} {_range(math.degrees(link.lower), math.degrees(link.upper))}'
        rows.append([f'`i = {step.index}`', short(1000 * link.a), d, f'`{pi_text(link.alpha)}`',
                     theta + ' *' * bool(link.erratum), step.joint or '(fixed)'])
    write.table(rows, ['Link `i`', '`a_i` (mm)', '`d_i` (mm)', '`alpha_i` (rad)',
                       '`theta_i` (deg)', 'joint'])
    for step in e.steps:
        if step.link.erratum:
            write.words(f'* range of `i = {step.index}`: {step.link.erratum}')
    write.words(f'`A_i = T_i(i+1) = {_factor_names(e, "i")}`')
    write.equation('', _CRAIGS if e.is_modified else _STANDARD)
    for name, T in e.tips:
        if words := _as_fixed_row(name, [[float(cell) for cell in row] for row in T]):
            write.words(words)
    if e.symbols:
        write.words('In what follows `c_i = cos(theta_i)` and `s_i = sin(theta_i)`, with')
        # A rule explains c_0 and s_0, but not c_34.
        write.table([[f'`{name}`', f'`= {_sum(_with_value(e, meaning))}`']
                     for name, meaning in e.symbols.items()
                     if name[0] not in 'cs' or not meaning.args[0].is_Symbol])


def _range(lower: float, upper: float) -> str:
    sign = '+' if upper >= 0 else ''  # as the documents print it
    return 'q' if math.isinf(lower) else f'({short(lower)} -> {sign}{short(upper)})'


def _factor_names(e: Explanation, i: object) -> str:
    turn, link = f'Rz(theta_{i}) tz(d_{i})', f'tx(a_{i}) Rx(alpha_{i})'
    return f'Rx(alpha_{i}) tx(a_{i}) {turn}' if e.is_modified else f'{turn} {link}'


def _as_fixed_row(name: str, T: Matrix) -> str:
    """Say which fixed row a transform behind the table is, if it is one."""
    theta = math.atan2(T[1][0], T[0][0])
    c, s = math.cos(theta), math.sin(theta)
    if max(abs(T[2][0]), abs(c * T[1][3] - s * T[0][3])) > 1e-9:
        return ''
    return (f'`{name}` is what a last fixed row would be, whose joint stays at 0: '
            f'`a = {short(c * T[0][3] + s * T[1][3])}`, `d = {short(T[2][3])}`, '
            f'`alpha = {pi_text(math.atan2(T[2][1], T[2][2]))}`, '
            f'`theta = {short(math.degrees(theta))}`')


def _values(e: Explanation, step: Step) -> list[str]:
    """Return `theta_3 = 90 - 30 = 60 deg` and the like; lengths are in mm."""
    i, link = step.index, step.link
    theta, d = (_sum(_terms(e.symbols.get(str(cell), cell))) for cell in (step.theta, step.d))
    if isinstance(step.theta, float):
        theta, d = f'{short(math.degrees(step.theta))} deg', short(step.d)
        moved = short(step.d - 1000 * link.d if link.is_prismatic
                      else math.degrees(step.theta - link.offset))
        added = f' - {moved[1:]} = ' if moved.startswith('-') else f' + {moved} = '
        if link.is_prismatic:
            d = short(1000 * link.d) + added + d
        elif step.joint:
            theta = short(math.degrees(link.offset)) + added + theta
    return [f'theta_{i} = {theta}', f'd_{i} = {d}', f'a_{i} = {_sum(_terms(step.a))}',
            f'alpha_{i} = {pi_text(link.alpha)}']


def pi_text(angle: float) -> str:
    """Return an angle [rad] as the tables print it: -pi/2, pi, 0; else in decimals."""
    part = Fraction(f'{math.degrees(angle):.12g}') / 180
    if part.denominator > 180:
        return f'{angle:.6g}'
    over, under = abs(part.numerator), part.denominator
    text = f'{over if over > 1 else ""}pi{f"/{under}" if under > 1 else ""}' if over else '0'
    return f'-{text}' if part < 0 else text


class Text:
    """Text as a teacher writes it on the board."""

    def __init__(self, e: Explanation) -> None:
        self._e = e
        self._parts: list[list[str]] = []
        self._joins = False

    def start(self, title: str) -> None:
        """Begin the document."""
        self._parts.append([_plain(title)])
        self._joins = True

    def heading(self, title: str) -> None:
        """Begin a step."""
        self._parts.append([_plain(title)])
        self._joins = not title.startswith(('Step 5', 'Step 6'))

    def words(self, text: str) -> None:
        """Write a paragraph: below a title, and the values of a link, without a gap."""
        follows = self._joins or text.startswith(('`theta', '* '))
        lines = wrapped(_plain(text))
        self._add(indented(lines) if text.startswith(('`theta', '* ')) else lines, follows)

    def table(self, rows: Sequence[Sequence[str]], header: Sequence[str] = ()) -> None:
        """Write rows of cells."""
        cells = [[_plain(cell) for cell in row] for row in rows]
        self._add(indented(columns(cells, '   ' if header else '  ',
                                   [_plain(title) for title in header])), self._joins)
        self._joins = False

    def equation(self, name: str, *matrices: Matrix) -> None:
        """Write a product of matrices, or the entries of one that is too wide."""
        blocks = [matrix([[_sum(_terms(cell)) for cell in row] for row in T],
                         '  ' if len(matrices) == 1 else ' ') for T in matrices]
        lines = indented(beside(f'{name} ='.strip(), *blocks))
        if max(map(len, lines)) > WIDTH and len(matrices) == 1:
            lines = [f'  {name} =']
            for entry, cell in _entries(matrices[0]):
                first, *rest = _filled(_with_value(self._e, cell), WIDTH - 12)
                lines += [f'    {entry.ljust(4)} = {first}',
                          *(' ' * 11 + part for line in rest for part in wrapped(line, '  ', 12))]
        self._add(lines, False)

    def end(self) -> str:
        """Return the document."""
        return '\n\n'.join('\n'.join(lines) for lines in self._parts)

    def _add(self, lines: list[str], joins: bool) -> None:
        if joins:
            self._parts[-1] += lines
        else:
            self._parts.append(lines)


class Latex:
    """A LaTeX document, which needs amsmath only."""

    def __init__(self, e: Explanation) -> None:
        self._lines = [r'\documentclass[10pt]{article}',
                       r'\usepackage[a4paper,landscape,margin=15mm]{geometry}',
                       r'\usepackage{amsmath}', r'\allowdisplaybreaks',
                       r'\setlength{\parindent}{0pt}', r'\begin{document}']

    def start(self, title: str) -> None:
        """Begin the document."""
        self._lines.append(rf'\section*{{{_mixed(title)}}}')

    def heading(self, title: str) -> None:
        """Begin a step."""
        self._lines.append(rf'\subsection*{{{_mixed(title)}}}')

    def words(self, text: str) -> None:
        """Write a paragraph."""
        self._lines += ['', _mixed(text)]

    def table(self, rows: Sequence[Sequence[str]], header: Sequence[str] = ()) -> None:
        """Write rows of cells."""
        lines = [' & '.join(map(_mixed, row)) + r' \\' for row in ([header] if header else [])]
        lines += [r'\hline'] * bool(header)
        lines += [' & '.join(map(_mixed, row)) + r' \\' for row in rows]
        self._lines += [r'\begin{center}', rf'\begin{{tabular}}{{{"l" * len(rows[0])}}}', *lines,
                        r'\end{tabular}', r'\end{center}']

    def equation(self, name: str, *matrices: Matrix) -> None:
        """Write a product of matrices, or the entries of one that is too wide."""
        written = [[' & '.join(_sum(_terms(cell, _latex)) for cell in row) for row in T]
                   for T in matrices]
        if max(len(row) for T in written for row in T) <= _WIDE or len(matrices) > 1:
            parts = [r'\begin{bmatrix} ' + r' \\ '.join(rows) + r' \end{bmatrix}'
                     for rows in written]
            self._lines.append(rf'\[ {_formula(name)} = {" ".join(parts)} \]')
            return
        self._lines += [rf'\[ {_formula(name)}: \]', r'\begin{align*}']
        for entry, cell in _entries(matrices[0]):
            first, *rest = _filled(_terms(cell, _latex), _LINE)
            self._lines += [rf'{_formula(entry)} &= {first} \\',
                            *(rf'&\quad {line} \\' for line in rest)]
        self._lines.append(r'\end{align*}')

    def end(self) -> str:
        """Return the document."""
        return '\n'.join([*self._lines, r'\end{document}'])


def _entries(T: Matrix) -> Iterator[tuple[str, Cell]]:
    """Yield the names and entries of a transform, column by column."""
    for names, cells in zip(zip(*_ENTRIES), zip(*T[:3])):
        yield from zip(names, cells)


def _terms(cell: Cell, printer: Callable[[Any], str] | None = None) -> list[str]:
    """Return the terms of an entry as they are printed, each but the first with its sign."""
    if isinstance(cell, str):
        return [_formula(cell) if printer else cell]
    if isinstance(cell, (int, float)):
        return [short(cell)]
    words = [(printer or _plain_term)(_with_decimals(term)) for term in cell.as_ordered_terms()]
    return words[:1] + [f'- {word[1:].lstrip()}' if word.startswith('-') else f'+ {word}'
                        for word in words[1:]]


def _with_value(e: Explanation, cell: Cell) -> list[str]:
    """Return the terms of an expression and, if it has one, its value in decimals."""
    terms, value = _terms(cell), e.value(cell)
    return terms if value is None or short(value) == _sum(terms) else [
        *terms, f'= {short(value)}']


def _sum(terms: Sequence[str]) -> str:
    return ' '.join(terms)


def _with_decimals(term: Cell) -> Cell:
    """Return a term with its fraction as a decimal where that is as exact: -0.9175."""
    import sympy

    coefficient, rest = term.as_coeff_Mul()
    roots = any(factor.is_number and factor != 1 for factor in sympy.Mul.make_args(rest))
    if coefficient.is_Integer or roots or not coefficient.is_Rational or 10**6 % coefficient.q:
        return term
    return sympy.Float(float(coefficient), 12) * rest


def _plain_term(term: Cell) -> str:
    from sympy.printing.str import sstr

    return str(sstr(term, full_prec=False)).replace('**', '^').replace('*', ' ')


def _latex(term: Cell) -> str:
    from sympy import latex

    names = {symbol: _formula(symbol.name).strip() for symbol in term.free_symbols}
    return str(latex(term, symbol_names=names))


def _filled(terms: Sequence[str], width: int) -> list[str]:
    """Join terms to lines no wider than `width`, unless a term itself is."""
    lines = ['']
    for term in terms:
        if lines[-1] and len(lines[-1]) + 1 + len(term) > width:
            lines.append(term)
        else:
            lines[-1] = f'{lines[-1]} {term}'.strip()
    return lines


def _plain(text: str) -> str:
    return text.replace('`', '')


def _mixed(text: str) -> str:
    """Return words for LaTeX, with what stands between backticks as formulas."""
    words = text.replace('->', '`->`').split('`')
    return ''.join(f'${_formula(part)}$' if i % 2 else ''.join(
        _ESCAPES.get(letter, letter) for letter in part) for i, part in enumerate(words) if part)


def _formula(text: str) -> str:
    """Return `T_Ro0`, `cos(theta_3 - theta_4)` or `c_3m4` in LaTeX's words."""
    text = re.sub(r'\b([Rt])([xz])\(', r'\1_\2(', text)
    text = re.sub(r'_(\w+(?:\(i\+1\))?|\(i[-+]1\))', lambda found: '_{' + found[1].replace(
        'm', '-').replace('_', ' ') + '}', text)
    text = text.replace('_{(i+1)}', '_{i+1}').replace('_{(i-1)}', '_{i-1}')
    for words, symbol in ((' deg', r'^\circ'), ('->', r'\rightarrow'), (' x ', r' \times ')):
        text = text.replace(words, symbol)
    return re.sub(r'(?<![a-z\\])(theta|alpha|pi|cos|sin|sqrt)(?![a-z])', r'\\\1 ', text)
