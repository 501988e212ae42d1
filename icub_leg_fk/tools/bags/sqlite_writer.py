"""Writes one sqlite3 file as rosbag2 does (its schema version 4)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import sqlite3

from icub_leg_fk.tools.bags.metadata import ROS_DISTRO, VERSION
from icub_leg_fk.tools.bags.topics import Message, Topic

# Word for word what rosbag2's sqlite_storage.cpp creates. No journal: a file that was not
# finished is never seen.
_CREATE = """
PRAGMA journal_mode = OFF;
PRAGMA synchronous = OFF;
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY,ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY,metadata_version INTEGER NOT NULL,metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL,type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(id INTEGER PRIMARY KEY,topic_type TEXT NOT NULL,encoding TEXT NOT NULL,encoded_message_definition TEXT NOT NULL,type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
"""  # noqa: E501
_INSERT = 'INSERT INTO messages (timestamp, topic_id, data) VALUES (?, ?, ?)'


class SqliteWriter:
    """Writes a sqlite3 file.

    Args:
        path: the file to create.
        topics: all topics; a message names its own by its index here.

    Attributes:
        counts: messages of each topic.
        start: time of the first message [ns].
        end: time of the last message [ns].
    """

    def __init__(self, path: Path, topics: Sequence[Topic]) -> None:
        self.counts = [0] * len(topics)
        self.start, self.end = 1 << 63, 0
        self._database = sqlite3.connect(path)
        self._database.executescript(_CREATE)
        self._database.execute('INSERT INTO schema VALUES (4, ?)', (ROS_DISTRO,))
        self._database.executemany(
            'INSERT INTO topics VALUES (?, ?, ?, ?, ?, ?)',
            [(number, *topic[:5]) for number, topic in enumerate(topics, 1)])
        definitions = {
            topic.type_name: (topic.type_name, topic.encoding, topic.definition, topic.type_hash)
            for topic in topics if topic.definition}
        self._database.executemany(
            'INSERT INTO message_definitions (topic_type, encoding, encoded_message_definition, '
            'type_description_hash) VALUES (?, ?, ?, ?)', definitions.values())

    def write(self, messages: Sequence[Message]) -> None:
        """Write messages that are in the order of their time."""
        counts = self.counts
        rows = []
        for topic, _, time, _, data in messages:
            counts[topic] += 1
            rows.append((time, topic + 1, data))
        if rows:
            self.start = min(self.start, min(row[0] for row in rows))
            self.end = max(self.end, max(row[0] for row in rows))
        self._database.executemany(_INSERT, rows)

    def flush(self) -> None:
        """Now `counts`, `start` and `end` are final; here for the likeness of MCAP."""

    def close(self, metadata: str) -> None:
        """Write what is pending and the metadata.

        Args:
            metadata: the bag's metadata, YAML.
        """
        self._database.execute('INSERT INTO metadata (metadata_version, metadata) VALUES (?, ?)',
                               (VERSION, metadata))
        self._database.commit()
        self._database.close()

    def abandon(self) -> None:
        """Close the file as it is, if it is open."""
        self._database.close()
