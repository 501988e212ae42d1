"""`leg_fk compare`: which version of the tables a robot is, and how far off, by its URDF."""

import argparse
from collections.abc import Iterable, Mapping, Sequence
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
  leg_fk compare icub.urdf --root base_link
  leg_fk compare icub.urdf --json"""

_SAMPLES = 400
_REACH = 1.2  # rad or m
_NEAR = 1.0  # mm or deg; so near a table is the robot
_USABLE = 10.0  # mm
_WIDTH = 80
_FEWEST_JOINTS = 3  # for constants at both ends to be distinguished from the joints
_NODE = 'ros2 run icub_leg_fk foot_pose_publisher --ros-args'
_HEADER = ('chain', 'frame', 'mm', 'deg', 'fit mm', 'fit deg', '')


class FrameComparison(NamedTuple):
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
    parser.add_argument(
        '--root',
        dest='robot_root',
        metavar='LINK',
        help="the robot's link that the tables' root frame is compared with (default: the one "
        'of its name)',
    )
    options.add(parser, '--kinematics-file', '--json')


def run(args: argparse.Namespace) -> int:
    """Print the comparison."""
    catalog, urdf = options.load_catalog(args), Urdf.load(args.urdf)
    if args.robot_root is not None:
        urdf.check_link(args.robot_root)
    robot = _Robot(urdf, args.robot_root)
    found, not_compared = _compare_all(catalog, args.chains or catalog.chains, robot)
    nearest = _nearest_of_each_chain(found)
    advice = [_summary(row, found) for row in nearest]
    advice += [*not_compared, *_what_to_run(nearest, robot, args)]
    if args.json:
        comparison = {
            'urdf': args.urdf,
            'robot': urdf.name,
            'advice': advice,
            'differences': [_as_json(row, row in nearest) for row in found],
        }
        print(text.as_json(comparison))
        return 0
    print(f'{args.urdf} ({urdf.name}) compared with the tables of')
    print(f'{catalog.file}')
    print(f'{_SAMPLES} postures within +-{_REACH} rad; largest difference\n')
    rows = [_cells(row, row in nearest) for row in found]
    print(*text.columns(rows, header=_HEADER), sep='\n')
    print()
    for line in advice:
        is_command = line.startswith('  ')
        print(
            line if is_command else textwrap.fill(line, _WIDTH, subsequent_indent='  ')
        )
    return 0


class _Robot(NamedTuple):
    """A robot that tables are compared with, and which of its links is their root frame."""

    urdf: Urdf
    named_root: str | None

    def root(self, chain: Chain) -> str:
        return self.named_root or chain.root_frame

    def lacks(self, chain: Chain) -> str:
        """Return what of a chain the robot lacks; nothing if it can be compared."""
        ends = self.root(chain), chain.frame_id
        for link in ends:
            if link not in self.urdf.links:
                return f'the robot has no link {link}'
        try:
            path = self.urdf.path(*ends)
        except InputFileError as error:
            return error.fault
        on_the_way = {joint.name for joint in path} | {joint.moved_by for joint in path}
        missing = [name for name in chain.joint_names if name not in on_the_way]
        if not missing:
            return ''
        return (
            f'between {" and ".join(ends)} the robot has no joint {", ".join(missing)}'
        )

    def forward(self, chain: Chain, positions: Mapping[str, Array]) -> Array:
        """Return the robot's own transforms; what moves the chain's joints is moved along."""
        ends, moved = (self.root(chain), chain.frame_id), dict(positions)
        for joint in self.urdf.path(*ends):
            if joint.moves and joint.name in positions:
                master = (positions[joint.name] - joint.offset) / joint.gain
                moved.setdefault(joint.moved_by, master)
        return self.urdf.forward(*ends, moved)


def _compare_all(
    catalog: Catalog, names: Iterable[str], robot: _Robot
) -> tuple[list[FrameComparison], list[str]]:
    """Return the comparisons of some chains, and a sentence for each reason why others have none.

    Raises:
        InputFileError: no chain can be compared.
    """
    found: list[FrameComparison] = []
    names_by_reason: dict[str, list[str]] = {}
    for name in names:
        rows: list[FrameComparison] = []
        reasons: list[str] = []
        for table in _versions(catalog, name):
            lacks = {}
            for frame in table.tip_frames:
                lacks[frame] = robot.lacks(table.with_frame(frame))
            frames = [frame for frame, reason in lacks.items() if not reason]
            rows += _compare_frames(table, frames, robot)
            reasons += lacks.values()
        if not rows:
            names_by_reason.setdefault(reasons[0], []).append(name)
        found += rows
    not_compared = [
        f'{", ".join(names)}: not compared: {reason}'
        for reason, names in names_by_reason.items()
    ]
    if not found:
        raise InputFileError(
            robot.urdf.file,
            f'{"; ".join(not_compared)}; --root names another root link, and -k tables with '
            'the names of this robot, as leg_fk table makes them',
        )
    return found, not_compared


def _versions(catalog: Catalog, name: str) -> Iterable[Chain]:
    """Return a chain in all its versions, or in the one that is named with it."""
    chain, version = catalog.split(name)
    return [catalog.chain(name)] if version else catalog.entry(chain).versions.values()


def _compare_frames(
    table: Chain, frames: Sequence[str], robot: _Robot
) -> list[FrameComparison]:
    """Return how far a table is from a robot, for some of its tip frames.

    The constants that fit best are those of the first frame: another frame of the same body only
    moves them.
    """
    rows: list[FrameComparison] = []
    positions = postures(table, _SAMPLES, _REACH, whole_range=False)
    fitted, root_turn, X = None, '', np.eye(4)
    for frame in frames:
        chain = table.with_frame(frame)
        ours, theirs = chain.forward(positions), robot.forward(chain, positions)
        if not rows and chain.n >= _FEWEST_JOINTS:
            X, Y = fit(ours, theirs)
            fitted = distance(X @ ours @ Y, theirs)
            root_turn = turn_in_words(X[:3, :3]) if fitted.deg <= _NEAR else ''
        turn = turn_of_axes(X @ ours if root_turn else ours, theirs)
        direct, turned = distance(ours @ turn, theirs), turn_in_words(turn[:3, :3])
        rows.append(FrameComparison(chain, direct, turned, fitted, root_turn))
    return rows


def _nearest_of_each_chain(rows: Sequence[FrameComparison]) -> list[FrameComparison]:
    nearest: dict[str, FrameComparison] = {}
    for row in sorted(rows, key=lambda row: row.score):
        nearest.setdefault(row.chain.name, row)
    return [row for row in rows if row is nearest[row.chain.name]]


def _summary(row: FrameComparison, rows: Sequence[FrameComparison]) -> str:
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
    return f'{chain.name}: {words}{_other_axes(chain, rows)}'


def _other_axes(chain: Chain, rows: Sequence[FrameComparison]) -> str:
    """Return which frames of a version have other axes than the robot's of their name."""
    words = ''
    for other, _, turn, *_ in rows:
        if turn and _id(other) == _id(chain):
            words += f'; its {other.frame_id} has other axes, turned by {turn}'
    return words


