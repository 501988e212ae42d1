"""Joint recordings of every kind as one stream of messages: bags, CSV files, logs of YARP.

Several of them are parts of one robot, and so are several topics of a bag.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager, ExitStack
import errno
import heapq
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

from icub_leg_fk.errors import InputFileError, LegFKError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.stream.cdr import JOINT_STATE
from icub_leg_fk.stream.configuration import DEFAULT_TIMEOUT
from icub_leg_fk.stream.joint_input import Look, Ready
from icub_leg_fk.stream.notes import notes_of
from icub_leg_fk.tools import csv_file
from icub_leg_fk.tools.bags import (
    Bag,
    DEFAULT_TOPIC,
    import_rosbags,
    METADATA,
    new_bag,
    open_bag,
    STORAGES,
)
from icub_leg_fk.tools.csv_file import CsvFile
from icub_leg_fk.tools.joint_states import Messages, Part, PREFIX_OPTION, SECOND
from icub_leg_fk.tools.progress import part_of, Progress
from icub_leg_fk.tools.recorded_robot import (
    Described,
    OPTION,
    Robot,
    robot_of,
    RobotInput,
)
from icub_leg_fk.tools.yarp_log import DATA, is_yarp_log, PARTS, YarpLog
import numpy as np

KINDS = (
    'a bag (directory, .mcap or .db3), a CSV file (.csv, .tsv or .txt) or a directory of '
    'yarpdatadumper'
)

_OF_ROS_1 = '.bag'
_COMPRESSED = '.zstd'


class BagTopics(Part):
    """The joint states of a bag on some topics, as a part of a recording.

    Args:
        bag: the bag.
        topics: the topics; `/joint_states`, or the only one there is, if none is named.
        joints: the joints that are looked for.

    Raises:
        InputFileError: there are no joint states on a topic; lists the topics that have some.
    """

    def __init__(self, bag: Bag, topics: Sequence[str], joints: Sequence[str]) -> None:
        super().__init__(bag.path)
        self.notes = bag.notes
        self._bag = bag
        self._connections = bag.joint_connections(topics, joints)
        self._topics = list(dict.fromkeys(each.topic for each in self._connections))
        self.topic = ' and '.join(self._topics)
        self.joint_names = bag.joint_names(self._topics)

    def messages(self, progress: Progress | None = None) -> Messages:
        """Yield time of recording [ns] and CDR bytes of each JointState."""
        for _, time, data in self._bag.messages(self._connections, progress):
            yield time, data

    def span(self) -> tuple[int, int]:
        """Return the first and the last time of recording [ns]."""
        return self._bag.span

    def topics_with(self, joints: Collection[str]) -> list[str]:
        """Return the other topics of the bag that have some joints."""
        others = [
            name for name in self._bag.topics(JOINT_STATE) if name not in self._topics
        ]
        return [
            name for name in others if set(joints) & set(self._bag.joint_names([name]))
        ]


class Recording:
    """What joints did, in one part or several.

    Attributes:
        name: its paths.
        topic: topics of the joint states; empty if it has no topics.
        start: time that is called 0 [ns]; None if that is the first pose.
        robot: whose joints they are.
        joint_prefix: what is before the joint names of its chains.
        notes: what a user should know of it, one line each.
    """

    def __init__(
        self, parts: Sequence[Part], robot: Robot, joint_prefix: str = ''
    ) -> None:
        self._parts = parts
        self.robot = robot
        self.joint_prefix = joint_prefix
        self.name = ', '.join(str(part.path) for part in parts)
        self.topic = ' and '.join(part.topic for part in parts if part.topic)
        self.start = 0 if all(part.is_relative for part in parts) else None
        self.notes = [note for part in parts for note in part.notes] + robot.notes
        if len(parts) > 1:
            _refuse_shared_joints(parts)
            _refuse_separate_spans(parts)

    def messages(self, progress: Progress | None = None) -> Messages:
        """Yield time of recording [ns] and CDR bytes of each JointState, those of parts by time.

        Raises:
            InputFileError: a part cannot be read to its end.
        """
        if len(self._parts) == 1:
            return self._parts[0].messages(progress)
        shares = [0.0] * len(self._parts)
        streams = []
        for place, part in enumerate(self._parts):
            streams.append(part.messages(part_of(progress, shares, place)))
        return heapq.merge(*streams, key=itemgetter(0))

    def span(self) -> tuple[int, int]:
        """Return the first and the last time [ns]."""
        spans = [part.span() for part in self._parts]
        return min(first for first, _ in spans), max(last for _, last in spans)

    def advice(self, joints: Collection[str]) -> str:
        """Return on which other topics joints are; nothing if on none."""
        topics = [topic for part in self._parts for topic in part.topics_with(joints)]
        return f'; --joint-topic can be {" or ".join(topics)}' if topics else ''


@contextmanager
def open_recording(
    paths: Sequence[str | Path],
    chains: Sequence[Chain] | Described,
    topics: Sequence[str] = (),
    time_unit: str = '',
    joint_prefix: str = '',
) -> Iterator[Recording]:
    """Give a recording for reading.

    Args:
        paths: where its parts are: bags, CSV files, directories of yarpdatadumper or with some.
        chains: the chains whose joints are looked for, or how those of the recording's own
            description of the robot are chosen.
        topics: topics of joint states in bags; `/joint_states`, or the only one there is, if none
            is named.
        time_unit: unit of the times in CSV files; if empty it is told by their size, or by the
            header.
        joint_prefix: what is before the joint names of the chains.

    Raises:
        InputFileError: a part cannot be read, or does not go with another; or it has no
            description that can be used.
        LegFKError: topics are named, or a description is wanted, and no part is a bag.
    """
    places = [Path(path) for path in paths]
    with ExitStack() as stack:
        bags = {
            path: stack.enter_context(open_bag(path))
            for path in places
            if has_topics(path)
        }
        if not bags and (topics or isinstance(chains, Described)):
            option = '--joint-topic' if topics else OPTION
            raise LegFKError(f'{option}: {places[0]} has no topics')
        robot = robot_of(chains, list(bags.values()), topics, joint_prefix)
        chains = robot.periods[0].chains
        names = dict.fromkeys(name for chain in chains for name in chain.joint_names)
        parts: list[Part] = []
        for path in places:
            if path in bags:
                parts.append(BagTopics(bags[path], topics, list(names)))
            else:
                parts += parts_without_topics(path, chains, time_unit)
        yield Recording(parts, robot, joint_prefix)


def follow(
    recording: Recording,
    take: Callable[[list[Ready]], None],
    *,
    joint_timeout: float = DEFAULT_TIMEOUT,
    velocities: bool = False,
    progress: Progress | None = None,
) -> Look:
    """Read a recording by the node's own input rules; return what there is to see of it.

    Args:
        recording: the recording.
        take: takes what each message makes ready.
        joint_timeout: how far a joint may lag the newest of its chain [s]; 0 is any time.
        velocities: whether velocities are wanted.
        progress: called now and then with the share that is done, 0 to 1.
    """
    robot_input = RobotInput(recording.robot, joint_timeout, velocities)
    for now, data in recording.messages(progress):
        ready = robot_input.feed(now, data)
        if ready:
            take(ready)
    return robot_input.take_look()


def warnings_of(
    recording: Recording, look: Look, poseless: Collection[str]
) -> list[str]:
    """Return what there is to say of the joint states, and why chains have no pose.

    Args:
        recording: the recording, still open.
        look: what there is to see of it.
        poseless: names of the chains that have no pose.

    Raises:
        InputFileError: no chain has a pose; says why.
    """
    notes = notes_of(look, recording.topic, recording.joint_prefix, PREFIX_OPTION)
    others = ' '.join(name for name in look.chains if name not in poseless)
    lines = list(recording.robot.warnings)
    for note in notes:
        line = str(note)
        if note.chain in poseless:
            chain = look.chains[note.chain].chain
            line += recording.advice(chain.joint_names)
            if others:
                line = line.replace(':', ' has no pose:', 1)
                line += f'; --chains {others} leaves it out'
        lines.append(line)
    if not others:
        faults = '; '.join(lines) or 'no message of joint states'
        raise InputFileError(recording.name, f'no chain has a pose: {faults}')
    return lines


class JointRecording(NamedTuple):
    """Joint positions over time.

    Attributes:
        joint_names: n names.
        times: (N,) times [s].
        positions: (N, n) joint positions [rad or m].
    """

    joint_names: tuple[str, ...]
    times: Array
    positions: Array

    def first(self, seconds: float) -> JointRecording:
        """Return the part up to a time after the first sample [s]."""
        n = int(np.searchsorted(self.times, self.times[0] + seconds, side='right'))
        return JointRecording(self.joint_names, self.times[:n], self.positions[:n])

    def positions_of(self, chain: Chain) -> Array:
        """Return the (N, n) joint positions of a chain [rad or m]."""
        return self.positions[
            :, [self.joint_names.index(name) for name in chain.joint_names]
        ]


def read_joints(paths: Sequence[str | Path], chains: Sequence[Chain]) -> JointRecording:
    """Return the joint positions of chains at the times at which all of them have a pose.

    Times count from the first of them, unless they count from something else than 1970.

    Raises:
        InputFileError: it cannot be read, or there is no such time.
    """
    stamps = array('q')
    positions = array('d')

    def take(vectors: Sequence[Ready]) -> None:
        if len(vectors) == len(chains):
            stamps.append(vectors[0].stamp)
            for ready in vectors:
                positions.extend(ready.positions)

    with open_recording(paths, chains) as recording:
        look = follow(recording, take)
        warnings_of(recording, look, list(look.chains) if not stamps else [])
    times = np.frombuffer(stamps, dtype=np.int64)
    start = times[0] if recording.start is None else recording.start
    joint_names = [name for chain in chains for name in chain.joint_names]
    return JointRecording(
        joint_names=tuple(joint_names),
        times=(times - start) / SECOND,
        positions=np.frombuffer(positions).reshape(len(times), -1),
    )


def write_joint_states(
    path: str | Path, sent: Iterable[tuple[int, bytes]], *, force: bool
) -> None:
    """Write serialized JointStates, by stamp [ns], as a bag, whole or not at all."""
    typesys = import_rosbags().typesys
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    with new_bag(path, 'mcap', force=force) as writer:
        topic = writer.add_connection(DEFAULT_TOPIC, JOINT_STATE, typestore=store)
        for stamp, data in sent:
            writer.write(topic, stamp, data)


def has_topics(path: Path) -> bool:
    """Return whether a recording is a bag, rather than a CSV file or logs of YARP.

    Raises:
        InputFileError: there is nothing, or something else.
    """
    try:
        path.stat()
    except OSError as error:
        faults = {
            errno.ENOENT: f'there is no such file or directory; allowed: {KINDS}',
            errno.ELOOP: 'is a loop of links, which lead to no file',
        }
        fault = f'cannot be read: {str(error.strerror).lower()}'
        raise InputFileError(str(path), faults.get(error.errno or 0, fault)) from error
    if _is_csv(path) or _log_folders(path):
        return False
    _refuse_other_files(path)
    return True


def parts_without_topics(
    path: Path, chains: Sequence[Chain], time_unit: str
) -> list[Part]:
    """Return the CSV file or the logs of YARP at a path.

    Raises:
        InputFileError: they cannot be read.
    """
    if _is_csv(path):
        return [CsvFile(path, chains, time_unit)]
    return _yarp_logs(path)


def _is_csv(path: Path) -> bool:
    return path.is_file() and path.suffix.lower() in csv_file.ENDINGS


def _log_folders(path: Path) -> list[Path]:
    """Return the logs of YARP that a path is, or that stand in it; none if it is no such."""
    if path.name == DATA and path.is_file():
        path = path.parent
    folders = [path]
    if path.is_dir() and not is_yarp_log(path) and not (path / METADATA).exists():
        folders = sorted(path.iterdir())
    return [folder for folder in folders if is_yarp_log(folder)]


def _yarp_logs(path: Path) -> list[Part]:
    """Return the logs of YARP at a path; those of parts whose joints are not known are noted."""
    logs = [YarpLog(folder) for folder in _log_folders(path)]
    known = [log for log in logs if log.joint_names]
    ports = ', '.join(log.port for log in logs if not log.joint_names)
    if ports and not known:
        fault = f'{ports} is of no known part; allowed: {", ".join(PARTS)}'
        raise InputFileError(str(path), fault)
    if ports:
        known[0].notes.append(f'left out: {ports}, of which no joint is known')
    return list(known)


def _refuse_other_files(path: Path) -> None:
    """Refuse a file that is no recording by its name."""
    if path.is_dir() or path.suffix in (*STORAGES, _OF_ROS_1, _COMPRESSED):
        return
    if path.suffix == '.mat':
        raise InputFileError(
            str(path),
            'is a file of MATLAB, as robometry writes it; save it as a CSV file with a column '
            'time and one per joint, in radians',
        )
    raise InputFileError(str(path), f'is no recording by its name; allowed: {KINDS}')


def _refuse_shared_joints(parts: Sequence[Part]) -> None:
    """Refuse parts that bring the same joint."""
    owner: dict[str, Part] = {}
    for part in parts:
        for joint in part.joint_names:
            other = owner.setdefault(joint, part)
            if other is not part:
                raise InputFileError(
                    str(part.path),
                    f'brings joint {joint}, and so does {other.path}; allowed: each joint once',
                )


def _refuse_separate_spans(parts: Sequence[Part]) -> None:
    """Refuse parts that were not recorded at the same time."""
    spans = [(part.span(), part) for part in parts]
    (start, _), latest = max(spans, key=lambda each: each[0][0])
    (_, end), earliest = min(spans, key=lambda each: each[0][1])
    if start > end:
        raise InputFileError(
            str(latest.path),
            f'begins at {start / SECOND:.3f} s, and {earliest.path} ends at {end / SECOND:.3f} s; '
            'allowed: parts of one time',
        )
