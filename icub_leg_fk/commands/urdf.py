"""`leg_fk urdf`: chains as a URDF."""

import argparse
from pathlib import Path

from icub_leg_fk.errors import LegFKError, UnknownNameError
from icub_leg_fk.kinematics import Catalog, Chain
from icub_leg_fk.tools import options
from icub_leg_fk.tools.output_file import write_text
from icub_leg_fk.tools.urdf_text import urdf_text

EXAMPLES = """\
The URDF has the frames of the tables, both tip frames where a chain has two, the joint names, and
as limits the ranges: the robots' where they are known, else the printed ones. Every chain hangs
from the root frame, which the chains must share.

examples:
  leg_fk urdf -o legs.urdf
  leg_fk urdf left_leg=v1
  leg_fk urdf left_leg right_leg head_imu=v2 -o icub.urdf
  leg_fk urdf -k my_robot.yaml --name my_robot"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    options.add(parser, 'chains')
    parser.add_argument(
        '--name',
        metavar='NAME',
        help='name of the robot (default: icub, or that of your file)',
    )
    options.add(parser, '--version', '--kinematics-file', '--root')
    options.add_output(parser, 'file to write (default: standard output)')


def run(args: argparse.Namespace) -> int:
    """Write the URDF."""
    catalog = options.load_catalog(args)
    name = _robot_name(catalog, args)
    chains = _chosen_chains(catalog, args)
    write_text(args.output, urdf_text(name, chains), force=args.force)
    if args.output not in (None, '-'):
        written = ', '.join(f'{chain.name}={chain.version}' for chain in chains)
        print(f'{args.output}: robot {name} with {written}')
    return 0


def _robot_name(catalog: Catalog, args: argparse.Namespace) -> str:
    if args.name is None:
        return 'icub' if args.kinematics_file is None else Path(catalog.file).stem
    if not args.name or not args.name.isprintable():
        raise LegFKError(f'--name is {args.name!r}; allowed: printable text')
    return str(args.name)


def _chosen_chains(catalog: Catalog, args: argparse.Namespace) -> tuple[Chain, ...]:
    """Return the chains asked for; if none is, all that have the version asked for."""
    if args.chains:
        return catalog.select(args.chains, args.version)
    options.refuse_no_chains(catalog)
    first = next(iter(catalog.chains))
    version = args.version or catalog.chain(first).version
    names = [
        name for name, entry in catalog.chains.items() if version in entry.versions
    ]
    if not names:
        versions = [
            known for entry in catalog.chains.values() for known in entry.versions
        ]
        raise UnknownNameError('version', version, dict.fromkeys(versions))
    return catalog.select(names, version)
