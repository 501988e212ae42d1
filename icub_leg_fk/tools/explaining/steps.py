"""What `leg_fk explain` tells: the Denavit-Hartenberg method, step by step, for one chain.

Lengths are millimetres here, as in the printed tables. Rows count from i = 0, so row i is the
transform A_i = T_i(i+1) = Rz(theta_i) tz(d_i) tx(a_i) Rx(alpha_i) from frame i+1 to frame i; in
Craig's convention it is Rx(alpha_i) tx(a_i) Rz(theta_i) tz(d_i).
An entry of a matrix is a float, or a sympy expression where the answer is to be exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
import math
from typing import Any, Protocol

from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.catalog import ChainEntry
from icub_leg_fk.kinematics.chain import modified_rows
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array, cos_sin
import numpy as np

Cell = Any
Matrix = list[list[Cell]]

# How the iCub's documentation calls the tips; another robot's are E and, with a sole, S.
TIP_SYMBOLS = {'left_foot': ('Lf', 'Ls'), 'right_foot': ('Rf', 'Rs'), 'head_imu': ('Is', '')}


@dataclass(frozen=True)
class Row:
    """A row of the DH table; `joint` is empty for a fixed row."""

    index: int
    joint: str
    link: DHLink


@dataclass(frozen=True)
class Step:
    """What one row contributes: its values, A_i with its four factors, and T_0(i+1)."""

    row: Row
    theta: Cell
    d: Cell
    a: Cell
    alpha: Cell
    factors: tuple[Matrix, Matrix, Matrix, Matrix]
    A: Matrix
    T_0: Matrix


@dataclass(frozen=True)
class Explanation:
    """One chain explained.

    Attributes:
        chain: the chain.
        root, tip: symbols of its ends, as in T_RoLf.
        source: where the table comes from, if it is not the printed documentation.
        q: the joint vector [rad or m]; None where the joints stay symbols.
        T_root_0: where frame 0 stands in the root frame.
        steps: one per row.
        tips: what follows the last row: name and matrix of T_nIs and of the sole.
        T_root_tip: the answer.
        symbols: what each symbol stands for; empty with numbers.
        frames: frames in the root frame [mm] by name, 0 to m and those of the tips, for q or for
            q = 0.
    """

    chain: Chain
    root: str
    tip: str
    source: str
    q: Sequence[float] | None
    T_root_0: Matrix
    steps: list[Step]
    tips: list[tuple[str, Matrix]]
    T_root_tip: Matrix
    frames: dict[str, Array]
    symbols: dict[str, Cell] = field(default_factory=dict)


class Algebra(Protocol):
    """The arithmetic in which a chain is explained: decimals, or sympy."""

    symbols: dict[str, Cell]

    def matrix(self, T: Array) -> Matrix:
        """Return a constant transform, whose translation is in metres, in mm."""

    def values(self, row: Row, q: float | None) -> tuple[Cell, Cell, Cell, Cell]:
        """Return theta, d, a, alpha of a row."""

    def cos_sin(self, row: Row, theta: Cell) -> tuple[Cell, Cell]:
        """Return cosine and sine of a row's theta."""

    def cos_sin_constant(self, angle: Cell) -> tuple[Cell, Cell]:
        """Return cosine and sine of an angle that is no joint's."""

    def running_products(self, steps: Sequence[Step], modified: bool) -> list[Matrix]:
        """Return T_01, T_02, ... T_0m."""


class Decimals:
    """Floats."""

    def __init__(self) -> None:
        self.symbols: dict[str, Cell] = {}

    def matrix(self, T: Array) -> Matrix:
        """Return a constant transform, whose translation is in metres, in mm."""
        return np.vstack((T[:3] * (1, 1, 1, 1000), T[3])).tolist()  # type: ignore[no-any-return]

    def values(self, row: Row, q: float | None) -> tuple[Cell, Cell, Cell, Cell]:
        """Return theta [rad], d, a [mm], alpha [rad] of a row."""
        link, position = row.link, q or 0.0
        slide, turn = (position, 0.0) if link.is_prismatic else (0.0, position)
        return (link.offset + link.sign * turn, 1000 * (link.d + link.sign * slide),
                1000 * link.a, link.alpha)

    def cos_sin(self, row: Row, theta: Cell) -> tuple[Cell, Cell]:
        """Return cosine and sine of a row's theta."""
        return cos_sin(theta)

    def cos_sin_constant(self, angle: Cell) -> tuple[Cell, Cell]:
        """Return cosine and sine of an angle."""
        return cos_sin(angle)

    def running_products(self, steps: Sequence[Step], modified: bool) -> list[Matrix]:
        """Return T_01, T_02, ... T_0m."""
        products = [steps[0].A]
        for step in steps[1:]:
            products.append(product(products[-1], step.A))
        return products


