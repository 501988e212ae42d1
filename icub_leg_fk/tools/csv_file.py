"""Joint positions in CSV files as people have them: one step to their dialect, one to their names.

Columns may be separated by commas, semicolons, tabs or blanks, decimals by a point or a comma;
the text may be UTF-8 or UTF-16, and Excel's `sep=;` may stand first. Times may count from 1970 or
from anything else, in s, ms, us or ns. An empty cell and NaN are gaps.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
import csv
from decimal import Decimal
from itertools import islice, pairwise
import math
from pathlib import Path
import re
from typing import NamedTuple

from icub_leg_fk.errors import InputFileError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.input_bytes import first_bytes
from icub_leg_fk.stream.cdr import JointStateEncoder
from icub_leg_fk.stream.notes import name_hint
from icub_leg_fk.tools.input_file import lines_of
from icub_leg_fk.tools.joint_states import Messages, Part, PREFIX_OPTION, SECOND
from icub_leg_fk.tools.options import LARGEST, number
from icub_leg_fk.tools.progress import Progress

ENDINGS = ('.csv', '.tsv', '.txt')
TIME_UNITS = {'s': SECOND, 'ms': 1_000_000, 'us': 1000, 'ns': 1}  # ns

_TIME_NAMES = ('time', 'timestamp', '__time', '%time', 't', 'stamp', 'time_stamp')
_UNIT_NAMES = {
    **{unit: unit for unit in TIME_UNITS},
    'sec': 's',
    'secs': 's',
    'seconds': 's',
    'msec': 'ms',
    'usec': 'us',
    '\N{MICRO SIGN}s': 'us',
    'nsec': 'ns',
}
_SINCE_1970 = {
    's': 1e8,
    'ms': 1e11,
    'us': 1e14,
    'ns': 1e17,
}  # the least that is taken for such
_LAST_TIME = (1 << 31) * SECOND  # ns; what a stamp can hold ends before
_USUAL_STEPS = (SECOND // 10_000, SECOND)  # ns, between samples
_GAPS = ('', 'nan', 'na', 'n/a', 'null', 'none')
_DEGREES = ('deg', 'degrees', '\N{DEGREE SIGN}')
_POSITION_WORDS = ('position', 'positions', 'pos')
_IN_BRACKETS = re.compile(r'(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]')  # name and unit
_TIME_SUFFIX = re.compile(r'(.*)_([a-z]+)')
_JOINT_SUFFIX = re.compile(r'(.+?)(?:_pos|_position)?(?:_(rad|deg))?')
_HEAD = 1 << 16  # bytes by which the dialect is told
_SAMPLE = 200  # rows by which the unit of time is told
_SHOWN = 20  # names of a header in a message
_LONGEST_SHOWN = 40  # characters of such a name


class Row(NamedTuple):
    """A row of a CSV file: the number of its line, from 1, and its cells."""

    line: int
    cells: list[str]


class Column(NamedTuple):
    """A column of a CSV file: its name, its place, and the factor to rad or m."""

    name: str
    place: int
    factor: float = 1.0


class CsvFile(Part):
    """The joint states of a CSV file.

    Args:
        path: the file.
        chains: the chains whose joints are read; one without any joint in the file is left out.
        time_unit: unit of the times, `s`, `ms`, `us` or `ns`; if empty it is told by their size,
            or by the header.

    Raises:
        InputFileError: the file cannot be read, has no such columns, or no rows.
    """

    def __init__(
        self, path: Path, chains: Sequence[Chain], time_unit: str = ''
    ) -> None:
        super().__init__(path)
        self._dialect = Dialect(path)
        header = _Header(path, self._dialect)
        self._time, named_unit = header.time_column()
        self._groups = header.joint_columns(chains)
        self._columns = [column for group in self._groups for column in group]
        self.joint_names = tuple(column.name for column in self._columns)
        times = [self._time_of(row) for row in islice(self._rows(), _SAMPLE)]
        if not times:
            raise InputFileError(
                str(path), 'no rows; allowed: at least one after the header'
            )
        unit = time_unit or _likely_unit(float(times[0]), named_unit)
        self._factor = TIME_UNITS[unit]
        self.is_relative = float(times[0]) < _SINCE_1970[unit]
        if not time_unit:
            self._note_odd_steps(times, unit)

    def messages(self, progress: Progress | None = None) -> Messages:
        """Yield time [ns] and CDR bytes of a JointState per row that has joint positions."""
        encoder = _RowEncoder(self._groups)
        for row in self._rows(progress):
            time = self._time_of(row)
            stamp = round(time * self._factor)
            if abs(stamp) >= _LAST_TIME:
                raise self._fault(
                    row,
                    self._time,
                    str(time),
                    'times before 2038; --time-unit says in which unit they are',
                )
            data = encoder.encode(stamp, self._positions(row))
            if data is not None:
                yield stamp, data

    def span(self) -> tuple[int, int]:
        """Return the first and the last time [ns]."""
        times = [self._time_of(row) for row in self._rows()]
        return round(min(times) * self._factor), round(max(times) * self._factor)

    def _rows(self, progress: Progress | None = None) -> Iterator[Row]:
        """Yield the rows after the header; empty lines and comments are none."""
        dialect = self._dialect
        width = len(dialect.header)
        lines = islice(
            lines_of(self.path, dialect.encoding, progress), dialect.header_line, None
        )
        for line, cells in enumerate(dialect.cells(lines), dialect.header_line + 1):
            if not cells or cells[0].startswith('#'):
                continue
            if len(cells) != width:
                raise InputFileError(
                    f'{self.path}:{line}',
                    f'{len(cells)} values under {width} '
                    'columns; allowed: one value per column',
                )
            yield Row(line, cells)

    def _time_of(self, row: Row) -> Decimal:
        """Return the time of a row in the unit of the file, to the last digit."""
        text = row.cells[self._time.place]
        plain = self._dialect.with_point(text)
        if not math.isfinite(number(plain)):
            raise self._fault(row, self._time, repr(text), 'a finite number')
        return Decimal(plain)

    def _positions(self, row: Row) -> list[float]:
        """Return the joint positions of a row [rad or m]; NaN for a gap."""
        positions = []
        for column in self._columns:
            text = row.cells[column.place]
            value = number(self._dialect.with_point(text))
            if not abs(value) <= LARGEST and text.strip().lower() not in _GAPS:
                raise self._fault(
                    row, column, repr(text), f'a finite number up to {LARGEST:g}'
                )
            positions.append(column.factor * value)
        return positions

    def _note_odd_steps(self, times: Sequence[Decimal], unit: str) -> None:
        """Note times so far apart, or so near, that they may be in another unit."""
        steps = [after - before for before, after in pairwise(times) if after > before]
        if not steps:
            return
        step = sorted(steps)[len(steps) // 2] * self._factor
        shortest, longest = _USUAL_STEPS
        if not shortest <= step <= longest:
            self.notes.append(
                f'the times of {self.path}, taken as {unit}, are '
                f'{float(step) / SECOND:g} s apart; --time-unit says in which unit '
                'they are'
            )

    def _fault(
        self, row: Row, column: Column, found: str, allowed: str
    ) -> InputFileError:
        return InputFileError(
            f'{self.path}:{row.line}',
            f'column {column.name}: {found}; allowed: {allowed}',
        )


class Dialect:
    """How a CSV file is written.

    Args:
        path: the file.

    Attributes:
        encoding: of its text.
        header: the names of its columns.
        header_line: number of the header's line, from 1.
    """

    def __init__(self, path: Path) -> None:
        head = first_bytes(path, _HEAD)
        self.encoding = _encoding_of(head)
        lines = head.decode(self.encoding, errors='ignore').splitlines()
        separator = ''
        if lines and lines[0].lower().startswith('sep='):
            separator = lines[0][4:5]
            lines[0] = ''
        self.header_line = 1 + _place_of_header(lines)
        header = lines[self.header_line - 1].lstrip('#') if lines else ''
        likeliest = max(',;\t', key=header.count)
        self._delimiter = separator or (likeliest if likeliest in header else '')
        cells = next(self.cells([header.strip(' ')]), [])
        self.header = tuple(cell.strip() for cell in cells)

    def cells(self, lines: Iterable[str]) -> Iterator[list[str]]:
        """Yield the cells of each line; blanks separate them if nothing else does."""
        if self._delimiter:
            return csv.reader(lines, delimiter=self._delimiter)
        return (line.split() for line in lines)

    def with_point(self, text: str) -> str:
        """Return a number as Python writes it: with a point, if it has a decimal comma."""
        return text.replace(',', '.') if self._delimiter != ',' else text


class _Header:
    """The names of a CSV file's columns, and what they mean."""

    def __init__(self, path: Path, dialect: Dialect) -> None:
        self._place = f'{path}:{dialect.header_line}'
        self._names = dialect.header
        self._meanings = [_joint_of(name) for name in self._names]
        shown = [repr(name)[1:-1][:_LONGEST_SHOWN] for name in self._names[:_SHOWN]]
        self._shown = ', '.join(shown)
        if not any(self._names):
            raise self._fault('no header; allowed: names of columns: time and joints')

    def time_column(self) -> tuple[Column, str]:
        """Return the column of times, and the unit in its name; empty if there is none."""
        found: dict[str, tuple[Column, str]] = {}
        for place, name in enumerate(self._names):
            plain, unit = _split_time(name.lower())
            if plain not in _TIME_NAMES:
                continue
            if plain in found:
                raise self._twice(found[plain][0].name, name)
            found[plain] = Column(name, place), unit
        for plain in _TIME_NAMES:
            if plain in found:
                return found[plain]
        raise self._fault(
            f'no column of times in the header ({self._shown}); '
            f'allowed: {", ".join(_TIME_NAMES)}'
        )

    def joint_columns(self, chains: Sequence[Chain]) -> list[list[Column]]:
        """Return the columns of each chain's joints; those of a joint stand once."""
        columns = {}
        wanted = dict.fromkeys(name for chain in chains for name in chain.joint_names)
        for joint in wanted:
            column = self._column_of(joint)
            if column is not None:
                columns[joint] = column
        if not columns:
            raise self._missing(list(wanted), chains, columns)
        groups = []
        left = dict(columns)
        for chain in chains:
            missing = [name for name in chain.joint_names if name not in columns]
            if missing and len(missing) < chain.n:
                raise self._missing(missing, chains, columns)
            groups.append(
                [left.pop(name) for name in chain.joint_names if name in left]
            )
        return [group for group in groups if group]

    def _column_of(self, joint: str) -> Column | None:
        """Return the column of a joint's positions: of just this name, or of one that says so."""
        places = list(enumerate(self._names))
        found = [Column(joint, place) for place, name in places if name == joint]
        if not found:
            last = joint.rpartition('/')[2]
            for place, name in places:
                meant, factor = self._meanings[place]
                if meant == last and joint in name:
                    found.append(Column(joint, place, factor))
        if len(found) > 1:
            raise self._twice(*(self._names[column.place] for column in found[:2]))
        return found[0] if found else None

    def _missing(
        self, joints: Sequence[str], chains: Sequence[Chain], found: Collection[str]
    ) -> InputFileError:
        whole = [chain.name for chain in chains if set(chain.joint_names) <= set(found)]
        advice = f'; or --chains {" ".join(whole)}' if whole else ''
        if not found:
            advice = name_hint(joints, self._names, '', PREFIX_OPTION)
        return self._fault(
            f'column {", ".join(joints)} is missing in the header ({self._shown}){advice}'
        )

    def _twice(self, one: str, other: str) -> InputFileError:
        names = one if one == other else f'{one} and {other}'
        return self._fault(
            f'column {names} appears twice in the header ({self._shown}); allowed: once'
        )

    def _fault(self, fault: str) -> InputFileError:
        return InputFileError(self._place, fault)


