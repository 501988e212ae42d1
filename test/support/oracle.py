"""Answers this project did not compute: the printed tables in Pinocchio and by hand.

The numbers are typed in from the documents, and each model is put together from rotations and
translations about the axes; nothing here is shared with the code under test.
"""

from math import cos, sin

import numpy as np

# Chain, version, a [mm], d [mm], alpha [deg], offset [deg], as printed; a line per row. Version 3
# of the legs is iKin's, with the left knee's d as the robot has it, which iKin prints as +6.2;
# that of the head is read off the URDF of iCubGenova09 by the documented method.
PRINTED = """
left_leg   v1      0        0        -90   90
left_leg   v1      0        0        -90   90
left_leg   v1      0        -223.6    90  -90
left_leg   v1     -213      0        180   90
left_leg   v1      0        0        -90    0
left_leg   v1     -41       0          0    0
right_leg  v1      0        0         90   90
right_leg  v1      0        0         90   90
right_leg  v1      0        223.6    -90  -90
right_leg  v1     -213      0        180   90
right_leg  v1      0        0         90    0
right_leg  v1     -41       0        180    0
left_leg   v2_5    0        0        -90   90
left_leg   v2_5    0        0        -90   90
left_leg   v2_5   -0.9175   -234.545  90  -90
left_leg   v2_5   -200.5    0        180   90
left_leg   v2_5    0        0        -90    0
left_leg   v2_5   -68.05    -3.5       0    0
right_leg  v2_5    0        0         90   90
right_leg  v2_5    0        0         90   90
right_leg  v2_5   -0.9175   234.545  -90  -90
right_leg  v2_5   -200.5    0        180   90
right_leg  v2_5    0        0         90    0
right_leg  v2_5   -68.05    3.5      180    0
left_leg   v3      9        0        -90   90
left_leg   v3     -15       -10.6    -90   90
left_leg   v3      15       -266.8    90  -90
left_leg   v3     -255.988  -6.2     180   90
left_leg   v3     -35       0        -90    0
left_leg   v3     -53.2     0          0    0
right_leg  v3      9        0         90   90
right_leg  v3     -15       10.6      90   90
right_leg  v3      15       266.8    -90  -90
right_leg  v3     -255.988  6.2      180   90
right_leg  v3     -35       0         90    0
right_leg  v3     -53.2     0        180    0
head_imu   v2      32       0         90    0
head_imu   v2      0        -5.5      90  -90
head_imu   v2      0        -223.3   -90  -90
head_imu   v2      9.5      0         90   90
head_imu   v2      0        0        -90  -90
head_imu   v2      18.5     110.8    -90   90
head_imu   v3      72.5     0        -90  -90
head_imu   v3      0        0        -90   90
head_imu   v3      4.86151  -278.7695 -90   0
head_imu   v3      9.5005   0         90   90
head_imu   v3      0        0         90   90
head_imu   v3     -5.5      170.484  180    0
"""
# The first three rows of each root transform, and of what follows the tables [mm].
ROOTS = {
    ('left_leg', 'v1'): '1 0 0 0  0 0 1 -68.1  0 -1 0 -119.9',
    ('left_leg', 'v2_5'): '1 0 0 0  0 0 1 -68.1  0 -1 0 -119.9',
    ('left_leg', 'v3'): '-1 0 0 21.6  0 0 -1 73.65  0 -1 0 0',
    ('right_leg', 'v1'): '1 0 0 0  0 0 1 68.1  0 -1 0 -119.9',
    ('right_leg', 'v2_5'): '1 0 0 0  0 0 1 68.1  0 -1 0 -119.9',
    ('right_leg', 'v3'): '-1 0 0 21.6  0 0 -1 -73.65  0 -1 0 0',
    ('head_imu', 'v2'): '0 -1 0 0  0 0 -1 0  1 0 0 0',
    ('head_imu', 'v3'): '0 0 -1 0  1 0 0 0  0 -1 0 60.5',
}
ENDS = {
    ('head_imu', 'v2'): '1 0 0 0  0 0 -1 0  0 1 0 6.6',
    ('head_imu', 'v3'): '1 0 0 0  0 1 0 -3.5  0 0 1 0',
}
SOLE = '0 0 1 0  0 -1 0 0  1 0 0 0'
SOLE_V3 = '0 0 1 -12.6  0 -1 0 0  1 0 0 22.88'
IDENTITY = '1 0 0 0  0 1 0 0  0 0 1 0'

CASES = [
    (name, version, frame)
    for name, version in ROOTS
    for frame in (('dh', 'sole') if name != 'head_imu' else ('dh',))
]


