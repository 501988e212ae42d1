"""Whole pictures: feet over time with the legs at some instants, and a walk in space."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.drawing import legs as legs
from icub_leg_fk.tools.drawing import over_time as over_time
from icub_leg_fk.tools.drawing.scene import Stage, TRAIL
from icub_leg_fk.tools.drawing.style import (
    AXIS_COLORS,
    color_of,
    FAINT,
    INK,
    label_of,
    MINUS,
    SLIDE,
)
from icub_leg_fk.tools.recording import ChainTrack
import numpy as np

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure


def feet_figure(tracks: Sequence[ChainTrack], instants: Sequence[float], title: str,
                soled: Collection[str]) -> Figure:
    """Return the tips over time, and below each other the chains in space at some instants.

    Args:
        tracks: what the chains did; at least one sample each.
        instants: times [s] at which to draw the chains, at most four.
        title: what the picture shows.
        soled: names of the chains that end in a foot.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=SLIDE)
    found = [(color_of(track.chain), violation) for track in tracks
             for violation in over_time.violations(track)]
    left, right, top, bottom = 0.075, 0.52, 0.83, 0.085
    strip = 0.045 + 0.026 * len(found) if found else 0.0
    grid = figure.add_gridspec(
        3 + bool(found), 1, left=left, right=right, top=top, bottom=bottom, hspace=0.42,
        height_ratios=[1, 1, 1, *([strip / 0.2] if found else [])])
    panels = [figure.add_subplot(grid[i]) for i in range(3)]
    over_time.draw_tips(panels, tracks)
    lowest = panels[-1]
    if found:
        lowest = figure.add_subplot(grid[3], sharex=panels[0])
        over_time.draw_violations(lowest, found)
        panels[-1].tick_params(labelbottom=False)
    lowest.set_xlabel('time [s]')
    over_time.mark_instants(panels, instants)
    _title(figure, title, tracks)
    spaces = figure.add_gridspec(
        -(-len(instants) // 2), min(2, len(instants)), left=0.56, right=0.99, top=top + 0.045,
        bottom=0.03, wspace=0.02, hspace=0.04)
    views = [legs.View(figure.add_subplot(spaces[i])) for i in range(len(instants))]
    scenes = [[(track, int(np.abs(track.times - instant).argmin())) for track in tracks]
              for instant in instants]
    stage = Stage.around([sample for scene in scenes for sample in scene], soled)
    for view, scene, letter, instant in zip(views, scenes, over_time.letters(), instants):
        stage.draw(view, scene)
        view.axes.set_title(f'{letter}  {instant:.2f} s', x=0.04, y=0.93)
    stage.frame(views)
    _axes_legend(figure, tracks, stage)
    return figure


def walk_figure(tracks: Sequence[ChainTrack], paths: Sequence[Array], title: str,
                soled: Collection[str]) -> Figure:
    """Return the chains in space at one instant and shortly before, and their tips' paths.

    Args:
        tracks: what the chains did; at least one sample each, at the same times.
        paths: (N, 7) poses of their tips, as they were received, one array per chain.
        title: what the picture shows.
        soled: names of the chains that end in a foot.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=SLIDE)
    _title(figure, title, tracks)
    view = legs.View(figure.add_axes((0.01, 0.02, 0.53, 0.87)), azimuth=236.0, elevation=15.0)
    times = tracks[0].times
    later = np.searchsorted(times, (times[0] + times[-1]) / 2)  # after the start has settled
    # The view is from the left: with the right foot ahead no leg hides the other.
    ahead = tracks[0].poses[later:, 0] - tracks[-1].poses[later:, 0]
    row = int(later + np.argmax(ahead))
    scene = [(track, row) for track in tracks]
    for ghost in np.searchsorted(times, times[row] + TRAIL / 5 * np.arange(-5, 0)):
        for track in tracks:
            legs.draw_leg(view, track.chain, track.positions[ghost], False, 4.0, alpha=0.14)
    stage = Stage.around(scene, soled)
    stage.draw(view, scene)
    stage.frame([view])
    _axes_legend(figure, tracks, stage)
    _draw_paths(figure, tracks, paths)
    return figure


def _draw_paths(figure: Figure, tracks: Sequence[ChainTrack], paths: Sequence[Array]) -> None:
    """Draw the tips' paths from the side and from above, in one scale."""
    points = np.vstack(paths)[:, :3] * (-1.0, -1.0, 1.0)
    low, high = points.min(axis=0) - 0.015, points.max(axis=0) + 0.015
    forward, left, up = (high - low).tolist()
    left_edge, width, top, height, between = 0.615, 0.365, 0.835, 0.645, 0.105
    inches = min(width * SLIDE[0] / forward, height * SLIDE[1] / (left + up))  # per metre
    for name, size, column, sign, label in (
            ('side', up, 2, 1.0, 'height  z  [m]'),
            ('above', left, 1, -1.0, f'left  {MINUS}y  [m]')):
        tall = size * inches / SLIDE[1]
        panel = figure.add_axes((left_edge, top - tall, forward * inches / SLIDE[0], tall))
        for i, (track, path) in enumerate(zip(tracks, paths, strict=True)):
            # Where feet share a path both are seen: the first one is drawn broad.
            panel.plot(-path[:, 0], sign * path[:, column], color=color_of(track.chain),
                       linewidth=1.6 if i else 4.5 if name == 'side' else 1.6)
        panel.set_xlim(low[0], high[0])
        panel.set_ylim(low[column], high[column])
        panel.locator_params(nbins=max(2, int(tall * 16)), axis='y')
        panel.locator_params(nbins=5, axis='x')
        panel.set_title(f'paths from {"the " * (name == "side")}{name}')
        panel.set_ylabel(label)
        top -= tall + between
    panel.set_xlabel(f'forward  {MINUS}x  [m]')


def _title(figure: Figure, title: str, tracks: Sequence[ChainTrack]) -> None:
    """Write the title, and below it what colours mean and what else is worth knowing."""
    figure.text(0.03, 0.955, title, fontsize=19, weight='bold', va='center')
    words = [(f'● {label_of(track.chain)}', color_of(track.chain)) for track in tracks]
    notes = [over_time.describe_gaps(tracks)]
    if not any(over_time.violations(track) for track in tracks):
        notes.append('all joints inside their documented ranges')
    words += [(note, FAINT) for note in notes if note]
    _write_in_colors(figure, 0.03, words)


def _axes_legend(figure: Figure, tracks: Sequence[ChainTrack], stage: Stage) -> None:
    """Write whose axes are drawn, and how large the floor's squares are."""
    frames = ', '.join(track.chain.tip_frame for track in tracks)
    _write_in_colors(figure, 0.56, [
        *((name, color) for name, color in zip('xyz', AXIS_COLORS, strict=True)),
        (f'of {tracks[0].chain.root_frame}, {frames}', INK),
        (f'squares {stage.step:g} m', FAINT)], 10.5)


def _write_in_colors(figure: Figure, x: float, words: Sequence[tuple[str, str]],
                     size: float = 12.0) -> None:
    """Write words in colours one after the other, in the line below the title."""
    from matplotlib.offsetbox import AnchoredOffsetbox, HPacker, TextArea

    parts: list[Artist] = [TextArea(text, textprops={'color': color, 'fontsize': size})
                           for text, color in words]
    figure.add_artist(AnchoredOffsetbox(
        'center left', child=HPacker(children=parts, pad=0, sep=size), pad=0, frameon=False,
        bbox_to_anchor=(x, 0.905), bbox_transform=figure.transFigure, borderpad=0))
