"""What `leg_fk explain` tells: the Denavit-Hartenberg method, worked out for one chain.

Lengths are millimetres here, as in the printed tables. Rows count from i = 0, so row i is the
transform A_i = T_i(i+1) from frame i+1 to frame i. An entry of a matrix is a float, or where the
answer is to be exact a sympy expression, with c_i and s_i for cosine and sine of theta_i. Every
product is linear in each joint's c_i and s_i, so nothing needs simplifying, but for joints with
parallel axes: Rz(theta_3) Rx(pi) Rz(theta_4) is Rz(theta_3 - theta_4) Rx(pi). Such angles are
added up while multiplying, and appear as c_34 and s_34, or c_3m4 and s_3m4 for a difference.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from importlib import import_module
import math
from typing import Any

from icub_leg_fk.errors import MissingDependencyError
from icub_leg_fk.kinematics import Chain
from icub_leg_fk.kinematics.link import DHLink
from icub_leg_fk.kinematics.rotation import Array, cos_sin
import numpy as np

Cell = Any
Matrix = list[list[Cell]]

# How the iCub's documentation calls the tips; another robot's are E and, with a sole, S.
_TIP_SYMBOLS = {'left_foot': ('Lf', 'Ls'), 'right_foot': ('Rf', 'Rs'), 'head_imu': ('Is', '')}


@dataclass(frozen=True)
class Step:
    """What row `index` contributes: its values, and A_i with its four factors."""

    index: int
    joint: str  # empty for a fixed row
    link: DHLink
    theta: Cell
    d: Cell
    a: Cell
    alpha: Cell
    factors: tuple[Matrix, ...]
    A: Matrix


@dataclass(frozen=True)
class Explanation:
    """One chain explained."""

    chain: Chain
    tip: str  # its symbol, as in T_RoLf
    source: str  # of the table, if it is not the printed documentation
    q: Sequence[float] | None  # [rad or m]; None where the joints stay symbols
    T_root_0: Matrix
    steps: list[Step]
    products: list[Matrix]  # T_01, T_02, ... T_0m
    tips: list[tuple[str, Matrix]]  # what follows the last row: T_nIs, and that of the sole
    T_root_tip: Matrix
    frames: dict[str, Array]  # by name, 0 to m and the tips', in the root frame, for q or q = 0
    symbols: dict[str, Cell]  # what each symbol stands for; empty with numbers

    @property
    def is_modified(self) -> bool:
        """Whether the table is in Craig's convention."""
        return self.chain.convention == 'modified'

    def value(self, cell: Cell) -> float | None:
        """Return the value of an entry; None if it depends on a joint without one."""
        if isinstance(cell, (int, float)):
            return float(cell)
        value = cell.subs(list(self.symbols.items())).evalf()
        return float(value) if value.is_number else None


class _Algebra:
    """The arithmetic: in floats, or exact in sympy's expressions.

    Where it is exact, `symbols` keeps the meaning of every symbol, and cosines and sines of a
    number are exact as long as they are as simple as sqrt(3)/2; the cosine of 100 degrees stays
    c_i, since its powers would fill pages.
    """

    def __init__(self, exact: bool) -> None:
        self.symbols: dict[str, Cell] = {}
        self._thetas: dict[int, Cell] = {}
        try:
            self._sympy: Any = import_module('sympy') if exact else None
        except ImportError as error:
            raise MissingDependencyError(
                'sympy is not installed, exact answers need it (pip install sympy, rosdep key '
                'python3-sympy); decimal ones do not: give --degrees or --radians') from error

    def number(self, value: float) -> Cell:
        return self._sympy.Rational(Fraction(repr(value))) if self._sympy else value

    def mm(self, metres: float) -> Cell:
        return self.number(float(f'{1000 * metres:.12g}') if self._sympy else 1000 * metres)

    def angle(self, radians: float) -> Cell:
        """Return an angle, exact as a part of pi if its degrees have at most four decimals."""
        degrees = Fraction(f'{math.degrees(radians):.12g}')
        if self._sympy and 10_000 % degrees.denominator == 0:
            return self._sympy.pi * self._sympy.Rational(degrees) / 180
        return self.number(radians)

    def joint(self, index: int, link: DHLink, q: float | None) -> tuple[Cell, Cell]:
        """Return theta and d of a row; a joint without a value brings its symbol."""
        theta, d = self.angle(link.offset), self.mm(link.d)
        if link.is_fixed:
            return theta, d
        position = (self._sympy.Symbol(f'q_{index}') if q is None
                    else self.mm(q) if link.is_prismatic else self.angle(q))
        moved = self.number(link.gain) * position + (d if link.is_prismatic else theta)
        if q is None:
            moved = self._define(f'{"d" if link.is_prismatic else "theta"}_{index}', moved)
        return (theta, moved) if link.is_prismatic else (moved, d)

    def cos_sin(self, index: int, theta: Cell) -> tuple[Cell, Cell]:
        """Return cosine and sine of a row's theta: c_i and s_i if it is a symbol."""
        self._thetas[index] = theta
        return self._cos_sin_sum([(index, 1)])

    def cos_sin_constant(self, angle: Cell) -> tuple[Cell, Cell]:
        """Return cosine and sine of an angle that is no joint's."""
        return ((self._sympy.cos(angle), self._sympy.sin(angle)) if self._sympy
                else cos_sin(float(angle)))

    def running_products(self, steps: Sequence[Step], modified: bool) -> list[Matrix]:
        """Return T_01, T_02, ... T_0m, with the angles of joints on parallel axes added up."""
        zero, one = self.number(0.0), self.number(1.0)
        products: list[Matrix] = []
        base = _constant(np.eye(4), self)
        turned: list[tuple[int, int]] = []  # joints since base, and the sense of each
        x, y, z, sense = zero, zero, zero, 1  # translation since base; -1 once z points back

        def behind(ca: Cell, sa: Cell) -> Matrix:
            c, s = self._cos_sin_sum(turned)
            T = product(base, [[c, -s * ca, s * sa, x], [s, c * ca, -c * sa, y],
                               [zero, sa, ca, z], [0, 0, 0, 1]])
            return [[self._sympy.expand(cell) for cell in row] for row in T] if self._sympy else T

        for step in steps:
            for part in ('link', 'joint') if modified else ('joint', 'link'):
                if part == 'joint':
                    turned.append((step.index, sense))
                    z += sense * step.d
                    continue
                c, s = self._cos_sin_sum(turned)
                x, y = x + c * step.a, y + s * step.a
                ca, sa = (sense * value for value in self.cos_sin_constant(step.alpha))
                if sa == 0:
                    sense = int(ca)
                else:
                    base, turned = behind(ca, sa), []
                    x, y, z, sense = zero, zero, zero, 1
            products.append(behind(sense * one, zero))
        return products

    def _cos_sin_sum(self, turned: Sequence[tuple[int, int]]) -> tuple[Cell, Cell]:
        """Return cosine and sine of a sum of thetas: numbers if they are simple, else symbols."""
        angles = [(index, sense * self._thetas[index]) for index, sense in turned]
        if not self._sympy:
            return self.cos_sin_constant(sum(angle for _, angle in angles))
        joints = [index for index, angle in angles if not angle.is_number]
        constant = sum((angle for _, angle in angles if angle.is_number),
                       start=self._sympy.Integer(0))
        cc, sc = self.cos_sin_constant(constant)
        if not joints and (cc.is_Rational or sc.is_Rational or cc == sc or cc == -sc):
            return cc, sc
        if not joints:  # cos(100 deg) is not simple; the angle itself may be a symbol's
            joints, constant, cc, sc = [index for index, _ in angles], 0, 1, 0
        total = sum(angle for index, angle in angles if index in joints)
        senses = dict(turned)
        name = ('_' if max(self._thetas) > 9 else '').join(  # c_12 or c_1_2; c_1m2
            f'{"m" if senses[index] < 0 else ""}{index}' for index in joints)
        c = self._define(f'c_{name}', self._sympy.cos(total, evaluate=False))
        s = self._define(f's_{name}', self._sympy.sin(total, evaluate=False))
        return c * cc - s * sc, s * cc + c * sc

    def _define(self, name: str, meaning: Cell) -> Cell:
        self.symbols[name] = meaning
        return self._sympy.Symbol(name)


