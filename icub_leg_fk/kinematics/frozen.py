"""What the value classes of this room share: arrays nobody can write to, equality and hash."""

from collections.abc import Hashable, Mapping
from dataclasses import Field, fields
from typing import Any, ClassVar

import numpy as np


class Frozen:
    """Base of a frozen dataclass that holds arrays or mappings.

    Arrays are read-only copies, also after copying and pickling. Two instances are equal if their
    compared fields are, by value; -0.0 equals 0.0.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                value = np.array(value, dtype=float)
                value.flags.writeable = False
                object.__setattr__(self, field.name, value)

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return type(self), tuple(getattr(self, field.name) for field in fields(self))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> Hashable:
        return tuple(_hashable(getattr(self, field.name))
                     for field in fields(self) if field.compare)


def _hashable(value: Any) -> Hashable:
    if isinstance(value, np.ndarray):
        return (value.shape, *value.ravel().tolist())  # equal floats have equal hashes, -0.0 too
    if isinstance(value, Mapping):
        return tuple(value.items())
    return value  # type: ignore[no-any-return]
