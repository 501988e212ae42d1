"""Recordings of joints as JointState messages, also those that are not made of messages.

So all of them are read by the same rules: those of the node.
"""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
import struct

from icub_leg_fk.tools.progress import Progress

SECOND = 1_000_000_000  # ns

_ENCAPSULATION = b'\x00\x01\x00\x00'  # CDR, little-endian

Messages = Iterator[
    tuple[int, bytes]
]  # time of recording [ns] and CDR bytes of a JointState


class Part(ABC):
    """A recording of some joints of a robot.

    Attributes:
        path: where it is.
        topic: topics of the joint states; empty if it has no topics.
        joint_names: the joints that it brings.
        is_relative: whether its times count from something else than 1970.
        notes: what a user should know of it, one line each.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topic = ''
        self.joint_names: tuple[str, ...] = ()
        self.is_relative = False
        self.notes: list[str] = []

    @abstractmethod
    def messages(self, progress: Progress | None = None) -> Messages:
        """Yield time of recording [ns] and CDR bytes of each JointState.

        Raises:
            InputFileError: it cannot be read to its end, or has a mistake; says where.
        """

    @abstractmethod
    def span(self) -> tuple[int, int]:
        """Return the first and the last time [ns]."""

    def topics_with(self, joints: Collection[str]) -> list[str]:
        """Return the other topics of the same file that have some joints."""
        return []


class JointStateEncoder:
    """Serializes JointStates with the same names, which have positions only.

    Args:
        names: n joint names.
    """

    def __init__(self, names: Sequence[str]) -> None:
        count = struct.pack('<I', len(names))
        head = _padded(_string(''), 4) + count
        for name in names:
            head += _padded(_string(name), 4)
        self._head = _padded(
            head + count, 8
        )  # as it is aligned after a stamp of 8 bytes
        self._pack = struct.Struct(f'<4siI{len(self._head)}s{len(names)}dII').pack

    def encode(self, stamp: int, positions: Sequence[float]) -> bytes:
        """Return the bytes of a message.

        Args:
            stamp: the time [ns].
            positions: n joint positions [rad or m].
        """
        sec, nanosec = divmod(stamp, SECOND)
        return self._pack(_ENCAPSULATION, sec, nanosec, self._head, *positions, 0, 0)


def _string(text: str) -> bytes:
    """Return a string as CDR has it."""
    data = text.encode() + b'\0'
    return struct.pack('<I', len(data)) + data


def _padded(data: bytes, size: int) -> bytes:
    """Return bytes filled up to a multiple of a size."""
    return data + bytes(-len(data) % size)
