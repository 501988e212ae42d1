"""One row of a Denavit-Hartenberg table, and tables in Craig's modified convention."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
import math

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics.rotation import Array, cos_sin
import numpy as np
from numpy.typing import ArrayLike

JOINT_TYPES = ('revolute', 'prismatic', 'fixed')
CONVENTIONS = ('standard', 'modified')


@dataclass(frozen=True, repr=False)
class DHLink:
    """A row of a DH table: A_i = Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i).

    A revolute row turns by theta_i = offset + gain q; a prismatic one slides by d_i = d + gain q
    and keeps theta_i = offset; a fixed row does not move.

    Attributes:
        a: link length [m].
        d: link offset [m].
        alpha: link twist [rad].
        offset: joint angle at q = 0 [rad].
        joint_type: `revolute`, `prismatic` or `fixed`.
        gain: how far the row moves per unit of its joint, such as -1 for one that counts backward;
            in m/rad for a slide that follows a turn, rad/m the other way round.
        joint: name of the joint that moves the row; empty for the next joint that no row names.
        lower: smallest joint position as printed [rad or m]; -inf if none is.
        upper: largest joint position as printed [rad or m]; inf if none is.
        robot_range: smallest and largest joint position of real robots [rad or m], where they are
            known to differ from what is printed; else None.
        erratum: what is known to be wrong with the printed row, and its source; empty if nothing.
    """

    a: float
    d: float
    alpha: float
    offset: float = 0.0
    joint_type: str = 'revolute'
    gain: float = 1.0
    joint: str = ''
    lower: float = -math.inf
    upper: float = math.inf
    robot_range: tuple[float, float] | None = None
    erratum: str = ''

    def __post_init__(self) -> None:
        if self.joint_type not in JOINT_TYPES:
            raise LegFKError(
                f'joint_type is {self.joint_type!r}; allowed: {", ".join(JOINT_TYPES)}'
            )
        for name in ('a', 'd', 'alpha', 'offset', 'gain'):
            value = float(
                getattr(self, name)
            )  # numpy's own scalars are slow in arithmetic
            if not math.isfinite(value):
                raise LegFKError(f'{name} is {value}; allowed: a finite number')
            object.__setattr__(self, name, value)
        if self.gain == 0.0:
            raise LegFKError('gain is 0; allowed: a number that moves the row')
        if self.is_fixed and self.joint:
            raise LegFKError(f'joint of a fixed row is {self.joint!r}; allowed: none')
        for lower, upper in ((self.lower, self.upper), self.limits):
            if not lower <= upper:
                raise LegFKError(
                    f'range is {lower} .. {upper}; allowed: lower <= upper'
                )

    @property
    def is_prismatic(self) -> bool:
        """Whether the row slides along z instead of turning about it."""
        return self.joint_type == 'prismatic'

    @property
    def is_fixed(self) -> bool:
        """Whether the row does not move."""
        return self.joint_type == 'fixed'

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest joint position [rad or m]: the robots' if known, else printed."""
        return self.robot_range or (self.lower, self.upper)

    @property
    def has_limits(self) -> bool:
        """Whether the joint position is bounded at all."""
        return self.limits != (-math.inf, math.inf)

    def transform(self, q: ArrayLike = 0.0) -> Array:
        """Return A_i, the (..., 4, 4) transform from this row's frame to the one before it.

        Args:
            q: (...) joint positions [rad or m]; without effect on a fixed row.
        """
        return self._along_z(q) @ self._along_x + 0.0  # no negative zeros

    def modified_transform(self, q: ArrayLike = 0.0) -> Array:
        """Return Rx(alpha) Tx(a) Rz(theta) Tz(d), the transform in the modified convention.

        Args:
            q: (...) joint positions [rad or m]; without effect on a fixed row.
        """
        return self._along_x @ self._along_z(q) + 0.0

    def _along_z(self, q: ArrayLike) -> Array:
        """Return Rz(theta) Tz(d), (..., 4, 4)."""
        moved = self.gain * np.asarray(q, dtype=float)
        T = np.zeros((*moved.shape, 4, 4))
        T[..., 2, 2] = T[..., 3, 3] = 1.0
        theta: ArrayLike = self.offset
        T[..., 2, 3] = self.d
        if self.is_prismatic:
            T[..., 2, 3] += moved
        elif not self.is_fixed:
            theta = self.offset + moved
        cosine, sine = cos_sin(theta)
        T[..., 0, 0] = T[..., 1, 1] = cosine
        T[..., 1, 0] = sine
        T[..., 0, 1] = -sine
        return T

    @cached_property
    def _along_x(self) -> Array:
        """The (4, 4) transform Tx(a) Rx(alpha)."""
        c, s = cos_sin(self.alpha)
        return np.array([[1, 0, 0, self.a], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])

    def __repr__(self) -> str:
        words = [
            f'{name}={getattr(self, name):.5g}'
            for name in ('a', 'd', 'alpha', 'offset')
        ]
        if self.joint_type != 'revolute':
            words.append(self.joint_type)
        if self.gain != 1.0:
            words.append(f'gain={self.gain:.5g}')
        if self.joint:
            words.append(f'joint={self.joint[:12]!r}')
        return f'DHLink({", ".join(words)})'


def standard_rows(rows: Sequence[DHLink]) -> tuple[DHLink, ...]:
    """Return rows of the modified convention (Craig, Introduction to Robotics, 1986) as standard.

    There A_i = Rx(alpha) Tx(a) Rz(theta) Tz(d), with a and alpha before the joint instead of
    after it. So each standard row takes them from the next one, and those of the first become a
    fixed row that has only them, if they are not 0.
    """
    links = []
    for row, following in zip(rows, [*rows[1:], None], strict=True):
        a, alpha = (following.a, following.alpha) if following else (0.0, 0.0)
        links.append(replace(row, a=a, alpha=alpha))
    first = rows[0]
    if first.a or first.alpha or _is_before_first(links[0]):
        links.insert(0, DHLink(a=first.a, d=0.0, alpha=first.alpha, joint_type='fixed'))
    return tuple(links)


def modified_rows(links: Sequence[DHLink]) -> tuple[DHLink, ...]:
    """Return rows that `standard_rows` made as they were in the modified convention."""
    a = alpha = 0.0
    if _is_before_first(links[0]):
        a, alpha = links[0].a, links[0].alpha
        links = links[1:]
    rows = []
    for link in links:
        rows.append(replace(link, a=a, alpha=alpha))
        a, alpha = link.a, link.alpha
    return tuple(rows)


def _is_before_first(link: DHLink) -> bool:
    """Return whether a first row has nothing but the a and alpha of a first modified row."""
    return link.is_fixed and link.d == link.offset == 0.0
