"""What the viewer draws of chains: lines, dots and labels in the root frame [m]."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import math
from typing import NamedTuple

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.kinematics_file import DIRECTIONS
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.colors import color_of
from icub_leg_fk.tools.space import AXIS_COLORS, round_step
import numpy as np

INK = '#222222'
FAINT = '#9a9a9a'
GRID = '#d4d4d4'
ARROW, DOT = 0.004, 0.01  # of the size of the scene

_UNKNOWN_ROOT = ('forward', 'left', 'up')  # REP-103
_SAME_PLACE = 1e-6  # of the size of the scene; nearer labels become one
_GRID_CELLS = 8  # in each direction


class Lines(NamedTuple):
    """Straight lines.

    Attributes:
        points: (N, 2, 3) their ends [m].
        colors: N colours, `#rrggbb`.
        width: thickness [pixel].
    """

    points: Array
    colors: tuple[str, ...]
    width: float


class Arrows(NamedTuple):
    """Straight arrows.

    Attributes:
        points: (N, 2, 3) where they begin and end [m].
        color: `#rrggbb`.
        radius: of their shafts [m].
    """

    points: Array
    color: str
    radius: float


class Dots(NamedTuple):
    """Round points.

    Attributes:
        points: (N, 3) places [m].
        color: `#rrggbb`.
        size: radius [m].
    """

    points: Array
    color: str
    size: float


class Label(NamedTuple):
    """A text that faces the viewer.

    Attributes:
        position: (3,) place [m].
        text: the text.
    """

    position: Array
    text: str


Part = Lines | Arrows | Dots | Label
Scene = dict[str, Part]
"""Parts by their names; the first field of each is where it is, the others are its look."""


class PosedChain:
    """A chain at one joint vector, and where it is in the root frame.

    Attributes:
        chain: the chain.
        q: n joint positions [rad or m].
        frames: (m + 2, 4, 4) frame 0, a frame for each of the m rows, and the tip's.
        corners: (K, 3) corners of the sole [m]; None if there is no sole.
    """

    def __init__(self, chain: Chain, q: Sequence[float]) -> None:
        self.chain = chain
        self.q = q
        self.frames = chain.frames(q)
        self.corners = chain.sole_outline(q)

    @property
    def origins(self) -> Array:
        """(m + 2, 3) the frames' origins [m]."""
        return self.frames[:, :3, 3]

    @property
    def tree_name(self) -> str:
        """The chain's name without the slash that would make a branch of the scene's tree."""
        return self.chain.name.replace('/', '%2F')


def segments(ends: Array, color: str, width: float) -> Lines:
    """Return (N, 2, 3) lines of one colour."""
    return Lines(ends, (color,) * len(ends), width)


def polyline(points: Array, color: str, width: float) -> Lines:
    """Return the lines from each of (N, 3) points to the next."""
    return segments(np.stack((points[:-1], points[1:]), axis=1), color, width)


def axes(frames: Array, length: float, width: float) -> Lines:
    """Return the x, y and z axes of (N, 4, 4) frames: red, green, blue."""
    origins = np.repeat(frames[:, None, :3, 3], 3, axis=1)
    tips = origins + length * frames[:, :3, :3].swapaxes(1, 2)
    ends = np.stack((origins, tips), axis=2).reshape(-1, 2, 3)
    return Lines(ends, AXIS_COLORS * len(frames), width)


def labels(
    prefix: str, names: Iterable[str], places: Iterable[Array], size: float
) -> Scene:
    """Return a label per name; names at one place share a label."""
    merged: list[tuple[str, Array]] = []
    for name, place in zip(names, places, strict=True):
        for index, (text, other) in enumerate(merged):
            if np.linalg.norm(place - other) < _SAME_PLACE * size:
                merged[index] = f'{text}, {name}', other
                break
        else:
            merged.append((name, place))
    return {f'{prefix} {text}': Label(place, text) for text, place in merged}


def reach(chains: Iterable[Chain]) -> float:
    """Return how far the chains reach from their root at most, without their slides [m]."""
    longest = 0.0
    for chain in chains:
        lengths = [math.hypot(link.a, link.d) for link in chain.links]
        lengths += [
            float(np.linalg.norm(T[:3, 3])) for T in (chain.T_root_0, chain.T_n_tip)
        ]
        longest = max(longest, sum(lengths))
    return longest or 1.0


