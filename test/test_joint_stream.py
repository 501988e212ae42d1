"""The fast way of the joint stream, in each case where it might differ from the plain one.

`Trial` sends each message to both (and to a naive model) and compares all that comes out.
"""

from dataclasses import replace
import math
import struct

from icub_leg_fk.kinematics import Catalog
from icub_leg_fk.ros import joint_stream
from icub_leg_fk.ros.joint_input import JointInput
from icub_leg_fk.ros.joint_state_cdr import decode_joint_state
from icub_leg_fk.ros.joint_stream import JointStream
from joint_model import CATALOG, LARGEST, Message
from joint_trial import SECOND, Trial
import pytest

ALL = ('turn', 'lift', 'reach', 'tilt')
ARM, CAMERA, POINTER = range(3)


@pytest.fixture
def chains(tmp_path):
    """Return an arm, a camera and a pointer, which share joints with it."""
    file = tmp_path / 'kinematics.yaml'
    file.write_text(CATALOG)
    return [Catalog.load(file).chain(name, 'a') for name in ('arm', 'camera', 'pointer')]


@pytest.fixture
def trial(chains):
    """Return a trial, which is looked at once more in the end."""
    trial = Trial(chains)
    yield trial
    trial.check_state()


@pytest.fixture
def decoded(monkeypatch):
    """Return the list of messages that a stream decoded in full."""
    messages = []

    def decode(data):
        messages.append(data)
        return decode_joint_state(data)

    monkeypatch.setattr(joint_stream, 'decode_joint_state', decode)
    return messages


def at(ms, names=ALL, positions=None, **others):
    """Return a message at a time [ms], with positions inside every range but lift's."""
    sec, rest = divmod(ms, 1000)
    if positions is None:
        positions = tuple(0.1 + 0.01 * i for i in range(len(names)))
    return Message(sec, rest * 1_000_000, tuple(names), tuple(positions), **others)


def warm(trial, **others):
    """Send two messages, after which the fast way is taken."""
    for ms in (1000, 1010):
        assert trial.send(at(ms, **others)) == [ARM, CAMERA, POINTER]


def test_only_the_first_message_of_a_kind_is_decoded_in_full(chains, decoded):
    stream = JointStream(JointInput(chains, 0.5), lambda: 0)
    for ms in range(1000, 1100):
        stream.feed(at(ms).cdr())
        stream.feed(at(ms, ('turn', 'tilt')[::-1] + ('lift', 'reach')).cdr())
    assert len(decoded) == 2


def test_velocities_may_be_wanted_later_and_no_longer(chains, decoded):
    stream = JointStream(JointInput(chains, 0.5), lambda: 0)
    velocities = []
    stream.on_ready = [None, None, lambda sec, nanosec, q, qdot: velocities.append(qdot)]
    expected = []
    for ms in range(1000, 1030):
        wanted = 1010 <= ms < 1020
        if ms in (1010, 1020):
            stream.want_velocities(wanted)
        message = at(ms, velocities=(1.0, 2.0, 3.0, float(ms)))
        stream.feed(message.cdr())
        held = dict(zip(message.names, message.velocities, strict=True))
        expected.append(tuple(held[name] for name in chains[POINTER].joint_names)
                        if wanted else None)
    assert velocities == expected
    assert len(decoded) == 3
    assert stream.settle().messages == 30
    assert stream.settle().take_counts(POINTER).ready == 30


def test_padding_that_changes_every_time_does_not_slow_the_stream_down(chains, decoded):
    stream = JointStream(JointInput(chains, 0.5), lambda: 0)
    for i in range(100):
        stream.feed(at(1000 + i, padding=i).cdr())
    assert len(decoded) == 1


def test_padding_may_hold_anything(trial):
    for i in range(30):
        trial.send(at(1000 + i, padding=37 * i % 256))
        trial.send(at(1000 + i, ('tilt', 'turn'), padding=91 * i % 256))


def test_names_of_equal_length_are_told_apart(trial):
    warm(trial)
    assert trial.send(at(1020, ('turn', 'lift', 'reach', 'tolt'))) == [ARM, CAMERA, POINTER]
    assert trial.send(at(2000, ('turn', 'lift', 'reach', 'tolt'))) == [ARM, POINTER]


def test_a_rejected_message_leaves_no_layout(trial, decoded):
    for message in (at(1000, positions=(0.1, 0.2, 0.3)), at(1000, positions=()),
                    at(1000, (*ALL, 'turn')), at(1000, (*ALL, 'x', 'x'))):
        for step in range(3):
            assert trial.send(replace(message, nanosec=step)) == []
    warm(trial)
    assert trial.send(at(1020, positions=(0.1, 0.2, 0.3))) == []
    assert trial.send(at(1030)) == [ARM, CAMERA, POINTER]


