"""What subcommands share: options by their names, and the chains and joint positions they mean."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import math
import sys
from typing import Any, TYPE_CHECKING

from icub_leg_fk.errors import JointVectorError, LegFKError

if TYPE_CHECKING:
    from icub_leg_fk.kinematics import Catalog, Chain

LARGEST = 1e9  # of a joint position; beyond it a float's last turn is lost anyway


_OPTIONS: dict[str, dict[str, Any]] = {
    'chain': {'metavar': 'CHAIN', 'help': 'a chain, such as left_leg or left_leg=v1 (leg_fk list shows '
              'them)'},
    '--chains': {'metavar': 'CHAIN', 'nargs': '+', 'help': 'chains, such as left_leg or head_imu=v2 (default: both '
                 'legs)'},
    '--version': {'metavar': 'VERSION', 'help': "of the tables (default: the file's)"},
    '--foot-frame': {'metavar': 'FRAME',
                     'help': "axes of the tip: of the iCub's feet dh, the table's last frame (the "
                             'default), or sole, x forward, y left, z up'},
    '--joint-topic': {'metavar': 'TOPIC', 'help': "the bag's topic of joint states (default: "
                      '/joint_states, or the only one there is)'},
    '--json': {'action': 'store_true', 'help': 'print JSON, for programs'},
    '--kinematics-file': {'metavar': 'FILE', 'help': 'a kinematics file, with the DH tables of '
                          "any robot (default: the iCub's, as shipped)"},
    '--force': {'action': 'store_true', 'help': 'replace what exists already'}}


def add(parser: argparse._ActionsContainer, *names: str) -> None:
    """Add shared options."""
    for name in names:
        flags = ('-k', name) if name == '--kinematics-file' else (name,)
        action = parser.add_argument(*flags, **_OPTIONS[name])
        if name in _COMPLETERS:
            setattr(action, 'completer', _COMPLETERS[name])  # noqa: B010 (it is argcomplete's)


_COMPLETERS: dict[str, Callable[..., list[str]]] = {
    'chain': lambda parsed_args, **_: [*load_catalog(parsed_args).chains],
    '--chains': lambda parsed_args, **_: [*load_catalog(parsed_args).chains],
    '--version': lambda parsed_args, **_: [*dict.fromkeys(
        version for entry in load_catalog(parsed_args).chains.values()
        for version in entry.versions)]}


def add_output(parser: argparse.ArgumentParser, purpose: str) -> None:
    """Add `--output` and `--force`."""
    parser.add_argument('-o', '--output', metavar='FILE', help=purpose)
    add(parser, '--force')


def add_joint_positions(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add `--degrees` and `--radians`, of which at most one may be given."""
    group = parser.add_mutually_exclusive_group(required=required)
    for unit in ('degrees', 'radians'):
        group.add_argument(
            f'--{unit}', metavar='Q', nargs='+', type=_joint_position,
            help=f'joint positions in {unit}, root to tip; of a prismatic joint always in metres')


def number(text: str) -> float:
    """Return the number that a text is; NaN if it is none."""
    try:
        return float(text) if text.isascii() and '_' not in text else math.nan
    except ValueError:
        return math.nan


def number_between(low: float, high: float, allowed: str = '') -> Callable[[str], float]:
    """Return what reads an option that is a number from one to another, both included."""
    def parse(text: str) -> float:
        value = number(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f'found {text.strip()!r}, allowed: '
                                             f'{allowed or f"{low:g} to {high:g}"}')
        return value
    return parse


_joint_position = number_between(-LARGEST, LARGEST, f'finite numbers up to {LARGEST:g}, one per '
                                 'joint')


def load_catalog(args: argparse.Namespace) -> Catalog:
    """Return the catalog that `-k` names; what it warns of is said on stderr."""
    from icub_leg_fk.kinematics import Catalog

    catalog = Catalog.load(args.kinematics_file)
    for line in catalog.warnings:
        print(f'leg_fk: warning: {line}', file=sys.stderr)
    return catalog


def load_chain(args: argparse.Namespace) -> tuple[Catalog, Chain]:
    """Return the catalog, and the chain that its options name."""
    catalog = load_catalog(args)
    return catalog, catalog.chain(args.chain, args.version, args.foot_frame)


def joint_positions(args: argparse.Namespace, chain: Chain) -> list[float] | None:
    """Return the joint vector given by `--degrees` or `--radians` [rad or m]; None if none is."""
    given: Sequence[float] | None = args.radians if args.degrees is None else args.degrees
    if given is None:
        return None
    if len(given) != chain.n:
        raise JointVectorError('joint positions', f'are {len(given)}', f'{chain.n}, in the order '
                               f'{" ".join(chain.joint_names)}')
    return [value if args.degrees is None or link.is_prismatic else math.radians(value)
            for value, link in zip(given, chain.joints, strict=True)]
