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
from typing import Any, TYPE_CHECKING

from icub_leg_fk.errors import LegFKError, MissingDependencyError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.colors import color_of
from icub_leg_fk.tools.output_file import check_target, whole_path
from icub_leg_fk.tools.space import Box, FAINT, GRID, Space
from icub_leg_fk.tools.tracks import ChainTrack, COORDINATES, OutOfRange, time_span
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

FORMATS = ('.png', '.svg', '.pdf')
INK = '#222222'
MINUS = '\N{MINUS SIGN}'
LETTERS = 'ABCD'  # of the instants at which the chains are drawn

# Lengths are inches. From the top: title, notes, legend, and panels below each other; beside them
# the chains in space.
_TITLE = 0.35
_NOTES = 0.78
_LEGEND = 1.1
_TOP = 1.3
_LEFT = 1.0
_PANEL = 5.65
_BETWEEN = 1.0  # two columns of panels
_SCENES = 6.2
_TALLEST = 6.5  # of the scenes
_BESIDE = 0.45  # panels and scenes
_MARGIN = 0.15
_CURVE = 1.4  # height of a panel of curves
_HEADING = 0.4  # of a panel, above it
_LETTER = 0.2  # of the instants, above the first panel
_BAR_ROW = 0.36  # a bar and its name
_FOOT = 0.62
_COLUMNS = 800  # of a panel
_MOST_SAMPLES = 4 * _COLUMNS  # of a curve; more cannot be seen and become a band
_TRAIL = 0.5  # s of a tip's path before and after an instant
_POSITION = ('z', 'x', 'y')
_ORIENTATION = ('roll', 'pitch', 'yaw')
_LEAST_SPANS = (0.01, 1.0)  # m and deg; smaller movements are hardly meant to be seen
_LONGEST_NAME = 45  # characters of a joint's
_OVER: dict[str, Any] = {'linewidth': 1.5, 'linestyle': (0, (4, 2)), 'alpha': 0.6}
_SETTINGS: dict[str, Any] = {
    'font.family': 'sans-serif',
    'font.sans-serif': ['DejaVu Sans'],
    'font.size': 12,
    'axes.titlesize': 12,
    'axes.titleweight': 'bold',
    'axes.titlelocation': 'left',
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


def import_matplotlib() -> ModuleType:
    """Return the package matplotlib with its modules of figures, lines and bitmaps."""
    os.environ |= {'MPLBACKEND': 'agg', 'MATPLOTLIBRC': os.devnull}
    logging.getLogger('matplotlib').setLevel(
        logging.CRITICAL
    )  # what it says of a matplotlibrc
    try:
        import matplotlib.backends.backend_agg
        import matplotlib.figure
        import matplotlib.lines
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
    return matplotlib


@contextmanager
def own_settings() -> Iterator[None]:
    """Let matplotlib draw with its defaults and this module's settings."""
    matplotlib = import_matplotlib()
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        yield


def check_output(path: str | Path, force: bool) -> None:
    """Refuse a picture that cannot be, before any work is done for it."""
    import_matplotlib()
    check_target(path, force=force, endings=FORMATS)


def save_picture(
    draw: Callable[[], Figure], path: str | Path, *, force: bool, dpi: int = 150
) -> None:
    """Draw a picture and write it in the format that its ending names, whole or not at all."""
    kind = Path(path).suffix.lower().lstrip('.')
    no_date = {'svg': {'Date': None}, 'pdf': {'CreationDate': None}}
    try:
        with own_settings(), whole_path(path, force=force) as new:
            draw().savefig(new, format=kind, dpi=dpi, metadata=no_date.get(kind))
    except ValueError as error:
        raise LegFKError(f'{path}: cannot be drawn: {error}') from error


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size in inches."""
    matplotlib = import_matplotlib()
    figure: Figure = matplotlib.figure.Figure(figsize=(width, height))
    matplotlib.backends.backend_agg.FigureCanvasAgg(figure)  # which can measure text
    return figure


def feet_figure(
    tracks: Sequence[ChainTrack],
    instants: Sequence[float],
    title: str,
    *,
    over: Sequence[ChainTrack] = (),
    over_name: str = '',
    orientation: bool = False,
) -> Figure:
    """Return the tips over time, and beside them the chains in space.

    Args:
        tracks: what the chains did.
        instants: up to four times at which the chains are drawn [s].
        title: what stands above.
        over: what chains did in another recording, over which the first is drawn.
        over_name: name of that recording.
        orientation: whether roll, pitch and yaw are drawn, too.
    """
    outside = [each for track in tracks for each in track.outside]
    columns = (_POSITION, _ORIENTATION) if orientation else (_POSITION,)
    layout = _Layout(len(columns), len(outside))
    figure = new_figure(layout.width, layout.height)
    panels = []
    for i, names in enumerate(columns):
        panels.append(_draw_tips(figure, layout, i, names, tracks, over))
    for column in panels:
        _mark_instants(column, instants)
    if outside:
        panels[0].append(layout.panel(figure, 0, len(_POSITION), panels[0][0]))
        _draw_outside_ranges(panels[0][-1], outside)
    for column in panels:
        column[-1].tick_params(labelbottom=True)
        column[-1].set_xlabel('time [s]')
    step = _draw_scenes(figure, layout.scenes, tracks, over, instants)
    _draw_legend(figure, layout, tracks, over, over_name)
    notes = _notes(tracks, bool(outside))
    _draw_words(figure, layout, title, notes, _notes_on_space(tracks, step))
    return figure


class _Layout:
    """Where things are in a figure [inches].

    Args:
        columns: columns of panels.
        bars: joints and ends of their ranges that have a bar.

    Attributes:
        width: of the figure.
        height: of the figure.
        scenes: where the chains are drawn in space.
    """

    def __init__(self, columns: int, bars: int) -> None:
        self._bars = bars
        beside = _LEFT + columns * _PANEL + (columns - 1) * _BETWEEN + _BESIDE
        self.width = beside + _SCENES + _MARGIN
        height = _TOP + _LETTER + 3 * (_HEADING + _CURVE) + _FOOT
        if bars:
            height += _HEADING + bars * _BAR_ROW
        self.height = height
        tall = min(height - _TOP + 0.1 - _MARGIN, _TALLEST)
        self.scenes = Box(beside, height - _TOP + 0.1 - tall, _SCENES, tall)

    def panel(self, figure: Figure, column: int, row: int, share: Axes | None) -> Axes:
        """Return the axes of a row, from the top, of which the fourth is for bars."""
        top = self.height - _TOP - _LETTER - row * (_HEADING + _CURVE) - _HEADING
        height = self._bars * _BAR_ROW if row == len(_POSITION) else _CURVE
        left = _LEFT + column * (_PANEL + _BETWEEN)
        rectangle = (
            left / self.width,
            (top - height) / self.height,
            _PANEL / self.width,
            height / self.height,
        )
        return figure.add_axes(rectangle, sharex=share)


def _draw_tips(
    figure: Figure,
    layout: _Layout,
    column: int,
    names: Sequence[str],
    tracks: Sequence[ChainTrack],
    over: Sequence[ChainTrack],
) -> list[Axes]:
    """Draw a coordinate of all tips in each panel of a column."""
    panels: list[Axes] = []
    gaps = {gap for track in tracks for gap in track.gaps}
    bars = [(begin, end - begin) for begin, end in sorted(gaps)]
    start, end = time_span([*tracks, *over])
    if start == end:
        start, end = start - 0.5, end + 0.5
    for row, name in enumerate(names):
        panel = layout.panel(figure, column, row, panels[0] if panels else None)
        panels.append(panel)
        _draw_curves(panel, name, tracks, over)
        panel.broken_barh(
            bars,
            (0, 1),
            color='black',
            alpha=0.12,
            linewidth=0,
            transform=panel.get_xaxis_transform(),
        )
        panel.set_title(
            _heading(name, tracks[0].chain),
            loc='left',
            pad=6 if row else 6 + _LETTER * 72,
        )
        panel.margins(x=0, y=0.12)
        _show_no_noise(panel, _LEAST_SPANS[name in _ORIENTATION])
        panel.locator_params(axis='y', nbins=4)
        panel.ticklabel_format(style='plain', useOffset=False)
        panel.tick_params(labelbottom=False)
    panels[0].set_xlim(start, end)
    return panels


def _show_no_noise(panel: Axes, least: float) -> None:
    """Let the values of a panel span so much at least."""
    low, high = panel.get_ylim()
    missing = least - (high - low)
    if missing > 0:
        panel.set_ylim(low - missing / 2, high + missing / 2)


def _draw_curves(
    panel: Axes, name: str, tracks: Sequence[ChainTrack], over: Sequence[ChainTrack]
) -> None:
    """Draw a coordinate of all tips; where two are the same, both can be seen."""
    for track in over:
        _draw_curve(panel, track, name, **_OVER)
    for track in tracks:
        _draw_curve(panel, track, name, linewidth=2)
    for i, track in enumerate(tracks[:-1]):
        _draw_curve(panel, track, name, linewidth=2, linestyle=(5 * i, (5, 10)))


def _draw_curve(panel: Axes, track: ChainTrack, name: str, **style: Any) -> None:
    """Draw a coordinate, or where samples are closer than can be seen the band they fill."""
    column = COORDINATES.index(name)
    factor = math.degrees(1.0) if name in _ORIENTATION else 1.0
    lowest = factor * track.lowest[:, column]
    highest = factor * track.highest[:, column]
    color = color_of(track.chain)
    if len(lowest) > _MOST_SAMPLES:
        _draw_band(
            panel, track, lowest, highest, {**style, 'color': color, 'linewidth': 1}
        )
        return
    is_hardly_a_line = len(np.unique(track.times)) < 3
    panel.plot(
        np.insert(track.times, track.breaks, np.nan),
        np.insert(lowest, track.breaks, np.nan),
        color=color,
        marker='o' if is_hardly_a_line else '',
        **style,
    )


def _draw_band(
    panel: Axes, track: ChainTrack, lowest: Array, highest: Array, style: dict[str, Any]
) -> None:
    """Draw what lies between the lowest and the highest of neighbouring (N,) values."""
    columns = np.linspace(0, len(lowest), _COLUMNS).astype(int)
    edges = np.unique(np.concatenate([columns, track.breaks]))
    starts = edges[:-1]
    holes = np.searchsorted(edges, track.breaks)
    times = np.add.reduceat(track.times, starts) / np.diff(edges)
    times = np.insert(times, holes, np.nan)
    lowest = np.insert(np.minimum.reduceat(lowest, starts), holes, np.nan)
    highest = np.insert(np.maximum.reduceat(highest, starts), holes, np.nan)
    panel.plot(times, lowest, **style)
    panel.plot(times, highest, **style)
    if 'linestyle' not in style:
        panel.fill_between(
            times, lowest, highest, color=style['color'], alpha=0.3, linewidth=0
        )


def _heading(name: str, chain: Chain) -> str:
    """Return what stands above a panel: what is drawn, and which way its axis points."""
    axis = 'xyz'.find(name) if name in _POSITION else _ORIENTATION.index(name)
    direction = f' ({chain.root_axes[axis]})' if chain.root_axes else ''
    if name in _POSITION:
        return f'{name}{direction} in {_short(chain.root_frame)} [m]'
    return f'{name} about {"xyz"[axis]}{direction} from q = 0 [°]'


def _draw_outside_ranges(panel: Axes, rows: Sequence[OutOfRange]) -> None:
    """Draw a row per joint and end of its range: its name, and bars below."""
    start, end = panel.get_xlim()
    least = (end - start) / 300  # what can be seen
    for row, outside in enumerate(rows):
        bars = [(begin, max(finish - begin, least)) for begin, finish in outside.spans]
        panel.broken_barh(
            bars, (row + 0.6, 0.3), color=color_of(outside.chain), linewidth=0
        )
        panel.text(
            0.005,
            row + 0.54,
            range_end(outside),
            fontsize=10,
            va='bottom',
            transform=panel.get_yaxis_transform(),
        )
    panel.set_yticks([])
    panel.set_ylim(len(rows), 0)
    panel.set_title('outside its range', loc='left')


def range_end(outside: OutOfRange) -> str:
    """Return which end of which joint's range is passed: `l_knee > 4°`."""
    chain = outside.chain
    link = chain.joints[outside.joint]
    limit = link.limits[outside.is_above]
    value = f'{limit:g} m' if link.is_prismatic else f'{math.degrees(limit):g}°'
    sign = '>' if outside.is_above else '<'
    return (
        f'{_short(chain.joint_names[outside.joint])} {sign} {value.replace("-", MINUS)}'
    )


def _mark_instants(panels: Sequence[Axes], instants: Sequence[float]) -> None:
    """Draw a line at each instant, and its letter above the first panel, clear of the others."""
    start, end = panels[0].get_xlim()
    for panel in panels:
        for instant in instants:
            panel.axvline(instant, color=INK, linewidth=1, linestyle=(0, (1, 2)))
    gap = 0.035 * (end - start)
    places: list[float] = []
    for instant in instants:
        places.append(max(instant, places[-1] + gap) if places else instant)
    last = end
    for i in reversed(range(len(places))):
        places[i] = min(places[i], last)
        last = places[i] - gap
    for letter, place in zip(LETTERS, places):
        panels[0].text(
            place,
            1.02,
            letter,
            ha='center',
            va='bottom',
            weight='bold',
            fontsize=11,
            transform=panels[0].get_xaxis_transform(),
        )


def _draw_scenes(
    figure: Figure,
    box: Box,
    tracks: Sequence[ChainTrack],
    over: Sequence[ChainTrack],
    instants: Sequence[float],
) -> float:
    """Draw the chains in space at each instant; return the side of the floor's squares [m]."""
    columns = min(2, len(instants))
    rows = math.ceil(len(instants) / 2)
    width = box.width / columns
    height = box.height / rows
    points = [each.points_at(t) for each in (*tracks, *over) for t in instants]
    everywhere = np.vstack(points)
    for i, instant in enumerate(instants):
        left = box.left + width * (i % columns)
        bottom = box.bottom + height * (rows - 1 - i // columns)
        space = Space(figure, Box(left, bottom, width, height - _HEADING), everywhere)
        _draw_scene(space, tracks, over, instant)
        words = f'{LETTERS[i]}  {instant:.2f} s'
        figure.text(
            (left + 0.2) / figure.get_figwidth(),
            (bottom + height - _HEADING / 2) / figure.get_figheight(),
            words,
            weight='bold',
            va='center',
        )
    return space.step


def _draw_scene(
    space: Space,
    tracks: Sequence[ChainTrack],
    over: Sequence[ChainTrack],
    instant: float,
) -> None:
    """Draw the root's axes and the chains that have a pose, the nearest last."""
    space.root()
    for track in over:
        if track.covers(instant):
            space.chain(track.chain, track.positions_at(instant), 5, alpha=0.3)
    there = [track for track in tracks if track.covers(instant)]
    there.sort(key=lambda track: space.depth(track.points_at(instant)))
    for rank, track in enumerate(there):
        zorder = 10.0 * (rank + 1)
        q = track.positions_at(instant)
        space.line(
            track.path_around(instant, _TRAIL),
            color=color_of(track.chain),
            linewidth=1,
            alpha=0.5,
            zorder=zorder,
        )
        space.chain(track.chain, q, zorder)
        space.frame(track.chain.forward(q), space.step, zorder + 5, 1.8, size=8)


def _draw_legend(
    figure: Figure,
    layout: _Layout,
    tracks: Sequence[ChainTrack],
    over: Sequence[ChainTrack],
    over_name: str,
) -> None:
    """Draw what the lines are, in a row that is as wide as the figure at most."""
    styles: dict[str, dict[str, Any]] = {}
    for track in tracks:
        styles[_label(track)] = {'color': color_of(track.chain), 'linewidth': 2}
    for track in over:
        label = f'{_label(track)}, {over_name}'
        styles[label] = {'color': color_of(track.chain), **_OVER}
    trail = f'path of a tip, {_TRAIL:g} s before and after'
    styles[trail] = {'color': FAINT, 'linewidth': 1, 'alpha': 0.5}
    Line2D = import_matplotlib().lines.Line2D
    lines = {label: Line2D([], [], **style) for label, style in styles.items()}
    legend = figure.legend(
        lines.values(),
        lines.keys(),
        ncols=len(lines),
        loc='center left',
        fontsize=11,
        borderpad=0,
        borderaxespad=0,
        handlelength=1.4,
        columnspacing=1.6,
        bbox_to_anchor=(_LEFT / layout.width, 1 - _LEGEND / layout.height),
    )
    _fit(figure, legend.get_texts(), layout.width - _LEFT - _MARGIN - 0.6 * len(lines))


def _draw_words(
    figure: Figure, layout: _Layout, title: str, notes: str, notes_on_space: str
) -> None:
    """Write what stands above the panels and the scenes."""

    def write(left: float, top: float, words: str, room: float, **style: Any) -> None:
        text = figure.text(
            left / layout.width, 1 - top / layout.height, words, va='center', **style
        )
        _fit(figure, [text], room)

    beside = layout.scenes.left
    write(0.4, _TITLE, title, layout.width - 0.4 - _MARGIN, fontsize=19, weight='bold')
    write(0.4, _NOTES, notes, beside - 0.6, fontsize=10.5, color=FAINT)
    write(
        beside + 0.2, _NOTES, notes_on_space, _SCENES - 0.2, fontsize=10.5, color=FAINT
    )


def _fit(figure: Figure, texts: Sequence[Text], room: float) -> None:
    """Make texts beside each other so small that they need no more than some inches in all."""
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    width = sum(text.get_window_extent(renderer).width for text in texts) / figure.dpi
    if width > room:
        for text in texts:
            text.set_fontsize(float(text.get_fontsize()) * room / width)


def _notes(tracks: Sequence[ChainTrack], any_outside: bool) -> str:
    """Return what explains the curves."""
    notes = []
    if not any_outside:
        notes.append('all joints inside their ranges')
    gaps = [end - begin for track in tracks for begin, end in track.gaps]
    if gaps:
        notes.append(f'grey: no pose, {max(gaps):.2f} s at most')
    if any(len(track.times) > _MOST_SAMPLES for track in tracks):
        notes.append('bands: lowest to highest')
    return ';  '.join(notes)


def _notes_on_space(tracks: Sequence[ChainTrack], step: float) -> str:
    """Return what explains the scenes."""
    frames = [tracks[0].chain.root_frame, *(track.chain.frame_id for track in tracks)]
    named = ', '.join(_short(frame) for frame in dict.fromkeys(frames))
    return f'axes x, y, z of {named};  squares of {step:g} m'


def _label(track: ChainTrack) -> str:
    return _short(track.chain.tip.replace('_', ' '))


def _short(name: str) -> str:
    """Return a name, cut off if it is very long."""
    return name if len(name) <= _LONGEST_NAME else f'{name[:_LONGEST_NAME]}...'
