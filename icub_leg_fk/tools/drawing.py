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
from typing import Any, TYPE_CHECKING

from icub_leg_fk.errors import LegFKError, MissingDependencyError, OutputFileError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.output_file import check_target, whole_path
from icub_leg_fk.tools.recording import ChainTrack, time_span
import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D

FORMATS = ('.png', '.svg', '.pdf')
AXIS_COLORS = ('#d62728', '#2ca02c', '#1f5fd0')  # x red, y green, z blue, as viewers have it
INK, FAINT, GRID, FLOOR = '#222222', '#6f6f6f', '#dddddd', '#f7f7f7'
_LEFT, _RIGHT = '#6a3d9a', '#e08214'  # told apart in every kind of colour vision
_OTHERS = ('#00798c', '#8c6d31', '#a8437c')
_WIDTH, _HEIGHT, _ROW = 13.333, 7.5, 0.3  # inches; a slide, and a row of bars
_COLUMNS = 800  # of a panel
_MOST_SAMPLES = 4 * _COLUMNS  # of a curve; more cannot be seen and become a band
_GAP = 5.0  # so many usual intervals without a pose are a gap
_TRAIL = 0.5  # s of a tip's path before and after an instant
_SETTINGS = {
    'font.family': 'sans-serif', 'font.sans-serif': ['DejaVu Sans'], 'font.size': 12,
    'axes.titlesize': 12, 'axes.titleweight': 'bold',
    'axes.edgecolor': FAINT, 'axes.spines.top': False, 'axes.spines.right': False,
    'axes.grid': True, 'axes.axisbelow': True, 'grid.color': GRID, 'xtick.color': FAINT,
    'ytick.color': FAINT, 'xtick.labelcolor': INK, 'ytick.labelcolor': INK, 'text.color': INK,
    'axes.labelcolor': INK, 'legend.frameon': False, 'svg.fonttype': 'none',
    'svg.hashsalt': 'leg_fk', 'pdf.fonttype': 42}


@contextmanager
def _plain_matplotlib() -> Iterator[None]:
    """Let matplotlib be imported and used with its own defaults and this module's settings."""
    os.environ |= {'MPLBACKEND': 'agg', 'MATPLOTLIBRC': os.devnull}
    logging.getLogger('matplotlib').setLevel(logging.CRITICAL)  # what it says of a matplotlibrc
    try:
        from matplotlib import rc_context, rcdefaults, rcParams
    except ImportError as error:
        raise MissingDependencyError('pictures need matplotlib: pip install matplotlib (rosdep '
                                     'key python3-matplotlib)') from error
    except ValueError as error:  # a matplotlibrc in the working directory that is not text
        raise LegFKError(f'matplotlib cannot be imported: {error}; is there a file matplotlibrc '
                         'in this directory?') from error
    with rc_context():
        rcdefaults()
        rcParams.update(_SETTINGS)  # type: ignore[arg-type]
        yield


def check_output(path: Path, force: bool) -> None:
    """Refuse a picture that cannot be, before any work is done for it."""
    with _plain_matplotlib():
        pass
    if path.suffix.lower() not in FORMATS:
        raise OutputFileError(f'{path}: found {path.suffix or "no ending"}, allowed: '
                              f'{", ".join(FORMATS)}')
    check_target(path, force=force)


def save_picture(draw: Callable[[], Figure], path: Path, *, force: bool, dpi: int = 150) -> None:
    """Draw a picture and write it in the format that its ending names, whole or not at all."""
    kind = path.suffix.lower().lstrip('.')
    metadata = {'svg': {'Date': None}, 'pdf': {'CreationDate': None}}.get(kind)  # no dates
    try:
        with _plain_matplotlib(), whole_path(path, force=force) as new:
            draw().savefig(new, format=kind, dpi=dpi, metadata=metadata)
    except ValueError as error:
        raise LegFKError(f'{path}: cannot be drawn: {error}') from error


