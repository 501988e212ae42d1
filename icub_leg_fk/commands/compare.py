"""`leg_fk compare`: which version of the tables a robot is, and how far off, by its URDF."""

import argparse
from collections.abc import Sequence
from itertools import permutations, product
import math
from typing import Any, NamedTuple

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics import Chain, matrix_to_quaternion, Urdf
from icub_leg_fk.kinematics.rotation import angle_between, Array, turns_about
from icub_leg_fk.tools import options, text
import numpy as np

EXAMPLES = """\
For each chain and version whose joints and frames the URDF has: how far the table's tip is from
the robot's frame of that name, at random joint positions within +-1.2 rad. "Fitted" is what is
left after the best constant transforms at root and tip: a frame that is only shifted fits, a
different leg does not.

examples:
  leg_fk compare icub.urdf
  leg_fk compare icub.urdf --chains left_leg right_leg
  leg_fk compare icub.urdf --json"""

_SAMPLES = 400
_REACH = 1.2  # rad or m
_NEAR = 1.0  # mm; so near a table is the robot
_USABLE = 10.0  # mm
_FEWEST_JOINTS = 3  # for constants at both ends to be told from the joints
_ARM = 0.3  # m; weighs angles against lengths in the fit


class Difference(NamedTuple):
    """How far a table is from a robot: largest and mean distance and angle.

    The angle is counted after a pure turn of the tip's axes, which `turn` has in words; what is
    fitted is after the best constants, and None where the joints are too few to tell.
    """

    chain: str
    version: str
    root: str
    frame: str
    mm: tuple[float, float]
    deg: tuple[float, float]
    turn: str
    fitted_mm: tuple[float, float] | None
    fitted_deg: tuple[float, float] | None
    nearest: bool = False


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('urdf', metavar='ROBOT.urdf', help='the URDF of the robot')
    parser.add_argument('--chains', metavar='CHAIN', nargs='+',
                        help='chains to compare (default: all whose joints the robot has)')
    options.add(parser, '--kinematics-file', '--json')


def run(args: argparse.Namespace) -> int:
    """Print the comparison."""
    catalog, urdf = options.load_catalog(args), Urdf.load(args.urdf)
    for name in args.chains or ():
        catalog.entry(name)
    names = args.chains or list(catalog.chains)
    found = [difference(chain, urdf) for name in names
             for version, table in catalog.chains[name].versions.items()
             for frame in table.tip_frames
             for chain in [catalog.chain(name, version, frame)] if _has(urdf, chain)]
    if not found:
        joints = ', '.join(joint.name for joint in list(urdf.joints.values())[:12])
        raise InputFileError(f'{args.urdf}: has the joints and frames of no chain of '
                             f'{", ".join(names)}; its joints are {joints or "none"}')
    found = [row._replace(nearest=row is _nearest(found, row.chain)) for row in found]
    advice = [_advice(_nearest(found, name), args.urdf) for name in dict.fromkeys(
        row.chain for row in found)]
    if args.json:
        print(text.as_json({'urdf': args.urdf, 'robot': urdf.name, 'advice': advice,
                            'differences': [_as_json(row) for row in found]}))
        return 0
    print(f'{args.urdf} ({urdf.name}) beside the tables of {catalog.file}')
    print(f'{_SAMPLES} postures within +-{_REACH} rad; largest (mean) difference\n')
    print('\n'.join(text.columns([_cells(row) for row in found], header=(
        'chain', 'version', 'frame', 'mm', 'deg', 'fitted mm', 'fitted deg', ''))))
    print()
    print('\n'.join(advice))
    return 0


def difference(chain: Chain, urdf: Urdf) -> Difference:
    """Return how far a chain's tip is from the robot's frame of that name."""
    Q = np.random.default_rng(2955).uniform(-_REACH, _REACH, (_SAMPLES, chain.n))
    ours = chain.forward(Q)
    robot = urdf.forward(chain.root_frame, chain.frame_id,
                         dict(zip(chain.joint_names, Q.T, strict=True)))
    turn, words = _turn_of_axes(ours, robot)
    turned = ours @ turn
    fitted = _fitted(turned, robot) if chain.n >= _FEWEST_JOINTS else None
    mm, deg = _distance(turned, robot)
    return Difference(chain.name, chain.version, chain.root_frame, chain.frame_id, mm, deg, words,
                      *(_distance(fitted, robot) if fitted is not None else (None, None)))


def _has(urdf: Urdf, chain: Chain) -> bool:
    """Return whether a robot has all joints of a chain between its root and tip frames."""
    if not {chain.root_frame, chain.frame_id} <= {*urdf.links}:
        return False
    try:
        path = urdf.path(chain.root_frame, chain.frame_id)
    except InputFileError:
        return False
    return {*chain.joint_names} <= {joint.name for joint in path}


def _nearest(rows: Sequence[Difference], chain: str) -> Difference:
    return min((row for row in rows if row.chain == chain),
               key=lambda row: (round(row.mm[0] + 5 * row.deg[0], 2), bool(row.turn)))


