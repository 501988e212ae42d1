"""CDR: what rclpy and rosbags read and write, and nothing that is not there."""

import math
import struct
import tracemalloc

from hypothesis import example, given, settings
from hypothesis import strategies as st
from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.stream.cdr import (
    PoseStampedEncoder,
    TFMessageEncoder,
    TwistStampedEncoder,
)
import pytest
from support.joint_model import Message
from support.joint_trial import bits, decode_joint_state

TEXT = st.text(max_size=30)  # every character but lone surrogates, NUL included
DOUBLES = st.lists(st.floats(), max_size=6).map(tuple)
MESSAGES = st.builds(
    Message,
    st.integers(-(2**31), 2**31 - 1),
    st.integers(0, 2**32 - 1),
    st.lists(TEXT.filter(lambda text: '\x00' not in text), max_size=6).map(tuple),
    DOUBLES,
    DOUBLES,
    DOUBLES,
    TEXT.filter(lambda text: '\x00' not in text),
    st.sampled_from('<>'),
    st.sampled_from((0, 1, 4, 9)),
    st.sampled_from((0, 1, 255)),
)
LARGE = Message(
    7,
    8,
    tuple(f'joint_{i}' for i in range(2000)),
    tuple(map(float, range(2000))),
    tuple(map(float, range(1999))),
    (math.nan,) * 3,
)
GOOD = Message(1, 2, ('a', '', 'längs'), (1.0, 2.0, 3.0), (4.0,), (5.0, 6.0), 'base')


def fields(data):
    """Return what was decoded, with floats as bytes, or None if it was refused."""
    try:
        return meant(decode_joint_state(data))
    except MalformedMessageError:
        return None


def meant(message):
    return (
        message.sec,
        message.nanosec,
        message.frame_id,
        message.names,
        bits(message.positions),
        bits(message.velocities),
    )


def altered(**changes):
    return Message(**{**vars(GOOD), **changes})


@pytest.fixture(scope='module')
def ros():
    """Return rclpy's serialization and the type of a JointState."""
    serialization = pytest.importorskip('rclpy.serialization', reason='needs rclpy')
    messages = pytest.importorskip('sensor_msgs.msg', reason='needs sensor_msgs')
    return serialization, messages.JointState


@pytest.fixture(scope='module')
def rclpy_reads(ros):
    """Return what reads bytes as rclpy does; None if it refuses them."""
    serialization, joint_state = ros

    def read(data):
        try:
            message = serialization.deserialize_message(data, joint_state)
        except Exception as error:  # noqa: BLE001 (RMWError is no public name)
            assert 'failed to deserialize' in str(error)
            return None
        header = message.header
        return (
            header.stamp.sec,
            header.stamp.nanosec,
            header.frame_id,
            tuple(message.name),
            bits(message.position),
            bits(message.velocity),
        )

    return read


@settings(max_examples=200)
@given(MESSAGES)
@example(LARGE)
def test_reads_what_rclpy_reads(rclpy_reads, message):
    data = message.cdr()
    assert fields(data) == rclpy_reads(data) == meant(message)


@settings(max_examples=200)
@given(MESSAGES)
@example(LARGE)
def test_reads_what_rclpy_writes(ros, message):
    serialization, joint_state = ros
    theirs = joint_state(
        name=message.names,
        position=message.positions,
        velocity=message.velocities,
        effort=message.efforts,
    )
    stamp = theirs.header.stamp
    stamp.sec, stamp.nanosec = message.sec, message.nanosec
    theirs.header.frame_id = message.frame_id
    assert fields(serialization.serialize_message(theirs)) == meant(message)


@pytest.mark.parametrize('order', '<>')
def test_refuses_a_message_cut_at_any_byte(order):
    data = altered(order=order).cdr()
    for end in range(len(data)):
        with pytest.raises(MalformedMessageError):
            decode_joint_state(data[:end])


