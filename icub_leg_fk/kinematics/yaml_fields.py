"""Reading the nodes of a YAML file one by one, so that every complaint can name its place."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import math
from pathlib import Path
import re
import reprlib
from typing import NoReturn

from icub_leg_fk.errors import CatalogError
from icub_leg_fk.kinematics.yaml_file import read_nodes
import yaml

_NUMBER = re.compile(r'[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,3})?')
NAME = re.compile(r'[A-Za-z0-9_./-]{1,100}')
WORD = re.compile(r'[A-Za-z][A-Za-z0-9_]{0,63}')  # also a part of topic and parameter names
_NAMED = {NAME: 'up to 100 letters, digits and _ . / -',
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
                Field(self.file, where(name), key).fail('each key once', 'the key again')
            fields[name] = Field(self.file, where(name), value)
        return fields

    def record(self, required: tuple[str, ...], optional: tuple[str, ...] = ()
               ) -> dict[str, Field]:
        """Return the fields of a mapping whose keys are fixed."""
        known = ', '.join(required + optional)
        fields = self.mapping(f'a mapping with {known}', lambda key: f'{self.where}, field {key}')
        for key, _ in self.node.value:
            if key.value not in required + optional:
                Field(self.file, self.where, key).fail(known, f'key {_short.repr(key.value)}')
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
        CatalogError: the file cannot be read or is no plain YAML.
    """
    file, node = read_nodes(path)
    return Field(file, 'kinematics file', node)