def _distance(one: Array, two: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return largest and mean distance [mm] and angle [deg] between transforms."""
    off = 1000 * np.linalg.norm(one[:, :3, 3] - two[:, :3, 3], axis=1)
    angle = np.degrees(angle_between(one[:, :3, :3], two[:, :3, :3]))
    return ((float(off.max()), float(off.mean())), (float(angle.max()), float(angle.mean())))


def _turn_of_axes(ours: Array, robot: Array) -> tuple[Array, str]:
    """Return the turn by right angles that brings the tip's axes nearest, and its words."""
    mean = (np.swapaxes(ours[:, :3, :3], 1, 2) @ robot[:, :3, :3]).mean(axis=0)
    signed = (np.eye(3)[list(order)] * signs for order in permutations(range(3))
              for signs in product((1, -1), repeat=3))
    T = np.eye(4)
    T[:3, :3] = max((R for R in signed if np.linalg.det(R) > 0),
                    key=lambda R: float((R * mean).sum()))
    *axis, w = matrix_to_quaternion(T[:3, :3]).tolist()
    if w == 1.0:
        return T, ''
    about = ' '.join(f'{"-" if value < 0 else "+"} {name}' for value, name in zip(axis, 'xyz')
                     if abs(value) > 1e-6).removeprefix('+ ')
    return T, f'axes turned by {round(2 * math.degrees(math.acos(w)))} deg about {about}'


def _fitted(ours: Array, robot: Array) -> Array:
    """Return X ours Y with the constant X and Y that bring it nearest to the robot's.

    Gauss-Newton on both transforms, least squares by numpy; singular directions (a constant that
    a joint can make up for) stay as they are.
    """
    X, Y = np.eye(4), np.eye(4)
    best, least = ours, math.inf
    for _ in range(20):
        T = X @ ours @ Y
        error = _error(T, robot)
        size = float((error ** 2).sum())
        if size < least:
            best, least = T, size
        columns = []
        for side in (0, 1):
            for k in range(6):
                step = np.zeros(6)
                step[k] = 1e-6
                moved = _small(step) @ T if side == 0 else T @ _small(step)
                columns.append((_error(moved, robot) - error).ravel() / 1e-6)
        delta = np.linalg.lstsq(np.array(columns).T, -error.ravel(), rcond=1e-6)[0].astype(float)
        X, Y = _small(delta[:6]) @ X, Y @ _small(delta[6:])
        if np.abs(delta).max() < 1e-12:
            break
    return best


def _error(T: Array, robot: Array) -> Array:
    """Return the (N, 6) differences: positions [m], and small angles times an arm's length."""
    turn = np.cross(T[:, :3, :3], robot[:, :3, :3], axis=1).sum(axis=2) / 2
    return np.hstack((T[:, :3, 3] - robot[:, :3, 3], _ARM * turn))


def _small(step: Array) -> Array:
    """Return the transform of a translation and a rotation vector."""
    angle = float(np.linalg.norm(step[3:]))
    T = np.eye(4)
    T[:3, 3] = step[:3]
    if angle:
        T[:3, :3] = turns_about(step[3:] / angle, angle)
    return T


def _advice(row: Difference, file: str) -> str:
    off = f'{_short(row.mm[0])} mm' + (f' and {_short(row.deg[0])} deg' if row.deg[0] > 0.1
                                       else '')
    but = f'; {row.turn}' if row.turn else ''
    if row.mm[0] <= _NEAR and row.deg[0] <= 1.0:
        return f'{row.chain}: use {row.version}, which is this robot to {off}{but}'
    own = f'leg_fk table {file} --root {row.root} --tips {row.frame}'
    if row.mm[0] <= _USABLE:
        return (f'{row.chain}: {row.version} is nearest, to {off}{but}; for the rest make your '
                f'own table: {own}')
    why = ''
    if row.fitted_mm and row.fitted_deg:
        shifted = row.fitted_mm[0] <= 0.2 * row.mm[0] and row.fitted_deg[0] <= 1.0
        if shifted:
            why = f', most of it a shift of its ends ({_short(row.fitted_mm[0])} mm fitted)'
        elif row.fitted_deg[0] > 1.0:
            why = ', and it is another mechanism'
    return (f'{row.chain}: no table is nearer than {_USABLE:g} mm; {row.version} is {off} off'
            f'{why}{but}; make your own: {own}')


def _short(value: float) -> str:
    return f'{value:.0f}' if value >= 10 else f'{value:.2g}'


def _cells(row: Difference) -> list[str]:
    def both(pair: tuple[float, float] | None) -> str:
        return 'too few joints' if pair is None else f'{pair[0]:.3f} ({pair[1]:.3f})'

    marks = ', '.join(filter(None, ('<- nearest' if row.nearest else '', row.turn)))
    return [row.chain, row.version, row.frame, both(row.mm), both(row.deg), both(row.fitted_mm),
            both(row.fitted_deg), marks]


def _as_json(row: Difference) -> dict[str, Any]:
    def both(pair: tuple[float, float] | None) -> dict[str, float] | None:
        return None if pair is None else {'largest': pair[0], 'mean': pair[1]}

    return {'chain': row.chain, 'version': row.version, 'root_frame': row.root,
            'frame': row.frame, 'mm': both(row.mm),
            'deg': both(row.deg), 'turn': row.turn, 'fitted_mm': both(row.fitted_mm),
            'fitted_deg': both(row.fitted_deg), 'nearest': row.nearest}
