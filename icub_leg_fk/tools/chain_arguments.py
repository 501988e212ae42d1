"""The options that subcommands share: a chain, its version, joint positions, a kinematics file."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import math
import sys
from typing import TYPE_CHECKING

from icub_leg_fk.errors import JointVectorError, LegFKError

if TYPE_CHECKING:
    from icub_leg_fk.kinematics import Catalog, Chain

DEFAULT_VERSION = 'v2_5'
LARGEST = 1e9  # of a joint position; beyond it a float's last turn is lost anyway


def add_kinematics_file(parser: argparse.ArgumentParser) -> None:
    """Add `-k`, `--kinematics-file`."""
    parser.add_argument(
        '-k', '--kinematics-file', metavar='FILE',
        help='a kinematics file of your own, with the DH tables of any robot (default: the '
             "iCub's, as shipped)")


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add `--json`."""
    parser.add_argument('--json', action='store_true', help='print JSON, for programs')


def add_chain(parser: argparse.ArgumentParser) -> None:
    """Add the chain, `--version`, `--foot-frame` and the kinematics file."""
    chain = parser.add_argument(
        'chain', metavar='CHAIN',
        help='a chain of the kinematics file, such as left_leg (see leg_fk list)')
    version = parser.add_argument(
        '--version', metavar='VERSION',
        help='version of the chain (default: v2_5, if the chain has it)')
    # What argcomplete offers in the shell.
    setattr(chain, 'completer', _known_chains)  # noqa: B010
    setattr(version, 'completer', _known_versions)  # noqa: B010
    add_foot_frame(parser)
    add_kinematics_file(parser)


def _known_chains(parsed_args: argparse.Namespace, **_: object) -> list[str]:
    return [*_catalog_so_far(parsed_args).chains]


def _known_versions(parsed_args: argparse.Namespace, **_: object) -> list[str]:
    return [*dict.fromkeys(version for entry in _catalog_so_far(parsed_args).chains.values()
                           for version in entry.versions)]


def _catalog_so_far(parsed_args: argparse.Namespace) -> Catalog:
    from icub_leg_fk.kinematics import Catalog

    return Catalog.load(getattr(parsed_args, 'kinematics_file', None))


def add_foot_frame(parser: argparse.ArgumentParser) -> None:
    """Add `--foot-frame`."""
    parser.add_argument('--foot-frame', metavar='FRAME',
                        help="axes of the tip: of the iCub's feet dh, the table's last frame, or "
                             "sole, x forward, y left, z up (default: the chain's first tip "
                             'frame)')


def add_chain_version(parser: argparse.ArgumentParser) -> None:
    """Add `--chain-version`, which `own_versions` reads."""
    parser.add_argument('--chain-version', metavar='CHAIN=VERSION', action='append', default=[],
                        type=_chain_version, help='version of one chain; may stand several times')


def own_versions(args: argparse.Namespace, chains: Sequence[str]) -> dict[str, str]:
    """Return the versions given by `--chain-version`, for chains that may have one."""
    versions: dict[str, str] = {}
    for chain, version in args.chain_version:
        if chain not in chains or chain in versions:
            raise LegFKError(f'--chain-version: found {chain}{" again" * (chain in versions)}, '
                             f'allowed: {", ".join(chains)}, each once')
        versions[chain] = version
    return versions


def _chain_version(text: str) -> tuple[str, str]:
    chain, _, version = text.strip().partition('=')
    if not (chain and version):
        raise argparse.ArgumentTypeError(f'found {text.strip()!r}, allowed: CHAIN=VERSION')
    return chain, version


def add_joint_positions(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add `--degrees` and `--radians`, of which at most one may be given."""
    group = parser.add_mutually_exclusive_group(required=required)
    for unit in ('degrees', 'radians'):
        group.add_argument(
            f'--{unit}', metavar='Q', nargs='+', type=_finite_number,
            help=f'joint positions in {unit}, root to tip; of a prismatic joint always in metres')


def number(text: str) -> float:
    """Return the number that a text is; NaN if it is none."""
    try:
        return float(text) if text.isascii() and '_' not in text else math.nan
    except ValueError:
        return math.nan


def number_between(low: float, high: float, unit: str = '') -> Callable[[str], float]:
    """Return what reads an option that is a number from one to another, both included."""
    def parse(text: str) -> float:
        value = number(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f'found {text.strip()!r}, allowed: {low:g} to {high:g}{unit}')
        return value
    return parse


def _finite_number(text: str) -> float:
    value = number(text)
    if not abs(value) <= LARGEST:
        raise argparse.ArgumentTypeError(f'found {text.strip()!r}, allowed: finite numbers up to '
                                         f'{LARGEST:g}, one per joint')
    return value


def chosen_version(catalog: Catalog, chain: str, version: str | None) -> str:
    """Return the version asked for, or else the default one if the chain has that."""
    versions = catalog.entry(chain).versions
    if version is None and DEFAULT_VERSION not in versions:
        raise LegFKError(f'chain {chain} has no version {DEFAULT_VERSION}, the default: give '
                         f'--version; known: {", ".join(versions)}')
    return DEFAULT_VERSION if version is None else version


def load_catalog(args: argparse.Namespace) -> Catalog:
    """Return the catalog that `-k` names; what it warns of is said on stderr."""
    from icub_leg_fk.kinematics import Catalog

    catalog = Catalog.load(args.kinematics_file)
    for line in catalog.warnings:
        print(f'leg_fk: warning: {line}', file=sys.stderr)
    return catalog


def load_chain(args: argparse.Namespace) -> tuple[Catalog, Chain]:
    """Return the catalog and the chain that the options of `add_chain` name."""
    catalog = load_catalog(args)
    version = chosen_version(catalog, args.chain, args.version)
    return catalog, catalog.chain(args.chain, version, args.foot_frame)


def joint_positions(args: argparse.Namespace, chain: Chain) -> list[float] | None:
    """Return the joint vector given by `--degrees` or `--radians` [rad or m]; None if none is."""
    given: Sequence[float] | None = args.radians if args.degrees is None else args.degrees
    if given is None:
        return None
    if len(given) != chain.n:
        raise JointVectorError(
            f'joint positions: found {len(given)}, allowed: {chain.n}, in the order '
            f'{" ".join(chain.joint_names)}')
    if args.degrees is None:
        return list(given)
    return [value if link.is_prismatic else math.radians(value)
            for value, link in zip(given, chain.joints, strict=True)]