def _id(chain: Chain) -> str:
    """Return a chain as it is named with its version."""
    return f'{chain.name}={chain.version}'


def _is_near(found: Difference) -> bool:
    return found.mm <= _NEAR and found.deg <= _NEAR


def _what_to_run(
    nearest: Sequence[FrameComparison], robot: _Robot, args: argparse.Namespace
) -> list[str]:
    """Return what to run for this robot, ready to paste."""
    chains = [row.chain for row in nearest]
    root = robot.root(chains[0])
    has_same_root = all(chain.root_frame == root for chain in chains)
    if has_same_root and all(_is_near(row.direct) for row in nearest):
        parameters = [f'chains:="[{", ".join(map(_id, chains))}]"']
        if args.kinematics_file:
            parameters.append(f'kinematics_file:={_absolute(args.kinematics_file)}')
        return ['The tables are this robot:', _node(*parameters)]
    of_node, of_table = [], ''
    shipped = Catalog.from_urdf(robot.urdf, root=root).known()
    if not {chain.name for chain in chains} <= {*shipped}:
        tips = [chain.frame_id for chain in chains]
        of_node = [f'chains:="[{", ".join(tips)}]"', f'root_frame:={shlex.quote(root)}']
        of_table = f' \\\n    --root {shlex.quote(root)} --tips {shlex.join(tips)}'
    output = shlex.quote(f'{Path(args.urdf).stem}.yaml')
    return [
        "To compute with the robot's own geometry, from its description, from this file, or "
        'from a table of it:',
        _node('description_from_topic:=true', *of_node),
        _node(f'kinematics_file:={_absolute(args.urdf)}', *of_node),
        f'  leg_fk table {shlex.quote(args.urdf)}{of_table} -o {output}',
    ]


def _node(*parameters: str) -> str:
    """Return the lines that start the node."""
    lines = [f'  {_NODE}', *(f'    -p {parameter}' for parameter in parameters)]
    return ' \\\n'.join(lines)


def _absolute(file: str) -> str:
    return shlex.quote(str(Path(file).absolute()))


def _short(value: float) -> str:
    if value < 0.001:
        return 'less than 0.001'
    return f'{value:.0f}' if value >= 10 else f'{value:.2g}'


def _cells(row: FrameComparison, is_nearest: bool) -> list[str]:
    fits = [row.fitted.mm, row.fitted.deg] if row.fitted else [None, None]
    numbers = [row.direct.mm, row.direct.deg, *fits]
    mark = '<- nearest' if is_nearest else ''
    return [_id(row.chain), row.chain.frame_id, *map(_number, numbers), mark]


def _number(value: float | None) -> str:
    if value is None:
        return ''
    return f'{value:.1f}' if value >= 10 else f'{value:.3f}'


def _as_json(row: FrameComparison, is_nearest: bool) -> dict[str, Any]:
    mm, deg = _pairs(row.direct)
    fitted_mm, fitted_deg = _pairs(row.fitted)
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


def _pairs(found: Difference | None) -> tuple[dict[str, float] | None, ...]:
    """Return millimetres and degrees, largest and mean of each."""
    if found is None:
        return None, None
    return (
        {'largest': found.mm, 'mean': found.mean_mm},
        {'largest': found.deg, 'mean': found.mean_deg},
    )
