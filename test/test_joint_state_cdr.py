"""JointState from CDR: what Fast CDR and rosbags read, and nothing that is not there."""

import math
import random
import struct
import tracemalloc

from hypothesis import example, given, settings
from hypothesis import strategies as st
from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.ros.joint_state_cdr import decode_joint_state
from joint_model import Message
from joint_trial import bits
import pytest

TEXT = st.text(max_size=30)  # every character but lone surrogates, NUL included
DOUBLES = st.lists(st.floats(), max_size=6).map(tuple)
MESSAGES = st.builds(
    Message, st.integers(-2**31, 2**31 - 1), st.integers(0, 2**32 - 1),
    st.lists(TEXT.filter(lambda text: '\x00' not in text), max_size=6).map(tuple),
    DOUBLES, DOUBLES, DOUBLES, TEXT.filter(lambda text: '\x00' not in text),
    st.sampled_from('<>'), st.sampled_from((0, 1, 4, 9)), st.sampled_from((0, 1, 255)))
LARGE = Message(7, 8, tuple(f'joint_{i}' for i in range(5000)), tuple(map(float, range(5000))),
                tuple(map(float, range(4999))), (math.nan,) * 3)
GOOD = Message(1, 2, ('a', '', 'längs'), (1.0, 2.0, 3.0), (4.0,), (5.0, 6.0), 'base')


def fields(data):
    """Return what was decoded, with floats as bytes, or None if it was refused."""
    try:
        message = decode_joint_state(data)
    except MalformedMessageError:
        return None
    return (message.sec, message.nanosec, message.names, bits(message.positions),
            bits(message.velocities), message.efforts)


def meant(message):
    return (message.sec, message.nanosec, message.names, bits(message.positions),
            bits(message.velocities), len(message.efforts))


def fields_of(ros):
    """Return the same of a message object of rclpy or rosbags."""
    return (ros.header.stamp.sec, ros.header.stamp.nanosec, tuple(ros.name), bits(ros.position),
            bits(ros.velocity), len(ros.effort))


@pytest.fixture(scope='module')
def rclpy_reads():
    """Return what reads bytes as rclpy does; None if it refuses them."""
    serialization = pytest.importorskip('rclpy.serialization', reason='needs rclpy')
    joint_state = pytest.importorskip('sensor_msgs.msg', reason='needs sensor_msgs').JointState

    def read(data):
        try:
            return fields_of(serialization.deserialize_message(data, joint_state))
        except Exception as error:  # noqa: BLE001 (RMWError is no public name)
            assert 'failed to deserialize' in str(error)
            return None
    return read


@given(MESSAGES)
@example(LARGE)
def test_reads_what_was_written_in_either_byte_order_whatever_the_padding(message):
    assert fields(message.cdr()) == meant(message)


@given(MESSAGES)
@example(LARGE)
def test_offsets_point_at_the_numbers(message):
    data = message.cdr()
    decoded = decode_joint_state(data)
    order, count = decoded.byte_order, len(message.positions)
    assert order == message.order
    assert data[decoded.positions_at:][:8 * count] == struct.pack(
        f'{order}{count}d', *message.positions)
    for at, values in ((decoded.velocity_count_at, message.velocities),
                       (decoded.effort_count_at, message.efforts)):
        assert struct.unpack_from(f'{order}I', data, at) == (len(values),)


@given(MESSAGES)
@example(LARGE)
def test_padding_is_all_that_may_change_unseen(message):
    data = bytearray(message.cdr())
    before = decode_joint_state(bytes(data))
    for at, size in before.padding:
        data[at:at + size] = b'\xa5' * size
    assert fields(bytes(data)) == meant(message)
    # With one more byte of padding noted as such, a name or a number would have changed.
    again = Message(**{**vars(message), 'padding': 0xa5}).cdr()
    assert bytes(data)[:len(again) - message.extra] == again[:len(again) - message.extra]


@settings(max_examples=300)
@given(MESSAGES)
@example(LARGE)
def test_reads_what_rclpy_reads(rclpy_reads, message):
    data = message.cdr()
    assert fields(data) == rclpy_reads(data) == meant(message)


@settings(max_examples=300)
@given(MESSAGES, TEXT)
@example(LARGE, '')
def test_reads_what_rclpy_writes(message, frame_id):
    serialization = pytest.importorskip('rclpy.serialization', reason='needs rclpy')
    joint_state = pytest.importorskip('sensor_msgs.msg', reason='needs sensor_msgs').JointState
    ros = joint_state(name=message.names, position=message.positions,
                      velocity=message.velocities, effort=message.efforts)
    ros.header.stamp.sec, ros.header.stamp.nanosec = message.sec, message.nanosec
    ros.header.frame_id = frame_id  # cut by rclpy at a NUL
    assert fields(serialization.serialize_message(ros)) == meant(message)


