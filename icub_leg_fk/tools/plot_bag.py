"""Joint positions of chains from a bag, by the node's own input rules."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.ros.configuration import DEFAULT_TIMEOUT
from icub_leg_fk.ros.joint_input import JointInput
from icub_leg_fk.ros.joint_stream import JointStream, OnReady
from icub_leg_fk.tools.bags.reader import BagReader
from icub_leg_fk.tools.bags.topics import JOINT_STATE
from icub_leg_fk.tools.recording import ChainTrack
import numpy as np

DEFAULT_TOPIC = '/joint_states'


@dataclass
class BagTracks:
    """What chains did in a bag.

    Attributes:
        tracks: one per chain that has a pose at all; times from the first pose on.
        poseless: chains without a pose, and the joints that were missing.
        damage: what of the bag could not be read.
    """

    tracks: list[ChainTrack] = field(default_factory=list)
    poseless: list[str] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)


@dataclass
class _Rows:
    """The joint vectors of one chain, 8 bytes a number."""

    stamps: array[int] = field(default_factory=lambda: array('q'))
    positions: array[float] = field(default_factory=lambda: array('d'))

    def handler(self) -> OnReady:
        def keep(sec: int, nanosec: int, q: Sequence[float], _: Sequence[float] | None) -> None:
            self.stamps.append(sec * 1_000_000_000 + nanosec)
            self.positions.extend(q)
        return keep

    def track(self, chain: Chain, start: int) -> ChainTrack:
        times = (np.frombuffer(self.stamps, dtype=np.int64) - start) / 1e9
        return ChainTrack(chain, times, np.frombuffer(self.positions).reshape(len(times), -1))


class _Clock:
    """Knows when the bag received the present message, for one without a stamp [ns]."""

    now = 0


def read_bag(path: Path, chains: Sequence[Chain], topic: str | None) -> BagTracks:
    """Return what some chains did in a bag.

    Args:
        path: directory of a rosbag2 bag, or one of its files.
        chains: the chains wanted.
        topic: topic of the joint states; None for `/joint_states`, or the only one there is.

    Raises:
        InputFileError: the bag cannot be read, has no such topic, or no chain has a pose.
    """
    clock, rows = _Clock(), [_Rows() for _ in chains]
    stream = JointStream(JointInput(chains, DEFAULT_TIMEOUT), now=lambda: clock.now)
    stream.on_ready = [row.handler() for row in rows]
    with TemporaryDirectory() as scratch:
        bag = BagReader(path, Path(scratch))
        for block in bag.blocks(_joint_topics(bag, topic)):
            for _, _, received, _, data in block:
                clock.now = received
                stream.feed(data)
    joint_input = stream.settle()
    start = min((row.stamps[0] for row in rows if row.stamps), default=0)
    found = BagTracks(damage=bag.damage)
    for index, (chain, row) in enumerate(zip(chains, rows, strict=True)):
        if row.stamps:
            found.tracks.append(row.track(chain, start))
        else:
            found.poseless.append(f'{chain.name} needs {_unknown(joint_input, index)}')
    if not found.tracks:
        raise InputFileError(f'{path}: found no pose in {joint_input.messages} joint states: '
                             f'{"; ".join(found.poseless + found.damage)}')
    return found


def _joint_topics(bag: BagReader, wanted: str | None) -> list[int]:
    """Return the indices of the topic to read the joint states from."""
    known = sorted({topic.name for topic in bag.topics if topic.type_name == JOINT_STATE})
    name = wanted or (DEFAULT_TOPIC if DEFAULT_TOPIC in known or len(known) != 1 else known[0])
    if name not in known:
        raise InputFileError(f'{bag.path}: found no joint states on {name}, allowed: '
                             f'--joint-topic with one of {", ".join(known) or "(none there)"}')
    return [index for index, topic in enumerate(bag.topics)
            if (topic.name, topic.type_name) == (name, JOINT_STATE)]


def _unknown(joint_input: JointInput, chain: int) -> str:
    """Return what a chain without a pose lacked."""
    known = joint_input.known_joints(chain)
    names = [name for name in joint_input.chains[chain].joint_names if name not in known]
    return ', '.join(names) or 'joint positions that are finite and fresh'
