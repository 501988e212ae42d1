"""Reads a bag, whatever its storage, compression and state: its topics and messages in blocks."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
import os
from pathlib import Path
import re
import shutil
from typing import NamedTuple

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.tools.bags.compression import decompress, decompress_file, ZSTD_MAGIC
from icub_leg_fk.tools.bags.mcap_reader import McapFile
from icub_leg_fk.tools.bags.metadata import METADATA, OldMetadata, read_metadata
from icub_leg_fk.tools.bags.sqlite_reader import SqliteFile, torn_bytes
from icub_leg_fk.tools.bags.topics import Message, Topic

KINDS: Mapping[str, str] = {'.mcap': 'mcap', '.db3': 'sqlite3'}
"""Storage by the ending of a file's name."""

_LARGEST_MESSAGE = 1 << 28  # bytes, decompressed
_ENDING = re.compile(r'(\.mcap|\.db3)(\.zstd)?$')


class _StorageFile(NamedTuple):
    path: Path
    ending: str
    compressed: bool
    indices: dict[int, int]


class BagReader:
    """An open bag: a directory, or a single storage file.

    Args:
        path: the bag.
        scratch: directory for files that have to be decompressed to be read.

    Attributes:
        path: the bag.
        storage: `mcap` or `sqlite3`.
        compression: compression of the chunks: `zstd`, `lz4` or nothing.
        topics: its topics.
        custom_data: a user's own entries of the metadata.
        damage: what could not be read, as far as it is known.
        attachments: how many MCAP attachments there are.
        late: messages behind others that were recorded after them, too far off to be sorted.
        progress: share of the bag that has been read, 0 to 1.

    Raises:
        InputFileError: there is no bag, or nothing in it can be read.
    """

    def __init__(self, path: Path, scratch: Path) -> None:
        self.path = path
        self.topics: list[Topic] = []
        self.damage: list[str] = []
        self.attachments = 0
        self.late = 0
        self.progress = 0.0
        self._scratch = scratch
        self._made: list[Path] = []
        self._undecodable = 0
        self._metadata = self._read_metadata()
        self.custom_data = self._metadata.custom_data
        self.compression = ''
        self._files = [self._describe(file) for file in self._find_files()]
        if not self.topics:
            reason = self.damage[0] if self.damage else 'it has no topics'
            raise InputFileError(f'{path}: nothing can be read: {reason}')
        self._add_silent_topics()
        self.storage = KINDS[self._files[0].ending]

    def blocks(self, wanted: Collection[int]) -> Iterator[list[Message]]:
        """Yield the messages, file by file and in order of their time, some at a time.

        Args:
            wanted: indices of the topics to read.
        """
        sizes = [file.path.stat().st_size for file in self._files]
        before = 0
        for file, size in zip(self._files, sizes, strict=True):
            if not file.indices:
                continue
            found: list[str] = []
            plain = self._plain(file.path, file.compressed, found)
            try:
                storage = self._open(plain, file.ending)
                plain_size = max(plain.stat().st_size, 1)
                indices = {number: index for number, index in file.indices.items()
                           if index in wanted}
                for block in storage.blocks(indices):
                    share = min(storage.done / plain_size, 1.0)
                    self.progress = (before + size * share) / max(sum(sizes), 1)
                    yield self._uncompressed(block)
                self._blame(file.path, found + storage.damage)
                self.late += storage.late
            finally:
                self._clear_scratch()
            before += size
        if self._undecodable:
            self.damage.append(f'{self._undecodable} messages have zstd data that are damaged, or '
                               f'become more than {_LARGEST_MESSAGE} bytes')

    def _read_metadata(self) -> OldMetadata:
        file = self.path / METADATA
        if self.path.is_dir():
            try:
                return read_metadata(file)
            except FileNotFoundError:
                self.damage.append(f'{METADATA} is missing')
            except (ValueError, OSError) as error:
                self.damage.append(f'{METADATA} cannot be read: {error}')
        elif not self.path.exists():
            raise InputFileError(f'{self.path}: there is no such bag')
        return OldMetadata()

    def _find_files(self) -> list[Path]:
        if not self.path.is_dir():
            if not _ENDING.search(self.path.name):
                raise InputFileError(f'{self.path}: found a file, allowed: a bag, which is a '
                                     'directory or ends in .mcap or .db3')
            return [self.path]
        present = sorted((file for file in self.path.iterdir() if _ENDING.search(file.name)),
                         key=_in_natural_order)
        if self._metadata.files is None:
            if not present:
                raise InputFileError(f'{self.path}: found a directory without bag files, allowed: '
                                     'a directory with .mcap or .db3 files')
            return present
        listed = [self.path / name for name in self._metadata.files]
        self.damage += [f'{file.name} is missing' for file in listed if not file.is_file()]
        return [file for file in listed if file.is_file()]

    def _describe(self, path: Path) -> _StorageFile:
        """Find out the topics of a file."""
        match = _ENDING.search(path.name)
        if match is None:
            raise InputFileError(f'{path}: found a storage file of an unknown kind, allowed: '
                                 '.mcap or .db3')
        ending, compressed = match[1], match[2] is not None
        found: list[str] = []
        plain = self._plain(path, compressed, found)
        try:
            storage = self._open(plain, ending)
        finally:
            self._clear_scratch()
        if not storage.topics:
            self._blame(path, storage.damage)
        self.attachments += storage.attachments
        self.compression = self.compression or storage.compression
        return _StorageFile(path, ending, compressed, {
            number: self._index(topic) for number, topic in storage.topics.items()})

    def _open(self, path: Path, ending: str) -> McapFile | SqliteFile:
        return McapFile(path, self._scratch) if ending == '.mcap' else SqliteFile(path)

    def _index(self, topic: Topic) -> int:
        known = next((known for known in self._metadata.topics
                      if known[:3] == topic[:3]), topic)
        topic = topic._replace(qos=topic.qos or known.qos,
                               type_hash=topic.type_hash or known.type_hash)
        if topic not in self.topics:
            self.topics.append(topic)
        return self.topics.index(topic)

    def _add_silent_topics(self) -> None:
        """Add the topics without any message, of which only the metadata may tell."""
        for topic in self._metadata.topics:
            if all(topic[:3] != present[:3] for present in self.topics):
                like = next((present for present in self.topics
                             if present.type_name == topic.type_name), topic)
                self.topics.append(topic._replace(encoding=like.encoding,
                                                  definition=like.definition))

    def _plain(self, path: Path, compressed: bool, damage: list[str]) -> Path:
        """Return a file to read: decompressed, and such that reading leaves the bag as it is."""
        plain = path
        if compressed:
            plain = self._scratch / path.stem
            self._made.append(plain)
            if problem := decompress_file(path, plain):
                damage.append(problem)
        if plain.suffix == '.db3':
            torn, log = torn_bytes(plain), Path(f'{plain}-wal')
            if torn or (log.exists() and log.stat().st_size):
                plain = self._copy_to_scratch(plain, log, torn)
            if torn:
                damage.append('is cut off')
        return plain

    def _copy_to_scratch(self, file: Path, log: Path, torn: int) -> Path:
        """Return a copy without a torn page, with the write-ahead log, which reading changes."""
        copy = self._scratch / f'copy_{file.name}'
        self._made += [copy, *(Path(f'{copy}{ending}') for ending in ('-wal', '-shm'))]
        shutil.copyfile(file, copy)
        os.truncate(copy, file.stat().st_size - torn)
        if log.exists():
            shutil.copyfile(log, f'{copy}-wal')
        return copy

    def _clear_scratch(self) -> None:
        while self._made:
            self._made.pop().unlink(missing_ok=True)

    def _uncompressed(self, block: list[Message]) -> list[Message]:
        """Return messages that may each be compressed, as only the metadata can tell, plain."""
        if self._metadata.message_compression is False:
            return block
        plain = []
        for message in block:
            *others, data = message
            if data.startswith(ZSTD_MAGIC):
                try:
                    data = decompress('zstd', data, _LARGEST_MESSAGE)
                except ValueError:
                    self._undecodable += 1
                    continue
                message = (*others, data)  # type: ignore[assignment]
            plain.append(message)
        return plain

    def _blame(self, path: Path, damage: list[str]) -> None:
        self.damage += [f'{path.name} {problem}' for problem in damage]


def _in_natural_order(path: Path) -> list[int | str]:
    """Return a key that sorts bag_2 before bag_10."""
    return [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', path.name)]
