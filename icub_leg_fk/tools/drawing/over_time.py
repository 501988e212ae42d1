"""Pictures of tips over time: height, forward and lateral position, range violations, gaps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
import math
from typing import TYPE_CHECKING

from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.drawing.style import color_of, has_known_axes, INK, label_of, MINUS
from icub_leg_fk.tools.recording import ChainTrack
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ICUB_COORDINATES = (('height  z  [m]', 2, 1.0), (f'forward  {MINUS}x  [m]', 0, -1.0),
                     (f'left  {MINUS}y  [m]', 1, -1.0))
_COORDINATES = (('z  [m]', 2, 1.0), ('x  [m]', 0, 1.0), ('y  [m]', 1, 1.0))
GAP_INTERVALS = 5.0  # so many usual intervals without a pose are a gap
_BINS = 3000  # of a curve; more cannot be seen, and make vector files huge


@dataclass(frozen=True)
class Violation:
    """A joint beyond one end of its documented range for a while; times [s]."""

    joint: str
    limit: str
    spans: tuple[tuple[float, float], ...]


def violations(track: ChainTrack) -> list[Violation]:
    """Return where a chain's joints are outside their documented ranges."""
    found = []
    for name, link, q in zip(track.chain.joint_names, track.chain.joints, track.positions.T,
                             strict=True):
        for outside, sign, limit in ((q < link.lower, '<', link.lower),
                                     (q > link.upper, '>', link.upper)):
            if outside.any():
                value = f'{limit:g} m' if link.is_prismatic else f'{math.degrees(limit):g}°'
                found.append(Violation(name, f'{sign} {value}'.replace('-', MINUS),
                                       tuple(_spans(outside, track.times))))
    return found


def gaps(track: ChainTrack) -> list[tuple[float, float]]:
    """Return the times [s] between which a chain has no pose although it should."""
    return [(float(track.times[i - 1]), float(track.times[i])) for i in _breaks(track.times)
            if track.times[i] > track.times[i - 1]]


def all_gaps(tracks: Sequence[ChainTrack]) -> list[tuple[float, float]]:
    """Return the gaps of any of the chains, each once."""
    return sorted({gap for track in tracks for gap in gaps(track)})


def draw_tips(axes: Sequence[Axes], tracks: Sequence[ChainTrack]) -> None:
    """Draw one coordinate of every tip against time into each of three axes."""
    start, end = time_span(tracks)
    coordinates = _ICUB_COORDINATES if has_known_axes(tracks[0].chain) else _COORDINATES
    for panel, (label, column, sign) in zip(axes, coordinates, strict=True):
        for track in tracks:
            curve = _curve(track.times, sign * track.poses[:, column])
            panel.plot(*curve, color=color_of(track.chain), label=label_of(track.chain),
                       marker='o' if len(track.times) < 3 else '')
        panel.broken_barh([(a, b - a) for a, b in all_gaps(tracks)], (0, 1), color='#000000',
                          alpha=0.12, linewidth=0, transform=panel.get_xaxis_transform())
        panel.set_title(label)
        panel.set_xlim(start, end)
        panel.margins(y=0.12)
        panel.locator_params(axis='y', nbins=4)
        panel.tick_params(labelbottom=False, length=0)
    axes[-1].tick_params(labelbottom=True)


def draw_violations(panel: Axes, found: Sequence[tuple[str, Violation]]) -> None:
    """Draw one row of bars per joint and end of range.

    Args:
        panel: where to draw.
        found: colours and violations.
    """
    start, end = panel.get_xlim()
    least = (end - start) / 300  # what can be seen
    for row, (color, violation) in enumerate(found):
        bars = [(a, max(b - a, least)) for a, b in violation.spans]
        panel.broken_barh(bars, (row - 0.35, 0.7), color=color, linewidth=0)
        first, last = bars[0][0], sum(bars[-1])
        on_the_left = first - start > end - last
        panel.annotate(f'{violation.joint} {violation.limit}',
                       (first if on_the_left else last, row), fontsize=10, va='center',
                       ha='right' if on_the_left else 'left', textcoords='offset points',
                       xytext=(-5 if on_the_left else 5, -0.5))
    panel.set_yticks([])
    panel.set_ylim(len(found) - 0.4, -0.6)
    panel.set_title('outside the documented range')
    panel.tick_params(length=0)


def mark_instants(axes: Sequence[Axes], instants: Sequence[float]) -> None:
    """Mark instants by dotted lines, and by letters above the first axes."""
    for panel in axes:
        for instant in instants:
            panel.axvline(instant, color=INK, linewidth=1.0, linestyle=(0, (1, 2)))
    start, end = axes[0].get_xlim()
    near = 0.025 * (end - start)
    for i, (letter, instant) in enumerate(zip(letters(), instants)):
        follows = i > 0 and instant - instants[i - 1] < near
        precedes = i + 1 < len(instants) and instants[i + 1] - instant < near
        axes[0].annotate(letter, (instant, 1.0), xycoords=('data', 'axes fraction'),
                         xytext=(0, 18), textcoords='offset points',
                         ha='left' if follows else 'right' if precedes else 'center',
                         fontsize=11, weight='bold')


def letters() -> Iterator[str]:
    """Yield A, B, C and so on."""
    return (chr(ord('A') + i) for i in range(26))


def time_span(tracks: Sequence[ChainTrack]) -> tuple[float, float]:
    """Return first and last time of all tracks [s]; apart even if there is only one."""
    start = min(float(track.times.min()) for track in tracks)
    end = max(float(track.times.max()) for track in tracks)
    return (start, end) if end > start else (start - 0.5, end + 0.5)


def describe_gaps(tracks: Sequence[ChainTrack]) -> str:
    """Return a phrase on the gaps, or nothing if there are none."""
    found = all_gaps(tracks)
    if not found:
        return ''
    longest = max(b - a for a, b in found)
    return f'grey: no pose ({len(found)} gap{"s" * (len(found) > 1)}, longest {longest:.2f} s)'


def _spans(flags: Array, times: Array) -> Iterator[tuple[float, float]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(int), [0]))))
    for first, after in zip(edges[::2], edges[1::2], strict=True):
        yield float(times[first]), float(times[min(after, len(times) - 1)])


def _breaks(times: Array) -> NDArray[np.intp]:
    """Return the indices of the samples that do not go on from the one before."""
    steps = np.diff(times)
    forward = steps[steps > 0]
    usual = np.median(forward) if len(forward) > 1 else np.inf
    return np.flatnonzero((steps > GAP_INTERVALS * usual) | (steps < 0)) + 1


def _curve(times: Array, values: Array) -> tuple[Array, Array]:
    """Return a curve to plot: a hole (NaN) at every break, and not more points than can be seen.

    Of every short stretch the lowest and the highest point are kept, so it looks the same.
    """
    breaks = _breaks(times)
    keep = np.arange(len(times))
    if len(times) > 2 * _BINS:
        edges = np.unique(np.concatenate((np.linspace(0, len(times), _BINS).astype(int), breaks)))
        keep = np.unique([int(a + pick(values[a:b])) for a, b in pairwise(edges)
                          for pick in (np.argmin, np.argmax)])
    holes = np.unique(np.searchsorted(keep, breaks))
    return np.insert(times[keep], holes, np.nan), np.insert(values[keep], holes, np.nan)
