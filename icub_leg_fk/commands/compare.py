"""`leg_fk compare`: which version of the tables a robot is, and how far off, by its URDF."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
import shlex
import textwrap
from typing import Any, NamedTuple

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics import Catalog, Chain, Urdf
from icub_leg_fk.kinematics.difference import (
    Difference,
    distance,
    fit,
    postures,
    turn_in_words,
    turn_of_axes,
)
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools import options, text
import numpy as np

EXAMPLES = """\
For each chain and version whose joints and frames the URDF has: how far the table's tip is from
the robot's frame of that name, at random joint positions within +-1.2 rad. "Fit" is what is left
after the best constant transforms at root and tip: a frame that is only moved or turned fits, a
different leg does not. The version that fits best is the nearest.

examples:
  leg_fk compare icub.urdf
  leg_fk compare icub.urdf --chains left_leg right_leg
  leg_fk compare icub.urdf --json"""

_SAMPLES = 400
_REACH = 1.2  # rad or m
_NEAR = 1.0  # mm or deg; so near a table is the robot
_USABLE = 10.0  # mm
_WIDTH = 80
_FEWEST_JOINTS = 3  # for constants at both ends to be distinguished from the joints
_NODE = 'ros2 run icub_leg_fk foot_pose_publisher --ros-args'
_HEADER = ('chain', 'version', 'frame', 'mm', 'deg', 'fit mm', 'fit deg', '')
_NUMBERS = range(3, 7)  # the columns of numbers


class Comparison(NamedTuple):
    """A table's tip compared with a robot's frame of that name.

    Attributes:
        chain: the table, in the frame that is compared.
        direct: how far they are apart, after a pure turn of the tip's axes.
        turn: that turn, in words; empty if there is none.
        fitted: how far they are apart after the best constants at both ends; None if the joints
            are too few to tell.
        root_turn: how the robot's root frame is turned from the table's, in words; empty if it is
            not, or if nothing fits.
    """

    chain: Chain
    direct: Difference
    turn: str
    fitted: Difference | None
    root_turn: str

    @property
    def score(self) -> float:
        """What is smallest for the version nearest to the robot."""
        best = self.fitted or self.direct
        return round(best.mm + 5 * best.deg, 2)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('urdf', metavar='ROBOT.urdf', help='the URDF of the robot')
    parser.add_argument(
        '--chains',
        metavar='CHAIN',
        nargs='+',
        help='chains to compare (default: all whose joints the robot has)',
    )
    options.add(parser, '--kinematics-file', '--root', '--json')


def run(args: argparse.Namespace) -> int:
    """Print the comparison."""
    catalog, urdf = options.load_catalog(args), Urdf.load(args.urdf)
    found, not_compared = _compare_all(
        catalog, args.chains or list(catalog.chains), urdf
    )
    nearest = _nearest_of_each_chain(found)
    advice = [_summary(row, found) for row in nearest]
    advice += [
        f'{name}: not compared: {reason}' for name, reason in not_compared.items()
    ]
    advice += _what_to_run(nearest, urdf, args)
    if args.json:
        differences = [_as_json(row, row in nearest) for row in found]
        print(
            text.as_json(
                {
                    'urdf': args.urdf,
                    'robot': urdf.name,
                    'advice': advice,
                    'differences': differences,
                }
            )
        )
        return 0
    print(f'{args.urdf} ({urdf.name}) compared with the tables of')
    print(f'{catalog.file}')
    print(f'{_SAMPLES} postures within +-{_REACH} rad; largest difference\n')
    print('\n'.join(_table([_cells(row, row in nearest) for row in found])))
    print()
    for line in advice:
        is_command = line.startswith('  ')
        print(
            line if is_command else textwrap.fill(line, _WIDTH, subsequent_indent='  ')
        )
    return 0


def _compare_all(
    catalog: Catalog, names: Sequence[str], urdf: Urdf
) -> tuple[list[Comparison], dict[str, str]]:
    """Return the comparisons of some chains, and why the others are not compared, by name.

    Raises:
        InputFileError: no chain can be compared.
    """
    found: list[Comparison] = []
    not_compared: dict[str, str] = {}
    for name in names:
        rows, reason = _compare_chain(catalog, name, urdf)
        found += rows
        if not rows:
            not_compared[name] = reason
    if not found:
        reasons = '; '.join(
            f'{name}: {reason}' for name, reason in not_compared.items()
        )
        raise InputFileError(
            urdf.file,
            f'cannot be compared: {reasons}; -k takes tables with the '
            'names of this robot',
        )
    return found, not_compared


def _compare_chain(
    catalog: Catalog, name: str, urdf: Urdf
) -> tuple[list[Comparison], str]:
    """Return the comparisons of a chain's versions, and why there is none if there is none."""
    rows: list[Comparison] = []
    reasons: list[str] = []
    for table in _versions(catalog, name):
        frames = []
        for frame in table.tip_frames:
            reason = _lacks(urdf, table.with_frame(frame))
            reasons.append(reason)
            if not reason:
                frames.append(frame)
        rows += compared(table, frames, urdf)
    return rows, reasons[0]


