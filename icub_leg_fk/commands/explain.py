"""`leg_fk explain`: how the pose of a chain follows from its Denavit-Hartenberg table.

What is said of the six steps of the method stands in `_blocks`; `as_text` and `as_latex` say how.
Formulas within sentences and tables stand between backticks. Entries of matrices are written by
sympy's own printers.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
import math
import re
import textwrap
from typing import Any

from icub_leg_fk.kinematics.chain_text import position, short
from icub_leg_fk.tools import options, text
from icub_leg_fk.tools.explanation import Cell, Explanation, Matrix, Step, work_out

EXAMPLES = """\
Without joint positions the answer is a formula in q_i. Lengths are mm, as in printed tables.

examples:
  leg_fk explain left_leg --degrees 0 10 0 -30 -15 5
  leg_fk explain left_leg
  leg_fk explain head_imu --version v2 --degrees 0 0 0 30 0 45 --symbolic
  leg_fk explain arm -k cylindrical_arm.yaml --version v1 --latex > arm.tex"""

_STANDARD = [
    ['cos theta_i', '-sin theta_i cos alpha_i', 'sin theta_i sin alpha_i', 'a_i cos theta_i'],
    ['sin theta_i', 'cos theta_i cos alpha_i', '-cos theta_i sin alpha_i', 'a_i sin theta_i'],
    ['0', 'sin alpha_i', 'cos alpha_i', 'd_i'], ['0', '0', '0', '1']]
_CRAIGS = [
    ['cos theta_i', '-sin theta_i', '0', 'a_i'],
    ['sin theta_i cos alpha_i', 'cos theta_i cos alpha_i', '-sin alpha_i', '-d_i sin alpha_i'],
    ['sin theta_i sin alpha_i', 'cos theta_i sin alpha_i', 'cos alpha_i', 'd_i cos alpha_i'],
    ['0', '0', '0', '1']]
_ENTRIES = [(f'r_{i + 1}{j + 1}' if j < 3 else f'p_{"xyz"[i]}', i, j)  # column by column
            for j in range(4) for i in range(3)]
_WIDE, _LINE = 330, 260  # characters of LaTeX: a matrix that fits on a line, a line of a sum
_ESCAPES = {letter: f'\\{letter}' for letter in '_&%$#{}'} | {
    '\\': r'\textbackslash{}', '^': r'\^{}', '~': r'\~{}'}
_PREAMBLE = [r'\documentclass[10pt]{article}',
             r'\usepackage[a4paper,landscape,margin=15mm]{geometry}', r'\usepackage{amsmath}',
             r'\allowdisplaybreaks', r'\setlength{\parindent}{0pt}', r'\begin{document}']


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    options.add(parser, 'chain', '--version', '--foot-frame', '--kinematics-file')
    options.add_joint_positions(parser, required=False)
    parser.add_argument('--symbolic', action='store_true',
                        help='exact numbers instead of decimals: pi/2, not 1.5708 (by sympy)')
    form = parser.add_mutually_exclusive_group()
    form.add_argument('--latex', action='store_true', help='print a LaTeX document')
    options.add(form, '--json')


def run(args: argparse.Namespace) -> int:
    """Print the explanation."""
    _, chain = options.load_chain(args)
    e = work_out(chain, options.joint_positions(args, chain), args.symbolic)
    print(text.as_json(_as_json(e)) if args.json else as_latex(e) if args.latex else as_text(e))
    return 0


def as_text(e: Explanation) -> str:
    """Return the explanation as a teacher writes it on the board."""
    paragraphs: list[list[str]] = []
    joins = False
    for kind, *parts in _blocks(e):
        if kind == 'equation':
            lines = _text_equation(e, *parts)
        elif kind == 'table':
            header, rows = ([[cell.replace('`', '') for cell in row] for row in part]
                            for part in parts)
            lines = text.indented(text.columns(rows, '   ' if header else '  ', *header))
        else:
            lines = text.wrapped(parts[0].replace('`', ''))
            lines = text.indented(lines) if kind == 'aside' else lines
        if kind == 'aside' or (joins and kind in ('table', 'words')):
            paragraphs[-1] += lines
        else:
            paragraphs.append(lines)
        joins = kind in ('title', 'heading') or (joins and kind == 'words')
    return '\n\n'.join('\n'.join(lines) for lines in paragraphs)


def as_latex(e: Explanation) -> str:
    """Return the explanation as a LaTeX document, which needs amsmath only."""
    lines = list(_PREAMBLE)
    for kind, *parts in _blocks(e):
        if kind == 'equation':
            lines += _latex_equation(*parts)
        elif kind == 'table':
            header, rows = ([' & '.join(map(_mixed, row)) + r' \\' for row in part]
                            for part in parts)
            lines += [rf'\begin{{center}}\begin{{tabular}}{{{"l" * len(parts[1][0])}}}', *header,
                      *[r'\hline'] * len(header), *rows, r'\end{tabular}\end{center}']
        elif kind in ('title', 'heading'):
            lines.append(rf'\{"sub" * (kind == "heading")}section*{{{_mixed(parts[0])}}}')
        else:
            lines += ['', _mixed(parts[0])]
    return '\n'.join([*lines, r'\end{document}'])


def _blocks(e: Explanation) -> Iterator[Any]:
    """Yield the whole explanation.

    `title`, `heading`, `words` and `aside` have a text, `table` rows of a header and rows,
    `equation` a name and matrices that are multiplied.
    """
    chain = e.chain
    yield ('title', f'{chain.name} {chain.version}: the transform `T_Ro{e.tip}`   '
           f'(Ro = {chain.root_frame}, {e.tip} = {chain.frame_id})')
    if e.source:
        yield 'words', f'Table from: {e.source}'
    values = 'symbols `q_i`' if e.q is None else ', '.join(
        f'{name} {position(link, value)}' for name, link, value
        in zip(chain.joint_names, chain.joints, e.q, strict=True))
    yield 'words', f'Joint positions: {values}. Lengths in mm.'
    yield from _frames(e)
    yield 'heading', 'Step 5. The Denavit-Hartenberg table, and each link as four basic transforms'
    yield from _table(e)
    for step in e.steps:
        i = step.index
        yield 'words', f'`A_{i} = T_{i}{i + 1} = {_factors(e, i)}`   {step.joint or "fixed"}'
        yield 'aside', '   '.join(f'`{value}`' for value in _values(e, step))
        yield ('equation', '', *step.factors)
        yield 'equation', '', step.A
    yield 'heading', 'Step 6. Multiply'
    for i, T in enumerate(e.products):
        yield 'equation', f'T_0{i + 1} = {f"T_0{i} A_{i}" if i else "A_0"}', T
    yield 'equation', 'T_Ro0', e.T_root_0
    for tip in e.tips:
        yield ('equation', *tip)
    factors = ' '.join(['T_Ro0', f'T_0{len(e.steps)}', *(name for name, _ in e.tips)])
    yield 'equation', f'T_Ro{e.tip} = {factors}', e.T_root_tip
    if e.q is not None:
        x, y, z = (short(e.value(row[3]) or 0.0) for row in e.T_root_tip[:3])
        yield ('words', f'{chain.frame_id} is at x = {x}, y = {y}, z = {z} mm in '
               f'{chain.root_frame}.')
        for note in text.range_notes(chain, e.q):
            yield 'words', note


def _frames(e: Explanation) -> Iterator[Any]:
    """Yield steps 1 to 4: the axes and origins of all frames."""
    n, modified = len(e.steps), e.is_modified
    at = f'coordinates in {e.chain.root_frame}, at {"q = 0" if e.q is None else "this q"}'
    other = '`z_(i+1)`' if modified else '`z_(i-1)`'
    axes = [f'{step.joint} {"slides along" if step.link.is_prismatic else "turns about"} it'
            if step.joint else 'a fixed row' for step in e.steps]
    axes.insert(0 if modified else n, f'no joint: {"frame 0" if modified else "the last frame"}')
    orthogonal = [f'orthogonal to `z_{i}` and `z_{i + 1}`' for i in range(n)]
    for title, letter, column, remarks in (
            (f'Step 1. The z axis of each joint   ({at})', 'z', 2, axes),
            (f'Step 2. The origin of each frame, on `z_i` where it meets {other}   (mm)', 'o', 3,
             [_origin(e, i) for i in range(n + 1)]),
            (f'Step 3. The x axis of each frame, orthogonal to {other} and `z_i`', 'x', 0,
             [*orthogonal, 'free'] if modified else ['as `T_Ro0` has it', *orthogonal]),
            ('Step 4. The y axis of each frame, by the right-hand rule: `y_i = z_i x x_i`', 'y', 1,
             [''] * (n + 1))):
        vectors = text.matrix([[short(value) for value in T[:3, column]]
                               for T in e.frames.values()], '  ')
        remarks = [*remarks, *(f'as `{name}` has it' for name, _ in e.tips)]
        yield 'heading', title
        yield 'table', [], [[f'`{letter}_{name}`', f'= ({vector[1:-1]})', remark] for
                            name, vector, remark in zip(e.frames, vectors, remarks, strict=True)]


def _origin(e: Explanation, i: int) -> str:
    """Say why the origin of frame i is where it is."""
    if i == (len(e.steps) if e.is_modified else 0):
        return 'where the last row puts it' if e.is_modified else 'where `T_Ro0` puts it'
    link = e.steps[i if e.is_modified else i - 1].link
    other = f'`z_{i + 1 if e.is_modified else i - 1}`'
    apart = f'{short(1000 * abs(link.a))} mm'
    if abs(math.sin(link.alpha)) < 1e-12:
        return f'`z_{i}` ' + (f'parallel to {other}, {apart} away' if link.a else
                              f'lies on {other}')
    return (f'where the common normal from {other} ends, {apart} away' if link.a else
            f'{other} and `z_{i}` meet here')


def _table(e: Explanation) -> Iterator[Any]:
    """Yield step 5: the table as the documents print it, its errata, the general matrix."""
    rows = []
    for step in e.steps:
        link, sign = step.link, '+' if step.link.gain > 0 else '-'
        d, theta = short(1000 * link.d), short(math.degrees(link.offset))
        if link.is_prismatic:
            d += f' {sign} {_range(1000 * link.lower, 1000 * link.upper)}'
        elif step.joint:
            theta += f' {sign} {_range(math.degrees(link.lower), math.degrees(link.upper))}'
        rows.append([f'`i = {step.index}`', short(1000 * link.a), d, f'`{_pi(link.alpha)}`',
                     theta + ' *' * bool(link.erratum), step.joint or '(fixed)'])
    yield 'table', [['Link `i`', '`a_i` (mm)', '`d_i` (mm)', '`alpha_i` (rad)', '`theta_i` (deg)',
                     'joint']], rows
    for step in e.steps:
        if step.link.erratum:
            yield 'aside', f'* range of `i = {step.index}`: {step.link.erratum}'
    yield 'words', f'`A_i = T_i(i+1) = {_factors(e, "i")}`'
    yield 'equation', '', _CRAIGS if e.is_modified else _STANDARD
    for name, T in e.tips:
        if words := _as_fixed_row(name, [[float(cell) for cell in row] for row in T]):
            yield 'words', words
    if e.symbols:
        yield 'words', 'In what follows `c_i = cos(theta_i)` and `s_i = sin(theta_i)`, with'
        # A rule explains c_0 and s_0, but not c_34.
        yield 'table', [], [[f'`{name}`', f'`= {" ".join(_with_value(e, meaning))}`']
                            for name, meaning in e.symbols.items()
                            if name[0] not in 'cs' or not meaning.args[0].is_Symbol]


def _range(lower: float, upper: float) -> str:
    sign = '+' if upper >= 0 else ''  # as the documents print it
    return 'q' if math.isinf(lower) else f'({short(lower)} -> {sign}{short(upper)})'


def _factors(e: Explanation, i: object) -> str:
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
            f'`alpha = {_pi(math.atan2(T[2][1], T[2][2]))}`, '
            f'`theta = {short(math.degrees(theta))}`')


def _values(e: Explanation, step: Step) -> list[str]:
    """Return `theta_3 = 90 - 30 = 60 deg` and the like; lengths are in mm."""
    i, link = step.index, step.link
    theta, d, a = (' '.join(_terms(e.symbols.get(str(cell), cell)))
                   for cell in (step.theta, step.d, step.a))
    if isinstance(step.theta, float):
        theta = f'{short(math.degrees(step.theta))} deg'
        if link.is_prismatic:
            d = _added(1000 * link.d, step.d, d)
        elif step.joint:
            theta = _added(math.degrees(link.offset), math.degrees(step.theta), theta)
    return [f'theta_{i} = {theta}', f'd_{i} = {d}', f'a_{i} = {a}',
            f'alpha_{i} = {_pi(link.alpha)}']


def _added(before: float, after: float, shown: str) -> str:
    moved = short(after - before)
    return f'{short(before)} {"-" if moved[0] == "-" else "+"} {moved.lstrip("-")} = {shown}'


def _pi(angle: float) -> str:
    """Return an angle [rad] as the tables print it: -pi/2, pi, 0; else in decimals."""
    part = Fraction(f'{math.degrees(angle):.12g}') / 180
    if part.denominator > 180:
        return f'{angle:.6g}'
    words = re.sub(r'\b1pi', 'pi', f'{part.numerator}pi/{part.denominator}').removesuffix('/1')
    return words if part else '0'


def _text_equation(e: Explanation, name: str, *matrices: Matrix) -> list[str]:
    """Return a product of matrices, or the entries of one that is too wide."""
    written = [text.matrix([[' '.join(_terms(cell)) for cell in row] for row in T],
                           '  ' if len(matrices) == 1 else ' ') for T in matrices]
    words = f'  {name} =' if name else '  ='
    gap = ' ' * len(words)
    lines = [' '.join(row) for row in zip((gap, words, gap, gap), *written)]
    if max(map(len, lines)) <= text.WIDTH or len(matrices) > 1:
        return lines
    lines = [f'  {name} =']
    for entry, i, j in _ENTRIES:
        first, *rest = _filled(_with_value(e, matrices[0][i][j]), text.WIDTH - 11)
        lines += [f'    {entry:4} = {first}', *(' ' * 11 + line for line in rest)]
    return lines


def _latex_equation(name: str, *matrices: Matrix) -> list[str]:
    written = [[' & '.join(' '.join(_terms(cell, _latex)) for cell in row) for row in T]
               for T in matrices]
    if max(len(row) for T in written for row in T) <= _WIDE or len(matrices) > 1:
        parts = [r'\begin{bmatrix} ' + r' \\ '.join(rows) + r' \end{bmatrix}'
                 for rows in written]
        return [rf'\[ {_formula(name)} = {" ".join(parts)} \]']
    lines = [rf'\[ {_formula(name)}: \]', r'\begin{align*}']
    for entry, i, j in _ENTRIES:
        first, *rest = _filled(_terms(matrices[0][i][j], _latex), _LINE)
        lines += [rf'{_formula(entry)} &= {first} \\', *(rf'&\quad {line} \\' for line in rest)]
    return [*lines, r'\end{align*}']


def _terms(cell: Cell, printer: Callable[[Any], str] | None = None) -> list[str]:
    """Return the terms of an entry as they are printed, each but the first with its sign."""
    if isinstance(cell, str):
        return [_formula(cell) if printer else cell]
    if isinstance(cell, (int, float)):
        return [short(cell)]
    words = [(printer or _plain)(_with_decimals(term)) for term in cell.as_ordered_terms()]
    return words[:1] + [f'- {word[1:].lstrip()}' if word.startswith('-') else f'+ {word}'
                        for word in words[1:]]


def _with_value(e: Explanation, cell: Cell) -> list[str]:
    """Return the terms of an expression and, if it has one, its value in decimals."""
    terms, value = _terms(cell), e.value(cell)
    return terms if value is None or short(value) == ' '.join(terms) else [
        *terms, f'= {short(value)}']


def _with_decimals(term: Cell) -> Cell:
    """Return a term with its fraction as a decimal where that is as exact: -0.9175."""
    import sympy

    coefficient, rest = term.as_coeff_Mul()
    roots = any(factor.is_number and factor != 1 for factor in sympy.Mul.make_args(rest))
    if coefficient.is_Integer or roots or not coefficient.is_Rational or 10**6 % coefficient.q:
        return term
    return sympy.Float(float(coefficient), 12) * rest


def _plain(term: Cell) -> str:
    from sympy.printing.str import sstr

    return str(sstr(term, full_prec=False)).replace('**', '^').replace('*', ' ')


def _latex(term: Cell) -> str:
    from sympy import latex

    names = {symbol: _formula(symbol.name).strip() for symbol in term.free_symbols}
    return str(latex(term, symbol_names=names))


def _filled(terms: Sequence[str], width: int) -> list[str]:
    """Join terms to lines, which end behind a term unless it alone is wider."""
    joined = ' '.join(term.replace(' ', '\xa0') if len(term) <= width else term for term in terms)
    return [line.replace('\xa0', ' ') for line in textwrap.wrap(
        joined, width, break_long_words=False, break_on_hyphens=False)]


def _mixed(words: str) -> str:
    """Return words for LaTeX, with what stands between backticks as formulas."""
    parts = words.replace('->', '`->`').split('`')
    return ''.join(f'${_formula(part)}$' if i % 2 else ''.join(
        _ESCAPES.get(letter, letter) for letter in part) for i, part in enumerate(parts) if part)


def _formula(words: str) -> str:
    """Return `T_Ro0`, `cos(theta_3 - theta_4)` or `c_3m4` in LaTeX's words."""
    words = re.sub(r'\b([Rt])([xz])\(', r'\1_\2(', words)
    words = re.sub(r'_(\w+(?:\(i\+1\))?|\(i[-+]1\))', lambda found: '_{' + found[1].replace(
        'm', '-').replace('_', ' ') + '}', words)
    words = words.replace('_{(i+1)}', '_{i+1}').replace('_{(i-1)}', '_{i-1}')
    for plain, symbol in ((' deg', r'^\circ'), ('->', r'\rightarrow'), (' x ', r' \times ')):
        words = words.replace(plain, symbol)
    return re.sub(r'(?<![a-z\\])(theta|alpha|pi|cos|sin|sqrt)(?![a-z])', r'\\\1 ', words)


