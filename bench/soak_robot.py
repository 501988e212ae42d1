"""A robot that behaves badly: joint states at 1 kHz, with a new fault every two seconds."""

from collections import Counter, deque
from collections.abc import Callable, Iterator
import itertools
import math
import random
import struct
import time
from typing import Any, NamedTuple

from bench.joint_messages import joint_positions, ROBOT_JOINTS
from geometry_msgs.msg import PoseStamped, TwistStamped
from icub_leg_fk.kinematics import Catalog
import rclpy
from rclpy.duration import Duration
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

FEET = {'left_foot': 'left_leg', 'right_foot': 'right_leg'}
DEPTH = 20_000
SAMPLES = 100  # of the gait
SECOND = 1_000_000_000  # ns
VERSIONS, FOOT_FRAMES = ('v1', 'v2_5', 'v3'), ('dh', 'sole')
CHECKED = 50  # every so many poses one is computed anew
_PERIOD = 0.001  # s from message to message
_BETWEEN_FAULTS = 2.0  # s
_CATCH_UP = 0.01  # s; what is later than that is not made up for
_STAMP, _STAMP_AT = struct.Struct('<iI'), 4
_POSE = struct.Struct('<7d')
_BOTH, _LEFT, _RIGHT, _NONE = (True, True), (True, False), (False, True), (False, False)

Turn = tuple[Any, ...]
"""A message to send: its kind, whether either foot must answer, and a step of time [ns] if odd."""


class Promise(NamedTuple):
    """A pose that the rules of the input promise."""

    stamp: int  # ns
    certain: bool  # that the message reaches the node at all
    sent: int  # ns
    sample: int  # of the gait
    fault: str  # what was being done to the node then


