"""The viewer: chains in a page of the browser, moved by sliders, a recording or a robot."""

from __future__ import annotations

from collections.abc import Sequence
import math
from threading import Event
import time
from typing import Any

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools import viewer_scene as drawn
from icub_leg_fk.tools.viewer_method import LAST_STEP, Method
from icub_leg_fk.tools.viewer_page import (
    Canvas,
    JointSliders,
    Numbers,
    tip_texts,
)
from icub_leg_fk.tools.viewer_scene import PosedChain, Scene
from icub_leg_fk.tools.viewer_source import Posture, Source
import numpy as np

PERIOD = 1 / 30  # s; the page is not updated more often
_FIELD_OF_VIEW = 0.6  # rad
_TOWARD_VIEWER = (0.82, 0.47, 0.33)  # forward, left, up; about a unit vector


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
        self._server = server
        self._source = source
        self._changed = Event()
        self._canvas = Canvas(server)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._chains: tuple[Chain, ...] = ()
        self._build(tuple(chains))

    def run(self) -> None:
        """Keep the page up to date until a signal ends it."""
        while True:
            self._changed.clear()
            self.refresh()
            time.sleep(PERIOD)
            self._changed.wait(0.0 if self._source and self._source.is_moving else None)

    def refresh(self) -> None:
        """Bring scene, sliders and numbers up to date."""
        postures = self._postures()
        scene = dict(self._fixed)
        for index, (q, note, trail) in enumerate(postures):
            if q is None:
                self._tips[index].show({}, note)
                continue
            posed = PosedChain(self._chains[index], q)
            self._sliders.show(dict(zip(posed.chain.joint_names, q, strict=True)))
            self._tips[index].show(tip_texts(posed), note)
            scene |= self._chain_scene(index, posed)
            if len(trail) > 1:
                scene |= drawn.trail_scene(posed, trail)
        self._canvas.show(scene)

    def _build(self, chains: tuple[Chain, ...]) -> None:
        """Build the page for some chains."""
        names = [chain.name for chain in chains]
        is_another = names != [chain.name for chain in self._chains]
        self._chains = chains
        self._size = drawn.reach(chains)
        gui = self._server.gui
        gui.reset()
        if self._source:
            self._source.add_controls(gui, self._on_change)
        self._sliders = JointSliders(
            gui, chains, self._on_change, follow=self._source is not None
        )
        if not self._source:
            button = gui.add_button('back to the start', color='gray')
            button.on_click(lambda _: self._sliders.reset())
        self._add_panel(gui)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(330)
        posed = [PosedChain(chain, self._sliders.positions(chain)) for chain in chains]
        points = np.vstack([drawn.outer_points(each) for each in posed])
        if is_another:
            self._place_cameras(points)
        floor = drawn.floor_scene(points, chains[0].root_axes, self._size)
        self._fixed = floor | drawn.root_scene(chains[0], self._size)

    def _on_change(self, _: Any) -> None:
        self._changed.set()

    def _postures(self) -> list[Posture]:
        """Return the joints of every chain, and build the page anew if the chains are others."""
        if not self._source:
            return [Posture(self._sliders.positions(chain)) for chain in self._chains]
        postures = self._source.step()
        if self._source.chains != self._chains:
            self._build(self._source.chains)
        return postures

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
        words = method.words(step, row)
        self._words.show({'as leg_fk explain prints it': words.splitlines()})
        return method.scene(step, row)

    def _shown_chain(self) -> int:
        """Return the index of the chain of which the method is shown."""
        return self._names.index(self._chain.value)

    def _add_panel(self, gui: Any) -> None:
        """Add the panel of the poses and the method."""
        self._names = [f'{chain.name}={chain.version}' for chain in self._chains]
        panel = gui.add_panel()
        with panel.add_tab('Poses'):
            gui.add_markdown(f'poses in {drawn.root_words(self._chains[0])}')
            self._frames = gui.add_checkbox('frames of the table', True)
            self._tips = []
            for chain in self._chains:
                with gui.add_folder(f'{chain.tip}: {chain.frame_id}'):
                    self._tips.append(Numbers(gui))
        with panel.add_tab('Method'):
            marks = [
                (0, 'off'),
                *((step, str(step)) for step in range(1, LAST_STEP + 1)),
            ]
            self._step = gui.add_slider('step', 0, LAST_STEP, 1, 0, marks=marks)
            self._chain = gui.add_dropdown('chain', self._names)
            self._row = gui.add_slider('row', 0, 1, 1, 0, visible=False)
            self._words = Numbers(gui)
        for control in (self._frames, self._step, self._chain, self._row):
            control.on_update(self._on_change)
        panel.dock_left()
        panel.set_width(500)

    def _place_cameras(self, points: Array) -> None:
        """Look at (N, 3) points from ahead of the root, a little from the left and above."""
        forward, left, up = drawn.directions(self._chains[0].root_axes)
        low, high = points.min(axis=0), points.max(axis=0)
        middle = (low + high) / 2
        radius = float(np.linalg.norm(high - low)) / 2 + 0.25 * self._size
        toward = np.array(_TOWARD_VIEWER) @ np.stack((forward, left, up))
        self._server.scene.set_up_direction(up)
        first = self._server.initial_camera
        first.up = up
        first.fov = _FIELD_OF_VIEW
        clients = self._server.get_clients().values()
        for camera in (first, *(client.camera for client in clients)):
            camera.look_at = middle
            camera.position = middle + radius / math.sin(_FIELD_OF_VIEW / 2) * toward
