"""A recording in the viewer: its time line, pause and speed, and the trails of the tips."""

from __future__ import annotations

from collections.abc import Sequence
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
            chosen = (
                np.linspace(chosen[0], chosen[-1], _TRAIL_POINTS).round().astype(int)
            )
        return self._chain.poses(self._positions[chosen])[:, :3]

    def _count(self, at: float) -> int:
        """Return how many samples there are up to a time [s]."""
        return int(np.searchsorted(self.times, at, side='right'))


class Recording:
    """Moves the chains as they were recorded.

    Args:
        tracks: what each chain did.
    """

    def __init__(self, tracks: Sequence[RecordedChain]) -> None:
        self._tracks = tuple(tracks)
        self._start = min(float(track.times[0]) for track in tracks)
        self._end = max(float(track.times[-1]) for track in tracks)
        self._at = self._start
        self._advanced = time.monotonic()
        self._is_pressed = False
        self.is_moving = False

    def add_controls(self, gui: Any, changed: Changed) -> None:
        """Add the time line, pause and speed to the page."""

        def press(event: Any) -> None:
            self._is_pressed = True
            changed(event)

        with gui.add_folder('recording'):
            self._line = gui.add_slider(
                'time [s]', self._start, self._end, 0.01, self._start
            )
            self._speed = gui.add_dropdown('speed', _SPEEDS, initial_value='1')
            self._button = gui.add_button('play')
        self._shown = self._line.value
        self._line.on_update(changed)
        self._button.on_click(press)

    def advance(self) -> None:
        """Go on to the present time, or to where the time line was moved."""
        now = time.monotonic()
        passed, self._advanced = now - self._advanced, now
        if self._line.value != self._shown:
            self._at = float(self._line.value)
            self._play(False)
        elif self.is_moving:
            self._at = min(self._at + passed * float(self._speed.value), self._end)
        if self._is_pressed:
            self._is_pressed = False
            self._at = self._start if self._at >= self._end else self._at
            self._play(not self.is_moving)
        elif self._at >= self._end:
            self._play(False)
        self._shown = self._line.value = self._at

    def postures(self) -> list[Posture]:
        """Return the joints of every chain."""
        return [track.posture(self._at) for track in self._tracks]

    def trails(self) -> list[Array]:
        """Return the last places of every tip, (N, 3) each."""
        return [track.trail(self._at) for track in self._tracks]

    def _play(self, is_moving: bool) -> None:
        self.is_moving = is_moving
        self._button.label = 'pause' if is_moving else 'play'
