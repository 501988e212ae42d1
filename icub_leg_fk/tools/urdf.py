"""`leg_fk urdf`: chains as a URDF."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from icub_leg_fk.errors import LegFKError, UnknownNameError
from icub_leg_fk.tools.chain_arguments import (
    add_chain_version,
    add_kinematics_file,
    DEFAULT_VERSION,
    load_catalog,
    own_versions,
)

if TYPE_CHECKING:
    from icub_leg_fk.kinematics import Catalog
    from icub_leg_fk.tools.urdf_model import Selection

HELP = 'write chains as a URDF, for RViz, Pinocchio and others'
EXAMPLES = """\
The URDF has the frames of the tables, both tip frames where a chain has two, the joint names, and
as limits the ranges: the robots' where they are known, else the printed ones. Every chain hangs
from the root frame, which the chains must share.

examples:
  leg_fk urdf -o legs.urdf
  leg_fk urdf left_leg --version v1
  leg_fk urdf left_leg right_leg head_imu --chain-version head_imu=v2 -o icub.urdf
  leg_fk urdf -k my_robot.yaml --version v1 --name my_robot"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('chains', metavar='CHAIN', nargs='*',
                        help='chains to write (default: all that have the version asked for)')
    parser.add_argument('--version', metavar='VERSION', default=DEFAULT_VERSION,
                        help='version of every chain that has none of its own (default: v2_5)')
    add_chain_version(parser)
    parser.add_argument('--name', help='name of the robot (default: icub, or that of your file)')
    parser.add_argument('-o', '--output', metavar='FILE',
                        help='file to write (default: standard output)')
    parser.add_argument('--force', action='store_true', help='replace an existing file')
    add_kinematics_file(parser)


def run(args: argparse.Namespace) -> int:
    """Write the URDF."""
    from icub_leg_fk.tools.urdf_model import urdf_text

    catalog = load_catalog(args)
    selections = _selections(catalog, args)
    robot = args.name or ('icub' if args.kinematics_file is None else Path(catalog.file).stem)
    if not robot.isprintable():
        raise LegFKError(f'--name: found {robot!r}, allowed: printable text')
    text = urdf_text(robot, selections)
    if args.output:
        from icub_leg_fk.tools.output_file import write_text
        write_text(args.output, text, force=args.force)
    else:
        print(text, end='')
    return 0


def _selections(catalog: Catalog, args: argparse.Namespace) -> list[Selection]:
    from icub_leg_fk.tools.urdf_model import Selection

    for name in args.chains:
        catalog.entry(name)
    versions = own_versions(args, args.chains or list(catalog.chains))
    names = list(dict.fromkeys(args.chains)) or [
        name for name, entry in catalog.chains.items()
        if name in versions or args.version in entry.versions]
    if not names:
        known = dict.fromkeys(version for entry in catalog.chains.values()
                              for version in entry.versions)
        raise UnknownNameError('version', args.version, known)
    selections = []
    for name in names:
        chain = catalog.chain(name, versions.get(name, args.version))
        selections.append(Selection(catalog.entry(name), chain.version))
    return selections
