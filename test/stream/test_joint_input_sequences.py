"""Arbitrary messages, sound and spoilt, through the joint input and a naive model of its rules."""

from functools import cache
from pathlib import Path
import struct
from tempfile import TemporaryDirectory

from hypothesis import given, settings
from hypothesis import strategies as st
from icub_leg_fk.kinematics import Catalog
from support.joint_model import CATALOG
from support.joint_trial import publishers, SECOND, STARTS, steps, traffic, Trial

TIMEOUTS = st.sampled_from((0, 1, 1_000_000, SECOND // 2, 30 * SECOND))  # ns
SPOILT_WORDS = [
    struct.pack(order + 'I', n)
    for order in '<>'
    for n in (
        0,
        1,
        2,
        3,
        5,
        8,
        9,
        12,
        0xFF,
        0x10000,
        2**28,
        2**29,
        2**31 - 1,
        2**31,
        2**32 - 4,
        2**32 - 1,
    )
] + [
    struct.pack(order + 'd', x)
    for order in '<>'
    for x in (
        0.0,
        -0.0,
        2.5,
        -2.5,
        1e150,
        1e300,
        float('nan'),
        float('inf'),
        float('-inf'),
    )
]
SPOILS = st.tuples(
    st.sampled_from(
        (
            'not',
            'not',
            'byte',
            'bit',
            'word',
            'number',
            'cut',
            'splice',
            'append',
            'stamp',
        )
    ),
    st.integers(0, 1000),
    st.integers(0, 255),
    st.sampled_from(SPOILT_WORDS),
)


@cache
def robots():
    """Return chains that share joints, and the iCub's own."""
    with TemporaryDirectory() as directory:
        file = Path(directory) / 'kinematics.yaml'
        file.write_text(CATALOG)
        robot = Catalog.load(file)
    arm, camera, pointer = robot.select(['arm', 'camera', 'pointer'])
    icub = Catalog.load()
    return (
        (arm, camera, pointer),
        (pointer,),
        (camera, arm),
        icub.select(['left_leg=v2_5', 'right_leg=v2_5']),
        icub.select(['left_leg=v1', 'head_imu=v2']),
    )


@st.composite
def messages(draw):
    """Return some chains, and messages that are well-formed if not always sensible."""
    chains = draw(st.sampled_from(robots()))
    faults = draw(st.sampled_from((0.0, 0.05, 0.2, 0.6)))
    return chains, list(
        traffic(draw(publishers(chains)), draw(steps(faults)), draw(STARTS))
    )


def test_any_sequence_gives_the_poses_that_the_rules_give():
    sent = ready = 0

    @settings(max_examples=200)
    @given(messages(), TIMEOUTS, st.integers(1, 60))
    def run(given_messages, timeout, period):
        nonlocal sent, ready
        chains, sequence = given_messages
        trial = Trial(chains, timeout)
        for number, message in enumerate(sequence, 1):
            trial.now += 10_000_000
            ready += trial.send(message)
            sent += 1
            if number % period == 0:
                trial.check_state()
        trial.check_state()

    run()
    assert ready > sent / 5, 'the traffic hardly makes poses'


def test_spoilt_messages_are_refused_or_give_what_their_bytes_say():
    sent = ready = 0

    @settings(max_examples=200)
    @given(messages(), st.lists(SPOILS, min_size=1, max_size=60))
    def run(given_messages, spoils):
        nonlocal sent, ready
        chains, sequence = given_messages
        trial = Trial(chains)
        for number, message in enumerate(sequence):
            data = spoilt(
                message.cdr(), sequence[0].cdr(), *spoils[number % len(spoils)]
            )
            ready += trial.send_bytes(data)
            sent += 1
        trial.check_state()

    run()
    assert ready > sent / 20


def spoilt(data, other, how, at, byte, word):
    """Return data with one of the mistakes that a broken or hostile sender makes."""
    data = bytearray(data)
    at %= len(data)
    if how == 'byte':
        data[at] = byte
    elif how == 'bit':
        data[at] ^= 1 << byte % 8
    elif how == 'word':
        data[at & ~3 : (at & ~3) + 4] = word[:4]
    elif how == 'number':  # they lie near the end
        start = len(data) - 4 - (at & ~7)
        data[start : start + 8] = word
    elif how == 'cut':
        del data[at:]
    elif how == 'splice':
        data[at:] = other[at * byte // 255 :]
    elif how == 'append':
        data += word[: 1 + byte % 8]
    elif how == 'stamp':  # or encapsulation
        data[at % 12] = byte
    return bytes(data)