def _as_json(e: Explanation) -> dict[str, Any]:
    """Return the explanation for programs; lengths in mm, angles in rad."""
    chain = e.chain
    return {
        'chain': chain.name, 'version': chain.version, 'source': e.source,
        'root_frame': chain.root_frame, 'frame_id': chain.frame_id,
        'units': {'length': 'mm', 'angle': 'rad'}, 'convention': chain.convention,
        'joints': list(chain.joint_names),
        'joint_positions': None if e.q is None else [
            1000 * value if link.is_prismatic else value
            for value, link in zip(e.q, chain.joints, strict=True)],
        'symbols': {name: str(meaning) for name, meaning in e.symbols.items()},
        'frames': [{name: (T[:3, column] + 0.0).tolist() for column, name in enumerate(
            ('x', 'y', 'z', 'origin'))} for T in e.frames.values()],
        'frame_names': list(e.frames),
        'links': [_link(step, e.is_modified) for step in e.steps],
        'running_products': [_matrix(T) for T in e.products],
        'T_root_0': _matrix(e.T_root_0),
        'after_last_link': {name: _matrix(T) for name, T in e.tips},
        'T_root_tip': _matrix(e.T_root_tip)}


def _link(step: Step, modified: bool) -> dict[str, Any]:
    link = step.link
    scale = 1000 if link.is_prismatic else 1
    names = ('Rx', 'tx', 'Rz', 'tz') if modified else ('Rz', 'tz', 'tx', 'Rx')
    return {
        'i': step.index, 'joint': step.joint or None, 'joint_type': link.joint_type,
        'range': [scale * x for x in link.limits] if math.isfinite(link.limits[0]) else None,
        'erratum': link.erratum, 'theta': _cell(step.theta), 'd': _cell(step.d),
        'a': _cell(step.a), 'alpha': _cell(step.alpha),
        'factors': {name: _matrix(T) for name, T in zip(names, step.factors, strict=True)},
        'A': _matrix(step.A)}


def _matrix(T: Matrix) -> list[list[float | str]]:
    """Return a matrix of numbers, or one of expressions if any entry is one."""
    exact = any(isinstance(_cell(cell), str) for row in T for cell in row)
    return [[str(cell) if exact else float(cell) + 0.0 for cell in row] for row in T]


def _cell(cell: Cell) -> float | str:
    return cell + 0.0 if isinstance(cell, (int, float)) else str(cell)
