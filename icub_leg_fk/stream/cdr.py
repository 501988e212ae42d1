"""ROS messages to and from their CDR bytes (OMG CDR, as rosidl lays them out); free of rclpy.

Read are sensor_msgs/JointState and std_msgs/String, bounds-checked, since their bytes come from
the network: every length is compared with what is there before anything is read or allocated. The
fields of a JointState are encapsulation (4 bytes), stamp sec and nanosec, frame_id, name[],
position[], velocity[], effort[]; alignment counts from the fifth byte. Padding may hold anything:
Fast CDR leaves in it what was in the buffer before. What Fast CDR takes and this refuses:
encapsulations other than plain CDR, in which no ROS middleware sends these; a string without NUL
at its end, or with one before it.

Written are JointState, PoseStamped, TwistStamped and TFMessage, little-endian: all but stamps and
numbers is prepared once.
"""

from collections.abc import Sequence
import struct
from typing import NamedTuple, NoReturn

from icub_leg_fk.errors import MalformedMessageError
from icub_leg_fk.kinematics.solver import Pose

JOINT_STATE = 'sensor_msgs/msg/JointState'
BYTE_ORDERS = {b'\x00\x01': '<', b'\x00\x00': '>'}
HEADER = 4  # bytes of the encapsulation, from whose end alignment counts
STAMP_END = 12  # encapsulation and stamp; frame_id follows

_ENCAPSULATION = b'\x00\x01\x00\x00'


class Doubles(NamedTuple):
    """Offset and number of the doubles of a sequence."""

    at: int
    n: int


class JointStateLayout(NamedTuple):
    """All but the numbers of a JointState; as a rule the same in every message of a publisher.

    Attributes:
        byte_order: `<` or `>`.
        frame_id: frame id of the header.
        names: joint names.
        padding: offset and size of what is skipped for alignment up to the names' end.
        names_end: offset of the count of positions, which follows the names.
        positions: where the positions are.
        velocities: where the velocities are.
        efforts: where the efforts are.
    """

    byte_order: str
    frame_id: str
    names: tuple[str, ...]
    padding: tuple[tuple[int, int], ...]
    names_end: int
    positions: Doubles
    velocities: Doubles
    efforts: Doubles


def read_layout(data: bytes) -> JointStateLayout:
    """Find out where things lie in a serialized JointState.

    Raises:
        MalformedMessageError: the bytes end too early, a length is absurd, or the encoding is
            not plain CDR; names the field.
    """
    reader = _Cursor(data, 'JointState')
    reader.take('header.stamp', 8)
    frame_id = reader.string('header.frame_id')
    # A string takes at least its length field: no more of them than a quarter of the rest.
    names = tuple([reader.string('name') for _ in range(reader.length('name', 4))])
    names_end = reader.align(4)
    padding = tuple(reader.padding)
    positions, velocities, efforts = map(
        reader.doubles, ('position', 'velocity', 'effort')
    )
    return JointStateLayout(
        reader.byte_order,
        frame_id,
        names,
        padding,
        names_end,
        positions,
        velocities,
        efforts,
    )


def read_string(data: bytes) -> bytes:
    """Return the text of a serialized String, not decoded: XML itself says how.

    Raises:
        MalformedMessageError: the bytes are no String.
    """
    return _Cursor(data, 'String').text('data')


class _StampedEncoder:
    """Serializes messages of a stamp, one frame id and some numbers."""

    numbers = 0

    def __init__(self, frame_id: str) -> None:
        self._frame_id = _aligned(STAMP_END - HEADER, _string(frame_id), 8)
        self._pack = struct.Struct(f'<4siI{len(self._frame_id)}s{self.numbers}d').pack

    def encode(self, sec: int, nanosec: int, numbers: Sequence[float]) -> bytes:
        """Return the bytes of one message, from its stamp and its numbers."""
        return self._pack(_ENCAPSULATION, sec, nanosec, self._frame_id, *numbers)


class PoseStampedEncoder(_StampedEncoder):
    """Serializes geometry_msgs/PoseStamped: x, y, z [m], qx, qy, qz, qw in a frame."""

    numbers = 7


class TwistStampedEncoder(_StampedEncoder):
    """Serializes geometry_msgs/TwistStamped: vx, vy, vz [m/s], wx, wy, wz [rad/s] in its axes."""

    numbers = 6


