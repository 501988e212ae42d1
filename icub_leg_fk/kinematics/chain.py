"""A serial chain of DH links: its forward kinematics, link frames and geometric Jacobian."""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
import math
import reprlib
from typing import NamedTuple, NoReturn

from icub_leg_fk.errors import JointVectorError, LegFKError, UnknownNameError
from icub_leg_fk.kinematics import chain_text
from icub_leg_fk.kinematics.frozen import Frozen
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array, is_rigid_transform, nearest_rotation
from icub_leg_fk.kinematics.solver import Pose, Solver, Twist
import numpy as np
from numpy.typing import ArrayLike

CONVENTIONS = ('standard', 'modified')

JointPositions = Sequence[float] | Mapping[str, float] | Array


class Row(NamedTuple):
    """A row of a chain's table, and the joint that moves it.

    Attributes:
        link: the row, in the convention of its chain.
        joint: name of the joint that moves it; empty if it is fixed.
        joint_index: index of that joint in a joint vector; -1 if the row is fixed.
        is_first: whether it is the first row that this joint moves, which has its range.
    """

    link: DHLink
    joint: str
    joint_index: int
    is_first: bool


@dataclass(frozen=True, eq=False, repr=False)
class TipFrame(Frozen):
    """A frame in which the tip's pose can be given.

    Attributes:
        frame_id: its name in ROS.
        T_tip_frame: (4, 4) transform from this frame to the tip, which T_n_tip places.
        outline: (K, 2) corners of the sole in the frame's xy plane [m]; None if it has none.
    """

    frame_id: str
    T_tip_frame: Array = field(default_factory=lambda: np.eye(4))
    outline: Array | None = None

    def __repr__(self) -> str:
        return f'<TipFrame {self.frame_id[:60]}>'