def directions(root_axes: Sequence[str]) -> tuple[Array, Array, Array]:
    """Return where forward, left and up are in the root frame, (3,) each."""
    words = root_axes or _UNKNOWN_ROOT
    R = np.array([DIRECTIONS[word] for word in words], dtype=float)
    forward, left, up = R.T
    return forward, left, up


def axis_names(chain: Chain) -> list[str]:
    """Return the axes of a chain's root with where they point: `x backward`, `y right`, `z up`."""
    words = chain.root_axes or ('', '', '')
    return [f'{axis} {word}'.strip() for axis, word in zip('xyz', words, strict=True)]


def root_words(chain: Chain) -> str:
    """Return a chain's root: `root_link (x backward, y right, z up)`."""
    where = f' ({", ".join(axis_names(chain))})' if chain.root_axes else ''
    return f'{chain.root_frame}{where}'


def outer_points(posed: PosedChain) -> Array:
    """Return (N, 3) points between which a chain is, from the root to its tip and sole."""
    points = np.vstack((np.zeros((1, 3)), posed.origins))
    return points if posed.corners is None else np.vstack((points, posed.corners))


def root_scene(chain: Chain, size: float) -> Scene:
    """Return the root's axes with their names."""
    length = 0.15 * size
    aside = np.full(3, -0.02 * size)  # frame 0 may be in the same place
    scene: Scene = {
        'root/axes': axes(np.eye(4)[None], length, 4.0),
        'root/name': Label(aside, chain.root_frame),
    }
    return scene | labels(
        'root/axis', axis_names(chain), 1.1 * length * np.eye(3), size
    )


def floor_scene(points: Array, root_axes: Sequence[str], size: float) -> Scene:
    """Return a grid below (N, 3) points [m]."""
    forward, left, up = directions(root_axes)
    step = round_step(size / 8)
    middle = np.array([np.mean(points @ forward), np.mean(points @ left)])
    half = step * _GRID_CELLS / 2
    ends = []
    for mark in np.linspace(-half, half, _GRID_CELLS + 1):
        ends.append([(mark, -half), (mark, half)])
        ends.append([(-half, mark), (half, mark)])
    plane = np.array(ends) + np.round(middle / step) * step
    lowest = float((points @ up).min())
    corners = plane[..., :1] * forward + plane[..., 1:] * left + lowest * up
    return {'floor': segments(corners, GRID, 1.0)}


def skeleton_scene(posed: PosedChain, size: float) -> Scene:
    """Return a chain as lines through the origins of its frames, with its joints."""
    bones = polyline(posed.origins, color_of(posed.chain), 6.0)
    return {
        f'{posed.tree_name}/bones': bones,
        f'{posed.tree_name}/joints': Dots(posed.origins[:-1], INK, DOT * size),
    }


def faint_scene(posed: PosedChain) -> Scene:
    """Return a chain as thin lines in the background."""
    return {f'{posed.tree_name}/bones': polyline(posed.origins, FAINT, 2.0)}


def ends_scene(posed: PosedChain, faint: bool) -> Scene:
    """Return the line from a chain's root to its frame 0, and the outline of its sole."""
    to_root = np.stack((np.zeros(3), posed.origins[0]))
    scene: Scene = {f'{posed.tree_name}/to root': polyline(to_root, FAINT, 2.0)}
    if posed.corners is not None:
        outline = np.vstack((posed.corners, posed.corners[:1]))
        color, width = (FAINT, 2.0) if faint else (color_of(posed.chain), 4.0)
        scene[f'{posed.tree_name}/sole'] = polyline(outline, color, width)
    return scene


def frames_scene(posed: PosedChain, size: float) -> Scene:
    """Return the frames of a chain's table, and the tip's, with their names."""
    frames = posed.frames
    names = [*map(str, range(len(frames) - 1)), posed.chain.frame_id]
    scene: Scene = {
        f'{posed.tree_name}/frames': axes(frames[:-1], 0.06 * size, 2.0),
        f'{posed.tree_name}/tip': axes(frames[-1:], 0.12 * size, 4.0),
    }
    return scene | labels(f'{posed.tree_name}/frame', names, posed.origins, size)


def trail_scene(posed: PosedChain, points: Array) -> Scene:
    """Return the way that a chain's tip has come, through (N, 3) points."""
    return {f'{posed.tree_name}/trail': polyline(points, color_of(posed.chain), 2.0)}