def feet_figure(tracks: Sequence[ChainTrack], instants: Sequence[float], title: str
                ) -> Figure:
    """Return the tips over time, and beside them the chains in space at up to four instants [s].

    """
    from matplotlib.figure import Figure

    rows = [(track.chain, *outside) for track in tracks for outside in outside_ranges(track)]
    height = _HEIGHT + _ROW * max(0, len(rows) - 1)
    figure = Figure(figsize=(_WIDTH, height))
    panels = figure.subplots(3 + bool(rows), sharex=True, gridspec_kw={
        'left': 0.075, 'right': 0.5, 'top': 1 - 1.35 / height, 'bottom': 0.65 / height,
        'hspace': 0.42, 'height_ratios': [1, 1, 1, _ROW * (len(rows) + 0.3) / 1.6][
            :3 + bool(rows)]})
    _draw_tips(panels[:3], tracks)
    if rows:
        _draw_outside_ranges(panels[3], rows)
    panels[-1].set_xlabel('time [s]')
    _mark_instants(panels[:3], instants)
    spaces = figure.add_gridspec(
        -(-len(instants) // 2), min(2, len(instants)), left=0.53, right=0.995,
        top=1 - 0.95 / height, bottom=0.01, wspace=0.0, hspace=0.0)
    scenes = [[(track, int(np.abs(track.times - instant).argmin())) for track in tracks]
              for instant in instants]
    points = np.vstack([track.chain.frames(track.positions[i])[:, :3, 3]
                        for scene in scenes for track, i in scene])
    for i, (scene, instant) in enumerate(zip(scenes, instants)):
        space = Space(figure, spaces[i], points)
        _draw_scene(space, scene)
        space.axes.text2D(0.06, 0.95, f'{"ABCD"[i]}  {instant:.2f} s', weight='bold',
                          transform=space.axes.transAxes)
    frames = ', '.join(dict.fromkeys(
        [tracks[0].chain.root_frame, *(track.chain.frame_id for track in tracks)]))
    figure.text(0.03, 1 - 0.35 / height, title, fontsize=19, weight='bold', va='center')
    for x, side, words in ((0.03, 'left', _notes(tracks, bool(rows))),
                           (0.985, 'right', f'axes of {frames};  squares of {space.step:g} m')):
        figure.text(x, 1 - 0.8 / height, words, fontsize=10.5, ha=side, va='center', color=FAINT)
    return figure


def outside_ranges(track: ChainTrack) -> list[tuple[str, list[tuple[float, float]]]]:
    """Return where joints are beyond an end of their range: which end, and spans of time [s]."""
    found = []
    chain, last = track.chain, len(track.times) - 1
    for name, link, q in zip(chain.joint_names, chain.joints, track.positions.T, strict=True):
        lower, upper = link.limits
        for outside, sign, limit in ((q < lower, '<', lower), (q > upper, '>', upper)):
            if outside.any():
                value = f'{limit:g} m' if link.is_prismatic else f'{math.degrees(limit):g}°'
                ends = np.minimum(np.flatnonzero(np.diff([False, *outside, False])), last)
                spans = [(start, end) for start, end in track.times[ends].reshape(-1, 2).tolist()]
                found.append((f'{name} {sign} {value}'.replace('-', '\N{MINUS SIGN}'), spans))
    return found


def gaps(tracks: Sequence[ChainTrack]) -> list[tuple[float, float]]:
    """Return the spans [s] in which a chain has no pose although it should, each once."""
    return sorted({(float(track.times[i - 1]), float(track.times[i])) for track in tracks
                   for i in _breaks(track.times) if track.times[i] > track.times[i - 1]})


def color_of(chain: Chain) -> str:
    """Return a chain's colour: one for everything left, one for everything right."""
    return next((color for word, color in (('left', _LEFT), ('right', _RIGHT))
                 if word in chain.tip + chain.name),
                _OTHERS[sum(map(ord, chain.name)) % len(_OTHERS)])


class Space:
    """A view of a part of space in parallel projection, in which every direction keeps its scale.

    It shows `points` (N, 3) and the root's axes [m], from azimuth and elevation [deg], above a
    floor with a line every `step` [m].
    """

    def __init__(self, figure: Figure, place: Any, points: Array, azimuth: float = 210.0,
                 elevation: float = 18.0, zoom: float = 1.15) -> None:
        self.axes: Axes3D = figure.add_subplot(
            place, projection='3d', proj_type='ortho', computed_zorder=False)
        self.axes.view_init(elevation, azimuth)
        self.axes.set_axis_off()
        az, el = math.radians(azimuth), math.radians(elevation)
        self._toward_viewer = np.array([
            math.cos(el) * math.cos(az), math.cos(el) * math.sin(az), math.sin(el)])
        self._rightward = np.array([-math.sin(az), math.cos(az), 0.0])
        points = np.vstack((points, np.zeros((1, 3))))
        least = max(float(np.ptp(points, axis=0).max()) / 7, 1e-4)
        decade = 10.0 ** math.floor(math.log10(least))  # the step is 0.1, 0.2, 0.5, 1 or the like
        self.step = next(decade * round_ for round_ in (1, 2, 5, 10) if decade * round_ >= least)
        lowest = np.floor(points.min(axis=0) / self.step - 1) * self.step
        highest = np.ceil(points.max(axis=0) / self.step + 1) * self.step
        lowest[2] = low = float(points[:, 2].min())
        self.axes.set(**{f'{axis}lim': ends for axis, ends in zip(
            'xyz', zip(lowest.tolist(), highest.tolist()))})
        self.axes.set_box_aspect(highest - lowest, zoom=zoom)
        xs, ys = (np.arange(start, end + self.step / 2, self.step)
                  for start, end in zip(lowest[:2], highest[:2]))
        self.fill([(xs[i], ys[j], low) for i, j in ((0, 0), (-1, 0), (-1, -1), (0, -1))], FLOOR, 0)
        for x, y in (*((x, ys[[0, -1]]) for x in xs), *((xs[[0, -1]], y) for y in ys)):
            self.line(np.transpose(np.broadcast_arrays(x, y, [low] * 2)), color=GRID, linewidth=1,
                      zorder=1)

    def depth(self, points: Array) -> float:
        """Return how near the middle of some points is to the viewer [m]; larger is nearer."""
        return float(np.mean(points @ self._toward_viewer))

    def line(self, points: ArrayLike, **style: Any) -> None:
        """Draw a line through (N, 3) points of the root frame."""
        self.axes.plot(*np.transpose(points), clip_on=False, **style)

    def fill(self, corners: ArrayLike, color: str, zorder: float, alpha: float = 1.0) -> None:
        """Fill a polygon of (N, 3) corners."""
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        self.axes.add_collection3d(Poly3DCollection(
            [np.asarray(corners)], facecolor=color, alpha=alpha, zorder=zorder, clip_on=False))

    def frame(self, T: Array, length: float, zorder: float, width: float = 2.0,
              labels: Sequence[str] = 'xyz', size: float = 9.0) -> None:
        """Draw the axes of a (4, 4) frame with their names, the nearest last."""
        origin = T[:3, 3]
        for i in sorted(range(3), key=lambda i: self.depth(T[:3, i])):
            self.axes.quiver(*origin, *(length * T[:3, i]), color=AXIS_COLORS[i], clip_on=False,
                             linewidth=width, arrow_length_ratio=0.3, zorder=zorder)
            aside = float(T[:3, i] @ self._rightward)
            self.axes.text(*(origin + 1.2 * length * T[:3, i]), labels[i], fontsize=size,
                           color=AXIS_COLORS[i], weight='bold', va='center', zorder=zorder + 1,
                           ha='center' if abs(aside) < 0.3 else 'left' if aside > 0 else 'right')

    def chain(self, chain: Chain, q: ArrayLike, zorder: float) -> None:
        """Draw a chain's skeleton from the root to its tip, its joints, and its sole if any."""
        points, color = chain.frames(q)[:, :3, 3], color_of(chain)
        self.line([(0.0, 0.0, 0.0), points[0]], color=FAINT, linewidth=2.5, zorder=zorder,
                  linestyle=(0, (2, 1.2)))
        corners = chain.sole_outline(q)
        if corners is not None:
            self.fill(corners, color, zorder, 0.3)
        self.line(points, color='white', linewidth=8, zorder=zorder + 1)
        self.line(points, color=color, linewidth=4, zorder=zorder + 2, solid_joinstyle='round')
        self.line(points[:-1], color=color, linestyle='', marker='o', markersize=6.5,
                  markerfacecolor='white', markeredgewidth=1.8, zorder=zorder + 3)


def _draw_scene(space: Space, scene: Sequence[tuple[ChainTrack, int]]) -> None:
    space.frame(np.eye(4), 1.2 * space.step, 90)
    nearest_last = sorted(scene, key=lambda sample: space.depth(
        sample[0].chain.frames(sample[0].positions[sample[1]])[:, :3, 3]))
    for rank, (track, i) in enumerate(nearest_last):
        chain, q, zorder = track.chain, track.positions[i], 10.0 * (rank + 1)
        around = np.abs(track.times - track.times[i]) <= _TRAIL
        space.line(track.poses[around, :3], color=color_of(chain), linewidth=1, alpha=0.5,
                   zorder=zorder)
        space.chain(chain, q, zorder)
        space.frame(chain.forward(q), space.step, zorder + 5, 1.8, size=8)


def _draw_tips(panels: Sequence[Axes], tracks: Sequence[ChainTrack]) -> None:
    found = gaps(tracks)
    for panel, (name, column) in zip(panels, (('z', 2), ('x', 0), ('y', 1)), strict=True):
        for track in tracks:
            _draw_curve(panel, track, column)
        panel.broken_barh([(a, b - a) for a, b in found], (0, 1), color='black', alpha=0.12,
                          linewidth=0, transform=panel.get_xaxis_transform())
        panel.set_title(f'{name} in {tracks[0].chain.root_frame} [m]', loc='left')
        panel.margins(x=0, y=0.12)
        panel.locator_params(axis='y', nbins=4)
    start, end = time_span(tracks)
    panels[0].set_xlim((start, end) if end > start else (start - 0.5, end + 0.5))
    panels[0].legend(loc='lower right', bbox_to_anchor=(1.0, 0.97), ncols=len(tracks), fontsize=11,
                     borderpad=0, handlelength=1.2, columnspacing=1.2)


def _notes(tracks: Sequence[ChainTrack], any_outside: bool) -> str:
    notes = [] if any_outside else ['all joints inside their ranges']
    if found := gaps(tracks):
        notes.append(f'grey: no pose, {max(b - a for a, b in found):.2f} s at most')
    if any(len(track.times) > _MOST_SAMPLES for track in tracks):
        notes.append('bands: lowest to highest')
    return ';  '.join(notes)


def _draw_curve(panel: Axes, track: ChainTrack, column: int) -> None:
    """Draw a coordinate, or where samples are closer than can be seen the band they fill."""
    color, label = color_of(track.chain), track.chain.tip.replace('_', ' ')
    times, values, breaks = track.times, track.poses[:, column], _breaks(track.times)
    if len(times) <= _MOST_SAMPLES:
        panel.plot(np.insert(times, breaks, np.nan), np.insert(values, breaks, np.nan),
                   color=color, label=label, linewidth=2,
                   marker='o' if len(np.unique(times)) < 3 else '')
        return
    edges = np.unique(np.r_[np.linspace(0, len(times), _COLUMNS).astype(int), breaks])
    starts, holes = edges[:-1], np.searchsorted(edges, breaks)
    middle, lowest, highest = (np.insert(column, holes, np.nan) for column in (
        np.add.reduceat(times, starts) / np.diff(edges),
        np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)))
    panel.fill_between(middle, lowest, highest, color=color, alpha=0.3, linewidth=0)
    panel.plot(middle, lowest, color=color, linewidth=1)
    panel.plot(middle, highest, color=color, linewidth=1, label=label)


