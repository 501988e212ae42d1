"""The rules by which JointState messages become joint vectors; plain, and free of rclpy.

- Joints are matched by name; joints of no chain are ignored.
- A message that brings some of a chain's joints updates those. The chain is then ready if each of
  its joints is known, finite and no older than `joint_timeout` beside the newest of them.
  (Finite is what leaves room to compute with: less than `LARGEST_VALUE`.)
- A message is rejected as a whole if `position` is shorter than `name` or a name stands twice; an
  empty `position` is counted only.
- Time has stepped back if a message is older than what is held of a joint it brings, or older by
  more than `joint_timeout` than anything held: then all held joints are forgotten and the message
  counts as the first. (Publishers of different joints may interleave slightly out of order.)

Everything refused is counted by reason, and reported with the joint or field it concerns.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import math

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.ros.joint_names import JointNames, ResolvedNames
from icub_leg_fk.ros.joint_vector import are_usable, JointVector, LARGEST_VALUE

MESSAGE_REASONS = ('malformed', 'empty_position', 'short_position', 'duplicate_name', 'time_jump')
CHAIN_REASONS = ('missing_joint', 'non_finite', 'stale_joint', 'no_velocity')


@dataclass
class ChainCounts:
    """What has happened to one chain since it was last asked.

    Attributes:
        ready: joint vectors that were complete and fresh.
        held_back: messages that touched the chain and gave none, by reason.
        joints: the joints concerned, by reason, with what was found of each.
    """

    ready: int = 0
    held_back: Counter[str] = field(default_factory=Counter)
    joints: dict[str, dict[str, str]] = field(default_factory=dict)

    def blame(self, reason: str, joints: dict[str, str]) -> None:
        """Note the joints concerned by a reason."""
        self.joints.setdefault(reason, {}).update(joints)


class JointInput:
    """Holds the newest position of every joint of some chains and applies the rules.

    Args:
        chains: the chains to feed.
        joint_timeout: greatest age of a joint beside the newest of its chain [s]; 0 is none.
        report: called with a reason and one line of text for everything worth a warning.

    Attributes:
        messages: messages seen.
        counts: messages by reason of `MESSAGE_REASONS`.
        chain_counts: one `ChainCounts` per chain.
        newest: newest stamp held [ns], or None while nothing is.
    """

    def __init__(self, chains: Sequence[Chain], joint_timeout: float,
                 report: Callable[[str, str], None] = lambda reason, text: None) -> None:
        self.chains = tuple(chains)
        self.messages = 0
        self.counts: Counter[str] = Counter()
        self.chain_counts = [ChainCounts() for _ in self.chains]
        self.newest: int | None = None
        self._report = report
        self._timeout_ns = round(joint_timeout * 1e9)
        self._names = JointNames(self.chains)
        self._forget()

    def update(self, stamp_ns: int, names: tuple[str, ...], positions: Sequence[float],
               velocities: Sequence[float] = ()) -> list[JointVector]:
        """Take one message in and return the joint vectors it makes ready, one per chain at most.

        Args:
            stamp_ns: stamp of the message [ns], already replaced by now if it was zero.
            names: joint names.
            positions: positions [rad or m].
            velocities: velocities [rad/s or m/s].
        """
        self.messages += 1
        if not positions:
            self.counts['empty_position'] += 1
            return []
        if len(positions) < len(names):
            self._reject('short_position', f'position has {len(positions)} values for '
                         f'{len(names)} names; message ignored')
            return []
        resolved = self._names.resolve(names)
        if resolved.duplicate is not None:
            self._reject('duplicate_name', f'name {resolved.duplicate[:60]!r} stands twice; '
                         'message ignored')
            return []
        if not resolved.pairs:
            return []
        if self._stepped_back(stamp_ns, resolved):
            self._reject('time_jump', f'time stepped back to {stamp_ns / 1e9:.3f} s; '
                         'held joints are forgotten')
            self._forget()
        if len(velocities) < len(names):
            velocities = [math.nan] * len(names)
        for index, slot in resolved.pairs:
            self._stamps[slot] = stamp_ns
            self._positions[slot] = positions[index]
            self._velocities[slot] = velocities[index]
        self.newest = stamp_ns if self.newest is None else max(self.newest, stamp_ns)
        ready = [self._joint_vector(chain) for chain in resolved.chains]
        return [vector for vector in ready if vector is not None]

    def hold(self, stamp_ns: int, names: tuple[str, ...], positions: Sequence[float],
             velocities: Sequence[float], repeats: int, ready: Sequence[int]) -> None:
        """Take in the last of some messages that a faster path has found good and given out.

        Args:
            stamp_ns: stamp of the last message [ns].
            names: joint names.
            positions: positions of the last message [rad or m].
            velocities: velocities of the last message [rad/s or m/s]; empty if unknown.
            repeats: how many such messages there were.
            ready: the chains that each of them made ready.
        """
        self.messages += repeats
        for chain in ready:
            self.chain_counts[chain].ready += repeats
        if names:
            self.newest = stamp_ns if self.newest is None else max(self.newest, stamp_ns)
        for index, slot in self._names.resolve(names).pairs:
            self._stamps[slot] = stamp_ns
            self._positions[slot] = positions[index]
            self._velocities[slot] = velocities[index] if velocities else math.nan

    def reject_malformed(self, error: Exception) -> None:
        """Count a message that could not even be decoded."""
        self.messages += 1
        self._reject('malformed', f'{error}; message ignored')

    def note_no_velocity(self, chain: int) -> None:
        """Count a joint vector whose velocities are wanted and unknown."""
        joints = {
            name: 'unknown' if math.isnan(self._velocities[slot]) else str(self._velocities[slot])
            for name, slot in zip(self.chains[chain].joint_names, self._names.chain_slots[chain],
                                  strict=True)
            if not are_usable((self._velocities[slot],))}
        self.chain_counts[chain].held_back['no_velocity'] += 1
        self.chain_counts[chain].blame('no_velocity', joints)
        self._report('no_velocity', f'{self.chains[chain].name}: no twist: velocity of '
                     f'{", ".join(f"{name} {what}" for name, what in joints.items())}')

    def take_counts(self, chain: int) -> ChainCounts:
        """Return what has happened to a chain since this was last called."""
        counts, self.chain_counts[chain] = self.chain_counts[chain], ChainCounts()
        return counts

    def take_over(self, previous: JointInput) -> None:
        """Go on with the joints and the counts of an input that this one replaces."""
        self.messages, self.counts = previous.messages, previous.counts
        counts = {chain.name: previous.take_counts(index)
                  for index, chain in enumerate(previous.chains)}
        self.chain_counts = [counts.get(chain.name, ChainCounts()) for chain in self.chains]
        for name, slot in self._names.slots.items():
            if (old := previous._names.slots.get(name)) is not None:
                self._stamps[slot] = previous._stamps[old]
                self._positions[slot] = previous._positions[old]
                self._velocities[slot] = previous._velocities[old]
        self.newest = max((stamp for stamp in self._stamps if stamp is not None), default=None)

    def known_joints(self, chain: int) -> dict[str, int]:
        """Return the stamps [ns] of those joints of a chain that are held."""
        return {name: stamp for name, slot in zip(
            self.chains[chain].joint_names, self._names.chain_slots[chain], strict=True)
            if (stamp := self._stamps[slot]) is not None}

    def _reject(self, reason: str, text: str) -> None:
        self.counts[reason] += 1
        self._report(reason, text)

    def _forget(self) -> None:
        self._stamps: list[int | None] = [None] * len(self._names.slots)
        self._positions = [math.nan] * len(self._names.slots)
        self._velocities = [math.nan] * len(self._names.slots)
        self.newest = None

    def _stepped_back(self, stamp_ns: int, resolved: ResolvedNames) -> bool:
        if self.newest is None or stamp_ns >= self.newest:
            return False
        if self._timeout_ns and stamp_ns < self.newest - self._timeout_ns:
            return True
        held = (self._stamps[slot] for _, slot in resolved.pairs)
        return any(stamp is not None and stamp > stamp_ns for stamp in held)

    def _joint_vector(self, index: int) -> JointVector | None:
        chain, slots, counts = self.chains[index], self._names.chain_slots[index], \
            self.chain_counts[index]
        stamps = [self._stamps[slot] for slot in slots]
        positions = tuple([self._positions[slot] for slot in slots])
        known = [stamp for stamp in stamps if stamp is not None]
        oldest_allowed = max(known) - self._timeout_ns if self._timeout_ns else min(known)
        found: dict[str, dict[str, str]] = {}
        for name, stamp, position in zip(chain.joint_names, stamps, positions, strict=True):
            if stamp is None:
                found.setdefault('missing_joint', {})[name] = 'never seen'
            elif stamp < oldest_allowed:
                age = (max(known) - stamp) / 1e9
                found.setdefault('stale_joint', {})[name] = f'{age:.3f} s old'
            elif not abs(position) < LARGEST_VALUE:
                found.setdefault('non_finite', {})[name] = str(position)
        if found:
            for reason, joints in found.items():
                counts.held_back[reason] += 1
                counts.blame(reason, joints)
                listed = ', '.join(f'{name} {what}' for name, what in joints.items())
                self._report(reason, f'{chain.name}: no pose: {listed}')
            return None
        counts.ready += 1
        self.note_range(index, positions)
        velocities = tuple([self._velocities[slot] for slot in slots])
        return JointVector(index, positions,
                           velocities if are_usable(velocities) else None)

    def note_range(self, index: int, positions: Sequence[float]) -> None:
        """Note the joints that are outside their documented range; the pose goes out anyway."""
        chain = self.chains[index]
        if outside := chain.out_of_range(positions):
            by_name = dict(zip(chain.joint_names, positions, strict=True))
            self.chain_counts[index].blame(
                'out_of_range', {name: f'{by_name[name]:.6g}' for name in outside})