def explanation(entry: ChainEntry, chain: Chain, foot_frame: str | None, q: Sequence[float] | None,
                algebra: Algebra) -> Explanation:
    """Work a chain out, step by step.

    Args:
        entry: the chain's entry in its catalog.
        chain: the version and tip frame asked for.
        foot_frame: that tip frame, `dh` or `sole`.
        q: joint vector [rad or m], or None to keep the joints as symbols.
        algebra: the arithmetic.
    """
    version = entry.versions[chain.version]
    steps = _steps(chain, q, algebra)
    tip, sole = TIP_SYMBOLS.get(chain.tip, ('E', 'S'))
    tip_transforms = []
    if not np.array_equal(version.T_n_tip, np.eye(4)):
        tip_transforms.append((f'T_n{tip}', version.T_n_tip))
    T_dh_tip = version.tip_frames[foot_frame or next(iter(version.tip_frames))].T_dh_tip
    if not np.array_equal(T_dh_tip, np.eye(4)):
        tip_transforms.append((f'T_{tip}{sole}', T_dh_tip))
        tip = sole
    tips = [(name, algebra.matrix(T)) for name, T in tip_transforms]
    T_root_0 = algebra.matrix(chain.T_root_0)
    T_root_tip = product(T_root_0, steps[-1].T_0)
    for _, T in tips:
        T_root_tip = product(T_root_tip, T)
    return Explanation(chain, 'Ro', tip, version.source, q, T_root_0, steps, tips, T_root_tip,
                       _frames(chain, q, [(name, np.array(Decimals().matrix(T)))
                                          for name, T in tip_transforms]), algebra.symbols)


def number(cell: Cell, symbols: Mapping[str, Cell]) -> float | None:
    """Return the value of an entry; None if it depends on a joint without a value."""
    if isinstance(cell, (int, float)):
        return float(cell)
    value = cell.subs(list(symbols.items())).evalf()
    return float(value) if value.is_number else None


def product(A: Matrix, B: Matrix) -> Matrix:
    """Return the product of two 4x4 matrices of numbers or expressions."""
    return [[sum((x * y for x, y in zip(row, column, strict=True)), start=0)
             for column in zip(*B, strict=True)] for row in A]


def basic_transforms(theta: tuple[Cell, Cell], d: Cell, a: Cell, alpha: tuple[Cell, Cell]
                     ) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Return Rz(theta), tz(d), tx(a), Rx(alpha); an angle is given as its cosine and sine."""
    (ct, st), (ca, sa) = theta, alpha
    return (
        [[ct, -st, 0, 0], [st, ct, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
        [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]],
        [[1, 0, 0, a], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
        [[1, 0, 0, 0], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]],
    )


def _steps(chain: Chain, q: Sequence[float] | None, algebra: Algebra) -> list[Step]:
    names = iter(chain.joint_names)
    given: Iterator[float | None] = iter([None] * chain.n if q is None else q)
    rows, positions = [], []
    modified = chain.convention == 'modified'
    for i, link in enumerate(modified_rows(chain) if modified else chain.links):
        rows.append(Row(i, '' if link.is_fixed else next(names), link))
        positions.append(0.0 if link.is_fixed else next(given))
    steps = []
    for row, position in zip(rows, positions, strict=True):
        theta, d, a, alpha = algebra.values(row, position)
        factors = basic_transforms(algebra.cos_sin(row, theta), d, a,
                                   algebra.cos_sin_constant(alpha))
        if modified:
            factors = (factors[3], factors[2], factors[0], factors[1])
        A = product(product(*factors[:2]), product(*factors[2:]))
        steps.append(Step(row, theta, d, a, alpha, factors, A, A))
    products = algebra.running_products(steps, modified)
    return [Step(s.row, s.theta, s.d, s.a, s.alpha, s.factors, s.A, T)
            for s, T in zip(steps, products, strict=True)]


def _frames(chain: Chain, q: Sequence[float] | None, tips: Sequence[tuple[str, Array]]
            ) -> dict[str, Array]:
    """Return frames 0 to m and those of the tips in the root frame [mm], by name."""
    algebra = Decimals()
    T: Array = np.array(algebra.matrix(chain.T_root_0))
    frames = {'0': T}
    for step in _steps(chain, [0.0] * chain.n if q is None else q, algebra):
        T = frames[str(step.row.index + 1)] = T @ np.array(step.A)
    for name, placed in tips:
        T = frames[name[3:]] = T @ placed
    return frames


def pi_text(angle: float) -> str:
    """Return an angle [rad] as the tables print it: -pi/2, pi, 0; else in decimals."""
    part = Fraction(f'{math.degrees(angle):.12g}') / 180
    if part.denominator > 180:
        return f'{angle:.6g}'
    over, under = abs(part.numerator), part.denominator
    text = f'{over if over > 1 else ""}pi{f"/{under}" if under > 1 else ""}' if over else '0'
    return f'-{text}' if part < 0 else text
