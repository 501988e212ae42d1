"""A robot without ROS, on another vendor's DDS: Eclipse Cyclone DDS's own Python.

A program of its own: reads a task as JSON from standard input (`domain`, `namespace`, `feet`,
`names`, `first` and `postures`, which are lists of joint positions [rad]), sends the postures as
joint states, stamped `first` [s] and 1 s more each, and writes the poses that come back as JSON to
standard output: by foot a list of [sec, x, y, z, qx, qy, qz, qw].
"""

from dataclasses import dataclass
import json
import sys
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

DEADLINE = 60.0  # s
AGAIN = duration(milliseconds=100)
SILENCE = duration(seconds=20)
LOSSLESS = Qos(
    Policy.Reliability.Reliable(max_blocking_time=SILENCE), Policy.History.KeepAll
)


@dataclass
class Time(IdlStruct, typename='builtin_interfaces::msg::dds_::Time_'):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename='std_msgs::msg::dds_::Header_'):
    stamp: Time
    frame_id: str


@dataclass
class JointState(IdlStruct, typename='sensor_msgs::msg::dds_::JointState_'):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class Point(IdlStruct, typename='geometry_msgs::msg::dds_::Point_'):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename='geometry_msgs::msg::dds_::Quaternion_'):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename='geometry_msgs::msg::dds_::Pose_'):
    position: Point
    orientation: Quaternion


@dataclass
class PoseStamped(IdlStruct, typename='geometry_msgs::msg::dds_::PoseStamped_'):
    header: Header
    pose: Pose


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
        deadline = time.monotonic() + DEADLINE
        tries = 0
        for foot, reader in self._readers.items():
            while next(reader.take_iter(timeout=AGAIN), None) is None:
                if time.monotonic() > deadline:
                    sys.exit(f'no pose of {foot} in {DEADLINE} s')
                tries += 1
                self._send(Time(0, tries), positions)

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
