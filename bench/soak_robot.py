"""A robot that behaves badly: joint states at 1 kHz, with a new fault every two seconds."""

from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
import itertools
import math
import random
import struct
import time
from typing import Any, NamedTuple

from bench.joint_messages import joint_positions, ROBOT_JOINTS
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.tools.urdf_text import urdf_text
import rclpy
from rclpy.duration import Duration
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

FEET = {'left_foot': 'left_leg', 'right_foot': 'right_leg'}
NODE = 'foot_pose_publisher'
DEPTH = 20_000
SAMPLES = 100  # of the gait
SECOND = 1_000_000_000  # ns
VERSIONS = ('v1', 'v2_5', 'v3')
DESCRIBED_VERSIONS = ('v1', 'v2_5')
FOOT_FRAMES = ('dh', 'sole')
CHECKED = 50  # every so many poses one is computed anew
URDF_ACCURACY = 1e-9  # m, and each entry of the quaternion
_PERIOD = 0.001  # s from message to message
_BETWEEN_FAULTS = 2.0  # s
_BETWEEN_DESCRIPTIONS = 4.0  # s
_CATCH_UP = 0.01  # s; what is later than that is not made up for
_PATIENCE = 5.0  # s; far beyond what anything takes but discovery
_DISCOVERY = 30.0  # s
_STAMP, _STAMP_AT = struct.Struct('<iI'), 4
_POSE = struct.Struct('<7d')
_LEGS_AT = ROBOT_JOINTS.index('l_hip_pitch')
_BOTH, _LEFT, _RIGHT, _NONE = (True, True), (True, False), (False, True), (False, False)

Turn = tuple[Any, ...]
"""A message to send: its kind, whether either foot must answer, and a step of time [ns] if odd."""


class Promise(NamedTuple):
    """A pose that the rules of the input promise."""

    stamp: int  # ns
    sent: int  # ns
    sample: int  # of the gait
    fault: str  # what was being done to the node then


