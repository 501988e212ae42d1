"""The Denavit-Hartenberg table of any serial chain in a URDF, by the documented method.

Steps 1 to 4 of the method place the frames (z axes along the joints, origins by the common
normals, x axes along them, y axes by the right hand), step 5 reads the table off them, step 6, the
product, is `Chain`. What is before the first joint becomes T_Ro0, what is after the last frame
T_nIs, so nothing of the URDF is lost.

Where the method leaves a choice it is made in this order: d = 0, angles that are multiples of 90
degrees, a >= 0. Axes that are almost parallel, whose common normal is far away, get a fixed row
between them, so the table is exact and no number is large. For people it is tidied instead: URDFs
are rounded, and what is almost parallel or almost a right angle was meant to be.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
import math
from pathlib import Path
import re
from typing import Any, NamedTuple

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics.chain import Chain, TipFrame
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.kinematics.urdf_file import Urdf, UrdfJoint
import numpy as np

VERSION = 'urdf'

TIDY = 1e-4  # rad; a tolerance that tidies the tables of real robots for people

_EXACT = 1e-11  # rad and m; below it a number is rounding
_SHORT = 1e-8  # m; what is shorter is 0 in a tidied table
_NEARLY = 0.2  # rad; between axes that are this near a common normal may be far away
_FAR = 1.0  # m along an axis, added to five times the distance of the joints


def chain_from_urdf(
    urdf: Urdf, root: str, tip: str, *, tolerance: float = 0.0
) -> Chain:
    """Return the chain between two links of a URDF, as a Denavit-Hartenberg table.

    Joints that mimic others become rows that follow them.

    Args:
        urdf: the robot.
        root: name of the link to start from.
        tip: name of a link below it, or one reached by going up over fixed joints first.
        tolerance: angle up to which axes are taken as parallel, and angles as right ones [rad].

    Raises:
        UnknownNameError: there is no such link; lists those at the ends.
        InputFileError: these links are not a chain, or a joint cannot be described by a table.
    """
    axes, T_end = _axes(urdf, root, tip)
    frames, links = _frames_and_rows(axes, T_end, tolerance)
    name = topic_name(tip)
    return Chain(
        name=tip,
        version=VERSION,
        root_frame=root,
        tip=name,
        joint_names=tuple(dict.fromkeys(axis.joint.moved_by for axis in axes)),
        links=tuple(links),
        T_root_0=_rounded(frames[0]),
        tip_frames={name: TipFrame(tip)},
        T_n_tip=_rounded(np.linalg.inv(frames[-1]) @ T_end),
        source=Path(urdf.file).name,
    )


def as_modified(chain: Chain) -> Chain:
    """Return a chain in the modified convention, whose rows have no a and alpha after the last."""
    last = chain.links[-1]
    after = DHLink(a=last.a, d=0.0, alpha=last.alpha, joint_type='fixed').transform()
    links = (*chain.links[:-1], replace(last, a=0.0, alpha=0.0))
    return replace(
        chain, links=links, T_n_tip=after @ chain.T_n_tip, convention='modified'
    )


def topic_name(name: str) -> str:
    """Return a link's name as it may stand in the name of a topic."""
    word = re.sub('[^A-Za-z0-9_]', '_', name)
    return word if re.match('[A-Za-z]', word) else f'tip_{word}'


def almost_parallel(
    urdf: Urdf, root: str, tip: str, tolerance: float
) -> list[tuple[str, str, float]]:
    """Return the pairs of joints whose axes are taken as parallel, and their angle [rad].

    Args:
        urdf: the robot.
        root: name of the link to start from.
        tip: name of a link below it.
        tolerance: angle between axes up to which they are taken as parallel [rad].
    """
    axes, _ = _axes(urdf, root, tip)
    pairs = []
    for one, two in pairwise(axes):
        angle = float(np.linalg.norm(np.cross(one.direction, two.direction)))
        if _EXACT < angle <= tolerance:
            pairs.append((one.joint.moved_by, two.joint.moved_by, angle))
    return pairs


