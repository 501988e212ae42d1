"""Messages through the model of the rules and through the joint input, side by side."""

from collections import Counter
import math
import struct

from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.ros.cdr import decode_joint_state
from icub_leg_fk.ros.joint_input import JointInput
from joint_model import JointModel, LARGEST, Message

SECOND = 1_000_000_000
SPECIAL = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1.0, math.nextafter(1.0, 2.0), -1.0, 0.5,
           LARGEST, -LARGEST, math.nextafter(LARGEST, 0.0), 1.7e308, -1.7e308, 5e-324)


def bits(values):
    """Return floats as bytes, for an equality that tells -0.0 from 0.0."""
    return None if values is None else struct.pack(f'{len(values)}d', *values)


class Trial:
    """A model and a joint input; every message goes to both, and what comes out is compared."""

    def __init__(self, chains, timeout=SECOND // 2):
        self.now = 1_700_000_000 * SECOND
        self.model = JointModel([
            {joint: link.limits
             for joint, link in zip(chain.joint_names, chain.joints, strict=True)}
            for chain in chains], timeout)
        self.reported = Counter()
        self.input = JointInput(chains, timeout / SECOND, lambda: self.now, self._report)

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
                    for joint in joints if reason != 'looks_like_degrees'} == model.blamed[index]
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


class Traffic:
    """Messages as robots, bridges, bags and strangers send them, from one random generator.

    Some publishers, each with names and lengths of its own, take turns; now and then a message
    is at fault or the clock is.
    """

    def __init__(self, rng, chains):
        self.rng = rng
        self.chains = [chain.joint_names for chain in chains]
        self.joints = list(dict.fromkeys(name for names in self.chains for name in names))
        self.publishers = [self._publisher() for _ in range(rng.choice((1, 2, 3, 5, 12)))]
        self.last = {}
        self.faults = rng.choice((0.0, 0.02, 0.2, 0.6))
        self.stamp = rng.choice((0, 7, 1_700_000_000, -3, 2**31 - 20)) * SECOND
        self.step = rng.choice((1, 1_000_000, 10_000_000, 300_000_000))

    def _publisher(self):
        rng = self.rng
        names = rng.choice((list(self.joints), list(self.joints), list(rng.choice(self.chains)),
                            rng.sample(self.joints, rng.randint(1, len(self.joints))), []))
        names += rng.sample(('', 'wheel', 'läuft', self.joints[0].upper(), self.joints[0] + ' '),
                            rng.choice((0, 0, 1, 3)))
        if rng.random() < 0.3:
            rng.shuffle(names)
        n = len(names)
        lengths = n + rng.choice((0, 0, 0, 1, 4)), *rng.choices((0, n, n, n + 2, n // 2), k=2)
        return (tuple(names), lengths, rng.choice(('', 'base_link')),
                rng.choice('<<<<<>'), rng.choice((0, 0, 0, 4, 8)))

    def _values(self, n):
        return [self.rng.uniform(-0.4, 0.4) for _ in range(n)]

    def next_message(self):
        """Return a message, well-formed if not always sensible."""
        rng = self.rng
        publisher = rng.choice(self.publishers)
        names, lengths, frame_id, order, extra = publisher
        self.stamp += self.step
        stamp = self.stamp
        positions, velocities, efforts = map(self._values, lengths)
        if rng.random() < self.faults:
            fault = rng.randrange(10)
            if fault == 0 and positions:
                positions[rng.randrange(len(positions))] = rng.choice(SPECIAL)
            elif fault == 1:
                names, positions = self._spoil(list(names), positions)
            elif fault == 2:
                back = rng.choice((0, 1, SECOND // 2, SECOND // 2 + 1, 3 * SECOND, 10**19))
                self.stamp = max(stamp - back, -2 * SECOND)
                stamp = self.stamp
            elif fault == 3:  # one message late, or early
                stamp += rng.choice((-1, 1)) * rng.choice((1, self.step, SECOND // 2, SECOND))
            elif fault == 4:
                self.stamp = stamp = stamp + rng.choice((SECOND // 2, SECOND // 2 + 1, 9 * SECOND))
            elif fault == 5:
                stamp = 0
            elif fault == 6 and velocities:
                velocities[rng.randrange(len(velocities))] = rng.choice(SPECIAL)
            elif fault == 7:
                velocities, efforts = efforts, velocities
            elif fault == 8:  # the same time again, while others have gone on
                stamp = self.last.get(publisher, stamp)
            else:
                positions = positions[:rng.randint(0, len(positions))]
        self.last[publisher] = stamp
        sec, nanosec = divmod(stamp, SECOND)
        sec = min(max(sec, -2**31), 2**31 - 1)
        if rng.random() < 0.05:  # some publishers do not carry over; it is the same time
            carry = rng.randint(1, 3)
            sec, nanosec = max(sec - carry, -2**31), nanosec + carry * SECOND
        return Message(sec, nanosec, names, tuple(positions), tuple(velocities), tuple(efforts),
                       frame_id, order, extra, rng.choice((0, 0, 0, 255)))

    def _spoil(self, names, positions):
        """Drop, repeat, swap or add a name."""
        rng = self.rng
        how = rng.randrange(4)
        if how == 0 and names:
            del names[rng.randrange(len(names))]
        elif how == 1 and names:
            names.append(rng.choice(names))
        elif how == 2:
            rng.shuffle(names)
        else:
            names.append(rng.choice((*self.joints, '', 'stranger')))
        if rng.random() < 0.7:
            positions = self._values(len(names))
        return tuple(names), positions
