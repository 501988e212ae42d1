"""A walking gait made from scratch: planned soles, joint angles by inverse kinematics.

It made config/examples/synthetic_walk.csv, which the demonstration plays.

The pelvis stays level and moves forward at constant speed, swaying over the standing foot and
bobbing a little; a foot stands still on the ground or swings to its next place along a
minimum-jerk curve. Seen from the root, both soles repeat the same cycle, half a period apart.
At q = 0 the soles are level and their x points forward, whichever way the root frame is turned
about its z (it has x backward, but forward on the iCub 3).
"""

from __future__ import annotations

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Catalog, Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.recording import JointRecording
import numpy as np
from numpy.polynomial import Polynomial

PERIOD = 1.25  # s, two steps
STANCE = 0.6  # share of the period a foot stands; above 0.5 both feet stand for a while
STEP = 0.12  # m from one foot's place to the other's
LIFT = 0.04  # m of the swing foot above the ground
SWAY = 0.03  # m of the pelvis to each side
BOB = 0.004  # m of the pelvis up and down
KNEE = np.radians(-34.0)  # of the posture around which the robot walks
HIP_ROLL_LIMIT = np.radians(17.0)  # the printed -119 .. 17 has a sign slip: both ends are near 17

# Minimum jerk (Flash and Hogan, J. Neuroscience 5, 1985) and a bump as smooth, over 0..1.
_SWING = Polynomial([0, 0, 0, 10, -15, 6])
_BUMP = 64 * Polynomial([0, 1]) ** 3 * Polynomial([1, -1]) ** 3


def walk(catalog: Catalog, version: str, seconds: float = 10.0,
         rate: float = 100.0) -> JointRecording:
    """Return positions [rad] of both legs, walking with level soles.

    The gait's period is rounded to whole samples of the rate [Hz].

    Raises:
        LegFKError: no such version, or its legs cannot walk like this within their ranges.
    """
    samples = max(2, round(PERIOD * rate))
    phases = np.arange(samples) / samples
    left_leg = catalog.chain('left_leg', version, 'sole')
    right_leg = catalog.chain('right_leg', version, 'sole')
    standing = left_leg.forward(_posture(left_leg))[:3, 3]
    left = _leg_cycle(left_leg, standing, phases)
    right = _leg_cycle(right_leg, standing * (1, -1, 1), phases + 0.5)
    count = max(1, round(seconds * rate))
    rows = np.arange(count) % samples
    return JointRecording(
        joint_names=(*left_leg.joint_names, *right_leg.joint_names),
        times=np.arange(count) / rate,
        positions=np.hstack((left, right))[rows])


def _leg_cycle(chain: Chain, standing: Array, phases: Array) -> Array:
    """Return the (N, 6) joint positions [rad] of one leg's cycle."""
    q = _posture(chain)
    level = chain.forward(np.zeros(chain.n))[:3, :3]
    positions = []
    for p in _sole_path(standing, level[0, 0], phases):
        q = _solve(chain, p, level, q)
        positions.append(q)
    for sample in positions:
        outside = chain.out_of_range(sample.tolist())
        if outside:
            raise LegFKError(f'the gait leaves the range of {outside[0]} of {chain.name} '
                             f'{chain.version}')
    return np.array(positions)


def _posture(chain: Chain) -> Array:
    """Return the joint positions around which the leg walks: knee bent, sole level."""
    hip_roll = chain.joints[1]
    room = np.radians(6.0)  # for the sway
    roll = float(np.clip(0.0, hip_roll.lower + room, min(hip_roll.upper, HIP_ROLL_LIMIT) - room))
    return np.array([-KNEE / 2, roll, 0.0, KNEE, KNEE / 2, -roll])


def _sole_path(standing: Array, ahead: float, phases: Array) -> Array:
    """Return the (N, 3) positions [m] of a sole in the root frame at (N,) phases.

    The foot moves around `standing` and stands in phases 0 to STANCE; `ahead` is 1 where x of the
    root frame points forward, -1 where backward.
    """
    side = np.sign(standing[1])  # -1 left, +1 right
    phase = phases % 1.0
    swing = np.clip((phase - STANCE) / (1 - STANCE), 0.0, 1.0)
    around = 2 * np.pi * (phase - STANCE / 2)  # 0 at mid-stance

    # In the world a foot advances by two steps a period, all of it while it swings, and the
    # pelvis by as much, evenly. A pelvis moving one way is a foot moving back.
    x = -ahead * 2 * STEP * (phase - STANCE / 2 - _SWING(swing))
    y = -side * SWAY * np.cos(around)
    z = LIFT * _BUMP(swing) - BOB * np.cos(2 * around)
    return standing + np.stack((x, y, z), axis=1)


def _solve(chain: Chain, position: Array, level: Array, start: Array) -> Array:
    """Return joint positions with a level sole at a position, by damped least squares."""
    q = start
    for _ in range(50):
        T = chain.forward(q)
        turn = np.cross(T[:3, :3].T, level.T).sum(axis=0) / 2
        error = np.append(position - T[:3, 3], turn)
        if np.abs(error).max() < 1e-12:
            return q
        J = chain.jacobian(q)
        q = q + J.T @ np.linalg.solve(J @ J.T + 1e-9 * np.eye(6), error)
    raise LegFKError(f'{chain.name} {chain.version} cannot reach the gait: missed '
                     f'{position.round(3).tolist()} m by {np.abs(error).max():.3g}')
