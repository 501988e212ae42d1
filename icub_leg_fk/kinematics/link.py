"""One link of a chain in the standard (distal) Denavit-Hartenberg convention."""

from dataclasses import dataclass
import math

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics.rotation import Array, cos_sin
import numpy as np
from numpy.typing import ArrayLike

JOINT_TYPES = ('revolute', 'prismatic', 'fixed')


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
        gain: how far the row moves per unit of its joint; -1 for one that counts backward, in m/rad
            or rad/m for a slide that follows a turn or the other way round.
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
            raise LegFKError(f'joint_type is {self.joint_type!r}; allowed: '
                             f'{", ".join(JOINT_TYPES)}')
        for name in ('a', 'd', 'alpha', 'offset', 'gain'):
            value = float(getattr(self, name))  # numpy's own scalars are slow in arithmetic
            if not math.isfinite(value):
                raise LegFKError(f'{name} is {value}; allowed: a finite number')
            object.__setattr__(self, name, value)
        if self.gain == 0.0:
            raise LegFKError('gain is 0; allowed: a number that moves the row')
        for lower, upper in ((self.lower, self.upper), self.limits):
            if not lower <= upper:
                raise LegFKError(f'range is {lower} .. {upper}; allowed: lower <= upper')

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
        """Return A_i, the (..., 4, 4) transform from this link's frame to the one before it.

        Args:
            q: (...) joint positions [rad or m]; without effect on a fixed row.
        """
        moved = self.gain * np.asarray(q, dtype=float)
        theta, d = np.full_like(moved, self.offset), np.full_like(moved, self.d)
        if self.is_prismatic:
            d = d + moved
        elif not self.is_fixed:
            theta = theta + moved
        ct, st = cos_sin(theta)
        ca, sa = cos_sin(self.alpha)
        A = np.zeros((*moved.shape, 4, 4))
        A[..., 0, 0], A[..., 0, 1], A[..., 0, 2], A[..., 0, 3] = ct, -st * ca, st * sa, self.a * ct
        A[..., 1, 0], A[..., 1, 1], A[..., 1, 2], A[..., 1, 3] = st, ct * ca, -ct * sa, self.a * st
        A[..., 2, 1], A[..., 2, 2], A[..., 2, 3] = sa, ca, d
        A[..., 3, 3] = 1.0
        return A + 0.0  # no negative zeros for the eye to stumble over

    def __repr__(self) -> str:
        words = [f'{name}={getattr(self, name):.6g}' for name in ('a', 'd', 'alpha', 'offset')]
        if self.joint_type != 'revolute':
            words.append(self.joint_type)
        if self.gain != 1.0:
            words.append(f'gain={self.gain:.6g}')
        if self.joint:
            words.append(f'joint={self.joint[:30]!r}')
        return f'DHLink({", ".join(words)})'
