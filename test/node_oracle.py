"""What the node's poses must be, by Pinocchio, from the tables of the shipped kinematics file."""

from functools import cache
import math

from icub_leg_fk.kinematics.catalog import config_file
import numpy as np
import pinocchio as pin
import yaml


@cache
def _tables():
    return yaml.safe_load(config_file('icub_kinematics.yaml').read_text())['chains']


def _metres(matrix):
    T = np.array(matrix, dtype=float)
    T[:3, 3] /= 1000.0
    return pin.SE3(T)


def _link(row):
    """Return Rz(offset) Tz(d) Tx(a) Rx(alpha), what follows the joint's own rotation."""
    return (pin.SE3(pin.rpy.rpyToMatrix(0, 0, math.radians(row['offset'])), np.zeros(3))
            * pin.SE3(pin.rpy.rpyToMatrix(math.radians(row['alpha']), 0, 0),
                      np.array([row['a'], 0.0, row['d']]) / 1000.0))


@cache
def _model(chain, version, foot_frame):
    """Return a Pinocchio model of revolute joints, and the index of its tip."""
    entry = _tables()[chain]
    table = entry['versions'][version]
    model, parent, placement = pin.Model(), 0, _metres(table['T_Ro0'])
    for i, row in enumerate(table['links']):
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f'joint{i}')
        placement = _link(row)
    if 'virtual_link' in table:
        placement = placement * _link(table['virtual_link'])
    for transform in (table.get('T_nIs'), entry['tip_frames'][foot_frame].get('transform')):
        if transform is not None:
            placement = placement * _metres(transform)
    tip = model.addFrame(pin.Frame('tip', parent, placement, pin.FrameType.OP_FRAME))
    return model, tip


def oracle_pose(chain, version, q, foot_frame='dh'):
    """Return the tip's pose in the root frame as a Pinocchio SE3."""
    model, tip = _model(chain, version, foot_frame)
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.array(q, dtype=float))
    return data.oMf[tip]


def oracle_jacobian(chain, version, q, foot_frame='dh'):
    """Return the (6, n) Jacobian of the tip, linear then angular, in the axes of the root."""
    model, tip = _model(chain, version, foot_frame)
    return pin.computeFrameJacobian(model, model.createData(), np.array(q, dtype=float), tip,
                                    pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)


def pose_matrix(pose):
    """Return the (4, 4) matrix of a geometry_msgs Pose or Transform."""
    p = getattr(pose, 'position', None) or pose.translation
    q = getattr(pose, 'orientation', None) or pose.rotation
    T = np.eye(4)
    T[:3, :3] = pin.Quaternion(q.w, q.x, q.y, q.z).toRotationMatrix()
    T[:3, 3] = p.x, p.y, p.z
    return T


def assert_same_pose(message, expected):
    """Check a PoseStamped against a Pinocchio SE3: 1e-12 m, 1e-12 in each entry of R."""
    np.testing.assert_allclose(pose_matrix(message.pose), expected.homogeneous, rtol=0, atol=1e-12)
