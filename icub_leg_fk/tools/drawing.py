"""Pictures of chains: their tips over time, and the chains in space at some instants.

matplotlib takes nothing from the user's settings, and pyplot, which wants a display, is not used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import logging
import math
import os
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, TYPE_CHECKING

from icub_leg_fk.errors import LegFKError, MissingDependencyError, OutputFileError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.colors import color_of
from icub_leg_fk.tools.output_file import check_target, whole_path
from icub_leg_fk.tools.recording import ChainTrack, time_span
import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D

FORMATS = ('.png', '.svg', '.pdf')
AXIS_COLORS = (
    '#d62728',
    '#2ca02c',
    '#1f5fd0',
)  # x red, y green, z blue, as viewers have it
INK = '#222222'
FAINT = '#6f6f6f'
GRID = '#dddddd'
FLOOR = '#f7f7f7'
MINUS = '\N{MINUS SIGN}'
LETTERS = 'ABCD'  # of the instants at which the chains are drawn

_WIDTH = 13.333  # inches, of a slide
_HEIGHT = 7.5
_ROW = 0.3  # inches, of a bar and its name
_COLUMNS = 800  # of a panel
_MOST_SAMPLES = 4 * _COLUMNS  # of a curve; more cannot be seen and become a band
_GAP = 5.0  # so many usual intervals without a pose are a gap
_TRAIL = 0.5  # s of a tip's path before and after an instant
_COORDINATES = {
    'z': 2,
    'x': 0,
    'y': 1,
}  # in the order of their panels, with their columns
_SETTINGS: dict[str, Any] = {
    'font.family': 'sans-serif',
    'font.sans-serif': ['DejaVu Sans'],
    'font.size': 12,
    'axes.titlesize': 12,
    'axes.titleweight': 'bold',
    'axes.edgecolor': FAINT,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'axes.grid': True,
    'axes.axisbelow': True,
    'grid.color': GRID,
    'xtick.color': FAINT,
    'ytick.color': FAINT,
    'xtick.labelcolor': INK,
    'ytick.labelcolor': INK,
    'text.color': INK,
    'axes.labelcolor': INK,
    'legend.frameon': False,
    'svg.fonttype': 'none',
    'svg.hashsalt': 'leg_fk',
    'pdf.fonttype': 42,
}


class OutOfRange(NamedTuple):
    """A joint beyond one end of its range.

    Attributes:
        chain: whose joint it is.
        text: which end of which joint: `l_knee > 4°`.
        spans: when it was there, from and to [s].
    """

    chain: Chain
    text: str
    spans: list[tuple[float, float]]


def import_matplotlib() -> tuple[ModuleType, ModuleType]:
    """Return the package matplotlib, which draws figures, and its module of things in space."""
    os.environ |= {'MPLBACKEND': 'agg', 'MATPLOTLIBRC': os.devnull}
    logging.getLogger('matplotlib').setLevel(
        logging.CRITICAL
    )  # what it says of a matplotlibrc
    try:
        import matplotlib.figure
        from mpl_toolkits.mplot3d import art3d
    except ImportError as error:
        raise MissingDependencyError(
            'matplotlib',
            'a picture',
            'pip install matplotlib (rosdep key python3-matplotlib)',
        ) from error
    except (
        ValueError
    ) as error:  # a matplotlibrc in the working directory that is not text
        raise LegFKError(
            f'matplotlib cannot be imported: {error}; is there a file matplotlibrc '
            'in this directory?'
        ) from error
    return matplotlib, art3d


@contextmanager
def _own_settings() -> Iterator[None]:
    """Let matplotlib draw with its defaults and this module's settings."""
    matplotlib, _ = import_matplotlib()
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        yield


def check_output(path: str | Path, force: bool) -> None:
    """Refuse a picture that cannot be, before any work is done for it."""
    import_matplotlib()
    check_target(path, force=force)
    ending = Path(path).suffix
    if ending.lower() not in FORMATS:
        raise OutputFileError(
            str(path), f'found {ending or "no ending"}, allowed: {", ".join(FORMATS)}'
        )


