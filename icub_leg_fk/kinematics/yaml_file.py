"""From a YAML file of any content to one tree of nodes that know their lines, or one error.

`yaml.safe_load` would forget the lines, keep only the last of two equal keys, expand aliases and
read `1:30` as 90. Here the text is bounded in size and depth, holds one document without aliases
and tags, and becomes yaml's nodes: plain text with its place.
"""

from __future__ import annotations

from pathlib import Path
import re
from typing import Any, NoReturn

from icub_leg_fk.errors import CatalogError
import yaml

MAX_BYTES = 1_000_000
MAX_DEPTH = 16

# libyaml, where PyYAML was built with it, is thirty times as fast as the loader in Python.
Loader: Any = getattr(yaml, 'CBaseLoader', yaml.BaseLoader)

_UNPRINTABLE = re.compile('[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]')


def read_nodes(path: str | Path) -> tuple[str, yaml.Node]:
    """Return the name of a YAML file, for errors, and the root of its nodes.

    Raises:
        CatalogError: it cannot be read, is too large, nests too deep, holds an alias, a tag or
            more than one document, or is no YAML.
    """
    file = str(path) if str(path).isprintable() else repr(str(path))
    text = _decode(file, _read(file, path))
    try:
        _refuse_surprises(file, text)
        node = yaml.compose(text, Loader=Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None) or getattr(error, 'context_mark', None)
        problem = getattr(error, 'problem', None) or getattr(error, 'context', None) or error
        line = mark.line + 1 if mark else 0
        if 'nesting depth' in str(problem):  # libyaml looks ahead, and has a limit of its own
            _fail_too_deep(file, line)
        found = f'no YAML: {" ".join(str(problem).split())}'
        _fail(file, line, found, 'well-formed YAML')
    if node is None:
        _fail(file, 0, 'nothing', 'units and chains')
    return file, node


def _fail(file: str, line: int, found: str, allowed: str) -> NoReturn:
    raise CatalogError(file, line, 'kinematics file', found, allowed) from None


def _fail_too_deep(file: str, line: int) -> NoReturn:
    _fail(file, line, f'more than {MAX_DEPTH} nested levels', f'at most {MAX_DEPTH}')


def _read(file: str, path: str | Path) -> bytes:
    try:
        with open(path, 'rb') as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        _fail(file, 0, error.strerror or str(error), 'a readable YAML file')
    except ValueError as error:  # a zero byte in the path
        _fail(file, 0, str(error), 'a readable YAML file')
    if len(data) > MAX_BYTES:
        _fail(file, 0, f'more than {MAX_BYTES} bytes', f'at most {MAX_BYTES} bytes')
    return data


def _decode(file: str, data: bytes) -> str:
    try:
        text = data.decode('utf-8-sig')
    except UnicodeDecodeError as error:
        line = data.count(b'\n', 0, error.start) + 1
        _fail(file, line, f'byte 0x{data[error.start]:02x}', 'UTF-8 text')
    unprintable = _UNPRINTABLE.search(text)
    if unprintable:
        line = text.count('\n', 0, unprintable.start()) + 1
        _fail(file, line, f'character U+{ord(unprintable.group()):04X}', 'printable text')
    return text


def _refuse_surprises(file: str, text: str) -> None:
    """Refuse what is YAML, but has no place in a kinematics file."""
    depth, documents = 0, 0
    event: Any
    for event in yaml.parse(text, Loader=Loader):
        line = event.start_mark.line + 1
        if isinstance(event, yaml.AliasEvent):
            _fail(file, line, f'alias *{event.anchor}', 'plain values')
        if getattr(event, 'tag', None):
            _fail(file, line, f'tag {event.tag}', 'plain values')
        documents += isinstance(event, yaml.DocumentStartEvent)
        if documents > 1:
            _fail(file, line, 'a second document', 'one document')
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH:
            _fail_too_deep(file, line)
