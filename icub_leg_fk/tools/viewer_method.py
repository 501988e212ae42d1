"""The Denavit-Hartenberg method in six steps: what the viewer draws and says of each.

A table in the modified convention (Craig's) has a and alpha of a row before its joint. There the
joint of row i turns about z_(i+1), and the row's common normal starts in the origin of frame i.
Lengths are shown in mm, as the printed tables have them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
import math
import re

from icub_leg_fk.kinematics.chain_text import short
from icub_leg_fk.kinematics.rotation import Array, turns_about
from icub_leg_fk.tools import text
from icub_leg_fk.tools.space import AXIS_COLORS
from icub_leg_fk.tools.viewer_scene import (
    arrows,
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

STEPS = (
    'The z axis of each joint',
    'The origin of each frame, and the common normals (mm)',
    'The x axis of each frame',
    'The y axis of each frame, by the right-hand rule',
    'The table, one row at a time (mm)',
    'Multiply (mm)',
)

_X_COLOR, _Y_COLOR, _Z_COLOR = AXIS_COLORS
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
        self.chain = posed.chain
        self.rows = posed.chain.rows()
        self.frames = posed.frames[:-1]
        self.tip = posed.frames[-1]
        self._is_modified = posed.chain.convention == 'modified'
        self._posed = posed
        self._size = size

    def scene(self, step: int, row: int) -> Scene:
        """Return what is drawn at a step, 1 to 6; at step 5 for one row."""
        if step == 5:
            return self._row_scene(row)
        if step == 6:
            return self._product_scene()
        scene = self._axis_scene('z', 2, 0.17)
        if step == 1:
            return scene | faint_scene(self._posed)
        scene |= self._origin_scene() | self._path_scene(range(len(self.rows)), INK)
        if step >= 3:
            scene |= self._axis_scene('x', 0, 0.11)
        if step >= 4:
            scene |= self._axis_scene('y', 1, 0.11)
        return scene

    def lines(self, step: int, row: int) -> list[str]:
        """Return the words for a step, 1 to 6; at step 5 of one row."""
        frames = range(len(self.frames))
        if step == 1:
            return self._vectors('z', 2, [self._axis_words(i) for i in frames])
        if step == 2:
            return self._vectors('o', 3, [self._origin_words(i) for i in frames])
        if step == 3:
            return self._vectors('x', 0, self._orthogonal_words())
        if step == 4:
            return self._vectors('y', 1, [f'z_{i} x x_{i}' for i in frames])
        return self._row_lines(row) if step == 5 else self._product_lines()

    def geometry(self, row: int) -> RowGeometry:
        """Return where the four parameters of a row are in space."""
        before, after = self.frames[row], self.frames[row + 1]
        link = self.rows[row].link
        theta, d = link.offset, link.d
        if link.is_prismatic:
            d += self._moved(row)
        elif not link.is_fixed:
            theta += self._moved(row)
        first, last = before[:3, 3], after[:3, 3]
        if self._is_modified:
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

    def _moved(self, row: int) -> float:
        """Return how far the joint of a row has moved it [rad or m]."""
        return self.rows[row].link.gain * float(
            self._posed.q[self.rows[row].joint_index]
        )

    def _axis_scene(self, letter: str, column: int, length: float) -> Scene:
        """Return one axis of every frame with its name; a z axis goes on beyond its origin."""
        origins = self.frames[:, :3, 3]
        along = length * self._size * self.frames[:, :3, column]
        names = [f'{letter}_{i}' for i in range(len(self.frames))]
        scene = labels(f'method/{letter}', names, origins + 1.1 * along, self._size)
        ends = np.stack((origins, origins + along), axis=1)
        scene[f'method/{letter} axes'] = arrows(
            ends, AXIS_COLORS[column], 3.0, self._size
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
        others = [other for other in range(len(self.rows)) if other != row]
        scene |= self._path_scene(others, FAINT)
        scene |= _length_scene(f'd_{row}', geometry.d, geometry.d_ends, _Z_COLOR)
        scene |= _length_scene(f'a_{row}', geometry.a, geometry.a_ends, _X_COLOR)
        # Both angles are drawn in the frame's origin from which, or to which, their axis leads.
        first_x, first_z = (
            0.1 * self._size * pair[0, :3, 0],
            0.1 * self._size * pair[0, :3, 2],
        )
        x_origin, z_origin = pair[1, :3, 3], pair[0, :3, 3]
        if self._is_modified:
            x_origin, z_origin = z_origin, x_origin
        theta = arc(z_origin, geometry.z, first_x, geometry.theta)
        alpha = arc(x_origin, geometry.x, first_z, geometry.alpha)
        scene |= _angle_scene(f'theta_{row}', geometry.theta, z_origin, theta, _Z_COLOR)
        return scene | _angle_scene(
            f'alpha_{row}', geometry.alpha, x_origin, alpha, _X_COLOR
        )

    def _product_scene(self) -> Scene:
        """Return the way from frame to frame, and the tip's frame to which it leads."""
        places = np.vstack((np.zeros(3), self.frames[:, :3, 3], self.tip[:3, 3]))
        ends = np.stack((places[:-1], places[1:]), axis=1)
        names = ['T_Ro0', *(f'A_{i}' for i in range(len(self.rows))), 'T_n_tip']
        if not self._has_tip_transform():
            ends, names = ends[:-1], names[:-1]
        scene = labels('method/factor', names, ends.mean(axis=1), self._size)
        scene['method/frames'] = axes(self.frames, 0.06 * self._size, 2.0)
        scene['method/tip'] = axes(self.tip[None], 0.16 * self._size, 5.0)
        scene['method/tip name'] = Label(self.chain.frame_id, self.tip[:3, 3])
        is_long = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) > _NOTHING
        if is_long.any():
            scene['method/factors'] = arrows(ends[is_long], INK, 3.0, self._size)
        return scene

    def _has_tip_transform(self) -> bool:
        return not np.allclose(self.tip, self.frames[-1], rtol=0.0, atol=1e-12)

    def _vectors(self, letter: str, column: int, remarks: Sequence[str]) -> list[str]:
        """Return a line for one column of every frame, with a remark."""
        scale = 1000.0 if column == 3 else 1.0
        cells = [_numbers(scale * T[:3, column]) for T in self.frames]
        rows = []
        for i, (vector, remark) in enumerate(
            zip(text.matrix(cells, '  '), remarks, strict=True)
        ):
            rows.append([f'{letter}_{i}', f'({vector[1:-1]})', remark])
        return text.columns(rows)

    def _axis_words(self, i: int) -> str:
        """Say which joint turns about z_i, or slides along it."""
        row = i - 1 if self._is_modified else i
        if not 0 <= row < len(self.rows):
            return 'no joint'
        link, joint, *_ = self.rows[row]
        if link.is_fixed:
            return 'a fixed row'
        return f'{joint} {"slides" if link.is_prismatic else "turns"}'

    def _origin_words(self, i: int) -> str:
        """Say why the origin of frame i is where it is."""
        row = i if self._is_modified else i - 1
        if row < 0:
            return 'T_Ro0 puts it there'
        if row == len(self.rows):
            return 'the last row puts it there'
        link = self.rows[row].link
        other = f'z_{i + 1 if self._is_modified else i - 1}'
        length = short(1000 * abs(link.a))
        is_parallel = abs(math.sin(link.alpha)) < _NOTHING
        if abs(link.a) < _NOTHING:
            return f'on {other}' if is_parallel else f'meets {other}'
        return f'{length} from {other}' + (', parallel' if is_parallel else '')

    def _orthogonal_words(self) -> list[str]:
        words = [f'orthogonal to z_{i}, z_{i + 1}' for i in range(len(self.rows))]
        return [*words, 'free'] if self._is_modified else ['as T_Ro0 has it', *words]

    def _row_lines(self, row: int) -> list[str]:
        geometry, following = self.geometry(row), row + 1
        z, x = (following, row) if self._is_modified else (row, following)
        theta, d = self._sums(row, geometry)
        values = text.columns(
            [
                [
                    f'theta_{row}',
                    f'= {theta} deg',
                    f'about z_{z}, x_{row} to x_{following}',
                ],
                [f'd_{row}', f'= {d}', f'along z_{z}'],
                [f'a_{row}', f'= {short(1000 * geometry.a)}', f'along x_{x}'],
                [
                    f'alpha_{row}',
                    f'= {_in_pi(geometry.alpha)}',
                    f'about x_{x}, z_{row} to z_{following}',
                ],
            ]
        )
        factors = [f'Rz(theta_{row}) tz(d_{row})', f'tx(a_{row}) Rx(alpha_{row})']
        if self._is_modified:
            factors = [f'Rx(alpha_{row}) tx(a_{row})', f'Rz(theta_{row}) tz(d_{row})']
        A = np.linalg.inv(self.frames[row]) @ self.frames[following]
        title = f'row i = {row}, {self.rows[row].joint or "fixed"}'
        return [
            title,
            '',
            *values,
            '',
            f'A_{row} = {" ".join(factors)} =',
            *matrix_in_mm(A),
        ]

    def _sums(self, row: int, geometry: RowGeometry) -> tuple[str, str]:
        """Return theta [deg] and d [mm] of a row, as `90 - 30 = 60` if a joint adds to it."""
        link = self.rows[row].link
        theta, d = math.degrees(geometry.theta), 1000 * geometry.d
        if link.is_fixed:
            return short(theta), short(d)
        if link.is_prismatic:
            return short(theta), _sum(1000 * link.d, d)
        return _sum(math.degrees(link.offset), theta), short(d)

    def _product_lines(self) -> list[str]:
        m = len(self.rows)
        factors = ' '.join(f'A_{i}' for i in range(m))
        T_0_m = np.linalg.inv(self.frames[0]) @ self.frames[-1]
        lines = [
            'T_Ro0 =',
            *matrix_in_mm(self.frames[0]),
            '',
            f'T_0{m} = {factors} =',
            *matrix_in_mm(T_0_m),
            '',
        ]
        product = f'T_Ro0 T_0{m}'
        if self._has_tip_transform():
            T_n_tip = np.linalg.inv(self.frames[-1]) @ self.tip
            lines += ['T_n_tip =', *matrix_in_mm(T_n_tip), '']
            product += ' T_n_tip'
        title = f'{self.chain.frame_id} in {self.chain.root_frame} = {product} ='
        return [*lines, title, *matrix_in_mm(self.tip)]