def save_picture(
    draw: Callable[[], Figure], path: str | Path, *, force: bool, dpi: int = 150
) -> None:
    """Draw a picture and write it in the format that its ending names, whole or not at all."""
    kind = Path(path).suffix.lower().lstrip('.')
    no_date = {'svg': {'Date': None}, 'pdf': {'CreationDate': None}}
    try:
        with _own_settings(), whole_path(path, force=force) as new:
            draw().savefig(new, format=kind, dpi=dpi, metadata=no_date.get(kind))
    except ValueError as error:
        raise LegFKError(f'{path}: cannot be drawn: {error}') from error


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size in inches."""
    matplotlib, _ = import_matplotlib()
    figure: Figure = matplotlib.figure.Figure(figsize=(width, height))
    return figure


def feet_figure(
    tracks: Sequence[ChainTrack], instants: Sequence[float], title: str
) -> Figure:
    """Return the tips over time, and beside them the chains in space.

    Args:
        tracks: what the chains did.
        instants: up to four times at which the chains are drawn [s].
        title: what stands above.
    """
    outside = [each for track in tracks for each in outside_ranges(track)]
    height = _HEIGHT + _ROW * max(0, len(outside) - 1)
    figure = new_figure(_WIDTH, height)
    _draw_time(figure, tracks, instants, outside)
    space = _draw_scenes(figure, tracks, instants)
    frames = [tracks[0].chain.root_frame]
    frames += [track.chain.frame_id for track in tracks]
    named = ', '.join(dict.fromkeys(frames))
    figure.text(0.03, 1 - 0.35 / height, title, fontsize=19, weight='bold', va='center')
    small: dict[str, Any] = {'fontsize': 10.5, 'va': 'center', 'color': FAINT}
    figure.text(
        0.03, 1 - 0.8 / height, _notes(tracks, bool(outside)), ha='left', **small
    )
    figure.text(
        0.985,
        1 - 0.8 / height,
        f'axes of {named};  squares of {space.step:g} m',
        ha='right',
        **small,
    )
    return figure


def outside_ranges(track: ChainTrack) -> list[OutOfRange]:
    """Return when joints were beyond an end of their range."""
    chain = track.chain
    found = []
    for name, link, q in zip(
        chain.joint_names, chain.joints, track.positions.T, strict=True
    ):
        lower, upper = link.limits
        for is_outside, sign, limit in (
            (q < lower, '<', lower),
            (q > upper, '>', upper),
        ):
            if is_outside.any():
                value = (
                    f'{limit:g} m' if link.is_prismatic else f'{math.degrees(limit):g}°'
                )
                text = f'{name} {sign} {value}'.replace('-', MINUS)
                found.append(OutOfRange(chain, text, _spans(track.times, is_outside)))
    return found


def gaps(tracks: Sequence[ChainTrack]) -> list[tuple[float, float]]:
    """Return the spans [s] in which a chain has no pose although it should, each once."""
    found = set()
    for track in tracks:
        for after in _breaks(track.times):
            before = after - 1
            begin, end = track.times[[before, after]].tolist()
            if end > begin:
                found.add((begin, end))
    return sorted(found)


class Space:
    """A view of a part of space in parallel projection, in which every direction keeps its scale.

    It shows some points and the root's axes above a floor of squares.

    Args:
        figure: where it is drawn.
        place: its part of the figure, of a grid of matplotlib.
        points: (N, 3) points of the root frame that are to be seen [m].
        azimuth: where the viewer stands [deg].
        elevation: how high the viewer stands [deg].
        zoom: how large things are.

    Attributes:
        axes: matplotlib's axes.
        step: side of a square of the floor [m].
    """

    def __init__(
        self,
        figure: Figure,
        place: Any,
        points: Array,
        azimuth: float = 210.0,
        elevation: float = 18.0,
        zoom: float = 1.15,
    ) -> None:
        self.axes: Axes3D = figure.add_subplot(
            place, projection='3d', proj_type='ortho', computed_zorder=False
        )
        self.axes.view_init(elevation, azimuth)
        self.axes.set_axis_off()
        az = math.radians(azimuth)
        el = math.radians(elevation)
        self._toward_viewer = np.array(
            [math.cos(el) * math.cos(az), math.cos(el) * math.sin(az), math.sin(el)]
        )
        self._rightward = np.array([-math.sin(az), math.cos(az), 0.0])
        points = np.vstack((points, np.zeros((1, 3))))
        self.step = step = _round_step(float(np.ptp(points, axis=0).max()) / 7)
        lowest = np.floor(points.min(axis=0) / step - 1) * step
        highest = np.ceil(points.max(axis=0) / step + 1) * step
        lowest[2] = points[:, 2].min()
        for axis, low, high in zip('xyz', lowest.tolist(), highest.tolist()):
            self.axes.set(**{f'{axis}lim': (low, high)})
        self.axes.set_box_aspect(highest - lowest, zoom=zoom)
        self._draw_floor(lowest, highest)

    def depth(self, points: Array) -> float:
        """Return how near the middle of some points is to the viewer [m]; larger is nearer."""
        return float(np.mean(points @ self._toward_viewer))

    def line(self, points: ArrayLike, **style: Any) -> None:
        """Draw a line through (N, 3) points of the root frame."""
        self.axes.plot(*np.transpose(points), clip_on=False, **style)

    def fill(
        self, corners: ArrayLike, color: str, zorder: float, alpha: float = 1.0
    ) -> None:
        """Fill a polygon of (N, 3) corners."""
        _, art3d = import_matplotlib()
        self.axes.add_collection3d(
            art3d.Poly3DCollection(
                [np.asarray(corners)],
                facecolor=color,
                alpha=alpha,
                zorder=zorder,
                clip_on=False,
            )
        )

    def frame(
        self,
        T: Array,
        length: float,
        zorder: float,
        width: float = 2.0,
        labels: Sequence[str] = 'xyz',
        size: float = 9.0,
    ) -> None:
        """Draw the axes of a (4, 4) frame with their names, the nearest last."""
        origin = T[:3, 3]
        for i in sorted(range(3), key=lambda i: self.depth(T[:3, i])):
            axis = T[:3, i]
            color = AXIS_COLORS[i]
            self.axes.quiver(
                *origin,
                *(length * axis),
                color=color,
                clip_on=False,
                linewidth=width,
                arrow_length_ratio=0.3,
                zorder=zorder,
            )
            self.axes.text(
                *(origin + 1.2 * length * axis),
                labels[i],
                fontsize=size,
                color=color,
                weight='bold',
                va='center',
                ha=self._side(axis),
                zorder=zorder + 1,
            )

    def chain(self, chain: Chain, q: ArrayLike, zorder: float) -> None:
        """Draw a chain's skeleton from the root to its tip, its joints, and its sole if any."""
        points = chain.frames(q)[:, :3, 3]
        color = color_of(chain)
        self.line(
            [(0.0, 0.0, 0.0), points[0]],
            color=FAINT,
            linewidth=2.5,
            zorder=zorder,
            linestyle=(0, (2, 1.2)),
        )
        corners = chain.sole_outline(q)
        if corners is not None:
            self.fill(corners, color, zorder, 0.3)
        self.line(points, color='white', linewidth=8, zorder=zorder + 1)
        self.line(
            points, color=color, linewidth=4, zorder=zorder + 2, solid_joinstyle='round'
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
        )

    def _side(self, axis: Array) -> str:
        """Return how text at the end of an axis is aligned to stay clear of it."""
        aside = float(axis @ self._rightward)
        if abs(aside) < 0.3:
            return 'center'
        return 'left' if aside > 0 else 'right'

    def _draw_floor(self, lowest: Array, highest: Array) -> None:
        """Draw the squares of the floor between two (3,) corners."""
        low = lowest[2]
        x0, y0 = lowest[:2]
        xs = np.arange(x0, highest[0] + self.step / 2, self.step)
        ys = np.arange(y0, highest[1] + self.step / 2, self.step)
        x1, y1 = xs[-1], ys[-1]
        self.fill(
            [(x0, y0, low), (x1, y0, low), (x1, y1, low), (x0, y1, low)], FLOOR, 0
        )
        style: dict[str, Any] = {'color': GRID, 'linewidth': 1, 'zorder': 1}
        for x in xs:
            self.line([(x, y0, low), (x, y1, low)], **style)
        for y in ys:
            self.line([(x0, y, low), (x1, y, low)], **style)


