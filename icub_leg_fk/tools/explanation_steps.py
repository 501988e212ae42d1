"""What an explanation says: the six steps of the documented method, for text and LaTeX alike.

Formulas within words stand between backticks, in the documents' notation: `T_Ro0`, `z_(i-1)`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math

from icub_leg_fk.kinematics.chain import Row
from icub_leg_fk.kinematics.chain_text import joint_range, position, short
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.tools import text
from icub_leg_fk.tools.explanation import ExplainedRow, Explanation, unit
from icub_leg_fk.tools.explanation_symbols import (
    Cell,
    degrees,
    Matrix,
    MM,
    plain,
    sums_of_angles,
)
import numpy as np

_GENERAL = {
    'standard': """\
cos theta_i | -sin theta_i cos alpha_i |  sin theta_i sin alpha_i | a_i cos theta_i
sin theta_i |  cos theta_i cos alpha_i | -cos theta_i sin alpha_i | a_i sin theta_i
0           |  sin alpha_i             |  cos alpha_i             | d_i
0           |  0                       |  0                       | 1""",
    'modified': """\
cos theta_i             | -sin theta_i             |  0           |  a_i
sin theta_i cos alpha_i |  cos theta_i cos alpha_i | -sin alpha_i | -d_i sin alpha_i
sin theta_i sin alpha_i |  cos theta_i sin alpha_i |  cos alpha_i |  d_i cos alpha_i
0                       |  0                       |  0           |  1""",
}
_ENTRIES = 'r_11 r_21 r_31 r_12 r_22 r_32 r_13 r_23 r_33 p_x p_y p_z'.split()
_DEGREE = math.degrees(1)  # per radian
_PARAMETERS = {
    'Rz': 'theta',
    'tz': 'd',
    'tx': 'a',
    'Rx': 'alpha',
}  # of the basic transforms
_HEADER = (
    'Link `i`',
    '`a_i` (mm)',
    '`d_i` (mm)',
    '`alpha_i` (rad)',
    '`theta_i` (deg)',
    'joint',
)


@dataclass(frozen=True)
class Heading:
    """A heading: the title, or that of a step."""

    words: str
    is_title: bool = False


@dataclass(frozen=True)
class Sentence:
    """Words that stand by themselves."""

    words: str


@dataclass(frozen=True)
class Remark:
    """Words that belong to what they stand under."""

    words: str


@dataclass(frozen=True)
class Table:
    """Rows of cells, under a header or without one."""

    rows: Sequence[Sequence[str]]
    header: Sequence[str] = ()


@dataclass(frozen=True)
class Equation:
    """A name, which may be empty, and the matrices whose product it is."""

    name: str
    matrices: Sequence[Matrix]


@dataclass(frozen=True)
class Entries:
    """A name, and a transform that is too wide for a line; its entries are given one by one."""

    name: str
    T: Matrix

    def by_name(self) -> list[tuple[str, Cell]]:
        """Return the names of the entries with the entries, column by column."""
        cells = np.array(self.T)[:3].T.ravel().tolist()
        return list(zip(_ENTRIES, cells, strict=True))


Block = Heading | Sentence | Remark | Table | Equation | Entries


def steps(e: Explanation) -> Iterator[Block]:
    """Yield the whole explanation, block by block."""
    yield from _introduction(e)
    yield from _placed_frames(e)
    yield from _table(e)
    yield from _general_row(e)
    if e.symbols:
        yield from _legend(e)
    for row in e.rows:
        yield from _each_row(e, row)
    yield from _products(e)
    if e.q is not None:
        yield from _answer(e, e.q)


def _introduction(e: Explanation) -> Iterator[Block]:
    chain = e.chain
    yield Heading(
        f'{chain.name}={chain.version}: the transform `T_Ro{e.tip}`   '
        f'(Ro = {chain.root_frame}, {e.tip} = {chain.frame_id})',
        is_title=True,
    )
    if chain.source:
        yield Remark(f'Table from: {_free_text(chain.source)}')
    if e.q is None:
        symbols = [
            f'`q_{joint}` ({name})' for joint, name in enumerate(chain.joint_names)
        ]
        yield Remark(
            f'Joint positions: symbols {", ".join(symbols)}. Lengths in mm, angles in rad.'
        )
        return
    joints = zip(chain.joint_names, chain.joints, e.q, strict=True)
    values = [f'{name} {position(link, value)}' for name, link, value in joints]
    yield Remark(f'Joint positions: {", ".join(values)}. Lengths in mm.')


def _placed_frames(e: Explanation) -> Iterator[Block]:
    """Take steps 1 to 4, each a column of every frame."""
    posture = 'q = 0' if e.q is None else 'this q'
    other = 'z_(i+1)' if e.is_modified else 'z_(i-1)'
    turns = [_motion(row) for row in e.rows]
    origins = [_origin(e, i) for i in range(len(e.rows) + 1)]
    normals = [f'orthogonal to `z_{i}` and `z_{i + 1}`' for i in range(len(e.rows))]
    if e.is_modified:
        turns.insert(0, 'no joint: frame 0')
        normals.append('free')
    else:
        turns.append('no joint: the last frame')
        normals.insert(0, 'as `T_Ro0` has it')
    yield Heading(
        'Step 1. The z axis of each joint   '
        f'(coordinates in {e.chain.root_frame}, at {posture})'
    )
    yield _vectors(e, 'z', 2, turns)
    yield Heading(
        f'Step 2. The origin of each frame, on `z_i` where it meets `{other}`   (mm)'
    )
    yield _vectors(e, 'o', 3, origins)
    yield Heading(
        f'Step 3. The x axis of each frame, orthogonal to `{other}` and `z_i`'
    )
    yield _vectors(e, 'x', 0, normals)
    yield Heading(
        'Step 4. The y axis of each frame, by the right-hand rule: `y_i = z_i x x_i`'
    )
    yield _vectors(e, 'y', 1, [''] * len(origins))


def _vectors(e: Explanation, letter: str, column: int, remarks: Sequence[str]) -> Table:
    """Return a column of every frame, each with its remark."""
    remarks = [*remarks, *(f'as `{name}` has it' for name in e.tips)]
    numbers = []
    for T in e.frames.values():
        numbers.append([short(value) for value in T[:3, column]])
    vectors = [f'`= ({line[1:-1]})`' for line in text.matrix(numbers, '  ')]
    names = [f'`{letter}_{name}`' for name in e.frames]
    return Table(list(zip(names, vectors, remarks, strict=True)))


def _motion(row: ExplainedRow) -> str:
    """Say what the joint of a row does with its z axis."""
    if row.link.is_fixed:
        return 'a fixed row'
    mover = row.row.joint if row.row.is_first else f'a row that follows {row.row.joint}'
    if row.link.is_prismatic:
        return f'{mover} slides along it'
    return f'{mover} turns about it'


def _joint(row: Row) -> str:
    """Return what moves a row: its joint, one that an earlier row has too, or nothing."""
    if row.link.is_fixed:
        return '(fixed)'
    return row.joint if row.is_first else f'follows {row.joint}'


def _origin(e: Explanation, i: int) -> str:
    """Say why the origin of frame i is where it is."""
    if e.is_modified and i == len(e.rows):
        return 'where the last row puts it'
    if not e.is_modified and i == 0:
        return 'where `T_Ro0` puts it'
    other = i + 1 if e.is_modified else i - 1
    link = e.rows[min(i, other)].link
    apart = f'{short(MM * abs(link.a))} mm away'
    is_parallel = abs(math.sin(link.alpha)) < 1e-12
    if is_parallel and link.a:
        return f'`z_{i}` parallel to `z_{other}`, {apart}'
    if is_parallel:
        return f'`z_{i}` lies on `z_{other}`'
    if link.a:
        return f'where the common normal from `z_{other}` ends, {apart}'
    return f'`z_{other}` and `z_{i}` meet here'


def _table(e: Explanation) -> Iterator[Block]:
    yield Heading(
        'Step 5. The Denavit-Hartenberg table, and each link as four basic transforms'
    )
    yield Table([_table_row(e, row) for row in e.rows], _HEADER)
    ranges = [
        f'{row.row.joint} {joint_range(row.link)}'
        for row in e.rows
        if row.link.robot_range and row.row.is_first
    ]
    if ranges:
        yield Remark(f'Ranges of robots, which count: {", ".join(ranges)}')
    for row in e.rows:
        if row.link.erratum:
            yield Remark(
                f'* `i = {row.index}` as printed: {_free_text(row.link.erratum)}'
            )


def _table_row(e: Explanation, row: ExplainedRow) -> list[str]:
    """Return a row as the documents print it, with the range in the place of the joint."""
    link = row.link
    d, theta = short(MM * link.d), short(math.degrees(link.offset))
    if link.is_prismatic:
        d = f'{d} {_moved(e, row)}'
    elif not link.is_fixed:
        theta = f'{theta} {_moved(e, row)}'
    mark = ' *' if link.erratum else ''
    values = [short(MM * link.a), d, _in_pi(link.alpha), theta]
    return [
        f'`i = {row.index}`{mark}',
        *(f'`{value}`' for value in values),
        _joint(row.row),
    ]


def _moved(e: Explanation, row: ExplainedRow) -> str:
    """Return `+ (-44 -> +132)`, or `- 0.5 q` where the range is unknown or another row's."""
    link = row.link
    joint = e.chain.joints[row.row.joint_index]
    gain = link.gain * unit(link, _DEGREE) / unit(joint, _DEGREE)
    sign = '+' if gain > 0 else '-'
    factor = '' if abs(gain) == 1 else f'{short(abs(gain), 6)} '
    if not row.row.is_first or (link.lower, link.upper) == (-math.inf, math.inf):
        return f'{sign} {factor}q'
    lower, upper = unit(link, _DEGREE) * link.lower, unit(link, _DEGREE) * link.upper
    plus = '+' if upper >= 0 else ''
    return f'{sign} {factor}({short(lower)} -> {plus}{short(upper)})'