class _RowEncoder:
    """Serializes rows as JointStates; a chain of which a row has nothing is left out of them."""

    def __init__(self, groups: Sequence[Sequence[Column]]) -> None:
        self._groups = groups
        names = [column.name for group in groups for column in group]
        self._encode_all = JointStateEncoder(names).encode
        self._encoders: dict[
            tuple[str, ...], Callable[[int, Sequence[float]], bytes]
        ] = {}

    def encode(self, stamp: int, positions: Sequence[float]) -> bytes | None:
        """Return the bytes of a row's message; None if the row has no positions."""
        if not any(map(math.isnan, positions)):
            return self._encode_all(stamp, positions)
        names: list[str] = []
        kept: list[float] = []
        start = 0
        for group in self._groups:
            end = start + len(group)
            values = positions[start:end]
            start = end
            if not all(map(math.isnan, values)):
                names += [column.name for column in group]
                kept += values
        if not names:
            return None
        key = tuple(names)
        if key not in self._encoders:
            self._encoders[key] = JointStateEncoder(key).encode
        return self._encoders[key](stamp, kept)


def _encoding_of(head: bytes) -> str:
    """Return the encoding of a text by its first bytes."""
    if head.startswith((b'\xff\xfe', b'\xfe\xff')):
        return 'utf-16'
    if head[1:2] == b'\0':
        return 'utf-16-le'
    try:
        head.decode('utf-8-sig')
    except UnicodeDecodeError as error:
        if error.start < len(head) - 3:  # and not a character that the head cuts off
            return 'latin-1'
    return 'utf-8-sig'


