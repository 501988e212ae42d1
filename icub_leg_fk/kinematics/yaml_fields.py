"""From a YAML file of any content to fields that know their place, or one error.

`yaml.safe_load` would forget the lines, keep only the last of two equal keys and read `1:30` as
90. So the file becomes yaml's nodes, plain text with its place, which are read one by one: every
complaint can name its place, and no object is ever made from a tag. An alias is the very node
that it names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
import math
from pathlib import Path
import re
import reprlib
from types import MappingProxyType
from typing import Any, NamedTuple, NoReturn, TypeVar

from icub_leg_fk.errors import CatalogError, closest
from icub_leg_fk.kinematics.input_bytes import first_bytes, shown
import yaml

MAX_BYTES = 1_000_000

_Value = TypeVar('_Value')
_Default = TypeVar('_Default')

# libyaml, where PyYAML was built with it, is thirty times as fast as the loader in Python.
Loader: Any = getattr(yaml, 'CBaseLoader', yaml.BaseLoader)

_NUMBER = re.compile(r'[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,3})?')
_PI = re.compile(r'([-+]?)(?:([0-9]{1,3}) ?\* ?)?pi(?: ?/ ?([1-9][0-9]{0,2}))?')


class TextKind(NamedTuple):
    """What a text in the file has to look like: a pattern, and how to say it."""

    pattern: re.Pattern[str]
    allowed: str


NAME = TextKind(re.compile(r'(?=.*\S).{1,300}'), 'up to 300 printable characters')
FRAME_ID = TextKind(
    re.compile(r'(?!/)(?=.*\S).{1,300}'),  # tf2 cannot look up a leading slash
    'up to 300 printable characters, not beginning with /',
)
WORD = TextKind(
    re.compile(r'[A-Za-z][A-Za-z0-9_]{0,63}'),
    'a letter, then up to 63 letters, digits and _',
)
LINE = TextKind(re.compile(r'.{0,300}'), 'text of one line')

_short = reprlib.Repr()
_short.maxstring = 60


class Field(NamedTuple):
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
        raise CatalogError(
            self.file, self.line, self.where, found or self.found(), allowed
        )

    def found(self) -> str:
        """Return what stands here, short enough for one line."""
        if isinstance(self.node, yaml.SequenceNode):
            return 'a list'
        if not isinstance(self.node, yaml.ScalarNode):
            return 'a mapping'
        shown = _short.repr(self.node.value)
        if self._is_quoted():
            return f'the text {shown}'
        return shown if self.node.value else 'nothing'

    def at(self, place: str) -> Field:
        """Return the same node, with its place described more closely."""
        return Field(self.file, f'{self.where}, {place}', self.node)

    def mapping(
        self,
        content: str,
        where: Callable[[str], str],
        kind: TextKind = NAME,
        at_least_one: str = '',
    ) -> dict[str, Field]:
        """Return the values of a mapping by name, refusing a key that stands twice.

        Args:
            content: what the mapping holds, for the error.
            where: returns the words for the place of a value, given its key.
            kind: what a key looks like.
            at_least_one: what there must be one of; empty if there need not be.
        """
        if not isinstance(self.node, yaml.MappingNode):
            self.fail(content)
        fields: dict[str, Field] = {}
        for key, value in self.node.value:
            name = Field(self.file, self.where, key).name('a name', kind)
            if name in fields:
                Field(self.file, where(name), key).fail(
                    'each key once', 'a duplicate key'
                )
            fields[name] = Field(self.file, where(name), value)
        if at_least_one and not fields:
            self.fail(f'at least one {at_least_one}', 'none')
        return fields

    def record(
        self,
        required: tuple[str, ...],
        optional: tuple[str, ...] = (),
        instead: Mapping[str, str] = MappingProxyType({}),
    ) -> Record:
        """Return the fields of a mapping whose keys are fixed.

        Args:
            required: the keys that must be there.
            optional: those that may be there.
            instead: what is written today by keys that people write, too.
        """
        known = required + optional
        fields = self.mapping(
            f'a mapping with {", ".join(known)}',
            lambda key: f'{self.where}, field {key}',
        )
        for key, _ in self.node.value:
            at, word = Field(self.file, self.where, key), key.value
            if word in instead:
                at.fail(f'{instead[word]} instead', f'key {word}')
            if word not in known:
                guess = closest(word, known)
                hint = f' (did you mean {guess!r}?)' if guess else ''
                at.fail(', '.join(known), f'unknown key {_short.repr(word)}{hint}')
        for name in required:
            if name not in fields:
                self.at(f'field {name}').fail(
                    f'all of {", ".join(required)}', 'nothing'
                )
        return Record(fields)

    def items(self, content: str, length: int | None = None) -> Iterator[Field]:
        """Yield the items of a list, which has at least one, or exactly `length`."""
        if not isinstance(self.node, yaml.SequenceNode):
            self.fail(content)
        count = len(self.node.value)
        if count == 0:
            self.fail(f'{content}, at least one', 'an empty list')
        if length is not None and count != length:
            self.fail(content, f'{count} item{"s" * (count != 1)}')
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

    def name(self, what: str = '', kind: TextKind = NAME) -> str:
        """Return a name or other text of one line, quoted or not."""
        text = self._scalar(kind.pattern)
        if text is None or not text.isprintable():
            self.fail(f'{what}: {kind.allowed}' if what else kind.allowed)
        return text

    def choice(self, choices: tuple[str, ...]) -> str:
        """Return one of some words."""
        text = self._scalar(LINE.pattern)
        if text not in choices:
            self.fail(' or '.join(choices))
        return text

    def _is_quoted(self) -> bool:
        return isinstance(self.node, yaml.ScalarNode) and bool(self.node.style)

    def _scalar(self, pattern: re.Pattern[str]) -> str | None:
        """Return the text of a scalar that matches, or None."""
        if isinstance(self.node, yaml.ScalarNode) and pattern.fullmatch(
            self.node.value
        ):
            return str(self.node.value)
        return None


class Record(dict[str, Field]):
    """The fields of a mapping whose keys are fixed."""

    def given(
        self, name: str, default: _Default, read: Callable[..., _Value], *details: Any
    ) -> _Value | _Default:
        """Return what an optional field holds, or a default.

        Args:
            name: of the field.
            default: what counts if it is not there.
            read: returns what a field holds, such as `Field.number`.
            details: what else `read` takes.
        """
        return read(self[name], *details) if name in self else default


def read_yaml(path: str | Path) -> Field:
    """Return the root of a YAML file.

    Raises:
        CatalogError: it cannot be read, is too large, or is not one document of YAML.
    """
    file = shown(path)
    data = first_bytes(path, MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        _fail(file, 0, f'more than {MAX_BYTES} bytes', f'at most {MAX_BYTES} bytes')
    try:
        node = yaml.compose(data, Loader=Loader)
    except (
        yaml.reader.ReaderError
    ) as error:  # bytes that are not text, or not printable
        line = data.count(b'\n', 0, error.position) + 1
        _fail(
            file,
            line,
            f'a byte or character that is not printable UTF-8 text ({error.reason})',
            'UTF-8 text',
        )
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = ' '.join(str(error.problem or error.context).split())
        _fail(
            file,
            mark.line + 1 if mark else 0,
            f'text that is not YAML ({problem})',
            'one document of well-formed YAML',
        )
    except RecursionError:
        _fail(file, 0, 'too many nested levels', 'well-formed YAML')
    if node is None:
        _fail(file, 0, 'nothing', 'units and chains')
    return Field(file, 'kinematics file', node)


def _fail(file: str, line: int, found: str, allowed: str) -> NoReturn:
    raise CatalogError(file, line, 'kinematics file', found, allowed) from None
