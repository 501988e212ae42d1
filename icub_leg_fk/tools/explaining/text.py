"""`leg_fk explain` as text: the six steps of the method, as a teacher writes them on the board."""

from __future__ import annotations

from collections.abc import Sequence
import math

from icub_leg_fk.tools.explaining.steps import Cell, Explanation, Matrix, number, pi_text, Step
from icub_leg_fk.tools.explaining.terms import cell_words, filled, terms
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
import numpy as np

Lines = list[str]

GENERAL_MATRIX = [
    ['cos theta_i', '-sin theta_i cos alpha_i', 'sin theta_i sin alpha_i', 'a_i cos theta_i'],
    ['sin theta_i', 'cos theta_i cos alpha_i', '-cos theta_i sin alpha_i', 'a_i sin theta_i'],
    ['0', 'sin alpha_i', 'cos alpha_i', 'd_i'],
    ['0', '0', '0', '1'],
]
COLUMN_NAMES = [('r_11', 'r_21', 'r_31'), ('r_12', 'r_22', 'r_32'), ('r_13', 'r_23', 'r_33'),
                ('p_x', 'p_y', 'p_z')]


CRAIGS_MATRIX = [
    ['cos theta_i', '-sin theta_i', '0', 'a_i'],
    ['sin theta_i cos alpha_i', 'cos theta_i cos alpha_i', '-sin alpha_i', '-d_i sin alpha_i'],
    ['sin theta_i sin alpha_i', 'cos theta_i sin alpha_i', 'cos alpha_i', 'd_i cos alpha_i'],
    ['0', '0', '0', '1'],
]


def factor_names(e: Explanation, i: object) -> str:
    """Return the factors of A_i in the order of the convention."""
    turn, link = f'Rz(theta_{i}) tz(d_{i})', f'tx(a_{i}) Rx(alpha_{i})'
    if e.chain.convention == 'modified':
        return f'Rx(alpha_{i}) tx(a_{i}) {turn}'
    return f'{turn} {link}'


def fixed_row_words(name: str, T: Matrix) -> Lines:
    """Say which fixed row a transform behind the table is, if it is one."""
    M = np.array([[float(cell) for cell in row] for row in T])
    theta = math.atan2(M[1, 0], M[0, 0])
    a, aside = (math.cos(theta) * M[0, 3] + math.sin(theta) * M[1, 3],
                math.cos(theta) * M[1, 3] - math.sin(theta) * M[0, 3])
    if max(abs(M[2, 0]), abs(aside)) > 1e-9:
        return []
    alpha = math.atan2(M[2, 1], M[2, 2])
    return wrapped(f'  {name} is what a last fixed row would be, whose joint stays at 0: '
                   f'a = {short(a)}, d = {short(M[2, 3])}, alpha = {pi_text(alpha)}, '
                   f'theta = {short(math.degrees(theta))}')


def out_of_range_notes(e: Explanation) -> Lines:
    """Say which joints are outside their range, as `leg_fk pose` does."""
    return [] if e.q is None else range_notes(e.chain, e.q)


def explanation_text(e: Explanation) -> str:
    """Return the whole explanation."""
    parts = [_heading(e), _z_axes(e), _origins(e), _x_axes(e), _y_axes(e), _dh_convention(e),
             *(_link(e, step) for step in e.steps), _products(e), _answer(e)]
    parts += [[note] for note in out_of_range_notes(e)]
    return '\n\n'.join('\n'.join(lines) for lines in parts)


def root_names(e: Explanation) -> str:
    """Return `T_RoLf = T_Ro0 T_06`, with T_nIs and the sole where they follow."""
    factors = ' '.join(['T_Ro0', f'T_0{len(e.steps)}', *(name for name, _ in e.tips)])
    return f'T_{e.root}{e.tip} = {factors}'


def link_name(step: Step) -> str:
    """Return `T_23` for row 2."""
    return f'T_{step.row.index}{step.row.index + 1}'


def origin_reason(e: Explanation, i: int) -> str:
    """Say why the origin of frame i is where it is."""
    if e.chain.convention == 'modified':
        if i == len(e.steps):
            return 'where the last row puts it'
        link, own, above = e.steps[i].row.link, f'z_{i}', f'z_{i + 1}'
    elif i == 0:
        return 'where T_Ro0 puts it'
    else:
        link, own, above = e.steps[i - 1].row.link, f'z_{i}', f'z_{i - 1}'
    apart = f'{short(1000 * abs(link.a))} mm'
    if abs(math.sin(link.alpha)) < 1e-12:
        relation = f'parallel to {above}, {apart} away' if link.a else f'lies on {above}'
        return f'{own} {relation}'
    if link.a == 0:
        return f'{above} and {own} meet here'
    return f'where the common normal from {above} ends, {apart} away'


