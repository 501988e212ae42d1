"""Reading a text file line by line."""

from collections.abc import Iterator
import io
from pathlib import Path

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.tools.progress import Progress

_LINES = 1000  # between two looks at how far a file is read


def lines_of(
    path: Path, encoding: str, progress: Progress | None = None
) -> Iterator[str]:
    """Yield the lines of a text file.

    Args:
        path: the file.
        encoding: of its text.
        progress: called now and then with the share that is read, 0 to 1.

    Raises:
        InputFileError: it cannot be read, or is not text of this encoding.
    """
    try:
        with path.open('rb') as stream:
            size = max(1, path.stat().st_size)
            for number, line in enumerate(io.TextIOWrapper(stream, encoding)):
                if progress is not None and number % _LINES == 0:
                    progress(stream.tell() / size)
                yield line
    except UnicodeDecodeError as error:
        fault = f'is not text in {encoding}: {error.reason}'
        raise InputFileError(str(path), fault) from error
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputFileError(str(path), f'cannot be read: {reason}') from error