class SoakRobot:
    """Sends joint states, knows what poses they promise, and takes in what comes.

    Args:
        namespace: that of the node.
        describes: whether it also publishes its description, every four seconds another one.

    Attributes:
        sent: messages sent since `connect`.
        received: messages that the node has received since, by its diagnostics.
        promised: poses that the rules promise, by foot.
        published: poses that the node has published, by its diagnostics.
        arrived: poses that have arrived.
        lost: poses promised that have not arrived.
        unexpected: poses that were not promised.
        twists: twists that have arrived.
        descriptions: changes of the description that the poses have followed.
        faults: faults done to the node.
        latencies: of every tenth pose [us].
        complaints: what is not as it must be, a line each.
    """

    def __init__(self, namespace: str, describes: bool) -> None:
        rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
        self._node = Node('robot', namespace=namespace)
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)
        self._qos = QoSProfile(depth=DEPTH)
        self._publisher = self._node.create_publisher(
            JointState, 'joint_states', self._qos
        )
        self._client = AsyncParameterClient(self._node, NODE)
        self._bystander: Any = None
        self._messages = _messages(random.Random(1))
        self._stamp = 1_700_000_000 * SECOND
        self._fault = 'start'
        self._turns = self._all_turns(('', 'urdf') if describes else VERSIONS)
        self._promises: dict[str, deque[Promise]] = {foot: deque() for foot in FEET}
        self._counted_at = dict.fromkeys(FEET, 0)  # ns
        self.sent = self.received = self.lost = self.unexpected = self.twists = 0
        self.promised = dict.fromkeys(FEET, 0)
        self.published = dict.fromkeys(FEET, 0)
        self.arrived = dict.fromkeys(FEET, 0)
        self.descriptions = 0
        self.faults: Counter[str] = Counter()
        self.latencies: list[float] = []
        self.complaints: list[str] = []
        self._new_version = ''  # that of a description whose poses have not come yet
        self._tolerance = URDF_ACCURACY if describes else 0.0
        self._chains = _chains(DESCRIBED_VERSIONS if describes else VERSIONS)
        self._subscribe(namespace)
        if describes:
            self._start_describing()

    def connect(self) -> bool:
        """Send until both feet answer, and count from there on; return whether they do."""
        end = time.monotonic() + _DISCOVERY
        self._send('plain', _BOTH)
        while not self._spin_until(self._is_answered, 0.1):
            if time.monotonic() > end:
                return False
            self._send('plain', _BOTH)
        if not self._take_counts():
            return False
        # What was sent before the node was found may never have reached it.
        self.sent = self.received
        self.promised = dict(self.published)
        self.arrived = dict(self.published)
        self.lost = self.descriptions = 0
        self.complaints.clear()
        return True

    def run(self, seconds: float) -> None:
        """Send for some time [s]."""
        now = due = time.monotonic()
        end = now + seconds
        while now < end:
            if now >= due:
                due = max(due + _PERIOD, now - _CATCH_UP)
                self._send(*next(self._turns))
            self._executor.spin_once(timeout_sec=max(0.0, due - time.monotonic()))
            now = time.monotonic()

    def finish(self) -> None:
        """Wait until every promise is kept and everything counted; count what is lost."""
        self._settle()
        if not self._take_counts():
            self.complaints.append(
                f'no diagnostics of both legs within {_PATIENCE:g} s'
            )

    def _settle(self) -> None:
        """Wait until every promise is kept, and count those that are not."""
        self._spin_until(self._is_answered, _PATIENCE)
        for foot, promises in self._promises.items():
            while promises:
                self._miss(foot, promises.popleft())

    def _is_answered(self) -> bool:
        return not any(self._promises.values())

    def _take_counts(self) -> bool:
        """Wait for diagnostics of what has happened until now; return whether they came."""
        now = time.time_ns()
        return self._spin_until(lambda: min(self._counted_at.values()) > now, _PATIENCE)

    def _spin_until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Take in what comes until a condition holds; return whether it does in time."""
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end:
                return False
            self._executor.spin_once(timeout_sec=0.02)
        return True

    def _send(
        self, kind: str, promised: tuple[bool, bool], step: int = 1_000_000
    ) -> None:
        """Send one message; `promised` says which feet must answer."""
        self._stamp += step
        sample = self.sent % SAMPLES
        data = self._messages[kind][sample]
        _STAMP.pack_into(data, _STAMP_AT, *divmod(self._stamp, SECOND))
        promise = Promise(self._stamp, time.monotonic_ns(), sample, self._fault)
        for foot, is_promised in zip(FEET, promised, strict=True):
            if is_promised:
                self._promises[foot].append(promise)
                self.promised[foot] += 1
        self._publisher.publish(bytes(data))
        self.sent += 1

    def _subscribe(self, namespace: str) -> None:
        """Listen to everything that the node publishes."""
        feet = {}
        for foot, chain in FEET.items():
            feet[f'{namespace.lstrip("/")}/{NODE}: {chain}'] = foot
            self._listen(PoseStamped, f'{NODE}/{foot}/pose', self._receiver(foot))
            self._listen(TwistStamped, f'{NODE}/{foot}/twist', self._count_twist)
        self._node.create_subscription(
            DiagnosticArray,
            '/diagnostics',
            lambda array: self._count(array, feet),
            self._qos,
        )

    def _listen(self, kind: Any, topic: str, receive: Callable[[bytes], None]) -> None:
        self._node.create_subscription(kind, topic, receive, self._qos, raw=True)

    def _receiver(self, foot: str) -> Callable[[bytes], None]:
        promises = self._promises[foot]

        def receive(data: bytes) -> None:
            now = time.monotonic_ns()
            sec, nanosec = _STAMP.unpack_from(data, _STAMP_AT)
            stamp = sec * SECOND + nanosec
            self.arrived[foot] += 1
            if all(promise.stamp != stamp for promise in promises):
                self.unexpected += 1
                self.complaints.append(f'{foot}: unexpected pose at {stamp}')
                return
            while promises[0].stamp != stamp:
                self._miss(foot, promises.popleft())
            promise = promises.popleft()
            if self.arrived[foot] % 10 == 0:
                self.latencies.append((now - promise.sent) / 1000)
            if self.arrived[foot] % CHECKED == 0:
                self._check(foot, promise, data)

        return receive

    def _count_twist(self, data: bytes) -> None:
        self.twists += 1

    def _count(self, array: DiagnosticArray, feet: dict[str, str]) -> None:
        """Take in what the node has counted itself; `feet` are those of its statuses."""
        stamp = array.header.stamp
        for status in array.status:
            if status.name in feet:
                foot = feet[status.name]
                values = {item.key: item.value for item in status.values}
                self.received = int(values['messages'])
                self.published[foot] = int(values['poses'])
                self._counted_at[foot] = stamp.sec * SECOND + stamp.nanosec

    def _miss(self, foot: str, promise: Promise) -> None:
        self.lost += 1
        self.complaints.append(
            f'{foot}: lost pose at {promise.stamp} during {promise.fault}'
        )

    def _check(self, foot: str, promise: Promise, data: bytes) -> None:
        """Check that a pose is that of some configuration that has been set."""
        q = joint_positions(2 * math.pi * promise.sample / SAMPLES)[
            _LEGS_AT : _LEGS_AT + 6
        ]
        pose = _POSE.unpack(data[-_POSE.size :])
        for chain in self._chains[foot]:
            if _differ_by(pose, chain.pose(q)) <= self._tolerance:
                self._follow_description(chain.version)
                return
        self.complaints.append(
            f'{foot}: pose of no configuration during {promise.fault}'
        )

    def _start_describing(self) -> None:
        """Publish the description as robot_state_publisher does, every few seconds another."""
        qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = self._node.create_publisher(String, 'robot_description', qos)
        catalog = Catalog.load()
        texts = {}
        for version in DESCRIBED_VERSIONS:
            texts[version] = urdf_text('icub', catalog.select(FEET.values(), version))
        versions = itertools.cycle(texts)

        def describe() -> None:
            if not self._new_version:
                self._new_version = next(versions)
                publisher.publish(String(data=texts[self._new_version]))

        describe()
        self._node.create_timer(_BETWEEN_DESCRIPTIONS, describe)

    def _follow_description(self, version: str) -> None:
        """Count the change of the description if this is the version of the new one."""
        if version == self._new_version:
            self._new_version = ''
            self.descriptions += 1

    def _all_turns(self, versions: Sequence[str]) -> Iterator[Turn]:
        """Yield for ever what is sent: fault after fault, and good messages between them."""
        good: Turn = ('plain', _BOTH)
        useless: list[Turn] = [('short', _NONE), ('doubled', _NONE), ('empty', _NONE)]
        faults: dict[str, list[Turn] | Callable[[], None]] = {
            'NaN burst': 100 * [('nan', _RIGHT)],
            'reordered names': 100 * [('reordered', _BOTH), good],
            'loop': [('plain', _BOTH, -10 * SECOND)],
            'publisher restart': self._restart,
            'version change': self._change('version', versions),
            'short, doubled, empty': 100 * [*useless, good],
            'leg by leg': 100 * [('left', _LEFT), ('right', _RIGHT, -300_000)],
            'foot frame change': self._change('foot_frame', FOOT_FRAMES),
            'malformed bytes': 100 * [('malformed', _NONE), good],
            'subscriber comes or goes': self._subscriber,
            'frame prefix change': self._change('frame_prefix', ('a/', '')),
            'other joints': 100 * [('others', _NONE), good],
            'skeletons on or off': self._change('publish_markers', (True, False)),
            'twists on or off': self._change('publish_twist', (True, False)),
            'joint timeout change': self._change('joint_timeout', (1.0, 0.5)),
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
        """Leave, and come back as another publisher, to which the node subscribes as well."""
        self._settle()
        self._publisher.wait_for_all_acked(Duration(seconds=_PATIENCE))
        self._node.destroy_publisher(self._publisher)
        self._publisher = self._node.create_publisher(
            JointState, 'joint_states', self._qos
        )
        if not self._spin_until(self._is_subscribed, _DISCOVERY):
            self.complaints.append(
                'the node does not subscribe to the publisher that restarted'
            )

    def _is_subscribed(self) -> bool:
        return self._publisher.get_subscription_count() > 0

    def _subscriber(self) -> None:
        if self._bystander is None:
            self._bystander = self._node.create_subscription(
                PoseStamped, f'{NODE}/left_foot/pose', lambda data: None, 10, raw=True
            )
        else:
            self._node.destroy_subscription(self._bystander)
            self._bystander = None

    def _change(self, name: str, values: Sequence[Any]) -> Callable[[], None]:
        """Return what sets a parameter to one of the values after the other."""
        turns = itertools.cycle(values)

        def note(future: Any) -> None:
            result = future.result().result
            if not result.successful:
                self.complaints.append(f'{name} refused: {result.reason}')

        def change() -> None:
            parameters = [Parameter(name, value=next(turns))]
            self._client.set_parameters_atomically(parameters).add_done_callback(note)

        return change


def _chains(versions: Sequence[str]) -> dict[str, list[Any]]:
    """Return by foot the chains of all configurations."""
    catalog = Catalog.load()
    chains: dict[str, list[Any]] = {}
    for foot, name in FEET.items():
        pairs = itertools.product(versions, FOOT_FRAMES)
        chains[foot] = [catalog.chain(name, version, frame) for version, frame in pairs]
    return chains


def _differ_by(pose: Sequence[float], other: Sequence[float]) -> float:
    """Return the largest difference of two poses' numbers [m or 1]."""
    return max(abs(a - b) for a, b in zip(pose, other, strict=True))