def table_rows(e: Explanation) -> list[list[str]]:
    """Return the DH table as the documents print it."""
    rows = []
    for step in e.steps:
        link, d, theta = step.row.link, '', ''
        offset = short(math.degrees(link.offset))
        theta = offset
        sign = '+' if link.sign == 1 else '-'
        if link.is_prismatic:
            d = f' {sign} {_range(1000 * link.lower, 1000 * link.upper)}'
        elif step.row.joint:
            theta += f' {sign} {_range(math.degrees(link.lower), math.degrees(link.upper))}'
        if link.erratum:
            theta += ' *'
        rows.append([f'i = {step.row.index}', short(1000 * link.a), short(1000 * link.d) + d,
                     pi_text(link.alpha), theta, step.row.joint or '(fixed)'])
    return rows


def defined_symbols(e: Explanation) -> list[tuple[str, Cell]]:
    """Return the symbols that need saying: not c_0 and s_0, which a rule explains, but c_34."""
    return [(name, meaning) for name, meaning in e.symbols.items()
            if name[0] not in 'cs' or not meaning.args[0].is_Symbol]


def link_values(e: Explanation, step: Step) -> list[str]:
    """Return `theta_3 = 90 - 30 = 60 deg` and the like; lengths are in mm."""
    i, link = step.row.index, step.row.link
    theta, d = (cell_words(e.symbols.get(str(cell), cell)) for cell in (step.theta, step.d))
    if isinstance(step.theta, float):
        theta, d = f'{short(math.degrees(step.theta))} deg', short(step.d)
        moved = short(1000 * (step.d / 1000 - link.d) if link.is_prismatic
                      else math.degrees(step.theta - link.offset))
        added = f' - {moved[1:]} = ' if moved.startswith('-') else f' + {moved} = '
        if link.is_prismatic:
            d = short(1000 * link.d) + added + d
        elif step.row.joint:
            theta = short(math.degrees(link.offset)) + added + theta
    return [f'theta_{i} = {theta}', f'd_{i} = {d}', f'a_{i} = {cell_words(step.a)}',
            f'alpha_{i} = {pi_text(link.alpha)}']


def _range(lower: float, upper: float) -> str:
    sign = '+' if upper >= 0 else ''  # as the documents print it
    return 'q' if math.isinf(lower) else f'({short(lower)} -> {sign}{short(upper)})'


def _heading(e: Explanation) -> Lines:
    chain = e.chain
    names = f'{e.root} = {chain.root_frame}, {e.tip} = {chain.tip_frame}'
    lines = [f'{chain.name} {chain.version}: the transform T_{e.root}{e.tip}   ({names})']
    if e.source:
        lines += wrapped(f'Table from: {e.source}')
    if e.q is None:
        lines += ['Joint positions: symbols q_i. Lengths in mm.']
    else:
        values = [f'{name} {position_text(link, value)}' for name, link, value
                  in zip(chain.joint_names, chain.joints, e.q, strict=True)]
        lines += wrapped(f'Joint positions: {", ".join(values)}. Lengths in mm.')
    return lines


def _frame_table(e: Explanation, axis: str, column: int, remarks: Sequence[str]) -> Lines:
    vectors = matrix([[short(value) for value in T[:3, column]] for T in e.frames.values()],
                     gap='  ')
    remarks = [*remarks, *(f'as {name} has it' for name, _ in e.tips)]
    rows = [[f'{axis}_{name}', f'= ({vector[1:-1]})', remark]
            for name, vector, remark in zip(e.frames, vectors, remarks, strict=True)]
    return indented(columns(rows))


def _at(e: Explanation) -> str:
    return f'coordinates in {e.chain.root_frame}, at {"q = 0" if e.q is None else "this q"}'


def _z_axes(e: Explanation) -> Lines:
    remarks = []
    for step in e.steps:
        verb = 'slides along' if step.row.link.is_prismatic else 'turns about'
        remarks.append(f'{step.row.joint} {verb} it' if step.row.joint else 'a fixed row')
    modified = e.chain.convention == 'modified'
    last = 'no joint: ' + ('frame 0' if modified else 'the last frame')
    remarks = [last, *remarks] if modified else [*remarks, last]
    return [f'Step 1. The z axis of each joint   ({_at(e)})',
            *_frame_table(e, 'z', 2, remarks)]


def _origins(e: Explanation) -> Lines:
    remarks = [origin_reason(e, i) for i in range(len(e.steps) + 1)]
    meets = 'z_(i+1)' if e.chain.convention == 'modified' else 'z_(i-1)'
    return [f'Step 2. The origin of each frame, on z_i where it meets {meets}   (mm)',
            *_frame_table(e, 'o', 3, remarks)]


