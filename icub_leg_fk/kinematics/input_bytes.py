"""Reading a file that a user has named."""

import os
from pathlib import Path

from icub_leg_fk.errors import CatalogError


def shown(path: str | Path) -> str:
    """Return a path as errors show it: quoted if it is empty or not printable."""
    text = str(path)
    return text if text and text.isprintable() else repr(text)


def first_bytes(path: str | Path, most: int) -> bytes:
    """Return the first bytes of a file, as many as there are.

    Raises:
        CatalogError: it cannot be read; says why.
    """
    try:
        with open(os.fspath(path), 'rb') as stream:
            return stream.read(most)
    # a TypeError for what is no path, a ValueError for a zero byte in it
    except (OSError, TypeError, ValueError) as error:
        reason = getattr(error, 'strerror', None) or str(error)
        raise CatalogError(
            shown(path), 0, '', reason.lower(), 'a readable file'
        ) from None
