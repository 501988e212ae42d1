"""Bags for tests, written and read with rosbags (which shares no code with `leg_fk bag`)."""

import csv
from pathlib import Path

from icub_leg_fk.kinematics import Catalog
import numpy as np
import pytest

interfaces = pytest.importorskip('rosbags.interfaces', reason='bags are made with rosbags')
rosbag2 = pytest.importorskip('rosbags.rosbag2')
highlevel = pytest.importorskip('rosbags.highlevel')
typesys = pytest.importorskip('rosbags.typesys')

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
TYPES = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
JOINT_STATE = 'sensor_msgs/msg/JointState'
STRING = 'std_msgs/msg/String'
POSE = 'geometry_msgs/msg/PoseStamped'
LEFT_POSE = '/foot_pose_publisher/left_foot/pose'
RIGHT_POSE = '/foot_pose_publisher/right_foot/pose'
STORAGES = {'mcap': rosbag2.StoragePlugin.MCAP, 'sqlite3': rosbag2.StoragePlugin.SQLITE3}
ENDINGS = {'mcap': '.mcap', 'sqlite3': '.db3'}
LEGS = tuple(f'{side}_{joint}' for side in 'lr' for joint in (
    'hip_pitch', 'hip_roll', 'hip_yaw', 'knee', 'ankle_pitch', 'ankle_roll'))
OTHERS = tuple(f'arm_joint_{i}' for i in range(20))
WALK = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'icub_genova04_walking.csv'


def qos(depth, reliability, durability, lease):
    """Return a QoS profile with names and numbers of every kind."""
    long = interfaces.QosTime(2147483647, 4294967295)
    return interfaces.Qos(
        interfaces.QosHistory.KEEP_LAST, depth, interfaces.QosReliability[reliability],
        interfaces.QosDurability[durability], long, long, interfaces.QosLiveliness.AUTOMATIC,
        lease, depth == 1)


SENSOR_QOS = qos(5, 'BEST_EFFORT', 'VOLATILE', interfaces.QosTime(2147483647, 4294967295))
LATCHED_QOS = qos(1, 'RELIABLE', 'TRANSIENT_LOCAL', interfaces.QosTime(1, 500))


def joint_state(stamp, names=LEGS, positions=None, velocities=(), frame_id=''):
    """Return the CDR bytes of a JointState; a stamp of None is zero."""
    if positions is None:
        positions = [0.01 * (i + 1) for i in range(len(names))]
    types = TYPES.types
    sec, nanosec = divmod(stamp or 0, SECOND)
    message = types[JOINT_STATE](
        types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](sec, nanosec), frame_id),
        list(names), np.array(positions, float), np.array(velocities, float), np.zeros(0))
    return bytes(TYPES.serialize_cdr(message, JOINT_STATE))


def string(text):
    """Return the CDR bytes of a String."""
    return bytes(TYPES.serialize_cdr(TYPES.types[STRING](text), STRING))


def walk(count, rate=100.0, names=OTHERS[:10] + LEGS + OTHERS[10:]):
    """Return (time, data) of joint states of swinging legs."""
    rows = []
    for i in range(count):
        time = START + round(i * SECOND / rate)
        q = 0.3 * np.sin(np.arange(len(names)) + 3 * i / rate)
        v = 0.9 * np.cos(np.arange(len(names)) + 3 * i / rate)
        rows.append((time + 40_000, joint_state(time, names, q, v)))
    return rows


def recorded_walk():
    """Return (time, data) of the walk of a real robot."""
    if not WALK.exists():
        pytest.skip(f'the recorded walk is not here: {WALK}')
    with WALK.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith('#')))
    names = [name for name in LEGS if name in rows[0]]
    assert len(names) == 12
    messages = []
    for row in rows:
        stamp = START + round(float(row['time']) * SECOND)
        messages.append((stamp + 250_000,
                         joint_state(stamp, names, [float(row[name]) for name in names])))
    return messages


def write_bag(path, storage='mcap', joints=None, compression=None, others=True,
              topic='/joint_states'):
    """Write a bag of joint states and, unless told, of two other topics, one of them silent."""
    joints = walk(200) if joints is None else joints
    writer = rosbag2.Writer(path, version=9, storage_plugin=STORAGES[storage])
    if compression:
        writer.set_compression(rosbag2.CompressionMode[compression.upper()],
                               rosbag2.CompressionFormat.ZSTD)
    with writer:
        states = writer.add_connection(topic, JOINT_STATE, typestore=TYPES,
                                       offered_qos_profiles=[SENSOR_QOS])
        if others:
            text = writer.add_connection('/text', STRING, typestore=TYPES,
                                         offered_qos_profiles=[LATCHED_QOS, SENSOR_QOS])
            writer.add_connection('/silent', 'nav_msgs/msg/Odometry', typestore=TYPES)
        for i, (time, data) in enumerate(joints):
            writer.write(states, time, data)
            if others and i % 3 == 0:
                writer.write(text, time + 1000, string(f'message {i}'))
    return path


def read_bag(path):
    """Return the topics of a bag and its messages as (topic, time, data)."""
    with highlevel.AnyReader([Path(path)], default_typestore=TYPES) as reader:
        topics = {
            connection.topic: (connection.msgtype, connection.ext.serialization_format,
                               tuple(connection.ext.offered_qos_profiles))
            for connection in reader.connections}
        messages = [(connection.topic, time, bytes(data))
                    for connection, time, data in reader.messages()]
        assert len(messages) == reader.message_count
    return topics, messages


def poses_of(messages, topic):
    """Return (time, message) of the poses on a topic."""
    return [(time, TYPES.deserialize_cdr(data, POSE))
            for name, time, data in messages if name == topic]


def expected_poses(joints, leg='left_leg', version='v2_5', foot_frame='dh'):
    """Return (stamp, (4, 4) matrix) of whole messages, by the plain product of matrices."""
    chain = Catalog.load().chain(leg, version, foot_frame)
    found = []
    for _, data in joints:
        message = TYPES.deserialize_cdr(data, JOINT_STATE)
        q = dict(zip(message.name, message.position, strict=True))
        stamp = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
        found.append((stamp, chain.forward([q[name] for name in chain.joint_names])))
    return found


def entries(folder):
    """Return the names of everything in a folder, hidden ones too."""
    return sorted(path.name for path in Path(folder).iterdir())
