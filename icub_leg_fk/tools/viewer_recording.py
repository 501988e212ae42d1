"""A recording in the viewer: its time line, pause and speed, and the trails of the tips."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import time
from typing import Any

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.configuration import DEFAULT_TIMEOUT
from icub_leg_fk.tools.viewer_page import Changed, Posture
import numpy as np

TRAIL = 2.0  # s
_TRAIL_POINTS = 200
_SPEEDS = ('0.1', '0.25', '0.5', '1', '2', '5', '10')


class RecordedChain:
    """What one chain did over time.

    Args:
        chain: the chain.
        times: (N,) [s], in any order.
        positions: (N, n) joint positions [rad or m].
    """

    def __init__(self, chain: Chain, times: Array, positions: Array) -> None:
        order = np.argsort(times, kind='stable')
        self.times = times[order]
        self._chain = chain
        self._positions = positions[order]

    def posture(self, at: float) -> Posture:
        """Return the newest joint positions up to a time [s]."""
        count = self._count(at)
        if not count:
            return Posture(None, 'no pose yet')
        age = at - float(self.times[count - 1])
        note = f'no pose for {age:.1f} s' if age > DEFAULT_TIMEOUT else ''
        return Posture(self._positions[count - 1].tolist(), note)

    def trail(self, at: float) -> Array:
        """Return (N, 3) places of the tip in the last seconds up to a time [s]."""
        end = self._count(at)
        chosen = np.arange(self._count(at - TRAIL), end)
        if len(chosen) > _TRAIL_POINTS:
            chosen = np.linspace(chosen[0], chosen[-1], _TRAIL_POINTS).round().astype(int)
        return self._chain.poses(self._positions[chosen])[:, :3]

    def _count(self, at: float) -> int:
        """Return how many samples there are up to a time [s]."""
        return int(np.searchsorted(self.times, at, side='right'))


class Recording:
    """Moves the chains as they were recorded, in the time of its clock.

    Args:
        tracks: what each chain did.
        clock: returns the present time [s].
    """

    def __init__(self, tracks: Sequence[RecordedChain],
                 clock: Callable[[], float] = time.monotonic) -> None:
        self._tracks = tuple(tracks)
        self._clock = clock
        self._start = min(float(track.times[0]) for track in tracks)
        self._end = max(float(track.times[-1]) for track in tracks)
        self._at = self._start
        self._played = clock()
        self.is_moving = False

    def add_controls(self, gui: Any, changed: Changed) -> None:
        """Add the time line, pause and speed to the page."""
        with gui.add_folder('recording'):
            self._line = gui.add_slider('time [s]', self._start, self._end, 0.01, self._start)
            self._speed = gui.add_dropdown('speed', _SPEEDS, initial_value='1')
            self._button = gui.add_button('play')
        self._shown = self._line.value
        self._line.on_update(changed)
        self._button.on_click(self._press)
        self._button.on_click(changed)

    def advance(self) -> None:
        """Go on to the present time, or to where the time line was moved."""
        now = self._clock()
        passed, self._played = now - self._played, now
        if self._line.value != self._shown:
            self._at = float(self._line.value)
            self._pause()
        elif self.is_moving:
            self._at += passed * float(self._speed.value)
        if self._at >= self._end:
            self._at = self._end
            self._pause()
        self._shown = self._line.value = self._at

    def postures(self) -> list[Posture]:
        """Return the joints of every chain."""
        return [track.posture(self._at) for track in self._tracks]

    def trails(self) -> list[Array]:
        """Return the last places of every tip, (N, 3) each."""
        return [track.trail(self._at) for track in self._tracks]

    def _press(self, _: Any) -> None:
        """Pause, or go on; after the end from the beginning."""
        if self.is_moving:
            self._pause()
            return
        if self._at >= self._end:
            self._at = self._start
            self._shown = self._line.value = self._at
        self._played = self._clock()
        self.is_moving = True
        self._button.label = 'pause'

    def _pause(self) -> None:
        self.is_moving = False
        self._button.label = 'play'
