"""What the node says of itself once a second on /diagnostics: one status per chain."""

from __future__ import annotations

from collections import Counter
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from icub_leg_fk.ros.joint_input import ChainCounts, MESSAGE_REASONS
from icub_leg_fk.ros.joint_stream import JointStream
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

_PERIOD = 1.0  # s
_WORDS = {
    'missing_joint': 'missing', 'stale_joint': 'stale', 'non_finite': 'not finite',
    'out_of_range': 'out of the documented range', 'no_velocity': 'without velocity',
}


class Diagnostics:
    """Publishes the state of a joint stream, on the steady clock.

    Args:
        node: the node to speak for.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._timer = node.create_timer(_PERIOD, self._publish,
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._stream: JointStream | None = None
        self._poses: Counter[str] = Counter()
        self._held_back: dict[str, Counter[str]] = {}
        self._last = time.monotonic()
        self._messages = 0
        self._rejected: Counter[str] = Counter()

    def watch(self, stream: JointStream) -> None:
        """Speak of this stream from now on."""
        self._stream = stream

    def _publish(self) -> None:
        if self._stream is None:
            return
        joint_input = self._stream.settle()
        now = time.monotonic()
        period, self._last = now - self._last, now
        messages = joint_input.messages - self._messages
        rejected = joint_input.counts - self._rejected
        self._messages, self._rejected = joint_input.messages, Counter(joint_input.counts)
        stamp = self._node.get_clock().now()
        age = ('' if joint_input.newest is None
               else f'{(stamp.nanoseconds - joint_input.newest) / 1e9:.3f}')
        array = DiagnosticArray()
        array.header.stamp = stamp.to_msg()
        for index, chain in enumerate(joint_input.chains):
            counts = joint_input.take_counts(index)
            self._poses[chain.name] += counts.ready
            held_back = self._held_back.setdefault(chain.name, Counter())
            held_back.update(counts.held_back)
            known = joint_input.known_joints(index)
            missing = [name for name in chain.joint_names if name not in known]
            level, message = _verdict(messages, rejected, counts, missing)
            values = {
                'version': chain.version,
                'rate (Hz)': f'{counts.ready / period:.1f}',
                'age (s)': age,
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


def _verdict(messages: int, rejected: Counter[str], counts: ChainCounts,
             missing: list[str]) -> tuple[bytes, str]:
    """Return level and message of one chain, from what happened since the last time."""
    if messages == 0:
        return DiagnosticStatus.STALE, 'no JointState received'
    concerns = [f'{_WORDS[reason]}: {_listed(joints)}'
                for reason, joints in sorted(counts.joints.items())]
    # An empty position is counted only, unless nothing else comes.
    worth_telling = [f'{reason} {count}' for reason, count in sorted(rejected.items())
                     if counts.ready == 0 or reason != 'empty_position']
    if worth_telling:
        concerns.append('messages: ' + ', '.join(worth_telling))
    if counts.ready == 0:
        if missing and 'missing_joint' not in counts.joints:
            concerns.insert(0, f'missing: {", ".join(missing)}')
        why = '; '.join(concerns) or 'no message with joints of this chain'
        return DiagnosticStatus.ERROR, f'no pose: {why}'
    if concerns:
        return DiagnosticStatus.WARN, '; '.join(concerns)
    return DiagnosticStatus.OK, 'poses go out'


def _listed(joints: dict[str, str]) -> str:
    return ', '.join(f'{name} {what}' for name, what in joints.items())