def test_refuses_the_other_byte_order_than_it_says():
    for order, lie in (('<', b'\x00\x00'), ('>', b'\x00\x01')):
        data = altered(order=order).cdr()
        with pytest.raises(MalformedMessageError):
            decode_joint_state(lie + data[2:])


@pytest.mark.parametrize('kind', [2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0x100, 0x101, 0xFFFF])
def test_refuses_every_encapsulation_but_plain_cdr(kind):
    with pytest.raises(
        MalformedMessageError, match=f'encapsulation 0x{kind:04x}; allowed'
    ):
        decode_joint_state(struct.pack('>H', kind) + GOOD.cdr()[2:])


@pytest.mark.parametrize(
    ('old', 'new'),
    [
        (b'base\x00', b'base!'),
        (b'base\x00', b'b\x00se\x00'),
        (b'base\x00', b'bas\x00\x00'),
    ],
)
def test_refuses_a_string_without_nul_at_its_end_or_with_one_before(old, new):
    data = GOOD.cdr()
    assert old in data
    with pytest.raises(
        MalformedMessageError, match=r'header\.frame_id is not a string'
    ):
        decode_joint_state(data.replace(old, new))


def test_reads_a_string_of_no_bytes_as_empty(rclpy_reads):
    data = Message(1, 2, (), (0.5,)).cdr()
    # Length 0 instead of length 1, NUL and padding; now it is the position that needs padding.
    data = data[:12] + bytes(4) + data[20:28] + bytes(4) + data[28:]
    assert fields(data) == rclpy_reads(data) is not None


def test_reads_names_that_are_no_utf_8_as_rclpy_does(rclpy_reads):
    data = GOOD.cdr().replace('längs'.encode(), b'l\xff\xfengs'[:6].ljust(6, b'\xc3'))
    assert fields(data) == rclpy_reads(data)
    assert '\ufffd' in fields(data)[3][2]


@pytest.mark.parametrize('count', [2**32 - 1, 2**31, 2**31 - 1, 2**29, 2**28, 2**20])
@pytest.mark.parametrize('order', '<>')
def test_an_absurd_count_is_refused_without_allocating(order, count):
    message = altered(order=order)
    data = message.cdr()
    positions_at = data.index(struct.pack(f'{order}3d', *GOOD.positions))
    counts_at = {
        'header.frame_id': 12,
        'name': 24,
        'velocity': positions_at + 24,
        'position': data.rindex(struct.pack(order + 'I', 3), 0, positions_at),
        'effort': positions_at + 40,
    }
    for field, at in counts_at.items():
        spoilt = data[:at] + struct.pack(order + 'I', count) + data[at + 4 :]
        tracemalloc.start()
        with pytest.raises(MalformedMessageError, match=f'{field} has {count} items'):
            decode_joint_state(spoilt)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 20_000


SOUND = [
    GOOD.cdr(),
    altered(order='>').cdr(),
    Message(3, 4, ('lift', 'turn'), (0.1, 0.2)).cdr(),
]
LONGEST = max(map(len, SOUND))
SPOILS = st.lists(
    st.tuples(
        st.integers(0, LONGEST),
        st.one_of(st.sampled_from((0, 1, 2, 4, 8, 0xFF)), st.integers(0, 255)),
    ),
    max_size=3,
)


@settings(max_examples=1000)
@given(st.sampled_from(SOUND), SPOILS, st.one_of(st.none(), st.integers(0, LONGEST)))
def test_spoilt_bytes_are_read_as_rclpy_reads_them_or_refused(
    rclpy_reads, sound, spoils, end
):
    """Whatever passes here passes there, with the same content; what does not is on the list.

    But for the options in the encapsulation, which Kilted's Fast CDR looks at.
    """
    spoilt = bytearray(sound)
    for at, byte in spoils:
        spoilt[at % len(spoilt)] = byte
    spoilt[2:4] = b'\x00\x00'
    data = bytes(spoilt[:end])
    ours, theirs = fields(data), rclpy_reads(data)
    if ours is None and theirs is not None:
        with pytest.raises(
            MalformedMessageError, match=r'the encapsulation|is not a string that ends'
        ):
            decode_joint_state(data)
    else:
        assert ours == theirs


