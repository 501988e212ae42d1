"""The plain ways that the package is compared to: numpy 4x4 matrices, and a loop over a bag.

`python -m bench.plain IN OUT` copies a bag and adds two foot poses per JointState: it reads with
rosbags' `AnyReader`, deserializes, multiplies matrices, serializes and writes message by message.
"""

from collections.abc import Sequence
import math
from pathlib import Path
import sys

from icub_leg_fk.kinematics import Catalog, Chain
from icub_leg_fk.kinematics.rotation import Array
import numpy as np

LEGS = ('left_leg', 'right_leg')
POSE = 'geometry_msgs/msg/PoseStamped'


def chains() -> list[Chain]:
    """Return both legs."""
    catalog = Catalog.load()
    return [catalog.chain(leg, 'v2_5', 'dh') for leg in LEGS]


def foot_matrix(chain: Chain, q: Sequence[float]) -> Array:
    """Return T_root_tip as the product of one matrix per row."""
    T = chain.T_root_0
    for link, angle in zip(chain.links, q, strict=True):
        theta = link.offset + angle
        ct, st = math.cos(theta), math.sin(theta)
        ca, sa = math.cos(link.alpha), math.sin(link.alpha)
        T = T @ np.array(
            [
                [ct, -st * ca, st * sa, link.a * ct],
                [st, ct * ca, -ct * sa, link.a * st],
                [0.0, sa, ca, link.d],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
    return T


def quaternion(T: Array) -> tuple[float, float, float, float]:
    """Return x, y, z, w of the rotation in a (4, 4) matrix, by the largest of the four."""
    m = T.tolist()
    w = 1.0 + m[0][0] + m[1][1] + m[2][2]
    x = 1.0 + m[0][0] - m[1][1] - m[2][2]
    y = 1.0 - m[0][0] + m[1][1] - m[2][2]
    z = 1.0 - m[0][0] - m[1][1] + m[2][2]
    wx, wy, wz = m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]
    xy, xz, yz = m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]
    largest = max(w, x, y, z)
    scale = 0.5 / math.sqrt(largest)
    if largest == w:
        return wx * scale, wy * scale, wz * scale, w * scale
    if largest == x:
        return x * scale, xy * scale, xz * scale, wx * scale
    if largest == y:
        return xy * scale, y * scale, yz * scale, wy * scale
    return xz * scale, yz * scale, z * scale, wz * scale


def add_poses(source: Path, target: Path) -> None:
    """Copy a bag with two foot poses per JointState."""
    from rosbags.highlevel import AnyReader
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import get_typestore, Stores

    store = get_typestore(Stores.ROS2_JAZZY)
    PoseStamped, Header, Pose, Point, Quaternion = (
        store.types[name]
        for name in (
            POSE,
            'std_msgs/msg/Header',
            'geometry_msgs/msg/Pose',
            'geometry_msgs/msg/Point',
            'geometry_msgs/msg/Quaternion',
        )
    )
    legs = chains()
    with (
        AnyReader([source]) as reader,
        Writer(target, version=9, storage_plugin=StoragePlugin.MCAP) as writer,
    ):
        copies = {
            connection.id: writer.add_connection(
                connection.topic,
                connection.msgtype,
                msgdef=connection.msgdef.data,
                rihs01=reader.typestore.hash_rihs01(connection.msgtype),
                offered_qos_profiles=connection.ext.offered_qos_profiles,
            )
            for connection in reader.connections
        }
        outputs = [
            writer.add_connection(
                f'/foot_pose_publisher/{leg.tip}/pose', POSE, typestore=store
            )
            for leg in legs
        ]
        for connection, timestamp, data in reader.messages():
            writer.write(copies[connection.id], timestamp, data)
            if connection.topic != '/joint_states':
                continue
            message = reader.deserialize(data, connection.msgtype)
            angles = dict(zip(message.name, message.position, strict=True))
            for leg, output in zip(legs, outputs, strict=True):
                T = foot_matrix(leg, [angles[name] for name in leg.joint_names])
                pose = PoseStamped(
                    Header(message.header.stamp, leg.root_frame),
                    Pose(Point(*T[:3, 3]), Quaternion(*quaternion(T))),
                )
                writer.write(output, timestamp, store.serialize_cdr(pose, POSE))


if __name__ == '__main__':
    add_poses(Path(sys.argv[1]), Path(sys.argv[2]))
