"""An explanation for programs, as JSON has it: lengths in mm, angles in rad."""

import math
from typing import Any

from icub_leg_fk.tools import text
from icub_leg_fk.tools.explanation import ExplainedRow, Explanation, unit
from icub_leg_fk.tools.explanation_symbols import Cell, Matrix
import numpy as np


def as_json(e: Explanation) -> str:
    """Return the explanation as JSON; exact numbers and formulas are strings that sympy reads."""
    chain = e.chain
    positions = None
    if e.q is not None:
        positions = [unit(link) * value for link, value in zip(chain.joints, e.q)]
    return text.as_json(
        {
            'chain': chain.name,
            'version': chain.version,
            'source': chain.source,
            'root_frame': chain.root_frame,
            'frame_id': chain.frame_id,
            'units': {'length': 'mm', 'angle': 'rad'},
            'convention': chain.convention,
            'joints': list(chain.joint_names),
            'joint_positions': positions,
            'symbols': {name: str(meaning) for name, meaning in e.symbols.items()},
            'frames': [_frame(T) for T in e.frames.values()],
            'frame_names': list(e.frames),
            'links': [_link(row) for row in e.rows],
            'running_products': [_matrix(T) for T in e.products],
            'T_root_0': _matrix(e.T_root_0),
            'after_last_link': {name: _matrix(T) for name, T in e.tips.items()},
            'T_root_tip': _matrix(e.T_root_tip),
        }
    )


def _frame(T: Matrix) -> dict[str, list[float]]:
    x, y, z, origin = (T[:3] + 0.0).T.tolist()  # no negative zeros
    return {'x': x, 'y': y, 'z': z, 'origin': origin}


def _link(row: ExplainedRow) -> dict[str, Any]:
    link = row.link
    return {
        'i': row.index,
        'joint': row.row.joint or None,
        'joint_type': link.joint_type,
        'range': _range(row, link.limits),
        'printed_range': _range(row, (link.lower, link.upper)),
        'erratum': link.erratum,
        'theta': _cell(row.theta),
        'd': _cell(row.d),
        'a': _cell(row.a),
        'alpha': _cell(row.alpha),
        'factors': {name: _matrix(T) for name, T in row.factors.items()},
        'A': _matrix(row.A),
    }


def _range(row: ExplainedRow, limits: tuple[float, float]) -> list[float | None] | None:
    """Return the limits of a row's joint, None for one that there is not."""
    if not row.row.is_first or limits == (-math.inf, math.inf):
        return None
    return [
        unit(row.link) * limit if math.isfinite(limit) else None for limit in limits
    ]


def _matrix(T: Matrix) -> list[list[float | str]]:
    cells = T + 0.0 if isinstance(T, np.ndarray) else np.array(T).astype(str)
    return cells.tolist()  # type: ignore[no-any-return]


def _cell(cell: Cell) -> float | str:
    return cell + 0.0 if isinstance(cell, float) else str(cell)
