"""The Denavit-Hartenberg table of any serial chain in a URDF, by the documented method.

Steps 1 to 4 of the method place the frames (z axes along the joints, origins by the common
normals, x axes along them, y axes by the right hand), step 5 reads the table off them, step 6, the
product, is `Chain`. What is in front of the first joint becomes T_Ro0, what is behind the last
frame T_nIs, so nothing of the URDF is lost.

Where the method leaves a choice it is made in this order: d = 0, angles that are multiples of 90
degrees, a >= 0. Axes that a URDF's rounding has made almost parallel are taken as parallel; those
that truly are a little apart, whose common normal is far away, get a fixed row between them.
"""

from collections.abc import Sequence
from itertools import pairwise
import math
from pathlib import Path
from typing import NamedTuple

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics.chain import Chain, TipFrame
from icub_leg_fk.kinematics.link import CONVENTIONS, DHLink
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.kinematics.urdf_file import MOVING, Urdf
import numpy as np

PARALLEL = 1e-4  # rad; below it axes are taken as parallel

_EXACT = 1e-11  # rad and m; below it a number is rounding
_NEARLY = 0.2  # rad; between axes that are this near a common normal may be far away
_FAR = 1.0  # m along an axis, beside five times the distance of the joints


def chain_from_urdf(urdf: Urdf | str | Path, root: str, tip: str, *, name: str = '',
                    version: str = 'urdf', convention: str = 'standard',
                    tolerance: float = PARALLEL) -> Chain:
    """Return the chain between two links of a URDF, as a Denavit-Hartenberg table.

    Args:
        urdf: path of a URDF, or one that has been read.
        root: name of the link to start from.
        tip: name of a link below it.
        name: name of the chain; the tip's if empty.
        version: version of the chain.
        convention: `standard` or `modified`, in which it prints and is written.
        tolerance: angle between axes up to which they are taken as parallel [rad].

    Raises:
        InputFileError: the file is not a URDF, or these links are not a chain.
    """
    if convention not in CONVENTIONS:
        raise InputFileError(f'convention is {convention!r}; allowed: {", ".join(CONVENTIONS)}')
    robot = urdf if isinstance(urdf, Urdf) else Urdf.load(urdf)
    axes, T_end = _axes(robot, root, tip)
    frames, links = _place(axes, T_end, tolerance)
    T_n_tip = _rounded(np.linalg.inv(frames[-1]) @ T_end)
    if convention == 'modified':  # whose rows have no a and alpha behind the last joint
        last = links[-1]
        T_n_tip = DHLink(a=last.a, d=0.0, alpha=last.alpha).transform() @ T_n_tip
        links[-1] = _link(last.joint_type, 0.0, last.d, 0.0, last.offset, last.lower, last.upper)
    return Chain(
        name=name or tip, version=version, root_frame=root, tip=name or tip,
        joint_names=tuple(axis.joint for axis in axes), links=tuple(links),
        tip_frames={tip: TipFrame(tip)},
        T_root_0=_rounded(frames[0]), T_n_tip=T_n_tip, convention=convention)


def almost_parallel(urdf: Urdf, root: str, tip: str, tolerance: float = PARALLEL
                    ) -> list[tuple[str, str, float]]:
    """Return the pairs of joints whose axes `chain_from_urdf` takes as parallel, and their angle.

    Args:
        urdf: the robot.
        root: name of the link to start from.
        tip: name of a link below it.
        tolerance: angle between axes up to which they are taken as parallel [rad].
    """
    axes, _ = _axes(urdf, root, tip)
    angles = [
        (one.joint, two.joint, float(np.linalg.norm(np.cross(one.direction, two.direction))))
        for one, two in pairwise(axes)]
    return [pair for pair in angles if _EXACT < pair[2] <= tolerance]


class _Axis(NamedTuple):
    """Where a joint's axis is at q = 0, in the root link."""

    joint: str
    kind: str
    direction: Array
    point: Array
    lower: float
    upper: float


def _axes(robot: Urdf, root: str, tip: str) -> tuple[list[_Axis], Array]:
    """Take step 1, the z axes; return them and T_root_tip at q = 0."""
    T, axes = np.eye(4), []
    for joint in robot.path(root, tip):
        T = T @ joint.origin
        if joint.kind in MOVING:
            axes.append(_Axis(joint.name, MOVING[joint.kind], T[:3, :3] @ joint.axis,
                              T[:3, 3].copy(), joint.lower, joint.upper))
    if not axes:
        raise InputFileError(f'{robot.file}: no joint moves between {root!r} and {tip!r}')
    return axes, T


