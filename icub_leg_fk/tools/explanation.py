"""What `leg_fk explain` works out: the Denavit-Hartenberg method on one chain, all its numbers.

Lengths are millimetres here, as in the printed tables. Rows count from i = 0, so row i is the
transform A_i = T_i(i+1) from frame i+1 to frame i. Matrices are numpy's with floats or, where the
answer is to be exact or a formula, sympy's (see `explanation_symbols`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
import math
from operator import matmul
from typing import NamedTuple

from icub_leg_fk.errors import LegFKError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.chain import Row
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array, cos_sin
from icub_leg_fk.tools.explanation_symbols import Cell, Exact, in_mm, Matrix, MM, symbol
import numpy as np

# In the order of multiplication. Of a modified table a and alpha are before the joint.
_FACTORS = {'standard': ('Rz', 'tz', 'tx', 'Rx'), 'modified': ('Rx', 'tx', 'Rz', 'tz')}

# How the iCub's documentation calls the tips; another robot's are E and, for a second frame, S.
_TIP_SYMBOLS = {
    'left_foot': ('Lf', 'Ls'),
    'right_foot': ('Rf', 'Rs'),
    'head_imu': ('Is', 'S'),
}

_MOST_TWISTS = 2  # alphas that are not right angles, before a formula fills pages


@dataclass(frozen=True)
class ExplainedRow:
    """What a row of the table contributes.

    Attributes:
        index: its i.
        row: the row with its joint, in the chain's own convention.
        theta: its angle about z; a symbol such as theta_3 where the joint has no value.
        d: its length along z; a symbol such as d_3 where the joint has no value.
        a: its length along x.
        alpha: its angle about x.
        factors: the four basic transforms by name, in the order of multiplication.
        A: their product.
    """

    index: int
    row: Row
    theta: Cell
    d: Cell
    a: Cell
    alpha: Cell
    factors: Mapping[str, Matrix]
    A: Matrix

    @property
    def link(self) -> DHLink:
        """The parameters as the table has them."""
        return self.row.link


@dataclass(frozen=True)
class Explanation:
    """A chain, explained.

    Attributes:
        chain: the chain.
        tip: symbol of the tip's frame, such as Lf in T_RoLf.
        q: joint positions [rad or m]; None where they stay symbols.
        T_root_0: transform from frame 0 to the root frame.
        rows: what each row of the table contributes.
        products: T_01, T_02, ... T_0m.
        tips: what follows the last row, by name: T_nIs, T_LfLs.
        T_root_tip: the answer.
        frames: (4, 4) frames in the root frame by name, 0 to m and the tip's, at q, or at q = 0.
        symbols: what each symbol stands for; empty with numbers.
    """

    chain: Chain
    tip: str
    q: Sequence[float] | None
    T_root_0: Matrix
    rows: Sequence[ExplainedRow]
    products: Sequence[Matrix]
    tips: Mapping[str, Matrix]
    T_root_tip: Matrix
    frames: Mapping[str, Array]
    symbols: Mapping[str, Cell]

    @property
    def is_modified(self) -> bool:
        """Whether the table is in Craig's convention."""
        return self.chain.convention == 'modified'


class Decimals:
    """Arithmetic with floats, in numpy's matrices; `Exact` has the same methods."""

    number = angle = float
    length = staticmethod(in_mm)

    def __init__(self) -> None:
        self.symbols: dict[str, Cell] = {}

    def cos_sin(self, angle: float) -> tuple[float, ...]:
        """Return cosine and sine, exact at right angles."""
        return tuple(map(float, cos_sin(angle)))

    def matrix(self, rows: Sequence[Sequence[float]]) -> Array:
        """Return a matrix of rows."""
        return np.array(rows, dtype=float)

    def named(self, name: str, value: float) -> float:
        """Return what stands for a parameter in matrices: its value."""
        return value

    def product(self, *matrices: Array) -> Array:
        """Return the product of matrices."""
        return reduce(matmul, matrices)

    def with_sums_of_angles(self, T: Array) -> Array:
        """Return a transform in which turns about parallel axes are one turn: as it is."""
        return T


Numbers = Decimals | Exact


class _Placed(NamedTuple):
    """A frame after the last row's, and where it is in the frame before it."""

    before: str
    name: str
    T: Array


def explain(
    chain: Chain, q: Sequence[float] | None, *, exact: bool = False
) -> Explanation:
    """Work out the documented method for one chain.

    Args:
        chain: the chain.
        q: (n,) joint positions [rad or m]; None for a formula in q_0, q_1, ...
        exact: whether numbers are to be exact; a formula's always are.

    Raises:
        LegFKError: the formula would fill pages.
        MissingDependencyError: exact numbers are wanted and sympy is not installed.
    """
    if q is None:
        _refuse_pages(chain)
    numbers = Exact() if exact or q is None else Decimals()
    rows = _rows(chain, _positions(chain, q, numbers), numbers)
    products = _running_products(rows, numbers)
    T_root_0 = _constant(chain.T_root_0, numbers)
    placed = _placed(chain)
    tips = {
        f'T_{frame.before}{frame.name}': _constant(frame.T, numbers) for frame in placed
    }
    return Explanation(
        chain=chain,
        tip=placed[-1].name if placed else _tip_symbols(chain)[0],
        q=q,
        T_root_0=T_root_0,
        rows=rows,
        products=products,
        tips=tips,
        T_root_tip=numbers.product(T_root_0, products[-1], *tips.values()),
        frames=_frames(chain, np.zeros(chain.n) if q is None else q, placed),
        symbols=numbers.symbols,
    )