def table(name, version):
    """Return a row of a, d [m], alpha, offset [rad] for each printed one."""
    rows = []
    for line in PRINTED.split('\n')[1:-1]:
        words = line.split()
        if words[:2] == [name, version]:
            a, d, alpha, offset = map(float, words[2:])
            rows.append([a / 1000, d / 1000, np.deg2rad(alpha), np.deg2rad(offset)])
    return rows


def transform(text):
    """Return the (4, 4) transform of three rows in mm."""
    T = np.eye(4)
    T[:3] = np.array(text.split(), float).reshape(3, 4)
    T[:3, 3] /= 1000
    return T


def after_table(name, version, frame):
    """Return the transform from a tip frame to the last row's frame."""
    T_n_tip = transform(ENDS.get((name, version), IDENTITY))
    if frame != 'sole':
        return T_n_tip
    return T_n_tip @ transform(SOLE_V3 if version == 'v3' else SOLE)


class PinocchioArm:
    """A printed table as a Pinocchio model: joints about z at fixed placements."""

    def __init__(self, name, version, frame):
        import pinocchio as pin

        self.pin, self.model = pin, pin.Model()
        T, joint = transform(ROOTS[name, version]), 0
        for a, d, alpha, offset in table(name, version):
            placement = pin.SE3(T @ rotation_z(offset))
            joint = self.model.addJoint(
                joint, pin.JointModelRZ(), placement, f'j{joint}'
            )
            T = translation(a, 0, d) @ rotation_x(alpha)
        placement = pin.SE3(T @ after_table(name, version, frame))
        self.tip = self.model.addFrame(
            pin.Frame('tip', joint, 0, placement, pin.FrameType.OP_FRAME)
        )
        self.data = self.model.createData()

    def forward(self, q):
        self.pin.framesForwardKinematics(self.model, self.data, q)
        return np.array(self.data.oMf[self.tip].homogeneous)

    def jacobian(self, q):
        axes = self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return np.array(
            self.pin.computeFrameJacobian(self.model, self.data, q, self.tip, axes)
        )


def translation(x, y, z):
    return np.array([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1.0]])


def rotation_x(angle):
    c, s = cos(angle), sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def rotation_z(angle):
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def basic_product(a, d, alpha, theta):
    """Return one link, as the documents define it: Rz(theta) Tz(d) Tx(a) Rx(alpha)."""
    return (
        rotation_z(theta)
        @ translation(0, 0, d)
        @ translation(a, 0, 0)
        @ rotation_x(alpha)
    )


class HandMadeArm:
    """A printed table multiplied out, where Pinocchio is not installed."""

    def __init__(self, name, version, frame):
        self.T_root_0 = transform(ROOTS[name, version])
        self.rows = table(name, version)
        self.after = after_table(name, version, frame)

    def forward(self, q):
        T = self.T_root_0
        for (a, d, alpha, offset), position in zip(self.rows, q, strict=True):
            T = T @ basic_product(a, d, alpha, offset + position)
        return T @ self.after


def frames(chain, q):
    """Return every frame of any chain, each row as the product of its four basic transforms."""
    positions = dict(zip(chain.joint_names, q, strict=True))
    named = {link.joint for link in chain.links}
    others = iter([name for name in chain.joint_names if name not in named])
    found = [np.array(chain.T_root_0)]
    for link in chain.links:
        theta, d = link.offset, link.d
        if link.joint_type != 'fixed':
            moved = link.gain * positions[link.joint or next(others)]
            theta += moved if link.joint_type == 'revolute' else 0.0
            d += moved if link.joint_type == 'prismatic' else 0.0
        found.append(found[-1] @ basic_product(link.a, d, link.alpha, theta))
    return [*found, found[-1] @ chain.T_n_tip]


def quaternion_to_matrix(quaternion):
    """Return the (..., 3, 3) rotation matrices of (..., 4) unit quaternions x, y, z, w."""
    x, y, z, w = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    R = np.empty((*x.shape, 3, 3))
    R[..., 0, 0] = 1 - 2 * (y * y + z * z)
    R[..., 1, 1] = 1 - 2 * (x * x + z * z)
    R[..., 2, 2] = 1 - 2 * (x * x + y * y)
    R[..., 0, 1], R[..., 1, 0] = 2 * (x * y - w * z), 2 * (x * y + w * z)
    R[..., 0, 2], R[..., 2, 0] = 2 * (x * z + w * y), 2 * (x * z - w * y)
    R[..., 1, 2], R[..., 2, 1] = 2 * (y * z - w * x), 2 * (y * z + w * x)
    return R
