"""Joint positions of chains from a bag, by the node's own input rules."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
import sys

from icub_leg_fk.errors import InputFileError, MissingDependencyError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.ros.joint_input import JointInput
from icub_leg_fk.ros.joint_stream import JointStream, OnReady
from icub_leg_fk.tools.recording import ChainTrack
import numpy as np

JOINT_STATE = 'sensor_msgs/msg/JointState'
DEFAULT_TOPIC = '/joint_states'


def read_bag(path: Path, chains: Sequence[Chain], topic: str | None) -> list[ChainTrack]:
    """Return what some chains did in a bag, those that have a pose at all.

    Args:
        path: directory of a rosbag2 bag, or one of its files (`.mcap`, `.db3`).
        chains: the chains wanted.
        topic: topic of the joint states; None for `/joint_states`, or the only one there is.

    Raises:
        InputFileError: the bag cannot be read, has no such topic, or no chain has a pose.
        MissingDependencyError: rosbags is not installed.
    """
    rows = [_Rows() for _ in chains]
    received = _Received()
    joint_input = JointInput(chains, joint_timeout=0.5)
    stream = JointStream(joint_input, now=lambda: received.ns)
    stream.on_ready = [row.handler() for row in rows]
    for received.ns, data in _joint_states(path, topic):
        stream.feed(data)
    stream.settle()
    start = min((row.stamps[0] for row in rows if row.stamps), default=0)
    tracks = [row.track(chain, start) for row, chain in zip(rows, chains, strict=True)
              if row.stamps]
    missing = [f'{chain.name} needs {", ".join(_unknown(joint_input, index))}'
               for index, (row, chain) in enumerate(zip(rows, chains, strict=True))
               if not row.stamps]
    if not tracks:
        raise InputFileError(f'{path}: found no pose in {joint_input.messages} joint states: '
                             f'{"; ".join(missing)}')
    for text in missing:
        print(f'leg_fk: note: not drawn: {text}', file=sys.stderr)
    return tracks


@dataclass
class _Received:
    """When the bag received the present message, for one without a stamp [ns]."""

    ns: int = 0


class _Rows:
    """The joint vectors of one chain, 8 bytes a number."""

    def __init__(self) -> None:
        self.stamps = array('q')
        self.positions = array('d')

    def handler(self) -> OnReady:
        stamps, positions = self.stamps, self.positions

        def keep(sec: int, nanosec: int, q: Sequence[float], _: Sequence[float] | None) -> None:
            stamps.append(sec * 1_000_000_000 + nanosec)
            positions.extend(q)
        return keep

    def track(self, chain: Chain, start: int) -> ChainTrack:
        times = (np.frombuffer(self.stamps, dtype=np.int64) - start) / 1e9
        return ChainTrack(chain, times, np.frombuffer(self.positions).reshape(len(times), -1))


def _unknown(joint_input: JointInput, chain: int) -> list[str]:
    known = joint_input.known_joints(chain)
    names = [name for name in joint_input.chains[chain].joint_names if name not in known]
    return names or ['joint positions that are finite and fresh']


def _joint_states(path: Path, topic: str | None) -> Iterator[tuple[int, bytes]]:
    """Yield when a JointState was received [ns], and its bytes."""
    try:
        from rosbags.rosbag2 import Reader
    except ImportError as error:
        raise MissingDependencyError('bags need rosbags: pip install rosbags') from error
    count = 0
    try:
        with Reader(path) as reader:
            chosen = _topic(path, [(c.topic, c.msgtype) for c in reader.connections], topic)
            connections = [connection for connection in reader.connections
                           if (connection.topic, connection.msgtype) == (chosen, JOINT_STATE)]
            for _, received, data in reader.messages(connections):
                yield received, bytes(data)
                count += 1
    except InputFileError:
        raise
    except Exception as error:  # rosbags lets those of sqlite, zstd and struct out
        reason = ' '.join(str(error).split()) or type(error).__name__
        if not count:
            raise InputFileError(f'{path}: found no readable bag ({reason}), allowed: a rosbag2 '
                                 'directory, or a .mcap or .db3 file') from error
        print(f'leg_fk: note: {path} is damaged after {count} joint states ({reason}); '
              'the rest is not drawn', file=sys.stderr)


def _topic(path: Path, topics: Sequence[tuple[str, str]], wanted: str | None) -> str:
    """Return the topic to read the joint states from."""
    known = sorted({name for name, kind in topics if kind == JOINT_STATE})
    topic = wanted or (DEFAULT_TOPIC if DEFAULT_TOPIC in known or len(known) != 1 else known[0])
    if topic not in known:
        raise InputFileError(f'{path}: found no joint states on {topic}, allowed: '
                             f'--joint-topic with one of {", ".join(known) or "(none there)"}')
    return topic
