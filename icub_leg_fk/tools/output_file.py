"""Writing a file or a bag so that it is there whole or not at all."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import re
import tempfile

from icub_leg_fk.errors import OutputFileError
from icub_leg_fk.tools.signals import held_signals


@contextmanager
def whole_path(path: str | Path, *, force: bool,
               may_replace: Callable[[Path], bool] = Path.is_file) -> Iterator[Path]:
    """Give a path to make a file or directory at; it takes its place when the block ends well.

    The work is done in a hidden directory beside the target, of which nothing is left. A target
    that exists is replaced if that is forced, and `may_replace` says that it is of the kind.
    """
    target = Path(os.path.realpath(path))
    check_target(path, force=force, may_replace=may_replace)
    try:
        with tempfile.TemporaryDirectory(prefix=f'.{target.name}.', suffix='.part',
                                         dir=target.parent, ignore_cleanup_errors=True) as work:
            new = Path(work, target.name)
            yield new
            check_target(path, force=force, may_replace=may_replace)
            with held_signals():
                if target.is_dir():
                    target.rename(Path(work, 'replaced'))
                new.replace(target)
    except OSError as error:
        raise OutputFileError(f'{path}: {error.strerror or error}') from error


def check_target(path: str | Path, *, force: bool,
                 may_replace: Callable[[Path], bool] = Path.is_file) -> None:
    """Refuse a target that `whole_path` would refuse, before any work is done."""
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        raise OutputFileError(f'{path}: there is no directory {target.parent}')
    if os.path.lexists(target):
        if not may_replace(target):
            raise OutputFileError(f'{path}: exists already and is something else than what would '
                                  'be written; nothing replaces it')
        if not force:
            raise OutputFileError(f'{path}: exists already; --force replaces it')


def write_text(path: str | None, text: str, *, force: bool) -> None:
    """Write a text file, whole or not at all, or without a path to standard output."""
    if path is None:
        print(text, end='')
        return
    with whole_path(path, force=force) as new:
        new.write_text(text, encoding='utf-8')


def is_bag(path: Path) -> bool:
    """Return whether a path is a bag and nothing more, so that replacing it loses only a bag."""
    if path.is_symlink():
        return False
    if not path.is_dir():
        return path.is_file() and path.suffix in ('.mcap', '.db3')
    entries = list(path.iterdir())
    others = [entry for entry in entries
              if not re.search(r'\.(mcap|db3)(\.zstd)?(-wal|-shm)?$', entry.name)]
    return (all(entry.is_file() and not entry.is_symlink() for entry in entries)
            and [entry.name for entry in others] == ['metadata.yaml']
            and b'rosbag2_bagfile_information' in others[0].read_bytes())