def _draw_time(
    figure: Figure,
    tracks: Sequence[ChainTrack],
    instants: Sequence[float],
    outside: Sequence[OutOfRange],
) -> None:
    """Draw the tips' coordinates, and when joints were outside their ranges, over time."""
    height = figure.get_figheight()
    ratios = [1.0] * len(_COORDINATES)
    if outside:
        ratios.append(_ROW * (len(outside) + 0.3) / 1.6)
    panels = figure.subplots(
        len(ratios),
        sharex=True,
        gridspec_kw={
            'left': 0.075,
            'right': 0.5,
            'top': 1 - 1.35 / height,
            'bottom': 0.65 / height,
            'hspace': 0.42,
            'height_ratios': ratios,
        },
    )
    _draw_tips(panels[: len(_COORDINATES)], tracks)
    if outside:
        _draw_outside_ranges(panels[-1], outside)
    panels[-1].set_xlabel('time [s]')
    _mark_instants(panels[: len(_COORDINATES)], instants)


def _draw_tips(panels: Sequence[Axes], tracks: Sequence[ChainTrack]) -> None:
    """Draw a coordinate of all tips in each panel."""
    bars = [(begin, end - begin) for begin, end in gaps(tracks)]
    for panel, (name, column) in zip(panels, _COORDINATES.items(), strict=True):
        for track in tracks:
            _draw_curve(panel, track, column)
        panel.broken_barh(
            bars,
            (0, 1),
            color='black',
            alpha=0.12,
            linewidth=0,
            transform=panel.get_xaxis_transform(),
        )
        panel.set_title(f'{name} in {tracks[0].chain.root_frame} [m]', loc='left')
        panel.margins(x=0, y=0.12)
        panel.locator_params(axis='y', nbins=4)
    start, end = time_span(tracks)
    if start == end:
        start, end = start - 0.5, end + 0.5
    panels[0].set_xlim(start, end)
    panels[0].legend(
        loc='lower right',
        bbox_to_anchor=(1.0, 0.97),
        ncols=len(tracks),
        fontsize=11,
        borderpad=0,
        handlelength=1.2,
        columnspacing=1.2,
    )


