"""Copying a recording and adding the poses of the feet, by the node's own rules and code.

`add_foot_poses` takes and returns plain values, so a fleet of recordings is a map over it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import re
import time
from typing import Any, NamedTuple

from icub_leg_fk.errors import (
    InputFileError,
    OutputFileError,
    ParameterError,
)
from icub_leg_fk.kinematics import Catalog, Chain
from icub_leg_fk.stream.cdr import JOINT_STATE
from icub_leg_fk.stream.configuration import (
    Configuration,
    DEFAULT_FRAME,
    DEFAULT_TIMEOUT,
    LEGS,
)
from icub_leg_fk.stream.joint_input import Look
from icub_leg_fk.stream.notes import name_hint, names_that_came, notes_of
from icub_leg_fk.stream.pose_stream import PoseStream, Send, Senders
from icub_leg_fk.tools.bags import (
    Bag,
    Connection,
    DEFAULT_TOPIC,
    import_rosbags,
    namespace_of,
    new_bag,
    open_bag,
    reliable_qos,
    STORAGES,
)
from icub_leg_fk.tools.joint_states import PREFIX_OPTION, SECOND
from icub_leg_fk.tools.output_file import check_target, is_bag
from icub_leg_fk.tools.progress import Progress
from icub_leg_fk.tools.recorded_robot import (
    Described,
    refuse_second_source,
    Robot,
    robot_of,
    RobotInput,
)
from icub_leg_fk.tools.recording import (
    has_topics,
    open_recording,
    Recording,
)

NODE = 'foot_pose_publisher'
POSE = 'geometry_msgs/msg/PoseStamped'
TWIST = 'geometry_msgs/msg/TwistStamped'
TF = 'tf2_msgs/msg/TFMessage'
TF_TOPIC = '/tf'
TF_TOPICS = (TF_TOPIC, '/tf_static')

_POSE_DEPTH = 10
_TF_DEPTH = 100
_IDL = '=' * 80 + '\nIDL: '  # how a definition in that language begins
_NAMESPACE = re.compile(r'/?([A-Za-z_]\w*(/[A-Za-z_]\w*)*/?)?', re.ASCII)
_UNKNOWN_HASH = f'RIHS01_{"0" * 64}'


class Summary(NamedTuple):
    """What has been done with one recording.

    Attributes:
        source: the recording that was read.
        target: the one that was made.
        copied: messages copied.
        added: messages added, by topic.
        joint_states: messages of joint states.
        rejected: of these, how many were rejected, by reason.
        held_back: per chain and reason, how many gave no pose or twist.
        warnings: what is doubtful, one line each.
        notes: what else a user should know, one line each.
        recorded: time from the first to the last message [s].
        took: time the work took [s].
    """

    source: str
    target: str
    copied: int
    added: dict[str, int]
    joint_states: int
    rejected: dict[str, int]
    held_back: dict[str, dict[str, int]]
    warnings: list[str]
    notes: list[str]
    recorded: float
    took: float


def add_foot_poses(
    source: str | Path,
    target: str | Path,
    *,
    chains: Sequence[str] = LEGS,
    version: str = '',
    kinematics_file: str | None = None,
    description_from_topic: bool | str = False,
    root: str | None = None,
    joint_prefix: str = '',
    foot_frame: str = DEFAULT_FRAME,
    frame_prefix: str = '',
    joint_timeout: float = DEFAULT_TIMEOUT,
    joint_topics: Sequence[str] = (),
    time_unit: str = '',
    namespace: str | None = None,
    twist: bool = False,
    tf: bool = False,
    only_poses: bool = False,
    replace_poses: bool = False,
    storage: str = '',
    force: bool = False,
    progress: Progress | None = None,
) -> Summary:
    """Copy a recording and add the poses of the feet.

    Args:
        source: a rosbag2 directory or a .mcap or .db3 file of one, a CSV file, or a directory of
            yarpdatadumper.
        target: directory to make, or a file if its name ends in .mcap or .db3.
        chains: chains of the kinematics file, such as `left_leg` or `head_imu=v2`.
        version: version of every chain that is named without one; empty is its default.
        kinematics_file: path of a kinematics file or a URDF; the shipped one if None.
        description_from_topic: whether the robot's own URDF in the recording is computed with, or
            the topic that it is on, if not `robot_description` in the namespace of the joint
            states.
        root: of a URDF, the link that poses are given in; `root_link` or else the top if None.
        joint_prefix: put before every joint name that is looked for.
        foot_frame: a tip frame's name.
        frame_prefix: put before every frame id.
        joint_timeout: age of a joint beside the newest of its chain that holds the chain back [s].
        joint_topics: topics of the joint states; `/joint_states`, or the only one there is, if
            none is named.
        time_unit: unit of the times in a CSV file; told by their size if empty.
        namespace: where the poses are published; that of the joint states if None.
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
        ParameterError: a choice is not valid.
    """
    began = time.monotonic()
    settings: dict[str, Any] = {
        'chains': chains,
        'version': version,
        'joint_prefix': joint_prefix,
        'foot_frame': foot_frame,
        'frame_prefix': frame_prefix,
        'joint_timeout': joint_timeout,
        'publish_tf': tf,
        'publish_twist': twist,
    }
    wanted: Sequence[Chain] | Described
    if description_from_topic:
        refuse_second_source(kinematics_file)
        configuration = Configuration.checked(None, **settings)
        wanted = Described(description_from_topic, root, settings)
    else:
        catalog = Catalog.load(kinematics_file, root=root)
        configuration = Configuration.checked(catalog, **settings)
        wanted = configuration.chains
    _refuse_overlap(source, target)
    storage = _chosen_storage(Path(source), Path(target), storage)
    check_target(target, force=force, may_replace=is_bag)
    with _open(source, wanted, joint_topics, time_unit, joint_prefix) as (bag, robot):
        chains_first = robot.periods[0].chains
        joints = [name for chain in chains_first for name in chain.joint_names]
        joint_states = bag.joint_connections(joint_topics, joints)
        topics = list(dict.fromkeys(each.topic for each in joint_states))
        added = _Added(configuration, robot, _namespace(namespace, topics))
        types = _Types()
        old = _OldPoses(bag, [] if only_poses else bag.connections, added, types)
        if old.found and not replace_poses:
            raise InputFileError(
                str(source),
                f'has {", ".join(old.found)} already; '
                '--replace-poses leaves these out, --only-poses writes the new',
            )
        with new_bag(target, storage, force=force) as writer:
            for name, value in bag.custom_data.items():
                writer.set_custom_data(name, str(value))
            copies = {each.id: types.copied(each, writer) for each in old.kept}
            poses = _Poses(writer, added, copies.values(), types)
            count = _write(bag, joint_states, copies, old, poses, progress)
            look = poses.robot_input.take_look()
            _refuse_strangers(source, look, joint_prefix)
    notes = notes_of(look, ' and '.join(topics), joint_prefix, PREFIX_OPTION)
    return Summary(
        source=str(source),
        target=str(target),
        copied=count,
        added=dict(poses.added),
        joint_states=look.messages,
        rejected=dict(look.rejected),
        held_back={name: dict(chain.held_back) for name, chain in look.chains.items()},
        warnings=[
            *configuration.warnings,
            *robot.warnings,
            *map(str, notes),
        ],
        notes=[
            *bag.notes,
            *configuration.notes,
            *robot.notes,
            *old.notes,
            *types.notes,
        ],
        recorded=(bag.span[1] - bag.span[0]) / SECOND,
        took=time.monotonic() - began,
    )


class _Added:
    """What is added to a recording.

    Args:
        configuration: what is to be published.
        robot: whose poses these are.
        namespace: where; empty, or with a slash before it.

    Attributes:
        configuration: the same.
        robot: the same.
        topics: types by topic.
        frames: child frames of the transforms.
    """

    def __init__(
        self, configuration: Configuration, robot: Robot, namespace: str
    ) -> None:
        self.configuration = configuration
        self.robot = robot
        self._namespace = namespace
        self.topics: dict[str, str] = {}
        self.frames: set[str] = set()
        for chain in robot.chains():
            self.topics[self.topic(chain, 'pose')] = POSE
            if configuration.publish_twist:
                self.topics[self.topic(chain, 'twist')] = TWIST
            if configuration.publish_tf:
                self.frames.add(configuration.frame_prefix + chain.frame_id)
        if configuration.publish_tf:
            self.topics[TF_TOPIC] = TF

    def topic(self, chain: Chain, what: str) -> str:
        """Return the topic of a chain's poses or twists."""
        return f'{self._namespace}/{NODE}/{chain.tip}/{what}'


