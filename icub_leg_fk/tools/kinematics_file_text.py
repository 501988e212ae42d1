"""Chains as the text of a kinematics file, in mm and degrees, every digit of them."""

from collections.abc import Sequence
import json
import math
import re

from icub_leg_fk.kinematics import Chain, Row, TipFrame
from icub_leg_fk.kinematics.chain_text import short
from icub_leg_fk.kinematics.rotation import Array
import numpy as np

_PLAIN = re.compile(r'[A-Za-z_][A-Za-z0-9_./-]*')


def kinematics_file_text(chains: Sequence[Chain], comments: Sequence[str]) -> str:
    """Return chains as a kinematics file.

    Args:
        chains: the chains, with different names.
        comments: what stands at the top, a line each.
    """
    lines = [f'# {comment}' for comment in comments]
    lines += ['', 'units: {length: mm, angle: deg}', '', 'chains:']
    for chain in chains:
        lines += ['', *_chain_lines(chain)]
    return '\n'.join(lines) + '\n'


def one_line(text: str) -> str:
    """Return text as it may stand in a comment or a description."""
    return re.sub(r'[^ -!#-\[\]-~]', '_', text)[:200]


def _chain_lines(chain: Chain) -> list[str]:
    joints = ', '.join(_quoted(name) for name in chain.joint_names)
    lines = [
        f'  {_quoted(chain.name)}:',
        f'    tip: {chain.tip}',
        f'    root_frame: {_quoted(chain.root_frame)}',
        f'    joints: [{joints}]',
        '    tip_frames:',
    ]
    for name, tip_frame in chain.tip_frames.items():
        lines += _tip_frame_lines(name, tip_frame)
    lines += ['    versions:', f'      {_quoted(chain.version)}:']
    if chain.source:
        lines.append(f'        source: "{one_line(chain.source)}"')
    if chain.convention == 'modified':
        lines.append('        convention: modified')
    lines += ['        T_Ro0:', *_matrix_lines(chain.T_root_0, 10)]
    lines += ['        links:', *_row_lines(chain.rows())]
    lines += ['        T_nIs:', *_matrix_lines(chain.T_n_tip, 10)]
    return lines


def _tip_frame_lines(name: str, tip_frame: TipFrame) -> list[str]:
    name, frame_id = _quoted(name), _quoted(tip_frame.frame_id)
    is_plain = (
        np.array_equal(tip_frame.T_tip_frame, np.eye(4)) and tip_frame.outline is None
    )
    if is_plain:
        return [f'      {name}: {{frame: {frame_id}}}']
    lines = [
        f'      {name}:',
        f'        frame: {frame_id}',
        '        transform:',
        *_matrix_lines(tip_frame.T_tip_frame, 10),
    ]
    if tip_frame.outline is not None:
        corners = [
            f'[{short(1000 * x, 10)}, {short(1000 * y, 10)}]'
            for x, y in tip_frame.outline.tolist()
        ]
        lines.append(f'        outline: [{", ".join(corners)}]')
    return lines


def _row_lines(rows: Sequence[Row]) -> list[str]:
    """Return the rows, their cells under each other."""
    cells = [
        (
            short(1000 * row.link.a, 10),
            short(1000 * row.link.d, 10),
            short(math.degrees(row.link.alpha), 13),
            short(math.degrees(row.link.offset), 13),
            _more(row),
        )
        for row in rows
    ]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = []
    for a, d, alpha, offset, more in cells:
        lines.append(
            f'          - {{a: {a:>{widths[0]}}, d: {d:>{widths[1]}}, '
            f'alpha: {alpha:>{widths[2]}}, offset: {offset:>{widths[3]}}{more}}}'
        )
    return lines


def _more(row: Row) -> str:
    """Return what a row has besides its four numbers."""
    link = row.link
    more = ''
    if row.is_first and link.has_limits:
        scale = 1000.0 if link.is_prismatic else 180 / math.pi
        lower, upper = (short(scale * limit, 9) for limit in link.limits)
        more += f', range: [{lower}, {upper}]'
    if link.joint_type != 'revolute':
        more += f', type: {link.joint_type}'
    if link.gain != 1.0:
        more += f', gain: {link.gain:.17g}'
    if link.joint:
        more += f', joint: {_quoted(link.joint)}'
    return more


def _matrix_lines(T: Array, indent: int) -> list[str]:
    rows = []
    for row in T.tolist():
        rows.append(
            [*(short(value, 16) for value in row[:3]), short(1000 * row[3], 10)]
        )
    rows[3][3] = '1'
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        padded = [cell.rjust(width) for cell, width in zip(row, widths, strict=True)]
        lines.append(f'{" " * indent}- [{", ".join(padded)}]')
    return lines


def _quoted(name: str) -> str:
    """Return a name, in quotes if YAML needs them."""
    return name if _PLAIN.fullmatch(name) else json.dumps(name, ensure_ascii=False)
