"""From the names of a message to the chains they concern."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from icub_leg_fk.kinematics import Chain

_REMEMBERED_LISTS = 64
_REMEMBERED_NAMES = 1000  # in one list, and
_REMEMBERED_CHARACTERS = 65536  # in it; what a stranger sends may be longer


class ResolvedNames(NamedTuple):
    """What a list of names means.

    Attributes:
        duplicate: the first name that stands twice, or None.
        pairs: index in the list and slot, for each joint of some chain.
        chains: indices of the chains touched.
    """

    duplicate: str | None
    pairs: tuple[tuple[int, int], ...]
    chains: tuple[int, ...]


class JointNames:
    """Gives every joint of some chains a slot, and remembers what lists of names mean.

    Args:
        chains: the chains; one joint may belong to several.

    Attributes:
        slots: slot of every joint by name.
        chain_slots: slots of each chain's joints, in their order.
    """

    def __init__(self, chains: Sequence[Chain]) -> None:
        self.slots = {name: slot for slot, name in enumerate(
            dict.fromkeys(name for chain in chains for name in chain.joint_names))}
        self.chain_slots = [tuple(self.slots[name] for name in chain.joint_names)
                            for chain in chains]
        self._remembered: dict[tuple[str, ...], ResolvedNames] = {}

    def resolve(self, names: tuple[str, ...]) -> ResolvedNames:
        """Return what a list of names means."""
        resolved = self._remembered.get(names)
        if resolved is None:
            resolved = self._resolve(names)
            if (len(names) <= _REMEMBERED_NAMES
                    and sum(map(len, names)) <= _REMEMBERED_CHARACTERS):
                if len(self._remembered) >= _REMEMBERED_LISTS:
                    self._remembered.clear()
                self._remembered[names] = resolved
        return resolved

    def _resolve(self, names: tuple[str, ...]) -> ResolvedNames:
        duplicate = None
        if len(set(names)) != len(names):
            duplicate = next(name for name, count in Counter(names).items() if count > 1)
        pairs = tuple((index, self.slots[name]) for index, name in enumerate(names)
                      if name in self.slots)
        brought = {slot for _, slot in pairs}
        chains = tuple(index for index, slots in enumerate(self.chain_slots)
                       if brought.intersection(slots))
        return ResolvedNames(duplicate, pairs, chains)