def arc(center: Array, axis: Array, start: Array, angle: float) -> Array:
    """Return (N, 3) points from center + start an angle [rad] on about an axis."""
    turned = math.copysign(min(abs(angle), 2 * math.pi), angle)
    angles = np.linspace(0.0, turned, 2 + int(abs(turned) / _ARC_STEP))
    return np.asarray(center + turns_about(axis, angles) @ start)


def matrix_in_mm(T: Array) -> list[str]:
    """Return the lines of a transform with its translation in mm."""
    shown = T.copy()
    shown[:3, 3] *= 1000.0
    return text.matrix([*map(_numbers, shown[:3]), ['0', '0', '0', '1']], '  ')


def _numbers(values: Array) -> list[str]:
    return [short(value) for value in values.tolist()]


def _length_scene(name: str, length: float, ends: Array, color: str) -> Scene:
    """Return a length [m] with its name and value; nothing if it is 0."""
    if abs(length) < _NOTHING:
        return {}
    words = f'{name} = {short(1000 * length)}'
    return {
        f'method/{name}': polyline(ends, color, 7.0),
        f'method/{name} value': Label(words, ends.mean(axis=0)),
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
        f'method/{name} value': Label(words, label_place),
    }


def _sum(constant: float, total: float) -> str:
    """Return `90 - 30 = 60`."""
    moved = short(total - constant)
    sign = '-' if moved.startswith('-') else '+'
    return f'{short(constant)} {sign} {moved.lstrip("-")} = {short(total)}'


def _in_pi(angle: float) -> str:
    """Return an angle [rad] as tables print it: -pi/2, pi, 0; else in decimals."""
    part = Fraction(f'{math.degrees(angle):.12g}') / 180
    if part.denominator > 180:
        return f'{angle:.6g}'
    words = re.sub(
        r'\b1pi', 'pi', f'{part.numerator}pi/{part.denominator}'
    ).removesuffix('/1')
    return words if part else '0'
