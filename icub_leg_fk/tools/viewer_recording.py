"""A recording in the viewer, with its time line, pause and speed."""

from __future__ import annotations

from collections.abc import Sequence
import time
from typing import Any

from icub_leg_fk.tools.tracks import ChainTrack, time_span
from icub_leg_fk.tools.viewer_source import Changed, Posture, posture_at
import numpy as np

_SPEEDS = ('0.1', '0.25', '0.5', '1', '2', '5', '10')


class Recording:
    """Moves the chains as they were recorded.

    Args:
        tracks: what each chain did.
    """

    def __init__(self, tracks: Sequence[ChainTrack]) -> None:
        self.chains = tuple(track.chain for track in tracks)
        self.is_moving = False
        self._samples = []
        for track in tracks:
            order = np.argsort(track.times, kind='stable')  # the clock may be set back
            self._samples.append((track.times[order], track.positions[order]))
        self._start, self._end = time_span(tracks)
        self._at = self._start
        self._stepped = time.monotonic()
        self._is_pressed = False

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

    def step(self) -> list[Posture]:
        """Go on to the present time, or to where the time line was moved."""
        now = time.monotonic()
        passed, self._stepped = now - self._stepped, now
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
        postures = []
        for chain, samples in zip(self.chains, self._samples, strict=True):
            postures.append(posture_at(self._at, chain, *samples))
        return postures

    def _play(self, is_moving: bool) -> None:
        self.is_moving = is_moving
        self._button.label = 'pause' if is_moving else 'play'