@given(MESSAGES)
@example(LARGE)
def test_reads_what_rosbags_writes(message):
    typesys = pytest.importorskip('rosbags.typesys', reason='needs rosbags')
    np = pytest.importorskip('numpy')
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    kinds = [store.types[name] for name in (
        'sensor_msgs/msg/JointState', 'std_msgs/msg/Header', 'builtin_interfaces/msg/Time')]
    ros = kinds[0](kinds[1](kinds[2](message.sec, message.nanosec), message.frame_id),
                   list(message.names), *map(np.array, (
                       message.positions, message.velocities, message.efforts)))
    data = bytes(store.serialize_cdr(ros, 'sensor_msgs/msg/JointState',
                                     little_endian=message.order == '<'))
    assert fields(data) == meant(message)


@pytest.mark.parametrize('order', '<>')
def test_refuses_a_message_cut_at_any_byte(order):
    data = Message(**{**vars(GOOD), 'order': order}).cdr()
    for end in range(len(data)):
        with pytest.raises(MalformedMessageError):
            decode_joint_state(data[:end])


def test_refuses_the_other_byte_order_than_it_says():
    for order, lie in (('<', b'\x00\x00'), ('>', b'\x00\x01')):
        data = Message(**{**vars(GOOD), 'order': order}).cdr()
        with pytest.raises(MalformedMessageError):
            decode_joint_state(lie + data[2:])


@pytest.mark.parametrize('kind', [2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0x100, 0x101, 0xffff])
def test_refuses_every_encapsulation_but_plain_cdr(kind):
    with pytest.raises(MalformedMessageError, match=f'encapsulation found 0x{kind:04x}, allowed'):
        decode_joint_state(struct.pack('>H', kind) + GOOD.cdr()[2:])


@pytest.mark.parametrize(('old', 'new'), [
    (b'base\x00', b'base!'), (b'base\x00', b'b\x00se\x00'), (b'base\x00', b'bas\x00\x00')])
def test_refuses_a_string_without_nul_at_its_end_or_with_one_before(old, new):
    data = GOOD.cdr()
    assert old in data
    with pytest.raises(MalformedMessageError, match=r'header\.frame_id is no string'):
        decode_joint_state(data.replace(old, new))


def test_reads_a_string_of_no_bytes_as_empty(rclpy_reads):
    data = Message(1, 2, (), (0.5,)).cdr()
    # Length 0 instead of length 1, NUL and padding; now it is the position that needs padding.
    data = data[:12] + bytes(4) + data[20:28] + bytes(4) + data[28:]
    assert fields(data) == rclpy_reads(data) is not None


def test_reads_names_that_are_no_utf_8_as_rclpy_does(rclpy_reads):
    data = GOOD.cdr().replace('längs'.encode(), b'l\xff\xfengs'[:6].ljust(6, b'\xc3'))
    assert fields(data) == rclpy_reads(data)
    assert '\ufffd' in fields(data)[2][2]


def test_takes_padding_in_the_wrong_place_for_what_it_is():
    data = GOOD.cdr()
    at = decode_joint_state(data).positions_at
    for spoilt in (data[:at - 4] + data[at:], data[:at] + bytes(4) + data[at:],
                   data[:12] + b'\x00' + data[12:]):
        with pytest.raises(MalformedMessageError):
            decode_joint_state(spoilt)


@pytest.mark.parametrize('count', [2**32 - 1, 2**31, 2**31 - 1, 2**29, 2**28, 2**20])
@pytest.mark.parametrize('order', '<>')
def test_an_absurd_count_is_refused_without_allocating(order, count):
    message = Message(**{**vars(GOOD), 'order': order})
    data = message.cdr()
    decoded = decode_joint_state(data)
    counts_at = {'header.frame_id': 12, 'name': 24, 'velocity': decoded.velocity_count_at,
                 'position': data.rindex(struct.pack(order + 'I', 3), 0, decoded.positions_at),
                 'effort': decoded.effort_count_at}
    for field, at in counts_at.items():
        spoilt = data[:at] + struct.pack(order + 'I', count) + data[at + 4:]
        tracemalloc.start()
        with pytest.raises(MalformedMessageError, match=f'{field} found {count} items'):
            decode_joint_state(spoilt)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 20_000


def test_spoilt_bytes_are_read_as_rclpy_reads_them_or_refused(rclpy_reads):
    """Whatever passes here passes there, with the same content; what does not is on the list."""
    rng = random.Random(5)
    sound = [GOOD.cdr(), Message(**{**vars(GOOD), 'order': '>'}).cdr(),
             Message(3, 4, ('lift', 'turn'), (0.1, 0.2)).cdr()]
    read = 0
    for _ in range(20_000):
        data = bytearray(rng.choice(sound))
        for _ in range(rng.choice((1, 1, 3))):
            data[rng.randrange(len(data))] = rng.choice((0, 1, 2, 4, 8, 0xff, rng.randrange(256)))
        data = bytes(data[:rng.choice((None, None, rng.randrange(len(data))))])
        ours, theirs = fields(data), rclpy_reads(data)
        if ours is None and theirs is not None:
            with pytest.raises(MalformedMessageError,
                               match=r'encapsulation found|is no string that ends'):
                decode_joint_state(data)
        else:
            assert ours == theirs, data
            read += ours is not None
    assert 2_000 < read < 18_000
