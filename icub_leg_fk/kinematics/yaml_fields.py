"""From a YAML file of any content to fields that know their place, or one error.

`yaml.safe_load` would forget the lines, keep only the last of two equal keys, expand aliases and
read `1:30` as 90. Here the text is bounded in size and depth, holds one document without aliases
and tags, and becomes yaml's nodes: plain text with its place. The nodes are read one by one, so
that every complaint can name its place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import math
from pathlib import Path
import re
import reprlib
from typing import Any, NoReturn

from icub_leg_fk.errors import CatalogError, near
import yaml

MAX_BYTES = 1_000_000
MAX_DEPTH = 16

# libyaml, where PyYAML was built with it, is thirty times as fast as the loader in Python.
Loader: Any = getattr(yaml, 'CBaseLoader', yaml.BaseLoader)

_UNPRINTABLE = re.compile('[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]')
_NUMBER = re.compile(r'[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,3})?')
_PI = re.compile(r'([-+]?)(?:([0-9]{1,3}) ?\* ?)?pi(?: ?/ ?([1-9][0-9]{0,2}))?')
NAME = re.compile(r'[A-Za-z0-9_./-]{1,100}')
FRAME = re.compile(r'[A-Za-z0-9_.-][A-Za-z0-9_./-]{0,99}')  # tf2 cannot look up a leading slash
WORD = re.compile(r'[A-Za-z][A-Za-z0-9_]{0,63}')  # also a part of topic and parameter names
_NAMED = {NAME: 'up to 100 letters, digits and _ . / -',
          FRAME: 'up to 100 letters, digits and _ . / -, not beginning with /',
          WORD: 'a letter, then up to 63 letters, digits and _'}
_LINE = re.compile(r'.{0,300}')

_short = reprlib.Repr()
_short.maxstring = 60


@dataclass(frozen=True)
class Field:
    """A node of the file together with the words for where it stands."""

    file: str
    where: str
    node: yaml.Node

    @property
    def line(self) -> int:
        """Line number in the file, from 1."""
        return int(self.node.start_mark.line) + 1

    def fail(self, allowed: str, found: str | None = None) -> NoReturn:
        """Raise the error that says what stands here and what may."""
        raise CatalogError(self.file, self.line, self.where, found or self.found(), allowed)

    def found(self) -> str:
        """Return what stands here, short enough for one line."""
        if isinstance(self.node, yaml.ScalarNode):
            if self._is_quoted():
                return f'the text {_short.repr(self.node.value)}'
            return _short.repr(self.node.value) if self.node.value else 'nothing'
        return 'a list' if isinstance(self.node, yaml.SequenceNode) else 'a mapping'

    def at(self, place: str) -> Field:
        """Return the same node, with its place described more closely."""
        return Field(self.file, f'{self.where}, {place}', self.node)

    def has(self, key: str) -> bool:
        """Return whether this is a mapping with a key of that name."""
        return isinstance(self.node, yaml.MappingNode) and any(
            name.value == key for name, _ in self.node.value)

    def mapping(self, kind: str, where: Callable[[str], str],
                pattern: re.Pattern[str] = NAME) -> dict[str, Field]:
        """Return the values of a mapping by name, refusing a key that stands twice.

        Args:
            kind: what the mapping holds, for the error.
            where: how to call the place of a value, given its key.
            pattern: what a key looks like.
        """
        if not isinstance(self.node, yaml.MappingNode):
            self.fail(kind)
        fields: dict[str, Field] = {}
        for key, value in self.node.value:
            name = Field(self.file, self.where, key).name('a name', pattern)
            if name in fields:
                Field(self.file, where(name), key).fail('each key once', 'a duplicate key')
            fields[name] = Field(self.file, where(name), value)
        return fields

    def record(self, required: tuple[str, ...], optional: tuple[str, ...] = ()
               ) -> dict[str, Field]:
        """Return the fields of a mapping whose keys are fixed."""
        known = ', '.join(required + optional)
        fields = self.mapping(f'a mapping with {known}', lambda key: f'{self.where}, field {key}')
        for key, _ in self.node.value:
            if key.value not in required + optional:
                guess = near(key.value, required + optional)
                hint = f' (did you mean {guess!r}?)' if guess else ''
                Field(self.file, self.where, key).fail(
                    known, f'unknown key {_short.repr(key.value)}{hint}')
        for name in required:
            if name not in fields:
                self.at(f'field {name}').fail(f'all of {", ".join(required)}', 'nothing')
        return fields

    def items(self, kind: str, length: int | None = None) -> Iterator[Field]:
        """Yield the items of a list."""
        if not isinstance(self.node, yaml.SequenceNode):
            self.fail(kind)
        count = len(self.node.value)
        if count != (count if length is None else length) or not count:
            self.fail(kind, f'{count} item{"s" * (count != 1)}')
        for item in self.node.value:
            yield Field(self.file, self.where, item)

    def number(self, unit: str = '') -> float:
        """Return a finite number."""
        text = self._scalar(_NUMBER)
        if text is None or self._is_quoted() or math.isinf(float(text)):
            self.fail(f'a finite number ({unit})' if unit else 'a finite number')
        return float(text)

    def fraction_of_pi(self) -> float | None:
        """Return an angle [rad] written as `pi`, `-pi/2` or `3*pi/4`; None if it is not."""
        text = self._scalar(_PI)
        if text is None or self._is_quoted():
            return None
        sign, factor, divisor = _PI.fullmatch(text).groups()  # type: ignore[union-attr]
        angle = math.pi * float(factor or 1) / float(divisor or 1)
        return -angle if sign == '-' else angle

    def name(self, kind: str, pattern: re.Pattern[str] = NAME) -> str:
        """Return a word."""
        text = self._scalar(pattern)
        if text is None:
            self.fail(f'{kind}: {_NAMED[pattern]}')
        return text

    def text(self) -> str:
        """Return free text of one line."""
        text = self._scalar(_LINE)
        if text is None or not text.isprintable():
            self.fail('text of one line')
        return text

    def choice(self, choices: tuple[str, ...]) -> str:
        """Return one of some words."""
        text = self._scalar(_LINE)
        if text not in choices:
            self.fail(' or '.join(choices))
        return text

    def _is_quoted(self) -> bool:
        return isinstance(self.node, yaml.ScalarNode) and bool(self.node.style)

    def _scalar(self, pattern: re.Pattern[str]) -> str | None:
        """Return the text of a scalar that matches, or None."""
        if isinstance(self.node, yaml.ScalarNode) and pattern.fullmatch(self.node.value):
            return str(self.node.value)
        return None


def read_yaml(path: str | Path) -> Field:
    """Return the root of a YAML file.

    Raises:
        CatalogError: it cannot be read, is too large, nests too deep, holds an alias, a tag or
            more than one document, or is not YAML.
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
        found = f'text that is not YAML ({" ".join(str(problem).split())})'
        _fail(file, line, found, 'well-formed YAML')
    if node is None:
        _fail(file, 0, 'nothing', 'units and chains')
    return Field(file, 'kinematics file', node)


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
