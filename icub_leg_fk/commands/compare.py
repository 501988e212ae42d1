"""`leg_fk compare`: which version of the tables a robot is, and how far off, by its URDF."""

import argparse
from collections.abc import Sequence
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
from icub_leg_fk.tools import options, text

EXAMPLES = """\
For each chain and version whose joints and frames the URDF has: how far the table's tip is from
the robot's frame of that name, at random joint positions within +-1.2 rad. "Fitted" is what is
left after the best constant transforms at root and tip: a frame that is only moved or turned
fits, a different leg does not.

examples:
  leg_fk compare icub.urdf
  leg_fk compare icub.urdf --chains left_leg right_leg
  leg_fk compare icub.urdf --json"""

_SAMPLES = 400
_REACH = 1.2  # rad or m
_NEAR = 1.0  # mm or deg; so near a table is the robot
_USABLE = 10.0  # mm
_FEWEST_JOINTS = 3  # for constants at both ends to be told from the joints


class Comparison(NamedTuple):
    """A table's tip beside a robot's frame of that name.

    Attributes:
        chain: the table, in the frame that is compared.
        direct: how far they are apart, after a pure turn of the tip's axes.
        turn: that turn, in words; empty if there is none.
        fitted: how far they are apart after the best constants at both ends; None if the joints
            are too few to tell.
        root_turn: how the robot's root frame is turned from the table's, in words.
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
    parser.add_argument('--chains', metavar='CHAIN', nargs='+',
                        help='chains to compare (default: all whose joints the robot has)')
    options.add(parser, '--kinematics-file', '--json')


def run(args: argparse.Namespace) -> int:
    """Print the comparison."""
    catalog, urdf = options.load_catalog(args), Urdf.load(args.urdf)
    names = args.chains or list(catalog.chains)
    found = []
    for table in _tables(catalog, names):
        found += compared(table, urdf)
    if not found:
        joints = ', '.join(joint.name for joint in urdf.joints[:12])
        raise InputFileError(args.urdf, 'has the joints and frames of none of '
                             f'{", ".join(names)}; its joints are {joints or "none"}')
    nearest = _nearest_of_each_chain(found)
    advice = [_advice(row, args.urdf) for row in nearest]
    if args.json:
        rows = [_as_json(row, row in nearest) for row in found]
        print(text.as_json({'urdf': args.urdf, 'robot': urdf.name, 'advice': advice,
                            'differences': rows}))
        return 0
    print(f'{args.urdf} ({urdf.name}) beside the tables of {catalog.file}')
    print(f'{_SAMPLES} postures within +-{_REACH} rad; largest (mean) difference\n')
    header = ('chain', 'version', 'frame', 'mm', 'deg', 'fitted mm', 'fitted deg', '')
    cells = [_cells(row, row in nearest) for row in found]
    print('\n'.join(text.columns(cells, header=header)))
    print()
    print('\n'.join(advice))
    return 0


def compared(table: Chain, urdf: Urdf) -> list[Comparison]:
    """Return how far a table is from a robot, for each of its tip frames that the robot has.

    The constants that fit best are those of the first frame: another frame of the same body only
    moves them.
    """
    rows: list[Comparison] = []
    positions = postures(table, _SAMPLES, _REACH, whole_range=False)
    fitted, root_turn = None, ''
    for frame in table.tip_frames:
        chain = table.with_frame(frame)
        if not _has(urdf, chain):
            continue
        ours = chain.forward(positions)
        theirs = urdf.forward(chain.root_frame, chain.frame_id, positions)
        if not rows and chain.n >= _FEWEST_JOINTS:
            X, Y = fit(ours, theirs)
            fitted = distance(X @ ours @ Y, theirs)
            root_turn = turn_in_words(X[:3, :3])
        turn = turn_of_axes(ours, theirs)
        rows.append(Comparison(chain, distance(ours @ turn, theirs),
                               turn_in_words(turn[:3, :3]), fitted, root_turn))
    return rows


def _tables(catalog: Catalog, names: Sequence[str]) -> list[Chain]:
    tables: list[Chain] = []
    for name in names:
        tables += catalog.entry(name).versions.values()
    return tables


def _has(urdf: Urdf, chain: Chain) -> bool:
    """Return whether a robot has all joints of a chain between its root and tip frames."""
    if not {chain.root_frame, chain.frame_id} <= {*urdf.links}:
        return False
    try:
        path = urdf.path(chain.root_frame, chain.frame_id)
    except InputFileError:
        return False
    return {*chain.joint_names} <= {joint.name for joint in path}


def _nearest_of_each_chain(rows: Sequence[Comparison]) -> list[Comparison]:
    nearest: dict[str, Comparison] = {}
    for row in rows:
        best = nearest.setdefault(row.chain.name, row)
        if row.score < best.score:
            nearest[row.chain.name] = row
    return list(nearest.values())


def _advice(row: Comparison, file: str) -> str:
    chain, direct, fitted = row.chain, row.direct, row.fitted
    off = f'{_short(direct.mm)} mm'
    if direct.deg > 0.1:
        off += f' and {_short(direct.deg)} deg'
    but = f'; its tip has axes turned by {row.turn}' if row.turn else ''
    own = f'leg_fk table {file} --root {chain.root_frame} --tips {chain.frame_id}'
    if direct.mm <= _NEAR and direct.deg <= _NEAR:
        return f'{chain.name}: use {chain.version}, which is this robot to {off}{but}'
    if fitted and fitted.mm <= _NEAR and fitted.deg <= _NEAR and row.root_turn:
        return (f'{chain.name}: {chain.version} is this robot to {_short(fitted.mm)} mm, but its '
                f'root frame is turned by {row.root_turn}; make your own: {own}')
    if direct.mm <= _USABLE:
        return (f'{chain.name}: {chain.version} is nearest, to {off}{but}; for the rest make your '
                f'own table: {own}')
    why = ''
    if fitted and fitted.deg > _NEAR:
        why = ', and it is another mechanism'
    elif fitted and fitted.mm <= 0.2 * direct.mm:
        why = f', most of it a shift of its ends ({_short(fitted.mm)} mm fitted)'
    return (f'{chain.name}: no table is nearer than {_USABLE:g} mm; {chain.version} is {off} off'
            f'{why}{but}; make your own: {own}')


def _short(value: float) -> str:
    return f'{value:.0f}' if value >= 10 else f'{value:.2g}'


def _cells(row: Comparison, is_nearest: bool) -> list[str]:
    chain, direct, fitted = row.chain, row.direct, row.fitted
    marks = []
    if is_nearest:
        marks.append('<- nearest')
    if row.turn:
        marks.append(f'axes turned by {row.turn}')
    fits = ['too few joints'] * 2
    if fitted:
        fits = [f'{fitted.mm:.3f} ({fitted.mean_mm:.3f})',
                f'{fitted.deg:.3f} ({fitted.mean_deg:.3f})']
    return [chain.name, chain.version, chain.frame_id, f'{direct.mm:.3f} ({direct.mean_mm:.3f})',
            f'{direct.deg:.3f} ({direct.mean_deg:.3f})', *fits, ', '.join(marks)]


def _as_json(row: Comparison, is_nearest: bool) -> dict[str, Any]:
    mm, deg = _pairs(row.direct)
    fitted_mm, fitted_deg = _pairs(row.fitted) if row.fitted else (None, None)
    return {
        'chain': row.chain.name, 'version': row.chain.version,
        'root_frame': row.chain.root_frame, 'frame': row.chain.frame_id, 'mm': mm, 'deg': deg,
        'turn': row.turn, 'fitted_mm': fitted_mm, 'fitted_deg': fitted_deg,
        'root_turn': row.root_turn, 'nearest': is_nearest}


def _pairs(found: Difference) -> tuple[dict[str, float], dict[str, float]]:
    return ({'largest': found.mm, 'mean': found.mean_mm},
            {'largest': found.deg, 'mean': found.mean_deg})
