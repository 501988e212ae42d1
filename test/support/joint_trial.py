"""Messages through the model of the rules and through the joint input, side by side."""

from dataclasses import dataclass
from itertools import islice
import math
import struct

from hypothesis import strategies as st
from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.stream.cdr import read_layout
from icub_leg_fk.stream.joint_input import JointInput
from support.joint_model import JointModel, LARGEST, Message

SECOND = 1_000_000_000
SPECIAL = (
    math.nan,
    math.inf,
    -math.inf,
    0.0,
    -0.0,
    1.0,
    math.nextafter(1.0, 2.0),
    -1.0,
    0.5,
    LARGEST,
    -LARGEST,
    math.nextafter(LARGEST, 0.0),
    1.7e308,
    -1.7e308,
    5e-324,
)


def bits(values):
    """Return floats as bytes, for an equality that tells -0.0 from 0.0."""
    return None if values is None else struct.pack(f'{len(values)}d', *values)


def decode_joint_state(data):
    """Return a serialized JointState as a message; raise MalformedMessageError if it is none."""
    layout = read_layout(data)
    order = layout.byte_order
    sec, nanosec = struct.unpack_from(f'{order}iI', data, 4)
    positions, velocities = layout.positions, layout.velocities
    return Message(
        sec,
        nanosec,
        layout.names,
        struct.unpack_from(f'{order}{positions.n}d', data, positions.at),
        struct.unpack_from(f'{order}{velocities.n}d', data, velocities.at),
        frame_id=layout.frame_id,
        order=order,
    )