def _general_row(e: Explanation) -> Iterator[Block]:
    yield Sentence(f'`A_i = T_i(i+1) = {_factors(e.rows[0], "i")}`')
    rows = [line.split('|') for line in _GENERAL[e.chain.convention].split('\n')]
    yield Equation('', [np.char.strip(rows)])
    T = e.chain.T_n_tip
    row = DHLink(
        a=T[0, 3], d=T[2, 3], alpha=math.atan2(T[2, 1], T[2, 2]), joint_type='fixed'
    )
    is_row = np.allclose(row.transform(), T) and not np.array_equal(T, np.eye(4))
    if is_row and not e.is_modified:
        a, d, alpha = short(MM * row.a), short(MM * row.d), _in_pi(row.alpha)
        yield Sentence(
            f'`{next(iter(e.tips))}` equals a last fixed row: `a = {a}`, `d = {d}`, '
            f'`alpha = {alpha}`, `theta = 0`'
        )


def _legend(e: Explanation) -> Iterator[Block]:
    """Say what the symbols are."""
    yield Sentence(
        'In what follows `c_i = cos(theta_i)` and `s_i = sin(theta_i)`, with'
    )
    meanings = {name: plain(meaning) for name, meaning in e.symbols.items()}
    meanings |= sums_of_angles([*e.products, e.T_root_tip])
    yield Table([[f'`{name}`', f'`= {meaning}`'] for name, meaning in meanings.items()])


