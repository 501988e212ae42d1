"""Errors of icub_leg_fk: each is named after its fault, carries its data and is a sentence."""

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
import reprlib


def closest(name: str, choices: Iterable[str]) -> str | None:
    """Return the choice that a name is most likely a misspelling of; None if there is none."""
    likely = get_close_matches(name, list(choices), n=1, cutoff=0.7)
    return likely[0] if likely else None


class LegFKError(Exception):
    """Base of every error this package raises for a user's mistake; its text is one line."""


class UnknownNameError(LegFKError):
    """A name that is not among the known ones.

    Attributes:
        kind: what the name was meant for, such as `chain` or `version`.
        name: the name that was given.
        choices: the names that exist.
        advice: what else may help; empty if nothing.
        of: what should have the name, such as `chain left_leg`; empty if that is clear.
    """

    def __init__(
        self,
        kind: str,
        name: str,
        choices: Iterable[str],
        advice: str = '',
        of: str = '',
    ) -> None:
        self.kind = kind
        self.name = name
        self.choices = tuple(choices)
        self.advice = advice
        self.of = of
        super().__init__(kind, name, self.choices, advice, of)

    def __str__(self) -> str:
        guess = closest(self.name, self.choices) if isinstance(self.name, str) else None
        hint = f'did you mean {guess!r}? ' if guess else ''
        known = ', '.join(self.choices) or 'none'
        advice = f'; {self.advice}' if self.advice else ''
        of = f' of {self.of}' if self.of else ''
        return f'unknown {self.kind} {reprlib.repr(self.name)}{of}; {hint}known: {known}{advice}'


class VersionNeededError(LegFKError):
    """A chain with several versions and no default was asked for without one.

    Attributes:
        chain: name of the chain.
        versions: the versions that it has.
    """

    def __init__(self, chain: str, versions: Iterable[str]) -> None:
        self.chain = chain
        self.versions = tuple(versions)
        super().__init__(chain, self.versions)

    def __str__(self) -> str:
        return (
            f'chain {self.chain} has several versions and no default; give one of '
            f'{", ".join(self.versions)}'
        )


@dataclass(eq=False, repr=False)
class JointVectorError(LegFKError):
    """Joint positions or velocities that cannot be computed with.

    Attributes:
        quantity: what is wrong, such as `q[2]` or `joint vector`.
        fault: what is wrong with it, such as `is nan`.
        allowed: what may stand there.
    """

    quantity: str
    fault: str
    allowed: str

    def __str__(self) -> str:
        return f'{self.quantity} {self.fault}; allowed: {self.allowed}'


@dataclass(eq=False, repr=False)
class _FileError(LegFKError):
    """What errors of files share: the file and what is wrong with it."""

    file: str
    fault: str

    def __str__(self) -> str:
        return f'{self.file}: {self.fault}'


class InputFileError(_FileError):
    """A file that cannot be read or does not hold what is needed.

    Attributes:
        file: path of the file as it was given.
        fault: what is wrong with it.
    """


class CatalogError(InputFileError):
    """A mistake in a kinematics file.

    Attributes:
        file: path of the file as it was given.
        line: line number, from 1; 0 if the whole file is meant.
        where: chain, version, row and field, as far as they are known; empty if the file
            cannot be read.
        found: what stands there.
        allowed: what may stand there.
    """

    def __init__(
        self, file: str, line: int, where: str, found: str, allowed: str
    ) -> None:
        fault = f'{where}: found {found}, allowed: {allowed}' if where else found
        super().__init__(file, fault)
        self.line = line
        self.where = where
        self.found = found
        self.allowed = allowed

    def __str__(self) -> str:
        if not self.where:
            return f'cannot read {self.file}: {self.found}'
        place = f'{self.file}:{self.line}' if self.line else self.file
        return f'{place}: {self.fault}'


class OutputFileError(_FileError):
    """A file that is to be written and cannot, or must not, such as one that already exists.

    Attributes:
        file: path of the file as it was given.
        fault: what is wrong with it.
    """


@dataclass(eq=False, repr=False)
class MalformedMessageError(LegFKError):
    """Bytes that are not a well-formed CDR message of the expected type.

    Attributes:
        message: the type of the message, such as `JointState`.
        fault: what is wrong with it, and where.
    """

    message: str
    fault: str

    def __str__(self) -> str:
        return f'{self.message}: {self.fault}'


@dataclass(eq=False, repr=False)
class ParameterError(LegFKError):
    """A parameter of the node that cannot be used.

    Attributes:
        parameter: name of the parameter.
        fault: what is wrong with it, and what is allowed.
    """

    parameter: str
    fault: str

    def __str__(self) -> str:
        return f'parameter {self.parameter}: {self.fault}'


@dataclass(eq=False, repr=False)
class MissingDependencyError(LegFKError):
    """An optional library that a command needs is not installed.

    Attributes:
        library: name of the library.
        purpose: what needs it.
        install: the line that installs it.
    """

    library: str
    purpose: str
    install: str

    def __str__(self) -> str:
        return f'{self.purpose} needs {self.library}, which is not installed: {self.install}'
