"""Writing a file so that it is there whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
from typing import BinaryIO

from icub_leg_fk.errors import OutputFileError


@contextmanager
def whole_file(path: str | Path) -> Iterator[BinaryIO]:
    """Give a file beside the one to write; it takes that one's place when the block ends well.

    Raises:
        OutputFileError: it cannot be written, or something else than a file stands there.
    """
    target = Path(os.path.realpath(path))
    part = target.with_name(f'.{target.name}.{os.getpid()}.part')
    try:
        if target.exists() and not target.is_file():
            raise OutputFileError(f'{path}: found something else than a file, allowed: a file')
        try:
            with part.open('wb') as stream:
                yield stream
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise OutputFileError(f'{path}: {error.strerror or error}') from error


def write_text(path: str | Path, text: str) -> None:
    """Write a text file, whole or not at all.

    Raises:
        OutputFileError: as for `whole_file`.
    """
    with whole_file(path) as stream:
        stream.write(text.encode())