def _versions(catalog: Catalog, name: str) -> list[Chain]:
    """Return a chain in all its versions, or in the one that is named with it."""
    chain, version = catalog.split(name)
    if version:
        return [catalog.chain(name)]
    return list(catalog.entry(chain).versions.values())


def compared(table: Chain, frames: Sequence[str], urdf: Urdf) -> list[Comparison]:
    """Return how far a table is from a robot, for some of its tip frames.

    The constants that fit best are those of the first frame: another frame of the same body only
    moves them.
    """
    rows: list[Comparison] = []
    positions = postures(table, _SAMPLES, _REACH, whole_range=False)
    fitted, root_turn, X = None, '', np.eye(4)
    for frame in frames:
        chain = table.with_frame(frame)
        ours = chain.forward(positions)
        theirs = urdf.forward(
            chain.root_frame, chain.frame_id, _for_masters(positions, chain, urdf)
        )
        if not rows and chain.n >= _FEWEST_JOINTS:
            X, Y = fit(ours, theirs)
            fitted = distance(X @ ours @ Y, theirs)
            root_turn = turn_in_words(X[:3, :3]) if fitted.deg <= _NEAR else ''
        turn = turn_of_axes(X @ ours if root_turn else ours, theirs)
        rows.append(
            Comparison(
                chain,
                distance(ours @ turn, theirs),
                turn_in_words(turn[:3, :3]),
                fitted,
                root_turn,
            )
        )
    return rows


def _for_masters(
    positions: Mapping[str, Array], chain: Chain, urdf: Urdf
) -> dict[str, Array]:
    """Return positions with those of other joints that move the chain's in the robot."""
    completed = dict(positions)
    for joint in urdf.path(chain.root_frame, chain.frame_id):
        if joint.moves and joint.name in positions and joint.moved_by not in positions:
            completed[joint.moved_by] = (
                positions[joint.name] - joint.offset
            ) / joint.gain
    return completed


def _lacks(urdf: Urdf, chain: Chain) -> str:
    """Return what of a chain a robot lacks; nothing if it can be compared."""
    for link in (chain.root_frame, chain.frame_id):
        if link not in urdf.links:
            return f'the robot has no link {link}'
    try:
        path = urdf.path(chain.root_frame, chain.frame_id)
    except InputFileError as error:
        return error.fault
    on_the_way = {joint.name for joint in path} | {joint.moved_by for joint in path}
    missing = [name for name in chain.joint_names if name not in on_the_way]
    if missing:
        return (
            f'between {chain.root_frame} and {chain.frame_id} the robot has no joint '
            f'{", ".join(missing)}'
        )
    return ''


def _nearest_of_each_chain(rows: Sequence[Comparison]) -> list[Comparison]:
    nearest: dict[str, Comparison] = {}
    for row in rows:
        best = nearest.setdefault(row.chain.name, row)
        if row.score < best.score:
            nearest[row.chain.name] = row
    return list(nearest.values())


def _summary(row: Comparison, rows: Sequence[Comparison]) -> str:
    """Return how near a robot's chain is to the nearest version of the tables."""
    chain, direct, fitted = row.chain, row.direct, row.fitted
    off = f'{_short(direct.mm)} mm'
    if direct.deg > 0.1:
        off += f' and {_short(direct.deg)} deg'
    if _is_near(direct):
        words = f'use {chain.version}, which is this robot to {off}'
    elif row.root_turn and fitted and fitted.mm <= _USABLE:
        words = (
            f"{chain.version} fits to {_short(fitted.mm)} mm, but the robot's root frame is "
            f'turned by {row.root_turn}'
        )
    elif direct.mm <= _USABLE:
        words = f'{chain.version} is nearest, to {off}'
    else:
        words = f'no table is nearer than {_USABLE:g} mm; {chain.version} is {off} off'
        if fitted and fitted.deg > _NEAR:
            words += ', and it is another mechanism'
        elif fitted and fitted.mm <= 0.2 * direct.mm:
            words += f', most of it a shift of its ends ({_short(fitted.mm)} mm fitted)'
    return f'{chain.name}: {words}{_other_axes(row, rows)}'


