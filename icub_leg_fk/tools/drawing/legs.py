"""Pictures of legs in space, seen in parallel projection: every direction keeps its scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any, TYPE_CHECKING

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.drawing.style import AXIS_COLORS, color_of, FAINT, GRID, INK, MINUS
import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SOLE_BOX = (-0.05, 0.11, -0.037, 0.037)  # m; back, front, right and left of the sole, for the eye
_HALO = 2.5  # points of white around lines, so that the nearer one is seen to be nearer


@dataclass(frozen=True)
class View:
    """A camera infinitely far away.

    Attributes:
        axes: where to draw; made equal in scale and bare.
        azimuth: where the camera stands, from the root's x toward its y [deg].
        elevation: how high it stands [deg].
    """

    axes: Axes
    azimuth: float = 210.0  # before the robot, to its left
    elevation: float = 18.0

    def __post_init__(self) -> None:
        self.axes.set_aspect('equal')
        self.axes.set_axis_off()

    def project(self, points: ArrayLike) -> Array:
        """Return (..., 2) places in the picture [m] of (..., 3) points of the root frame [m]."""
        return np.asarray(points, dtype=float) @ self._basis[:, :2]

    def depth(self, points: ArrayLike) -> float:
        """Return how near the middle of some points is to the camera [m]; larger is nearer."""
        return float(np.mean(np.asarray(points, dtype=float) @ self._basis[:, 2]))

    @property
    def _basis(self) -> Array:
        """(3, 3) columns: right and up in the picture, and toward the camera."""
        az, el = math.radians(self.azimuth), math.radians(self.elevation)
        return np.array([
            [-math.sin(az), -math.sin(el) * math.cos(az), math.cos(el) * math.cos(az)],
            [math.cos(az), -math.sin(el) * math.sin(az), math.cos(el) * math.sin(az)],
            [0.0, math.cos(el), math.sin(el)],
        ])

    def line(self, points: ArrayLike, halo: bool = False, **style: Any) -> None:
        """Draw a line through points of the root frame."""
        if halo:
            from matplotlib.patheffects import Normal, Stroke

            width = style.get('linewidth', 2.0) + 2 * _HALO
            style['path_effects'] = [Stroke(linewidth=width, foreground='white'), Normal()]
        self.axes.plot(*self.project(points).T, **style)

    def text(self, point: ArrayLike, text: str, offset: tuple[float, float] = (0, 0),
             **style: Any) -> None:
        """Write at a point of the root frame, moved by an offset in typographic points."""
        self.axes.annotate(text, tuple(self.project(point)), xytext=offset,
                           textcoords='offset points',
                           **{'ha': 'center', 'va': 'center', 'annotation_clip': False, **style})

    def arrow(self, start: ArrayLike, end: ArrayLike, **style: Any) -> None:
        """Draw an arrow between points of the root frame."""
        from matplotlib.patches import FancyArrowPatch

        self.axes.add_patch(FancyArrowPatch(
            tuple(self.project(start)), tuple(self.project(end)), arrowstyle='-|>',
            shrinkA=0, shrinkB=0, clip_on=False, **style))


def draw_triad(view: View, T: Array, length: float, width: float, zorder: float,
               labels: Sequence[str] = ()) -> None:
    """Draw a frame's axes: x red, y green, z blue.

    Args:
        view: where.
        T: (4, 4) frame in the root frame.
        length: of the axes [m].
        width: of the lines [points].
        zorder: of the nearest axis; farther ones are drawn before.
        labels: what to write at the ends of the three axes; nothing if empty.
    """
    origin = T[:3, 3]
    for i in np.argsort([view.depth(T[:3, i]) for i in range(3)]):
        end = origin + length * T[:3, i]
        view.arrow(origin, end, color=AXIS_COLORS[i], linewidth=width, zorder=zorder,
                   mutation_scale=4.5 * width)
        if labels:
            right, up = view.project(T[:3, i]).tolist()
            view.text(end, labels[i], (9 * right, 9 * up), color=AXIS_COLORS[i], weight='bold',
                      ha='center' if abs(right) < 0.3 else 'left' if right > 0 else 'right',
                      va='bottom' if up > 0.5 else 'center', zorder=zorder + 1)


def draw_leg(view: View, chain: Chain, q: ArrayLike, has_sole: bool, zorder: float = 10.0,
             alpha: float = 1.0) -> None:
    """Draw a chain's skeleton from the root to its tip, its sole if it has one, and its joints."""
    frames = chain.frames(q)
    points, color = frames[:, :3, 3], color_of(chain)
    view.line([(0.0, 0.0, 0.0), points[0]], color=FAINT, linewidth=3, zorder=zorder, alpha=alpha,
              linestyle=(0, (2, 1.2)), solid_capstyle='butt')
    if has_sole:
        view.axes.fill(*view.project(sole_outline(frames[-1])).T, facecolor=color, edgecolor=color,
                       alpha=0.3 * alpha, linewidth=1.2, zorder=zorder)
    view.line(points, halo=alpha == 1.0, color=color, linewidth=5, zorder=zorder + 1, alpha=alpha,
              solid_joinstyle='round')
    if alpha == 1.0:
        view.axes.plot(*view.project(points[:-1]).T, 'o', color='white', markeredgecolor=color,
                       markeredgewidth=2.0, markersize=7.5, zorder=zorder + 2)


