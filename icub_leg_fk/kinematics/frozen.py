"""What the value classes of this room share: contents nobody can write to, equality and hash."""

from collections.abc import Hashable, Mapping
from dataclasses import Field, fields
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np


class Frozen:
    """Base of a frozen dataclass that holds arrays or mappings.

    Arrays and mappings are read-only copies and lists are tuples, also after copying and
    pickling. Two instances are equal if their compared fields are, by value; -0.0 equals 0.0.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __post_init__(self) -> None:
        for field in fields(self):
            object.__setattr__(self, field.name, _read_only(getattr(self, field.name)))

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return type(self), tuple(
            _picklable(getattr(self, field.name)) for field in fields(self)
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, type(self)):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> Hashable:
        return tuple(
            _hashable(getattr(self, field.name))
            for field in fields(self)
            if field.compare
        )


def _read_only(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        array = np.array(value, dtype=float)
        array.flags.writeable = False
        return array
    if isinstance(value, (dict, MappingProxyType)):
        return MappingProxyType(dict(value))
    if isinstance(value, list):
        return tuple(value)
    return value


def _picklable(value: Any) -> Any:
    return dict(value) if isinstance(value, MappingProxyType) else value


def _hashable(value: Any) -> Hashable:
    if isinstance(value, np.ndarray):
        return (
            value.shape,
            *value.ravel().tolist(),
        )  # equal floats have equal hashes, -0.0 too
    if isinstance(value, Mapping):
        return tuple(value.items())
    return value  # type: ignore[no-any-return]
