"""Bags for tests, written and read with rosbags (which shares no code with `leg_fk bag`)."""

from dataclasses import astuple
from pathlib import Path

from icub_leg_fk.kinematics import load_chain
import numpy as np
import pytest
from support.recorded_walk import FILE, read_recorded_walk

interfaces = pytest.importorskip(
    'rosbags.interfaces', reason='bags are made with rosbags'
)
rosbag2 = pytest.importorskip('rosbags.rosbag2')
highlevel = pytest.importorskip('rosbags.highlevel')
typesys = pytest.importorskip('rosbags.typesys')

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
TYPES = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
JOINT_STATE = 'sensor_msgs/msg/JointState'
STRING = 'std_msgs/msg/String'
POSE = 'geometry_msgs/msg/PoseStamped'
TWIST = 'geometry_msgs/msg/TwistStamped'
TF = 'tf2_msgs/msg/TFMessage'
LEFT_POSE = '/foot_pose_publisher/left_foot/pose'
RIGHT_POSE = '/foot_pose_publisher/right_foot/pose'
LEFT_TWIST = '/foot_pose_publisher/left_foot/twist'
RIGHT_TWIST = '/foot_pose_publisher/right_foot/twist'
STORAGES = {
    'mcap': rosbag2.StoragePlugin.MCAP,
    'sqlite3': rosbag2.StoragePlugin.SQLITE3,
}
ENDINGS = {'mcap': '.mcap', 'sqlite3': '.db3'}
LEGS = load_chain('left_leg').joint_names + load_chain('right_leg').joint_names
OTHERS = tuple(f'arm_joint_{i}' for i in range(20))
FOREVER = interfaces.QosTime(2147483647, 4294967295)


def qos(depth, reliability, durability, lease=FOREVER):
    """Return a QoS profile with names and numbers of every kind."""
    return interfaces.Qos(
        interfaces.QosHistory.KEEP_LAST,
        depth,
        interfaces.QosReliability[reliability],
        interfaces.QosDurability[durability],
        FOREVER,
        FOREVER,
        interfaces.QosLiveliness.AUTOMATIC,
        lease,
        depth == 1,
    )


SENSOR_QOS = qos(5, 'BEST_EFFORT', 'VOLATILE')
LATCHED_QOS = qos(1, 'RELIABLE', 'TRANSIENT_LOCAL', interfaces.QosTime(1, 500))


def joint_state(stamp, names=LEGS, positions=None, velocities=(), frame_id=''):
    """Return the CDR bytes of a JointState; a stamp of None is zero."""
    if positions is None:
        positions = [0.01 * (i + 1) for i in range(len(names))]
    types = TYPES.types
    time = types['builtin_interfaces/msg/Time'](*divmod(stamp or 0, SECOND))
    header = types['std_msgs/msg/Header'](time, frame_id)
    message = types[JOINT_STATE](
        header,
        list(names),
        np.array(positions, float),
        np.array(velocities, float),
        np.zeros(0),
    )
    return bytes(TYPES.serialize_cdr(message, JOINT_STATE))


def string(text):
    """Return the CDR bytes of a String."""
    return bytes(TYPES.serialize_cdr(TYPES.types[STRING](text), STRING))


def walk(count, rate=100.0, names=OTHERS[:10] + LEGS + OTHERS[10:]):
    """Return (time, data) of joint states of swinging legs."""
    rows = []
    for i in range(count):
        stamp = START + round(i * SECOND / rate)
        phase = np.arange(len(names)) + 3 * i / rate
        data = joint_state(stamp, names, 0.3 * np.sin(phase), 0.9 * np.cos(phase))
        rows.append((stamp + 40_000, data))
    return rows


def recorded_walk():
    """Return (time, data) of the walk of a real robot."""
    if not FILE.is_file():
        pytest.skip(f'the recorded walk is not there: {FILE}')
    names, times, positions, _ = read_recorded_walk()
    stamps = [START + round(time * SECOND) for time in times.tolist()]
    return [
        (stamp + 250_000, joint_state(stamp, names, q))
        for stamp, q in zip(stamps, positions, strict=True)
    ]


def write_bag(
    path,
    storage='mcap',
    joints=None,
    compression=None,
    others=True,
    topic='/joint_states',
):
    """Write a bag of joint states and, unless told, of two other topics, one of them silent."""
    joints = walk(200) if joints is None else joints
    topics = {topic: (JOINT_STATE, [SENSOR_QOS], joints)}
    if others:
        texts = [
            (time + 1000, string(f'message {3 * i}'))
            for i, (time, _) in enumerate(joints[::3])
        ]
        topics['/text'] = (STRING, [LATCHED_QOS, SENSOR_QOS], texts)
        topics['/silent'] = ('nav_msgs/msg/Odometry', [], [])
    return write_topics(path, topics, storage, compression)


def write_topics(path, topics, storage='mcap', compression=None):
    """Write a bag of topics, each with its type, QoS and messages (time, data)."""
    writer = rosbag2.Writer(path, version=9, storage_plugin=STORAGES[storage])
    if compression:
        writer.set_compression(
            rosbag2.CompressionMode[compression.upper()], rosbag2.CompressionFormat.ZSTD
        )
    with writer:
        rows = []
        for name, (message_type, profiles, messages) in topics.items():
            connection = writer.add_connection(
                name, message_type, typestore=TYPES, offered_qos_profiles=profiles
            )
            rows += [(connection, time, data) for time, data in messages]
        for row in sorted(rows, key=lambda row: row[1]):
            writer.write(*row)
    return Path(path)


def numbers_of(part):
    """Return the numbers of a message: x, y, z, qx, qy, qz, qw of a Pose or a Transform."""
    triples = [each for each in astuple(part) if isinstance(each, tuple)]
    return [value for each in triples for value in each if isinstance(value, float)]


def read_bag(path):
    """Return the topics of a bag and its messages as (topic, time, data)."""
    with highlevel.AnyReader([Path(path)], default_typestore=TYPES) as reader:
        topics = {}
        for each in reader.connections:
            profiles = tuple(each.ext.offered_qos_profiles)
            topics[each.topic] = (each.msgtype, each.ext.serialization_format, profiles)
        messages = [
            (each.topic, time, bytes(data)) for each, time, data in reader.messages()
        ]
        assert len(messages) == reader.message_count
    return topics, messages


def poses_of(messages, topic, message_type=POSE):
    """Return (time, message) of a topic, which may be of another type, too."""
    return [
        (time, TYPES.deserialize_cdr(data, message_type))
        for name, time, data in messages
        if name == topic
    ]


def expected_poses(joints, leg='left_leg', version='v2_5', foot_frame='dh'):
    """Return (stamp, (4, 4) matrix) of whole messages, by the plain product of matrices."""
    chain = load_chain(leg, version, frame=foot_frame)
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
