"""Recordings of joints as JointState messages, also those that are not made of messages.

So all of them are read by the same rules: those of the node.
"""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator
from pathlib import Path

from icub_leg_fk.tools.progress import Progress

SECOND = 1_000_000_000  # ns
PREFIX_OPTION = '--joint-prefix '  # and what is put before the names of joints

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
