"""Pictures of several chains at an instant: a floor, a ruler, their frames, their tips' paths."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.drawing import legs as legs
from icub_leg_fk.tools.drawing.style import color_of, has_known_axes
from icub_leg_fk.tools.recording import ChainTrack
import numpy as np

Sample = tuple[ChainTrack, int]
"""A chain's track and the index of one of its samples."""

TRAIL = 0.5  # s of a tip's path before and after an instant
_MOST_STEPS = 7


@dataclass(frozen=True)
class Stage:
    """Where scenes are drawn, all in one scale.

    Attributes:
        xs: x of the floor's lines [m].
        ys: y of the floor's lines [m].
        step: from line to line [m]; all that is drawn beside the chains grows with it.
        soled: names of the chains that end in a foot.
    """

    xs: Array
    ys: Array
    step: float
    soled: Collection[str]

    @classmethod
    def around(cls, samples: Sequence[Sample], soled: Collection[str]) -> Stage:
        """Return a stage with room for some samples."""
        points = np.vstack([_joints(sample) for sample in samples] + [np.zeros((1, 3))])
        step = _round_step(float(np.ptp(points, axis=0).max()) / _MOST_STEPS)
        low = np.minimum(points.min(axis=0) - (step, 0.3 * step, 0.0), -1.5 * step)
        high = np.maximum(points.max(axis=0) + 0.3 * step, 1.5 * step)
        return cls(legs.grid_lines(low[0], high[0], step), legs.grid_lines(low[1], high[1], step),
                   step, soled)

    def draw(self, view: legs.View, scene: Sequence[Sample]) -> None:
        """Draw chains at their samples, their tips' paths around these, and the floor."""
        reach = [_joints(sample) for sample in scene]
        heights = np.concatenate([points[:, 2] for points in reach] + [np.zeros(1)])
        low = float(heights.min())
        legs.draw_ground(view, low, self.xs, self.ys)
        legs.draw_ruler(view, (self.xs[0], self.ys[-1], low), float(heights.max()), self.step)
        if has_known_axes(scene[0][0].chain):
            legs.draw_forward(view, (self.xs[0] + 1.6 * self.step, self.ys[0], low),
                              1.4 * self.step)
        legs.draw_triad(view, np.eye(4), self.step, 2.4, 60, labels='xyz')
        nearness = np.argsort(np.argsort([view.depth(points) for points in reach]))
        for (track, i), rank in zip(scene, nearness, strict=True):
            chain, q, z = track.chain, track.positions[i], 10.0 + 10 * float(rank)
            around = np.abs(track.times - track.times[i]) <= TRAIL
            view.line(track.poses[around, :3], color=color_of(chain), linewidth=1.2, alpha=0.5,
                      zorder=z - 1)
            legs.draw_leg(view, chain, q, chain.name in self.soled, z)
            legs.draw_triad(view, chain.forward(q), self.step, 2.2, z + 5)

    def frame(self, views: Sequence[legs.View]) -> None:
        """Give all views one scale, that of the one that needs most room."""
        boxes = np.array([view.axes.dataLim.extents for view in views])
        left, bottom = boxes[:, :2].min(axis=0) - np.multiply(self.step, (0.6, 0.4))
        right, top = boxes[:, 2:].max(axis=0) + np.multiply(self.step, (0.1, 1.3))
        for view in views:
            view.axes.set_xlim(left, right)
            view.axes.set_ylim(bottom, top)


def _joints(sample: Sample) -> Array:
    """Return the (n + 2, 3) origins of a chain's frames at a sample [m]."""
    track, i = sample
    return np.asarray(track.chain.frames(track.positions[i])[:, :3, 3])


def _round_step(least: float) -> float:
    """Return the smallest of ... 0.05, 0.1, 0.2, 0.5, 1 ... that is not below `least` [m]."""
    decade = 10.0 ** np.floor(np.log10(max(least, 1e-4)))
    return float(next(decade * factor for factor in (1, 2, 5, 10) if decade * factor >= least))
