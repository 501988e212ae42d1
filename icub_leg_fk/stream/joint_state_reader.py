"""Reads serialized JointStates fast, by remembering the lists of names that came last.

A robot sends the same names in the same order a thousand times a second. So where the names end
and which numbers are wanted is found out once, and of every further message only its stamp and
those numbers are unpacked. That is a cache: dropped, it costs time and nothing else.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from operator import itemgetter
import struct
from typing import Any

from icub_leg_fk.stream.cdr import HEADER, JointStateLayout, read_layout, STAMP_END

_REMEMBERED = 8  # lists of names
_LARGEST_REMEMBERED = 16384  # bytes of names; what a stranger sends may be larger

Pick = Callable[[Any], Any]


class JointStateReader:
    """Finds out, for the joints of some chains, what serialized JointStates bring of them.

    Args:
        chains: the joint names of each chain, by whatever stands for the chain.
    """

    def __init__(self, chains: Mapping[Any, Sequence[str]]) -> None:
        self._chains = chains
        self._forms: list[Form] = []

    def form_of(self, data: bytes) -> Form:
        """Return the form of a message: remembered, or read anew.

        Raises:
            MalformedMessageError: the bytes are not a JointState.
        """
        for fits in (Form.fits, Form.fits_but_for_padding):
            for form in self._forms:
                if fits(form, data):
                    self._put_first(form)
                    return form
        form = Form(data, read_layout(data), self._chains)
        if form.names_end <= _LARGEST_REMEMBERED:
            self._forms.insert(0, form)
            del self._forms[_REMEMBERED:]
        return form

    def _put_first(self, form: Form) -> None:
        """Let a form be the first that is tried."""
        if form is not self._forms[0]:
            self._forms.remove(form)
            self._forms.insert(0, form)


class Form:
    """What JointStates with the same names and lengths have in common, and where they hold what.

    Attributes:
        frame_id: frame id of the header.
        names: all joint names.
        names_end: where the names end [bytes].
        fault: why such messages are rejected, a reason and a text; None if they are not.
        places: of each joint of a chain its place in `positions` and `velocities`.
        chains: each chain with joints here, and what picks its joint vector from `positions` or
            `velocities`; None instead if some of its joints are not here.
        stamp: unpacks a message's stamp, seconds and nanoseconds.
        look: the last look in which such a message was met; for whoever wants to meet it once.
    """

    def __init__(
        self, data: bytes, layout: JointStateLayout, chains: Mapping[Any, Sequence[str]]
    ) -> None:
        self.frame_id = layout.frame_id
        self.names = layout.names
        self.names_end = layout.names_end
        self.fault = _fault(layout)
        self.look: object = None
        wanted = {name for joint_names in chains.values() for name in joint_names}
        indices: dict[str, int] = {}
        for index, name in enumerate(layout.names):
            if name in wanted:
                indices.setdefault(name, index)
        self.places = {name: place for place, name in enumerate(indices)}
        self.chains = _picks(chains, self.places)
        self._remember_head(data, layout)
        self._remember_numbers(layout, list(indices.values()))

    def _remember_head(self, data: bytes, layout: JointStateLayout) -> None:
        """Remember what a message begins with, its padding masked."""
        names_end = layout.names_end
        mask = bytearray(b'\xff' * names_end)
        for at, size in layout.padding:
            end = at + size
            mask[at:end] = bytes(size)
        self._mask = int.from_bytes(mask[STAMP_END:], 'little')
        self._head = data[STAMP_END:names_end]
        self._masked_head = int.from_bytes(self._head, 'little') & self._mask
        self._encapsulation = data[:2]

    def _remember_numbers(
        self, layout: JointStateLayout, indices: Sequence[int]
    ) -> None:
        """Remember where the numbers lie, and how to unpack those of some indices."""
        order = layout.byte_order
        sequences = (layout.positions, layout.velocities, layout.efforts)
        counts_at = [layout.names_end]
        counts_at += [doubles.at + 8 * doubles.n for doubles in sequences[:2]]
        gaps = [after - before - 4 for before, after in pairwise(counts_at)]
        self._read_counts = struct.Struct(f'{order}I{gaps[0]}xI{gaps[1]}xI').unpack_from
        self._counts = tuple(doubles.n for doubles in sequences)
        self._size = layout.efforts.at + 8 * layout.efforts.n
        self.stamp = struct.Struct(f'{order}{HEADER}xiI').unpack_from
        skipped = [index - before - 1 for before, index in pairwise((-1, *indices))]
        fields = ''.join(f'{8 * skip}xd' for skip in skipped)
        self._numbers = struct.Struct(order + fields).unpack_from
        self._positions_at = layout.positions.at
        has_velocities = layout.velocities.n == len(layout.names)
        self._velocities_at = layout.velocities.at if has_velocities else None

    def fits(self, data: bytes) -> bool:
        """Return whether a message has this form, and padding as the last one had."""
        return (
            data.startswith(self._head, STAMP_END)
            and len(data) >= self._size
            and data[:2] == self._encapsulation
            and self._read_counts(data, self.names_end) == self._counts
        )

    def fits_but_for_padding(self, data: bytes) -> bool:
        """Return whether a message has this form, whatever its padding holds.

        Fast CDR leaves in it what was in its buffer before; the next message of the same publisher
        likely has the same.
        """
        if len(data) < self._size:
            return False
        end = self.names_end
        head = data[STAMP_END:end]
        if int.from_bytes(head, 'little') & self._mask != self._masked_head:
            return False
        self._head = head
        return self.fits(data)

    def velocities(self, data: bytes) -> tuple[float, ...] | None:
        """Return the velocities [rad/s or m/s] of the joints in `places`; None if it has none."""
        if self._velocities_at is None:
            return None
        return self._numbers(data, self._velocities_at)

    def positions(self, data: bytes) -> tuple[float, ...]:
        """Return the positions [rad or m] of the joints in `places`."""
        return self._numbers(data, self._positions_at)


def _fault(layout: JointStateLayout) -> tuple[str, str] | None:
    """Return why messages of a layout are rejected as a whole: reason and text; None if not."""
    names, positions = layout.names, layout.positions.n
    if positions == 0:
        return 'empty_position', 'position is empty'
    if positions != len(names):
        return (
            'position_length',
            f'position has {positions} values for {len(names)} names',
        )
    name, count = Counter(names).most_common(1)[0]
    if count > 1:
        return 'duplicate_name', f'name {name[:60]!r} appears twice'
    return None


def _picks(
    chains: Mapping[Any, Sequence[str]], places: Mapping[str, int]
) -> tuple[tuple[Any, Pick | None], ...]:
    """Return the chains that have joints in some places, with what picks all of them there."""
    picks = []
    for chain, joint_names in chains.items():
        here = [places[name] for name in joint_names if name in places]
        if here:
            is_whole = len(here) == len(joint_names)
            picks.append((chain, _pick(here) if is_whole else None))
    return tuple(picks)


def _pick(places: Sequence[int]) -> Pick:
    """Return what picks the values at some places out of a tuple, as a tuple."""
    first, last = places[0], places[-1]
    if places == list(range(first, last + 1)):
        return itemgetter(slice(first, last + 1))
    return itemgetter(*places)
