"""`leg_fk explain` as JSON: decimals as numbers, exact entries as sympy writes them."""

from __future__ import annotations

import math
from typing import Any

from icub_leg_fk.tools.explaining.steps import Cell, Explanation, Matrix, Step
from icub_leg_fk.tools.text import json_text


def explanation_json(e: Explanation) -> str:
    """Return the explanation; lengths in mm, angles in rad."""
    chain = e.chain
    return json_text({
        'chain': chain.name,
        'version': chain.version,
        'source': e.source,
        'root_frame': chain.root_frame,
        'tip_frame': chain.tip_frame,
        'units': {'length': 'mm', 'angle': 'rad'},
        'convention': chain.convention,
        'joints': list(chain.joint_names),
        'joint_positions': None if e.q is None else [
            1000 * value if link.is_prismatic else value
            for value, link in zip(e.q, chain.joints, strict=True)],
        'symbols': {name: str(meaning) for name, meaning in e.symbols.items()},
        'frames': [{'origin': T[:3, 3].tolist(), 'x': T[:3, 0].tolist(), 'y': T[:3, 1].tolist(),
                    'z': T[:3, 2].tolist()} for T in (frame + 0.0 for frame in e.frames.values())],
        'frame_names': list(e.frames),
        'links': [_link(step, chain.convention) for step in e.steps],
        'running_products': [_matrix(step.T_0) for step in e.steps],
        'T_root_0': _matrix(e.T_root_0),
        'after_last_link': {name: _matrix(T) for name, T in e.tips},
        'T_root_tip': _matrix(e.T_root_tip),
    })


def _link(step: Step, convention: str) -> dict[str, Any]:
    names = (('Rx', 'tx', 'Rz', 'tz') if convention == 'modified'
             else ('Rz', 'tz', 'tx', 'Rx'))
    link = step.row.link
    scale = 1000 if link.is_prismatic else 1
    lower, upper = link.limits
    return {
        'i': step.row.index,
        'joint': step.row.joint or None,
        'joint_type': link.joint_type if step.row.joint else 'fixed',
        'range': [scale * lower, scale * upper] if math.isfinite(lower) else None,
        'erratum': link.erratum,
        'theta': _cell(step.theta), 'd': _cell(step.d), 'a': _cell(step.a),
        'alpha': _cell(step.alpha),
        'factors': {name: _matrix(factor) for name, factor
                    in zip(names, step.factors, strict=True)},
        'A': _matrix(step.A),
    }


def _matrix(T: Matrix) -> list[list[float]] | list[list[str]]:
    """Return a matrix of numbers, or one of expressions if any entry is one."""
    if all(isinstance(cell, (int, float)) for row in T for cell in row):
        return [[float(cell) + 0.0 for cell in row] for row in T]
    return [[str(cell) for cell in row] for row in T]


def _cell(cell: Cell) -> float | str:
    return cell + 0.0 if isinstance(cell, (int, float)) else str(cell)
