"""Joint recordings: what a robot's joints did over time."""

from __future__ import annotations

from dataclasses import dataclass

from icub_leg_fk.kinematics.rotation import Array


@dataclass(frozen=True)
class JointRecording:
    """Joint positions over time.

    Attributes:
        joint_names: n joint names.
        times: (N,) times [s], increasing.
        positions: (N, n) joint positions [rad].
        velocities: (N, n) joint velocities [rad/s], or None if unknown.
    """

    joint_names: tuple[str, ...]
    times: Array
    positions: Array
    velocities: Array | None = None