def _messages(order: random.Random) -> dict[str, list[bytearray]]:
    """Return the serialized gait in every kind of message."""
    kinds: dict[str, list[bytearray]] = {}
    reordered = order.sample(range(len(ROBOT_JOINTS)), len(ROBOT_JOINTS))
    for sample in range(SAMPLES):
        q = joint_positions(2 * math.pi * sample / SAMPLES)
        for kind, (names, positions) in _variants(q, reordered).items():
            message = JointState(
                name=names, position=positions, velocity=[0.1] * len(positions)
            )
            kinds.setdefault(kind, []).append(bytearray(serialize_message(message)))
    kinds['malformed'] = [data[:16] for data in kinds['plain']]
    return kinds


def _variants(
    q: list[float], reordered: list[int]
) -> dict[str, tuple[list[str], list[float]]]:
    """Return the names and positions of every kind of message."""
    names = list(ROBOT_JOINTS)
    left, right = slice(_LEGS_AT, _LEGS_AT + 6), slice(_LEGS_AT + 6, _LEGS_AT + 12)
    with_nan = list(q)
    with_nan[names.index('l_knee')] = math.nan
    return {
        'plain': (names, q),
        'short': (names, q[:-1]),
        'nan': (names, with_nan),
        'empty': (names, []),
        'reordered': ([names[i] for i in reordered], [q[i] for i in reordered]),
        'doubled': ([*names, 'l_knee'], [*q, 0.0]),
        'others': (names[:_LEGS_AT], q[:_LEGS_AT]),
        'left': (names[left], q[left]),
        'right': (names[right], q[right]),
    }