@dataclass(frozen=True, eq=False, repr=False)
class Chain(Frozen):
    """One version of one chain: T_root_frame = T_root_0 A_1 ... A_m T_n_tip T_tip_frame.

    Lengths are metres and angles radians everywhere. A joint vector q has one entry per joint, in
    the order of `joint_names`; it is never clamped to a range. A chain is a value: its arrays are
    read-only, it compares, hashes, pickles, and prints as its DH table.

    Attributes:
        name: name in the catalog, such as `left_leg`.
        version: version in the catalog, such as `v2_5`.
        root_frame: frame id of the root.
        tip: what is at its end, such as `left_foot`; names the topics.
        joint_names: n joint names, root to tip.
        links: m standard rows of the DH table, root to tip; the rows of a table in the modified
            convention are re-indexed (see `rows`).
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        tip_frames: the frames at the tip by name, such as `dh` and `sole`.
        frame: the one of them in which poses are given; the first if empty.
        T_n_tip: (4, 4) transform from the tip to the last row's frame.
        convention: `standard`, or `modified` for a table in Craig's convention.
        root_axes: where x, y and z of the root point, such as backward, right, up; empty if it is
            not known.
        source: where the table comes from; empty if nothing is said.
    """

    name: str
    version: str
    root_frame: str
    tip: str
    joint_names: tuple[str, ...]
    links: tuple[DHLink, ...]
    T_root_0: Array
    tip_frames: Mapping[str, TipFrame] = field(default_factory=dict)
    frame: str = ''
    T_n_tip: Array = field(default_factory=lambda: np.eye(4))
    convention: str = 'standard'
    root_axes: tuple[str, ...] = ()
    source: str = ''

    def __post_init__(self) -> None:
        if self.convention not in CONVENTIONS:
            self._refuse(f'convention is {self.convention!r}; allowed: {", ".join(CONVENTIONS)}')
        if len(set(self.joint_names)) < len(self.joint_names):
            self._refuse(f'joints are {", ".join(self.joint_names)}; allowed: each joint once')
        _ = self._row_joints  # refuses rows that do not fit the joints
        for name in ('T_root_0', 'T_n_tip'):
            object.__setattr__(self, name, self._checked_transform(name))
        frames = dict(self.tip_frames) or {self.tip: TipFrame(self.tip)}
        object.__setattr__(self, 'tip_frames', frames)
        object.__setattr__(self, 'frame', self.frame or next(iter(frames)))
        if self.frame not in frames:
            raise UnknownNameError(f'tip frame of chain {self.name}', self.frame, frames)
        super().__post_init__()

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @property
    def frame_id(self) -> str:
        """Name in ROS of the tip's frame in which poses are given."""
        return self.tip_frames[self.frame].frame_id

    @cached_property
    def joints(self) -> tuple[DHLink, ...]:
        """The first row that each joint moves, in the order of `joint_names`."""
        first_rows = [self._row_joints.index(joint) for joint in range(self.n)]
        return tuple(self.links[row] for row in first_rows)

    @cached_property
    def lower(self) -> Array:
        """(n,) smallest joint positions [rad or m]: the robots' if known, else as printed."""
        return _read_only([link.limits[0] for link in self.joints])

    @cached_property
    def upper(self) -> Array:
        """(n,) largest joint positions [rad or m]: the robots' if known, else as printed."""
        return _read_only([link.limits[1] for link in self.joints])

    def rows(self) -> tuple[Row, ...]:
        """Return the table's rows with their joints, in the chain's own convention."""
        links, joints = self.links, self._row_joints
        if self.convention == 'modified':
            links = modified_rows(self.links)
            joints = joints[len(joints) - len(links):]
        rows = []
        for index, (link, joint) in enumerate(zip(links, joints, strict=True)):
            name = '' if link.is_fixed else self.joint_names[joint]
            rows.append(Row(link, name, joint, joint >= 0 and joint not in joints[:index]))
        return tuple(rows)

    def with_frame(self, frame: str) -> Chain:
        """Return the same chain with its poses in another frame of its tip.

        Raises:
            UnknownNameError: the tip has no such frame; lists those it has.
        """
        return self if frame == self.frame else replace(self, frame=frame)

    def forward(self, q: ArrayLike | Mapping[str, float]) -> Array:
        """Return the transform from the tip's frame to the root frame.

        The straight way: the product of the matrices as the tables define them.

        Args:
            q: (..., n) joint positions [rad or m], or a mapping from joint names.

        Returns:
            (..., 4, 4) transforms.

        Raises:
            JointVectorError: q is not (..., n), or an entry is no finite number.
        """
        return deque(self._transforms(self._array(q)), maxlen=1).pop()

    def frames(self, q: ArrayLike | Mapping[str, float]) -> Array:
        """Return every frame of the table in the root frame, in the chain's own convention.

        Args:
            q: (..., n) joint positions [rad or m], or a mapping from joint names.

        Returns:
            (..., m + 2, 4, 4): frame 0, a frame for each of the m rows, and the tip's.

        Raises:
            JointVectorError: q is not (..., n), or an entry is no finite number.
        """
        return np.stack([*self._transforms(self._array(q))], axis=-3)

    def _transforms(self, q: Array) -> Iterator[Array]:
        """Yield frame 0, the frame of each row, and the tip's, (..., 4, 4) each."""
        transform = _modified_transform if self.convention == 'modified' else DHLink.transform
        T = np.broadcast_to(self.T_root_0, (*q.shape[:-1], 4, 4))
        yield T
        for row in self.rows():
            position = 0.0 if row.link.is_fixed else q[..., row.joint_index]
            T = T @ transform(row.link, position)
            yield T
        yield T @ self._T_n_frame

    def sole_outline(self, q: ArrayLike | Mapping[str, float]) -> Array | None:
        """Return the (K, 3) corners of the sole in the root frame [m]; None if there is no sole.

        Args:
            q: (n,) joint positions [rad or m], or a mapping from joint names.
        """
        for name, tip_frame in self.tip_frames.items():
            if tip_frame.outline is not None:
                corners = np.pad(tip_frame.outline, ((0, 0), (0, 1)))
                T = self.with_frame(name).forward(q)
                return corners @ T[:3, :3].T + T[:3, 3]
        return None

    def pose(self, q: JointPositions) -> Pose:
        """Return x, y, z [m] and the unit quaternion qx, qy, qz, qw for one joint vector, fast.

        Of the two unit quaternions it is the one nearer to the tip frame's orientation at q = 0,
        so it is continuous in q within half a turn of that.

        Args:
            q: (n,) joint positions [rad or m], or a mapping from joint names; a list or tuple is
                fastest.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number, or a joint is
                missing.
        """
        try:
            pose = self._solver.pose(self._vector(q))
        except (ArithmeticError, TypeError, ValueError) as error:
            self._refuse_vector('q', q, error)
        if not math.isfinite(pose.x + pose.y + pose.z):
            self._refuse_vector('q', q)
        return pose

    def poses(self, Q: ArrayLike) -> Array:
        """Return the (N, 7) rows x, y, z [m], qx, qy, qz, qw of N joint vectors, as `pose` does.

        Memory beyond the result does not grow with N.

        Args:
            Q: (N, n) joint positions [rad or m].

        Raises:
            JointVectorError: Q is not (N, n), or an entry is no finite number.
        """
        poses = self._solver.poses(self._array(Q, 2))
        if not np.isfinite(poses).all():
            raise _too_large('q')
        return poses

    def jacobian(self, q: JointPositions) -> Array:
        """Return the geometric Jacobian of the tip, in the axes of the root frame.

        A row adds (z x (p_tip - p), z) if revolute and (z, 0) if prismatic to the column of its
        joint, with z and p of the frame before it (Siciliano et al., Robotics, 2009, eq. 3.30),
        times its gain. Pinocchio calls it LOCAL_WORLD_ALIGNED.

        Args:
            q: (n,) joint positions [rad or m], or a mapping from joint names.

        Returns:
            (6, n): three rows of linear [m/s], then three of angular velocity [rad/s], per unit
            of joint velocity.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        q = self._array(q, 1)
        J = np.zeros((6, self.n))
        tip = self.forward(q)[:3, 3]
        T = self.T_root_0
        for link, joint in zip(self.links, self._row_joints, strict=True):
            axis = link.gain * T[:3, 2]
            if link.is_prismatic:
                J[:3, joint] += axis
            elif not link.is_fixed:
                J[:3, joint] += np.cross(axis, tip - T[:3, 3])
                J[3:, joint] += axis
            T = T @ link.transform(0.0 if link.is_fixed else q[joint])
        return J

    def twist(self, q: JointPositions, qdot: JointPositions) -> Twist:
        """Return the tip's vx, vy, vz [m/s] and wx, wy, wz [rad/s] in the axes of the root frame.

        Args:
            q: (n,) joint positions [rad or m], or a mapping; a list or tuple is fastest.
            qdot: (n,) joint velocities [rad/s or m/s]; likewise.

        Raises:
            JointVectorError: q or qdot has not n entries, or one is no finite number.
        """
        try:
            twist = self._solver.twist(self._vector(q), self._vector(qdot))
        except (ArithmeticError, TypeError, ValueError) as error:
            self._array(q, 1, 'q')
            self._refuse_vector('qdot', qdot, error)
        if not math.isfinite(sum(twist)):
            self._array(q, 1, 'q')
            self._refuse_vector('qdot', qdot)
        return twist

    def out_of_range(self, q: JointPositions) -> tuple[str, ...]:
        """Return the names of the joints whose position is outside `lower` to `upper`.

        Args:
            q: (n,) joint positions [rad or m], or a mapping from joint names.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        positions = self._array(q, 1)
        outside = (positions < self.lower) | (positions > self.upper)
        return tuple(self.joint_names[joint] for joint in np.flatnonzero(outside))

    @cached_property
    def _T_n_frame(self) -> Array:
        return self.T_n_tip @ self.tip_frames[self.frame].T_tip_frame

    @cached_property
    def _row_joints(self) -> tuple[int, ...]:
        """The index of the joint that moves each row; -1 for a fixed one."""
        names = self.joint_names
        named = {link.joint for link in self.links}
        unnamed = deque(joint for joint, name in enumerate(names) if name not in named)
        row_joints = []
        for link in self.links:
            if link.is_fixed:
                row_joints.append(-1)
            elif link.joint:
                if link.joint not in names:
                    raise UnknownNameError(f'joint of chain {self.name}', link.joint, names)
                row_joints.append(names.index(link.joint))
            elif unnamed:
                row_joints.append(unnamed.popleft())
            else:
                self._refuse_joints()
        if unnamed or not names:
            self._refuse_joints()
        return tuple(row_joints)

    @cached_property
    def _solver(self) -> Solver:
        R_zero = self.forward(np.zeros(self.n))[:3, :3]
        return Solver(self.links, self._row_joints, self.T_root_0, self._T_n_frame, R_zero)

    def _vector(self, q: JointPositions) -> Sequence[float]:
        """Return n joint positions as floats, not yet known to be finite."""
        if type(q) is list or type(q) is tuple:
            if len(q) == self.n:
                return array('d', q)
        return self._array(q, 1).tolist()  # type: ignore[no-any-return]

    def _array(self, q: ArrayLike | Mapping[str, float], ndim: int | None = None,
               name: str = 'q') -> Array:
        """Return q in float64, if it is (..., n) finite real numbers of ndim dimensions."""
        if isinstance(q, Mapping):
            q = self._ordered(q, name)
        shape = {1: f'({self.n},)', 2: f'(N, {self.n})', None: f'(..., {self.n})'}[ndim]
        allowed = f'{shape} finite real numbers, one per joint'
        try:
            values = np.asarray(q)
        except (OverflowError, TypeError, ValueError) as error:
            raise JointVectorError(name, f'is not an array of numbers ({error})',
                                   allowed) from error
        is_masked = type(q).__module__.startswith('numpy.ma')  # whose import takes a start 7 ms
        is_number = values.dtype.kind in 'biuf' or not values.size
        if isinstance(q, (str, bytes)) or is_masked or not is_number:
            found = type(q).__name__ + (f' of {values.dtype.name}' if values.ndim else '')
            raise JointVectorError(name, f'is a {found}', allowed)
        has_shape = values.ndim == ndim if ndim else values.ndim >= 1
        if not has_shape or values.shape[-1] != self.n:
            raise JointVectorError(name, f'has the shape {values.shape}', allowed)
        values = values.astype(float, copy=False)
        _refuse_not_finite(name, values)
        return values

    def _ordered(self, q: Mapping[str, float], name: str) -> list[float]:
        """Return the joint positions of a mapping in the order of the joints."""
        missing = [joint for joint in self.joint_names if joint not in q]
        if missing:
            raise JointVectorError(name, f'lacks {", ".join(missing)}',
                                   f'a mapping with all of {", ".join(self.joint_names)}')
        return [q[joint] for joint in self.joint_names]

    def _refuse_vector(self, name: str, q: JointPositions,
                       error: Exception | None = None) -> NoReturn:
        """Raise the error that says what is wrong with a vector that gave no finite result."""
        self._array(q, 1, name)
        raise _too_large(name) from error

    def _checked_transform(self, name: str) -> Array:
        T = np.array(getattr(self, name), dtype=float)
        if T.shape != (4, 4) or not is_rigid_transform(T):
            found = ' '.join(str(T.tolist()).split())
            self._refuse(f'{name} is {reprlib.repr(found)}; allowed: a (4, 4) rotation and '
                         'translation with the last row 0 0 0 1')
        T[:3, :3] = nearest_rotation(T[:3, :3])
        return T

    def _refuse_joints(self) -> NoReturn:
        moving = sum(not link.is_fixed for link in self.links)
        self._refuse(f'{len(self.joint_names)} joint names for {moving} rows with a joint; '
                     'allowed: at least one joint, and at least one row for each')

    def _refuse(self, fault: str) -> NoReturn:
        raise LegFKError(f'chain {self.name}: {fault}')

    def __repr__(self) -> str:
        joints = 'joint' if self.n == 1 else 'joints'
        return (f'<Chain {self.name[:30]} {self.version[:20]}: {self.n} {joints}, '
                f'{self.root_frame[:30]} to {self.frame_id[:30]}>')

    def __str__(self) -> str:
        return chain_text.as_text(self)

    def _repr_html_(self) -> str:
        return chain_text.as_html(self)


