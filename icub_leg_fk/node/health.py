"""The node's health: one look a second, shown twice, in diagnostics and in the log."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
import time
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from icub_leg_fk.node.outputs import pose_topic
from icub_leg_fk.stream.cdr import JOINT_STATE
from icub_leg_fk.stream.configuration import Configuration
from icub_leg_fk.stream.description import Description, UNUSABLE
from icub_leg_fk.stream.joint_input import (
    ChainLook,
    HOLD_BACK,
    JointInput,
    Look,
    REJECTIONS,
    TIME_JUMP,
)
from icub_leg_fk.stream.notes import ERROR, INFO, joints_found, Note, notes_of
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

POSE_STAMPED = 'geometry_msgs/msg/PoseStamped'
STRING = 'std_msgs/msg/String'
PATIENCE = 5  # looks that some notes must last before they are logged

_PERIOD = 1.0  # s from look to look
_THROTTLE = 5.0  # s between two lines in the log for one reason
_PATIENT = (
    'silence',
    'no_match',
    'always_empty',
    'no_clock',
    'same_name',
    'no_description',
)
_THROTTLED = (
    'malformed',
    'position_length',
    'duplicate_name',
    'missing_joint',
    'stale_joint',
    'non_finite',
    'no_velocity',
)
_NOT_LOGGED = ('out_of_range', UNUSABLE)


class Surroundings(NamedTuple):
    """What is around the node at a look.

    Attributes:
        topic: full name of the topic the joint states come from.
        publishers: full names of the nodes that publish joint states on it.
        other_types: what else is published on it.
        silence: time since the last message, or since the start [s].
        has_time: whether the node's clock runs; simulated time may not have begun.
        name: full name of the node.
        pose_publishers: full names of the nodes that publish on its first topic.
    """

    topic: str
    publishers: Sequence[str]
    other_types: Sequence[str]
    silence: float
    has_time: bool
    name: str
    pose_publishers: Sequence[str]

    def publisher_count(self) -> str:
        """Return how many publishers the topic has, in words."""
        count = len(self.publishers)
        if count == 0 and self.other_types:
            return f'no publisher of this type, only of {", ".join(self.other_types)}'
        return f'{count or "no"} publisher{"s" * (count > 1)}'


class Totals(defaultdict[str, Counter[str]]):
    """What has been counted since the start, by chain; of all messages under an empty name."""

    def __init__(self) -> None:
        super().__init__(Counter)

    def add(self, look: Look) -> None:
        """Add what has happened since the last look."""
        self[''].update(look.rejected, messages=look.messages)
        for name, chain_look in look.chains.items():
            self[name].update(chain_look.held_back, poses=chain_look.ready)


class Health:
    """Takes a look at the joint input once a second, on the steady clock, and shows what it finds.

    Args:
        node: the node to speak for.
        joint_input: the joint input.
        topic: full name of the topic the joint states come from.
        description: the description of the robot.
    """

    def __init__(
        self, node: Node, joint_input: JointInput, topic: str, description: Description
    ) -> None:
        self._node = node
        self._input = joint_input
        self._topic = topic
        self._description = description
        self._log = HealthLog(node.get_logger())
        self._totals = Totals()
        self._announcement: Sequence[Note] = ()
        self._announced: Sequence[Note] = ()
        self._last_look = self._last_message = time.monotonic()
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._timer = node.create_timer(
            _PERIOD, self._show, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def configure(
        self, configuration: Configuration, announcement: Sequence[Note]
    ) -> None:
        """Take in what is published, and what there is to say of it; the next look says it.

        `ros2 param load` sets one parameter after the other.
        """
        self._configuration = configuration
        self._announcement = announcement

    def say_announcement(self) -> None:
        """Say what is new of the configuration."""
        for note in self._announcement:
            if note not in self._announced:
                self._log.write(note)
        self._announced = self._announcement

    def _show(self) -> None:
        """Look at what has happened since the last look, and show it."""
        self.say_announcement()
        look = self._input.take_look()
        now = time.monotonic()
        period, self._last_look = now - self._last_look, now
        if look.messages:
            self._last_message = now
        around = self._surroundings(silence=now - self._last_message)
        describers = self._publishers_of(self._description.topic, STRING)
        notes = [
            *notes_around(look, around, self._totals),
            *notes_of(look, self._topic, self._configuration.joint_prefix),
            *self._description.notes(describers),
        ]
        self._totals.add(look)
        self._log.show(notes, look)
        array = DiagnosticArray()
        array.header.stamp = self._node.get_clock().now().to_msg()
        for name in (*look.chains, *self._configuration.awaited):
            level, message = verdict(look, name, notes)
            status = DiagnosticStatus(level=level, message=message)
            status.name = f'{around.name.lstrip("/")}: {name}'
            if name in look.chains:
                chain_look = look.chains[name]
                status.hardware_id = f'{name}={chain_look.chain.version}'
                status.values = self._values(chain_look, period, around)
            array.status.append(status)
        self._publisher.publish(array)

    def _surroundings(self, silence: float) -> Surroundings:
        """Return what is around the node."""
        node = self._node
        infos = node.get_publishers_info_by_topic(self._topic)
        types = {info.topic_type for info in infos}
        pose_publishers = []
        for chain in self._input.chains[:1]:
            own_topic = node.resolve_topic_name(pose_topic(chain))
            pose_publishers = self._publishers_of(own_topic, POSE_STAMPED)
        return Surroundings(
            topic=self._topic,
            publishers=self._publishers_of(self._topic, JOINT_STATE),
            other_types=sorted(types - {JOINT_STATE}),
            silence=silence,
            has_time=node.get_clock().now().nanoseconds > 0,
            name=node.get_fully_qualified_name(),
            pose_publishers=pose_publishers,
        )

    def _publishers_of(self, topic: str, message_type: str) -> list[str]:
        """Return the full names of the nodes that publish messages of a type on a topic."""
        infos = self._node.get_publishers_info_by_topic(topic)
        return sorted(
            f'{info.node_namespace.rstrip("/")}/{info.node_name}'
            for info in infos
            if info.topic_type == message_type
        )

    def _values(
        self, chain_look: ChainLook, period: float, around: Surroundings
    ) -> list[KeyValue]:
        """Return the values of a chain's status."""
        chain = chain_look.chain
        stamps = self._input.held_stamps(chain).values()
        now = self._node.get_clock().now().nanoseconds
        of_all, of_chain = self._totals[''], self._totals[chain.name]
        values = {
            'version': chain.version,
            'rate (Hz)': f'{chain_look.ready / period:.1f}',
            'age (s)': f'{(now - max(stamps)) / 1e9:.3f}' if stamps else '',
            'topic': self._topic,
            'publishers': len(around.publishers),
            'description': self._description.value(chain.name),
            'messages': of_all['messages'],
            'poses': of_chain['poses'],
        }
        for reason in (*REJECTIONS, TIME_JUMP):
            values[reason] = of_all[reason]
        for reason in HOLD_BACK:
            if reason in of_chain:
                values[reason] = of_chain[reason]
        for reason, joints in sorted(chain_look.joints.items()):
            values[f'{reason} joints'] = joints_found(reason, joints)
        return [KeyValue(key=key, value=str(value)) for key, value in values.items()]


