"""Reading a YAML file node by node, so that every complaint can name its line.

`yaml.safe_load` would forget the lines, keep only the last of two equal keys, expand aliases
and read `1:30` as 90. Here a file is composed with the safe loader into nodes, bounded in size
and depth and without aliases, and read through `Field`, which knows where it stands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
import re
from typing import Any, NoReturn

from icub_leg_fk.errors import CatalogError
import yaml

MAX_BYTES = 1_000_000
MAX_DEPTH = 16

_NUMBER = re.compile(r'[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d{1,3})?')


class _Loader(yaml.SafeLoader):
    """The safe loader's composer, bounded in depth and without aliases."""

    depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent):
            raise yaml.composer.ComposerError(
                None, None, f'found alias *{event.anchor}, allowed: plain values',
                event.start_mark)
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise yaml.composer.ComposerError(
                None, None, f'found more than {MAX_DEPTH} nested levels, allowed: '
                f'{MAX_DEPTH}', event.start_mark)
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


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
            text = repr(self.node.value)
            return text if len(text) <= 60 else text[:57] + '...'
        return 'a list' if isinstance(self.node, yaml.SequenceNode) else 'a mapping'

    def mapping(self, kind: str, where: Callable[[str], str]) -> dict[str, Field]:
        """Return the values of a mapping by name, refusing a key that stands twice.

        Args:
            kind: what the mapping holds, for the error.
            where: how to call the place of a value, given its key.
        """
        if not isinstance(self.node, yaml.MappingNode):
            self.fail(kind)
        fields: dict[str, Field] = {}
        for key, value in self.node.value:
            at = Field(self.file, self.where, key)
            name = at.name('a name')
            if name in fields:
                at.fail('each key once', f'key {name!r} twice')
            fields[name] = Field(self.file, where(name), value)
        return fields

    def record(self, required: tuple[str, ...], optional: tuple[str, ...] = ()
               ) -> dict[str, Field]:
        """Return the fields of a mapping whose keys are fixed."""
        known = ', '.join(required + optional)
        fields = self.mapping(f'a mapping with {known}', lambda key: f'{self.where}, field {key}')
        for key, _ in self.node.value:
            if key.value not in required + optional:
                Field(self.file, self.where, key).fail(known, f'key {key.value!r}')
        for name in required:
            if name not in fields:
                self.fail(f'all of {", ".join(required)}', f'no {name}')
        return fields

    def items(self, kind: str, length: int | None = None) -> Iterator[Field]:
        """Yield the items of a list."""
        if not isinstance(self.node, yaml.SequenceNode):
            self.fail(kind)
        if length is not None and len(self.node.value) != length:
            self.fail(kind, f'{len(self.node.value)} values')
        if not self.node.value:
            self.fail(kind, 'an empty list')
        for item in self.node.value:
            yield Field(self.file, self.where, item)

    def number(self, unit: str = '') -> float:
        """Return a finite number."""
        allowed = f'a finite number{unit and f" ({unit})"}'
        node = self.node
        if not isinstance(node, yaml.ScalarNode) or node.style or not _NUMBER.fullmatch(node.value):
            self.fail(allowed)
        value = float(node.value)
        if abs(value) == float('inf'):
            self.fail(allowed)
        return value

    def name(self, kind: str, pattern: str = r'[A-Za-z0-9_./-]+') -> str:
        """Return a word."""
        if not isinstance(self.node, yaml.ScalarNode) or not re.fullmatch(pattern, self.node.value):
            self.fail(f'{kind} of letters, digits and _')
        return str(self.node.value)

    def text(self) -> str:
        """Return free text of one line."""
        if not isinstance(self.node, yaml.ScalarNode) or not str(self.node.value).isprintable():
            self.fail('text of one line')
        return str(self.node.value)

    def choice(self, choices: tuple[str, ...]) -> str:
        """Return one of some words."""
        if not isinstance(self.node, yaml.ScalarNode) or self.node.value not in choices:
            self.fail(' or '.join(choices))
        return str(self.node.value)


def read_yaml(path: str | Path) -> Field:
    """Return the root of a YAML file.

    Raises:
        CatalogError: it cannot be read, is too large, nests too deep, holds an alias or more
            than one document, or is no YAML.
    """
    file = str(path)
    try:
        with open(path, 'rb') as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise CatalogError(file, 0, 'kinematics file', error.strerror or str(error),
                           'a readable YAML file') from error
    if len(data) > MAX_BYTES:
        raise CatalogError(file, 0, 'kinematics file', f'more than {MAX_BYTES} bytes',
                           f'at most {MAX_BYTES} bytes')
    loader = None
    try:
        loader = _Loader(data)
        node = loader.get_single_node()
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        mark = getattr(error, 'problem_mark', None) or getattr(error, 'context_mark', None)
        problem = getattr(error, 'problem', None) or getattr(error, 'reason', None) or 'no YAML'
        found, _, allowed = ' '.join(str(problem).split()).partition(', allowed: ')
        raise CatalogError(file, mark.line + 1 if mark else 0, 'kinematics file',
                           found.removeprefix('found '), allowed or 'well-formed YAML') from error
    finally:
        if loader is not None:
            loader.dispose()
    if node is None:
        raise CatalogError(file, 0, 'kinematics file', 'nothing', 'units and chains')
    return Field(file, 'kinematics file', node)