def _x_axes(e: Explanation) -> Lines:
    remarks = ['as T_Ro0 has it'] + [f'orthogonal to z_{i} and z_{i + 1}'
                                     for i in range(len(e.steps))]
    if e.chain.convention == 'modified':
        remarks = [f'orthogonal to z_{i} and z_{i + 1}' for i in range(len(e.steps))] + ['free']
    other = 'z_(i+1)' if e.chain.convention == 'modified' else 'z_(i-1)'
    return [f'Step 3. The x axis of each frame, orthogonal to {other} and z_i',
            *_frame_table(e, 'x', 0, remarks)]


def _y_axes(e: Explanation) -> Lines:
    return ['Step 4. The y axis of each frame, by the right-hand rule: y_i = z_i x x_i',
            *_frame_table(e, 'y', 1, [''] * (len(e.steps) + 1))]


def _dh_convention(e: Explanation) -> Lines:
    header = ['Link i', 'a_i (mm)', 'd_i (mm)', 'alpha_i (rad)', 'theta_i (deg)', 'joint']
    lines = ['Step 5. The Denavit-Hartenberg table, and each link as four basic transforms', '']
    lines += indented(columns(table_rows(e), '   ', header))
    for step in e.steps:
        if step.row.link.erratum:
            lines += indented(wrapped(f'* range of i = {step.row.index}: {step.row.link.erratum}'))
    lines += ['', f'  A_i = T_i(i+1) = {factor_names(e, "i")}', '']
    general = CRAIGS_MATRIX if e.chain.convention == 'modified' else GENERAL_MATRIX
    lines += indented(beside('=', matrix(general, gap='   ')), 6)
    lines += [line for name, T in e.tips for line in ['', *fixed_row_words(name, T)]
              if fixed_row_words(name, T)]
    if e.symbols:
        defined = [[name, f'= {" ".join(_with_value(e, meaning))}']
                   for name, meaning in defined_symbols(e)]
        lines += ['', '  In what follows c_i = cos(theta_i) and s_i = sin(theta_i), with', '']
        lines += indented(columns(defined), 4)
    return lines


def _link(e: Explanation, step: Step) -> Lines:
    i = step.row.index
    title = f'A_{i} = {link_name(step)} = {factor_names(e, i)}'
    blocks = [matrix(_cells(factor)) for factor in step.factors]
    return [f'{title}   {step.row.joint or "fixed"}',
            '  ' + '   '.join(link_values(e, step)), '',
            *indented(beside('=', *blocks)), '',
            *_equals(e, '', step.A)]


def _products(e: Explanation) -> Lines:
    lines = ['Step 6. Multiply', '']
    lines += _equals(e, 'T_01 = A_0', e.steps[0].T_0)
    for step in e.steps[1:]:
        i = step.row.index
        lines += ['', *_equals(e, f'T_0{i + 1} = T_0{i} A_{i}', step.T_0)]
    return lines


def _answer(e: Explanation) -> Lines:
    lines = _equals(e, f'T_{e.root}0', e.T_root_0)
    for name, T in e.tips:
        lines += ['', *_equals(e, name, T)]
    lines += ['', *_equals(e, root_names(e), e.T_root_tip)]
    if e.q is not None:
        lines += ['', closing_sentence(e)]
    return lines


def closing_sentence(e: Explanation) -> str:
    """Say where the tip is."""
    x, y, z = (short(number(row[3], e.symbols) or 0.0) for row in e.T_root_tip[:3])
    return f'{e.chain.tip_frame} is at x = {x}, y = {y}, z = {z} mm in {e.chain.root_frame}.'


def _cells(T: Matrix) -> list[list[str]]:
    return [[cell_words(cell) for cell in row] for row in T]


def _with_value(e: Explanation, cell: Cell) -> list[str]:
    """Return the terms of an expression and, if it has one, its value in decimals."""
    words, value = terms(cell), number(cell, e.symbols)
    if value is not None and short(value) != ' '.join(words):
        words.append(f'= {short(value)}')
    return words


def _equals(e: Explanation, name: str, T: Matrix) -> Lines:
    """Return a matrix after its name, or its entries one by one if it is too wide."""
    lines = indented(beside(f'{name} ='.strip(), matrix(_cells(T), gap='  ')))
    if max(map(len, lines)) <= WIDTH:
        return lines
    lines = [f'  {name} =']
    for names, column in zip(COLUMN_NAMES, zip(*T[:3], strict=True), strict=True):
        for cell, value in zip(names, column, strict=True):
            lines_of_sum = filled(_with_value(e, value), WIDTH - 12)
            first, *rest = [part for line in lines_of_sum for part in wrapped(line, '  ', 12)]
            lines += [f'    {cell.ljust(4)} = {first}', *(' ' * 11 + line for line in rest)]
    return lines
