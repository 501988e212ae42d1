"""A place for a new bag that is nothing or whole: made aside, and renamed when finished.

Everything grows in the hidden directory `.NAME.partial` beside the bag NAME, which is locked while
somebody writes in it. One that a killed run has left behind is not locked, and is cleared by the
next run that writes the same bag.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import fcntl
import os
from pathlib import Path
import shutil

from icub_leg_fk.errors import OutputFileError
from icub_leg_fk.tools.bags.metadata import METADATA, read_metadata
from icub_leg_fk.tools.bags.reader import KINDS
from icub_leg_fk.tools.signals import held_signals

_ENDINGS = ('', '-wal', '-shm', '-journal')  # of a storage file and of what sqlite adds


class OutputPlace:
    """Where a bag is made.

    Args:
        target: the bag to make: a directory, or a file if its name ends in .mcap or .db3.
        replace: whether an existing bag may be replaced.

    Attributes:
        scratch: directory for what is needed meanwhile.
        bag: where to make the bag; `put` moves it to its target.

    Raises:
        OutputFileError: the target exists, or cannot be made.
    """

    def __init__(self, target: Path, replace: bool) -> None:
        self._target = target
        self._replace = replace
        self._aside = target.parent / f'.{target.name}.partial'
        self._old = self._aside / 'replaced'
        self.scratch = self._aside / 'scratch'
        self.bag = self._aside / 'new' / target.name
        self._check_target()
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            self._lock = self._locked()
        except OSError as error:
            raise OutputFileError(f'{target}: cannot be written: {error.strerror}') from error
        self._clear()
        self.scratch.mkdir()
        self.bag.parent.mkdir()

    def put(self) -> None:
        """Move the finished bag to its target.

        Raises:
            OutputFileError: the target has come into being meanwhile.
        """
        self._check_target()
        with held_signals():
            if self._target.exists():
                self._target.rename(self._old)
            self.bag.rename(self._target)

    def close(self) -> None:
        """Remove everything but a bag that has been put in its place."""
        with held_signals():
            self._clear()
            shutil.rmtree(self._aside, ignore_errors=True)
            os.close(self._lock)

    def _check_target(self) -> None:
        target = self._target
        if not os.path.lexists(target):
            return
        if not self._replace:
            raise OutputFileError(f'{target}: exists already; --force replaces it')
        if not _is_bag(target):
            raise OutputFileError(f'{target}: exists and is no bag, or more than one; '
                                  '--force replaces one bag, with its metadata.yaml')

    def _locked(self) -> int:
        """Make the hidden directory and return the descriptor that locks it."""
        while True:
            self._aside.mkdir(exist_ok=True)
            descriptor = os.open(self._aside, os.O_RDONLY | os.O_DIRECTORY)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if os.path.samestat(os.fstat(descriptor), self._aside.stat()):
                    return descriptor
            except BlockingIOError as error:
                os.close(descriptor)
                raise OutputFileError(
                    f'{self._target}: is being written by another leg_fk bag') from error
            except FileNotFoundError:  # removed by its last owner since it was opened
                pass
            os.close(descriptor)

    def _clear(self) -> None:
        if self._old.exists() and not os.path.lexists(self._target):
            self._old.rename(self._target)  # a run was killed while it replaced the bag
        for left in self._aside.iterdir():
            if left.is_dir() and not left.is_symlink():
                shutil.rmtree(left)
            else:
                left.unlink()


@contextmanager
def output_place(target: Path, replace: bool) -> Iterator[OutputPlace]:
    """Give a place to make a bag; afterwards nothing but a bag that was put is left."""
    place = OutputPlace(target, replace)
    try:
        yield place
    finally:
        place.close()


def _is_bag(path: Path) -> bool:
    """Return whether a path is a bag and nothing more, so that replacing it loses only a bag."""
    if path.is_symlink():
        return False
    if path.is_file():
        return path.suffix in KINDS
    try:
        files = read_metadata(path / METADATA).files or ()
    except (ValueError, OSError):
        return False
    known = {METADATA, *(f'{file}{ending}' for file in files for ending in _ENDINGS)}
    return all(entry.name in known and entry.is_file() and not entry.is_symlink()
               for entry in path.iterdir())