def work_out(chain: Chain, q: Sequence[float] | None, exact: bool) -> Explanation:
    """Work a chain out for a joint vector [rad or m], or for symbols, which are exact."""
    algebra, decimals = _Algebra(exact or q is None), _Algebra(False)
    steps = _steps(chain, q, algebra)
    products = algebra.running_products(steps, chain.convention == 'modified')
    tip, sole = _TIP_SYMBOLS.get(chain.tip, ('E', 'S'))
    tips = []
    if not np.array_equal(chain.T_n_tip, np.eye(4)):
        tips.append((f'T_n{tip}', chain.T_n_tip))
    T_tip_frame = chain.tip_frames[chain.frame].T_tip_frame
    if not np.array_equal(T_tip_frame, np.eye(4)):
        tips.append((f'T_{tip}{sole}', T_tip_frame))
        tip = sole
    T: Array = np.array(_constant(chain.T_root_0, decimals))
    frames = {'0': T}
    for step in _steps(chain, [0.0] * chain.n if q is None else q, decimals):
        T = frames[str(step.index + 1)] = T @ np.array(step.A)
    for name, placed in tips:
        T = frames[name[3:]] = T @ np.array(_constant(placed, decimals))
    T_root_0 = _constant(chain.T_root_0, algebra)
    exact_tips = [(name, _constant(placed, algebra)) for name, placed in tips]
    T_root_tip = product(T_root_0, products[-1], *(placed for _, placed in exact_tips))
    return Explanation(chain, tip, chain.source, q, T_root_0, steps, products, exact_tips,
                       T_root_tip, frames, algebra.symbols)


def product(*matrices: Matrix) -> Matrix:
    """Return the product of 4x4 matrices of numbers or expressions."""
    return reduce(lambda A, B: [[sum((x * y for x, y in zip(row, column)), start=0)
                                 for column in zip(*B)] for row in A], matrices)


def _constant(T: Array, algebra: _Algebra) -> Matrix:
    """Return a constant transform, whose translation is in metres, in mm."""
    return [[*map(algebra.number, row[:3]), algebra.mm(row[3])]
            for row in T[:3].tolist()] + [[0, 0, 0, 1]]


def _steps(chain: Chain, q: Sequence[float] | None, algebra: _Algebra) -> list[Step]:
    modified = chain.convention == 'modified'
    steps = []
    for i, (link, joint, joint_index, _) in enumerate(chain.rows()):
        position = None if q is None or link.is_fixed else q[joint_index]
        theta, d = algebra.joint(i, link, position)
        a, alpha = algebra.mm(link.a), algebra.angle(link.alpha)
        (ct, st), (ca, sa) = algebra.cos_sin(i, theta), algebra.cos_sin_constant(alpha)
        factors: tuple[Matrix, ...] = (
            [[ct, -st, 0, 0], [st, ct, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
            [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]],
            [[1, 0, 0, a], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
            [[1, 0, 0, 0], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]])
        if modified:
            factors = (factors[3], factors[2], factors[0], factors[1])
        steps.append(Step(i, joint, link, theta, d, a, alpha, factors, product(*factors)))
    return steps
