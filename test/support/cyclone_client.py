"""A robot without ROS, on another vendor's DDS: Eclipse Cyclone DDS's own Python.

A program of its own: reads a task as JSON from standard input (`domain`, `namespace`, `feet`,
`names`, `first` and `postures`, which are lists of joint positions [rad]), sends the postures as
joint states, stamped `first` [s] and 1 s more each, and writes the poses that come back as JSON to
standard output: by foot a list of [sec, x, y, z, qx, qy, qz, qw].
"""

import json
import sys

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

ATTEMPTS = 600
AGAIN = duration(milliseconds=100)
SILENCE = duration(seconds=20)
LOSSLESS = Qos(
    Policy.Reliability.Reliable(max_blocking_time=SILENCE), Policy.History.KeepAll
)


NUMBERS = sequence[float64]


def message(package, name, /, **fields):
    """Return the type of a ROS message, by its name in DDS."""
    return make_idl_struct(name, f'{package}::msg::dds_::{name}_', fields)


Time = message('builtin_interfaces', 'Time', sec=int32, nanosec=uint32)
Header = message('std_msgs', 'Header', stamp=Time, frame_id=str)
JointState = message(
    'sensor_msgs',
    'JointState',
    header=Header,
    name=sequence[str],
    position=NUMBERS,
    velocity=NUMBERS,
    effort=NUMBERS,
)
Point = message('geometry_msgs', 'Point', **dict.fromkeys('xyz', float64))
Quaternion = message('geometry_msgs', 'Quaternion', **dict.fromkeys('xyzw', float64))
Pose = message('geometry_msgs', 'Pose', position=Point, orientation=Quaternion)
PoseStamped = message('geometry_msgs', 'PoseStamped', header=Header, pose=Pose)


class Client:
    """Sends joint states and receives the poses of some feet."""

    def __init__(self, domain, namespace, feet, names):
        participant = DomainParticipant(domain)
        prefix = f'rt{namespace}'  # as ROS names its topics in DDS
        joint_states = Topic(
            participant, f'{prefix}/joint_states', JointState, qos=LOSSLESS
        )
        self._writer = DataWriter(participant, joint_states, qos=LOSSLESS)
        self._names = names
        self._readers = {}
        for foot in feet:
            name = f'{prefix}/foot_pose_publisher/{foot}/pose'
            poses = Topic(participant, name, PoseStamped, qos=LOSSLESS)
            self._readers[foot] = DataReader(participant, poses, qos=LOSSLESS)

    def connect(self, positions):
        """Send a posture again and again until every foot has answered."""
        for foot, reader in self._readers.items():
            for attempt in range(ATTEMPTS):
                self._send(Time(0, attempt + 1), positions)
                if next(reader.take_iter(timeout=AGAIN), None) is not None:
                    break
            else:
                sys.exit(f'no pose of {foot} after {ATTEMPTS} messages')

    def ask(self, postures, first):
        """Send postures; return what has come when the last pose has, or when nothing comes."""
        for second, positions in enumerate(postures, first):
            self._send(Time(second, 0), positions)
        last = first + len(postures) - 1
        answers = {}
        for foot, reader in self._readers.items():
            answers[foot] = received(reader, first, last)
        return answers

    def _send(self, stamp, positions):
        self._writer.write(
            JointState(Header(stamp, ''), self._names, positions, [], [])
        )


def received(reader, first, last):
    """Return the poses from the first second on, up to the one of the last."""
    poses = []
    for message in reader.take_iter(timeout=SILENCE):
        sec = message.header.stamp.sec
        p, q = message.pose.position, message.pose.orientation
        if sec >= first:
            poses.append([sec, p.x, p.y, p.z, q.x, q.y, q.z, q.w])
        if sec == last:
            break
    return poses


def main():
    """Do the task on standard input."""
    task = json.load(sys.stdin)
    client = Client(task['domain'], task['namespace'], task['feet'], task['names'])
    client.connect(task['postures'][0])
    answers = client.ask(task['postures'], task['first'])
    json.dump(answers, sys.stdout)


if __name__ == '__main__':
    main()