def _other_axes(row: Comparison, rows: Sequence[Comparison]) -> str:
    """Return which frames of a version have other axes than the robot's of their name."""
    words = ''
    for other in rows:
        is_same = (other.chain.name, other.chain.version) == (
            row.chain.name,
            row.chain.version,
        )
        if is_same and other.turn:
            words += (
                f'; its {other.chain.frame_id} has other axes, turned by {other.turn}'
            )
    return words


def _is_near(found: Difference) -> bool:
    return found.mm <= _NEAR and found.deg <= _NEAR


def _what_to_run(
    nearest: Sequence[Comparison], urdf: Urdf, args: argparse.Namespace
) -> list[str]:
    """Return what to run for this robot, ready to paste."""
    chains = [row.chain for row in nearest]
    if all(_is_near(row.direct) for row in nearest):
        named = ', '.join(f'{chain.name}={chain.version}' for chain in chains)
        file = ''
        if args.kinematics_file:
            file = f' -p kinematics_file:={_absolute(args.kinematics_file)}'
        return [
            'The tables are this robot:',
            f'  {_NODE} \\',
            f'    -p chains:="[{named}]"{file}',
        ]
    robot = Catalog.from_urdf(urdf)
    output = shlex.quote(f'{Path(args.urdf).stem}.yaml')
    node, table = '', ''
    if not {chain.name for chain in chains} <= {*robot.known()}:
        tips = [chain.frame_id for chain in chains]
        root = chains[0].root_frame
        node = f' -p chains:="[{", ".join(tips)}]" -p root_frame:={root}'
        table = f' --root {shlex.quote(root)} --tips {shlex.join(tips)}'
    return [
        "To compute with the robot's own geometry, from its description, from this file, or "
        'from a table of it:',
        f'  {_NODE} \\',
        f'    -p description_from_topic:=true{node}',
        f'  {_NODE} \\',
        f'    -p kinematics_file:={_absolute(args.urdf)}{node}',
        f'  leg_fk table {shlex.quote(args.urdf)}{table} -o {output}',
    ]


def _absolute(file: str) -> str:
    return shlex.quote(str(Path(file).resolve()))


def _short(value: float) -> str:
    if value < 0.001:
        return 'less than 0.001'
    return f'{value:.0f}' if value >= 10 else f'{value:.2g}'


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(_HEADER, *rows, strict=True)]
    lines = []
    for cells in (_HEADER, *rows):
        padded = [
            cell.rjust(width) if index in _NUMBERS else cell.ljust(width)
            for index, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        lines.append('  '.join(padded).rstrip())
    return lines


def _cells(row: Comparison, is_nearest: bool) -> list[str]:
    fits = ['-', '-']
    if row.fitted:
        fits = [_number(row.fitted.mm), _number(row.fitted.deg)]
    return [
        row.chain.name,
        row.chain.version,
        row.chain.frame_id,
        _number(row.direct.mm),
        _number(row.direct.deg),
        *fits,
        '<- nearest' if is_nearest else '',
    ]


def _number(value: float) -> str:
    return f'{value:.1f}' if value >= 10 else f'{value:.3f}'


def _as_json(row: Comparison, is_nearest: bool) -> dict[str, Any]:
    mm, deg = _pairs(row.direct)
    fitted_mm, fitted_deg = _pairs(row.fitted) if row.fitted else (None, None)
    return {
        'chain': row.chain.name,
        'version': row.chain.version,
        'root_frame': row.chain.root_frame,
        'frame': row.chain.frame_id,
        'mm': mm,
        'deg': deg,
        'turn': row.turn,
        'fitted_mm': fitted_mm,
        'fitted_deg': fitted_deg,
        'root_turn': row.root_turn,
        'nearest': is_nearest,
    }


def _pairs(found: Difference) -> tuple[dict[str, float], dict[str, float]]:
    return (
        {'largest': found.mm, 'mean': found.mean_mm},
        {'largest': found.deg, 'mean': found.mean_deg},
    )
