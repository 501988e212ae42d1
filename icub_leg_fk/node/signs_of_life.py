"""What the log says of the node's work: what it publishes, and why nothing comes; rclpy-free."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
import re
import time
from typing import Any

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.stream.joint_input import ChainCounts

PATIENCE = 5  # s without what is expected, before it is worth a warning
JOINT_STATE = 'sensor_msgs/msg/JointState'
_NAMES_SHOWN = 12
_LONGEST_NEAR = 100  # characters of a name that may be meant for a joint's
_PERIOD = 5.0  # s between two warnings for one reason

_Lines = tuple[tuple[str, ...], tuple[str, ...]]  # to be known, to be warned of


@dataclass(frozen=True)
class Second:
    """What happened since the last look, a second ago.

    Attributes:
        messages: messages received.
        messages_before: messages received before.
        silence: time since the last message, or since the start [s].
        rejected: messages by reason.
        chains: each chain with what happened to it.
        names: the joint names that came.
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
        """List the joint names that came, as many as fit a line."""
        shown = ', '.join(repr(name)[1:-1][:40] for name in self.names[:_NAMES_SHOWN]) or 'none'
        more = len(self.names) - _NAMES_SHOWN
        return f'{shown} and {more} more' if more > 0 else shown

    def publishers(self) -> str:
        """Say how many publish joint states on the topic, and what else is published there."""
        count = self.types.count(JOINT_STATE)
        counted = f'{count or "no"} publisher{"s" * (count > 1)}'
        foreign = ', '.join(sorted(set(self.types) - {JOINT_STATE}))
        return f'{counted}, but one of type {foreign}' if foreign else counted


class SignsOfLife:
    """Logs each thing once, and again only after it has been well in between.

    Args:
        logger: what logs, such as that of a node.
        topic: full name of the topic the joint states come from.
    """

    def __init__(self, logger: Any, topic: str) -> None:
        self._logger = logger
        self._topic = topic
        self._configuration: _Lines = (), ()
        self._said_configuration: _Lines = (), ()
        self._said: set[str] = set()
        self._seconds: Counter[str] = Counter()

    def configured(self, lines: Sequence[str], warnings: Sequence[str]) -> None:
        """Take what there is to say of the configuration, and say it if it is the first.

        What changes later is said with the next look: `ros2 param load` sets one parameter after
        the other.
        """
        self._configuration = tuple(lines), tuple(warnings)
        if self._said_configuration == ((), ()):
            self._say_configuration()

    def look(self, second: Second) -> None:
        """Log what is worth it."""
        self._say_configuration()
        before = f', {second.messages_before} before' if second.messages_before else ''
        self._warn('silence', second.silence >= PATIENCE, lambda: (
            f'no JointState on {self._topic} for {second.silence:.0f} s{before}; '
            f'{second.publishers()} there'))
        several = second.types.count(JOINT_STATE) > 1
        if several and second.messages:
            self._once('several', f'{second.publishers()} on {self._topic}')
        self._warn('steps back', several and second.rejected['time_jump'] > 0, lambda: (
            f'{second.publishers()} on {self._topic}, and their stamps step back: do they bring '
            'the same joints?'))
        if second.messages:
            empty = second.rejected['empty_position'] == second.messages
            self._warn('empty', empty, lambda: (
                f'no message on {self._topic} has positions: position is empty'), PATIENCE)
        for chain, counts in second.chains:
            self._look_at(second, chain, counts)

    def _look_at(self, second: Second, chain: Chain, counts: ChainCounts) -> None:
        name = chain.name
        if counts.ready:
            publishers = f'; {second.publishers()} on {self._topic}' if second.types else ''
            self._once(f'{name} first', f'first pose of {chain.tip}{publishers}')
        if second.messages > second.rejected['malformed']:
            foreign = set(chain.joint_names).isdisjoint(second.names)
            self._warn(f'{name} foreign', foreign, lambda: (
                f'no message on {self._topic} has a joint of {name} '
                f'({", ".join(chain.joint_names)}); names that came: {second.names_that_came()}'
                f'{_near(chain, second.names)}'), PATIENCE)
        degrees = counts.joints.get('looks_like_degrees', {})
        # Well again is only a chain that moves within its range.
        if degrees or counts.ready:
            self._warn(f'{name} degrees', bool(degrees), lambda: (
                f'{name}: positions look like degrees, radians are expected: '
                + ', '.join(f'{joint} {value}' for joint, value in degrees.items())))

    def _say_configuration(self) -> None:
        (lines, warnings), said = self._configuration, self._said_configuration
        self._said_configuration = self._configuration
        if warnings != said[1]:
            for line in warnings:
                self._logger.warning(line)
        if lines != said[0]:
            for line in lines:
                self._logger.info(line)

    def _once(self, key: str, text: str) -> None:
        if key not in self._said:
            self._said.add(key)
            self._logger.info(text)

    def _warn(self, key: str, is_so: bool, text: Callable[[], str], patience: int = 0) -> None:
        """Warn of what is so, for as many seconds in which messages came."""
        if not is_so:
            self._said.discard(key)
            self._seconds[key] = 0
            return
        self._seconds[key] += 1
        if self._seconds[key] >= patience and key not in self._said:
            self._said.add(key)
            self._logger.warning(text())


class ThrottledWarnings:
    """Passes on at most one warning per reason and period, and says how many it held back.

    Args:
        warn: called with the text of a warning.
    """

    def __init__(self, warn: Callable[[str], object]) -> None:
        self._warn = warn
        self._last: dict[str, float] = {}
        self._held_back: dict[str, int] = {}

    def __call__(self, reason: str, text: str) -> None:
        """Warn, unless this reason has been warned about a moment ago."""
        now = time.monotonic()
        if now - self._last.get(reason, -_PERIOD) < _PERIOD:
            self._held_back[reason] = self._held_back.get(reason, 0) + 1
            return
        self._last[reason] = now
        more = self._held_back.pop(reason, 0)
        self._warn(f'{reason}: {text}' + (f' (and {more} more)' if more else ''))


def _near(chain: Chain, names: Sequence[str]) -> str:
    """Say which name is a chain's but for capitals, or what stands before or behind it."""
    for name in (name for name in names if len(name) <= _LONGEST_NEAR):
        for joint in chain.joint_names:
            if re.fullmatch(rf'(.*[^a-z0-9])?{re.escape(joint)}([^a-z0-9].*)?', name,
                            re.IGNORECASE | re.DOTALL):
                return f'; {name!r} is nearly {joint!r}, but names must be equal'
    return ''
