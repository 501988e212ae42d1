"""A recording in the viewer, with its time line, pause and speed."""

from __future__ import annotations

from collections.abc import Sequence
import time
from typing import Any

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.tracks import ChainTrack, time_span
from icub_leg_fk.tools.viewer_source import Changed, Posture, posture_at
import numpy as np

Samples = tuple[Chain, Array, Array]  # of a chain: (N,) times [s], (N, n) positions

_SPEEDS = ('0.1', '0.25', '0.5', '1', '2', '5', '10')


class Recording:
    """Moves the chains as they were recorded.

    Args:
        tracks: what each chain did; several of one whose description changed, in their order.
    """

    def __init__(self, tracks: Sequence[ChainTrack]) -> None:
        self.is_moving = False
        self._samples: dict[str, list[Samples]] = {}
        for track in tracks:
            order = np.argsort(track.times, kind='stable')  # the clock may be set back
            samples = track.chain, track.times[order], track.positions[order]
            self._samples.setdefault(track.chain.name, []).append(samples)
        self._start, self._end = time_span(tracks)
        self._at = self._start
        self._speed = '1'
        self._stepped = time.monotonic()
        self._is_pressed = False

    @property
    def chains(self) -> tuple[Chain, ...]:
        """The chains, by the description that counted at the time."""
        return tuple(chain for chain, *_ in self._present())

    def add_controls(self, gui: Any, changed: Changed) -> None:
        """Add the time line, pause and speed to the page."""

        def press(event: Any) -> None:
            self._is_pressed = True
            changed(event)

        with gui.add_folder('recording'):
            self._line = gui.add_slider(
                'time [s]', self._start, self._end, 0.01, self._at
            )
            self._speeds = gui.add_dropdown('speed', _SPEEDS, initial_value=self._speed)
            self._button = gui.add_button('play')
        self._play(self.is_moving)
        self._line.on_update(changed)
        self._button.on_click(press)

    def step(self) -> list[Posture]:
        """Go on to the present time, or to where the time line was moved."""
        now = time.monotonic()
        passed, self._stepped = now - self._stepped, now
        self._speed = self._speeds.value
        if self._line.value != self._at:
            self._at = float(self._line.value)
            self._play(False)
        elif self.is_moving:
            self._at = min(self._at + passed * float(self._speed), self._end)
        if self._is_pressed:
            self._is_pressed = False
            self._at = self._start if self._at >= self._end else self._at
            self._play(not self.is_moving)
        elif self._at >= self._end:
            self._play(False)
        self._line.value = self._at
        return [posture_at(self._at, *samples) for samples in self._present()]

    def _present(self) -> list[Samples]:
        """Return the samples of every chain by the description that counted at the time."""
        present = []
        for parts in self._samples.values():
            begun = [samples for samples in parts if samples[1][0] <= self._at]
            present.append(begun[-1] if begun else parts[0])
        return present

    def _play(self, is_moving: bool) -> None:
        self.is_moving = is_moving
        self._button.label = 'pause' if is_moving else 'play'
