"""What subcommands share: options by their names, and the chains and joint positions they mean."""

import argparse
from collections.abc import Callable, Iterable, Sequence
import math
from pathlib import Path
import sys
from typing import Any

from icub_leg_fk.errors import InputFileError, JointVectorError, LegFKError
from icub_leg_fk.kinematics import Catalog, Chain, ChainEntry
from icub_leg_fk.stream.configuration import Configuration, DEFAULT_FRAME, LEGS

LARGEST = 1e9  # of a joint position; beyond it a float's last turn is lost anyway


def add(parser: argparse._ActionsContainer, *names: str) -> None:
    """Add shared options."""
    for name in names:
        flags = ('-k', name) if name == '--kinematics-file' else (name,)
        action = parser.add_argument(*flags, **_OPTIONS[name])
        if name in _COMPLETERS:
            setattr(action, 'completer', _COMPLETERS[name])  # noqa: B010 (it is argcomplete's)


def add_output(parser: argparse.ArgumentParser, purpose: str) -> None:
    """Add `--output` and `--force`."""
    parser.add_argument('-o', '--output', metavar='FILE', help=purpose)
    add(parser, '--force')


def add_recording(parser: argparse.ArgumentParser) -> None:
    """Add what says which chains are looked for in recordings, and how they are read."""
    add(
        parser,
        '--chains',
        '--version',
        '--foot-frame',
        '--kinematics-file',
        '--description-from-topic',
        '--root',
        '--joint-topic',
        '--joint-prefix',
        '--time-unit',
    )


