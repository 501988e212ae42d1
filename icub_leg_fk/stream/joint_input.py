"""From serialized JointStates to the joint vectors of some chains; free of rclpy.

The rules:

- Joints are matched by name; joints of no chain are ignored.
- A message that brings some of a chain's joints updates those. The chain is then ready if each of
  its joints is known, finite and lags the newest of them by no more than the joint timeout.
  (Finite is what leaves room to compute with: less than `LARGEST_VALUE`.)
- A message is rejected as a whole if `position` is not as long as `name`, or a name appears twice;
  an empty `position` is counted only. Velocities are unknown unless they are as many as the names.
- A zero stamp stands for the present time.
- Time has stepped back if a message is older than what is held of a joint it brings, or older by
  more than the timeout than anything held: then all held joints are forgotten and the message
  counts as the first. (Publishers of different joints may interleave slightly out of order.)

What happens is counted, and noted with the joints it concerns, until somebody takes a look.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import math

from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.kinematics import Chain, DHLink
from icub_leg_fk.stream.joint_state_reader import Form, JointStateReader, Pick

LARGEST_VALUE = 1e150  # of a position or velocity; beyond it sums and products overflow
REJECTIONS = ('malformed', 'empty_position', 'position_length', 'duplicate_name')
TIME_JUMP = 'time_jump'
HOLD_BACK = ('missing_joint', 'stale_joint', 'non_finite', 'no_velocity')
"""Why a chain gives no pose or no twist."""

_SECOND = 1_000_000_000  # ns
_LAST_SECOND = (1 << 31) - 1  # that a stamp can hold
_BEFORE_ALL_TIME = -(1 << 63)  # ns
_LARGEST_USABLE = math.nextafter(LARGEST_VALUE, 0.0)
_TURN = 2 * math.pi
_UNKNOWN = math.nan
_MOST_NAMES = 1000  # that a look holds; strangers may send any number
_MOST_FRAME_IDS = 8
_LONGEST_TEXT = 100  # characters of a name or frame id in a look


@dataclass(slots=True)
class Ready:
    """A chain's joint vector, complete and fresh.

    Attributes:
        chain: the chain.
        sec: seconds of the stamp.
        nanosec: nanoseconds of the stamp.
        positions: n joint positions [rad or m].
        velocities: n joint velocities [rad/s or m/s]; None if they are not wanted, or one is not
            known, or not finite.
    """

    chain: Chain
    sec: int
    nanosec: int
    positions: tuple[float, ...]
    velocities: tuple[float, ...] | None

    @property
    def stamp(self) -> int:
        """The stamp [ns]."""
        return self.sec * _SECOND + self.nanosec


@dataclass
class ChainLook:
    """What has happened to one chain since the last look.

    Attributes:
        chain: the chain.
        ready: messages that gave a complete and fresh joint vector.
        silent: messages with positions of its joints that gave none.
        held_back: messages that gave no pose, or with `no_velocity` no twist, by reason.
        joints: by reason the joints concerned, with what was found last: a position, a velocity,
            or how far a joint lags [s]; nan where nothing is known. Reasons that hold nothing back
            are here too: `out_of_range` and `looks_like_degrees`.
    """

    chain: Chain
    ready: int = 0
    silent: int = 0
    held_back: Counter[str] = field(default_factory=Counter)
    joints: dict[str, dict[str, float]] = field(default_factory=dict)

    def note(self, reason: str, joints: Mapping[str, float]) -> None:
        """Note the joints that a reason concerns, and count a message that gives less for it."""
        self.joints.setdefault(reason, {}).update(joints)
        if reason in HOLD_BACK:
            self.held_back[reason] += 1


@dataclass
class Look:
    """What has happened since the last look.

    Attributes:
        messages: messages received.
        rejected: messages rejected, by reason of `REJECTIONS`; and under `TIME_JUMP` those with
            which time stepped back.
        faults: what was found with the last message of each of these reasons.
        names: joint names that came, as many as are worth keeping.
        joints: joints of the chains whose names came.
        frame_ids: joints of the chains that came with a position, by frame id.
        chains: what has happened to each chain, by its name.
    """

    messages: int = 0
    rejected: Counter[str] = field(default_factory=Counter)
    faults: dict[str, str] = field(default_factory=dict)
    names: dict[str, None] = field(default_factory=dict)
    joints: set[str] = field(default_factory=set)
    frame_ids: dict[str, set[str]] = field(default_factory=dict)
    chains: dict[str, ChainLook] = field(default_factory=dict)

    def meet(self, form: Form) -> None:
        """Note what messages of a form bring."""
        for name in form.names:
            if len(self.names) == _MOST_NAMES:
                break
            self.names[name[:_LONGEST_TEXT]] = None
        self.joints.update(form.places)
        frame_id = form.frame_id[:_LONGEST_TEXT]
        has_room = frame_id in self.frame_ids or len(self.frame_ids) < _MOST_FRAME_IDS
        if form.fault is None and form.places and has_room:
            self.frame_ids.setdefault(frame_id, set()).update(form.places)


@dataclass(slots=True)
class _Brought:
    """What a message brought; held for each of its joints until another message brings that."""

    stamp: int
    places: Mapping[str, int]
    positions: tuple[float, ...]
    velocities: tuple[float, ...] | None

    def velocity(self, joint: str) -> float:
        return (
            _UNKNOWN if self.velocities is None else self.velocities[self.places[joint]]
        )


class JointInput:
    """Takes JointStates in and returns the joint vectors of the chains that they make ready.

    It has no chains before `configure` is called; that may be called again at any time.

    Args:
        now: returns the present time [ns], which stamps messages with a zero stamp.

    Attributes:
        chains: the chains; one joint may belong to several.
    """

    def __init__(self, now: Callable[[], int]) -> None:
        self._now = now
        self._look = Look()
        self._held: dict[str, _Brought] = {}
        self._states: list[_ChainState] = []
        self.configure((), 0.0)

    def configure(
        self, chains: Sequence[Chain], joint_timeout: float, velocities: bool = False
    ) -> None:
        """Begin to work for some chains, with the joints that are held and what was counted.

        Args:
            chains: the chains.
            joint_timeout: how far a joint may lag the newest of its chain [s]; 0 is any time.
            velocities: whether velocities are wanted too.
        """
        self.chains = tuple(chains)
        self._timeout = round(joint_timeout * _SECOND)
        self._wants_velocities = velocities
        looks = {state.chain.name: state.look for state in self._states}
        self._states = [_ChainState(chain) for chain in chains]
        for state in self._states:
            if state.chain.name in looks:
                state.look = replace(looks[state.chain.name], chain=state.chain)
        joint_names = {state: state.joints for state in self._states}
        wanted = set().union(*joint_names.values())
        self._held = {name: held for name, held in self._held.items() if name in wanted}
        stamps = [held.stamp for held in self._held.values()]
        self._newest = max(stamps, default=_BEFORE_ALL_TIME)
        self._reader = JointStateReader(joint_names)

    def feed(self, data: bytes) -> list[Ready]:
        """Take one serialized JointState in and return the joint vectors it makes ready."""
        self._look.messages += 1
        form = self._form_of(data)
        if form is None or not form.chains:
            return []
        sec, nanosec = form.stamp(data)
        if sec == 0 and nanosec == 0:
            sec, nanosec = divmod(self._now(), _SECOND)
        if sec > _LAST_SECOND:  # a bag may say that it was recorded then
            self._reject(
                'malformed',
                f'it has no stamp, and the time is {sec} s; allowed: up to '
                f'{_LAST_SECOND} s',
            )
            return []
        brought = self._hold(form, sec * _SECOND + nanosec, data)
        ready = []
        for state, pick in form.chains:
            q = pick(brought.positions) if pick else None
            if q is None or not state.is_in_range(q):
                q = self._examine(state)
            if q is None:
                state.look.silent += 1
                continue
            state.look.ready += 1
            qdot = None
            if self._wants_velocities:
                qdot = self._velocities(state, brought, pick)
            ready.append(Ready(state.chain, sec, nanosec, q, qdot))
        return ready

    def take_look(self) -> Look:
        """Return what has happened since this was last called."""
        look, self._look = self._look, Look()
        for state in self._states:
            look.chains[state.chain.name] = state.look
            state.look = ChainLook(state.chain)
        return look

    def held_stamps(self, chain: Chain) -> dict[str, int]:
        """Return the stamps [ns] of those joints of a chain that are held."""
        names = [name for name in chain.joint_names if name in self._held]
        return {name: self._held[name].stamp for name in names}

    def _form_of(self, data: bytes) -> Form | None:
        """Return the form of a message; None if it is rejected."""
        try:
            form = self._reader.form_of(data)
        except MalformedMessageError as error:
            self._reject('malformed', str(error))
            return None
        if form.look is not self._look:
            form.look = self._look
            self._look.meet(form)
        if form.fault is not None:
            self._reject(*form.fault)
            return None
        return form

    def _reject(self, reason: str, fault: str) -> None:
        """Count and note a message that gives nothing."""
        self._look.rejected[reason] += 1
        self._look.faults[reason] = fault

    def _hold(self, form: Form, stamp: int, data: bytes) -> _Brought:
        """Hold what a message brings, and forget what is held if time has stepped back."""
        if stamp >= self._newest:
            self._newest = stamp
        elif self._has_stepped_back(stamp, form):
            self._reject(TIME_JUMP, f'{stamp / _SECOND:.3f} s')
            self._held.clear()
            self._newest = stamp
        velocities = form.velocities(data) if self._wants_velocities else None
        brought = _Brought(stamp, form.places, form.positions(data), velocities)
        held = self._held
        for joint in form.places:
            held[joint] = brought
        return brought

    def _has_stepped_back(self, stamp: int, form: Form) -> bool:
        if self._timeout and stamp < self._newest - self._timeout:
            return True
        held = [self._held[joint].stamp for joint in form.places if joint in self._held]
        return max(held, default=stamp) > stamp

    def _examine(self, state: _ChainState) -> tuple[float, ...] | None:
        """Return the positions held of a chain's joints; None if any is missing, stale or bad.

        What is the matter with any of them is noted.
        """
        held = self._held
        newest = max([held[joint].stamp for joint in state.joints if joint in held])
        found: defaultdict[str, dict[str, float]] = defaultdict(dict)
        positions = []
        for joint, (lower, upper), link in zip(
            state.joints, state.ranges, state.chain.joints
        ):
            if joint not in held:
                found['missing_joint'][joint] = _UNKNOWN
                continue
            brought = held[joint]
            position = brought.positions[brought.places[joint]]
            positions.append(position)
            lag = newest - brought.stamp
            if lag > self._timeout > 0:
                found['stale_joint'][joint] = lag / _SECOND
            elif not lower <= position <= upper:
                for reason in _faults(position, lower, upper, link):
                    found[reason][joint] = position
        reasons = [reason for reason in HOLD_BACK if reason in found]
        for reason in reasons or found:
            state.look.note(reason, found[reason])
        return None if reasons else tuple(positions)

    def _velocities(
        self, state: _ChainState, brought: _Brought, pick: Pick | None
    ) -> tuple[float, ...] | None:
        """Return the velocities of a chain's joints; None, which is noted, if one is unknown."""
        if pick is None or brought.velocities is None:
            qdot = tuple([self._held[joint].velocity(joint) for joint in state.joints])
        else:
            qdot = pick(brought.velocities)
        if _are_usable(qdot):
            return qdot
        bad = {
            joint: value
            for joint, value in zip(state.joints, qdot)
            if not abs(value) < LARGEST_VALUE
        }
        state.look.note('no_velocity', bad)
        return None