class SoakRobot:
    """Sends joint states, knows what poses they promise, and takes in what comes.

    It counts the promised poses that were `kept` and `lost`, those `unexpected`, the `twists` and
    the `faults` done; `latencies` [us] has every tenth, `complaints` says what is not as it must.
    """

    def __init__(self, namespace: str) -> None:
        rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
        self._node = Node('robot', namespace=namespace)
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)
        self._qos = QoSProfile(depth=DEPTH)
        self._publisher = self._node.create_publisher(JointState, 'joint_states', self._qos)
        self._client = AsyncParameterClient(self._node, 'foot_pose_publisher')
        self._bystander: Any = None
        self._messages = _messages(random.Random(1))
        self._stamp = 1_700_000_000 * SECOND
        self._certain = False
        self._answered_from = 0
        self._fault = 'start'
        self._turns = self._all_turns()
        catalog = Catalog.load()
        self._chains = {}
        for foot, chain in FEET.items():
            self._chains[foot] = [catalog.chain(chain, version, frame)
                                  for version in VERSIONS for frame in FOOT_FRAMES]
        self._promised: dict[str, deque[Promise]] = {foot: deque() for foot in FEET}
        self.kept = dict.fromkeys(FEET, 0)
        self.latencies: list[float] = []
        self.sent = self.lost = self.unexpected = self.twists = 0
        self.faults: Counter[str] = Counter()
        self.complaints: list[str] = []
        for foot in FEET:
            for name, kind, receive in (('pose', PoseStamped, self._receiver(foot)),
                                        ('twist', TwistStamped, self._count_twist)):
                self._node.create_subscription(
                    kind, f'foot_pose_publisher/{foot}/{name}', receive, self._qos, raw=True)

    def run(self, seconds: float) -> None:
        """Send for some time [s]."""
        due = time.monotonic()
        end = due + seconds
        while (now := time.monotonic()) < end:
            if now >= due:
                due = max(due + _PERIOD, now - _CATCH_UP)
                self._send(*next(self._turns))
            self._executor.spin_once(timeout_sec=max(0.0, due - time.monotonic()))

    def finish(self, seconds: float = 5.0) -> None:
        """Wait until every promise is kept, and count those that are not."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and any(
                promise.certain for open_ones in self._promised.values() for promise in open_ones):
            self._executor.spin_once(timeout_sec=0.05)
        for foot, open_ones in self._promised.items():
            while open_ones:
                self._miss(foot, open_ones.popleft())

    def connect(self, seconds: float = 30.0) -> bool:
        """Send until both feet answer; return whether they do."""
        end = time.monotonic() + seconds
        while not self._certain and time.monotonic() < end:
            self._send('plain', _BOTH)
            self._executor.spin_once(timeout_sec=0.05)
        return self._certain

    def _send(self, kind: str, promised: tuple[bool, bool], step: int = 1_000_000) -> None:
        """Send one message; `promised` says which feet must answer."""
        self._stamp += step
        sample = self.sent % SAMPLES
        data = self._messages[kind][sample]
        _STAMP.pack_into(data, _STAMP_AT, *divmod(self._stamp, SECOND))
        sent = time.monotonic_ns()
        for open_ones, is_promised in zip(self._promised.values(), promised, strict=True):
            if is_promised:
                open_ones.append(Promise(self._stamp, self._certain, sent, sample, self._fault))
        self._publisher.publish(bytes(data[:16] if kind == 'malformed' else data))
        self.sent += 1

    def _receiver(self, foot: str) -> Callable[[bytes], None]:
        open_ones = self._promised[foot]

        def receive(data: bytes) -> None:
            now = time.monotonic_ns()
            sec, nanosec = _STAMP.unpack_from(data, _STAMP_AT)
            stamp = sec * SECOND + nanosec
            if all(promise.stamp != stamp for promise in open_ones):
                self.unexpected += 1
                self.complaints.append(f'{foot}: unexpected pose at {stamp}')
                return
            while (promise := open_ones.popleft()).stamp != stamp:
                self._miss(foot, promise)
            self.kept[foot] += 1
            if self.kept[foot] % 10 == 0:
                self.latencies.append((now - promise.sent) / 1000)
            if self.kept[foot] % CHECKED == 0:
                self._check(foot, promise, data)
            self._certain = self._certain or min(self.kept.values()) > self._answered_from
        return receive

    def _count_twist(self, data: bytes) -> None:
        self.twists += 1

    def _miss(self, foot: str, promise: Promise) -> None:
        if promise.certain:
            self.lost += 1
            self.complaints.append(f'{foot}: lost pose at {promise.stamp} during {promise.fault}')

    def _check(self, foot: str, promise: Promise, data: bytes) -> None:
        """Check that a pose is that of some configuration that has been set."""
        q = joint_positions(2 * math.pi * promise.sample / SAMPLES)[20:26]
        pose = _POSE.unpack(data[-_POSE.size:])
        if not any(pose == chain.pose(q) for chain in self._chains[foot]):
            self.complaints.append(f'{foot}: pose of no configuration during {promise.fault}')

    def _all_turns(self) -> Iterator[Turn]:
        """Yield for ever what is sent: fault after fault, and good messages between them."""
        good: Turn = ('plain', _BOTH)
        faults: dict[str, list[Turn] | Callable[[], None]] = {
            'NaN burst': 100 * [('nan', _RIGHT)],
            'reordered names': 100 * [('reordered', _BOTH), good],
            'loop': [('plain', _BOTH, -10 * SECOND)],
            'publisher restart': self._restart,
            'version change': self._change('version', itertools.cycle(VERSIONS)),
            'short, doubled, empty': 100 * [('short', _NONE), ('doubled', _NONE),
                                            ('empty', _NONE), good],
            'leg by leg': 100 * [('left', _LEFT), ('right', _RIGHT, -300_000)],
            'foot frame change': self._change('foot_frame', itertools.cycle(FOOT_FRAMES)),
            'malformed bytes': 100 * [('malformed', _NONE), good],
            'subscriber comes or goes': self._subscriber,
            'frame prefix change': self._change('frame_prefix', itertools.cycle(('a/', ''))),
            'other joints': 100 * [('others', _NONE), good],
            'skeletons on or off': self._change('publish_markers', itertools.cycle((True, False))),
            'twists on or off': self._change('publish_twist', itertools.cycle((True, False))),
            'joint timeout change': self._change('joint_timeout', itertools.cycle((1.0, 0.5))),
        }
        for self._fault, fault in itertools.cycle(faults.items()):
            self.faults[self._fault] += 1
            if callable(fault):
                fault()
            else:
                yield from fault
            end = time.monotonic() + _BETWEEN_FAULTS
            while time.monotonic() < end:
                yield good

    def _restart(self) -> None:
        """Leave, and come back as another publisher; nothing is certain until it is answered."""
        self._publisher.wait_for_all_acked(Duration(seconds=5))
        self._node.destroy_publisher(self._publisher)
        self.finish()
        self._certain = False
        self._answered_from = max(self.kept.values())
        self._publisher = self._node.create_publisher(JointState, 'joint_states', self._qos)

    def _subscriber(self) -> None:
        if self._bystander is None:
            self._bystander = self._node.create_subscription(
                PoseStamped, 'foot_pose_publisher/left_foot/pose', lambda data: None, 10, raw=True)
        else:
            self._node.destroy_subscription(self._bystander)
            self._bystander = None

    def _change(self, name: str, values: Iterator[Any]) -> Callable[[], None]:
        def note(future: Any) -> None:
            if not future.result().result.successful:
                self.complaints.append(f'{name} refused: {future.result().result.reason}')

        return lambda: self._client.set_parameters_atomically(
            [Parameter(name, value=next(values))]).add_done_callback(note)


def _messages(order: random.Random) -> dict[str, list[bytearray]]:
    """Return the serialized gait in every kind of message."""
    kinds: dict[str, list[bytearray]] = {}
    names = list(ROBOT_JOINTS)
    reordered = order.sample(range(32), 32)
    knee = names.index('l_knee')
    for sample in range(SAMPLES):
        q = joint_positions(2 * math.pi * sample / SAMPLES)
        for kind, of, positions in (
                ('plain', names, q), ('malformed', names, q), ('short', names, q[:-1]),
                ('nan', names, [*q[:knee], math.nan, *q[knee + 1:]]), ('empty', names, []),
                ('reordered', [names[i] for i in reordered], [q[i] for i in reordered]),
                ('doubled', [*names, 'l_knee'], [*q, 0.0]), ('others', names[:20], q[:20]),
                ('left', names[20:26], q[20:26]), ('right', names[26:], q[26:])):
            kinds.setdefault(kind, []).append(bytearray(serialize_message(
                JointState(name=of, position=positions, velocity=[0.1] * len(positions)))))
    return kinds