def add_joint_positions(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add `--degrees` and `--radians`, of which at most one may be given."""
    group = parser.add_mutually_exclusive_group(required=required)
    for unit in ('degrees', 'radians'):
        group.add_argument(
            f'--{unit}',
            metavar='Q',
            nargs='+',
            type=_joint_position,
            help=f'joint positions in {unit}, root to tip; of a prismatic joint always in metres',
        )


def path(text: str) -> str:
    """Return the path that a text is; an unset variable of the shell leaves an empty one."""
    if not text:
        raise argparse.ArgumentTypeError("found '', allowed: a path")
    return text


def number(text: str) -> float:
    """Return the number that a text is; NaN if it is none."""
    if not text.isascii() or '_' in text:
        return math.nan
    try:
        return float(text)
    except ValueError:
        return math.nan


def number_between(
    low: float, high: float, allowed: str = ''
) -> Callable[[str], float]:
    """Return what reads an option that is a number from one to another, both included."""

    def parse(text: str) -> float:
        value = number(text)
        if not low <= value <= high:
            numbers = allowed or f'{low:g} to {high:g}'
            raise argparse.ArgumentTypeError(f'found {text!r}, allowed: {numbers}')
        return value

    return parse


def load_catalog(args: argparse.Namespace, *, tolerance: float = 0.0) -> Catalog:
    """Return the catalog that `-k` names, with a line on stderr for each of its warnings.

    Args:
        args: the options.
        tolerance: of a URDF, angle up to which its tables are tidied for people [rad].
    """
    for option in ('kinematics_file', 'root', 'version', 'foot_frame'):
        if (
            getattr(args, option, None) == ''
        ):  # as an unset variable of the shell leaves it
            words = option.replace('_', '-')
            raise LegFKError(f'--{words} is empty; leave it out for its default')
    catalog = Catalog.load(
        args.kinematics_file, root=getattr(args, 'root', None), tolerance=tolerance
    )
    for line in catalog.warnings:
        print(f'leg_fk: warning: {line}', file=sys.stderr)
    return catalog


def refuse_no_chains(catalog: Catalog) -> None:
    """Refuse a URDF without chains."""
    if not catalog.chains:
        raise InputFileError(
            catalog.file, 'has no chain: no joint moves a link at its ends'
        )


def chosen_chain(args: argparse.Namespace) -> Chain:
    """Return the chain that the options name."""
    return load_catalog(args).chain(args.chain, args.version, args.foot_frame)


def chains_of_one_root(args: argparse.Namespace) -> list[Chain]:
    """Return the chains asked for, or both legs, or else all of the file."""
    return chains_of(load_catalog(args), args)


def chains_of(catalog: Catalog, args: argparse.Namespace) -> list[Chain]:
    """Return those chains of a catalog.

    Raises:
        LegFKError: there are none, or they have several root frames.
    """
    refuse_no_chains(catalog)
    legs = [name for name in LEGS if name in catalog.chains]
    names = args.chains or legs or list(catalog.chains)
    configuration = Configuration.checked(catalog, **settings_of(args, names))
    chains = configuration.chains
    roots = sorted({chain.root_frame for chain in chains})
    if len(roots) > 1:
        raise LegFKError(
            f'the chains have the root frames {", ".join(roots)}; allowed: chains of '
            'one root frame'
        )
    if args.foot_frame:
        print_notes([], configuration.notes)
    return list(chains)


def settings_of(args: argparse.Namespace, chains: Sequence[str]) -> dict[str, Any]:
    """Return what `Configuration.checked` takes, with the names of chains."""
    return {
        'chains': chains,
        'version': args.version or '',
        'joint_prefix': getattr(args, 'joint_prefix', ''),
        'foot_frame': args.foot_frame or DEFAULT_FRAME,
    }


def print_notes(warnings: Iterable[str], notes: Iterable[str]) -> None:
    """Print what a user should know of an input, each in a line on stderr."""
    for warning in warnings:
        print(f'leg_fk: warning: {warning}', file=sys.stderr)
    for note in notes:
        print(f'leg_fk: note: {note}', file=sys.stderr)


def joint_positions(args: argparse.Namespace, chain: Chain) -> list[float] | None:
    """Return the joint vector given by `--degrees` or `--radians` [rad or m]; None if none is."""
    given = args.degrees or args.radians
    if not given:
        return None
    if len(given) != chain.n:
        raise JointVectorError(
            'the joint vector',
            f'has {len(given)} entries',
            f'{chain.n}, in the order {" ".join(chain.joint_names)}',
        )
    if args.radians:
        _warn_of_degrees(chain, args.radians)
        return list(args.radians)
    positions = []
    for value, link in zip(args.degrees, chain.joints, strict=True):
        positions.append(value if link.is_prismatic else math.radians(value))
    return positions


def _joint_position(text: str) -> float:
    if ',' in text:
        raise argparse.ArgumentTypeError(
            f'found {text!r}; numbers are separated by spaces, and '
            'their decimals by a point'
        )
    return _position_in_bounds(text)


def _topic(text: str) -> str:
    if not text.startswith('/') or Path(text).exists():
        raise argparse.ArgumentTypeError(
            f'found {text!r}, allowed: a topic with a slash before it; what is to be read '
            'comes before this option'
        )
    return text


_position_in_bounds = number_between(
    -LARGEST, LARGEST, f'finite numbers up to {LARGEST:g}, one per joint'
)


def _warn_of_degrees(chain: Chain, q: list[float]) -> None:
    """Warn of angles [rad] that are outside their range and more than a turn."""
    outside = chain.out_of_range(q)
    doubtful = []
    for name, link, value in zip(chain.joint_names, chain.joints, q, strict=True):
        is_turns = not link.is_prismatic and abs(value) > 2 * math.pi
        if name in outside and is_turns:
            doubtful.append(f'{name} {value:g}')
    if doubtful:
        print(
            f'leg_fk: warning: positions look like degrees, for which there is --degrees: '
            f'{", ".join(doubtful)}',
            file=sys.stderr,
        )


def _complete_chain(
    prefix: str, parsed_args: argparse.Namespace, **_: Any
) -> list[str]:
    """Return the chains, or after an equals sign the versions of one."""
    catalog = load_catalog(parsed_args)
    name = prefix.rpartition('=')[0]
    if name in catalog.chains:
        return [f'{name}={version}' for version in catalog.chains[name].versions]
    return list(catalog.chains)


def _complete_version(parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Return the versions of the chains typed so far, or of all."""
    return [
        version for entry in _typed_chains(parsed_args) for version in entry.versions
    ]


def _complete_frame(parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Return the tip frames of the chains typed so far, or of all."""
    frames: list[str] = []
    for entry in _typed_chains(parsed_args):
        for chain in entry.versions.values():
            frames.extend(chain.tip_frames)
    return frames


def _typed_chains(args: argparse.Namespace) -> list[ChainEntry]:
    catalog = load_catalog(args)
    names = [getattr(args, 'chain', None), *(getattr(args, 'chains', None) or [])]
    chains = [catalog.split(name)[0] for name in names if name]
    typed = [catalog.chains[chain] for chain in chains if chain in catalog.chains]
    return typed or list(catalog.chains.values())


_COMPLETERS: dict[str, Callable[..., list[str]]] = {
    'chain': _complete_chain,
    'chains': _complete_chain,
    '--chains': _complete_chain,
    '--version': _complete_version,
    '--foot-frame': _complete_frame,
}

_OPTIONS: dict[str, dict[str, Any]] = {
    'chain': {
        'metavar': 'CHAIN',
        'help': 'a chain, such as left_leg or left_leg=v1 (leg_fk list shows them)',
    },
    'chains': {
        'metavar': 'CHAIN',
        'nargs': '*',
        'help': 'chains, such as left_leg or head_imu=v2 (default: all that have the version '
        'asked for, or if none is, that of the first chain)',
    },
    '--chains': {
        'metavar': 'CHAIN',
        'nargs': '+',
        'help': 'chains, such as left_leg or head_imu=v2 (default: both legs)',
    },
    '--version': {
        'metavar': 'VERSION',
        'help': "of the chains named without one (default: the file's)",
    },
    '--foot-frame': {
        'metavar': 'FRAME',
        'help': "axes of the tip: of the iCub's feet dh, the table's last frame (the default), "
        'or sole, x forward, y left, z up',
    },
    '--joint-topic': {
        'metavar': 'TOPIC',
        'nargs': '+',
        'dest': 'joint_topics',
        'default': (),
        'help': "the bag's topics of joint states (default: /joint_states, or the only one there "
        'is)',
    },
    '--joint-prefix': {
        'metavar': 'PREFIX',
        'default': '',
        'help': 'put before every joint name that is looked for, such as icub1/',
    },
    '--description-from-topic': {
        'metavar': 'TOPIC',
        'nargs': '?',
        'const': True,
        'default': False,
        'type': _topic,
        'help': "compute with the robot's own URDF, which a bag has (default TOPIC: "
        'robot_description, in the namespace of the joint states)',
    },
    '--time-unit': {
        'metavar': '{s,ms,us,ns}',
        'choices': ('s', 'ms', 'us', 'ns'),
        'default': '',
        'help': 'unit of the times in a CSV file (default: from their size and the header)',
    },
    '--json': {'action': 'store_true', 'help': 'print JSON, for programs'},
    '--kinematics-file': {
        'metavar': 'FILE',
        'help': 'a kinematics file, with the DH tables of any robot, or a URDF (default: the '
        'tables of the iCub, as shipped)',
    },
    'recordings': {
        'metavar': 'RECORDING',
        'nargs': '+',
        'type': path,
        'help': 'bag, CSV file or directory of yarpdatadumper',
    },
    '--root': {
        'metavar': 'LINK',
        'help': 'of a URDF, the link that poses are given in (default: root_link, or the top of '
        'the tree)',
    },
    '--force': {'action': 'store_true', 'help': 'replace what exists already'},
}