def _each_row(e: Explanation, row: ExplainedRow) -> Iterator[Block]:
    i = row.index
    yield Sentence(
        f'`A_{i} = {_between(i, i + 1)} = {_factors(row, i)}`   {_joint(row.row)}'
    )
    yield Remark(
        f'`theta_{i} = {_theta(e, row)}`   `d_{i} = {_d(e, row)}`   '
        f'`a_{i} = {plain(row.a)}`   `alpha_{i} = {_in_pi(row.link.alpha)}`'
    )
    yield Equation('', list(row.factors.values()))
    yield _transform('', row.A)


def _theta(e: Explanation, row: ExplainedRow) -> str:
    """Return `90 - 30 = 60 deg`, or exact in rad: `q_3 + pi/2`."""
    if not isinstance(row.theta, float):
        return plain(e.symbols.get(f'theta_{row.index}', row.theta))
    moves = row.link.joint_type == 'revolute'
    return f'{_sum(math.degrees(row.link.offset), math.degrees(row.theta), moves)} deg'


def _d(e: Explanation, row: ExplainedRow) -> str:
    """Return `150 + 100 = 250`, or exact: `q_2 + 150`."""
    if not isinstance(row.d, float):
        return plain(e.symbols.get(f'd_{row.index}', row.d))
    return _sum(MM * row.link.d, row.d, row.link.is_prismatic)


