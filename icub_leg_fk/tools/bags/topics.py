"""Topics of a bag, and the definitions of the three message types that `leg_fk bag` adds."""

from __future__ import annotations

from typing import NamedTuple

JOINT_STATE = 'sensor_msgs/msg/JointState'
POSE = 'geometry_msgs/msg/PoseStamped'
TWIST = 'geometry_msgs/msg/TwistStamped'
TF = 'tf2_msgs/msg/TFMessage'

Message = tuple[int, int, int, int, bytes]
"""Index of the topic, sequence number, time of recording and of publishing [ns], CDR bytes."""


class Topic(NamedTuple):
    """What a bag knows of a topic; everything as it stands in the file.

    Attributes:
        name: full name.
        type_name: message type, such as `sensor_msgs/msg/JointState`.
        serialization_format: `cdr`.
        qos: offered QoS profiles, YAML; empty if unknown.
        type_hash: REP-2011 hash of the type; empty if unknown.
        encoding: `ros2msg` or `ros2idl`; empty if there is no definition.
        definition: definition of the message type and of all types in it.
    """

    name: str
    type_name: str
    serialization_format: str = 'cdr'
    qos: str = ''
    type_hash: str = ''
    encoding: str = ''
    definition: str = ''


_QOS = """\
- history: keep_last
  depth: {depth}
  reliability: reliable
  durability: volatile
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false"""

_PARTS = {
    'builtin_interfaces/Time': 'int32 sec\nuint32 nanosec\n',
    'std_msgs/Header': 'builtin_interfaces/Time stamp\nstring frame_id\n',
    'geometry_msgs/Point': 'float64 x\nfloat64 y\nfloat64 z\n',
    'geometry_msgs/Quaternion': 'float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n',
    'geometry_msgs/Vector3': 'float64 x\nfloat64 y\nfloat64 z\n',
    'geometry_msgs/Pose': 'Point position\nQuaternion orientation\n',
    'geometry_msgs/Twist': 'Vector3 linear\nVector3 angular\n',
    'geometry_msgs/Transform': 'Vector3 translation\nQuaternion rotation\n',
    'geometry_msgs/TransformStamped':
        'std_msgs/Header header\nstring child_frame_id\nTransform transform\n',
}
_TYPES = {
    POSE: (
        'RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8',
        'std_msgs/Header header\nPose pose\n',
        ('std_msgs/Header', 'builtin_interfaces/Time', 'geometry_msgs/Pose',
         'geometry_msgs/Point', 'geometry_msgs/Quaternion')),
    TWIST: (
        'RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64',
        'std_msgs/Header header\nTwist twist\n',
        ('std_msgs/Header', 'builtin_interfaces/Time', 'geometry_msgs/Twist',
         'geometry_msgs/Vector3')),
    TF: (
        'RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087',
        'geometry_msgs/TransformStamped[] transforms\n',
        ('geometry_msgs/TransformStamped', 'std_msgs/Header', 'builtin_interfaces/Time',
         'geometry_msgs/Transform', 'geometry_msgs/Vector3', 'geometry_msgs/Quaternion')),
}


def new_topic(name: str, message_type: str, like: Topic) -> Topic:
    """Return a topic to add, offered as the node offers it.

    Args:
        name: full name.
        message_type: `POSE`, `TWIST` or `TF`.
        like: a topic of the bag; if that has no definition, nor has the new one: readers take
            either all types from the bag or all from elsewhere.
    """
    qos = _QOS.format(depth=100 if message_type == TF else 10)
    type_hash, definition, parts = _TYPES[message_type]
    if not like.definition:
        return Topic(name, message_type, 'cdr', qos, type_hash)
    sections = [definition, *(f'MSG: {part}\n{_PARTS[part]}' for part in parts)]
    return Topic(name, message_type, 'cdr', qos, type_hash, 'ros2msg',
                 f'{"=" * 80}\n'.join(sections))
