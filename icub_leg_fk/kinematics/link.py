"""One link of a chain in the standard (distal) Denavit-Hartenberg convention."""

from __future__ import annotations

from dataclasses import dataclass
import math

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics.rotation import Array, cos_sin
import numpy as np

JOINT_TYPES = ('revolute', 'prismatic')


@dataclass(frozen=True)
class DHLink:
    """A row of a DH table: A_i = Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i).

    A revolute joint turns by theta_i = offset + q; a prismatic one slides by d_i = d + q and
    keeps theta_i = offset.

    Attributes:
        a: link length [m].
        d: link offset [m].
        alpha: link twist [rad].
        offset: joint angle at q = 0 [rad].
        joint_type: `revolute` or `prismatic`.
        lower: smallest documented joint position [rad or m]; -inf if none is.
        upper: largest documented joint position [rad or m]; inf if none is.
        erratum: what is known to be wrong with the printed row, and its source; empty if nothing.
    """

    a: float
    d: float
    alpha: float
    offset: float = 0.0
    joint_type: str = 'revolute'
    lower: float = -math.inf
    upper: float = math.inf
    erratum: str = ''

    def __post_init__(self) -> None:
        if self.joint_type not in JOINT_TYPES:
            msg = f'joint_type: found {self.joint_type!r}, allowed: {", ".join(JOINT_TYPES)}'
            raise LegFKError(msg)
        for name in ('a', 'd', 'alpha', 'offset'):
            value = float(getattr(self, name))  # numpy's own scalars are slow in arithmetic
            if not math.isfinite(value):
                msg = f'{name}: found {value}, allowed: a finite number'
                raise LegFKError(msg)
            object.__setattr__(self, name, value)
        if not self.lower <= self.upper:
            msg = f'range: found {self.lower} .. {self.upper}, allowed: lower <= upper'
            raise LegFKError(msg)

    @property
    def is_prismatic(self) -> bool:
        """Whether the joint slides along z instead of turning about it."""
        return self.joint_type == 'prismatic'

    def transform(self, q: float = 0.0) -> Array:
        """Return A_i, the (4, 4) transform from this link's frame to the one before it.

        Args:
            q: joint position [rad, or m if prismatic].
        """
        theta, d = (self.offset, self.d + q) if self.is_prismatic else (self.offset + q, self.d)
        ct, st = cos_sin(theta)
        ca, sa = cos_sin(self.alpha)
        return np.array([
            [ct, -st * ca, st * sa, self.a * ct],
            [st, ct * ca, -ct * sa, self.a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]) + 0.0  # no negative zeros for the eye to stumble over
