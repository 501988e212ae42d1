"""Errors of icub_leg_fk: each carries its data and says what would have been allowed."""

from collections.abc import Iterable
import reprlib

_LONG_NAME = 10  # characters; from here on a second slip is still a near miss


def near(name: str, choices: Iterable[str]) -> str | None:
    """Return the choice that a name is a misspelling of; None if there is none.

    Near is one slip (a character too many, too few or another, or two that have changed places),
    two from ten characters on.
    """
    slips = 2 if len(name) >= _LONG_NAME else 1
    distances = {choice: _edit_distance(name, choice) for choice in choices
                 if choice != name and abs(len(choice) - len(name)) <= slips}
    close = [choice for choice, distance in distances.items()
             if distance <= slips and distance < len(name)]
    return min(close, key=distances.__getitem__, default=None)


def _edit_distance(a: str, b: str) -> int:
    """Return the distance of Damerau and Levenshtein, in its restricted form."""
    rows = [list(range(len(b) + 1))]
    for i, x in enumerate(a, 1):
        rows.append([i])
        for j, y in enumerate(b, 1):
            least = min(rows[i - 1][j] + 1, rows[i][j - 1] + 1, rows[i - 1][j - 1] + (x != y))
            if i > 1 and j > 1 and (x, a[i - 2]) == (b[j - 2], y):
                least = min(least, rows[i - 2][j - 2] + 1)
            rows[i].append(least)
    return rows[-1][-1]


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
        known = ', '.join(self.choices) or 'none'
        guess = near(name, self.choices) if isinstance(name, str) else None
        hint = f'did you mean {guess!r}? ' if guess else ''
        super().__init__(f'unknown {kind} {reprlib.repr(name)}; {hint}known: {known}')


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
