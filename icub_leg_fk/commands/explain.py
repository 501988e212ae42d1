"""`leg_fk explain`: how the pose of a chain follows from its Denavit-Hartenberg table."""

import argparse
from dataclasses import replace

from icub_leg_fk.kinematics import Catalog, Chain
from icub_leg_fk.kinematics.difference import difference, postures
from icub_leg_fk.kinematics.table_from_urdf import TIDY
from icub_leg_fk.tools import options
from icub_leg_fk.tools.explanation import explain
from icub_leg_fk.tools.explanation_json import as_json
from icub_leg_fk.tools.explanation_latex import as_latex
from icub_leg_fk.tools.explanation_text import as_text

EXAMPLES = """\
Without joint positions the answer is a formula in q_0, q_1, ... Lengths are mm, as in printed
tables. The table of a URDF is tidied as by leg_fk table, and what that costs is reported.

examples:
  leg_fk explain left_leg --degrees 0 10 0 -30 -15 5
  leg_fk explain left_leg
  leg_fk explain head_imu=v2 --degrees 0 0 0 30 0 45 --symbolic
  leg_fk explain arm -k cylindrical_arm.yaml --latex > arm.tex
  leg_fk explain left_leg -k icub.urdf"""

_SAMPLES = 1000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    options.add(
        parser, 'chain', '--version', '--foot-frame', '--kinematics-file', '--root'
    )
    options.add_joint_positions(parser, required=False)
    parser.add_argument(
        '--symbolic',
        action='store_true',
        help='exact numbers instead of decimals: pi/2, not 1.5708 (by sympy)',
    )
    form = parser.add_mutually_exclusive_group()
    form.add_argument('--latex', action='store_true', help='print a LaTeX document')
    options.add(form, '--json')


def run(args: argparse.Namespace) -> int:
    """Print the explanation."""
    chain = _chain_for_people(args)
    explanation = explain(
        chain, options.joint_positions(args, chain), exact=args.symbolic
    )
    if args.json:
        print(as_json(explanation))
    elif args.latex:
        print(as_latex(explanation))
    else:
        print(as_text(explanation))
    return 0


def _chain_for_people(args: argparse.Namespace) -> Chain:
    """Return the chain; that of a URDF with a tidied table, whose source has what that costs."""
    catalog = options.load_catalog(args, tolerance=TIDY)
    chain = catalog.chain(args.chain, args.version, args.foot_frame)
    exact = Catalog.load(args.kinematics_file, root=args.root).chain(
        chain.name, chain.version, chain.frame
    )
    if chain == exact:
        return chain
    found = difference(chain.forward, exact.forward, postures(chain, _SAMPLES))
    cost = f'at most {found.mm:.4f} mm, {found.deg:.4f} deg in {_SAMPLES} postures'
    return replace(chain, source=f'{chain.source}, tidied, which costs {cost}')
