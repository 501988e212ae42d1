"""What the node's messages must say, by a library that is not this project's."""

from functools import cache

import numpy as np
import pytest
from support.oracle import HandMadeArm, PinocchioArm


@cache
def _arm(chain, version, foot_frame):
    """Return Pinocchio's, or where that is not installed the tables multiplied out by hand."""
    try:
        return PinocchioArm(chain, version, foot_frame)
    except ImportError:
        return HandMadeArm(chain, version, foot_frame)


def oracle_pose(chain, version, q, foot_frame='dh'):
    """Return the (4, 4) transform from the tip to the root frame."""
    return _arm(chain, version, foot_frame).forward(np.array(q, dtype=float))


def oracle_jacobian(chain, version, q, foot_frame='dh'):
    """Return the (6, n) Jacobian of the tip, linear then angular, in the axes of the root."""
    pytest.importorskip(
        'pinocchio', reason='Pinocchio, which knows the Jacobian, is missing'
    )
    return _arm(chain, version, foot_frame).jacobian(np.array(q, dtype=float))


def pose_matrix(pose):
    """Return the (4, 4) matrix of a geometry_msgs Pose or Transform."""
    p = getattr(pose, 'position', None) or pose.translation
    q = getattr(pose, 'orientation', None) or pose.rotation
    x, y, z, w = q.x, q.y, q.z, q.w
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = p.x, p.y, p.z
    return T


def assert_same_pose(message, expected):
    """Check a PoseStamped against a (4, 4) transform: 1e-12 m, 1e-12 in each entry of R."""
    np.testing.assert_allclose(pose_matrix(message.pose), expected, rtol=0, atol=1e-12)
