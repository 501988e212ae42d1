"""The plain way to add foot poses to a bag: a loop over rosbags, message by message.

Reads with `AnyReader`, deserializes every JointState, multiplies numpy 4x4 matrices, serializes
two PoseStamped and writes everything with rosbags' `Writer`. This is the reference that
`leg_fk bag` is measured against:

    python bench/plain_bag.py IN OUT
"""

from __future__ import annotations

import math
from pathlib import Path
import sys
import time

from icub_leg_fk.kinematics import Catalog
import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

JOINT_STATES = '/joint_states'
POSE = 'geometry_msgs/msg/PoseStamped'


def link_matrix(a, d, alpha, theta):
    """Return one DH link's 4x4 matrix."""
    ct, st, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    return np.array([
        [ct, -st * ca, st * sa, a * ct],
        [st, ct * ca, -ct * sa, a * st],
        [0.0, sa, ca, d],
        [0.0, 0.0, 0.0, 1.0],
    ])


def foot_matrix(chain, q):
    """Return T_root_tip as the product of the link matrices."""
    T = chain.T_root_0
    for link, angle in zip(chain.links, q, strict=True):
        T = T @ link_matrix(link.a, link.d, link.alpha, link.offset + angle)
    return T @ chain.T_n_tip


def quaternion(R):
    """Return x, y, z, w of a rotation matrix, by its largest component."""
    trace = np.trace(R)
    squares = np.array([*(1 - trace + 2 * np.diag(R)), 1 + trace])
    i = int(np.argmax(squares))
    large = math.sqrt(squares[i])
    if i == 3:
        axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        return np.array([*(axis / large / 2), large / 2])
    j, k = (i + 1) % 3, (i + 2) % 3
    q = np.empty(4)
    q[i] = large / 2
    q[j] = (R[j, i] + R[i, j]) / large / 2
    q[k] = (R[k, i] + R[i, k]) / large / 2
    q[3] = (R[k, j] - R[j, k]) / large / 2
    return q if q[3] >= 0 else -q


def add_poses(source: Path, target: Path) -> int:
    """Copy a bag with two foot poses per JointState; return the number of JointStates."""
    types = get_typestore(Stores.ROS2_JAZZY)
    PoseStamped, Header = types.types[POSE], types.types['std_msgs/msg/Header']
    Pose = types.types['geometry_msgs/msg/Pose']
    Point = types.types['geometry_msgs/msg/Point']
    Quaternion = types.types['geometry_msgs/msg/Quaternion']
    catalog = Catalog.load()
    chains = [catalog.chain(leg, 'v2_5') for leg in ('left_leg', 'right_leg')]
    count = 0
    with AnyReader([source]) as reader, \
            Writer(target, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        copies = {
            connection.id: writer.add_connection(
                connection.topic, connection.msgtype, msgdef=connection.msgdef.data,
                rihs01=reader.typestore.hash_rihs01(connection.msgtype),
                offered_qos_profiles=connection.ext.offered_qos_profiles)
            for connection in reader.connections}
        outputs = [writer.add_connection(f'/foot_pose_publisher/{chain.tip}/pose', POSE,
                                         typestore=types) for chain in chains]
        for connection, timestamp, data in reader.messages():
            writer.write(copies[connection.id], timestamp, data)
            if connection.topic != JOINT_STATES:
                continue
            message = reader.deserialize(data, connection.msgtype)
            angles = dict(zip(message.name, message.position, strict=True))
            for chain, output in zip(chains, outputs, strict=True):
                T = foot_matrix(chain, [angles[name] for name in chain.joint_names])
                pose = PoseStamped(
                    Header(message.header.stamp, chain.root_frame),
                    Pose(Point(*T[:3, 3]), Quaternion(*quaternion(T[:3, :3]))))
                writer.write(output, timestamp, types.serialize_cdr(pose, POSE))
            count += 1
    return count


def main() -> None:
    """Run the loop on the bags of the command line and say how long a message took."""
    began = time.process_time()
    count = add_poses(Path(sys.argv[1]), Path(sys.argv[2]))
    print(f'{(time.process_time() - began) / count * 1e6:.1f} us of CPU per JointState')


if __name__ == '__main__':
    main()