class _NoBag:
    """A recording that is no bag, like a bag with joint states alone."""

    def __init__(self, recording: Recording) -> None:
        rosbags = import_rosbags()
        types = rosbags.typesys.get_typestore(rosbags.typesys.Stores.ROS2_JAZZY)
        text, _ = types.generate_msgdef(JOINT_STATE, ros_version=2)
        form = rosbags.interfaces.MessageDefinitionFormat.MSG
        self._recording = recording
        self.connections = [
            rosbags.interfaces.Connection(
                id=1,
                topic=DEFAULT_TOPIC,
                msgtype=JOINT_STATE,
                msgdef=rosbags.interfaces.MessageDefinition(form, text),
                digest=types.hash_rihs01(JOINT_STATE),
                msgcount=0,
                ext=rosbags.interfaces.ConnectionExtRosbag2(
                    'cdr', [reliable_qos(_POSE_DEPTH)]
                ),
                owner=None,
            )
        ]
        self.custom_data: dict[str, str] = {}
        self.notes = recording.notes
        self.span = recording.span()

    def joint_connections(
        self, topics: Sequence[str], joints: Iterable[str]
    ) -> list[Connection]:
        """Return the only connection."""
        return self.connections

    def messages(
        self, connections: Iterable[Connection], progress: Progress | None = None
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield connection, time [ns] and CDR bytes of each message, if it is asked for."""
        for connection in connections:
            for stamp, data in self._recording.messages(progress):
                yield connection, stamp, data


class _Types:
    """The types of messages, as rosbags knows them.

    Attributes:
        store: those of ROS 2 Jazzy.
        notes: what is not known of the types of a recording, one line each.
    """

    def __init__(self) -> None:
        self._typesys = import_rosbags().typesys
        self.store = self._typesys.get_typestore(self._typesys.Stores.ROS2_JAZZY)
        self.notes: list[str] = []

    def copied(self, old: Connection, writer: Any) -> Connection:
        """Add a topic of a recording to another one."""
        return writer.add_connection(
            old.topic,
            old.msgtype,
            msgdef=old.msgdef.data,
            rihs01=self._hash_of(old),
            serialization_format='cdr',
            offered_qos_profiles=old.ext.offered_qos_profiles,
        )

    def _hash_of(self, connection: Connection) -> str:
        """Return a type's hash: as recorded, or else from the definition."""
        if connection.digest:
            return str(connection.digest)
        try:
            return str(self._store_of(connection).hash_rihs01(connection.msgtype))
        except Exception:  # noqa: BLE001 (whatever a strange definition makes of it)
            note = f'the type hash of {connection.msgtype} is not known'
            self.notes.append(f'{note}; {_UNKNOWN_HASH[:9]}... stands for it')
            return _UNKNOWN_HASH

    def _store_of(self, connection: Connection) -> Any:
        """Return the types that a recording defines itself, or those of Jazzy."""
        text = connection.msgdef.data
        if not text:
            return self.store
        store = self._typesys.get_typestore(self._typesys.Stores.EMPTY)
        if text.startswith(_IDL):
            store.register(self._typesys.get_types_from_idl(text))
        else:
            store.register(self._typesys.get_types_from_msg(text, connection.msgtype))
        return store


class _OldPoses:
    """What a recording has already of what is added.

    Attributes:
        kept: the connections to copy.
        transforms: ids of those on which are transforms that are not to be copied.
        found: what there is, in words.
        notes: the same, as what is left out.
    """

    def __init__(
        self,
        bag: Bag | _NoBag,
        connections: Iterable[Connection],
        added: _Added,
        types: _Types,
    ) -> None:
        topics = added.topics.keys() - {TF_TOPIC}
        poses = [each for each in connections if each.topic in topics]
        self.kept = [each for each in connections if each.topic not in topics]
        self.transforms: set[int] = set()
        self.found = list(dict.fromkeys(each.topic for each in poses))
        self._frames = added.frames
        self._store = types.store
        for connection in self.kept:
            is_tf = connection.topic in TF_TOPICS and connection.msgtype == TF
            frames = self._frames_on(connection, bag) if is_tf else set()
            if frames:
                self.transforms.add(connection.id)
                self.found.append(
                    f'{connection.topic} with {", ".join(sorted(frames))}'
                )
        self.notes = [f'left out: {each} of the recording' for each in self.found]

    def rest_of(self, data: bytes) -> bytes | None:
        """Return a TFMessage without the transforms made anew; None if nothing is left of it."""
        message = self._store.deserialize_cdr(data, TF)
        there = len(message.transforms)
        message.transforms = [
            each
            for each in message.transforms
            if each.child_frame_id not in self._frames
        ]
        if len(message.transforms) == there:
            return data
        return self._store.serialize_cdr(message, TF) if message.transforms else None

    def _frames_on(self, connection: Connection, bag: Bag | _NoBag) -> set[str]:
        """Return which of the frames that are added are on a topic of transforms."""
        names = [frame.encode() + b'\0' for frame in self._frames]
        found: set[str] = set()
        for _, _, data in bag.messages([connection]):
            may_have = any(name in data for name in names)  # `a/x` has `x`, too
            if may_have:
                message = self._store.deserialize_cdr(data, TF)
                found.update(each.child_frame_id for each in message.transforms)
        return found & self._frames


class _Poses:
    """Writes what joint states give.

    Attributes:
        writer: what writes them.
        robot_input: what takes the joint states.
        added: messages written, by topic.
    """

    def __init__(
        self,
        writer: Any,
        added: _Added,
        copies: Iterable[Connection],
        types: _Types,
    ) -> None:
        self.writer = writer
        configuration = added.configuration
        self._time = 0  # when the present message was recorded [ns]
        self.added = dict.fromkeys(added.topics, 0)
        there = {(each.topic, each.msgtype): each for each in copies}
        send = {}
        for topic, kind in added.topics.items():
            connection = there.get((topic, kind))
            if connection is None:
                depth = _TF_DEPTH if topic == TF_TOPIC else _POSE_DEPTH
                connection = writer.add_connection(
                    topic,
                    kind,
                    typestore=types.store,
                    offered_qos_profiles=[reliable_qos(depth)],
                )
            send[topic] = self._sender(connection)
        senders = {
            chain.name: Senders(
                send[added.topic(chain, 'pose')], send.get(added.topic(chain, 'twist'))
            )
            for chain in added.robot.chains()
        }

        def begin(chains: Sequence[Chain]) -> None:
            self._stream = PoseStream(
                chains, configuration.frame_prefix, senders, send.get(TF_TOPIC)
            )

        self.robot_input = RobotInput(
            added.robot,
            configuration.joint_timeout,
            configuration.publish_twist,
            begin,
        )

    def take(self, timestamp: int, data: bytes) -> None:
        """Take a message of joint states in, and write what it gives."""
        self._time = timestamp
        vectors = self.robot_input.feed(timestamp, data)  # which may begin a new stream
        self._stream.send(vectors)

    def _sender(self, connection: Connection) -> Send:
        write = self.writer.write
        added = self.added
        topic = connection.topic

        def send(data: bytes) -> None:
            write(connection, self._time, data)
            added[topic] += 1

        return send


def _write(
    bag: Bag | _NoBag,
    joint_states: Iterable[Connection],
    copies: Mapping[int, Connection],
    old: _OldPoses,
    poses: _Poses,
    progress: Progress | None,
) -> int:
    """Copy messages, each of joint states followed by what it gives; return how many were copied.

    Args:
        bag: the recording.
        joint_states: its joint states.
        copies: what takes the place of its connections, by their ids.
        old: which transforms are made anew.
        poses: takes the joint states.
        progress: called now and then with the share that is done, 0 to 1.
    """
    count = 0
    write = poses.writer.write
    joint_ids = {each.id for each in joint_states}
    wanted = [each for each in bag.connections if each.id in copies.keys() | joint_ids]
    for connection, timestamp, data in bag.messages(wanted, progress):
        id_ = connection.id
        if id_ in copies:
            kept = old.rest_of(data) if id_ in old.transforms else data
            if kept is not None:
                write(copies[id_], timestamp, kept)
                count += 1
        if id_ in joint_ids:
            poses.take(timestamp, data)
    return count


@contextmanager
def _open(
    source: str | Path,
    chains: Sequence[Chain] | Described,
    joint_topics: Sequence[str],
    time_unit: str,
    joint_prefix: str,
) -> Iterator[tuple[Bag | _NoBag, Robot]]:
    """Give a recording for reading, as a bag or like one, and the robot that it is of."""
    path = Path(source)
    if has_topics(path):
        with open_bag(path) as bag:
            yield bag, robot_of(chains, [bag], joint_topics, joint_prefix)
        return
    with open_recording([path], chains, joint_topics, time_unit) as recording:
        yield _NoBag(recording), recording.robot


def _namespace(namespace: str | None, topics: Sequence[str]) -> str:
    """Return the namespace of the poses: empty, or with a slash before it.

    Raises:
        ParameterError: it is no name of ROS.
    """
    if namespace is None:
        return namespace_of(topics)
    if not _NAMESPACE.fullmatch(namespace):
        raise ParameterError(
            'namespace',
            f'found {namespace!r}, allowed: words of letters, '
            'digits and underscores, separated by slashes',
        )
    words = namespace.strip('/')
    return f'/{words}' if words else ''


def _refuse_strangers(source: str | Path, look: Look, joint_prefix: str) -> None:
    """Refuse a recording of which no joint belongs to any chain."""
    if look.joints or look.rejected.keys() - {'time_jump'}:
        return
    fault = 'has a joint of any chain' if look.messages else 'of joint states'
    wanted = '; '.join(
        f'{name} needs {", ".join(each.chain.joint_names)}'
        for name, each in look.chains.items()
    )
    joints = [name for each in look.chains.values() for name in each.chain.joint_names]
    hint = name_hint(joints, look.names, joint_prefix, PREFIX_OPTION)
    raise InputFileError(
        str(source),
        f'no message {fault}; {wanted}; names found: {names_that_came(look)}{hint}',
    )


def _refuse_overlap(source: str | Path, target: str | Path) -> None:
    """Refuse a target in, over or around the source."""
    here, there = (Path(os.path.realpath(path)) for path in (source, target))
    if here == there or here in there.parents or there in here.parents:
        raise OutputFileError(
            str(target),
            'is the input itself, or a part of it or what it is '
            'in; allowed: another place',
        )


def _chosen_storage(source: Path, target: Path, storage: str) -> str:
    """Return the storage to use: as the target's name says, or as asked for, or as it was."""
    named = STORAGES.get(target.suffix, '')
    if named and storage not in ('', named):
        raise OutputFileError(
            str(target),
            f'is a name for {named}, and --storage is {storage}; '
            'allowed: one that agrees, or a name without such an '
            'ending',
        )
    if named or storage:
        return named or storage
    files = source.iterdir() if source.is_dir() else (source,)
    return 'sqlite3' if any('.db3' in file.suffixes for file in files) else 'mcap'
