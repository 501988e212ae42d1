"""A serial chain of DH links: its forward kinematics, link frames and geometric Jacobian."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
import math
from typing import NamedTuple, NoReturn

from icub_leg_fk.errors import LegFKError, UnknownNameError
from icub_leg_fk.kinematics import chain_text
from icub_leg_fk.kinematics.frozen import Frozen
from icub_leg_fk.kinematics.joint_vector import (
    joint_array,
    joint_floats,
    JointVector,
    too_large,
)
from icub_leg_fk.kinematics.link import CONVENTIONS, DHLink, modified_rows
from icub_leg_fk.kinematics.rotation import Array, rigid_transform
from icub_leg_fk.kinematics.solver import Pose, Solver, Twist
import numpy as np
from numpy.typing import ArrayLike


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

    def __repr__(self) -> str:
        return f'<Row {self.joint[:12] or "fixed"}: {replace(self.link, joint="")!r}>'


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

    def __post_init__(self) -> None:
        T = rigid_transform(self.T_tip_frame, f'transform of tip frame {self.frame_id}')
        object.__setattr__(self, 'T_tip_frame', T)
        super().__post_init__()

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
        source: where the table comes from; empty if not given.
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
            self._refuse(
                f'convention is {self.convention!r}; allowed: {", ".join(CONVENTIONS)}'
            )
        if len(set(self.joint_names)) < len(self.joint_names):
            self._refuse(
                f'joints are {", ".join(self.joint_names)}; allowed: each joint once'
            )
        _ = self._row_joints  # refuses rows that do not fit the joints
        last = self.links[-1]
        if self.convention == 'modified' and (last.a or last.alpha):
            self._refuse(
                f'a and alpha after the last joint are {last.a:g} and {last.alpha:g}; '
                'allowed in the modified convention: 0, with T_n_tip instead'
            )
        for name in ('T_root_0', 'T_n_tip'):
            transform = rigid_transform(
                getattr(self, name), f'{name} of chain {self.name}'
            )
            object.__setattr__(self, name, transform)
        frames = dict(self.tip_frames) or {self.tip: TipFrame(self.tip)}
        object.__setattr__(self, 'tip_frames', frames)
        object.__setattr__(self, 'frame', self.frame or next(iter(frames)))
        if self.frame not in frames:
            raise UnknownNameError(
                'tip frame', self.frame, frames, of=f'chain {self.name}'
            )
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
        """(n,) smallest joint positions [rad or m]; the robots' if known, else as printed."""
        return _read_only([link.limits[0] for link in self.joints])

    @cached_property
    def upper(self) -> Array:
        """(n,) largest joint positions [rad or m]; the robots' if known, else as printed."""
        return _read_only([link.limits[1] for link in self.joints])

    def rows(self) -> tuple[Row, ...]:
        """Return the table's rows with their joints, in the chain's own convention."""
        return self._rows

    def with_frame(self, frame: str) -> Chain:
        """Return the same chain with its poses in another frame of its tip.

        Raises:
            UnknownNameError: the tip has no such frame; lists those it has.
        """
        return self if frame == self.frame else replace(self, frame=frame)

    def forward(self, q: ArrayLike | Mapping[str, ArrayLike]) -> Array:
        """Return the transform from the tip's frame to the root frame.

        The straight way: the product of the matrices as the table defines them.

        Args:
            q: (..., n) joint positions [rad or m], or a mapping from joint names.

        Returns:
            (..., 4, 4) transforms.

        Raises:
            JointVectorError: q is not (..., n), an entry is not finite, or a joint is
                missing.
        """
        positions = joint_array(q, self.joint_names)
        with np.errstate(all='ignore'):
            T = self._T_root_0_for(positions)
            for link, joint in self._moved_links:
                T = T @ link.transform(positions[..., joint])
            return _finite(T @ self._T_n_frame)

    def frames(self, q: ArrayLike | Mapping[str, ArrayLike]) -> Array:
        """Return every frame of the table in the root frame, in the chain's own convention.

        Args:
            q: (..., n) joint positions [rad or m], or a mapping from joint names.

        Returns:
            (..., m + 2, 4, 4): frame 0, a frame for each of the m rows, and the tip's.

        Raises:
            JointVectorError: q is not (..., n), an entry is not finite, or a joint is
                missing.
        """
        positions = joint_array(q, self.joint_names)
        is_modified = self.convention == 'modified'
        with np.errstate(all='ignore'):
            frames = [self._T_root_0_for(positions)]
            for link, _, joint, _ in self._rows:
                transform = link.modified_transform if is_modified else link.transform
                frames.append(frames[-1] @ transform(positions[..., joint]))
            frames.append(frames[-1] @ self._T_n_frame)
            return _finite(np.stack(frames, axis=-3))

    def sole_outline(self, q: ArrayLike | Mapping[str, ArrayLike]) -> Array | None:
        """Return the corners of the sole in the root frame; None if the tip has no sole.

        Args:
            q: (n,) joint positions [rad or m], or a mapping from joint names.

        Returns:
            (K, 3) corners [m].
        """
        if self._outline is None:
            return None
        T = self.forward(q)
        return self._outline @ T[:3, :3].T + T[:3, 3]

    def pose(self, q: JointVector) -> Pose:
        """Return x, y, z [m] and the unit quaternion qx, qy, qz, qw for one joint vector, fast.

        Of the two unit quaternions it is the one nearer to the tip frame's orientation at q = 0,
        so it is continuous in q within half a turn of that.

        Args:
            q: (n,) joint positions [rad or m], or a mapping from joint names; a list or tuple is
                fastest.

        Raises:
            JointVectorError: q has not n entries, or one is not finite, or a joint is
                missing.
        """
        try:
            pose = self._solver.pose(joint_floats(q, self.joint_names))
        except (ArithmeticError, TypeError, ValueError) as error:
            self._refuse_vector(q, 'q', error)
        if not math.isfinite(pose.x + pose.y + pose.z):
            self._refuse_vector(q, 'q')
        return pose

    def poses(self, Q: ArrayLike | Mapping[str, ArrayLike]) -> Array:
        """Return the poses of many joint vectors, each as `pose` does.

        Memory beyond the result does not grow with N.

        Args:
            Q: (N, n) joint positions [rad or m], or a mapping from joint names to (N,) ones.

        Returns:
            (N, 7) rows x, y, z [m], qx, qy, qz, qw.

        Raises:
            JointVectorError: Q is not (N, n), an entry is not finite, or a joint is
                missing.
        """
        return _finite(self._solver.poses(joint_array(Q, self.joint_names, 2)))

    def jacobian(self, q: JointVector) -> Array:
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
            JointVectorError: q has not n entries, or one is not finite, or a joint is
                missing.
        """
        positions = joint_array(q, self.joint_names, 1)
        J = np.zeros((6, self.n))
        with np.errstate(all='ignore'):
            before = [self.T_root_0]
            for link, joint in self._moved_links:
                before.append(before[-1] @ link.transform(positions[joint]))
            tip = (before[-1] @ self._T_n_frame)[:3, 3]
            for (link, joint), T in zip(self._moved_links, before[:-1], strict=True):
                axis = link.gain * T[:3, 2]
                if link.is_prismatic:
                    J[:3, joint] += axis
                elif not link.is_fixed:
                    J[:3, joint] += np.cross(axis, tip - T[:3, 3])
                    J[3:, joint] += axis
        return _finite(J)

    def twist(self, q: JointVector, qdot: JointVector) -> Twist:
        """Return the tip's vx, vy, vz [m/s] and wx, wy, wz [rad/s] in the axes of the root frame.

        Args:
            q: (n,) joint positions [rad or m], or a mapping; a list or tuple is fastest.
            qdot: (n,) joint velocities [rad/s or m/s]; likewise.

        Raises:
            JointVectorError: q or qdot has not n entries, or one is not finite, or a joint
                is missing.
        """
        try:
            positions = joint_floats(q, self.joint_names)
            twist = self._solver.twist(
                positions, joint_floats(qdot, self.joint_names, 'qdot')
            )
        except (ArithmeticError, TypeError, ValueError) as error:
            joint_array(q, self.joint_names, 1)
            self._refuse_vector(qdot, 'qdot', error)
        if not math.isfinite(sum(twist)):
            joint_array(q, self.joint_names, 1)
            self._refuse_vector(qdot, 'qdot')
        return twist

    def out_of_range(self, q: JointVector) -> tuple[str, ...]:
        """Return the names of the joints whose position is outside `lower` to `upper`.

        Args:
            q: (n,) joint positions [rad or m], or a mapping from joint names.

        Raises:
            JointVectorError: q has not n entries, or one is not finite, or a joint is
                missing.
        """
        positions = joint_array(q, self.joint_names, 1)
        outside = (positions < self.lower) | (positions > self.upper)
        return tuple(self.joint_names[joint] for joint in np.flatnonzero(outside))

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
                    raise UnknownNameError(
                        'joint', link.joint, names, of=f'chain {self.name}'
                    )
                row_joints.append(names.index(link.joint))
            elif unnamed:
                row_joints.append(unnamed.popleft())
            else:
                self._refuse_joints()
        if unnamed or not names:
            self._refuse_joints()
        return tuple(row_joints)

    @cached_property
    def _moved_links(self) -> tuple[tuple[DHLink, int], ...]:
        """The standard rows, each with the index of the joint that moves it."""
        return tuple(zip(self.links, self._row_joints, strict=True))

    @cached_property
    def _rows(self) -> tuple[Row, ...]:
        links, joints = self.links, self._row_joints
        if self.convention == 'modified':
            links = modified_rows(self.links)
            first = len(joints) - len(links)
            joints = joints[first:]
        rows = []
        for index, (link, joint) in enumerate(zip(links, joints, strict=True)):
            name = '' if link.is_fixed else self.joint_names[joint]
            is_first = not link.is_fixed and joint not in joints[:index]
            rows.append(Row(link, name, joint, is_first))
        return tuple(rows)

    @cached_property
    def _T_n_frame(self) -> Array:
        return self.T_n_tip @ self.tip_frames[self.frame].T_tip_frame

    @cached_property
    def _outline(self) -> Array | None:
        """The (K, 3) corners of the sole in the tip's frame [m]."""
        for tip_frame in self.tip_frames.values():
            if tip_frame.outline is not None:
                corners = np.pad(tip_frame.outline, ((0, 0), (0, 1)))
                T_tip_frame = self.tip_frames[self.frame].T_tip_frame
                T = np.linalg.inv(T_tip_frame) @ tip_frame.T_tip_frame
                return np.asarray(corners @ T[:3, :3].T + T[:3, 3])
        return None

    @cached_property
    def _solver(self) -> Solver:
        R_zero = self.forward(np.zeros(self.n))[:3, :3]
        return Solver(
            self.links, self._row_joints, self.T_root_0, self._T_n_frame, R_zero
        )

    def _T_root_0_for(self, positions: Array) -> Array:
        return np.broadcast_to(self.T_root_0, (*positions.shape[:-1], 4, 4))

    def _refuse_vector(
        self, q: JointVector, name: str, error: Exception | None = None
    ) -> NoReturn:
        """Raise the error that says what is wrong with a vector that gave no finite result."""
        joint_array(q, self.joint_names, 1, name)
        raise too_large(name) from error

    def _refuse_joints(self) -> NoReturn:
        moving = sum(not link.is_fixed for link in self.links)
        self._refuse(
            f'{len(self.joint_names)} joint names for {moving} rows with a joint; '
            'allowed: at least one joint, and at least one row for each'
        )

    def _refuse(self, fault: str) -> NoReturn:
        raise LegFKError(f'chain {self.name}: {fault}')

    def __repr__(self) -> str:
        joints = 'joint' if self.n == 1 else 'joints'
        return (
            f'<Chain {self.name[:20]} {self.version[:10]}: {self.n} {joints}, '
            f'{self.root_frame[:20]} to {self.frame_id[:20]}>'
        )

    def __str__(self) -> str:
        return chain_text.as_text(self)

    def _repr_html_(self) -> str:
        return chain_text.as_html(self)


def solver_of(chain: Chain) -> Solver:
    """Return what computes for joint vectors that are known to be n finite floats, unchecked."""
    return chain._solver


def _finite(values: Array) -> Array:
    if not np.isfinite(values).all():
        raise too_large('q')
    return values


def _read_only(values: Sequence[float]) -> Array:
    result = np.array(values, dtype=float)
    result.flags.writeable = False
    return result
