"""zstd and lz4, from whichever library is installed; cut-off data gives what is there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from icub_leg_fk.errors import MissingDependencyError

COMPRESSIONS = ('', 'lz4', 'zstd')
ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'
_PIECE = 1 << 16
_PORTION = 1 << 10


def decompress(compression: str, data: bytes, limit: int) -> bytes:
    """Return data decompressed, as far as it goes.

    Args:
        compression: `zstd`, `lz4` or nothing.
        data: one compressed frame, maybe cut off.
        limit: how many bytes it may become; a frame of some kilobytes may hold a gigabyte.

    Raises:
        ValueError: the data is damaged, becomes more than that, or the compression is unknown.
        MissingDependencyError: no library for it is installed.
    """
    if not compression:
        return data
    pieces, size = [], 0
    for piece in decompress_pieces(compression, [data]):
        size += len(piece)
        if size > limit:
            raise ValueError(f'{compression} data of more than {limit} bytes')
        pieces.append(piece)
    return b''.join(pieces)


def decompress_pieces(compression: str, pieces: Iterable[bytes]) -> Iterator[bytes]:
    """Yield data decompressed, as far as it goes, in pieces.

    Args:
        compression: `zstd`, `lz4` or nothing.
        pieces: one compressed frame, maybe cut off.

    Raises:
        ValueError: the data is damaged, or the compression unknown.
        MissingDependencyError: no library for it is installed.
    """
    if not compression:
        yield from pieces
        return
    decompressor, errors = _decompressor(compression)
    for piece in pieces:
        # A little at a time, for it may grow by a factor of thousands.
        for at in range(0, len(piece), _PORTION):
            try:
                yield decompressor.decompress(piece[at:at + _PORTION])
            except errors as error:
                raise ValueError(f'damaged {compression} data') from error
            if decompressor.eof:
                return


def compressor(compression: str) -> Callable[[bytes], bytes]:
    """Return a function that compresses.

    Args:
        compression: `zstd`, `lz4` or nothing.

    Raises:
        ValueError: the compression is unknown.
        MissingDependencyError: no library for it is installed.
    """
    if compression not in COMPRESSIONS:
        raise ValueError(f'unknown compression {compression!r}')
    if not compression:
        return bytes
    if compression == 'lz4':
        return _lz4().compress  # type: ignore[no-any-return]
    return _zstd().compress  # type: ignore[no-any-return]


def decompress_file(source: Path, target: Path) -> str:
    """Decompress a zstd file, as far as it goes, and return what was wrong with it, if anything.

    Raises:
        MissingDependencyError: no library for zstd is installed.
    """
    decompressor, errors = _decompressor('zstd')
    with source.open('rb') as compressed, target.open('wb') as plain:
        while piece := compressed.read(_PIECE):
            while piece:
                if decompressor.eof:
                    decompressor, _ = _decompressor('zstd')
                try:
                    plain.write(decompressor.decompress(piece))
                except errors:
                    return f'damaged zstd data before byte {compressed.tell()}'
                piece = decompressor.unused_data if decompressor.eof else b''
    return '' if decompressor.eof else f'cut off at byte {source.stat().st_size}'


def _decompressor(compression: str) -> tuple[Any, tuple[type[Exception], ...]]:
    """Return an object that decompresses one frame piece by piece, and the errors it raises."""
    if compression == 'zstd':
        module = _zstd()
        if hasattr(module, 'ZstdFile'):  # the one of Python 3.14, or its backport
            return module.ZstdDecompressor(), (module.ZstdError, EOFError)
        return module.ZstdDecompressor().decompressobj(), (module.ZstdError,)
    if compression == 'lz4':
        return _lz4().LZ4FrameDecompressor(), (RuntimeError, EOFError)
    raise ValueError(f'unknown compression {compression!r}')


def _zstd() -> Any:
    return _first_of('zstd', 'compression.zstd', 'backports.zstd', 'zstandard')


def _lz4() -> Any:
    return _first_of('lz4', 'lz4.frame')


def _first_of(compression: str, *modules: str) -> Any:
    for module in modules:
        try:
            return import_module(module)
        except ImportError:
            continue
    raise MissingDependencyError(
        f'this bag is compressed with {compression}, which needs the Python package '
        f'{modules[-1].partition(".")[0]}: install icub_leg_fk[tools]')
