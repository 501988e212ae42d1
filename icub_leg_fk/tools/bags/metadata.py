"""A bag's metadata.yaml: what of an old one is used, and the text of a new one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from icub_leg_fk.tools.bags.topics import Topic
import yaml

METADATA = 'metadata.yaml'
VERSION = 9
ROS_DISTRO = 'jazzy'
_HEADING = 'rosbag2_bagfile_information'

# rmw/types.h; up to version 8 of the metadata, policies were written as numbers.
_POLICIES = {
    'history': ('system_default', 'keep_last', 'keep_all', 'unknown'),
    'reliability': ('system_default', 'reliable', 'best_effort', 'unknown', 'best_available'),
    'durability': ('system_default', 'transient_local', 'volatile', 'unknown', 'best_available'),
    'liveliness': ('system_default', 'automatic', 'manual_by_node', 'manual_by_topic', 'unknown',
                   'best_available'),
}


class OldMetadata(NamedTuple):
    """What an existing metadata.yaml says.

    Attributes:
        storage: `mcap` or `sqlite3`; empty if it does not say.
        files: names of the storage files, in order; None if it does not say.
        message_compression: whether each message is compressed by itself.
        topics: topics, without definitions.
        custom_data: a user's own entries.
    """

    storage: str = ''
    files: tuple[str, ...] | None = None
    message_compression: bool | None = None
    topics: tuple[Topic, ...] = ()
    custom_data: Mapping[str, str] = {}


def read_metadata(path: Path) -> OldMetadata:
    """Read a metadata.yaml.

    Raises:
        ValueError: it is damaged.
        OSError: it cannot be read.
    """
    try:
        information = yaml.safe_load(path.read_text())[_HEADING]
        listed = [entry['topic_metadata'] for entry in information['topics_with_message_count']]
        return OldMetadata(
            storage=_text(information['storage_identifier']),
            files=tuple(Path(_text(name)).name for name in information['relative_file_paths']),
            message_compression=str(
                information.get('compression_mode', '')).lower() == 'message',
            topics=tuple(Topic(
                _text(entry['name']), _text(entry['type']), _text(entry['serialization_format']),
                _qos_text(entry.get('offered_qos_profiles')),
                _text(entry.get('type_description_hash') or '')) for entry in listed),
            custom_data={_text(key): _text(value) for key, value in
                         (information.get('custom_data') or {}).items()})
    except (yaml.YAMLError, KeyError, TypeError, AttributeError, RecursionError,
            UnicodeError) as error:
        raise ValueError('damaged') from error


def describe(storage: str, file: str, topics: Sequence[Topic], counts: Sequence[int],
             start: int, end: int, custom_data: Mapping[str, str]) -> dict[str, Any]:
    """Return what is to stand in a bag's metadata, without the heading.

    Args:
        storage: `mcap` or `sqlite3`.
        file: name of the storage file.
        topics: the topics.
        counts: messages of each topic.
        start: time of the first message [ns].
        end: time of the last message [ns].
        custom_data: a user's own entries.
    """
    total = sum(counts)
    span = {
        'starting_time': {'nanoseconds_since_epoch': start if total else 0},
        'duration': {'nanoseconds': end - start if total else 0},
        'message_count': total,
    }
    return {
        'version': VERSION,
        'storage_identifier': storage,
        **span,
        'topics_with_message_count': [
            {'topic_metadata': {
                'name': topic.name,
                'type': topic.type_name,
                'serialization_format': topic.serialization_format,
                'offered_qos_profiles': _profiles(topic.qos),
                'type_description_hash': topic.type_hash},
             'message_count': count}
            for topic, count in zip(topics, counts, strict=True)],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [file],
        'files': [{'path': file, **span}],
        'custom_data': dict(custom_data) or None,
        'ros_distro': ROS_DISTRO,
    }


def metadata_file_text(description: Mapping[str, Any]) -> str:
    """Return the text of a metadata.yaml."""
    return as_yaml({_HEADING: dict(description)})


def as_yaml(value: Any) -> str:
    """Return a value as YAML without references, which rosbag2 does not expect."""
    return yaml.dump(value, Dumper=_PlainDumper, sort_keys=False)


class _PlainDumper(yaml.SafeDumper):

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(value: Any) -> str:
    """Return a value as text; raises UnicodeEncodeError if no file could hold that."""
    text = str(value)
    text.encode()
    return text


def _qos_text(profiles: Any) -> str:
    """Return offered QoS profiles, which stand as text or as a list, as text."""
    if isinstance(profiles, list):
        return yaml.safe_dump(profiles, sort_keys=False).strip() if profiles else ''
    return _text(profiles or '')


def _profiles(qos: str) -> list[dict[str, Any]]:
    """Return offered QoS profiles with the names of their policies; nothing if unreadable."""
    try:
        return [_profile(profile) for profile in yaml.safe_load(qos) or []]
    except (yaml.YAMLError, ArithmeticError, KeyError, TypeError, ValueError, IndexError,
            RecursionError):
        return []


def _profile(old: Mapping[str, Any]) -> dict[str, Any]:
    def policy(name: str) -> str:
        value = old[name]
        return _POLICIES[name][value] if isinstance(value, int) else str(value)

    def duration(name: str) -> dict[str, int]:
        return {part: int(old[name][part]) for part in ('sec', 'nsec')}

    return {
        'history': policy('history'),
        'depth': int(old['depth']),
        'reliability': policy('reliability'),
        'durability': policy('durability'),
        'deadline': duration('deadline'),
        'lifespan': duration('lifespan'),
        'liveliness': policy('liveliness'),
        'liveliness_lease_duration': duration('liveliness_lease_duration'),
        'avoid_ros_namespace_conventions': bool(old['avoid_ros_namespace_conventions']),
    }