def _sum(start: float, total: float, moves: bool) -> str:
    if not moves:
        return short(total)
    moved = short(total - start)
    sign = '-' if moved.startswith('-') else '+'
    return f'{short(start)} {sign} {moved.lstrip("-")} = {short(total)}'


def _products(e: Explanation) -> Iterator[Block]:
    yield Heading('Step 6. Multiply')
    before = ''
    for row, T in zip(e.rows, e.products, strict=True):
        name = _between(0, row.index + 1)
        yield _transform(f'{name} = {before}A_{row.index}', T)
        before = f'{name} '
    yield Equation('T_Ro0', [e.T_root_0])
    for name, T in e.tips.items():
        yield Equation(name, [T])
    factors = ' '.join(['T_Ro0', before.strip(), *e.tips])
    yield _transform(f'T_Ro{e.tip} = {factors}', e.T_root_tip)


def _transform(name: str, T: Matrix) -> Equation | Entries:
    """Return a transform as a matrix if it fits on a line, else entry by entry."""
    columns = zip(*T.tolist(), strict=True)
    widths = [max(map(len, map(plain, column))) for column in columns]
    if len(f'  {name} = [      ]') + sum(widths) > text.WIDTH:
        return Entries(name, T)
    return Equation(name, [T])


def _answer(e: Explanation, q: Sequence[float]) -> Iterator[Block]:
    x, y, z, _ = (short(float(row[3])) for row in e.T_root_tip.tolist())
    yield Sentence(
        f'{e.chain.frame_id} is at x = {x}, y = {y}, z = {z} mm in '
        f'{e.chain.root_frame}.'
    )
    for note in text.range_notes(e.chain, q):
        yield Sentence(_free_text(note))


def _factors(row: ExplainedRow, i: int | str) -> str:
    """Return `Rz(theta_3) tz(d_3) tx(a_3) Rx(alpha_3)`."""
    return ' '.join(f'{name}({_PARAMETERS[name]}_{i})' for name in row.factors)


def _between(i: int, j: int) -> str:
    """Return the name of the transform from frame j to frame i."""
    return f'T_{i}{j}' if j < 10 else f'T_{i},{j}'


def _in_pi(angle: float) -> str:
    """Return an angle [rad] as the tables print it: -pi/2, pi, 0; else in decimals."""
    part = degrees(angle) / 180
    if part.denominator > 180:
        return short(angle, 6)
    times = {-1: '-pi', 0: '0', 1: 'pi'}.get(part.numerator, f'{part.numerator}pi')
    return times if part.denominator == 1 else f'{times}/{part.denominator}'


def _free_text(words: str) -> str:
    """Return words that somebody else wrote, without the marks of a formula."""
    return words.replace('`', "'")
