"""A serial chain of DH links: its forward kinematics, link frames and geometric Jacobian."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
import math
import reprlib

from icub_leg_fk.errors import JointVectorError, LegFKError
from icub_leg_fk.kinematics.frozen import Frozen
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array, is_rigid_transform, nearest_rotation
from icub_leg_fk.kinematics.solver import Pose, Solver, Twist
import numpy as np
from numpy.typing import ArrayLike

CONVENTIONS = ('standard', 'modified')


@dataclass(frozen=True, eq=False, repr=False)
class Chain(Frozen):
    """One version of one chain: T_root_tip = T_root_0 A_1 ... A_m T_n_tip.

    Lengths are metres and angles radians everywhere. A joint vector q has one entry per joint, in
    the order of `joint_names`; it is never clamped to a range. A chain is a value: its arrays are
    read-only, it compares, hashes, pickles, and prints as its DH table.

    Attributes:
        name: name in the catalog, such as `left_leg`.
        version: version in the catalog, such as `v2_5`.
        root_frame: frame id of the root.
        tip: what the tip is, such as `left_foot`; names the topics.
        tip_frame: frame id of the tip.
        joint_names: n joint names, root to tip.
        links: m rows of the DH table, root to tip, of which m - n are fixed.
        T_root_0: (4, 4) transform from frame 0 to the root frame.
        T_n_tip: (4, 4) transform from the tip to the last row's frame.
        convention: `standard`, or `modified` if the table was written in Craig's convention; the
            links are standard rows in either case (see `modified_rows`).
    """

    name: str
    version: str
    root_frame: str
    tip: str
    tip_frame: str
    joint_names: tuple[str, ...]
    links: tuple[DHLink, ...]
    T_root_0: Array
    T_n_tip: Array = field(default_factory=lambda: np.eye(4))
    convention: str = 'standard'

    def __post_init__(self) -> None:
        if self.convention not in CONVENTIONS:
            raise LegFKError(f'chain {self.name}: convention is {self.convention!r}; '
                             f'allowed: {", ".join(CONVENTIONS)}')
        if not self.joints or len(self.joint_names) != len(self.joints):
            raise LegFKError(f'chain {self.name}: {len(self.joint_names)} joint names for '
                             f'{len(self.joints)} rows with a joint; allowed: one name each, and '
                             'at least one joint')
        for joint in self.joint_names:
            if self.joint_names.count(joint) > 1:
                raise LegFKError(f'chain {self.name}: joint {joint!r} appears twice; allowed: '
                                 'each joint once')
        for name in ('T_root_0', 'T_n_tip'):
            T = np.array(getattr(self, name), dtype=float)
            if T.shape != (4, 4) or not is_rigid_transform(T):
                found = ' '.join(str(T.tolist()).split())
                raise LegFKError(f'chain {self.name}: {name} is {found}; allowed: a (4, 4) '
                                 'rotation and translation with the last row 0 0 0 1')
            T[:3, :3] = nearest_rotation(T[:3, :3])
            object.__setattr__(self, name, T)
        super().__post_init__()

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @cached_property
    def joints(self) -> tuple[DHLink, ...]:
        """The n rows that have a joint, in the order of `joint_names`."""
        return tuple(link for link in self.links if not link.is_fixed)

    @cached_property
    def lower(self) -> Array:
        """(n,) smallest joint positions [rad or m]: the robots' if known, else as printed."""
        return _read_only([link.limits[0] for link in self.joints])

    @cached_property
    def upper(self) -> Array:
        """(n,) largest joint positions [rad or m]: the robots' if known, else as printed."""
        return _read_only([link.limits[1] for link in self.joints])

    def forward(self, q: ArrayLike) -> Array:
        """Return the transform T_root_tip.

        The straight way: the product of the matrices as the tables define them.

        Args:
            q: (..., n) joint positions [rad or m].

        Returns:
            (..., 4, 4) transforms.

        Raises:
            JointVectorError: q is not (..., n), or an entry is no finite number.
        """
        return deque(self._frames(self._numbers(q)), maxlen=1).pop()

    def frames(self, q: ArrayLike) -> Array:
        """Return every frame of the chain in the root frame.

        Args:
            q: (..., n) joint positions [rad or m].

        Returns:
            (..., m + 2, 4, 4): frame 0, frames 1 to m after each row, and the tip.

        Raises:
            JointVectorError: q is not (..., n), or an entry is no finite number.
        """
        return np.stack([*self._frames(self._numbers(q))], axis=-3)

    def _frames(self, q: Array) -> Iterator[Array]:
        """Yield frame 0, the frame after each row, and the tip, (..., 4, 4) each."""
        T = np.broadcast_to(self.T_root_0, (*q.shape[:-1], 4, 4))
        yield T
        joint = 0
        for link in self.links:
            T = T @ link.transform(0.0 if link.is_fixed else q[..., joint])
            joint += not link.is_fixed
            yield T
        yield T @ self.T_n_tip

    def pose(self, q: Sequence[float]) -> Pose:
        """Return x, y, z [m] and the unit quaternion qx, qy, qz, qw for one joint vector, fast.

        Of the two unit quaternions it is the one nearer to the tip frame's orientation at q = 0,
        so it is continuous in q within half a turn of that.

        Args:
            q: (n,) joint positions [rad or m]; a list or tuple of floats is fastest.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        pose = self._solver.pose(q) if type(q) is tuple or type(q) is list else None
        if pose is None:
            pose = self._solver.pose(self._numbers(q, 1).tolist())
            assert pose is not None
        return pose

    def poses(self, Q: ArrayLike) -> Array:
        """Return the (N, 7) rows x, y, z [m], qx, qy, qz, qw of N joint vectors, as `pose` does.

        Memory beyond the result does not grow with N.

        Args:
            Q: (N, n) joint positions [rad or m].

        Raises:
            JointVectorError: Q is not (N, n), or an entry is no finite number.
        """
        return self._solver.poses(self._numbers(Q, 2))

    def jacobian(self, q: ArrayLike) -> Array:
        """Return the geometric Jacobian of the tip, in the axes of the root frame.

        Column i is (z x (p_tip - p), z) for a revolute and (z, 0) for a prismatic joint, with z
        and p of the frame before its link (Siciliano et al., Robotics, 2009, eq. 3.30), negated
        where the joint counts backward. Pinocchio calls it LOCAL_WORLD_ALIGNED.

        Args:
            q: (n,) joint positions [rad or m].

        Returns:
            (6, n): three rows of linear [m/s], then three of angular velocity [rad/s], per unit
            of joint velocity.

        Raises:
            JointVectorError: q has not n entries, or one is no finite number.
        """
        *frames, tip = self._frames(self._numbers(q, 1))
        columns = []
        for link, T in zip(self.links, frames):
            axis = T[:3, 2] * link.sign
            if link.is_prismatic:
                columns.append(np.hstack((axis, np.zeros(3))))
            elif not link.is_fixed:
                columns.append(np.hstack((np.cross(axis, tip[:3, 3] - T[:3, 3]), axis)))
        return np.array(columns).T

    def twist(self, q: Sequence[float], qdot: Sequence[float]) -> Twist:
        """Return the tip's vx, vy, vz [m/s] and wx, wy, wz [rad/s] in the axes of the root frame.

        Args:
            q: (n,) joint positions [rad or m]; a list or tuple of floats is fastest.
            qdot: (n,) joint velocities [rad/s or m/s]; likewise.

        Raises:
            JointVectorError: q or qdot has not n entries, or one is no finite number.
        """
        fast = type(q) in (tuple, list) and type(qdot) in (tuple, list)
        twist = self._solver.twist(q, qdot) if fast else None
        if twist is None:
            twist = self._solver.twist(self._numbers(q, 1).tolist(),
                                       self._numbers(qdot, 1, 'joint velocities').tolist())
            assert twist is not None
        return twist

    def out_of_range(self, q: Sequence[float]) -> tuple[str, ...]:
        """Return the names of the joints whose position is outside `lower` to `upper`.

        Args:
            q: (n,) joint positions [rad or m].

        Raises:
            JointVectorError: q is not n numbers.
        """
        try:
            return tuple([name for name, (lower, upper), position in zip(
                self.joint_names, self._limits, q, strict=True)
                if not lower <= position <= upper])
        except (TypeError, ValueError) as error:
            raise JointVectorError(f'joint vector is {reprlib.repr(q)}; {self.n} numbers are '
                                   'allowed, one per joint') from error

    @cached_property
    def _limits(self) -> list[tuple[float, float]]:
        return [link.limits for link in self.joints]

    @cached_property
    def _solver(self) -> Solver:
        return Solver(self.links, self.T_root_0, self.T_n_tip,
                      self.forward(np.zeros(self.n))[:3, :3])

    def _numbers(self, q: ArrayLike, ndim: int | None = None,
                 what: str = 'joint vector') -> Array:
        """Return q in float64, if it is (..., n) finite real numbers of ndim dimensions."""
        shape = {1: f'({self.n},)', 2: f'(N, {self.n})', None: f'(..., {self.n})'}[ndim]
        try:
            values = np.asarray(q)
        except (OverflowError, TypeError, ValueError) as error:
            raise JointVectorError(f'{what} is not an array of numbers ({error}); {shape} finite '
                                   'numbers are allowed') from error
        masked = type(q).__module__.startswith('numpy.ma')  # whose import would cost a start 7 ms
        if isinstance(q, (str, bytes)) or masked or (
                values.dtype.kind not in 'biuf' and values.size):
            found = type(q).__name__ + (f' of {values.dtype.name}' if values.ndim else '')
            raise JointVectorError(f'{what} is a {found}; {shape} finite real numbers are allowed')
        if (values.ndim != ndim if ndim else values.ndim < 1) or values.shape[-1] != self.n:
            raise JointVectorError(f'{what} has the shape {values.shape}; {shape} is allowed')
        values = values.astype(float, copy=False)
        with np.errstate(all='ignore'):
            maybe_bad = not math.isfinite(values.sum())  # a mask as large as q only if it may be
        if maybe_bad and not np.isfinite(values).all():
            index = tuple(np.argwhere(~np.isfinite(values))[0].tolist())
            raise JointVectorError(f'{what}: q[{", ".join(map(str, index))}] is {values[index]}; '
                                   'finite numbers are allowed')
        return values

    def __repr__(self) -> str:
        joints = 'joint' if self.n == 1 else 'joints'
        return (f'<Chain {self.name} {self.version}: {self.n} {joints}, '
                f'{self.root_frame} to {self.tip_frame}>')

    def __str__(self) -> str:
        modified = self.convention == 'modified'
        rows = [('i', 'joint', 'a', 'd', 'alpha', 'theta', 'range')]
        names = iter(self.joint_names)
        for i, link in enumerate(modified_rows(self) if modified else self.links):
            name = '(fixed)' if link.is_fixed else next(names)
            d, theta = _number(1000 * link.d), _number(math.degrees(link.offset))
            moved = '' if link.is_fixed else f' {"+" if link.sign == 1 else "-"} q'
            d, theta = (d + moved, theta) if link.is_prismatic else (d, theta + moved)
            scale = 1000 if link.is_prismatic else 180 / math.pi
            lower, upper = link.limits
            bounds = '' if link.is_fixed or (lower, upper) == (-math.inf, math.inf) else (
                f'{_number(scale * lower)} .. {_number(scale * upper)}')
            rows.append((str(i), name, _number(1000 * link.a), d,
                         _number(math.degrees(link.alpha)), theta, bounds))
        widths = [max(map(len, column)) for column in zip(*rows)]
        heading = (f'{self.name} {self.version}: {self.root_frame} to {self.tip_frame}, '
                   f'{"modified" if modified else "standard"} Denavit-Hartenberg table in mm, deg')
        lines = ['  '.join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip()
                 for row in rows]
        return '\n'.join([heading, *lines])


def modified_rows(chain: Chain) -> tuple[DHLink, ...]:
    """Return a chain's rows in the modified convention (Craig, Introduction to Robotics, 1986).

    There A_i = Rx(alpha) Tx(a) Rz(theta) Tz(d), with a and alpha before the joint instead of
    behind it, so each row takes them from the standard row before.
    """
    a = alpha = 0.0
    links = chain.links
    if links[0].is_fixed and links[0].d == links[0].offset == 0.0:  # as `standard_rows` made it
        a, alpha, links = links[0].a, links[0].alpha, links[1:]
    rows = []
    for link in links:
        rows.append(replace(link, a=a, alpha=alpha))
        a, alpha = link.a, link.alpha
    return tuple(rows)


def standard_rows(rows: Sequence[DHLink]) -> tuple[DHLink, ...]:
    """Return rows of the modified convention as standard ones; inverse of `modified_rows`."""
    behind = [(row.a, row.alpha) for row in rows[1:]] + [(0.0, 0.0)]
    links = [replace(row, a=a, alpha=alpha)
             for row, (a, alpha) in zip(rows, behind, strict=True)]
    if rows and (rows[0].a or rows[0].alpha):
        links.insert(0, DHLink(a=rows[0].a, d=0.0, alpha=rows[0].alpha, joint_type='fixed'))
    return tuple(links)


def _read_only(values: Sequence[float]) -> Array:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


def _number(value: float) -> str:
    return f'{round(value, 6) + 0.0:.10g}'
