"""Copying a recording and adding the poses of the feet, by the node's own rules and code.

`add_foot_poses` takes and returns plain values, so a fleet of recordings is a map over it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
import sqlite3
import time
from typing import Any

from icub_leg_fk.errors import InputFileError, LegFKError, OutputFileError, ParameterError
from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.stream.configuration import (
    Configuration,
    DEFAULT_FRAME,
    DEFAULT_TIMEOUT,
    LEGS,
)
from icub_leg_fk.stream.joint_input import JointInput
from icub_leg_fk.stream.pose_stream import PoseStream, Send, Senders
from icub_leg_fk.tools.bags import import_rosbags, joint_connections, messages, open_bag
from icub_leg_fk.tools.output_file import check_target, is_bag, whole_path

NODE = '/foot_pose_publisher'
POSE, TWIST, TF = ('geometry_msgs/msg/PoseStamped', 'geometry_msgs/msg/TwistStamped',
                   'tf2_msgs/msg/TFMessage')
TF_TOPIC = '/tf'
STORAGES = {'.mcap': 'mcap', '.db3': 'sqlite3'}
_UNKNOWN_HASH = f'RIHS01_{"0" * 64}'
_NAMES_SHOWN = 20


@dataclass(frozen=True)
class Summary:
    """What has been done with one recording."""

    source: str  #: the recording that was read
    target: str  #: the one that was made
    copied: int  #: messages copied
    added: dict[str, int]  #: messages added, by topic
    joint_states: int  #: messages of joint states
    rejected: dict[str, int]  #: of these, how many were rejected, by reason
    #: per chain and reason, how many gave no pose or twist, and the joints concerned
    held_back: dict[str, dict[str, tuple[int, str]]]
    notes: list[str]  #: what a user should know, one line each
    recorded: float  #: time from the first to the last message [s]
    took: float  #: time the work took [s]


def add_foot_poses(
        source: str | Path, target: str | Path, *, chains: Sequence[str] = LEGS,
        version: str = '', kinematics_file: str | None = None, foot_frame: str = DEFAULT_FRAME,
        frame_prefix: str = '', joint_timeout: float = DEFAULT_TIMEOUT,
        joint_topic: str | None = None, twist: bool = False,
        tf: bool = False, only_poses: bool = False, replace_poses: bool = False,
        storage: str = '', force: bool = False, progress: Callable[[float], None] | None = None
        ) -> Summary:
    """Copy a recording and add the poses of the feet.

    Args:
        source: directory of a rosbag2 recording, or a .mcap or .db3 file.
        target: directory to make, or a file if its name ends in .mcap or .db3.
        chains: chains of the kinematics file, such as `left_leg` or `head_imu=v2`.
        version: version of every chain that is named without one; empty is its default.
        kinematics_file: path of a kinematics file; the shipped one if None.
        foot_frame: a tip frame's name.
        frame_prefix: put before every frame id.
        joint_timeout: age of a joint beside the newest of its chain that holds the chain back [s].
        joint_topic: topic of the joint states; `/joint_states`, or the only one there is, if None.
        twist: whether velocities of the tips are added, too.
        tf: whether the poses are added to /tf, too.
        only_poses: whether everything but what is added is left out.
        replace_poses: whether poses that the recording has already are left out.
        storage: `mcap` or `sqlite3`; if empty as the target says, or as the source has it.
        force: whether an existing target is replaced.
        progress: called now and then with the share that is done, 0 to 1.

    Raises:
        InputFileError: the source cannot be read, or has no joint of any chain.
        OutputFileError: the target exists, is part of the source, or cannot be written.
        LegFKError: a choice is not valid.
    """
    began = time.monotonic()
    source, target = Path(source), Path(target)
    try:
        configuration = Configuration.checked(
            Catalog.load(kinematics_file), chains=chains, version=version, foot_frame=foot_frame,
            frame_prefix=frame_prefix, joint_timeout=joint_timeout, publish_tf=tf,
            publish_twist=twist)
    except ParameterError as error:
        option = error.parameter.replace('_', '-')
        raise LegFKError(f'--{option}: {error.fault}') from error
    storage = _checked(source, target, storage)
    check_target(target, force=force, may_replace=is_bag)
    with open_bag(source) as reader:
        job = _Job(reader, source, configuration, joint_topic, only_poses)
        if not only_poses:
            job.leave_out_old_poses(replace_poses)
        with whole_path(target, force=force, may_replace=is_bag) as place:
            with _writer(place, storage) as writer:
                job.run(writer, progress)
            job.check_use()
        return job.summary(str(target), time.monotonic() - began)


@contextmanager
def _writer(place: Path, storage: str) -> Iterator[Any]:
    """Give what writes a recording at a place: a directory, or a file if its name says so."""
    rosbag2, _ = import_rosbags()
    ending = place.suffix if place.suffix in STORAGES else ''
    directory = place.with_name(f'{place.stem}.directory') if ending else place
    try:
        with rosbag2.Writer(directory, version=rosbag2.Writer.VERSION_LATEST,
                            storage_plugin=rosbag2.StoragePlugin[storage.upper()]) as writer:
            yield writer
    except (sqlite3.Error, rosbag2.WriterError) as error:
        raise OutputFileError(f'{place.name}: cannot be written: {error}') from error
    if ending:
        file, = directory.glob(f'*{ending}')
        file.rename(place)


class _Job:
    """A recording, the poses that join it, and what becomes known on the way."""

    def __init__(self, reader: Any, source: Path, configuration: Configuration,
                 joint_topic: str | None, only_poses: bool) -> None:
        _, self._typesys = import_rosbags()
        self._store = self._typesys.get_typestore(self._typesys.Stores.ROS2_JAZZY)
        self._reader, self._source, self._configuration = reader, source, configuration
        joint_states = joint_connections(reader, source, joint_topic)
        self._joint_ids = {connection.id for connection in joint_states}
        self._kept: list[Any] = [] if only_poses else list(reader.connections)
        self._own_tf: set[int] = set()  # connections to /tf with frames that are added
        self._time = self._copied = 0
        self._input = JointInput(configuration.chains, configuration.joint_timeout,
                                 lambda: self._time, velocities=configuration.publish_twist)
        self._children = [configuration.frame_prefix + chain.frame_id
                          for chain in configuration.chains]
        self._notes = [*configuration.notes, *configuration.warnings]
        self._topics: dict[str, str] = {}  # what is added: types by topic
        for chain in configuration.chains:
            self._topics[f'{NODE}/{chain.tip}/pose'] = POSE
            if configuration.publish_twist:
                self._topics[f'{NODE}/{chain.tip}/twist'] = TWIST
        if configuration.publish_tf:
            self._topics[TF_TOPIC] = TF
        self._added = dict.fromkeys(self._topics, 0)

    def leave_out_old_poses(self, replace_poses: bool) -> None:
        """Refuse, or leave out, what the recording already has of what is added."""
        old = [connection for connection in self._kept
               if connection.topic in self._topics and connection.topic != TF_TOPIC]
        found = [connection.topic for connection in old]
        if self._configuration.publish_tf:
            transforms = [connection for connection in self._kept
                          if (connection.topic, connection.msgtype) == (TF_TOPIC, TF)]
            if transforms and any(
                    frame.encode() + b'\0' in data for _, _, data in
                    messages(self._reader, self._source, transforms) for frame in self._children):
                found.append(f'{TF_TOPIC} with {", ".join(self._children)}')
                self._own_tf = {connection.id for connection in transforms}
        if found and not replace_poses:
            raise InputFileError(f'{self._source}: has {", ".join(found)} already; '
                                 '--replace-poses leaves these out, --only-poses writes the new')
        self._kept = [connection for connection in self._kept if connection not in old]
        self._notes += [f'left out: {topic} of the recording' for topic in found]

    def run(self, writer: Any, progress: Callable[[float], None] | None) -> None:
        """Copy the messages, each joint state followed by what it gives."""
        for key, value in (self._reader.storage.metadata.custom or {}).items():
            writer.set_custom_data(key, str(value))
        copies = {connection.id: writer.add_connection(
            connection.topic, connection.msgtype, msgdef=connection.msgdef.data,
            rihs01=connection.digest or self._hash_of(connection), serialization_format='cdr',
            offered_qos_profiles=connection.ext.offered_qos_profiles)
            for connection in self._kept}
        wanted = [connection for connection in self._reader.connections
                  if connection.id in copies or connection.id in self._joint_ids]
        stream, write, feed = self._stream(writer, copies), writer.write, self._input.feed
        joint_ids, own_tf = self._joint_ids, self._own_tf
        total = sum(connection.msgcount for connection in wanted) or 1
        for number, (connection, timestamp, data) in enumerate(
                messages(self._reader, self._source, wanted)):
            if (copy := copies.get(connection.id)) is not None:
                kept = self._without_own_transforms(data) if connection.id in own_tf else data
                if kept is not None:
                    write(copy, timestamp, kept)
                    self._copied += 1
            if connection.id in joint_ids:
                self._time = timestamp
                stream.send(feed(data))
            if progress is not None and number % 1000 == 0:
                progress(number / total)

    def check_use(self) -> None:
        """Refuse a recording of which no joint belongs to any chain."""
        counts = self._input.chain_counts
        if any(count.ready or count.held_back for count in counts) or (
                self._input.counts.keys() - {'time_jump'}):
            return
        wanted = '; '.join(f'{chain.name} needs {", ".join(chain.joint_names)}'
                           for chain in self._configuration.chains)
        why = 'has a joint of any chain' if self._input.messages else 'of joint states'
        names = list(self._input.names_since())
        if more := names[_NAMES_SHOWN:]:
            names[_NAMES_SHOWN:] = [f'and {len(more)} more']
        raise InputFileError(f'{self._source}: no message {why}; {wanted}; names found: '
                             f'{", ".join(names) or "none"}')

    def summary(self, target: str, took: float) -> Summary:
        """Return what has been done."""
        joint_input = self._input
        held_back = {chain.name: {reason: (count, ', '.join(
            f'{joint} {what}' for joint, what in counts.joints.get(reason, {}).items()))
            for reason, count in counts.held_back.items()}
            for chain, counts in zip(joint_input.chains, joint_input.chain_counts)}
        return Summary(
            str(self._source), target, self._copied, self._added, joint_input.messages,
            dict(joint_input.counts), held_back, list(dict.fromkeys(self._notes)),
            max(0, self._reader.duration - 1) / 1e9, took)

    def _stream(self, writer: Any, copies: Mapping[int, Any]) -> PoseStream:
        """Return what writes the messages that are added."""
        def sender(topic: str) -> Send | None:
            if topic not in self._topics:
                return None
            connection = self._add(writer, topic, self._topics[topic], copies)
            write, added = writer.write, self._added

            def send(data: bytes) -> None:
                write(connection, self._time, data)
                added[topic] += 1
            return send

        chains = self._configuration.chains
        senders = [Senders(sender(f'{NODE}/{chain.tip}/pose'), sender(f'{NODE}/{chain.tip}/twist'))
                   for chain in chains]
        return PoseStream(chains, self._configuration.frame_prefix, senders, sender(TF_TOPIC),
                          self._input.note_no_velocity)

    def _add(self, writer: Any, topic: str, kind: str, copies: Mapping[int, Any]) -> Any:
        """Return the connection of what is added: one that is copied, or a new one."""
        for connection in self._kept:
            if (connection.topic, connection.msgtype) == (topic, kind):
                return copies[connection.id]
        return writer.add_connection(topic, kind, typestore=self._store, offered_qos_profiles=[
            _reliable(100 if topic == TF_TOPIC else 10)])

    def _hash_of(self, connection: Any) -> str:
        """Return the type hash that a recording does not hold, from the definition."""
        try:
            store, text = self._store, connection.msgdef.data
            if text:
                store = self._typesys.get_typestore(self._typesys.Stores.EMPTY)
                store.register(self._typesys.get_types_from_idl(text)
                               if text.startswith('=' * 80 + '\nIDL: ') else
                               self._typesys.get_types_from_msg(text, connection.msgtype))
            return str(store.hash_rihs01(connection.msgtype))
        except Exception:  # noqa: BLE001 (whatever a strange definition makes of it)
            self._notes.append(f'the type hash of {connection.msgtype} is not known; '
                               f'{_UNKNOWN_HASH[:9]}... stands for it')
            return _UNKNOWN_HASH

    def _without_own_transforms(self, data: bytes) -> bytes | None:
        """Return a TFMessage without the frames that are added; None if nothing is left of it."""
        message = self._store.deserialize_cdr(data, TF)
        kept = [transform for transform in message.transforms
                if transform.child_frame_id not in self._children]
        if len(kept) == len(message.transforms):
            return data
        message.transforms = kept
        return bytes(self._store.serialize_cdr(message, TF)) if kept else None


def _reliable(depth: int) -> Any:
    """Return the QoS with which the node offers its topics."""
    from rosbags import interfaces

    forever = interfaces.QosTime(2147483647, 4294967295)
    return interfaces.Qos(
        interfaces.QosHistory.KEEP_LAST, depth, interfaces.QosReliability.RELIABLE,
        interfaces.QosDurability.VOLATILE, forever, forever, interfaces.QosLiveliness.AUTOMATIC,
        forever, False)


def _checked(source: Path, target: Path, storage: str) -> str:
    """Return the storage to use; refuse a target in, over or around the source."""
    here, there = source.resolve(), target.resolve()
    if here == there or here in there.parents or there in here.parents:
        raise OutputFileError(f'{target}: is the input itself, or a part of it or what it is in; '
                              'allowed: another place')
    named = STORAGES.get(target.suffix, '')
    if named and storage not in ('', named):
        raise OutputFileError(f'{target}: is a name for {named}, and --storage is {storage}; '
                              'allowed: one that agrees, or a name without such an ending')
    files = source.iterdir() if source.is_dir() else (source,)
    return named or storage or (
        'mcap' if any('.mcap' in file.suffixes for file in files) else 'sqlite3')
