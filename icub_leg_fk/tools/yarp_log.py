"""What yarpdatadumper writes of an iCub's ports: a directory each, of a part's joints in degrees.

`info.log` names the port and says which times there are; `data.log` has a line per message: its
number, one time or two [s], and the values of `state:o`, or of `stateExt:o`, whose first list are
the positions.
"""

from collections import deque
from collections.abc import Iterator
from decimal import Decimal
import math
from pathlib import Path
import re

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.stream.cdr import JointStateEncoder
from icub_leg_fk.tools.input_file import lines_of
from icub_leg_fk.tools.joint_states import Messages, Part, SECOND
from icub_leg_fk.tools.options import LARGEST, number
from icub_leg_fk.tools.progress import Progress

INFO = 'info.log'
DATA = 'data.log'

_LEG = ('hip_pitch', 'hip_roll', 'hip_yaw', 'knee', 'ankle_pitch', 'ankle_roll')
PARTS = {  # and their joints in YARP's order, after which others may follow, such as the eyes
    'left_leg': tuple(f'l_{joint}' for joint in _LEG),
    'right_leg': tuple(f'r_{joint}' for joint in _LEG),
    'torso': ('torso_yaw', 'torso_roll', 'torso_pitch'),
    'head': ('neck_pitch', 'neck_roll', 'neck_yaw'),
}

_PORT = re.compile(r'(/\S+)\s+\[connected\]')
_STAMP = re.compile(r'Stamp:\s*([a-z+]+)')
_SINCE_1970 = 10**8  # s; a later time counts from then


class YarpLog(Part):
    """The joint states of a port's directory.

    Args:
        path: the directory, with `info.log` and `data.log`.

    Attributes:
        port: name of the port; of one of no known part there are no joint names.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        info = ''.join(lines_of(path / INFO, 'utf-8'))
        port = _PORT.search(info)
        if port is None:
            raise InputFileError(
                str(path / INFO),
                'names no port; allowed: a line such as '
                '[0.0] /icub/left_leg/state:o [connected]',
            )
        self.port = port[1]
        words = self.port.split('/')
        self.joint_names = next((PARTS[word] for word in words if word in PARTS), ())
        stamp = _STAMP.search(info)
        self._clocks = stamp[1].split('+') if stamp else ['rx']
        first = next(self._lines(), None)
        if first is None:
            raise InputFileError(str(path / DATA), 'no lines; allowed: one per message')
        self.is_relative = self._parsed(*first)[0] < _SINCE_1970 * SECOND

    def messages(self, progress: Progress | None = None) -> Messages:
        """Yield time [ns] and CDR bytes of a JointState per line."""
        encode = JointStateEncoder(self.joint_names).encode
        for line, text in self._lines(progress):
            stamp, values = self._parsed(line, text)
            yield stamp, encode(stamp, values)

    def span(self) -> tuple[int, int]:
        """Return the first and the last time [ns]."""
        lines = self._lines()
        first = next(lines)
        last = deque(lines, maxlen=1) or [first]
        return self._parsed(*first)[0], self._parsed(*last[0])[0]

    def _lines(self, progress: Progress | None = None) -> Iterator[tuple[int, str]]:
        """Yield the lines with their numbers, from 1; not one that is still being written."""
        for line, text in enumerate(lines_of(self.path / DATA, 'utf-8', progress), 1):
            if text.endswith('\n'):
                yield line, text

    def _parsed(self, line: int, text: str) -> tuple[int, list[float]]:
        """Return time [ns] and joint positions [rad] of a line."""
        clocks = len(self._clocks)
        words = text.split(None, clocks + 1)[1:]
        if len(words) <= clocks:
            raise self._fault(line, 'ends too early', 'number, time, values')
        time = words[self._clocks.index('tx') if 'tx' in self._clocks else 0]
        if not math.isfinite(number(time)):
            raise self._fault(line, f'time {time!r}', 'seconds')
        values = _positions(words[-1])[: len(self.joint_names)]
        if len(values) < len(self.joint_names):
            raise self._fault(
                line,
                f'{len(values)} values',
                f'{len(self.joint_names)} or more of {self.port}',
            )
        degrees = [number(value) for value in values]
        for text, value in zip(values, degrees):
            if not abs(value) <= LARGEST and text.lower() != 'nan':
                raise self._fault(line, f'value {text!r}', 'numbers of degrees')
        stamp = round(Decimal(time) * SECOND)
        return stamp, [math.radians(value) for value in degrees]

    def _fault(self, line: int, found: str, allowed: str) -> InputFileError:
        return InputFileError(
            f'{self.path / DATA}:{line}', f'{found}; allowed: {allowed}'
        )


def is_yarp_log(path: Path) -> bool:
    """Return whether a path is a directory that yarpdatadumper made of a port."""
    return (path / DATA).is_file()


def _positions(text: str) -> list[str]:
    """Return the words of a flat list, or of the first of several in brackets."""
    if text.startswith('('):
        text = text[1:].partition(')')[0]
    return text.split()
