"""A serial chain of DH links: its forward kinematics, link frames and geometric Jacobian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
import math

from icub_leg_fk.errors import JointVectorError, LegFKError
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import (
    Array,
    is_rigid_transform,
    nearest_rotation,
    quaternion_to_matrix,
)
from icub_leg_fk.kinematics.solver import Pose, PoseSolver
from icub_leg_fk.kinematics.twist_solver import Twist, TwistSolver
import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Chain:
    """One version of one chain: T_root_tip = T_root_0 A_1(q_1) ... A_n(q_n) A_virtual T_n_tip.

    Lengths are metres and angles radians everywhere. A joint vector q has one entry per link, in
    the order of `joint_names`; it is never clamped to the documented ranges.

    Attributes:
        name: name in the catalog, such as `left_leg`.
        version: version in the catalog, such as `v2_5`.
        root_frame: frame id of the root.
        tip: what the tip is, such as `left_foot`; names the topics.
        tip_frame: frame id of the tip.
        joint_names: n joint names, root to tip.
        links: n links, root to tip.
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        virtual_link: a link after the last one whose joint stays at 0, or None.
        T_n_tip: (4, 4) transform from the tip to the last frame.
    """

    name: str
    version: str
    root_frame: str
    tip: str
    tip_frame: str
    joint_names: tuple[str, ...]
    links: tuple[DHLink, ...]
    T_root_0: Array
    virtual_link: DHLink | None = None
    T_n_tip: Array = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        if not self.links or len(self.joint_names) != len(self.links):
            msg = (f'chain {self.name}: found {len(self.joint_names)} joint names for '
                   f'{len(self.links)} links, allowed: one name per link, at least one link')
            raise LegFKError(msg)
        for joint in self.joint_names:
            if self.joint_names.count(joint) > 1:
                msg = f'chain {self.name}: found joint {joint!r} twice, allowed: each joint once'
                raise LegFKError(msg)
        for name in ('T_root_0', 'T_n_tip'):
            T = np.array(getattr(self, name), dtype=float)
            if T.shape != (4, 4) or not is_rigid_transform(T):
                msg = (f'chain {self.name}: {name}: found {" ".join(str(T.tolist()).split())}, '
                       'allowed: a (4, 4) rotation and translation with the last row 0 0 0 1')
                raise LegFKError(msg)
            T[:3, :3] = nearest_rotation(T[:3, :3])
            T.flags.writeable = False
            object.__setattr__(self, name, T)

    def forward(self, q: ArrayLike) -> Array:
        """Return the (4, 4) transform T_root_tip for one joint vector.

        The straight way: the product of the matrices as the tables define them.

        Args:
            q: (n,) joint positions [rad or m].

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        return np.asarray(self.frames(q)[-1])

    def frames(self, q: ArrayLike) -> Array:
        """Return every frame of the chain in the root frame, for one joint vector.

        Args:
            q: (n,) joint positions [rad or m].

        Returns:
            (n + 2, 4, 4): frame 0, frames 1 to n after each link, and the tip, which includes
            the virtual link.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        positions = self._joint_vectors(q, 1).tolist()
        frames = [self.T_root_0]
        for link, position in zip(self.links, positions, strict=True):
            frames.append(frames[-1] @ link.transform(position))
        frames.append(frames[-1] @ self._T_last_tip)
        return np.array(frames)

    def forward_many(self, Q: ArrayLike) -> Array:
        """Return the (N, 4, 4) transforms T_root_tip of N joint vectors.

        Args:
            Q: (N, n) joint positions [rad or m].

        Raises:
            JointVectorError: Q is not (N, n), or an entry is no finite number.
        """
        poses = self.poses(Q)
        T = np.zeros((len(poses), 4, 4))
        T[:, :3, :3] = quaternion_to_matrix(poses[:, 3:])
        T[:, :3, 3] = poses[:, :3]
        T[:, 3, 3] = 1.0
        return T

    def pose(self, q: Sequence[float]) -> Pose:
        """Return x, y, z [m] and the unit quaternion qx, qy, qz, qw, w >= 0, for one joint vector.

        Args:
            q: n joint positions [rad or m]; a list or tuple of floats is fastest.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        if type(q) is tuple or type(q) is list:
            return self.solver.pose(q)
        return self.solver.pose(self._joint_vectors(q, 1).tolist())

    def poses(self, Q: ArrayLike) -> Array:
        """Return the (N, 7) rows x, y, z [m], qx, qy, qz, qw of N joint vectors.

        Memory beyond the result does not grow with N.

        Args:
            Q: (N, n) joint positions [rad or m].

        Raises:
            JointVectorError: Q is not (N, n), or an entry is no finite number.
        """
        return self.solver.poses(self._joint_vectors(Q, 2))

    def poses_as_one_by_one(self, Q: ArrayLike) -> Array:
        """Return what `poses` does, each row bit-identical to `pose` of its joint vector."""
        return self.solver.poses(self._joint_vectors(Q, 2), libm=True)

    def jacobian(self, q: ArrayLike) -> Array:
        """Return the geometric Jacobian of the tip, in the root frame.

        Column i is (z x (p_tip - p), z) for a revolute and (z, 0) for a prismatic joint, with z
        and p of the frame before link i (Siciliano et al., Robotics, 2009, eq. 3.30).

        Args:
            q: (n,) joint positions [rad or m].

        Returns:
            (6, n): three rows of linear [m/s], then three of angular velocity [rad/s], per unit
            of joint velocity.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        frames = self.frames(q)
        axes = frames[:-2, :3, 2]
        arms = frames[-1, :3, 3] - frames[:-2, :3, 3]
        prismatic = np.array([link.is_prismatic for link in self.links])[:, None]
        linear = np.where(prismatic, axes, np.cross(axes, arms))
        angular = np.where(prismatic, 0.0, axes)
        return np.hstack((linear, angular)).T

    def twist(self, q: Sequence[float], qdot: Sequence[float]) -> Twist:
        """Return the tip's vx, vy, vz [m/s] and wx, wy, wz [rad/s] in the axes of the root frame.

        Args:
            q: n joint positions [rad or m]; a list or tuple of floats.
            qdot: n joint velocities [rad/s or m/s]; likewise.

        Raises:
            JointVectorError: q or qdot has not n entries, or one is no finite number.
        """
        return self.twist_solver.twist(q, qdot)

    def out_of_range(self, q: Sequence[float]) -> tuple[str, ...]:
        """Return the names of the joints whose position is outside its documented range.

        Args:
            q: n joint positions [rad or m].

        Raises:
            JointVectorError: q has not n entries.
        """
        if len(q) != len(self.links):
            msg = f'joint vector: found {len(q)} values, allowed: {len(self.links)}'
            raise JointVectorError(msg)
        return tuple(
            name for name, link, position in zip(self.joint_names, self.links, q, strict=True)
            if not link.lower <= position <= link.upper)

    @cached_property
    def _T_last_tip(self) -> Array:
        """(4, 4) transform from the tip to the last link with a joint."""
        if self.virtual_link is None:
            return self.T_n_tip
        return np.asarray(self.virtual_link.transform(0.0) @ self.T_n_tip)

    @cached_property
    def solver(self) -> PoseSolver:
        """What `pose` and `poses` ask; takes no other joint vectors than lists and tuples."""
        return PoseSolver(self.links, self.T_root_0, self._T_last_tip)

    @cached_property
    def twist_solver(self) -> TwistSolver:
        """What `twist` asks, and what computes many twists."""
        return TwistSolver(self.links, self.T_root_0, self._T_last_tip)

    def _joint_vectors(self, q: ArrayLike, ndim: int) -> Array:
        n = len(self.links)
        shape = f'({n},)' if ndim == 1 else f'(N, {n})'
        try:
            values = np.asarray(q, dtype=float)
        except (OverflowError, TypeError, ValueError) as error:
            msg = f'joint vector: found a {type(q).__name__}, allowed: {shape} numbers'
            raise JointVectorError(msg) from error
        if values.ndim != ndim or values.shape[-1] != n:
            msg = f'joint vector: found shape {values.shape}, allowed: {shape}'
            raise JointVectorError(msg)
        with np.errstate(all='ignore'):
            maybe_bad = not math.isfinite(values.sum())  # a mask as large as Q only if it may be
        if maybe_bad and not np.isfinite(values).all():
            index = tuple(np.argwhere(~np.isfinite(values))[0].tolist())
            msg = (f'joint vector: found q[{", ".join(map(str, index))}] = {values[index]}, '
                   'allowed: finite numbers')
            raise JointVectorError(msg)
        return values
