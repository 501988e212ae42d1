"""What moves the chains of the viewer in place of its sliders, and how they are moved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.configuration import DEFAULT_TIMEOUT
import numpy as np

TRAIL = 2.0  # s
TRAIL_POINTS = 200

Changed = Callable[[Any], None]


class Posture(NamedTuple):
    """The joints of a chain.

    Attributes:
        q: n joint positions [rad or m]; None while they are not known.
        note: what is to be said of them in red; empty if nothing.
        trail: (N, 3) the last places of the tip [m].
    """

    q: Sequence[float] | None
    note: str = ''
    trail: Array = np.zeros((0, 3))


class Source(Protocol):
    """What moves the chains in place of the sliders.

    Attributes:
        is_moving: whether the joints may change without anything being done in the page.
    """

    is_moving: bool

    @property
    def chains(self) -> tuple[Chain, ...]:
        """The chains; a step may change them."""

    def add_controls(self, gui: Any, changed: Changed) -> None:
        """Add to the page what it is controlled by; `changed` is called when that is used."""

    def step(self) -> list[Posture]:
        """Go on to the present time, and return the joints of every chain."""


def posture_at(at: float, chain: Chain, times: Array, positions: Array) -> Posture:
    """Return what a chain did last, up to a time.

    Args:
        at: the time [s].
        chain: the chain.
        times: (N,) times of its samples [s], in order.
        positions: (N, n) joint positions [rad or m].
    """
    first, end = np.searchsorted(times, (at - TRAIL, np.nextafter(at, np.inf)))
    if not end:
        return Posture(None, 'no pose yet')
    age = at - float(times[end - 1])
    note = f'no pose for {age:.1f} s' if age > DEFAULT_TIMEOUT else ''
    count = min(end - first, TRAIL_POINTS)
    chosen = np.linspace(first, end - 1, count).round().astype(int)
    trail = chain.poses(positions[chosen])[:, :3]
    return Posture(positions[end - 1].tolist(), note, trail)
