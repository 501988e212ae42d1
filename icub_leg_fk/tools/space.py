"""A view of a part of space in parallel projection, drawn by matplotlib in two dimensions."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any, NamedTuple, TYPE_CHECKING

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.colors import color_of
import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AXIS_COLORS = (
    '#d62728',
    '#2ca02c',
    '#1f5fd0',
)  # x red, y green, z blue, as viewers have it
FAINT = '#6f6f6f'
GRID = '#dddddd'
FLOOR = '#f7f7f7'

_ROOT_AXES = 1.2  # sides of a square
_MARGIN = 0.22  # inches around what is seen, for the names of axes
_DISTANCES = (0.12, 0.22, 0.32, 0.42, 0.52)  # inches from an axis to its name
_POINT = 1 / 72  # inch
_LEAST_ARROW = 0.12  # inches; a shorter one has no head


class Box(NamedTuple):
    """A rectangle of a figure [inches from its lower left corner]."""

    left: float
    bottom: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Its right side."""
        return self.left + self.width

    @property
    def top(self) -> float:
        """Its upper side."""
        return self.bottom + self.height

    def meets(self, other: Box) -> bool:
        """Return whether two rectangles have a part in common."""
        left, bottom = max(self.left, other.left), max(self.bottom, other.bottom)
        return left < min(self.right, other.right) and bottom < min(self.top, other.top)

    def holds(self, other: Box) -> bool:
        """Return whether another rectangle is inside."""
        return (
            self.left <= other.left
            and self.bottom <= other.bottom
            and other.right <= self.right
            and other.top <= self.top
        )


