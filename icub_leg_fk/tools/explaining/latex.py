r"""`leg_fk explain` as a LaTeX document, which needs amsmath only."""

from __future__ import annotations

import re

from icub_leg_fk.tools.explaining.steps import Explanation, Matrix, Step
from icub_leg_fk.tools.explaining.terms import cell_words, filled, LATEX, symbol_latex, terms
from icub_leg_fk.tools.explaining.text import (
    closing_sentence,
    COLUMN_NAMES,
    defined_symbols,
    link_values,
    origin_reason,
    out_of_range_notes,
    table_rows,
)
from icub_leg_fk.tools.text import position_text, short

WIDE = 330  # characters of a matrix in LaTeX that still fit on a line
LINE = 260  # characters of a sum

ESCAPES = {letter: f'\\{letter}' for letter in '_&%$#{}'} | {
    '\\': r'\textbackslash{}', '^': r'\^{}', '~': r'\~{}'}

PREAMBLE = r"""\documentclass[10pt]{article}
\usepackage[a4paper,landscape,margin=15mm]{geometry}
\usepackage{amsmath}
\allowdisplaybreaks
\setlength{\parindent}{0pt}
\setcounter{MaxMatrixCols}{20}
\begin{document}"""

GENERAL = r"""\[ A_i = T_{i(i+1)} = R_z(\theta_i)\, t_z(d_i)\, t_x(a_i)\, R_x(\alpha_i)
= \begin{bmatrix}
\cos\theta_i & -\sin\theta_i\cos\alpha_i & \sin\theta_i\sin\alpha_i & a_i\cos\theta_i \\
\sin\theta_i & \cos\theta_i\cos\alpha_i & -\cos\theta_i\sin\alpha_i & a_i\sin\theta_i \\
0 & \sin\alpha_i & \cos\alpha_i & d_i \\
0 & 0 & 0 & 1
\end{bmatrix} \]"""

CRAIGS = r"""\[ A_i = T_{i(i+1)} = R_x(\alpha_i)\, t_x(a_i)\, R_z(\theta_i)\, t_z(d_i)
= \begin{bmatrix}
\cos\theta_i & -\sin\theta_i & 0 & a_i \\
\sin\theta_i\cos\alpha_i & \cos\theta_i\cos\alpha_i & -\sin\alpha_i & -d_i\sin\alpha_i \\
\sin\theta_i\sin\alpha_i & \cos\theta_i\sin\alpha_i & \cos\alpha_i & d_i\cos\alpha_i \\
0 & 0 & 0 & 1
\end{bmatrix} \]"""

FRAMES = r"""The joint of row $i$ turns about, or slides along, $z_i$. The origin $o_i$ is where
$z_i$ meets $z_{i-1}$, or where their common normal ends; $x_i$ is orthogonal to both axes;
$y_i = z_i \times x_i$."""


def explanation_latex(e: Explanation) -> str:
    """Return a document that explains the chain."""
    parts = [PREAMBLE, _heading(e), r'\subsection*{Steps 1 to 4: the frames}', FRAMES, _frames(e),
             r'\subsection*{Step 5: the Denavit-Hartenberg table}', _table(e),
             CRAIGS if e.chain.convention == 'modified' else GENERAL]
    parts += [_symbols(e)] if e.symbols else []
    parts += [_link(e, step) for step in e.steps]
    parts += [r'\subsection*{Step 6: multiply}', _equation('T_{01} = A_{0}', e.steps[0].T_0)]
    parts += [_equation(f'T_{{0{i + 1}}} = T_{{0{i}}} A_{{{i}}}', step.T_0)
              for i, step in enumerate(e.steps[1:], start=1)]
    parts += [_equation(f'T_{{{e.root}0}}', e.T_root_0)]
    parts += [_equation(_indexed(name), T) for name, T in e.tips]
    factors = [f'T_{{{e.root}0}}', f'T_{{0{len(e.steps)}}}', *(_indexed(n) for n, _ in e.tips)]
    parts += [_equation(f'T_{{{e.root}{e.tip}}} = {" ".join(factors)}', e.T_root_tip)]
    parts += [] if e.q is None else [_words(closing_sentence(e))]
    parts += [*map(_words, out_of_range_notes(e)), r'\end{document}']
    return '\n\n'.join(parts)


def _heading(e: Explanation) -> str:
    chain = e.chain
    title = f'{chain.name} {chain.version}: the transform'
    lines = [rf'\section*{{{_words(title)} $T_{{{e.root}{e.tip}}}$}}',
             rf'{e.root} is \texttt{{{_words(chain.root_frame)}}}, {e.tip} is '
             rf'\texttt{{{_words(chain.tip_frame)}}}. Lengths are mm.']
    if e.source:
        lines.append(f'Table from: {_words(e.source)}.')
    if e.q is not None:
        values = [f'{name} {position_text(link, value)}' for name, link, value
                  in zip(chain.joint_names, chain.joints, e.q, strict=True)]
        lines.append(f'Joint positions: {_words(", ".join(values))}.')
    return '\n'.join(lines)