def _draw_curve(panel: Axes, track: ChainTrack, column: int) -> None:
    """Draw a coordinate, or where samples are closer than can be seen the band they fill."""
    values = track.poses[:, column]
    if len(values) > _MOST_SAMPLES:
        _draw_band(panel, track, values)
        return
    breaks = _breaks(track.times)
    is_hardly_a_line = len(np.unique(track.times)) < 3
    panel.plot(
        np.insert(track.times, breaks, np.nan),
        np.insert(values, breaks, np.nan),
        color=color_of(track.chain),
        label=_label(track),
        linewidth=2,
        marker='o' if is_hardly_a_line else '',
    )


def _draw_band(panel: Axes, track: ChainTrack, values: Array) -> None:
    """Draw what lies between the lowest and the highest of neighbouring (N,) values."""
    color = color_of(track.chain)
    breaks = _breaks(track.times)
    columns = np.linspace(0, len(values), _COLUMNS).astype(int)
    edges = np.unique(np.concatenate([columns, breaks]))
    starts = edges[:-1]
    holes = np.searchsorted(edges, breaks)
    middle = np.add.reduceat(track.times, starts) / np.diff(edges)
    middle = np.insert(middle, holes, np.nan)
    lowest = np.insert(np.minimum.reduceat(values, starts), holes, np.nan)
    highest = np.insert(np.maximum.reduceat(values, starts), holes, np.nan)
    panel.fill_between(middle, lowest, highest, color=color, alpha=0.3, linewidth=0)
    panel.plot(middle, lowest, color=color, linewidth=1)
    panel.plot(middle, highest, color=color, linewidth=1, label=_label(track))


def _label(track: ChainTrack) -> str:
    return track.chain.tip.replace('_', ' ')


def _draw_outside_ranges(panel: Axes, rows: Sequence[OutOfRange]) -> None:
    """Draw a row of bars, with its name above it, per joint and end of its range."""
    start, end = panel.get_xlim()
    least = (end - start) / 300  # what can be seen
    for row, outside in enumerate(rows):
        bars = [(begin, max(finish - begin, least)) for begin, finish in outside.spans]
        panel.broken_barh(
            bars, (row + 0.55, 0.3), color=color_of(outside.chain), linewidth=0
        )
        panel.text(
            0.005,
            row + 0.5,
            outside.text,
            fontsize=10,
            transform=panel.get_yaxis_transform(),
        )
    panel.set_yticks([])
    panel.set_ylim(len(rows) + 0.1, -0.2)
    panel.set_title('outside its range', loc='left')