def sole_outline(T_root_tip: Array) -> Array:
    """Return (4, 3) corners of a plate at the tip, whichever way its frame is turned.

    Of the tip's axes (those of a foot as the tables leave it, or of a sole) the plate lies across
    the one that is upright, and its length along the one that is most forward.
    """
    R, origin = T_root_tip[:3, :3], T_root_tip[:3, 3]
    up = int(np.argmax(np.abs(R[2])))
    forward = max((i for i in range(3) if i != up), key=lambda i: abs(R[0, i]))
    ahead = -R[:, forward] * np.sign(R[0, forward])
    aside = np.cross(R[:, up] * np.sign(R[2, up]), ahead)
    back, front, right, left = SOLE_BOX
    return np.array([origin + a * ahead + b * aside
                     for a, b in ((back, right), (front, right), (front, left), (back, left))])


def draw_ground(view: View, height: float, xs: Array, ys: Array) -> None:
    """Draw a grid at a height, through the given x and y [m]."""
    corners = [(xs[0], ys[0]), (xs[-1], ys[0]), (xs[-1], ys[-1]), (xs[0], ys[-1])]
    view.axes.fill(*view.project([(*c, height) for c in corners]).T, color='#f7f7f7', zorder=0)
    for value in xs:
        view.line([(value, ys[0], height), (value, ys[-1], height)], color=GRID, linewidth=1,
                  zorder=1)
    for value in ys:
        view.line([(xs[0], value, height), (xs[-1], value, height)], color=GRID, linewidth=1,
                  zorder=1)


def grid_lines(low: float, high: float, step: float = 0.1) -> Array:
    """Return the lines of a grid that take in a range [m]."""
    return np.arange(math.floor(low / step), math.ceil(high / step) + 1, dtype=float) * step


def draw_forward(view: View, point: Sequence[float], length: float = 0.14, text: str = 'forward'
                 ) -> None:
    """Draw an arrow along the ground that points where the robot faces: along -x."""
    end = np.subtract(point, (length, 0.0, 0.0))
    view.arrow(point, end, color=INK, linewidth=1.8, mutation_scale=13, zorder=3)
    view.text(end, text, (0, -9), fontsize=10, zorder=3)


def draw_ruler(view: View, foot: Sequence[float], top: float, step: float) -> None:
    """Draw an upright ruler with heights in the root frame.

    Args:
        view: where.
        foot: (3,) its lower end [m].
        top: height of its upper end [m].
        step: half the way from mark to mark [m].
    """
    x, y, low = foot
    view.line([(x, y, low), (x, y, top)], color=FAINT, linewidth=1, zorder=2)
    first, last = math.ceil(low / (2 * step) - 1e-9), math.floor(top / (2 * step) + 1e-9)
    for value in (np.arange(first, last + 1) * 2 * step).tolist():
        right, up = view.project((x, y, value)).tolist()
        view.axes.plot([right - 0.08 * step, right], [up, up], color=FAINT, linewidth=1, zorder=2)
        text = f'{value:.4g}'.replace('-', MINUS) if abs(value) > step else 'z  0 m'
        view.text((x, y, value), text, (-8, 0), ha='right', fontsize=9)
