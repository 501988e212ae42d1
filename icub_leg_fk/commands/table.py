"""`leg_fk table`: the Denavit-Hartenberg tables of a robot from its URDF, as a kinematics file."""

import argparse
from functools import partial
from pathlib import Path
import sys
import tempfile

from icub_leg_fk.errors import CatalogError, LegFKError
from icub_leg_fk.kinematics import Catalog, Chain, chain_from_urdf, Urdf
from icub_leg_fk.kinematics.difference import difference, postures
from icub_leg_fk.kinematics.table_from_urdf import almost_parallel
from icub_leg_fk.tools import options
from icub_leg_fk.tools.kinematics_file_text import kinematics_file_text, one_line
from icub_leg_fk.tools.output_file import check_target, write_text

EXAMPLES = """\
Carries out the documented method on a URDF: z axes, origins, x axes, y axes, DH parameters,
product. Each tip becomes a chain; the file has joint names, limits as ranges, T_Ro0, rows, T_nIs
and frame ids. It ends with a comparison of the file with the URDF multiplied out.

examples:
  leg_fk table icub.urdf --root root_link --tips l_sole r_sole -o my_icub.yaml
  leg_fk table panda.urdf --root panda_link0 --tips panda_link8 --convention modified
  leg_fk pose l_sole -k my_icub.yaml --degrees 0 10 0 -30 -15 5
  leg_fk explain l_sole -k my_icub.yaml"""

_SAMPLES = 1000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('urdf', metavar='ROBOT.urdf', help='the URDF; of a xacro file make one '
                        'first: xacro FILE > robot.urdf')
    parser.add_argument('--root', metavar='LINK', required=True, help='link to start from')
    parser.add_argument('--tips', metavar='LINK', nargs='+', required=True,
                        help='links below it, a chain each')
    parser.add_argument('--name', metavar='NAME', nargs='+',
                        help='names of the chains (default: those of the tips)')
    parser.add_argument('--convention', metavar='{standard,modified}', default='standard',
                        choices=('standard', 'modified'),
                        help="of the table: standard (the default), or modified, which is Craig's")
    parser.add_argument('--tolerance', metavar='RAD', default=1e-4,
                        type=options.number_between(0, 0.1, '0 to 0.1 rad'),
                        help='angle between axes up to which they are taken as parallel, since '
                             'URDFs are rounded (default: 1e-4); what it costs is reported')
    options.add_output(parser, 'file to write (default: standard output)')


def run(args: argparse.Namespace) -> int:
    """Write the kinematics file."""
    if args.output is not None:
        check_target(args.output, force=args.force)
    urdf = Urdf.load(args.urdf)
    chains = []
    for name, tip in zip(_names(args), args.tips, strict=True):
        chains.append(chain_from_urdf(urdf, args.root, tip, name=name, convention=args.convention,
                                      tolerance=args.tolerance))
    source = one_line(Path(urdf.file).name)
    text = kinematics_file_text(chains, [
        f'Denavit-Hartenberg tables of {one_line(urdf.name) or "a robot"}, made by `leg_fk table` '
        f'from {source}.',
        f'Axes that are {args.tolerance:g} rad apart or less were taken as parallel.'])
    written = _read_back(text, args.urdf)
    lines = []
    for chain in chains:
        lines += _report(written.chain(chain.name), urdf, args.tolerance)
    write_text(args.output, text, force=args.force)
    if args.output is not None:
        names = ', '.join(chain.name for chain in chains)
        lines.insert(0, f'{args.output}: {names}')
    print('\n'.join(lines), file=sys.stderr if args.output is None else sys.stdout)
    return 0


def _names(args: argparse.Namespace) -> list[str]:
    names = args.name or list(args.tips)
    if len(names) != len(args.tips) or len(set(names)) != len(names):
        raise LegFKError(f'--name: {", ".join(names)}; allowed: {len(args.tips)} different names, '
                         'one per tip')
    return names


def _read_back(text: str, urdf_file: str) -> Catalog:
    """Return the catalog of the file that is to be written."""
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, 'table.yaml')
        file.write_text(text, encoding='utf-8')
        try:
            return Catalog.load(file)
        except CatalogError as error:
            raise LegFKError(f'{urdf_file}: cannot be written as a kinematics file: '
                             f'{error.fault}') from error


def _report(chain: Chain, urdf: Urdf, tolerance: float) -> list[str]:
    """Return how far a written chain is from its URDF, and what was done to it."""
    root, tip = chain.root_frame, chain.frame_id
    found = difference(chain.forward, partial(urdf.forward, root, tip),
                       postures(chain, _SAMPLES))
    lines = [f'{chain.name}: {chain.n} joint{"s" * (chain.n != 1)}; largest difference from the '
             f'URDF in {_SAMPLES} postures: {found.mm:.4f} mm, {found.deg:.4f} deg']
    for one, two, angle in almost_parallel(urdf, root, tip, tolerance):
        lines.append(f'  taken as parallel: the axes of {one} and {two}, {angle:.1g} rad apart')
    added = len(chain.links) - chain.n
    if added > 0:
        lines.append(f'  {added} fixed rows between axes that are almost parallel')
    return lines
