"""Reads the messages of one sqlite3 file of a bag in blocks, whole or not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
import sqlite3
from urllib.parse import quote

from icub_leg_fk.tools.bags.topics import Message, Topic

_BLOCK = 1 << 20  # bytes
_ROWS = 4096
_MAGIC = b'SQLite format 3\x00'
_FIRST_LEAP = 1_000_000  # ns
_TOO_FAR = 1 << 60
_COLUMNS = 'SELECT topic_id, timestamp, id, data FROM messages'
_BY_TIME = (f'{_COLUMNS} WHERE timestamp >= :time AND (timestamp > :time OR id > :number) '
            'ORDER BY timestamp, id')
_BY_NUMBER = (f'{_COLUMNS} NOT INDEXED WHERE timestamp >= 0 AND id > :number '
              'ORDER BY id')  # the order of recording


class SqliteFile:
    """One sqlite3 file.

    Attributes:
        path: the file.
        topics: its topics by their id.
        damage: what could not be read.
        compression: none; here for the likeness of MCAP.
        attachments: none.
        late: none; they are sorted by an index.
        done: bytes read so far.
    """

    compression = ''
    attachments = 0
    late = 0

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[int, Topic] = {}
        self.damage: list[str] = []
        self.done = 0
        log = Path(f'{path}-wal')
        self._access = 'mode=ro' if log.exists() and log.stat().st_size else 'immutable=1'
        try:
            self._describe()
        except (sqlite3.Error, ValueError) as error:
            self._access = 'immutable=1'
            try:
                self._describe()
                self.damage.append(f'write-ahead log cannot be read: {error}')
            except (sqlite3.Error, ValueError):
                self.damage.append(f'topics cannot be read: {error}')

    def blocks(self, indices: Mapping[int, int]) -> Iterator[list[Message]]:
        """Yield the messages in order of their time, some at a time.

        Args:
            indices: index that a message's topic is to have, by topic id; others are left out.
        """
        if not self.topics:
            return
        with closing(self._connect()) as database:
            yield from self._blocks(database, indices)

    def _connect(self) -> sqlite3.Connection:
        """Open the file for reading; with its write-ahead log, if a killed recorder left one."""
        database = sqlite3.connect(f'file:{quote(str(self.path))}?{self._access}', uri=True)
        # Without this, sqlite refuses a file that is shorter than its header says.
        database.execute('PRAGMA writable_schema = ON')
        database.text_factory = lambda data: data.decode('utf-8', 'replace')
        return database

    def _describe(self) -> None:
        # Older recorders had fewer columns and no definitions; see rosbag2's sqlite_storage.cpp.
        with closing(self._connect()) as database:
            known = {row[1] for row in database.execute('PRAGMA table_info(topics)')}
            columns = ', '.join(
                column if column in known else "''" for column in
                ('name', 'type', 'serialization_format', 'offered_qos_profiles',
                 'type_description_hash'))
            definitions = {}
            if database.execute('PRAGMA table_info(message_definitions)').fetchall():
                definitions = {row[0]: row[1:] for row in database.execute(
                    'SELECT topic_type, encoding, encoded_message_definition '
                    'FROM message_definitions')}
            for number, *fields in database.execute(
                    f'SELECT id, {columns} FROM topics ORDER BY id'):
                self.topics[number] = Topic(*map(_text, (
                    *fields, *definitions.get(fields[1], ('', '')))))

    def _blocks(self, database: sqlite3.Connection,
                indices: Mapping[int, int]) -> Iterator[list[Message]]:
        block: list[Message] = []
        size, odd = 0, 0
        query, leap = _BY_TIME, 0
        place = {'time': _first_time(database), 'number': -1}
        while leap < _TOO_FAR:
            try:
                for topic, time, number, data in database.execute(query, place):
                    if (type(data) is not bytes or type(time) is not int
                            or topic not in self.topics):
                        odd += 1
                        continue
                    place, leap = {'time': time, 'number': number}, 0
                    size += len(data)
                    if topic in indices:
                        block.append((indices[topic], 0, time, time, data))
                    if size >= _BLOCK or len(block) >= _ROWS:
                        self.done += size
                        yield block
                        block, size = [], 0
                break
            except sqlite3.DatabaseError as error:
                # Leap over what is damaged, twice as far each time that leads nowhere.
                time, number = place.values()
                if not leap:
                    self.damage.append(f'messages behind number {number} (at {time / 1e9:.3f} s) '
                                       f'are unreadable: {error}')
                    if query is _BY_TIME and not _index_is_readable(database):
                        query = _BY_NUMBER
                leap = 2 * leap or (1 if query is _BY_NUMBER else _FIRST_LEAP)
                if query is _BY_NUMBER:
                    place['number'] += leap
                else:
                    place = {'time': time + leap, 'number': -1}
        self.done += size
        if odd:
            self.damage.append(f'{odd} messages have no topic, no time or no data')
        if block:
            yield block


def torn_bytes(path: Path) -> int:
    """Return how many bytes of a page that is cut off stand at the end of a file.

    Of such a page sqlite would take the missing part for zeros, and so give false messages.
    """
    with path.open('rb') as file:
        header = file.read(18)
    page_size = int.from_bytes(header[16:], 'big')
    if page_size == 1:  # as the file format puts it
        page_size = 65536
    return path.stat().st_size % page_size if header.startswith(_MAGIC) and page_size else 0


def _text(value: object) -> str:
    """Return a value of a text column, in which sqlite holds anything, as text."""
    if isinstance(value, bytes):
        return value.decode('utf-8', 'replace')
    return '' if value is None else str(value)


def _first_time(database: sqlite3.Connection) -> int:
    try:
        found = database.execute('SELECT min(timestamp) FROM messages '
                                 'WHERE timestamp >= 0').fetchone()[0]
    except sqlite3.DatabaseError:
        return 0
    return found if isinstance(found, int) else 0


def _index_is_readable(database: sqlite3.Connection) -> bool:
    try:
        database.execute('SELECT count(timestamp) FROM messages WHERE timestamp >= 0').fetchone()
    except sqlite3.DatabaseError:
        return False
    return True
