"""The joint states that every measurement uses."""

import math

ROBOT_JOINTS = (
    *(
        f'{part}_{axis}'
        for part in ('torso', 'neck')
        for axis in ('pitch', 'roll', 'yaw')
    ),
    *(
        f'{side}_{joint}'
        for side in 'lr'
        for joint in (
            'shoulder_pitch',
            'shoulder_roll',
            'shoulder_yaw',
            'elbow',
            'wrist_prosup',
            'wrist_pitch',
            'wrist_yaw',
        )
    ),
    *(
        f'{side}_{joint}'
        for side in 'lr'
        for joint in (
            'hip_pitch',
            'hip_roll',
            'hip_yaw',
            'knee',
            'ankle_pitch',
            'ankle_roll',
        )
    ),
)
"""The 32 joints of the simulated iCub; the last twelve are the legs'."""


def joint_positions(phase: float) -> list[float]:
    """Return their positions, inside every documented range [rad]."""
    swing = 0.1 * math.sin(phase)
    legs = [0.2 + swing, 0.05, 0.02 * swing, -0.5 - swing, -0.2 + swing, 0.03]
    return [*(swing for _ in range(20)), *legs, *legs]