class _ChainState:
    """A chain, the ranges of its joints, and what has happened to it since the last look."""

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.joints = chain.joint_names
        self.look = ChainLook(chain)
        lower = [max(value, -_LARGEST_USABLE) for value in chain.lower.tolist()]
        upper = [min(value, _LARGEST_USABLE) for value in chain.upper.tolist()]
        self.ranges = list(zip(lower, upper))

    def is_in_range(self, q: Sequence[float]) -> bool:
        """Return whether all positions are within their ranges, and so finite."""
        for value, (lower, upper) in zip(q, self.ranges):
            if not lower <= value <= upper:
                return False
        return True


def _faults(
    position: float, lower: float, upper: float, link: DHLink
) -> tuple[str, ...]:
    """Return what is the matter with a position that is out of range."""
    if not abs(position) < LARGEST_VALUE:
        return ('non_finite',)
    beyond = max(lower - position, position - upper)
    if beyond > _TURN and abs(position) > _TURN and not link.is_prismatic:
        return 'looks_like_degrees', 'out_of_range'
    return ('out_of_range',)


def _are_usable(values: Sequence[float]) -> bool:
    """Return whether all values are finite, with room to compute with them."""
    for value in values:
        if not -LARGEST_VALUE < value < LARGEST_VALUE:
            return False
    return True