def _place(axes: Sequence[_Axis], T_end: Array, tolerance: float
           ) -> tuple[list[Array], list[DHLink]]:
    """Place the frames one after the other and read the rows off them (steps 2 to 5)."""
    frames = [_first_frame(axes)]
    links: list[DHLink] = []

    def add(frame: Array, kind: str = 'fixed', lower: float = -math.inf,
            upper: float = math.inf) -> None:
        links.append(_row(frames[-1], frame, kind, lower, upper))
        # Behind the row as it was read, so that what rounding it has cost does not add up.
        frames.append(frames[-1] @ links[-1].transform())

    for axis, following in pairwise(axes):
        # Of a slide only the direction counts; its line may pass where the frame before it is.
        point = frames[-1][:3, 3] if following.kind == 'prismatic' else following.point
        limits = axis.kind, axis.lower, axis.upper
        reach = _FAR + 5 * float(np.linalg.norm(following.point - axis.point))
        if _is_far(frames[-1], following.direction, point, tolerance, reach):
            start = frames[-1][:3, 3]
            foot = point + following.direction * (following.direction @ (start - point))
            across = (foot - start) / np.linalg.norm(foot - start)
            add(_next_frame(frames[-1], across, start, 0.0), *limits)
            add(_next_frame(frames[-1], following.direction, foot, 0.0))
        else:
            add(_next_frame(frames[-1], following.direction, point, tolerance), *limits)
    last = axes[-1]
    z, point = T_end[:3, 2], T_end[:3, 3]
    parallel = float(np.linalg.norm(np.cross(frames[-1][:3, 2], z))) < _EXACT
    if parallel:  # then the last frame can stand in the tip
        frame = _next_frame(frames[-1], z, point, _EXACT)
        frame[:3, 3] = point
    elif _is_far(frames[-1], z, point, 0.0, _FAR + 5 * float(np.linalg.norm(
            point - frames[-1][:3, 3]))):
        frame = frames[-1]  # the tip's own transform has no limits
    else:
        frame = _next_frame(frames[-1], z, point, 0.0)
    add(frame, last.kind, last.lower, last.upper)
    return frames, links


def _first_frame(axes: Sequence[_Axis]) -> Array:
    """Return frame 0: on the first axis, where d_1 = 0 if near, its x along a root axis."""
    z, origin = axes[0].direction, axes[0].point
    if len(axes) > 1 and axes[1].kind == axes[0].kind == 'revolute':
        normal = np.cross(z, axes[1].direction)
        if (sine := float(normal @ normal)) > _NEARLY ** 2:
            along = float(np.cross(axes[1].point - origin, axes[1].direction) @ normal) / sine
            if abs(along) < _FAR:
                origin = origin + along * z
    x = np.eye(3)[int(np.argmin(np.abs(z).round(9)))]
    return _frame(x - z * (x @ z), z, origin)


def _is_far(frame: Array, z: Array, point: Array, tolerance: float, reach: float) -> bool:
    """Tell whether the common normal of almost parallel axes is farther away than a reach."""
    normal = np.cross(frame[:3, 2], z)
    sine = float(np.linalg.norm(normal))
    if not tolerance < sine < _NEARLY:
        return False
    start = frame[:3, 3]
    along = (float(np.cross(point - start, z) @ normal) / sine ** 2,
             float(np.cross(point - start, frame[:3, 2]) @ normal) / sine ** 2)
    foot = point + z * (z @ (start - point))
    return max(map(abs, along)) > reach and float(np.linalg.norm(foot - start)) > _EXACT


def _next_frame(frame: Array, z: Array, point: Array, tolerance: float) -> Array:
    """Return the frame on the next axis, its x along the common normal (steps 2 to 4)."""
    x0, z0, start = frame[:3, 0], frame[:3, 2], frame[:3, 3]
    normal = np.cross(z0, z)
    sine = float(np.linalg.norm(normal))
    if sine <= max(tolerance, _EXACT):  # parallel: d = 0
        z = z0 if z0 @ z > 0 else -z0
        origin = point + z0 * (z0 @ (start - point))
        x = origin - start
        if np.linalg.norm(x) < _EXACT:  # and the same: theta = 0
            return _frame(x0, z, start)
        return _frame(x, z, origin)
    normal /= sine
    along = float(np.cross(point - start, z0) @ normal) / sine  # from the point to the normal
    origin = point + along * z
    a = float((origin - start) @ normal)
    if abs(a) < _EXACT:  # they cross: the x nearer to the one before
        cosine, sine0 = float(x0 @ normal), float(np.cross(x0, normal) @ z0)
        flip = cosine < -_EXACT or (abs(cosine) <= _EXACT and sine0 < 0)
    else:
        flip = a < 0
    return _frame(-normal if flip else normal, z, origin)


def _row(before: Array, after: Array, kind: str, lower: float, upper: float) -> DHLink:
    """Read theta, d, a and alpha off two frames (step 5)."""
    T = np.linalg.inv(before) @ after
    theta = math.atan2(T[1, 0], T[0, 0])
    c, s = math.cos(theta), math.sin(theta)
    return _link(kind, c * T[0, 3] + s * T[1, 3], T[2, 3], math.atan2(T[2, 1], T[2, 2]), theta,
                 lower, upper)


def _link(kind: str, a: float, d: float, alpha: float, theta: float, lower: float, upper: float
          ) -> DHLink:
    a, d = (0.0 if abs(value) < _EXACT else float(value) for value in (a, d))
    return DHLink(a=a, d=d, alpha=_clean_angle(alpha), offset=_clean_angle(theta),
                  joint_type=kind, lower=lower, upper=upper)


def _clean_angle(angle: float) -> float:
    """Return an angle, the right one if it is one but for rounding, and pi for -pi."""
    quarters = round(angle / (math.pi / 2))
    if abs(angle - quarters * math.pi / 2) < _EXACT:
        angle = quarters * math.pi / 2
    return math.pi if angle == -math.pi else float(angle)


def _rounded(T: Array) -> Array:
    """Return a transform without the rounding noise about 0, 1 and -1."""
    T = np.array(T)
    whole = np.rint(T)
    near_whole = np.abs(T - whole) < 1e-14
    near_whole[:3, 3] &= whole[:3, 3] == 0
    T[near_whole] = whole[near_whole]
    return T + 0.0


def _frame(x: Array, z: Array, origin: Array) -> Array:
    """Return the frame of an x axis, a z axis and an origin; y by the right hand."""
    T = np.eye(4)
    x = x - z * (x @ z)
    x = x / np.linalg.norm(x)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, np.cross(z, x), z, origin
    return T
