"""What the log says of the joint states: the first poses, and why there are none; rclpy-free."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.ros.joint_input import ChainCounts

PATIENCE = 5.0  # s without what is expected, before it is worth a warning
JOINT_STATE = 'sensor_msgs/msg/JointState'
_NAMES_SHOWN = 12


@dataclass(frozen=True)
class Second:
    """What happened since the last look, a second ago.

    Attributes:
        messages: messages received.
        messages_before: messages received before.
        silence: time since the last message, or since the start [s].
        rejected: messages by reason.
        chains: each chain with what happened to it.
        names: the joint names of the last message.
        types: the message type of each publisher on the topic.
    """

    messages: int
    messages_before: int
    silence: float
    rejected: Counter[str]
    chains: Sequence[tuple[Chain, ChainCounts]]
    names: Sequence[str]
    types: Sequence[str]

    def names_that_came(self) -> str:
        """List the names of the last message, as many as fit a line."""
        shown = ', '.join(repr(name)[1:-1][:40] for name in self.names[:_NAMES_SHOWN]) or 'none'
        more = len(self.names) - _NAMES_SHOWN
        return f'{shown} and {more} more' if more > 0 else shown

    def foreign_types(self) -> str:
        """Say that somebody publishes another type on the topic, if so."""
        foreign = sorted(set(self.types) - {JOINT_STATE})
        return f'; a publisher there has the type {", ".join(foreign)}' if foreign else ''


class SignsOfLife:
    """Logs each thing once, and again only after it has been well in between.

    Args:
        logger: what logs, such as that of a node.
        topic: full name of the topic the joint states come from.
    """

    def __init__(self, logger: Any, topic: str) -> None:
        self._logger = logger
        self._topic = topic
        self._said: set[str] = set()
        self._untouched: Counter[str] = Counter()

    def look(self, second: Second) -> None:
        """Log what is worth it."""
        silent = second.silence >= PATIENCE
        self._warn('silence', silent, lambda: self._silence(second))
        several = second.types.count(JOINT_STATE)
        if several > 1 and second.messages and 'several' not in self._said:
            self._said.add('several')
            self._logger.info(f'{several} publishers on {self._topic}')
        self._warn('steps back', several > 1 and second.rejected['time_jump'] > 0, lambda: (
            f'{several} publishers on {self._topic}, and their stamps step back: do they bring '
            'the same joints?'))
        for chain, counts in second.chains:
            self._look_at(second, chain, counts)

    def _look_at(self, second: Second, chain: Chain, counts: ChainCounts) -> None:
        name = chain.name
        if counts.ready and f'{name} first' not in self._said:
            self._said.add(f'{name} first')
            several = len(second.types)
            self._logger.info(f'first pose of {chain.tip}; {several} '
                              f'publisher{"s" * (several != 1)} on {self._topic}')
        if counts.ready or counts.held_back:
            self._untouched[name] = 0
        elif second.messages:
            self._untouched[name] += 1
        self._warn(f'{name} untouched', self._untouched[name] >= PATIENCE, lambda: (
            f'no message on {self._topic} has a joint of {name} ({", ".join(chain.joint_names)}); '
            f'names that came: {second.names_that_came()}{_near(chain, second.names)}'))
        degrees = counts.joints.get('looks_like_degrees', {})
        # Well again is only a chain that moves within its range.
        if degrees or counts.ready:
            self._warn(f'{name} degrees', bool(degrees), lambda: (
                f'{name}: positions look like degrees, radians are expected: '
                + ', '.join(f'{joint} {value}' for joint, value in degrees.items())))

    def _silence(self, second: Second) -> str:
        before = f', {second.messages_before} before' if second.messages_before else ''
        listeners = second.types.count(JOINT_STATE)
        why = second.foreign_types() or (
            f'; {listeners} publisher{"s" * (listeners != 1)} there' if listeners
            else '; nobody publishes there')
        return f'no JointState on {self._topic} for {second.silence:.0f} s{before}{why}'

    def _warn(self, key: str, is_so: bool, text: Any) -> None:
        if not is_so:
            self._said.discard(key)
        elif key not in self._said:
            self._said.add(key)
            self._logger.warning(text())


def _near(chain: Chain, names: Sequence[str]) -> str:
    """Say which names are a chain's but for a prefix or capitals."""
    for name in names:
        for joint in chain.joint_names:
            if name.rsplit('/', 1)[-1].casefold() == joint.casefold():
                return f'; {name!r} is not {joint!r}: names must be equal'
    return ''
