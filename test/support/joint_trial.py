"""Messages through the model of the rules and through the joint input, side by side."""

from collections import Counter
from dataclasses import dataclass
import math
import struct

from hypothesis import strategies as st
from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.stream.cdr import read_layout
from icub_leg_fk.stream.joint_input import JointInput
from support.joint_model import JointModel, LARGEST, Message

SECOND = 1_000_000_000
SPECIAL = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1.0, math.nextafter(1.0, 2.0), -1.0, 0.5,
           LARGEST, -LARGEST, math.nextafter(LARGEST, 0.0), 1.7e308, -1.7e308, 5e-324)


def bits(values):
    """Return floats as bytes, for an equality that tells -0.0 from 0.0."""
    return None if values is None else struct.pack(f'{len(values)}d', *values)


def decode_joint_state(data):
    """Return a serialized JointState as a message; raise MalformedMessageError if it is none."""
    layout = read_layout(data)
    sec, nanosec = struct.unpack_from(f'{layout.byte_order}iI', data, 4)
    positions, velocities = (
        struct.unpack_from(f'{layout.byte_order}{n}d', data, at)
        for at, n in (layout.positions, layout.velocities))
    return Message(sec, nanosec, layout.names, positions, velocities)


class Trial:
    """A model and a joint input; every message goes to both, and what comes out is compared."""

    def __init__(self, chains, timeout=SECOND // 2):
        self.now = 1_700_000_000 * SECOND
        self.model = JointModel([
            {joint: link.limits
             for joint, link in zip(chain.joint_names, chain.joints, strict=True)}
            for chain in chains], timeout)
        self.reported = Counter()
        self.input = JointInput(chains, timeout / SECOND, lambda: self.now, self._report,
                                velocities=True)

    def _report(self, reason, text):
        self.reported[reason] += 1

    def send(self, message):
        """Send a message and return the chains it made ready."""
        sec, nanosec = message.sec, message.nanosec
        if sec == 0 and nanosec == 0:
            sec, nanosec = divmod(self.now, SECOND)
        ready = self.model.update(sec * SECOND + nanosec, message.names, message.positions,
                                  message.velocities)
        expected = [(chain, sec, nanosec, bits(q), bits(qdot)) for chain, q, qdot in ready]
        assert [(chain, sec, nanosec, bits(q), bits(qdot))
                for chain, sec, nanosec, q, qdot in self.input.feed(message.cdr())
                ] == expected, message
        return [chain for chain, _, _ in ready]

    def send_bytes(self, data):
        """Send bytes that may be anything, and return the chains they made ready."""
        try:
            message = decode_joint_state(data)
        except MalformedMessageError:
            self.model.messages += 1
            self.model.counts['malformed'] += 1
            assert self.input.feed(data) == []
            return []
        stamp = message.sec * SECOND + message.nanosec
        if message.sec == 0 and message.nanosec == 0:
            stamp = self.now
        ready = self.model.update(stamp, message.names, message.positions, message.velocities)
        assert [(chain, sec * SECOND + nanosec, bits(q), bits(qdot))
                for chain, sec, nanosec, q, qdot in self.input.feed(data)] == [
                    (chain, stamp, bits(q), bits(qdot)) for chain, q, qdot in ready], data
        return [chain for chain, _, _ in ready]

    def check_state(self):
        """Compare all that is held and counted, then start counting anew."""
        model = self.model
        for index, chain in enumerate(model.chains):
            counts = self.input.take_counts(index)
            assert counts.ready == model.ready[index]
            assert counts.held_back == model.held_back[index]
            assert {(reason, joint) for reason, joints in counts.joints.items()
                    for joint in joints
                    if reason != 'looks_like_degrees'} == model.concerned[index]
            assert self.input.known_joints(index) == {
                joint: model.held[joint].stamp for joint in chain if joint in model.held}
        assert (self.input.messages, self.input.newest) == (model.messages, model.newest)
        assert self.input.counts == model.counts
        expected = sum(model.held_back, Counter()) + model.counts
        del expected['empty_position']
        assert self.reported == expected
        model.counts_taken()
        self.reported = +Counter({reason: n for reason, n in model.counts.items()
                                  if reason != 'empty_position'})


@dataclass(frozen=True)
class Publisher:
    """Somebody who sends JointStates of one form."""

    names: tuple[str, ...]
    surplus: int  # positions beyond the names
    velocities: float  # per name
    efforts: float
    frame_id: str
    order: str
    extra: int


@dataclass(frozen=True)
class Step:
    """One message: whose, how long after the last, and what is the matter with it."""

    publisher: int
    elapsed: int  # ns
    fault: str | None
    at: int  # where the fault is
    value: float
    shift: int  # ns
    padding: int


FAULTS = ('position', 'velocity', 'cut', 'drop', 'repeat', 'reverse', 'swap', 'stranger', 'back',
          'late', 'zero stamp', 'again', 'no carry')


def publishers(chains):
    """Return a strategy: publishers as on robots, of bridges for parts, and strangers."""
    own = [chain.joint_names for chain in chains]
    joints = list(dict.fromkeys(name for names in own for name in names))
    strangers = ['', 'wheel', 'läuft', joints[0].upper(), joints[0] + ' ']
    names = st.one_of(
        st.sampled_from([tuple(joints), *own, ('wheel', *joints, '')]),
        st.permutations(joints).map(tuple),
        st.lists(st.sampled_from(joints + strangers), unique=True).map(tuple))
    per_name = st.sampled_from((0, 1, 1, 1.5, 0.5))
    return st.lists(st.builds(
        Publisher, names, st.sampled_from((0, 0, 0, 1, 4)), per_name, per_name,
        st.sampled_from(('', 'base_link')), st.sampled_from('<<<>'), st.sampled_from((0, 0, 4, 9)),
    ), min_size=1, max_size=12)


def steps(faults):
    """Return a strategy: a sequence of messages of which this share, 0 to 1, has a fault."""
    sound = [None] * round(len(FAULTS) * (1 / faults - 1)) if faults else [None]
    return st.lists(st.builds(
        Step, st.integers(0, 11), st.sampled_from((1, 10**6, 10**7, 10**7, SECOND // 2)),
        st.sampled_from((*sound, *(FAULTS if faults else ()))), st.integers(0, 40),
        st.sampled_from(SPECIAL),
        st.sampled_from((0, 1, 10**6, SECOND // 2, SECOND // 2 + 1, 3 * SECOND, 10**19)),
        st.sampled_from((0, 0, 255))), max_size=60)


STARTS = st.sampled_from((0, 7, 1_700_000_000, -3, 2**31 - 20))  # s


def traffic(publishers, steps, start):
    """Yield the messages of some publishers who take turns."""
    time, last = start * SECOND, {}
    for number, step in enumerate(steps):
        publisher = publishers[step.publisher % len(publishers)]
        n = len(publisher.names)
        names = list(publisher.names)
        # Numbers that differ from message to message and from joint to joint, within 0.4.
        positions, velocities, efforts = (
            [((31 * number + 17 * i) % 81 - 40) / 100 for i in range(int(size))]
            for size in (n + publisher.surplus, n * publisher.velocities, n * publisher.efforts))
        at = step.at % n if n else 0
        time += step.elapsed
        if step.fault == 'back':
            time = max(time - step.shift, -2 * SECOND)
        stamp, carry = time, 0
        if step.fault == 'position' and n:
            positions[at] = step.value
        elif step.fault == 'velocity' and velocities:
            velocities[at % len(velocities)] = step.value
        elif step.fault == 'cut':
            del positions[at:]
        elif step.fault == 'drop':
            del names[at:at + 1]
        elif step.fault == 'repeat' and n:
            names[-1] = names[at]
        elif step.fault == 'reverse':
            names.reverse()
        elif step.fault == 'swap':
            velocities, efforts = efforts, velocities
        elif step.fault == 'stranger':
            names.insert(at, 'stranger')
        elif step.fault == 'late':
            stamp -= step.shift
        elif step.fault == 'zero stamp':
            stamp = 0
        elif step.fault == 'again':
            stamp = last.get(publisher, stamp)
        elif step.fault == 'no carry':  # some publishers do not; it is the same time
            carry = 1 + step.at % 3
        last[publisher] = stamp
        sec, nanosec = divmod(stamp, SECOND)
        sec = min(max(sec, carry - 2**31), 2**31 - 1)
        yield Message(sec - carry, nanosec + carry * SECOND, tuple(names), tuple(positions),
                      tuple(velocities), tuple(efforts), publisher.frame_id, publisher.order,
                      publisher.extra, step.padding)
