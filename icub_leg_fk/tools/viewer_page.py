"""What the viewer's page consists of, by viser: its server, the scene, joint sliders, numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
import html
from importlib import import_module
import io
import math
import socket
from typing import Any, NamedTuple

from icub_leg_fk.errors import LegFKError, MissingDependencyError
from icub_leg_fk.kinematics import Chain, chain_text, DHLink
from icub_leg_fk.kinematics.rotation import Array, roll_pitch_yaw
from icub_leg_fk.tools import text
from icub_leg_fk.tools.signals import held_signals
from icub_leg_fk.tools.viewer_scene import Arrows, Label, Lines, Part, PosedChain, Scene
from icub_leg_fk.tools.viewer_source import Changed
import numpy as np

_BEYOND = 0.2  # of a range; so far beyond it a slider goes
_ROUNDING = 1e-9  # rad or m; from degrees and back


class _Scale(NamedTuple):
    """How a slider shows the positions of a joint.

    Attributes:
        unit: its unit, in words.
        per: how many of these a rad or m is.
        most: end of a slider without a range.
        step: step of a slider.
        whole: a slider's ends are multiples of it.
    """

    unit: str
    per: float
    most: float
    step: float
    whole: float


_SCALES = {
    'revolute': _Scale('degrees', 180.0 / math.pi, 180.0, 0.1, 1.0),
    'prismatic': _Scale('m', 1.0, 1.0, 0.001, 0.01),
}

_GREY, _RED = '#777777', '#d00000'
_SMALL = 'font-size:11px;line-height:1.2;padding:0 8px'
_COPIED = 'margin:0;padding:2px 8px 6px;font:11px/1.4 monospace;overflow-x:auto;user-select:all'


@contextmanager
def running_server(host: str, port: int) -> Iterator[Any]:
    """Run viser's server while it lasts, on the next free port if this one is taken.

    Raises:
        MissingDependencyError: viser is not installed.
        LegFKError: there is no such address on this machine.
    """
    viser = _import_viser()
    _check_host(host)
    with redirect_stdout(io.StringIO()):  # viser's banner
        server = viser.ViserServer(
            host=host, port=port, label='leg_fk view', verbose=False
        )
    # Any page that reaches the server could ask viser to hand it on to the internet.
    server.request_share_url = lambda: None
    try:
        yield server
    finally:
        with held_signals(), redirect_stdout(io.StringIO()):  # viser's farewell
            server.stop()


def _import_viser() -> Any:
    try:
        return import_module('viser')
    except ImportError as error:
        raise MissingDependencyError(
            'viser', 'the viewer', 'pip install viser'
        ) from error


def _check_host(host: str) -> None:
    """Refuse an address that is not this machine's; viser would wait for ever."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as trial:
            trial.bind(address)
    except (OSError, UnicodeError) as error:
        raise LegFKError(
            f'--host: found {host!r}, allowed: an address of this machine, such as '
            '127.0.0.1, or 0.0.0.0 for all of them'
        ) from error


class Canvas:
    """The scene as viser has it."""

    def __init__(self, server: Any) -> None:
        self._server = server
        self._handles: dict[str, Any] = {}
        self._shown: Scene = {}

    def show(self, scene: Scene) -> None:
        """Show a scene and nothing else."""
        with self._server.atomic():
            for name in self._shown.keys() - scene.keys():
                self._handles.pop(name).remove()
            for name, part in scene.items():
                if _looks_like(self._shown.get(name), part):
                    setattr(self._handles[name], part._fields[0], part[0])
                else:
                    self._handles[name] = self._added(name, part)
        self._shown = scene

    def _added(self, name: str, part: Part) -> Any:
        scene = self._server.scene
        if isinstance(part, Label):
            return scene.add_label(
                name,
                part.text,
                position=part.position,
                font_screen_scale=0.8,
                anchor='bottom-left',
            )
        if isinstance(part, Lines):
            colors = np.array([_linear(color) for color in part.colors])
            both_ends = np.stack((colors, colors), axis=1)
            return scene.add_line_segments(
                name,
                part.points,
                both_ends,
                thickness=part.width,
                thickness_units='screen',
            )
        if isinstance(part, Arrows):
            return scene.add_arrows(
                name,
                part.points,
                _rgb(part.color),
                shaft_radius=part.radius,
                head_radius=3 * part.radius,
                head_length=8 * part.radius,
            )
        return scene.add_point_cloud(
            name,
            part.points,
            _rgb(part.color),
            point_size=part.size,
            point_shape='circle',
            point_shading='flat',
            precision='float32',
        )


def _looks_like(before: Part | None, part: Part) -> bool:
    """Tell whether what is shown differs from a part in its place alone."""
    if type(before) is not type(part):
        return False
    return before[1:] == part[1:] and before[0].shape == part[0].shape


def _rgb(color: str) -> tuple[int, int, int]:
    """Return `#rrggbb` as three numbers up to 255."""
    red, green, blue = bytes.fromhex(color[1:])
    return red, green, blue


def _linear(color: str) -> Array:
    """Return `#rrggbb` in linear light up to 1, which viser takes for lines (IEC 61966-2-1)."""
    values = np.array(_rgb(color)) / 255
    return np.where(
        values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4
    )