class _Axis(NamedTuple):
    """Where a joint's axis is at q = 0, in the root link."""

    joint: UrdfJoint
    direction: Array
    point: Array


def _axes(urdf: Urdf, root: str, tip: str) -> tuple[list[_Axis], Array]:
    """Take step 1, the z axes; return them and T_root_tip at q = 0."""
    T, axes = np.eye(4), []
    for joint in urdf.path(root, tip):
        T = T @ joint.origin
        if joint.moves:
            axes.append(_Axis(joint, T[:3, :3] @ joint.axis, T[:3, 3].copy()))
            T = T @ joint.motion(np.array([joint.offset]))[0]
    if not axes:
        raise InputFileError(urdf.file, f'no joint moves between {root!r} and {tip!r}')
    return axes, T


def _motions(axes: Sequence[_Axis]) -> list[dict[str, Any]]:
    """Return what moves the row of each axis: a joint by its name if it moves several rows."""
    names = [axis.joint.moved_by for axis in axes]
    motions: list[dict[str, Any]] = []
    for index, (joint, _, _) in enumerate(axes):
        motion: dict[str, Any] = {'joint_type': joint.kind, 'gain': joint.gain}
        if names.count(joint.moved_by) > 1:
            motion['joint'] = joint.moved_by
        if joint.moved_by not in names[:index]:  # the first row has the range
            motion.update(lower=joint.lower, upper=joint.upper)
        motions.append(motion)
    return motions


def _frames_and_rows(
    axes: Sequence[_Axis], T_end: Array, tolerance: float
) -> tuple[list[Array], list[DHLink]]:
    """Place the frames one after the other and read the rows off them (steps 2 to 5)."""
    frames = [_first_frame(axes)]
    links: list[DHLink] = []
    for axis, following, motion in zip(
        axes, [*axes[1:], None], _motions(axes), strict=True
    ):
        if following is None:
            placed = [_last_frame(frames[-1], T_end, tolerance)]
        else:
            placed = _frames_on(frames[-1], axis, following, tolerance)
        for frame in placed:
            link = _fixed_row(frames[-1], frame, tolerance)
            # After the row as it was read, so that what rounding it has cost does not add up.
            frames.append(frames[-1] @ link.transform())
            links.append(replace(link, **motion) if frame is placed[0] else link)
    return frames, links


def _frames_on(
    frame: Array, axis: _Axis, following: _Axis, tolerance: float
) -> list[Array]:
    """Return the frame on the next joint's axis, after one across if that axis is awkward."""
    # Of a slide only the direction counts; its line may pass where the frame before it is.
    start, z = frame[:3, 3], following.direction
    point = start if following.joint.kind == 'prismatic' else following.point
    reach = _FAR + 5 * float(np.linalg.norm(following.point - axis.point))
    if not _is_far(frame, z, point, tolerance, reach):
        return [_next_frame(frame, z, point, tolerance)]
    foot = _foot(start, point, z)
    across = (foot - start) / np.linalg.norm(foot - start)
    first = _next_frame(frame, across, start, 0.0)
    return [first, _next_frame(first, z, foot, 0.0)]


def _last_frame(frame: Array, T_end: Array, tolerance: float) -> Array:
    """Return the last row's frame: in the tip if it can stand there, else wherever is near."""
    z, point = T_end[:3, 2], T_end[:3, 3]
    apart = max(tolerance, _EXACT)
    if float(np.linalg.norm(np.cross(frame[:3, 2], z))) <= apart:
        last = _next_frame(frame, z, point, apart)
        last[:3, 3] = point
        return last
    reach = _FAR + 5 * float(np.linalg.norm(point - frame[:3, 3]))
    if _is_far(frame, z, point, 0.0, reach):
        return frame  # the tip's own transform has no limits
    return _next_frame(frame, z, point, 0.0)


