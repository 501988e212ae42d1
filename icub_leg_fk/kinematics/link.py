"""One link of a chain in the standard (distal) Denavit-Hartenberg convention."""

from dataclasses import dataclass
import math

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics.rotation import Array, cos_sin
import numpy as np
from numpy.typing import ArrayLike

JOINT_TYPES = ('revolute', 'prismatic', 'fixed')


@dataclass(frozen=True)
class DHLink:
    """A row of a DH table: A_i = Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i).

    A revolute joint turns by theta_i = offset + sign q; a prismatic one slides by d_i = d + sign q
    and keeps theta_i = offset; a fixed row has no joint.

    Attributes:
        a: link length [m].
        d: link offset [m].
        alpha: link twist [rad].
        offset: joint angle at q = 0 [rad].
        joint_type: `revolute`, `prismatic` or `fixed`.
        sign: 1, or -1 for a joint that counts backward.
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
    sign: int = 1
    lower: float = -math.inf
    upper: float = math.inf
    robot_range: tuple[float, float] | None = None
    erratum: str = ''

    def __post_init__(self) -> None:
        if self.joint_type not in JOINT_TYPES:
            msg = f'joint_type is {self.joint_type!r}; allowed: {", ".join(JOINT_TYPES)}'
            raise LegFKError(msg)
        if self.sign not in (1, -1):
            raise LegFKError(f'sign is {self.sign!r}; allowed: 1 or -1')
        for name in ('a', 'd', 'alpha', 'offset'):
            value = float(getattr(self, name))  # numpy's own scalars are slow in arithmetic
            if not math.isfinite(value):
                raise LegFKError(f'{name} is {value}; allowed: a finite number')
            object.__setattr__(self, name, value)
        for lower, upper in ((self.lower, self.upper), self.limits):
            if not lower <= upper:
                raise LegFKError(f'range is {lower} .. {upper}; allowed: lower <= upper')

    @property
    def is_prismatic(self) -> bool:
        """Whether the joint slides along z instead of turning about it."""
        return self.joint_type == 'prismatic'

    @property
    def is_fixed(self) -> bool:
        """Whether the row has no joint."""
        return self.joint_type == 'fixed'

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest joint position [rad or m]: the robots' if known, else printed."""
        return self.robot_range or (self.lower, self.upper)

    def transform(self, q: ArrayLike = 0.0) -> Array:
        """Return A_i, the (..., 4, 4) transform from this link's frame to the one before it.

        Args:
            q: (...) joint positions [rad, or m if prismatic]; without effect on a fixed row.
        """
        q = np.asarray(q, dtype=float)
        moved = 0.0 if self.is_fixed else self.sign * (q if q.ndim else float(q))
        turned, slid = (0.0, moved) if self.is_prismatic else (moved, 0.0)
        ct, st = cos_sin(self.offset + turned)
        ca, sa = cos_sin(self.alpha)
        A = np.zeros((*np.shape(moved), 4, 4))
        A[..., 0, 0], A[..., 0, 1], A[..., 0, 2], A[..., 0, 3] = ct, -st * ca, st * sa, self.a * ct
        A[..., 1, 0], A[..., 1, 1], A[..., 1, 2], A[..., 1, 3] = st, ct * ca, -ct * sa, self.a * st
        A[..., 2, 1], A[..., 2, 2], A[..., 2, 3] = sa, ca, self.d + slid
        A[..., 3, 3] = 1.0
        return A + 0.0  # no negative zeros for the eye to stumble over
