"""The viewer: chains in a page of the browser, moved by sliders, a recording or a robot."""

from __future__ import annotations

from collections.abc import Sequence
import math
from threading import Event
import time
from typing import Any, Protocol

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools import viewer_scene as drawn
from icub_leg_fk.tools.viewer_method import Method, STEPS
from icub_leg_fk.tools.viewer_page import (
    Canvas,
    Changed,
    JointSliders,
    Numbers,
    Posture,
    tip_texts,
)
from icub_leg_fk.tools.viewer_scene import PosedChain, Scene
import numpy as np

PERIOD = 1 / 30  # s; the page is not updated more often
_FIELD_OF_VIEW = 0.6  # rad
_TOWARD_VIEWER = (0.82, 0.47, 0.33)  # forward, left, up; about a unit vector


class Source(Protocol):
    """What moves the chains in place of the sliders.

    Attributes:
        is_moving: whether the joints may change without anything being done in the page.
    """

    is_moving: bool

    def add_controls(self, gui: Any, changed: Changed) -> None:
        """Add to the page what it is controlled by; `changed` is called when that is used."""

    def advance(self) -> None:
        """Go on to the present time."""

    def postures(self) -> list[Posture]:
        """Return the joints of every chain."""

    def trails(self) -> list[Array]:
        """Return the last places of every tip, (N, 3) each [m]."""


class Viewer:
    """A page that shows chains of one root.

    Args:
        server: viser's.
        chains: the chains.
        source: what moves them; None for the sliders.
    """

    def __init__(
        self, server: Any, chains: Sequence[Chain], source: Source | None
    ) -> None:
        self._chains = tuple(chains)
        self._source = source
        self._changed = Event()
        self._size = drawn.reach(chains)
        self._canvas = Canvas(server)
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False)
        if source:
            source.add_controls(gui, self._on_change)
        self._sliders = JointSliders(
            gui, chains, self._on_change, follow=source is not None
        )
        if not source:
            button = gui.add_button('back to the start', color='gray')
            button.on_click(lambda _: self._sliders.reset())
        self._add_panel(gui)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(330)
        points = [
            drawn.outer_points(PosedChain(chain, self._sliders.positions(chain)))
            for chain in chains
        ]
        self._fixed = self._fixed_scene(np.vstack(points))
        self._place_camera(server, np.vstack(points))

    def run(self) -> None:
        """Keep the page up to date until a signal ends it."""
        while True:
            self._changed.clear()
            self.refresh()
            time.sleep(PERIOD)
            self._changed.wait(0.0 if self._source and self._source.is_moving else None)

    def refresh(self) -> None:
        """Bring scene, sliders and numbers up to date."""
        postures, trails = self._postures()
        scene = dict(self._fixed)
        for index, chain in enumerate(self._chains):
            q, note = postures[index]
            if q is None:
                self._tips[index].show({}, note)
                continue
            posed = PosedChain(chain, q)
            self._sliders.show(dict(zip(chain.joint_names, q, strict=True)))
            self._tips[index].show(tip_texts(posed), note)
            scene |= self._chain_scene(index, posed)
            if len(trails[index]) > 1:
                scene |= drawn.trail_scene(posed, trails[index])
        self._canvas.show(scene)

    def _on_change(self, _: Any) -> None:
        self._changed.set()

    def _postures(self) -> tuple[list[Posture], list[Array]]:
        """Return the joints of every chain, and the last places of its tip."""
        if self._source:
            self._source.advance()
            return self._source.postures(), self._source.trails()
        postures = [Posture(self._sliders.positions(chain)) for chain in self._chains]
        return postures, [np.zeros((0, 3))] * len(postures)

    def _chain_scene(self, index: int, posed: PosedChain) -> Scene:
        """Return a chain; while the method is shown, that or what stands in its background."""
        step = int(self._step.value)
        scene = drawn.ends_scene(posed, faint=step > 0)
        if index == self._shown_chain():
            scene |= self._show_method(posed, step)
        elif step:
            scene |= drawn.faint_scene(posed)
        if step:
            return scene
        scene |= drawn.skeleton_scene(posed, self._size)
        if self._frames.value:
            scene |= drawn.frames_scene(posed, self._size)
        return scene

    def _show_method(self, posed: PosedChain, step: int) -> Scene:
        """Say what a step of the method says, and return what it draws."""
        last_row = len(posed.chain.rows()) - 1
        self._row.visible = step == 5
        self._row.max = max(last_row, 1)
        if not step:
            self._words.show({'Move the slider to step 1.': []})
            return {}
        method, row = Method(posed, self._size), min(int(self._row.value), last_row)
        self._words.show({f'Step {step}. {STEPS[step - 1]}': method.lines(step, row)})
        return method.scene(step, row)

    def _shown_chain(self) -> int:
        """Return the index of the chain of which the method is shown."""
        return self._names.index(self._chain.value)

    def _add_panel(self, gui: Any) -> None:
        """Add the panel of the poses and the method."""
        self._names = [f'{chain.name}={chain.version}' for chain in self._chains]
        panel = gui.add_panel()
        with panel.add_tab('Poses'):
            root = self._chains[0]
            where = f': {", ".join(drawn.axis_names(root))}' if root.root_axes else ''
            gui.add_markdown(f'poses in `{root.root_frame}`{where}')
            self._frames = gui.add_checkbox('frames of the table', True)
            self._tips = []
            for chain in self._chains:
                with gui.add_folder(f'{chain.tip}: {chain.frame_id}'):
                    self._tips.append(Numbers(gui))
        with panel.add_tab('Method'):
            marks = (
                (0, 'off'),
                *((step, str(step)) for step in range(1, len(STEPS) + 1)),
            )
            self._step = gui.add_slider('step', 0, len(STEPS), 1, 0, marks=marks)
            self._chain = gui.add_dropdown('chain', self._names)
            self._row = gui.add_slider('row', 0, 1, 1, 0, visible=False)
            self._words = Numbers(gui)
        for control in (self._frames, self._step, self._chain, self._row):
            control.on_update(self._on_change)
        panel.dock_left()
        panel.set_width(450)

    def _fixed_scene(self, points: Array) -> Scene:
        """Return what does not move: the root and a floor below (N, 3) points."""
        floor = drawn.floor_scene(points, self._chains[0].root_axes, self._size)
        return floor | drawn.root_scene(self._chains[0], self._size)

    def _place_camera(self, server: Any, points: Array) -> None:
        """Look at (N, 3) points from ahead of the root, a little from the left and above."""
        forward, left, up = drawn.directions(self._chains[0].root_axes)
        low, high = points.min(axis=0), points.max(axis=0)
        middle = (low + high) / 2
        radius = float(np.linalg.norm(high - low)) / 2 + 0.25 * self._size
        toward = np.array(_TOWARD_VIEWER) @ np.stack((forward, left, up))
        camera = server.initial_camera
        camera.fov = _FIELD_OF_VIEW
        camera.up = up
        camera.look_at = middle
        camera.position = middle + radius / math.sin(_FIELD_OF_VIEW / 2) * toward
        server.scene.set_up_direction(up)