def modified_rows(links: Sequence[DHLink]) -> tuple[DHLink, ...]:
    """Return standard rows in the modified convention (Craig, Introduction to Robotics, 1986).

    There A_i = Rx(alpha) Tx(a) Rz(theta) Tz(d), with a and alpha before the joint instead of
    after it, so each row takes them from the standard row before.
    """
    a = alpha = 0.0
    first = links[0]
    if first.is_fixed and first.d == first.offset == 0.0:  # as `standard_rows` made it
        a, alpha, links = first.a, first.alpha, links[1:]
    rows = []
    for link in links:
        rows.append(replace(link, a=a, alpha=alpha))
        a, alpha = link.a, link.alpha
    return tuple(rows)


def standard_rows(rows: Sequence[DHLink]) -> tuple[DHLink, ...]:
    """Return rows of the modified convention as standard ones; inverse of `modified_rows`."""
    next_ones = [(row.a, row.alpha) for row in rows[1:]]
    next_ones.append((0.0, 0.0))
    links = [replace(row, a=a, alpha=alpha)
             for row, (a, alpha) in zip(rows, next_ones, strict=True)]
    if rows and (rows[0].a or rows[0].alpha):
        links.insert(0, DHLink(a=rows[0].a, d=0.0, alpha=rows[0].alpha, joint_type='fixed'))
    return tuple(links)


def _modified_transform(row: DHLink, q: ArrayLike) -> Array:
    """Return Rx(alpha) Tx(a) Rz(theta) Tz(d) of a row in the modified convention."""
    before = DHLink(a=row.a, d=0.0, alpha=row.alpha).transform()
    return before @ replace(row, a=0.0, alpha=0.0).transform(q)


def _refuse_not_finite(name: str, values: Array) -> None:
    with np.errstate(all='ignore'):
        is_finite = math.isfinite(values.sum())  # a mask as large as the values only if needed
    if is_finite or np.isfinite(values).all():
        return
    index = tuple(np.argwhere(~np.isfinite(values))[0].tolist())
    place = ', '.join(map(str, index))
    raise JointVectorError(f'{name}[{place}]', f'is {values[index]}', 'finite numbers')


def _too_large(name: str) -> JointVectorError:
    return JointVectorError(name, 'has values too large to compute with', 'finite numbers')


def _read_only(values: Sequence[float]) -> Array:
    result = np.array(values, dtype=float)
    result.flags.writeable = False
    return result