class TFMessageEncoder:
    """Serializes tf2_msgs/TFMessage messages of some transforms with one stamp.

    Args:
        frames: frame id and child frame id of each transform.
    """

    def __init__(self, frames: Sequence[tuple[str, str]]) -> None:
        self._frames: list[bytes] = []
        layout, at = '<4sI', 4
        for frame_id, child_frame_id in frames:
            start = at + STAMP_END - HEADER
            ids = _aligned(start, _string(frame_id), 4)
            ids = _aligned(start, ids + _string(child_frame_id), 8)
            self._frames.append(ids)
            layout += f'iI{len(ids)}s7d'
            at = start + len(ids) + 56
        self._pack = struct.Struct(layout).pack

    def encode(self, sec: int, nanosec: int, poses: Sequence[Pose]) -> bytes:
        """Return the bytes of one message.

        Args:
            sec: seconds of the stamp.
            nanosec: nanoseconds of the stamp.
            poses: x, y, z [m], qx, qy, qz, qw of each child frame.
        """
        fields: list[object] = []
        for ids, pose in zip(self._frames, poses, strict=True):
            fields += (sec, nanosec, ids, *pose)
        return self._pack(_ENCAPSULATION, len(self._frames), *fields)


class JointStateEncoder:
    """Serializes JointStates with the same names, which have positions only.

    Args:
        names: n joint names.
    """

    def __init__(self, names: Sequence[str]) -> None:
        start = STAMP_END - HEADER
        count = struct.pack('<I', len(names))
        head = _aligned(start, _string(''), 4) + count
        for name in names:
            head += _aligned(start, _string(name), 4)
        self._head = _aligned(start, head + count, 8)
        self._pack = struct.Struct(f'<4siI{len(self._head)}s{len(names)}dII').pack

    def encode(self, stamp: int, positions: Sequence[float]) -> bytes:
        """Return the bytes of a message.

        Args:
            stamp: the time [ns].
            positions: n joint positions [rad or m].
        """
        sec, nanosec = divmod(stamp, 1_000_000_000)
        return self._pack(_ENCAPSULATION, sec, nanosec, self._head, *positions, 0, 0)


class _Cursor:
    """A position in the bytes of a message that refuses to move past their end."""

    def __init__(self, data: bytes, message: str) -> None:
        self._message = message
        byte_order = BYTE_ORDERS.get(bytes(data[:2]))
        if byte_order is None:
            self._fail(
                f'has the encapsulation 0x{data[:2].hex()}; allowed: 0x0000, 0x0001'
            )
        self.byte_order = byte_order
        self.padding: list[tuple[int, int]] = []
        self._data = data
        self._at = HEADER

    def align(self, size: int) -> int:
        """Return the next offset that is a multiple of size, and go there."""
        padding = (HEADER - self._at) % size
        if padding:
            self.padding.append((self._at, padding))
            self._at += padding
        return self._at

    def take(self, field: str, size: int) -> int:
        """Return the present offset and pass over as many bytes."""
        start = self._at
        self._at = start + size
        if self._at > len(self._data):
            self._fail(f'{field} ends at byte {self._at}; allowed: {len(self._data)}')
        return start

    def length(self, field: str, item_size: int) -> int:
        """Return the count of items that follow; they fit in what is left."""
        self.align(4)
        count: int = struct.unpack_from(
            f'{self.byte_order}I', self._data, self.take(field, 4)
        )[0]
        left = len(self._data) - self._at
        if count * item_size > left:
            self._fail(
                f'{field} has {count} items; allowed: what fits in the {left} bytes left'
            )
        return count

    def string(self, field: str) -> str:
        """Return the string that follows."""
        return self.text(field).decode('utf-8', 'replace')

    def text(self, field: str) -> bytes:
        """Return the string that follows, not decoded."""
        size = self.length(field, 1)
        start = self.take(field, size)
        end = self._at
        text = self._data[start:end]
        if size and text.find(0) != size - 1:
            self._fail(f'{field} is not a string that ends with NUL')
        return text[:-1]

    def doubles(self, field: str) -> Doubles:
        """Pass over a sequence of numbers."""
        count = self.length(field, 8)
        if count:
            self.align(8)
        return Doubles(self.take(field, 8 * count), count)

    def _fail(self, fault: str) -> NoReturn:
        raise MalformedMessageError(self._message, fault)


def _string(text: str) -> bytes:
    """Return the bytes of a string: length, text and NUL."""
    data = text.encode() + b'\x00'
    return struct.pack('<I', len(data)) + data


def _aligned(offset: int, data: bytes, size: int) -> bytes:
    """Return data that starts at an offset, padded so that items of `size` may follow."""
    return data + bytes(-(offset + len(data)) % size)