class JointSliders:
    """A slider per joint, and below it a line that turns red outside the joint's range.

    Args:
        gui: viser's, where they go.
        chains: the chains; a joint of several has one slider.
        changed: called when a slider is moved.
        follow: whether the sliders only show what something else moves.
    """

    def __init__(
        self, gui: Any, chains: Sequence[Chain], changed: Changed, follow: bool
    ) -> None:
        self._gui = gui
        self._follow = follow
        self._links: dict[str, DHLink] = {}
        self._sliders: dict[str, Any] = {}
        self._lines: dict[str, Any] = {}
        for chain in chains:
            with gui.add_folder(f'{chain.name}={chain.version}'):
                for name, link in zip(chain.joint_names, chain.joints, strict=True):
                    if name not in self._links:
                        self._add(name, link)
                        self._sliders[name].on_update(changed)

    def _add(self, name: str, link: DHLink) -> None:
        low, high = slider_bounds(link)
        scale = _SCALES[link.joint_type]
        self._links[name] = link
        self._sliders[name] = self._gui.add_slider(
            name,
            low,
            high,
            scale.step,
            slider_start(link),
            disabled=self._follow,
            hint=f'{name} in {scale.unit}',
        )
        self._lines[name] = self._gui.add_html('')

    def positions(self, chain: Chain) -> list[float]:
        """Return the joint positions of a chain [rad or m] at which its sliders stand."""
        positions = []
        for name in chain.joint_names:
            scale = _SCALES[self._links[name].joint_type]
            positions.append(float(self._sliders[name].value) / scale.per)
        return positions

    def show(self, positions: Mapping[str, float]) -> None:
        """Say whether joint positions [rad or m] are in range; sliders that follow move there.

        Beyond its end a slider cannot go.
        """
        for name, position in positions.items():
            link, slider = self._links[name], self._sliders[name]
            self._lines[name].content = _range_line(link, position)
            if self._follow:
                shown = _SCALES[link.joint_type].per * position
                slider.value = min(max(shown, slider.min), slider.max)

    def reset(self) -> None:
        """Move all sliders to where they stood first."""
        for name, slider in self._sliders.items():
            slider.value = slider_start(self._links[name])


def slider_bounds(link: DHLink) -> tuple[float, float]:
    """Return the ends of a joint's slider [deg or m]: a fifth of its range beyond either end."""
    lower, upper = _shown_limits(link)
    scale = _SCALES[link.joint_type]
    if not math.isfinite(lower):
        lower = min(-scale.most, upper - scale.most)
    if not math.isfinite(upper):
        upper = max(scale.most, lower + scale.most)
    margin, whole = _BEYOND * (upper - lower), scale.whole
    low = whole * math.floor((lower - margin) / whole)
    high = whole * math.ceil((upper + margin) / whole)
    return round(low, 2), round(high, 2)


def slider_start(link: DHLink) -> float:
    """Return where a slider stands first [deg or m]: at 0, or at the nearest end of the range."""
    lower, upper = _shown_limits(link)
    return min(max(0.0, lower), upper)


def _shown_limits(link: DHLink) -> tuple[float, float]:
    """Return the ends of a joint's range [deg or m]."""
    lower, upper = link.limits
    per = _SCALES[link.joint_type].per
    return per * lower, per * upper


def _range_line(link: DHLink, position: float) -> str:
    """Return the line below a slider, as HTML."""
    lower, upper = link.limits
    allowed = chain_text.joint_range(link)
    if lower - _ROUNDING <= position <= upper + _ROUNDING:
        words, color = f'range {allowed}' if allowed else 'no range', _GREY
    else:
        words, color = (
            f'{chain_text.position(link, position)} is outside {allowed}',
            _RED,
        )
    return f'<div style="{_SMALL};margin-top:-6px;color:{color}">{html.escape(words)}</div>'


class Numbers:
    """Texts with their titles; a click selects one, to be copied."""

    def __init__(self, gui: Any) -> None:
        self._html = gui.add_html('')

    def show(self, texts: Mapping[str, Sequence[str]], note: str = '') -> None:
        """Show the lines of some texts by their titles, and a note in red."""
        parts = []
        for title, lines in texts.items():
            parts.append(_div(title, _GREY))
            copied = html.escape('\n'.join(lines))
            parts.append(
                f'<pre style="{_COPIED}" title="a click selects it">{copied}</pre>'
            )
        if note:
            parts.append(_div(note, _RED))
        self._html.content = ''.join(parts)


def _div(words: str, color: str) -> str:
    return f'<div style="{_SMALL};color:{color}">{html.escape(words)}</div>'


def tip_texts(posed: PosedChain) -> dict[str, list[str]]:
    """Return the pose of a chain's tip in texts by title, in the numbers of `leg_fk pose`."""
    T = posed.frames[-1]
    angles = np.degrees(roll_pitch_yaw(T[:3, :3]))
    quaternion = posed.chain.pose(posed.q)[3:]
    return {
        'position (m)': [_named('xyz', text.numbers(T[:3, 3]))],
        'quaternion': [_named('xyzw', text.numbers(quaternion))],
        'roll, pitch, yaw (deg)': [
            _named(('roll', 'pitch', 'yaw'), text.numbers(angles, 4))
        ],
        'matrix (translation in m)': text.transform(T),
    }


def _named(names: Sequence[str], numbers: Sequence[str]) -> str:
    cells = zip(names, numbers, strict=True)
    return '  '.join(f'{name} {number:>10}' for name, number in cells)
