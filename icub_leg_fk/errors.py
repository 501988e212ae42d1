"""Errors of icub_leg_fk: each carries its data and says what would have been allowed."""

from __future__ import annotations

from collections.abc import Iterable


class LegFKError(Exception):
    """Base of every error this package raises for a user's mistake; its text is one line."""


class UnknownNameError(LegFKError):
    """A name that is not among the known ones.

    Attributes:
        kind: what the name was meant for, such as `chain` or `version of chain left_leg`.
        name: the name that was given.
        choices: the names that exist.
    """

    def __init__(self, kind: str, name: str, choices: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.choices = tuple(choices)
        known = ', '.join(self.choices) or '(none)'
        super().__init__(f'unknown {kind}: {name!r}; known: {known}')


class JointVectorError(LegFKError):
    """A joint vector of the wrong length or with an entry that is no finite number."""


class CatalogError(LegFKError):
    """A mistake in a kinematics file.

    Attributes:
        file: path of the file as it was given.
        line: line number, from 1; 0 if the whole file is meant.
        where: chain, version, row and field, as far as they are known.
        found: what stands there.
        allowed: what may stand there.
    """

    def __init__(self, file: str, line: int, where: str, found: str, allowed: str) -> None:
        self.file = file
        self.line = line
        self.where = where
        self.found = found
        self.allowed = allowed
        place = f'{file}:{line}' if line else file
        super().__init__(f'{place}: {where}: found {found}, allowed: {allowed}')


class MalformedMessageError(LegFKError):
    """Bytes that are not a well-formed CDR message of the expected type."""


class ParameterError(LegFKError):
    """A node parameter with a value that cannot be used."""


class InputFileError(LegFKError):
    """A file given to a tool that cannot be read or does not hold what the tool needs."""


class OutputFileError(LegFKError):
    """A file that a tool is to write and cannot, or must not, such as one that already exists."""


class MissingDependencyError(LegFKError):
    """An optional library that one tool needs is not installed."""
