"""The Denavit-Hartenberg method in six steps: what the viewer draws and says of each.

A table in the modified convention (Craig's) has a and alpha of a row before its joint. There the
joint of row i turns about z_(i+1), and the row's common normal starts in the origin of frame i.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
import math
import re

from icub_leg_fk.kinematics.chain_text import short
from icub_leg_fk.kinematics.rotation import Array, turns_about
from icub_leg_fk.tools.explanation import explain
from icub_leg_fk.tools.explanation_text import as_text
from icub_leg_fk.tools.space import AXIS_COLORS
from icub_leg_fk.tools.viewer_scene import (
    ARROW,
    Arrows,
    axes,
    DOT,
    Dots,
    FAINT,
    faint_scene,
    INK,
    Label,
    labels,
    polyline,
    PosedChain,
    Scene,
    segments,
)
import numpy as np

LAST_STEP = 6
_TABLE, _PRODUCT = 5, 6

_X_COLOR, _, _Z_COLOR = AXIS_COLORS
_ARC_STEP = math.radians(4)
_NOTHING = 1e-9  # m or rad; less is not drawn


@dataclass(frozen=True)
class RowGeometry:
    """Where the four parameters of a row are in space, in the root frame.

    Attributes:
        theta: angle about `z` from the first x axis to the second [rad].
        d: length along `z` [m].
        a: length along `x` [m].
        alpha: angle about `x` from the first z axis to the second [rad].
        x: (3,) the x axis along which a lies.
        z: (3,) the z axis along which d lies.
        d_ends: (2, 3) the ends of d.
        a_ends: (2, 3) the ends of a, which is the common normal.
    """

    theta: float
    d: float
    a: float
    alpha: float
    x: Array
    z: Array
    d_ends: Array
    a_ends: Array


class Method:
    """The six steps for a chain at one joint vector.

    Args:
        posed: the chain.
        size: size of the scene [m].
    """

    def __init__(self, posed: PosedChain, size: float) -> None:
        self.frames = posed.frames[:-1]
        self._tip = posed.frames[-1]
        self._posed = posed
        self._size = size
        self._explanation = explain(posed.chain, posed.q)
        self._rows = self._explanation.rows

    def scene(self, step: int, row: int) -> Scene:
        """Return what is drawn at a step, 1 to 6; at step 5 for one row."""
        if step == _TABLE:
            return self._row_scene(row)
        if step == _PRODUCT:
            return self._product_scene()
        scene = self._axis_scene('z', 2, 0.17)
        if step == 1:
            return scene | faint_scene(self._posed)
        scene |= self._origin_scene() | self._path_scene(range(len(self._rows)), INK)
        if step >= 3:
            scene |= self._axis_scene('x', 0, 0.11)
        if step >= 4:
            scene |= self._axis_scene('y', 1, 0.11)
        return scene

    def words(self, step: int, row: int) -> str:
        """Return what `leg_fk explain` prints of a step, 1 to 6; of step 5 one row."""
        words = as_text(self._explanation)
        steps = re.split(r'^(?=Step \d\.)', words, flags=re.MULTILINE)
        if step != _TABLE:
            return steps[step].strip()
        rows = re.split(r'^(?=A_\d+ = )', steps[step], flags=re.MULTILINE)
        return f'{steps[step].splitlines()[0]}\n\n{rows[1 + row]}'.strip()

    def geometry(self, row: int) -> RowGeometry:
        """Return where the four parameters of a row are in space."""
        before, after = self.frames[row], self.frames[row + 1]
        explained = self._rows[row]
        theta, d = float(explained.theta), float(explained.d) / 1000
        link = explained.link
        first, last = before[:3, 3], after[:3, 3]
        if self._explanation.is_modified:
            x, z = before[:3, 0], after[:3, 2]
            foot = first + link.a * x
            a_ends, d_ends = (first, foot), (foot, last)
        else:
            x, z = after[:3, 0], before[:3, 2]
            foot = first + d * z
            d_ends, a_ends = (first, foot), (foot, last)
        return RowGeometry(
            theta, d, link.a, link.alpha, x, z, np.array(d_ends), np.array(a_ends)
        )

    def _axis_scene(self, letter: str, column: int, length: float) -> Scene:
        """Return one axis of every frame with its name; a z axis goes on beyond its origin."""
        origins = self.frames[:, :3, 3]
        along = length * self._size * self.frames[:, :3, column]
        names = [f'{letter}_{i}' for i in range(len(self.frames))]
        scene = labels(f'method/{letter}', names, origins + 1.1 * along, self._size)
        ends = np.stack((origins, origins + along), axis=1)
        scene[f'method/{letter} axes'] = Arrows(
            ends, AXIS_COLORS[column], ARROW * self._size
        )
        if letter == 'z':
            lines = np.stack((origins - along, origins), axis=1)
            scene['method/z lines'] = segments(lines, _Z_COLOR, 1.0)
        return scene

    def _origin_scene(self) -> Scene:
        origins = self.frames[:, :3, 3]
        names = [f'o_{i}' for i in range(len(origins))]
        scene = labels('method/origin', names, origins, self._size)
        scene['method/origins'] = Dots(origins, INK, DOT * self._size)
        return scene

    def _path_scene(self, rows: Iterable[int], color: str) -> Scene:
        """Return the way through the table, along each d in grey and along each common normal."""
        geometries = [self.geometry(row) for row in rows]
        normals = [row.a_ends for row in geometries if abs(row.a) > _NOTHING]
        offsets = [row.d_ends for row in geometries if abs(row.d) > _NOTHING]
        scene: Scene = {}
        if normals:
            width = 2.0 if color == FAINT else 5.0
            scene['method/common normals'] = segments(np.array(normals), color, width)
        if offsets:
            scene['method/offsets'] = segments(np.array(offsets), FAINT, 2.0)
        return scene

    def _row_scene(self, row: int) -> Scene:
        """Return theta, d, a and alpha of a row, and the frames between which they lead."""
        geometry = self.geometry(row)
        pair = np.stack((self.frames[row], self.frames[row + 1]))
        length = 0.2 * self._size
        tips = pair[:, :3, 3, None] + 1.08 * length * pair[:, :3, :3]
        names = [f'{axis}_{i}' for i in (row, row + 1) for axis in 'xyz']
        scene = labels(
            'method/axis', names, tips.swapaxes(1, 2).reshape(-1, 3), self._size
        )
        scene['method/two frames'] = axes(pair, length, 2.5)
        others = [other for other in range(len(self._rows)) if other != row]
        scene |= self._path_scene(others, FAINT)
        scene |= _length_scene(f'd_{row}', geometry.d, geometry.d_ends, _Z_COLOR)
        scene |= _length_scene(f'a_{row}', geometry.a, geometry.a_ends, _X_COLOR)
        # Both angles are drawn in the frame's origin from which, or to which, their axis leads.
        z_origin, x_origin = pair[:, :3, 3]
        if self._explanation.is_modified:
            x_origin, z_origin = z_origin, x_origin
        radius = 0.1 * self._size
        theta = arc(z_origin, geometry.z, radius * pair[0, :3, 0], geometry.theta)
        alpha = arc(x_origin, geometry.x, radius * pair[0, :3, 2], geometry.alpha)
        scene |= _angle_scene(f'theta_{row}', geometry.theta, z_origin, theta, _Z_COLOR)
        return scene | _angle_scene(
            f'alpha_{row}', geometry.alpha, x_origin, alpha, _X_COLOR
        )

    def _product_scene(self) -> Scene:
        """Return the way from frame to frame, and the tip's frame to which it leads."""
        places = np.vstack((np.zeros(3), self.frames[:, :3, 3], self._tip[:3, 3]))
        names = ['T_Ro0', *(f'A_{i}' for i in range(len(self._rows)))]
        names += filter(None, [' '.join(self._explanation.tips)])
        ends = np.stack((places[:-1], places[1:]), axis=1)[: len(names)]
        scene = labels('method/factor', names, ends.mean(axis=1), self._size)
        scene['method/frames'] = axes(self.frames, 0.06 * self._size, 2.0)
        scene['method/tip'] = axes(self._tip[None], 0.16 * self._size, 5.0)
        scene['method/tip name'] = Label(self._tip[:3, 3], self._posed.chain.frame_id)
        is_long = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) > _NOTHING
        if is_long.any():
            scene['method/factors'] = Arrows(ends[is_long], INK, ARROW * self._size)
        return scene