class Space:
    """A view of a part of space, in which every direction keeps its scale.

    It has a floor of squares below some points and the origin, and room for the axes of the root.

    Args:
        figure: where it is drawn.
        box: its part of the figure.
        points: (N, 3) points of the root frame that are to be seen [m].
        azimuth: where the viewer stands [deg].
        elevation: how high the viewer stands [deg].

    Attributes:
        axes: matplotlib's axes.
        step: side of a square of the floor [m].
    """

    def __init__(
        self,
        figure: Figure,
        box: Box,
        points: Array,
        azimuth: float = 210.0,
        elevation: float = 18.0,
    ) -> None:
        az = math.radians(azimuth)
        el = math.radians(elevation)
        self._toward_viewer = np.array(
            [math.cos(el) * math.cos(az), math.cos(el) * math.sin(az), math.sin(el)]
        )
        rightward = np.array([-math.sin(az), math.cos(az), 0.0])
        upward = np.cross(self._toward_viewer, rightward)
        self._projection = np.stack([rightward, upward], axis=1)
        self._names: list[Box] = []
        self._box = box
        points = np.vstack((points, np.zeros((1, 3))))
        self.step = step = round_step(float(np.ptp(points, axis=0).max()) / 7)
        lowest = np.floor(points.min(axis=0) / step - 1) * step
        highest = np.ceil(points.max(axis=0) / step + 1) * step
        lowest[2] = points[:, 2].min()
        floor = _grid(lowest, highest, step)
        root_axes = _ROOT_AXES * step * np.eye(3)
        self.axes = self._fitting_axes(figure, np.vstack([points, root_axes, *floor]))
        self._draw_floor(floor)

    def depth(self, points: Array) -> float:
        """Return how near the middle of some points is to the viewer [m]; larger is nearer."""
        return float(np.mean(points @ self._toward_viewer))

    def line(self, points: ArrayLike, **style: Any) -> None:
        """Draw a line through (N, 3) points of the root frame."""
        u, v = self._seen(points).T
        self.axes.plot(u, v, **style)

    def fill(
        self, corners: ArrayLike, color: str, zorder: float, alpha: float = 1.0
    ) -> None:
        """Fill a polygon of (N, 3) corners."""
        u, v = self._seen(corners).T
        self.axes.fill(u, v, facecolor=color, alpha=alpha, zorder=zorder, linewidth=0)

    def root(self) -> None:
        """Draw the axes of the root."""
        self.frame(np.eye(4), _ROOT_AXES * self.step, 90)

    def frame(
        self,
        T: Array,
        length: float,
        zorder: float,
        width: float = 2.0,
        labels: Sequence[str] = 'xyz',
        size: float = 9.0,
    ) -> None:
        """Draw the axes of a (4, 4) frame, the nearest last, and the names that find room."""
        for i in sorted(range(3), key=lambda i: self.depth(T[:3, i])):
            start, end = self._seen([T[:3, 3], T[:3, 3] + length * T[:3, i]])
            self._arrow(start, end, AXIS_COLORS[i], width, zorder)
            side = (end - start)[0] / length
            self._name(start, end, side, labels[i], size, AXIS_COLORS[i], zorder)

    def chain(
        self, chain: Chain, q: ArrayLike, zorder: float, alpha: float = 1.0
    ) -> None:
        """Draw a chain's skeleton from the root to its tip, its joints, and its sole if any."""
        points = chain.frames(q)[:, :3, 3]
        color = color_of(chain)
        self.line(
            [(0.0, 0.0, 0.0), points[0]],
            color=FAINT,
            linewidth=2.5,
            zorder=zorder,
            linestyle=(0, (2, 1.2)),
            alpha=alpha,
        )
        corners = chain.sole_outline(q)
        if corners is not None:
            self.fill(corners, color, zorder, 0.3 * alpha)
        self.line(points, color='white', linewidth=8, zorder=zorder + 1, alpha=alpha)
        self.line(
            points,
            color=color,
            linewidth=4,
            zorder=zorder + 2,
            alpha=alpha,
            solid_joinstyle='round',
        )
        self.line(
            points[:-1],
            color=color,
            linestyle='',
            marker='o',
            markersize=6.5,
            markerfacecolor='white',
            markeredgewidth=1.8,
            zorder=zorder + 3,
            alpha=alpha,
        )

    def _seen(self, points: ArrayLike) -> Array:
        """Return where the viewer sees (N, 3) points: (N, 2), rightward and upward [m]."""
        return np.asarray(np.asarray(points, dtype=float) @ self._projection)

    def _fitting_axes(self, figure: Figure, points: Array) -> Any:
        """Return axes in which (N, 3) points fill the box, but for its margin."""
        box = self._box
        seen = self._seen(points)
        lowest, highest = seen.min(axis=0), seen.max(axis=0)
        room = np.array(box[2:]) - 2 * _MARGIN
        self._scale = scale = float((room / (highest - lowest)).min())  # inches per m
        half = np.array(box[2:]) / scale / 2
        self._corner = (lowest + highest) / 2 - half
        left_right, bottom_top = zip(self._corner, self._corner + 2 * half)
        size = figure.get_size_inches()
        axes = figure.add_axes(np.divide(box, (*size, *size)).tolist())
        axes.set_axis_off()
        axes.set_xlim(left_right)
        axes.set_ylim(bottom_top)
        return axes

    def _draw_floor(self, lines: Sequence[Array]) -> None:
        """Draw the floor from the lines between its squares, of which the first two are edges."""
        one, other = lines[:2]
        self.fill([*one, *other[::-1]], FLOOR, 0)
        for line in lines:
            self.line(line, color=GRID, linewidth=1, zorder=1)

    def _arrow(
        self, start: Array, end: Array, color: str, width: float, zorder: float
    ) -> None:
        """Draw an arrow between two places in the picture; a short one has no head."""
        if np.linalg.norm(end - start) * self._scale < _LEAST_ARROW:
            u, v = np.stack((start, end), axis=1)
            self.axes.plot(u, v, color=color, linewidth=width, zorder=zorder)
            return
        style = {
            'arrowstyle': '-|>',
            'color': color,
            'linewidth': width,
            'shrinkA': 0.0,
            'shrinkB': 0.0,
            'mutation_scale': 4 + 3 * width,
        }
        self.axes.annotate(
            '', end, start, arrowprops=style, zorder=zorder, annotation_clip=False
        )

    def _name(
        self,
        start: Array,
        end: Array,
        side: float,
        name: str,
        size: float,
        color: str,
        zorder: float,
    ) -> None:
        """Write the name of an axis after its end, where nothing else is written.

        It leads to the right by `side` of its length.
        """
        width = 0.7 * size * len(name) * _POINT
        height = 1.3 * size * _POINT
        place, share = 'center', 0.5
        if abs(side) >= 0.3:
            place, share = ('left', 0.0) if side > 0 else ('right', 1.0)
        length = float(np.linalg.norm(end - start))
        direction = (end - start) / length if length else np.array([0.0, 1.0])
        for distance in _DISTANCES:
            at = end + distance / self._scale * direction
            x, y = (at - self._corner) * self._scale + self._box[:2]
            box = Box(x - share * width, y - height / 2, width, height)
            if self._box.holds(box) and not any(map(box.meets, self._names)):
                self._names.append(box)
                self.axes.text(
                    *at,
                    name,
                    fontsize=size,
                    color=color,
                    weight='bold',
                    ha=place,
                    va='center',
                    zorder=zorder + 1,
                )
                return


def _grid(lowest: Array, highest: Array, step: float) -> list[Array]:
    """Return the lines between the squares of a floor, (2, 3) each, its two far edges first."""
    x0, y0, low = lowest
    xs = np.arange(x0, highest[0] + step / 2, step)
    ys = np.arange(y0, highest[1] + step / 2, step)
    lines = [
        np.array([(x, y0, low), (x, ys[-1], low)]) for x in (xs[0], xs[-1], *xs[1:-1])
    ]
    return lines + [np.array([(x0, y, low), (xs[-1], y, low)]) for y in ys]


def round_step(least: float) -> float:
    """Return the smallest of 0.1, 0.2, 0.5, 1 and the like [m] that is not below a length."""
    least = max(least, 1e-4)
    decade = 10.0 ** math.floor(math.log10(least))
    return next(decade * step for step in (1, 2, 5, 10) if decade * step >= least)
