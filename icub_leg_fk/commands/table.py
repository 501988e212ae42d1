"""`leg_fk table`: the Denavit-Hartenberg tables of a robot from its URDF, as a kinematics file."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
import sys
import tempfile

from icub_leg_fk.errors import CatalogError, InputFileError, LegFKError
from icub_leg_fk.kinematics import Catalog, Chain, Urdf
from icub_leg_fk.kinematics.difference import difference, postures
from icub_leg_fk.kinematics.table_from_urdf import almost_parallel, as_modified, TIDY
from icub_leg_fk.tools import options
from icub_leg_fk.tools.kinematics_file_text import kinematics_file_text, one_line
from icub_leg_fk.tools.output_file import check_target, STANDARD_OUTPUT, write_text

EXAMPLES = """\
Carries out the documented method on a URDF: z axes, origins, x axes, y axes, DH parameters,
product. Of an iCub it writes the legs and the head's sensor; of any robot a chain for each link
that --tips names. The table is tidied for people, and what that costs is reported: the file is
compared with the URDF multiplied out. To compute exactly, use the URDF itself: -k ROBOT.urdf.

examples:
  leg_fk table icub.urdf -o my_icub.yaml
  leg_fk table panda.urdf --root panda_link0 --tips panda_link8 --convention modified
  leg_fk pose left_leg -k my_icub.yaml --degrees 0 10 0 -30 -15 5
  leg_fk explain left_leg -k my_icub.yaml"""

_SAMPLES = 1000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        'urdf',
        metavar='ROBOT.urdf',
        help='the URDF; of a xacro file make one first: xacro FILE > robot.urdf',
    )
    options.add(parser, '--root')
    parser.add_argument(
        '--tips',
        metavar='LINK',
        nargs='+',
        help="links to write a chain for (default: the iCub's legs and head, as "
        'far as the robot has them)',
    )
    parser.add_argument(
        '--name',
        metavar='NAME',
        nargs='+',
        help='names of the chains (default: those of the tips)',
    )
    parser.add_argument(
        '--convention',
        metavar='{standard,modified}',
        default='standard',
        choices=('standard', 'modified'),
        help="of the table: standard (the default), or modified, which is Craig's",
    )
    parser.add_argument(
        '--tolerance',
        metavar='RAD',
        default=TIDY,
        type=options.number_between(0, 0.1, '0 to 0.1 rad'),
        help='what is this near to parallel or to a right angle is taken as such, '
        'since URDFs are rounded (default: 1e-4); 0 for an exact table',
    )
    options.add_output(parser, 'file to write (default: standard output)')


def run(args: argparse.Namespace) -> int:
    """Write the kinematics file."""
    is_printed = args.output in (None, STANDARD_OUTPUT)
    if not is_printed:
        check_target(args.output, force=args.force)
    urdf = Urdf.load(args.urdf)
    catalog = Catalog.from_urdf(urdf, root=args.root, tolerance=args.tolerance)
    for line in catalog.warnings:
        print(f'leg_fk: warning: {line}', file=sys.stderr)
    chains = _chains(catalog, args)
    text = kinematics_file_text(chains, _comments(urdf, args.tolerance))
    written = _read_back(text, args.urdf)
    lines = []
    for chain in chains:
        lines += _report(written.chain(chain.name), urdf, args.tolerance)
    write_text(args.output, text, force=args.force)
    if not is_printed:
        names = ', '.join(chain.name for chain in chains)
        lines.insert(0, f'{args.output}: {names}')
    print('\n'.join(lines), file=sys.stderr if is_printed else sys.stdout)
    return 0


def _chains(catalog: Catalog, args: argparse.Namespace) -> list[Chain]:
    tips = args.tips or list(catalog.known())
    if not tips:
        options.refuse_no_chains(catalog)
        raise InputFileError(
            args.urdf,
            "has none of the iCub's chains; give --tips, such as "
            f'{" ".join(catalog.chains)}',
        )
    chains = []
    for name, tip in zip(_names(args.name, tips), tips, strict=True):
        chain = replace(catalog.chain(tip), name=name)
        chains.append(as_modified(chain) if args.convention == 'modified' else chain)
    return chains


def _names(names: Sequence[str] | None, tips: Sequence[str]) -> Sequence[str]:
    chosen = names or tips
    if len(chosen) != len(tips) or len(set(chosen)) != len(chosen):
        raise LegFKError(
            f'--name: {", ".join(chosen)}; allowed: {len(tips)} different names, one '
            'per tip'
        )
    return chosen


def _comments(urdf: Urdf, tolerance: float) -> list[str]:
    robot, file = one_line(urdf.name) or 'a robot', one_line(Path(urdf.file).name)
    comments = [
        f'Denavit-Hartenberg tables of {robot}, made by `leg_fk table` from {file}.'
    ]
    if tolerance:
        comments.append(
            f'What is within {tolerance:g} rad of parallel or of a right angle was '
            'taken as such.'
        )
    return comments


def _read_back(text: str, urdf_file: str) -> Catalog:
    """Return the catalog of the file that is to be written."""
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, 'table.yaml')
        file.write_text(text, encoding='utf-8')
        try:
            return Catalog.load(file)
        except CatalogError as error:
            raise InputFileError(
                urdf_file, f'cannot be written as a kinematics file: {error.fault}'
            ) from error


def _report(chain: Chain, urdf: Urdf, tolerance: float) -> list[str]:
    """Return how far a written chain is from its URDF, and what was done to it."""
    root, positions = chain.root_frame, postures(chain, _SAMPLES)
    found = []
    for frame, tip_frame in chain.tip_frames.items():
        robot = partial(urdf.forward, root, tip_frame.frame_id)
        found.append(difference(chain.with_frame(frame).forward, robot, positions))
    mm, deg = max(row.mm for row in found), max(row.deg for row in found)
    frames = ', '.join(chain.tip_frames)
    lines = [
        f'{chain.name} (frames: {frames}): {chain.n} joint{"s" * (chain.n != 1)}; largest '
        f'difference from the URDF in {_SAMPLES} postures: {mm:.4f} mm, {deg:.4f} deg'
    ]
    for one, two, angle in almost_parallel(urdf, root, chain.frame_id, tolerance):
        lines.append(
            f'  taken as parallel: the axes of {one} and {two}, {angle:.1g} rad apart'
        )
    added = sum(link.is_fixed for link in chain.links)
    if added:
        lines.append(
            f'  {added} fixed row{"s" * (added != 1)} between axes that are almost '
            'parallel'
        )
    return lines
