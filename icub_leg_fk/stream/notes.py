"""What there is to say of a joint input, as plain data: free of rclpy, and of how it is shown.

The node shows it once a second, in diagnostics and log; a command at the end of a recording.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
import math
import re
from typing import NamedTuple

from icub_leg_fk.stream.joint_input import ChainLook, Look, TIME_JUMP

INFO, WARNING = 'info', 'warning'

_NAMES_SHOWN = 12
_LONGEST_SHOWN = 40  # characters of a name
_MANY_JUMPS = 3
_RARE = 20  # messages for each step back, in a recording that is played in a loop
_WORDS = {
    'missing_joint': 'never seen',
    'stale_joint': '{:.3f} s old',
    'non_finite': '{}',
    'no_velocity': '{}',
    'out_of_range': '{:.6g}',
    'looks_like_degrees': '{:.6g}',
}
"""What is said of a joint, by reason."""


class Note(NamedTuple):
    """One thing that is worth a line.

    Attributes:
        key: what it is about, such as `stale_joint`: the same as long as it lasts.
        chain: name of the chain that it is about; empty if it is about all messages.
        level: INFO or WARNING.
        text: what there is to say, in a line that does not name the chain.
    """

    key: str
    chain: str
    level: str
    text: str

    def __str__(self) -> str:
        return f'{self.chain}: {self.text}' if self.chain else self.text


def notes_of(look: Look, topic: str = '') -> list[Note]:
    """Return what there is to say of what happened since the last look.

    Args:
        look: what happened.
        topic: the topic on which the messages came; empty if they came otherwise.
    """
    on_topic = f' on {topic}' if topic else ''
    notes = [*_of_messages(look, on_topic)]
    for chain_look in look.chains.values():
        notes += _of_chain(chain_look)
        notes += _of_frame_ids(look, chain_look)
        notes += _of_names(look, chain_look, on_topic)
    return notes


def names_that_came(look: Look) -> str:
    """Return the joint names that came, as many as fit a line."""
    names = [repr(name)[1:-1][:_LONGEST_SHOWN] for name in look.names]
    if len(names) > _NAMES_SHOWN:
        names[_NAMES_SHOWN:] = ['...']
    return ', '.join(names) or 'none'


def listed(reason: str, joints: Mapping[str, float]) -> str:
    """Return the joints that a reason concerns, with what was found of each."""
    return ', '.join(f'{joint} {_found(reason, value)}' for joint, value in joints.items())


def _found(reason: str, value: float) -> str:
    if reason == 'no_velocity' and math.isnan(value):
        return 'unknown'
    return _WORDS[reason].format(value)


def _of_messages(look: Look, on_topic: str) -> Iterator[Note]:
    for reason in ('malformed', 'position_length', 'duplicate_name'):
        if count := look.rejected[reason]:
            yield Note(reason, '', WARNING,
                       f'{_messages(count)} rejected: {look.faults[reason]}')
    if look.messages and look.rejected['empty_position'] == look.messages:
        yield Note('always_empty', '', WARNING,
                   f'no message{on_topic} has positions: position is empty')
    if jumps := look.rejected[TIME_JUMP]:
        yield _of_time(jumps, look.messages, look.faults[TIME_JUMP])


def _of_time(jumps: int, messages: int, where: str) -> Note:
    """Tell a recording that is played in a loop from publishers that contradict each other."""
    if jumps >= _MANY_JUMPS and jumps * _RARE > messages:
        return Note('many_time_jumps', '', WARNING,
                    f'time stepped back {jumps} times in {messages} messages, last to {where}: '
                    'do several publishers bring the same joints?')
    times = f' {jumps} times, last' if jumps > 1 else ''
    return Note(TIME_JUMP, '', WARNING,
                f'time stepped back{times} to {where}; held joints are forgotten')


def _of_chain(look: ChainLook) -> Iterator[Note]:
    def note(reason: str, words: str) -> Note:
        return Note(reason, look.chain.name, WARNING,
                    words + listed(reason, look.joints[reason]))

    for reason in ('missing_joint', 'stale_joint', 'non_finite'):
        if count := look.held_back[reason]:
            yield note(reason, f'no pose from {_messages(count)}: ')
    if count := look.held_back['no_velocity']:
        yield note('no_velocity', f'no twist from {_messages(count)}: velocity of ')
    if 'looks_like_degrees' in look.joints:
        yield note('looks_like_degrees', 'positions look like degrees, radians are expected: ')
    if 'out_of_range' in look.joints:
        yield note('out_of_range', 'out of range: ')


def _of_frame_ids(look: Look, chain_look: ChainLook) -> Iterator[Note]:
    """Warn of joints that come under several frame ids: they may be those of several robots."""
    for joint in chain_look.chain.joint_names:
        frame_ids = [repr(name) for name, joints in look.frame_ids.items() if joint in joints]
        if len(frame_ids) > 1:
            yield Note('frame_ids', chain_look.chain.name, WARNING,
                       f'{joint} comes under the frame ids {" and ".join(frame_ids)}: from '
                       f'{len(frame_ids)} robots?')
            return


def _of_names(look: Look, chain_look: ChainLook, on_topic: str) -> Iterator[Note]:
    """Warn if no joint of a chain has come."""
    chain = chain_look.chain
    if not look.names or not look.joints.isdisjoint(chain.joint_names):
        return
    text = (f'no message{on_topic} has one of its joints ({", ".join(chain.joint_names)}); names '
            f'that came: {names_that_came(look)}')
    pair = _near(chain.joint_names, look.names)
    if pair:
        name, joint = pair
        text += f'; {name!r} is nearly {joint!r}, but names must be equal'
    yield Note('no_match', chain.name, WARNING, text)


def _near(joints: Sequence[str], names: Iterable[str]) -> tuple[str, str] | None:
    """Return the first name that is a joint's but for capitals and what is put before or after."""
    any_joint = '|'.join(re.escape(joint) for joint in joints)
    pattern = re.compile(rf'(?:.*[^a-z0-9])?({any_joint})(?:[^a-z0-9].*)?', re.I | re.S)
    for name in names:
        match = pattern.fullmatch(name)
        if match:
            joint = next(joint for joint in joints if joint.lower() == match[1].lower())
            return name, joint
    return None


def _messages(count: int) -> str:
    return f'{count} message{"s" * (count != 1)}'