def test_a_name_that_stands_twice_among_strangers_is_rejected_each_time(trial):
    warm(trial)
    for ms in (1020, 1030, 1040):
        assert trial.send(at(ms, (*ALL, 'x', 'x'))) == []
        assert trial.send(at(ms, (*ALL, '', ''))) == []
        assert trial.send(at(ms, (*ALL, 'x', ''))) == [ARM, CAMERA, POINTER]


def test_equal_bytes_with_other_counts_behind_are_told_apart(trial):
    with_velocities = at(1000, velocities=(1.0, 2.0, 3.0, 4.0))
    with_efforts = at(1000, efforts=(1.0, 2.0, 3.0, 4.0), extra=4)
    assert len(with_velocities.cdr()) == len(with_efforts.cdr())
    for step in range(4):
        trial.send(replace(with_velocities, nanosec=step))
        trial.send(replace(with_efforts, nanosec=step))


@pytest.mark.parametrize('which', ['velocity_count_at', 'effort_count_at'])
def test_an_absurd_count_behind_the_positions_is_refused_by_the_fast_way_too(trial, which):
    message = at(1020, velocities=(0.0,) * 4, efforts=(0.0,) * 4)
    warm(trial, velocities=(0.0,) * 4, efforts=(0.0,) * 4)
    offset = getattr(decode_joint_state(message.cdr()), which)
    for count in (10, 2**32 - 1):
        data = bytearray(message.cdr())
        struct.pack_into('<I', data, offset, count)
        trial.send_malformed(bytes(data))
    assert trial.send(message) == [ARM, CAMERA, POINTER]


def test_the_other_byte_order_under_the_same_bytes_is_refused(trial):
    warm(trial)
    trial.send_malformed(b'\x00\x00' + at(1020).cdr()[2:])
    trial.send_malformed(b'\x00\x03' + at(1020).cdr()[2:])
    assert trial.send(at(1020)) == [ARM, CAMERA, POINTER]


def test_big_endian_messages_take_the_fast_way_as_well(trial, chains, decoded):
    for ms in range(1000, 1010):
        assert trial.send(at(ms, order='>')) == [ARM, CAMERA, POINTER]
    decoded.clear()
    stream = JointStream(JointInput(chains, 0.5), lambda: 0)
    for ms in range(1000, 1010):
        stream.feed(at(ms, order='>').cdr())
    assert len(decoded) == 1


def test_overlapping_layouts_settle_in_the_order_they_came(trial):
    one, other = at(1000), at(1000, ('x', *ALL[::-1]), (0.5, 0.6, 0.7, 0.8, 0.9))
    for sec, order in enumerate(((one, other), (other, one), (one, other)), start=1):
        for step in range(10):
            for message in order:
                trial.send(replace(message, sec=sec, nanosec=step))
        # Only a message that brings a part of a chain shows which positions are held.
        assert trial.send(Message(sec, 10, ('reach',), (0.1,))) == [ARM]


def test_a_part_of_a_chain_uses_what_the_fast_way_held(trial):
    warm(trial)
    assert trial.send(at(1020, positions=(0.5, 0.6, 0.7, 0.8))) == [ARM, CAMERA, POINTER]
    assert trial.send(at(1030, ('reach',), (-0.0,))) == [ARM]


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf, LARGEST, -LARGEST, 1e308])
@pytest.mark.parametrize('index', range(4))
def test_a_value_not_to_compute_with_holds_back_just_its_chains(trial, value, index):
    warm(trial)
    positions = [0.1] * 4
    positions[index] = value
    blamed = [{ARM, CAMERA}, {ARM, POINTER}, {ARM}, {CAMERA}][index]
    for ms in (1020, 1030):
        assert set(trial.send(at(ms, positions=positions))) == {ARM, CAMERA, POINTER} - blamed
    assert trial.send(at(1040)) == [ARM, CAMERA, POINTER]


def test_a_value_not_to_compute_with_behind_one_out_of_range_is_found(trial):
    warm(trial)
    assert trial.send(at(1020, positions=(9.0, 0.1, math.nan, 0.1))) == [CAMERA, POINTER]


def test_a_strangers_value_does_not_matter(trial):
    for ms in (1000, 1010, 1020):
        ready = trial.send(at(ms, ('x', *ALL), (math.nan, 0.1, 0.1, 0.1, 0.1)))
        assert ready == [ARM, CAMERA, POINTER]


@pytest.mark.parametrize('value', [-1.0, 1.0, math.nextafter(1.0, 2.0), math.nextafter(-1.0, -2.0),
                                   0.5, math.nextafter(0.5, 1.0), -2.0, 2.0, 0.0, -0.0, 5e-324,
                                   math.nextafter(LARGEST, 0.0), -math.nextafter(LARGEST, 0.0)])