def _first_frame(axes: Sequence[_Axis]) -> Array:
    """Return frame 0: on the first axis, where d_1 = 0 if near, its x along a root axis."""
    z, origin = axes[0].direction, axes[0].point
    if len(axes) > 1 and axes[1].joint.kind == axes[0].joint.kind == 'revolute':
        _, sine, along, _ = _common_normal(origin, z, axes[1].point, axes[1].direction)
        if sine > _NEARLY and abs(along) < _FAR:
            origin = origin + along * z
    x = np.eye(3)[int(np.argmin(np.abs(z).round(9)))]
    return _frame(x - z * (x @ z), z, origin)


def _common_normal(
    point: Array, z: Array, next_point: Array, next_z: Array
) -> tuple[Array, float, float, float]:
    """Return the common normal of two lines.

    Returns:
        Its (3,) unit vector, 0 if the lines are parallel; the sine of the angle between them; how
        far it is from the point of the first line, and from that of the second, along them.
    """
    normal = np.cross(z, next_z)
    sine = float(np.linalg.norm(normal))
    if sine == 0.0:
        return normal, sine, 0.0, 0.0
    normal /= sine
    along, along_next = (
        float(np.cross(next_point - point, other) @ normal) / sine
        for other in (next_z, z)
    )
    return normal, sine, along, along_next


def _foot(start: Array, point: Array, z: Array) -> Array:
    """Return the point of a line that is nearest to another point."""
    return np.asarray(point + z * (z @ (start - point)))


def _is_far(
    frame: Array, z: Array, point: Array, tolerance: float, reach: float
) -> bool:
    """Return whether the common normal of almost parallel axes is farther away than a reach."""
    start = frame[:3, 3]
    _, sine, *along = _common_normal(start, frame[:3, 2], point, z)
    if not tolerance < sine < _NEARLY:
        return False
    is_apart = float(np.linalg.norm(_foot(start, point, z) - start)) > _EXACT
    return is_apart and max(map(abs, along)) > reach


def _next_frame(frame: Array, z: Array, point: Array, tolerance: float) -> Array:
    """Return the frame on the next axis, its x along the common normal (steps 2 to 4)."""
    x0, z0, start = frame[:3, 0], frame[:3, 2], frame[:3, 3]
    x, sine, _, along = _common_normal(start, z0, point, z)
    if sine <= max(tolerance, _EXACT):  # parallel: d = 0
        z = z0 if z0 @ z > 0 else -z0
        origin = _foot(start, point, z)
        if np.linalg.norm(origin - start) < _EXACT:  # and the same: theta = 0
            return _frame(x0, z, start)
        return _frame(origin - start, z, origin)
    origin = point + along * z
    a = float((origin - start) @ x)
    if abs(a) < _EXACT:  # they cross: the x nearer to the one before
        cosine = float(x0 @ x)
        points_away = abs(cosine) <= _EXACT and float(np.cross(x0, x) @ z0) < 0
        is_other = cosine < -_EXACT or points_away
    else:
        is_other = a < 0
    return _frame(-x if is_other else x, z, origin)


def _fixed_row(before: Array, after: Array, tolerance: float) -> DHLink:
    """Read theta, d, a and alpha off two frames (step 5), tidied if there is a tolerance."""
    T = np.linalg.inv(before) @ after
    theta = math.atan2(T[1, 0], T[0, 0])
    a = math.cos(theta) * T[0, 3] + math.sin(theta) * T[1, 3]
    alpha = math.atan2(T[2, 1], T[2, 2])
    shortest = _SHORT if tolerance else _EXACT
    a, d = (0.0 if abs(length) < shortest else length for length in (a, T[2, 3]))
    alpha, offset = (
        _clean_angle(angle, max(tolerance, _EXACT)) for angle in (alpha, theta)
    )
    return DHLink(a, d, alpha, offset, 'fixed')


def _clean_angle(angle: float, apart: float) -> float:
    """Return an angle, the right one if it is apart from it by no more, and pi for -pi."""
    quarters = round(angle / (math.pi / 2))
    if abs(angle - quarters * math.pi / 2) <= apart:
        angle = quarters * math.pi / 2
    return math.pi if angle == -math.pi else angle


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
