"""Arbitrary messages, sound and spoilt, through the joint input and a naive model of its rules."""

import struct

from hypothesis import given, settings
from hypothesis import strategies as st
from icub_leg_fk.kinematics import Catalog
from joint_model import CATALOG
from joint_trial import SECOND, Traffic, Trial
import pytest

TIMEOUTS = (0, 1, 1_000_000, SECOND // 2, 30 * SECOND)  # ns
ABSURD = [struct.pack(order + 'I', n) for order in '<>' for n in (
    0, 1, 2, 3, 5, 8, 9, 12, 0xff, 0x10000, 2**28, 2**29, 2**31 - 1, 2**31, 2**32 - 4, 2**32 - 1)]
NUMBERS = [struct.pack('<d', x) for x in (0.0, -0.0, 2.5, -2.5, 1e150, 1e300)] + [
    struct.pack(order + 'd', x) for order in '<>'
    for x in (float('nan'), float('inf'), float('-inf'))]


@pytest.fixture(scope='module')
def robots(tmp_path_factory):
    """Return chains that share joints, and the iCub's own."""
    file = tmp_path_factory.mktemp('catalog') / 'kinematics.yaml'
    file.write_text(CATALOG)
    robot, icub = Catalog.load(file), Catalog.load()
    arm, camera, pointer = (robot.chain(name, 'a') for name in ('arm', 'camera', 'pointer'))
    return ((arm, camera, pointer), (pointer,), (camera, arm),
            tuple(icub.chain(name, 'v2_5') for name in ('left_leg', 'right_leg')),
            (icub.chain('left_leg', 'v1'), icub.chain('head_imu', 'v2')))


def test_any_sequence_gives_the_poses_that_the_rules_give(robots):
    sent = ready = 0

    @settings(max_examples=150)
    @given(rng=st.randoms(use_true_random=False), length=st.integers(1, 400))
    def run(rng, length):
        nonlocal sent, ready
        chains = rng.choice(robots)
        trial, traffic = Trial(chains, rng.choice(TIMEOUTS)), Traffic(rng, chains)
        checked = rng.choice((0.002, 0.02, 1.0))
        for _ in range(length):
            trial.now += rng.randrange(20_000_000)
            ready += len(trial.send(traffic.next_message()))
            sent += 1
            if rng.random() < checked:
                trial.check_state()
        trial.check_state()

    run()
    assert ready > sent / 5, 'the traffic hardly makes poses'


def test_spoilt_messages_are_refused_or_give_what_their_bytes_say(robots):
    sent = ready = 0

    @settings(max_examples=150)
    @given(rng=st.randoms(use_true_random=False), length=st.integers(1, 300))
    def run(rng, length):
        nonlocal sent, ready
        chains = rng.choice(robots)
        trial, traffic = Trial(chains), Traffic(rng, chains)
        others = [traffic.next_message().cdr() for _ in range(3)]
        for _ in range(length):
            data = bytearray(traffic.next_message().cdr())
            if rng.random() < 0.7:
                data = spoilt(rng, data, others)
            ready += len(trial.send_bytes(bytes(data)))
            sent += 1
        trial.check_state()

    run()
    assert ready > sent / 20


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
