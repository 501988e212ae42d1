"""A chain's joint vector, and the numbers that may stand in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

LARGEST_VALUE = 1e150  # of a position or velocity; beyond it sums and products overflow


class JointVector(NamedTuple):
    """A chain's joint vector, complete and fresh.

    Attributes:
        chain: index of the chain.
        positions: n joint positions [rad or m].
        velocities: n joint velocities [rad/s or m/s]; None if one is not known, or not finite.
    """

    chain: int
    positions: tuple[float, ...]
    velocities: tuple[float, ...] | None


def are_usable(values: Sequence[float]) -> bool:
    """Return whether all values are finite, with room to compute with them."""
    for value in values:
        if not -LARGEST_VALUE < value < LARGEST_VALUE:
            return False
    return True
