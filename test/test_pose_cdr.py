"""PoseStamped to CDR: the bytes that rclpy writes, and what rosbags reads from them."""

import struct

from hypothesis import example, given, settings
from hypothesis import strategies as st
from icub_leg_fk.ros.pose_cdr import PoseStampedEncoder
import pytest

FRAME_IDS = st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\x00'),
                    max_size=40)
POSES = st.tuples(*[st.floats()] * 7)
SECONDS = st.integers(-2**31, 2**31 - 1)
NANOSECONDS = st.integers(0, 2**32 - 1)
ORIGIN = (0.0, -0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def bits(values):
    return struct.pack('<7d', *values)


def without_padding(data, frame_id):
    """Return the bytes without those between the frame id and the first number."""
    end = 4 + 8 + 4 + len(frame_id.encode()) + 1
    return data[:end], data[end + -(end - 4) % 8:]


@settings(max_examples=500)
@given(FRAME_IDS, SECONDS, NANOSECONDS, POSES)
@example('', 0, 0, ORIGIN)
@example('root_link', 1_700_000_000, 999_999_999, ORIGIN)
@example('Fußgelenk/\U0001f9be', -1, 2**32 - 1, ORIGIN)
@example('x' * 5000, 0, 0, ORIGIN)
def test_writes_the_bytes_that_rclpy_writes(frame_id, sec, nanosec, pose):
    serialize = pytest.importorskip('rclpy.serialization', reason='needs rclpy').serialize_message
    messages = pytest.importorskip('geometry_msgs.msg', reason='needs geometry_msgs')
    message = messages.PoseStamped()
    message.header.frame_id = frame_id
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    at, turn = message.pose.position, message.pose.orientation
    at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w = pose
    ours = PoseStampedEncoder(frame_id).encode(sec, nanosec, pose)
    theirs = serialize(message)
    # rclpy's buffer may be longer than the message; what follows the message has no meaning.
    assert without_padding(ours, frame_id) == without_padding(theirs[:len(ours)], frame_id)


@settings(max_examples=500)
@given(FRAME_IDS, SECONDS, NANOSECONDS, POSES)
@example('', 0, 0, ORIGIN)
@example('Fußgelenk/\U0001f9be', -1, 2**32 - 1, ORIGIN)
def test_rosbags_reads_what_was_meant_and_no_byte_is_left(frame_id, sec, nanosec, pose):
    typesys = pytest.importorskip('rosbags.typesys', reason='needs rosbags')
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    data = PoseStampedEncoder(frame_id).encode(sec, nanosec, pose)
    message = store.deserialize_cdr(data, 'geometry_msgs/msg/PoseStamped')  # asserts the length
    at, turn = message.pose.position, message.pose.orientation
    assert message.header.frame_id == frame_id
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (sec, nanosec)
    assert bits((at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w)) == bits(pose)
    assert data == store.serialize_cdr(message, 'geometry_msgs/msg/PoseStamped')


def test_one_encoder_writes_many_messages():
    encoder = PoseStampedEncoder('root_link')
    first = encoder.encode(1, 2, ORIGIN)
    second = encoder.encode(3, 4, (1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.0))
    assert first != second
    assert encoder.encode(1, 2, ORIGIN) == first
