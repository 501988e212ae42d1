"""Writing a file or a bag so that it is there whole or not at all."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import re
import tempfile

from icub_leg_fk.errors import OutputFileError
from icub_leg_fk.tools.signals import held_signals

STANDARD_OUTPUT = '-'

_PART_OF_BAG = re.compile(r'.*\.(mcap|db3)(\.zstd)?(-wal|-shm)?')


@contextmanager
def whole_path(
    path: str | Path, *, force: bool, may_replace: Callable[[Path], bool] = Path.is_file
) -> Iterator[Path]:
    """Give a path to make a file or directory at; it takes its place when the block ends well.

    The work is done in a hidden directory next to the target, which is removed. A target
    that exists is replaced if that is forced, and `may_replace` says that it is of the kind.

    Raises:
        OutputFileError: the target cannot be written, or must not be.
    """
    check_target(path, force=force, may_replace=may_replace)
    target = Path(os.path.realpath(path))
    try:
        with tempfile.TemporaryDirectory(
            prefix=f'.{target.name}.',
            suffix='.part',
            dir=target.parent,
            ignore_cleanup_errors=True,
        ) as work:
            new = Path(work, target.name)
            yield new
            check_target(path, force=force, may_replace=may_replace)
            with held_signals():
                if target.is_dir():
                    target.rename(Path(work, 'replaced'))
                new.replace(target)
    except OSError as error:
        raise _cannot_be_written(path, error) from error


def check_target(
    path: str | Path,
    *,
    force: bool,
    may_replace: Callable[[Path], bool] = Path.is_file,
    endings: Sequence[str] = (),
) -> None:
    """Refuse a target that `whole_path` would refuse, before any work is done.

    Args:
        path: the target.
        force: whether a target that exists is replaced.
        may_replace: says whether it is of the kind.
        endings: those that its name may have; any if there are none.

    Raises:
        OutputFileError: says why.
    """
    refuse_option_like(path)
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        raise OutputFileError(str(path), f'there is no directory {target.parent}')
    if os.path.lexists(target):
        if not may_replace(target):
            raise OutputFileError(
                str(path),
                'exists already and is something else than what '
                'would be written; nothing replaces it',
            )
        if not force:
            raise OutputFileError(str(path), 'exists already; --force replaces it')
    try:
        tempfile.TemporaryDirectory(
            prefix=f'.{target.name}.', dir=target.parent
        ).cleanup()
    except OSError as error:
        raise _cannot_be_written(path, error) from error
    ending = Path(path).suffix
    if endings and ending.lower() not in endings:
        fault = f'found {ending or "no ending"}, allowed: {", ".join(endings)}'
        raise OutputFileError(str(path), fault)


def _cannot_be_written(path: str | Path, error: OSError) -> OutputFileError:
    reason = error.strerror or str(error)
    return OutputFileError(str(path), f'cannot be written: {reason.lower()}')


def refuse_option_like(path: str | Path) -> None:
    """Refuse an output without a name, or with one that begins as an option does.

    Raises:
        OutputFileError: says why, and how such a file can be named all the same.
    """
    name = str(path).strip()
    if not name or not Path(path).name:
        raise OutputFileError(repr(str(path)), 'is not the name of a file')
    if name == STANDARD_OUTPUT:
        raise OutputFileError(
            name,
            'is standard output, which does not take this; allowed: the name of a file',
        )
    if name.startswith('-'):
        raise OutputFileError(
            name,
            f'begins with a minus sign, as options do; a file of this '
            f'name is written ./{name}',
        )


def write_text(path: str | None, text: str, *, force: bool) -> None:
    """Write a text file, whole or not at all, or to standard output if the path is None or `-`."""
    if path is None or path == STANDARD_OUTPUT:
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
    if any(entry.is_symlink() or not entry.is_file() for entry in entries):
        return False
    others = [entry for entry in entries if not _PART_OF_BAG.fullmatch(entry.name)]
    if [entry.name for entry in others] != ['metadata.yaml']:
        return False
    return b'rosbag2_bagfile_information' in others[0].read_bytes()