class HealthLog:
    """Logs each note once, and again only after it has been well in between.

    Rejected messages and those that give no pose are logged every five seconds as long as there
    are any. A step back in time is an event of its own, and logged each time.

    Args:
        logger: what logs, such as that of a node.
    """

    def __init__(self, logger: Any) -> None:
        self._logger = logger
        self._throttled = {key: logger.get_child(key) for key in _THROTTLED}
        self._looks: Counter[tuple[str, str]] = Counter()  # for which a note has lasted

    def show(self, notes: Sequence[Note], look: Look) -> None:
        """Log what is worth it of the notes of a look."""
        for note in notes:
            self._looks[note.key, note.chain] += 1
            if self._is_due(note):
                self.write(note)
        for key, logger in self._throttled.items():
            texts = [str(note) for note in notes if note.key == key]
            if texts:
                logger.warning('; '.join(texts), throttle_duration_sec=_THROTTLE)
        if look.messages:  # else nothing is known
            lasting = {(note.key, note.chain) for note in notes}
            self._looks = Counter({key: self._looks[key] for key in lasting})

    def write(self, note: Note) -> None:
        """Log a note."""
        if note.level == INFO:
            self._logger.info(str(note))
        elif note.level == ERROR:
            self._logger.error(str(note))
        else:
            self._logger.warning(str(note))

    def _is_due(self, note: Note) -> bool:
        if note.key in _NOT_LOGGED or note.key in _THROTTLED:
            return False
        if note.key == TIME_JUMP:
            return True
        patience = PATIENCE if note.key in _PATIENT else 1
        return self._looks[note.key, note.chain] == patience


def notes_around(look: Look, around: Surroundings, before: Totals) -> Iterator[Note]:
    """Yield what there is to say of the node's surroundings.

    Args:
        look: what has happened since the last look.
        around: what is around the node.
        before: what had happened until then.
    """
    count = around.publisher_count()
    if look.messages == 0:
        messages = before['']['messages']
        counted = f', {messages} before' if messages else ''
        text = (
            f'no JointState received on {around.topic} for {around.silence:.0f} s{counted}'
            f'; it has {count}'
        )
        yield Note('silence', text)
    for name, chain_look in look.chains.items():
        if chain_look.ready and not before[name]['poses']:
            text = f'first pose of {chain_look.chain.tip}; {count} on {around.topic}'
            yield Note(f'first pose of {name}', text, level=INFO)
    if look.messages > 1 and len(around.publishers) > 1:
        yield Note('publishers', f'{count} on {around.topic}', level=INFO)
        yield from _of_same_joints(look, around)
    if not around.has_time:
        yield Note('no_clock', 'use_sim_time is set, but no time has come on /clock')
    if around.pose_publishers.count(around.name) > 1:
        text = (
            f'another node is called {around.name} and publishes the same topics; give one '
            'of them another name: --ros-args -r __node:=NAME'
        )
        yield Note('same_name', text)


def _of_same_joints(look: Look, around: Surroundings) -> Iterator[Note]:
    """Warn if several publishers seem to bring the joints of one chain."""
    for name, chain_look in look.chains.items():
        if chain_look.ready + chain_look.silent == look.messages:
            text = (
                f'every message on {around.topic} brings its joints, and it has '
                f'{around.publisher_count()}: {", ".join(around.publishers)}'
            )
            yield Note('same_joints', text, name)


def verdict(look: Look, chain: str, notes: Sequence[Note]) -> tuple[bytes, str]:
    """Return level and message of the status of a chain, which may wait for a description."""
    serious = [
        note for note in notes if note.chain in ('', chain) and note.level != INFO
    ]
    message = '; '.join(note.text for note in serious)
    if any(note.level == ERROR for note in serious):
        return DiagnosticStatus.ERROR, message
    if look.messages == 0 or chain not in look.chains:
        return DiagnosticStatus.STALE, message
    if look.chains[chain].ready == 0:
        nothing = 'no message with a position of its joints'
        return DiagnosticStatus.ERROR, message or nothing
    if message:
        return DiagnosticStatus.WARN, message
    return DiagnosticStatus.OK, 'publishing'