class Trial:
    """A model and a joint input; every message goes to both, and what comes out is compared."""

    def __init__(self, chains, timeout=SECOND // 2):
        self.now = 1_700_000_000 * SECOND
        self.chains = chains
        ranges = {}
        for chain in chains:
            limits = [link.limits for link in chain.joints]
            ranges[chain.name] = dict(zip(chain.joint_names, limits, strict=True))
        self.model = JointModel(ranges, timeout)
        self.input = JointInput(lambda: self.now)
        self.input.configure(chains, timeout / SECOND, velocities=True)

    def send(self, message, data=None):
        """Send a message, in other bytes than its own if given; return the number of vectors."""
        sec, nanosec = message.sec, message.nanosec
        if sec == 0 and nanosec == 0:
            sec, nanosec = divmod(self.now, SECOND)
        expected = []
        for chain, q, qdot in self.model.update(sec * SECOND + nanosec, message):
            expected.append((chain, sec, nanosec, bits(q), bits(qdot)))
        vectors = self.input.feed(message.cdr() if data is None else data)
        found = []
        for vector in vectors:
            assert vector.chain in self.chains
            assert vector.stamp == sec * SECOND + nanosec
            found.append(
                (
                    vector.chain.name,
                    vector.sec,
                    vector.nanosec,
                    bits(vector.positions),
                    bits(vector.velocities),
                )
            )
        assert found == expected, message
        return len(found)

    def send_bytes(self, data):
        """Send bytes that may be anything, and return the number of vectors."""
        try:
            message = decode_joint_state(data)
        except MalformedMessageError:
            self.model.messages += 1
            self.model.reject('malformed')
            assert self.input.feed(data) == []
            return 0
        return self.send(message, data)

    def check_state(self):
        """Compare all that is held, counted and noted, then start counting anew."""
        model, look = self.model, self.input.take_look()
        assert look.messages == model.messages
        assert look.rejected == model.rejected
        assert look.faults.keys() == model.rejected.keys()
        assert look.frame_ids == dict(islice(model.joints_by_frame_id.items(), 8))
        for chain in self.chains:
            name = chain.name
            of_chain = look.chains[name]
            assert of_chain.chain is chain
            assert (of_chain.ready, of_chain.silent) == (
                model.ready[name],
                model.silent[name],
            )
            assert of_chain.held_back == model.held_back[name]
            assert concerned_joints(of_chain) == model.concerned[name]
            held = {
                joint: model.held[joint].stamp
                for joint in model.held.keys() & set(model.chains[name])
            }
            assert self.input.held_stamps(chain) == held
        model.count_anew()


def concerned_joints(of_chain):
    """Return the reasons of which the rules know, each with a joint it concerns."""
    concerned = set()
    for reason in of_chain.joints.keys() - {'looks_like_degrees'}:
        concerned |= {(reason, joint) for joint in of_chain.joints[reason]}
    return concerned


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


FAULTS = (
    'position',
    'velocity',
    'cut',
    'repeat',
    'back',
    'late',
    'zero stamp',
    'again',
    'no carry',
)


def publishers(chains):
    """Return a strategy: publishers as on robots, of bridges for parts, and strangers."""
    own = [chain.joint_names for chain in chains]
    joints = list(dict.fromkeys(chain_joint for names in own for chain_joint in names))
    strangers = ['', 'wheel', 'läuft', joints[0].upper(), joints[0] + ' ']
    names = st.one_of(
        st.sampled_from([tuple(joints), *own, ('wheel', *joints, '')]),
        st.permutations(joints).map(tuple),
        st.lists(st.sampled_from(joints + strangers), unique=True).map(tuple),
    )
    publisher = st.builds(
        Publisher,
        names=names,
        surplus=st.sampled_from((0, 0, 0, 0, 0, 0, 1, 4)),
        velocities=st.sampled_from((0, 1, 1, 1.5, 0.5)),
        efforts=st.sampled_from((0, 1, 1, 1.5, 0.5)),
        frame_id=st.sampled_from(('', 'base_link')),
        order=st.sampled_from('<<<>'),
        extra=st.sampled_from((0, 0, 4, 9)),
    )
    return st.lists(publisher, min_size=1, max_size=12)


def steps(faults):
    """Return a strategy: a sequence of messages of which this share, 0 to 1, has a fault."""
    choices = [None]
    if faults:
        choices = [None] * round(len(FAULTS) * (1 / faults - 1)) + list(FAULTS)
    step = st.builds(
        Step,
        publisher=st.integers(0, 11),
        elapsed=st.sampled_from((1, 10**6, 10**7, 10**7, SECOND // 2)),
        fault=st.sampled_from(choices),
        at=st.integers(0, 40),
        value=st.sampled_from(SPECIAL),
        shift=st.sampled_from(
            (0, 1, 10**6, SECOND // 2, SECOND // 2 + 1, 3 * SECOND, 10**19)
        ),
        padding=st.sampled_from((0, 0, 255)),
    )
    return st.lists(step, min_size=10, max_size=60)


STARTS = st.sampled_from((0, 7, 1_700_000_000, -3, 2**31 - 20))  # s


def traffic(publishers, steps, start):
    """Yield the messages of some publishers who take turns."""
    time = start * SECOND
    last = {}
    for number, step in enumerate(steps):
        publisher = publishers[step.publisher % len(publishers)]
        time += step.elapsed
        if step.fault == 'back':
            time = max(time - step.shift, -2 * SECOND)
        stamp = time
        if step.fault == 'late':
            stamp -= step.shift
        elif step.fault == 'zero stamp':
            stamp = 0
        elif step.fault == 'again':
            stamp = last.get(publisher, stamp)
        last[publisher] = stamp
        carry = (
            1 + step.at % 3 if step.fault == 'no carry' else 0
        )  # some publishers do not
        sec, nanosec = divmod(stamp, SECOND)
        sec = min(max(sec, carry - 2**31), 2**31 - 1)
        names, positions, velocities, efforts = contents(publisher, number, step)
        yield Message(
            sec - carry,
            nanosec + carry * SECOND,
            tuple(names),
            tuple(positions),
            tuple(velocities),
            tuple(efforts),
            publisher.frame_id,
            publisher.order,
            publisher.extra,
            step.padding,
        )


def contents(publisher, number, step):
    """Return the lists of a message, with the fault that a step has."""
    names = list(publisher.names)
    n = len(names)
    positions = values(number, n + publisher.surplus)
    velocities = values(number, int(n * publisher.velocities))
    efforts = values(number, int(n * publisher.efforts))
    at = step.at % max(n, 1)
    if step.fault == 'position' and n:
        positions[at] = step.value
    elif step.fault == 'velocity' and velocities:
        velocities[at % len(velocities)] = step.value
    elif step.fault == 'cut':
        del positions[at:]
    elif step.fault == 'repeat' and n:
        names[-1] = names[at]
    return names, positions, velocities, efforts


def values(number, n):
    """Return n numbers that differ from message to message and from joint to joint, within 0.4."""
    return [((31 * number + 17 * i) % 81 - 40) / 100 for i in range(n)]
