"""Velocity of a chain's tip; free of rclpy."""

from __future__ import annotations

from collections.abc import Sequence

from icub_leg_fk.kinematics import Chain


def tip_twist(chain: Chain, q: Sequence[float], qdot: Sequence[float]) -> list[float]:
    """Return the tip's linear [m/s] and angular velocity [rad/s] in the axes of the root frame.

    Args:
        chain: the chain.
        q: n joint positions [rad or m].
        qdot: n joint velocities [rad/s or m/s].
    """
    return [float(value) for value in chain.jacobian(q) @ qdot]
