"""What the node says of itself once a second: a status per chain; the signs of life beside it."""

from collections import Counter
from collections.abc import Callable
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from icub_leg_fk.node.signs_of_life import Second, SignsOfLife
from icub_leg_fk.stream.joint_input import ChainCounts, JointInput, MESSAGE_REASONS
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

_PERIOD = 1.0  # s
_WORDS = {
    'missing_joint': 'missing', 'stale_joint': 'stale', 'non_finite': 'not finite',
    'out_of_range': 'out of range', 'no_velocity': 'without velocity',
    'looks_like_degrees': 'looks like degrees',
}


class Diagnostics:
    """Publishes on /diagnostics and logs signs of life, on the steady clock.

    Args:
        node: the node to speak for.
        topic: full name of the topic the joint states come from.
        signs: logs what is worth it of each second.
        state: returns the joint input and when it last got a message [s, monotonic] or None.
    """

    def __init__(self, node: Node, topic: str, signs: SignsOfLife,
                 state: Callable[[], tuple[JointInput, float | None]]) -> None:
        self._node = node
        self._topic = topic
        self._state = state
        self._signs = signs
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._timer = node.create_timer(_PERIOD, self._publish,
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._poses: Counter[str] = Counter()
        self._held_back: dict[str, Counter[str]] = {}
        self._start = self._last = time.monotonic()
        self._messages = 0
        self._rejected: Counter[str] = Counter()

    def _publish(self) -> None:
        joint_input, heard = self._state()
        now = time.monotonic()
        period, self._last = now - self._last, now
        rejected = joint_input.counts - self._rejected
        second = Second(
            messages=joint_input.messages - self._messages,
            messages_before=self._messages,
            silence=now - (self._start if heard is None else heard),
            rejected=rejected,
            chains=[(chain, joint_input.take_counts(index))
                    for index, chain in enumerate(joint_input.chains)],
            names=joint_input.names_since(self._messages),
            types=[info.topic_type
                   for info in self._node.get_publishers_info_by_topic(self._topic)])
        self._messages, self._rejected = joint_input.messages, Counter(joint_input.counts)
        self._signs.look(second)
        stamp = self._node.get_clock().now()
        age = ('' if joint_input.newest is None
               else f'{(stamp.nanoseconds - joint_input.newest) / 1e9:.3f}')
        array = DiagnosticArray()
        array.header.stamp = stamp.to_msg()
        for index, (chain, counts) in enumerate(second.chains):
            self._poses[chain.name] += counts.ready
            held_back = self._held_back.setdefault(chain.name, Counter())
            held_back.update(counts.held_back)
            known = joint_input.known_joints(index)
            missing = [name for name in chain.joint_names if name not in known]
            level, message = _verdict(second, counts, missing)
            values = {
                'version': chain.version,
                'rate (Hz)': f'{counts.ready / period:.1f}',
                'age (s)': age,
                'topic': self._topic,
                'publishers': str(len(second.types)),
                'messages': str(joint_input.messages),
                'poses': str(self._poses[chain.name]),
            }
            values |= {reason: str(joint_input.counts[reason]) for reason in MESSAGE_REASONS}
            values |= {reason: str(count) for reason, count in sorted(held_back.items())}
            values |= {f'{reason} joints': _listed(joints)
                       for reason, joints in sorted(counts.joints.items())}
            array.status.append(DiagnosticStatus(
                level=level, message=message, hardware_id=f'{chain.name} {chain.version}',
                name=f'{self._node.get_fully_qualified_name().lstrip("/")}: {chain.name}',
                values=[KeyValue(key=key, value=value) for key, value in values.items()]))
        self._publisher.publish(array)


def _verdict(second: Second, counts: ChainCounts, missing: list[str]) -> tuple[bytes, str]:
    """Return level and message of one chain, from what happened since the last time."""
    if second.messages == 0:
        before = f', {second.messages_before} before' if second.messages_before else ''
        return DiagnosticStatus.STALE, (
            f'no JointState received: none for {second.silence:.1f} s{before}; '
            f'{second.publishers()}')
    concerns = [f'{_WORDS[reason]}: {_listed(joints)}'
                for reason, joints in sorted(counts.joints.items())]
    # An empty position is counted only, unless nothing else comes.
    messages = [f'{reason} {count}' for reason, count in sorted(second.rejected.items())
                if counts.ready == 0 or reason != 'empty_position']
    if messages:
        concerns.append('messages: ' + ', '.join(messages))
    if counts.ready == 0:
        if missing and 'missing_joint' not in counts.joints:
            concerns.insert(0, f'missing: {", ".join(missing)}; names that came: '
                            f'{second.names_that_came()}')
        why = '; '.join(concerns) or 'no message with joints of this chain'
        return DiagnosticStatus.ERROR, f'no pose: {why}'
    if concerns:
        return DiagnosticStatus.WARN, '; '.join(concerns)
    return DiagnosticStatus.OK, 'publishing'


def _listed(joints: dict[str, str]) -> str:
    return ', '.join(f'{name} {what}' for name, what in joints.items())
