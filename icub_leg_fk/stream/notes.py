"""What there is to say of a joint input, as plain data: free of rclpy, and of how it is shown.

The node shows it once a second, in diagnostics and log; a command at the end of a recording.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
import math
import re
from typing import NamedTuple

from icub_leg_fk.stream.joint_input import ChainLook, Look, TIME_JUMP

INFO = 'info'
WARNING = 'warning'
ERROR = 'error'

_NAMES_SHOWN = 12
_LONGEST_SHOWN = 40  # characters of a name
_MANY_JUMPS = 3
_LOOP = 20  # messages at least in a recording that is played again and again
_NO_POSE = 'no pose from {}: {}'
_OF_JOINTS = {
    'missing_joint': (_NO_POSE, 'never seen'),
    'stale_joint': (_NO_POSE, '{:.3f} s old'),
    'non_finite': (_NO_POSE, '{}'),
    'no_velocity': ('no twist from {}: velocity of {}', '{}'),
    'looks_like_degrees': (
        'positions look like degrees, radians are expected: {1}',
        '{:.6g}',
    ),
    'out_of_range': ('out of range: {1}', '{:.6g}'),
}
"""What is written of the messages and joints that a reason concerns, and of each joint."""


class Note(NamedTuple):
    """One thing that is worth a line.

    Attributes:
        key: what it is about, such as `stale_joint`: the same as long as it lasts.
        text: what there is to say, in a line that does not name the chain.
        chain: name of the chain that it is about; empty if it is about all messages.
        level: INFO, WARNING or ERROR.
    """

    key: str
    text: str
    chain: str = ''
    level: str = WARNING

    def __str__(self) -> str:
        return f'{self.chain}: {self.text}' if self.chain else self.text


def notes_of(
    look: Look,
    topic: str = '',
    joint_prefix: str = '',
    prefix_setting: str = 'joint_prefix:=',
) -> list[Note]:
    """Return what there is to say of what happened since the last look.

    Args:
        look: what happened.
        topic: the topic on which the messages came; empty if they came otherwise.
        joint_prefix: what is before the joint names of the chains.
        prefix_setting: what is written before another such prefix to have it looked for.
    """
    on_topic = f' on {topic}' if topic else ''
    notes = [*_of_messages(look, on_topic)]
    for chain_look in look.chains.values():
        notes += _of_joints(chain_look)
        notes += _of_frame_ids(look, chain_look)
        notes += _of_names(look, chain_look, on_topic, joint_prefix, prefix_setting)
    return notes


def names_that_came(look: Look) -> str:
    """Return the joint names that came, as many as fit a line."""
    names = [repr(name)[1:-1][:_LONGEST_SHOWN] for name in look.names]
    if len(names) > _NAMES_SHOWN:
        names[_NAMES_SHOWN:] = ['...']
    return ', '.join(names) or 'none'


def joints_found(reason: str, joints: Mapping[str, float]) -> str:
    """Return the joints that a reason concerns, with what was found of each."""
    _, text = _OF_JOINTS[reason]
    words = []
    for joint, value in joints.items():
        is_unknown = reason == 'no_velocity' and math.isnan(value)
        found = 'unknown' if is_unknown else text.format(value)
        words.append(f'{joint} {found}')
    return ', '.join(words)


def _of_messages(look: Look, on_topic: str) -> Iterator[Note]:
    for reason in ('malformed', 'position_length', 'duplicate_name'):
        count = look.rejected[reason]
        if count:
            text = f'{_messages(count)} rejected: {look.faults[reason]}'
            yield Note(reason, text)
    if look.messages and look.rejected['empty_position'] == look.messages:
        text = f'no message{on_topic} has positions: position is empty'
        yield Note('always_empty', text)
    jumps = look.rejected[TIME_JUMP]
    where = look.faults.get(TIME_JUMP)
    if jumps >= _MANY_JUMPS and jumps * _LOOP > look.messages:
        yield Note(
            'many_time_jumps',
            f'time stepped back {jumps} times in {look.messages} messages, last to {where}: '
            'do several publishers bring the same joints?',
        )
    elif jumps:
        times = f' {jumps} times, last' if jumps > 1 else ''
        text = f'time stepped back{times} to {where}; held joints are forgotten'
        yield Note(TIME_JUMP, text)


def _of_joints(look: ChainLook) -> Iterator[Note]:
    for reason, (text, _) in _OF_JOINTS.items():
        if reason in look.joints:
            messages = _messages(look.held_back[reason])
            joints = joints_found(reason, look.joints[reason])
            yield Note(reason, text.format(messages, joints), look.chain.name)


def _of_frame_ids(look: Look, chain_look: ChainLook) -> Iterator[Note]:
    """Yield a warning of a joint that comes under several frame ids."""
    for joint in chain_look.chain.joint_names:
        frame_ids = [
            repr(name) for name, joints in look.frame_ids.items() if joint in joints
        ]
        if len(frame_ids) > 1:
            text = (
                f'{joint} comes under the frame ids {" and ".join(frame_ids)}: from '
                f'{len(frame_ids)} robots?'
            )
            yield Note('frame_ids', text, chain_look.chain.name)
            return


def _of_names(
    look: Look,
    chain_look: ChainLook,
    on_topic: str,
    joint_prefix: str,
    prefix_setting: str,
) -> Iterator[Note]:
    """Yield a warning if no joint of a chain has come."""
    joints = chain_look.chain.joint_names
    if not look.names or not look.joints.isdisjoint(joints):
        return
    hint = name_hint(joints, look.names, joint_prefix, prefix_setting)
    text = (
        f'no message{on_topic} has one of its joints ({", ".join(joints)}); names that came: '
        f'{names_that_came(look)}{hint}'
    )
    yield Note('no_match', text, chain_look.chain.name)


def name_hint(
    joints: Sequence[str],
    names: Iterable[str],
    joint_prefix: str,
    prefix_setting: str,
) -> str:
    """Return what may help where no name is that of a joint; empty if nothing is like one.

    Args:
        joints: names of joints.
        names: names that came.
        joint_prefix: what is before the names of the joints.
        prefix_setting: what is written before another such prefix to have it looked for.
    """
    bare = [joint.removeprefix(joint_prefix) for joint in joints]
    pair = _near(bare, names)
    if not pair:
        return ''
    name, joint = pair
    if name.endswith(joint):
        prefix = name.removesuffix(joint) or '""'
        return f'; {name!r} is looked for with {prefix_setting}{prefix}'
    return f'; {name!r} is nearly {joint_prefix + joint!r}, but names must be equal'


def _near(joints: Sequence[str], names: Iterable[str]) -> tuple[str, str] | None:
    """Return the first name that is a joint's but for capitals and what is put before or after."""
    by_lower = {joint.lower(): joint for joint in joints}
    any_joint = '|'.join(map(re.escape, by_lower))
    pattern = re.compile(rf'(?:.*[^a-z0-9])?({any_joint})(?:[^a-z0-9].*)?', re.DOTALL)
    for name in names:
        match = pattern.fullmatch(name.lower())
        if match:
            return name, by_lower[match[1]]
    return None


def _messages(count: int) -> str:
    return f'{count} message{"s" * (count != 1)}'
