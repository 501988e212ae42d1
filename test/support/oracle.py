"""Answers this project did not compute: the printed tables in Pinocchio and by hand.

The numbers are typed in from the documents, and each model is put together from rotations and
translations about the axes; nothing here is shared with the code under test.
"""

from collections.abc import Sequence
from math import cos, pi, sin
from typing import Any

from icub_leg_fk.kinematics import Chain
import numpy as np

# (a [mm], d [mm], alpha [rad], offset [deg]), a row per link, as printed.
Row = tuple[float, float, float, float]

LEFT_V1: list[Row] = [
    (0, 0, -pi / 2, 90),
    (0, 0, -pi / 2, 90),
    (0, -223.6, pi / 2, -90),
    (-213, 0, pi, 90),
    (0, 0, -pi / 2, 0),
    (-41, 0, 0, 0),
]
RIGHT_V1: list[Row] = [
    (0, 0, pi / 2, 90),
    (0, 0, pi / 2, 90),
    (0, 223.6, -pi / 2, -90),
    (-213, 0, pi, 90),
    (0, 0, pi / 2, 0),
    (-41, 0, pi, 0),
]
LEFT_V2_5: list[Row] = [
    (0, 0, -pi / 2, 90),
    (0, 0, -pi / 2, 90),
    (-0.9175, -234.545, pi / 2, -90),
    (-200.5, 0, pi, 90),
    (0, 0, -pi / 2, 0),
    (-68.05, -3.5, 0, 0),
]
RIGHT_V2_5: list[Row] = [
    (0, 0, pi / 2, 90),
    (0, 0, pi / 2, 90),
    (-0.9175, 234.545, -pi / 2, -90),
    (-200.5, 0, pi, 90),
    (0, 0, pi / 2, 0),
    (-68.05, 3.5, pi, 0),
]
# Of iKin, not of the documents; the left knee's d is the robot's, which iKin prints as +6.2.
LEFT_V3: list[Row] = [
    (9, 0, -pi / 2, 90),
    (-15, -10.6, -pi / 2, 90),
    (15, -266.8, pi / 2, -90),
    (-255.988, -6.2, pi, 90),
    (-35, 0, -pi / 2, 0),
    (-53.2, 0, 0, 0),
]
RIGHT_V3: list[Row] = [
    (9, 0, pi / 2, 90),
    (-15, 10.6, pi / 2, 90),
    (15, 266.8, -pi / 2, -90),
    (-255.988, 6.2, pi, 90),
    (-35, 0, pi / 2, 0),
    (-53.2, 0, pi, 0),
]
HEAD_V2: list[Row] = [
    (32, 0, pi / 2, 0),
    (0, -5.5, pi / 2, -90),
    (0, -223.3, -pi / 2, -90),
    (9.5, 0, pi / 2, 90),
    (0, 0, -pi / 2, -90),
    (18.5, 110.8, -pi / 2, 90),
]

# Of the URDF of iCubGenova09, read off by the documented method; not in print.
HEAD_V3: list[Row] = [
    (72.5, 0, -pi / 2, -90),
    (0, 0, -pi / 2, 90),
    (4.86151, -278.7695, -pi / 2, 0),
    (9.5005, 0, pi / 2, 90),
    (0, 0, pi / 2, 90),
    (-5.5, 170.484, pi, 0),
]


def _leg_root(x: float, y: float, z: float) -> np.ndarray:
    return np.array(
        [[1, 0, 0, x / 1000], [0, 0, 1, y / 1000], [0, -1, 0, z / 1000], [0, 0, 0, 1]]
    )