def _mark_instants(panels: Sequence[Axes], instants: Sequence[float]) -> None:
    """Draw a line at each instant, and its letter above the first panel."""
    start, end = panels[0].get_xlim()
    for panel in panels:
        for instant in instants:
            panel.axvline(instant, color=INK, linewidth=1, linestyle=(0, (1, 2)))
    right_of_last = start
    for letter, instant in zip(LETTERS, instants):
        at = max(
            instant, right_of_last
        )  # so that letters of near instants stand side by side
        right_of_last = at + 0.03 * (end - start)
        panels[0].text(
            at,
            0.99,
            letter,
            ha='center',
            va='top',
            weight='bold',
            fontsize=11,
            transform=panels[0].get_xaxis_transform(),
            bbox={'facecolor': 'white', 'linewidth': 0, 'pad': 0.5},
        )


def _draw_scenes(
    figure: Figure, tracks: Sequence[ChainTrack], instants: Sequence[float]
) -> Space:
    """Draw the chains in space at each instant; return the last view."""
    height = figure.get_figheight()
    columns = min(2, len(instants))
    rows = math.ceil(len(instants) / 2)
    places = figure.add_gridspec(
        rows,
        columns,
        left=0.53,
        right=0.995,
        top=1 - 0.95 / height,
        bottom=0.01,
        wspace=0.0,
        hspace=0.0,
    )
    points = []
    for instant in instants:
        for track in tracks:
            q = track.positions[track.nearest(instant)]
            points.append(track.chain.frames(q)[:, :3, 3])
    everywhere = np.vstack(points)
    for i, (letter, instant) in enumerate(zip(LETTERS, instants)):
        space = Space(figure, places[i], everywhere)
        _draw_scene(space, tracks, instant)
        space.axes.text2D(
            0.06,
            0.95,
            f'{letter}  {instant:.2f} s',
            weight='bold',
            transform=space.axes.transAxes,
        )
    return space


def _draw_scene(space: Space, tracks: Sequence[ChainTrack], instant: float) -> None:
    """Draw the root's axes, and the chains with their tips' paths, the nearest last."""
    space.frame(np.eye(4), 1.2 * space.step, 90)
    samples = [(track, track.nearest(instant)) for track in tracks]

    def depth(sample: tuple[ChainTrack, int]) -> float:
        track, i = sample
        return space.depth(track.chain.frames(track.positions[i])[:, :3, 3])

    for rank, (track, i) in enumerate(sorted(samples, key=depth)):
        zorder = 10.0 * (rank + 1)
        q = track.positions[i]
        around = np.abs(track.times - track.times[i]) <= _TRAIL
        space.line(
            track.poses[around, :3],
            color=color_of(track.chain),
            linewidth=1,
            alpha=0.5,
            zorder=zorder,
        )
        space.chain(track.chain, q, zorder)
        space.frame(track.chain.forward(q), space.step, zorder + 5, 1.8, size=8)


def _notes(tracks: Sequence[ChainTrack], any_outside: bool) -> str:
    """Return what explains the curves."""
    notes = []
    if not any_outside:
        notes.append('all joints inside their ranges')
    found = gaps(tracks)
    if found:
        longest = max(end - begin for begin, end in found)
        notes.append(f'grey: no pose, {longest:.2f} s at most')
    if any(len(track.times) > _MOST_SAMPLES for track in tracks):
        notes.append('bands: lowest to highest')
    return ';  '.join(notes)


def _spans(times: Array, mask: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Return from when to when [s] an (N,) mask holds, up to the sample after."""
    ends = np.flatnonzero(np.diff([False, *mask, False]))
    ends = np.minimum(ends, len(times) - 1)
    return [(begin, end) for begin, end in times[ends].reshape(-1, 2).tolist()]


def _breaks(times: Array) -> NDArray[np.intp]:
    """Return the indices of the samples that do not go on from the one before."""
    steps = np.diff(times)
    forward = steps[steps > 0]
    usual = np.median(forward) if len(forward) > 1 else np.inf
    return np.flatnonzero((steps > _GAP * usual) | (steps < 0)) + 1


def _round_step(least: float) -> float:
    """Return the smallest of 0.1, 0.2, 0.5, 1 and the like [m] that is not below a length."""
    least = max(least, 1e-4)
    decade = 10.0 ** math.floor(math.log10(least))
    for factor in (1, 2, 5):
        if factor * decade >= least:
            return factor * decade
    return 10 * decade