def _draw_outside_ranges(panel: Axes, rows: Sequence[tuple[Chain, str, list[tuple[float, float]]]]
                         ) -> None:
    """Draw a row of bars, with its name above it, per joint and end of its range."""
    start, end = panel.get_xlim()
    least = (end - start) / 300  # what can be seen
    for row, (chain, name, spans) in enumerate(rows):
        panel.broken_barh([(a, max(b - a, least)) for a, b in spans], (row + 0.55, 0.3),
                          color=color_of(chain), linewidth=0)
        panel.text(0.005, row + 0.5, name, fontsize=10, transform=panel.get_yaxis_transform())
    panel.set_yticks([])
    panel.set_ylim(len(rows) + 0.1, -0.2)
    panel.set_title('outside its range', loc='left')


def _mark_instants(panels: Sequence[Axes], instants: Sequence[float]) -> None:
    start, end = panels[0].get_xlim()
    for panel in panels:
        for instant in instants:
            panel.axvline(instant, color=INK, linewidth=1, linestyle=(0, (1, 2)))
    right_of_last = start
    for letter, instant in zip('ABCD', instants):
        at = max(instant, right_of_last)  # so that letters of near instants stand side by side
        right_of_last = at + 0.03 * (end - start)
        panels[0].text(at, 0.99, letter, ha='center', va='top', weight='bold', fontsize=11,
                       transform=panels[0].get_xaxis_transform(),
                       bbox={'facecolor': 'white', 'linewidth': 0, 'pad': 0.5})


def _breaks(times: Array) -> NDArray[np.intp]:
    """Return the indices of the samples that do not go on from the one before."""
    steps = np.diff(times)
    forward = steps[steps > 0]
    usual = np.median(forward) if len(forward) > 1 else np.inf
    return np.flatnonzero((steps > _GAP * usual) | (steps < 0)) + 1
