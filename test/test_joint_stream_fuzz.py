"""A million spoilt messages, each refused or giving by the fast way what the plain way gives.

Half of them go to a stream that velocities are asked of, half to one without.
"""

import random
import struct

from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.ros import joint_stream
from icub_leg_fk.ros.joint_input import JointInput
from icub_leg_fk.ros.joint_state_cdr import decode_joint_state
from icub_leg_fk.ros.joint_stream import JointStream
from joint_model import CATALOG, Message
from joint_trial import bits, SECOND
import pytest

INPUTS = 1_000_000
BATCH = 1000
NOW = SECOND * SECOND  # ns
ABSURD = [struct.pack(order + 'I', n) for order in '<>' for n in (
    0, 1, 2, 3, 5, 8, 9, 12, 0xff, 0x10000, 2**28, 2**29, 2**31 - 1, 2**31, 2**32 - 4, 2**32 - 1)]
NUMBERS = [struct.pack('<d', x) for x in (0.0, -0.0, 2.5, -2.5, 1e150, 1e300)] + [
    struct.pack(order + 'd', x) for order in '<>'
    for x in (float('nan'), float('inf'), float('-inf'))]
SOUND = [Message(0, 0, names, tuple(0.1 * i for i in range(n)), (0.2,) * velocities,
                 (0.3,) * efforts, frame_id, order, extra)
         for names, n, velocities, efforts, frame_id, order, extra in (
             (('tilt', 'turn'), 2, 0, 0, '', '<', 0),
             (('turn', 'tilt'), 2, 0, 0, 'abc', '<', 4),
             (('tilt', 'turn', 'lift'), 3, 2, 0, '', '<', 0),
             (('tilt', 'turn', 'lift'), 3, 0, 2, '', '<', 4),
             (('lift',), 1, 1, 1, '', '<', 0),
             (('lift', 'x'), 3, 0, 0, '', '<', 0),
             (('tilt', 'turn'), 2, 2, 2, '', '<', 0),
             (('turn', 'tilt', 'lift'), 3, 4, 0, '', '<', 0),
             (('tilt', 'turn'), 2, 2, 1, '', '>', 0),
             (('x', 'tilt'), 2, 0, 0, '', '<', 0))]


def spoilt(rng, data, others):
    """Return data with one of the mistakes that a broken or hostile sender makes."""
    size = len(data)
    at = int(rng.random() * size)
    how = int(rng.random() * 8)
    if how == 0:
        data[at] = int(rng.random() * 256)
    elif how == 1:
        at &= ~3
        data[at:at + 4] = rng.choice(ABSURD)
    elif how == 2:
        del data[at:]
    elif how == 3:
        at = size - 4 - (at & ~7)  # the numbers lie near the end
        data[at:at + 8] = rng.choice(NUMBERS)
    elif how == 4:
        other = rng.choice(others)
        data[at:] = other[int(rng.random() * len(other)):]
    elif how == 5:
        data[int(rng.random() * 12)] = int(rng.random() * 256)  # encapsulation or stamp
    elif how == 6:
        data += rng.randbytes(1 + at % 8)
    else:
        for _ in range(3):
            data[int(rng.random() * size)] ^= 1 << int(rng.random() * 8)
    return data


class PlainWay:
    """What a stream does, message by message with the plain decoder and the plain rules."""

    def __init__(self, joint_input, out):
        self.input = joint_input
        self.out = out

    def feed(self, data):
        try:
            message = decode_joint_state(data)
        except MalformedMessageError as error:
            self.input.reject_malformed(error)
            return
        stamp = message.sec * SECOND + message.nanosec or NOW
        self.out += [(vector.chain, stamp, bits(vector.positions), bits(vector.velocities))
                     for vector in self.input.update(stamp, message.names, message.positions,
                                                     message.velocities)]


def fast_way(joint_input, out, velocities):
    stream = JointStream(joint_input, lambda: NOW, velocities)
    stream.on_ready = [
        lambda sec, nanosec, q, qdot, chain=chain: out.append(
            (chain, sec * SECOND + nanosec, bits(q), bits(qdot)))
        for chain in range(len(joint_input.chains))]
    return stream


@pytest.mark.parametrize('velocities', [False, True])
def test_spoilt_messages_are_refused_or_give_what_the_plain_way_gives(
        tmp_path, monkeypatch, velocities):
    file = tmp_path / 'kinematics.yaml'
    file.write_text(CATALOG)
    chains = [Catalog.load(file).chain(name, 'a') for name in ('camera', 'pointer')]
    rng = random.Random(20261122 + velocities)
    from_fast, from_plain = [], []
    fast = fast_way(JointInput(chains, 0.5), from_fast, velocities)
    plain = PlainWay(JointInput(chains, 0.5), from_plain)
    decoded = 0

    def counting_decode(data):
        nonlocal decoded
        decoded += 1
        return decode_joint_state(data)

    monkeypatch.setattr(joint_stream, 'decode_joint_state', counting_decode)
    sound = [message.cdr() for message in SOUND]
    poses = moving = 0
    for batch in range(INPUTS // 2 // BATCH):
        pair_sent = rng.sample(sound, 2)
        for i in range(BATCH):
            data = bytearray(pair_sent[i & 1])
            struct.pack_into('<II' if data[1] else '>II', data, 4, 1 + batch, i)
            inputs = [bytes(data)] if i % 16 < 2 else []
            inputs.append(bytes(spoilt(rng, data, sound)))
            for data in inputs:
                fast.feed(data)
                plain.feed(data)
                if from_fast or from_plain:
                    assert from_fast == [item if velocities else (*item[:3], None)
                                         for item in from_plain], data
                    poses += len(from_fast)
                    moving += sum(item[3] is not None for item in from_fast)
                    from_fast.clear()
                    from_plain.clear()
        ours, theirs = fast.settle(), plain.input
        assert (ours.messages, ours.counts, ours.newest, ours.chain_counts) == (
            theirs.messages, theirs.counts, theirs.newest, theirs.chain_counts), batch
    messages, counts = ours.messages, ours.counts
    assert messages >= INPUTS // 2
    # The spoiling reaches every reason, and leaves messages that make poses, by both ways.
    assert len(counts) == 5 and min(counts.values()) > 10, counts
    assert counts['malformed'] > messages / 5 and poses > messages / 5, (counts, poses)
    assert 0.1 < (messages - decoded) / messages < 0.9
    assert not velocities or 0.1 < moving / poses < 0.9
