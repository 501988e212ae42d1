"""Copies one bag with its foot poses: reader, poses, writer."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
import math
import os
from pathlib import Path
import sqlite3
import time

from icub_leg_fk.errors import InputFileError, OutputFileError
from icub_leg_fk.ros.configuration import Configuration
from icub_leg_fk.tools.bags.mcap_writer import McapWriter
from icub_leg_fk.tools.bags.metadata import as_yaml, describe, METADATA, metadata_file_text
from icub_leg_fk.tools.bags.output import output_place
from icub_leg_fk.tools.bags.poses import pose_topics, PoseAdder
from icub_leg_fk.tools.bags.reader import BagReader, KINDS
from icub_leg_fk.tools.bags.sqlite_writer import SqliteWriter
from icub_leg_fk.tools.bags.topics import JOINT_STATE, Message, TF, Topic

OnProgress = Callable[[float], None]
"""Called with the share that is done, 0 to 1."""


@dataclass(frozen=True)
class Conversion:
    """What to do with a bag.

    Attributes:
        configuration: chains and what is added for them.
        joint_topic: the topic of joint states.
        only_poses: whether the bag's own messages are left out.
        storage: `mcap` or `sqlite3`; as in the bag if empty.
        force: whether an existing bag may be replaced.
    """

    configuration: Configuration
    joint_topic: str
    only_poses: bool = False
    storage: str = ''
    force: bool = False


@dataclass(frozen=True)
class Summary:
    """What has been done.

    Attributes:
        target: the bag that was made.
        copied: messages copied.
        added: messages added, by topic.
        joint_states: messages of joint states.
        rejected: messages of joint states rejected as a whole, by reason.
        held_back: messages that gave a chain no pose, by chain and reason, with the joints.
        damage: what of the input could not be read.
        notes: what else is worth knowing.
        recorded: length of the recording [s].
        took: how long it took [s].
    """

    target: str
    copied: int
    added: dict[str, int]
    joint_states: int
    rejected: dict[str, int]
    held_back: dict[str, dict[str, tuple[int, str]]]
    damage: list[str]
    notes: list[str]
    recorded: float
    took: float


def convert(source: Path, target: Path, conversion: Conversion,
            on_progress: OnProgress) -> Summary:
    """Copy a bag and add the foot poses.

    Args:
        source: the bag to read.
        target: the bag to make: a directory, or a file if its name ends in .mcap or .db3.
        conversion: what to do.
        on_progress: called now and then.

    Raises:
        InputFileError: there is nothing to read, or no topic of joint states.
        OutputFileError: the target exists, overlaps with the source, or cannot be written.
    """
    target = Path(os.path.abspath(target))
    _check_apart(source, target)
    began = time.monotonic()
    with output_place(target, conversion.force) as place:
        bag = BagReader(source, place.scratch)
        job = _Job(bag, conversion)
        storage = _storage(target, conversion.storage) or bag.storage
        file = _storage_file(place.bag, storage)
        try:
            with _writer(storage, file, job.topics, bag.compression) as writer:
                for block in job.blocks(on_progress):
                    writer.write(block)
                writer.flush()
                description = describe(storage, file.name, job.topics, writer.counts,
                                       writer.start, writer.end, bag.custom_data)
                writer.close(as_yaml(description))
        except sqlite3.Error as error:
            raise OutputFileError(f'{target}: cannot be written: {error}') from error
        if file != place.bag:
            (place.bag / METADATA).write_text(metadata_file_text(description))
        place.put()
    return job.summary(str(target), writer.counts, time.monotonic() - began)


class _Job:
    """A bag, the poses that join it, and what becomes known on the way."""

    def __init__(self, bag: BagReader, conversion: Conversion) -> None:
        self._bag = bag
        self._notes = conversion.configuration.notes
        joint_topics = _joint_topics(bag, conversion.joint_topic)
        self._wanted = set(joint_topics) if conversion.only_poses else set(range(len(bag.topics)))
        added = pose_topics(conversion.configuration, bag.topics[joint_topics[0]])
        old = [] if conversion.only_poses else bag.topics
        self._old = len(old)
        self.topics = [*old, *_not_yet_there(bag, old, added)]
        self._adder = PoseAdder(conversion.configuration, self.topics, joint_topics,
                                keep=not conversion.only_poses)
        self._start, self._end = math.inf, -math.inf

    def blocks(self, on_progress: OnProgress) -> Iterator[list[Message]]:
        """Yield the messages of the new bag, some at a time."""
        for block in self._bag.blocks(self._wanted):
            if block:
                self._start = min(self._start, block[0][2])
                self._end = max(self._end, block[-1][2])
            yield self._adder.add(block)
            on_progress(self._bag.progress)

    def summary(self, target: str, counts: Sequence[int], took: float) -> Summary:
        """Return what has been done."""
        joint_input = self._adder.settle()
        added = self._adder.added
        notes = list(self._notes)
        if self._bag.attachments:
            notes.append(f'{self._bag.attachments} MCAP attachments are not copied')
        if self._bag.late:
            notes.append(f'{self._bag.late} messages stay behind others that were recorded after '
                         'them: they are too far out of order to be sorted')
        return Summary(
            target=target,
            copied=sum(counts) - sum(added.values()),
            added={topic.name: added[index] for index, topic in enumerate(self.topics)
                   if index in added or index >= self._old},
            joint_states=joint_input.messages,
            rejected=dict(joint_input.counts),
            held_back={
                chain.name: {reason: (count, _joints(counted.joints.get(reason, {})))
                             for reason, count in counted.held_back.items()}
                for chain, counted in zip(joint_input.chains, joint_input.chain_counts,
                                          strict=True)},
            damage=self._bag.damage,
            notes=notes,
            recorded=self._recorded(),
            took=took)

    def _recorded(self) -> float:
        return max(self._end - self._start, 0) / 1e9


def _joints(found: Mapping[str, str]) -> str:
    return ', '.join(f'{joint} {what}' for joint, what in found.items())


def _check_apart(source: Path, target: Path) -> None:
    """Refuse to write a bag into, over or around the one that is read."""
    here, there = source.resolve(), target.resolve()
    if here == there or here in there.parents or there in here.parents:
        raise OutputFileError(f'{target}: found the input itself, or a part of it or what it is '
                              'in, allowed: another place')


def _joint_topics(bag: BagReader, name: str) -> list[int]:
    """Return the indices of the topic of joint states: files of a bag may describe it apart."""
    found = [index for index, topic in enumerate(bag.topics)
             if (topic.name, topic.type_name, topic.serialization_format)
             == (name, JOINT_STATE, 'cdr')]
    if not found:
        present = sorted({topic.name for topic in bag.topics if topic.type_name == JOINT_STATE})
        listed = ', '.join(present) or 'none; it has no sensor_msgs/msg/JointState'
        raise InputFileError(f'{bag.path}: found no joint states on {name}; --joint-topic may '
                             f'be: {listed}')
    return found


def _not_yet_there(bag: BagReader, old: Sequence[Topic], added: Sequence[Topic]) -> list[Topic]:
    """Return the topics to add without a TF topic that is there already.

    Raises:
        InputFileError: another one is there already.
    """
    types = {topic.name: topic.type_name for topic in old}
    for topic in added:
        if topic.name in types and types[topic.name] != TF:
            raise InputFileError(f'{bag.path}: has {topic.name} already; --only-poses writes the '
                                 'new poses alone')
    return [topic for topic in added if topic.name not in types]


def _storage(target: Path, asked: str) -> str:
    """Return the storage that the target's name or an option asks for; empty if neither."""
    if target.suffix not in KINDS:
        return asked
    named = KINDS[target.suffix]
    if asked and asked != named:
        raise OutputFileError(f'{target}: found a name for {named} and --storage {asked}, '
                              'allowed: one that agrees, or a name without such an ending')
    return named


def _storage_file(bag: Path, storage: str) -> Path:
    """Return the file to write the messages to, in a new directory unless the bag is a file."""
    if bag.suffix in KINDS:
        return bag
    bag.mkdir()
    ending = next(ending for ending, name in KINDS.items() if name == storage)
    return bag / f'{bag.name}_0{ending}'


@contextmanager
def _writer(storage: str, file: Path, topics: Sequence[Topic],
            compression: str) -> Iterator[McapWriter | SqliteWriter]:
    writer = (McapWriter(file, topics, compression) if storage == 'mcap'
              else SqliteWriter(file, topics))
    try:
        yield writer
    finally:
        with suppress(OSError):  # what the disk had no room for is still pending
            writer.abandon()