def unit(link: DHLink, radian: float = 1.0) -> float:
    """Return what a joint position of 1 m is in mm, or one of 1 rad in another unit of angles."""
    return MM if link.is_prismatic else radian


def _refuse_pages(chain: Chain) -> None:
    """Refuse a formula whose entries would have thousands of characters."""
    twists = [
        link.alpha for link in chain.links if abs(math.sin(2 * link.alpha)) > 1e-9
    ]
    if len(twists) > _MOST_TWISTS:
        raise LegFKError(
            f'a formula of chain {chain.name} would fill pages, because {len(twists)} of its '
            f'alphas are not right angles (allowed: {_MOST_TWISTS}); give joint positions, such '
            'as with --degrees'
        )


def _positions(chain: Chain, q: Sequence[float] | None, numbers: Numbers) -> list[Cell]:
    """Return the joint positions [rad or mm], or a symbol for each."""
    if q is None:
        return [symbol(f'q_{joint}') for joint in range(chain.n)]
    positions: list[Cell] = []
    for value, link in zip(q, chain.joints, strict=True):
        read = numbers.length if link.is_prismatic else numbers.angle
        positions.append(read(float(value)))
    return positions


def _rows(
    chain: Chain, positions: Sequence[Cell], numbers: Numbers
) -> list[ExplainedRow]:
    rows = []
    for index, row in enumerate(chain.rows()):
        link = row.link
        theta, d = numbers.angle(link.offset), numbers.length(link.d)
        a, alpha = numbers.length(link.a), numbers.angle(link.alpha)
        if not link.is_fixed:
            gain = link.gain * unit(link) / unit(chain.joints[row.joint_index])
            moved = numbers.number(gain) * positions[row.joint_index]
            if link.is_prismatic:
                d = numbers.named(f'd_{index}', d + moved)
            else:
                theta = numbers.named(f'theta_{index}', theta + moved)
        basic = _basic_transforms(theta, d, a, alpha, numbers)
        factors = {name: basic[name] for name in _FACTORS[chain.convention]}
        A = numbers.product(*factors.values())
        rows.append(ExplainedRow(index, row, theta, d, a, alpha, factors, A))
    return rows


def _basic_transforms(
    theta: Cell, d: Cell, a: Cell, alpha: Cell, numbers: Numbers
) -> dict[str, Matrix]:
    """Return the turns about and the moves along z and x, by name."""
    (ct, st), (ca, sa) = numbers.cos_sin(theta), numbers.cos_sin(alpha)
    transforms = {}
    for name, entries in {
        'Rz': {(0, 0): ct, (0, 1): -st, (1, 0): st, (1, 1): ct},
        'tz': {(2, 3): d},
        'tx': {(0, 3): a},
        'Rx': {(1, 1): ca, (1, 2): -sa, (2, 1): sa, (2, 2): ca},
    }.items():
        transforms[name] = _identity(numbers)
        for place, entry in entries.items():
            transforms[name][place] = entry
    return transforms


def _identity(numbers: Numbers) -> Matrix:
    return numbers.matrix(np.eye(4, dtype=int).tolist())


def _running_products(rows: Sequence[ExplainedRow], numbers: Numbers) -> list[Matrix]:
    """Return T_01, T_02, ... T_0m."""
    T = _identity(numbers)
    products = []
    for row in rows:
        for name, factor in row.factors.items():
            T = numbers.product(T, factor)
            if name == 'Rz':
                T = numbers.with_sums_of_angles(T)
        products.append(T)
    return products


def _tip_symbols(chain: Chain) -> tuple[str, str]:
    """Return the symbols of the tip and of its second frame."""
    return _TIP_SYMBOLS.get(chain.tip, ('E', 'S'))


def _placed(chain: Chain) -> list[_Placed]:
    """Return the frames after the last row's: none, the tip's, another of the tip, or both."""
    tip, second = _tip_symbols(chain)
    T_tip_frame = chain.tip_frames[chain.frame].T_tip_frame
    frames = [_Placed('n', tip, chain.T_n_tip), _Placed(tip, second, T_tip_frame)]
    return [frame for frame in frames if not np.array_equal(frame.T, np.eye(4))]


def _frames(
    chain: Chain, q: Sequence[float] | Array, placed: Sequence[_Placed]
) -> dict[str, Array]:
    """Return all frames in the root frame by name, with their origins in mm."""
    *of_table, T = chain.frames(q)[:-1]
    frames = {str(i): frame for i, frame in enumerate([*of_table, T])}
    for after in placed:
        T = frames[after.name] = T @ after.T
    for T in frames.values():
        T[:3, 3] *= MM
    return frames


def _constant(T: Array, numbers: Numbers) -> Matrix:
    """Return a transform that no joint changes, with its translation in mm."""
    constant = _identity(numbers)
    for row, column in np.ndindex(3, 4):
        read = numbers.length if column == 3 else numbers.number
        constant[row, column] = read(float(T[row, column]))
    return constant
