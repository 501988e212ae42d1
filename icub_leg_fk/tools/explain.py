"""`leg_fk explain`: how the pose of a chain follows from its Denavit-Hartenberg table."""

from __future__ import annotations

import argparse

from icub_leg_fk.tools.chain_arguments import (
    add_chain,
    add_joint_positions,
    joint_positions,
    load_chain,
)

HELP = 'explain a chain: DH table, each A_i, products, answer'
EXAMPLES = """\
Without joint positions the answer is a formula in q_i. Lengths are mm, as in printed tables.

examples:
  leg_fk explain left_leg --degrees 0 10 0 -30 -15 5
  leg_fk explain left_leg
  leg_fk explain head_imu --version v2 --degrees 0 0 0 30 0 45 --symbolic
  leg_fk explain arm -k cylindrical_arm.yaml --version v1 --latex > arm.tex"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_chain(parser)
    add_joint_positions(parser, required=False)
    parser.add_argument('--symbolic', action='store_true',
                        help='exact numbers instead of decimals: pi/2, not 1.5708 (needs sympy, '
                             'as do symbols)')
    form = parser.add_mutually_exclusive_group()
    form.add_argument('--latex', action='store_true', help='print a LaTeX document')
    form.add_argument('--json', action='store_true', help='print JSON, for programs')


def run(args: argparse.Namespace) -> int:
    """Print the explanation."""
    from icub_leg_fk.tools.explaining.steps import Algebra, Decimals, explanation

    catalog, chain = load_chain(args)
    q = joint_positions(args, chain)
    algebra: Algebra = Decimals()
    if args.symbolic or q is None:
        from icub_leg_fk.tools.explaining.symbolic import Exact
        algebra = Exact()
    e = explanation(catalog.entry(chain.name), chain, args.foot_frame, q, algebra)
    if args.json:
        from icub_leg_fk.tools.explaining.json_form import explanation_json as render
    elif args.latex:
        from icub_leg_fk.tools.explaining.latex import explanation_latex as render
    else:
        from icub_leg_fk.tools.explaining.text import explanation_text as render
    print(render(e))
    return 0
