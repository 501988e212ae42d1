"""`leg_fk explain`: how the pose of a chain follows from its Denavit-Hartenberg table."""

import argparse
import math
from typing import Any

from icub_leg_fk.tools import options, text
from icub_leg_fk.tools.explain_document import as_latex, as_text
from icub_leg_fk.tools.explain_steps import Cell, Explanation, Matrix, Step, work_out

EXAMPLES = """\
Without joint positions the answer is a formula in q_i. Lengths are mm, as in printed tables.

examples:
  leg_fk explain left_leg --degrees 0 10 0 -30 -15 5
  leg_fk explain left_leg
  leg_fk explain head_imu --version v2 --degrees 0 0 0 30 0 45 --symbolic
  leg_fk explain arm -k cylindrical_arm.yaml --version v1 --latex > arm.tex"""


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
    catalog, chain = options.load_chain(args)
    version = catalog.entry(chain.name).versions[chain.version]
    e = work_out(version, chain, args.foot_frame, options.joint_positions(args, chain),
                 args.symbolic)
    print(text.as_json(_as_json(e)) if args.json else as_latex(e) if args.latex else as_text(e))
    return 0


def _as_json(e: Explanation) -> dict[str, Any]:
    """Return the explanation for programs; lengths in mm, angles in rad."""
    chain = e.chain
    return {
        'chain': chain.name, 'version': chain.version, 'source': e.source,
        'root_frame': chain.root_frame, 'tip_frame': chain.tip_frame,
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
        'running_products': [_matrix(step.T_0) for step in e.steps],
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
