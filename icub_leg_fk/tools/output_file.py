"""Writing a file so that it is there whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from icub_leg_fk.errors import OutputFileError


def write_text(path: str | Path, text: str) -> None:
    """Write a text file beside its place and rename it, so that no half of it is ever seen.

    Raises:
        OutputFileError: it cannot be written, or something else than a file stands there.
    """
    target = Path(os.path.realpath(path))
    part = target.with_name(f'.{target.name}.{os.getpid()}.part')
    try:
        if target.exists() and not target.is_file():
            raise OutputFileError(f'{path}: found something else than a file, allowed: a file')
        try:
            part.write_text(text, encoding='utf-8')
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise OutputFileError(f'{path}: {error.strerror}') from error