STAMPS = st.tuples(st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1))
FRAME_IDS = st.one_of(
    st.sampled_from(('', 'root_link', 'Fußgelenk/\U0001f9be', 'x' * 5000)),
    TEXT.filter(lambda text: '\x00' not in text),
)
POSES = st.tuples(*[st.floats()] * 7)


@pytest.fixture(scope='module')
def rosbags_reads():
    """Return what reads bytes as rosbags does, which asserts that no byte is left."""
    typesys = pytest.importorskip('rosbags.typesys', reason='needs rosbags')
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)

    def read(data, kind):
        message = store.deserialize_cdr(data, kind)
        assert data == store.serialize_cdr(message, kind)
        return message

    return read


def numbers_of(*parts):
    """Return the numbers of Points, Vector3s and Quaternions."""
    axes = [(part, axis) for part in parts for axis in 'xyzw' if hasattr(part, axis)]
    return bits([getattr(part, axis) for part, axis in axes])


@given(FRAME_IDS, STAMPS, POSES)
def test_rosbags_reads_the_pose_and_twist_that_were_meant(
    rosbags_reads, frame_id, stamp, pose
):
    data = PoseStampedEncoder(frame_id).encode(*stamp, pose)
    posed = rosbags_reads(data, 'geometry_msgs/msg/PoseStamped')
    assert numbers_of(posed.pose.position, posed.pose.orientation) == bits(pose)
    data = TwistStampedEncoder(frame_id).encode(*stamp, pose[:6])
    moving = rosbags_reads(data, 'geometry_msgs/msg/TwistStamped')
    assert numbers_of(moving.twist.linear, moving.twist.angular) == bits(pose[:6])
    for header in (posed.header, moving.header):
        assert header.frame_id == frame_id
        assert (header.stamp.sec, header.stamp.nanosec) == stamp


@given(st.lists(st.tuples(FRAME_IDS, FRAME_IDS, POSES), max_size=4), STAMPS)
def test_rosbags_reads_the_transforms_that_were_meant(rosbags_reads, transforms, stamp):
    encoder = TFMessageEncoder([(parent, child) for parent, child, _ in transforms])
    data = encoder.encode(*stamp, [pose for _, _, pose in transforms])
    message = rosbags_reads(data, 'tf2_msgs/msg/TFMessage')
    for found, (parent, child, pose) in zip(
        message.transforms, transforms, strict=True
    ):
        assert (found.header.frame_id, found.child_frame_id) == (parent, child)
        assert (found.header.stamp.sec, found.header.stamp.nanosec) == stamp
        moved = found.transform
        assert numbers_of(moved.translation, moved.rotation) == bits(pose)


@given(FRAME_IDS, STAMPS, POSES)
def test_a_pose_is_the_bytes_that_rclpy_writes(ros, frame_id, stamp, pose):
    serialization, _ = ros
    messages = pytest.importorskip('geometry_msgs.msg', reason='needs geometry_msgs')
    message = messages.PoseStamped()
    message.header.frame_id = frame_id
    message.header.stamp.sec, message.header.stamp.nanosec = stamp
    at, turn = message.pose.position, message.pose.orientation
    at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w = pose
    ours = PoseStampedEncoder(frame_id).encode(*stamp, pose)
    theirs = serialization.serialize_message(message)[: len(ours)]
    # Between the frame id and the numbers, and after them, rclpy's buffer may hold anything.
    end = 4 + 8 + 4 + len(frame_id.encode()) + 1
    assert (ours[:end], ours[-56:]) == (theirs[:end], theirs[-56:])