HEAD_ROOT = np.array([[0.0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])
HEAD_V3_ROOT = np.array(
    [[0.0, 0, -1, 0], [1, 0, 0, 0], [0, -1, 0, 0.0605], [0, 0, 0, 1]]
)
T_NIS_V3 = np.array([[1.0, 0, 0, 0], [0, 1, 0, -0.0035], [0, 0, 1, 0], [0, 0, 0, 1]])
T_NIS = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0.0066], [0, 0, 0, 1]])
V3_ROOT = {
    side: np.array([[-1, 0, 0, 0.0216], [0, 0, -1, y], [0, -1, 0, 0], [0, 0, 0, 1]])
    for side, y in (('left', 0.07365), ('right', -0.07365))
}
SOLE = np.array([[0.0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])

# (chain, version): root transform, rows, transform from the tip to the last frame.
TABLES: dict[tuple[str, str], tuple[np.ndarray, list[Row], np.ndarray]] = {
    ('left_leg', 'v1'): (_leg_root(0, -68.1, -119.9), LEFT_V1, np.eye(4)),
    ('left_leg', 'v2_5'): (_leg_root(0, -68.1, -119.9), LEFT_V2_5, np.eye(4)),
    ('left_leg', 'v3'): (V3_ROOT['left'], LEFT_V3, np.eye(4)),
    ('right_leg', 'v1'): (_leg_root(0, 68.1, -119.9), RIGHT_V1, np.eye(4)),
    ('right_leg', 'v2_5'): (_leg_root(0, 68.1, -119.9), RIGHT_V2_5, np.eye(4)),
    ('right_leg', 'v3'): (V3_ROOT['right'], RIGHT_V3, np.eye(4)),
    ('head_imu', 'v2'): (HEAD_ROOT, HEAD_V2, T_NIS),
    ('head_imu', 'v3'): (HEAD_V3_ROOT, HEAD_V3, T_NIS_V3),
}
V3_SOLE = SOLE @ np.array(
    [[1, 0, 0, 0.02288], [0, 1, 0, 0], [0, 0, 1, -0.0126], [0, 0, 0, 1]]
)


def tip_transform(version: str, frame: str) -> np.ndarray:
    """Return the transform from a tip frame to the end of the table."""
    if frame != 'sole':
        return np.eye(4)
    return V3_SOLE if version == 'v3' else SOLE


CASES = [
    (name, version, frame)
    for name, version in TABLES
    for frame in (('dh', 'sole') if name != 'head_imu' else ('dh',))
]


class PinocchioArm:
    """A printed table as a Pinocchio model: joints about z at fixed placements."""

    def __init__(self, name: str, version: str, frame: str) -> None:
        import pinocchio as pin

        T_root_0, rows, T_n_tip = TABLES[name, version]
        self.pin, self.model = pin, pin.Model()
        placement, joint = pin.SE3(T_root_0), 0
        for i, (a, d, alpha, offset) in enumerate(rows):
            placement = placement * pin.SE3(
                pin.utils.rotate('z', np.deg2rad(offset)), np.zeros(3)
            )
            joint = self.model.addJoint(
                joint, pin.JointModelRZ(), placement, f'joint_{i}'
            )
            along_z = pin.SE3(np.eye(3), np.array([0, 0, d / 1000]))
            along_x = pin.SE3(np.eye(3), np.array([a / 1000, 0, 0]))
            placement = (
                along_z * along_x * pin.SE3(pin.utils.rotate('x', alpha), np.zeros(3))
            )
        placement = placement * pin.SE3(T_n_tip @ tip_transform(version, frame))
        self.tip = self.model.addFrame(
            pin.Frame('tip', joint, 0, placement, pin.FrameType.OP_FRAME)
        )
        self.data = self.model.createData()

    def forward(self, q: np.ndarray) -> np.ndarray:
        self.pin.framesForwardKinematics(self.model, self.data, q)
        return np.array(self.data.oMf[self.tip].homogeneous)

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        return np.array(
            self.pin.computeFrameJacobian(
                self.model,
                self.data,
                q,
                self.tip,
                self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
            )
        )


def translation(x: float, y: float, z: float) -> np.ndarray:
    return np.array([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1.0]])


def rotation_x(angle: float) -> np.ndarray:
    c, s = cos(angle), sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def rotation_z(angle: float) -> np.ndarray:
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def basic_product(a: float, d: float, alpha: float, theta: float) -> np.ndarray:
    """Return one link, as the documents define it: Rz(theta) Tz(d) Tx(a) Rx(alpha)."""
    return (
        rotation_z(theta)
        @ translation(0, 0, d)
        @ translation(a, 0, 0)
        @ rotation_x(alpha)
    )


class HandMadeArm:
    """A printed table multiplied out, where Pinocchio is not installed."""

    def __init__(self, name: str, version: str, frame: str) -> None:
        self.T_root_0, self.rows, self.T_n_tip = TABLES[name, version]
        self.T_dh_tip = tip_transform(version, frame)

    def forward(self, q: np.ndarray) -> np.ndarray:
        T = self.T_root_0
        for (a, d, alpha, offset), position in zip(self.rows, q, strict=True):
            T = T @ basic_product(
                a / 1000, d / 1000, alpha, np.deg2rad(offset) + position
            )
        return T @ self.T_n_tip @ self.T_dh_tip


def product(chain: Chain, q: Sequence[float]) -> np.ndarray:
    """Return T_root_tip of any chain, each row as the product of its four basic transforms."""
    positions = dict(zip(chain.joint_names, q, strict=True))
    named = {link.joint for link in chain.links}
    others = iter([name for name in chain.joint_names if name not in named])
    T = np.array(chain.T_root_0)
    for link in chain.links:
        theta, d = link.offset, link.d
        if link.joint_type != 'fixed':
            moved = link.gain * positions[link.joint or next(others)]
            theta += moved if link.joint_type == 'revolute' else 0.0
            d += moved if link.joint_type == 'prismatic' else 0.0
        T = T @ basic_product(link.a, d, link.alpha, theta)
    return T @ chain.T_n_tip


def quaternion_to_matrix(quaternion: Any) -> Any:
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