def _place_of_header(lines: Sequence[str]) -> int:
    """Return the index of the header's line: the first that is no comment, or the last that is.

    numpy writes the header as a comment, after which there are only numbers.
    """
    comment = 0
    for place, line in enumerate(lines):
        if line.startswith('#'):
            comment = place
        elif line.strip():
            begins_with_number = math.isfinite(
                number(re.split(r'[,;\s]', line.strip())[0])
            )
            is_comment_header = lines[comment].startswith('#') and begins_with_number
            return comment if is_comment_header else place
    return comment


def _likely_unit(time: float, named: str) -> str:
    """Return the unit of a time: as named, unless it were after 2038; else by its size."""
    if named and time * TIME_UNITS[named] < _LAST_TIME:
        return named
    likely = 's'
    for unit, least in _SINCE_1970.items():
        if time >= least:
            likely = unit
    return likely


def _split_time(name: str) -> tuple[str, str]:
    """Return the name of a column of times without its unit, and the unit; empty if none."""
    match = _IN_BRACKETS.fullmatch(name) or _TIME_SUFFIX.fullmatch(name)
    if match and match[2] in _UNIT_NAMES:
        return match[1], _UNIT_NAMES[match[2]]
    return name, ''


def _joint_of(name: str) -> tuple[str, float]:
    """Return whose positions a column holds by its name, and the factor to rad or m.

    As `/joint_states/l_knee/position`, `joint_states.position.l_knee`, `l_knee [deg]` have it.
    """
    match = _IN_BRACKETS.fullmatch(name)
    unit = ''
    if match:
        name, unit = match[1], match[2].lower()
    words = [word for word in re.split('[/.]', name) if word]
    if len(words) > 1 and words[-1].lower() in _POSITION_WORDS:
        del words[-1]
    elif len(words) > 1 and words[-2].lower() not in _POSITION_WORDS:
        return '', 1.0
    match = _JOINT_SUFFIX.fullmatch(words[-1]) if words else None
    if not match:
        return '', 1.0
    is_in_degrees = unit in _DEGREES or match[2] == 'deg'
    return match[1], math.radians(1.0) if is_in_degrees else 1.0