def _frames(e: Explanation) -> str:
    rows = []
    reasons = [origin_reason(e, i) for i in range(len(e.steps) + 1)]
    reasons += [f'as {name} has it' for name, _ in e.tips]
    for (i, T), reason in zip(e.frames.items(), reasons, strict=True):
        vectors = [f'$({", ".join(short(value) for value in T[:3, column])})$'
                   for column in (2, 3, 0, 1)]
        rows.append(' & '.join([f'${i}$', *vectors, _formula_words(reason)]) + r' \\')
    where = _words(e.chain.root_frame)
    at = 'at $q = 0$' if e.q is None else 'at these positions'
    return '\n'.join([
        r'\begin{center}', r'\begin{tabular}{llllll}',
        rf'$i$ & $z_i$ & $o_i$ & $x_i$ & $y_i$ & in \texttt{{{where}}}, {at} \\ \hline',
        *rows, r'\end{tabular}', r'\end{center}'])


def _table(e: Explanation) -> str:
    rows = []
    for i, a, d, alpha, theta, joint in table_rows(e):
        cells = (i, a, d, alpha, theta.replace('->', r'\rightarrow'))
        rows.append(' & '.join([*(f'${_formula(cell)}$' for cell in cells), _words(joint)])
                    + r' \\')
    errata = [rf'* Range of $i = {step.row.index}$: {_words(step.row.link.erratum)}.\\'
              for step in e.steps if step.row.link.erratum]
    return '\n'.join([
        r'\begin{center}', r'\begin{tabular}{llllll}',
        r'Link $i$ & $a_i$ (mm) & $d_i$ (mm) & $\alpha_i$ (rad) & $\theta_i$ (deg) & joint \\',
        r'\hline', *rows, r'\end{tabular}', r'\end{center}', *errata])


def _symbols(e: Explanation) -> str:
    defined = [f'${symbol_latex(name)} = {cell_words(meaning, LATEX)}$'
               for name, meaning in defined_symbols(e)]
    return (r'In what follows $c_i = \cos\theta_i$ and $s_i = \sin\theta_i$, with '
            + ', '.join(defined) + '.')


def _link(e: Explanation, step: Step) -> str:
    i = step.row.index
    values = r' \quad '.join(_formula(value) for value in link_values(e, step))
    factors = ' '.join(_matrix(factor) for factor in step.factors)
    return '\n'.join([
        rf'\paragraph{{{_words(step.row.joint or "fixed")}}} ${values}$',
        rf'\begin{{align*}} A_{{{i}}} = T_{{{i}{i + 1}}} &= {factors} \\',
        f'&= {_matrix(step.A)}', r'\end{align*}'])


def _equation(name: str, T: Matrix) -> str:
    """Return a matrix after its name, or its entries one by one if it is too wide."""
    matrix = _matrix(T)
    if max(map(len, matrix.splitlines())) <= WIDE:
        return rf'\[ {name} = {matrix} \]'
    lines = []
    for names, column in zip(COLUMN_NAMES, zip(*T[:3], strict=True), strict=True):
        for cell, value in zip(names, column, strict=True):
            first, *rest = filled(terms(value, LATEX), LINE)
            lines += [rf'{_indexed(cell)} &= {first} \\',
                      *(rf'&\quad {line} \\' for line in rest)]
    return '\n'.join([rf'\[ {name}: \]', r'\begin{align*}', *lines, r'\end{align*}'])


def _matrix(T: Matrix) -> str:
    rows = [' & '.join(cell_words(cell, LATEX) for cell in row) for row in T]
    return r'\begin{bmatrix}' + '\n' + ' \\\\\n'.join(rows) + '\n' + r'\end{bmatrix}'


def _indexed(name: str) -> str:
    letter, _, index = name.partition('_')
    return f'{letter}_{{{index}}}'


def _formula(text: str) -> str:
    """Turn `alpha_1 = -pi/2` into LaTeX's words for it."""
    text = re.sub(r'_(\w+)', r'_{\1}', text.replace(' deg', r'^\circ'))
    return re.sub(r'(?<!\\)\b(theta|alpha|pi)(?=\b|_)', r'\\\1 ', text)


def _formula_words(text: str) -> str:
    """Turn `z_3 parallel to z_2` into words with formulas."""
    return re.sub(r'\b([zT])_(\w+)', r'$\1_{\2}$', text)


def _words(text: str) -> str:
    return ''.join(ESCAPES.get(letter, letter) for letter in text)