def test_out_of_range_is_noted_and_goes_out(trial, value):
    warm(trial)
    trial.check_state()
    for index in range(4):
        positions = [0.0] * 4
        positions[index] = value
        assert trial.send(at(1020, positions=positions)) == [ARM, CAMERA, POINTER]
        trial.check_state()


def test_negative_zero_goes_out_as_it_is(trial):
    warm(trial)
    trial.send(at(1020, positions=(-0.0,) * 4))
    trial.send(at(1030, ('reach',), (0.0,)))


@pytest.mark.parametrize('back', [1, SECOND // 2, SECOND // 2 + 1, 10**9, 10**18])
def test_time_stepping_back_is_seen(trial, back):
    warm(trial)
    assert trial.send(at(1020)) == [ARM, CAMERA, POINTER]
    sec, nanosec = divmod(1_020_000_000 - back, SECOND)
    assert trial.send(replace(at(0), sec=max(sec, -2**31), nanosec=nanosec)) == [0, 1, 2]
    assert trial.send(replace(at(0), sec=max(sec, -2**31), nanosec=nanosec)) == [0, 1, 2]


def test_a_layout_without_joints_does_not_move_time(trial):
    warm(trial)
    for ms in (9000, 9010, 9020, 1020):
        assert trial.send(at(ms, ('x', 'y'))) == []
    assert trial.send(at(1030)) == [ARM, CAMERA, POINTER]


def test_no_names_with_positions_is_nobodys_message(trial):
    warm(trial)
    for ms in (1020, 1030, 1040):
        assert trial.send(at(ms, (), (0.1, 0.2))) == []


def test_a_zero_stamp_becomes_now_each_time(trial):
    warm(trial)
    for now in (2 * SECOND, 3 * SECOND + 5):
        trial.now = now
        assert trial.send(at(0)) == [ARM, CAMERA, POINTER]


def test_a_zero_stamp_after_negative_ones_becomes_now(trial):
    for sec in (-5, -4, 0, 0):
        assert trial.send(replace(at(0), sec=sec)) == [ARM, CAMERA, POINTER]


def test_a_stamp_that_only_adds_up_to_zero_is_not_zero(trial):
    for message in (replace(at(0), sec=-1, nanosec=SECOND), replace(at(0), nanosec=1)) * 2:
        assert trial.send(message) == [ARM, CAMERA, POINTER]


@pytest.mark.parametrize(('sec', 'nanosec'), [
    (-2**31, 0), (-1, 999_999_999), (5, SECOND), (5, 2**32 - 1), (2**31 - 1, 2**32 - 1)])
def test_odd_stamps_go_through_unchanged(trial, sec, nanosec):
    for _ in range(3):
        assert trial.send(replace(at(0), sec=sec, nanosec=nanosec)) == [ARM, CAMERA, POINTER]


def test_positions_beyond_the_names_are_left_alone(trial):
    for ms in (1000, 1010, 1020):
        ready = trial.send(at(ms, positions=(0.1, 0.2, 0.3, 0.4, math.nan, math.inf)))
        assert ready == [ARM, CAMERA, POINTER]


def test_more_layouts_than_are_remembered_lose_nothing(trial):
    for turn in range(3):
        for i in range(11):
            ms = 1000 + 100 * turn + i
            assert trial.send(at(ms, (*ALL[i % 4:], *ALL[:i % 4], f'x{i}'))) == [0, 1, 2]
            assert trial.send(at(ms, ('tilt', 'turn', f'y{i}'))) == [ARM, CAMERA]


def test_messages_too_large_to_remember_are_read_all_the_same(trial):
    strangers = tuple(f'stranger_{i}' for i in range(4000))
    for ms in (1000, 1010, 1020):
        assert trial.send(at(ms, (*ALL, *strangers))) == [ARM, CAMERA, POINTER]


def test_a_chain_that_nobody_wants_is_counted_and_the_others_go_out(chains):
    out = []
    stream = JointStream(JointInput(chains, 0.5), lambda: 0)
    stream.on_ready[CAMERA] = lambda sec, nanosec, q, qdot: out.append(q)
    for ms in range(1000, 1010):
        stream.feed(at(ms).cdr())
    assert out == [(0.13, 0.1)] * 10
    assert [counts.ready for counts in stream.settle().chain_counts] == [10] * 3


def test_a_handler_may_look_at_the_state(chains):
    stream = JointStream(JointInput(chains, 0.5), lambda: 0)
    seen = []
    stream.on_ready[POINTER] = lambda *_: seen.append(stream.settle().messages)
    for ms in range(1000, 1010):
        stream.feed(at(ms).cdr())
    assert seen == list(range(1, 11))