def arc(center: Array, axis: Array, start: Array, angle: float) -> Array:
    """Return (N, 3) points from center + start an angle [rad] on about an axis."""
    turned = math.copysign(min(abs(angle), 2 * math.pi), angle)
    angles = np.linspace(0.0, turned, 2 + int(abs(turned) / _ARC_STEP))
    return np.asarray(center + turns_about(axis, angles) @ start)


def _length_scene(name: str, length: float, ends: Array, color: str) -> Scene:
    """Return a length [m] with its name and value; nothing if it is 0."""
    if abs(length) < _NOTHING:
        return {}
    words = f'{name} = {short(1000 * length)}'
    return {
        f'method/{name}': polyline(ends, color, 7.0),
        f'method/{name} value': Label(ends.mean(axis=0), words),
    }


def _angle_scene(
    name: str, angle: float, center: Array, points: Array, color: str
) -> Scene:
    """Return an angle [rad] as an arc with its name and value; nothing if it is 0."""
    if abs(angle) < _NOTHING:
        return {}
    sides = np.stack((points[0], center, points[-1]))
    label_place = center + 1.25 * (points[len(points) // 2] - center)
    words = f'{name} = {short(math.degrees(angle))} deg'
    return {
        f'method/{name}': polyline(points, color, 5.0),
        f'method/{name} sides': polyline(sides, color, 1.5),
        f'method/{name} value': Label(label_place, words),
    }
