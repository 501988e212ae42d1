"""Exact arithmetic for `leg_fk explain`: sympy, with c_i and s_i for cosine and sine of theta_i.

Where theta_i is a number they are its exact cosine and sine, as long as those are as simple as
sqrt(3)/2; the cosine of 100 degrees stays c_i, since its powers would fill pages.

Every product is linear in each joint's c_i and s_i, so nothing needs simplifying, but for joints
with parallel axes: Rz(theta_3) Rx(pi) Rz(theta_4) = Rz(theta_3 - theta_4) Rx(pi). Such angles are
added up while multiplying, and appear as c_34 and s_34, or c_3m4 and s_3m4 for a difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
import math

from icub_leg_fk.errors import MissingDependencyError
from icub_leg_fk.kinematics.rotation import Array
from icub_leg_fk.tools.explaining.steps import Cell, Matrix, product, Row, Step

try:
    import sympy
except ImportError as error:
    raise MissingDependencyError(
        'sympy is not installed: exact and symbolic answers need it (pip install sympy, rosdep '
        'key python3-sympy); decimal ones do not, give --degrees or --radians') from error


class Exact:
    """Sympy expressions; keeps the meaning of every symbol it introduces in `symbols`."""

    def __init__(self) -> None:
        self.symbols: dict[str, Cell] = {}
        self._angles: dict[int, Cell] = {}

    def matrix(self, T: Array) -> Matrix:
        """Return a constant transform, whose translation is in metres, in mm."""
        rows = [[exact_number(value) for value in row] for row in T.tolist()]
        for row, metres in zip(rows, T[:3, 3].tolist(), strict=False):
            row[3] = exact_mm(metres)
        return rows

    def values(self, row: Row, q: float | None) -> tuple[Cell, Cell, Cell, Cell]:
        """Return theta, d, a, alpha of a row; a joint without a value brings its symbol."""
        i, link = row.index, row.link
        theta, d = exact_angle(link.offset), exact_mm(link.d)
        a, alpha = exact_mm(link.a), exact_angle(link.alpha)
        if link.is_prismatic:
            if q is None:
                d = self._define(f'd_{i}', link.sign * sympy.Symbol(f'q_{i}') + d)
            else:
                d += link.sign * exact_mm(q)
        elif link.is_fixed:
            pass
        elif q is None:
            theta = self._define(f'theta_{i}', link.sign * sympy.Symbol(f'q_{i}') + theta)
        else:
            theta += link.sign * exact_angle(q)
        return theta, d, a, alpha

    def cos_sin(self, row: Row, theta: Cell) -> tuple[Cell, Cell]:
        """Return cosine and sine of a row's theta: c_i and s_i if it is a symbol."""
        self._angles[row.index] = theta
        return self._pair([(row.index, 1)])

    def cos_sin_constant(self, angle: Cell) -> tuple[Cell, Cell]:
        """Return cosine and sine of an angle that is no joint's."""
        return sympy.cos(angle), sympy.sin(angle)

    def running_products(self, steps: Sequence[Step], modified: bool) -> list[Matrix]:
        """Return T_01, T_02, ... T_0m, with the angles of joints on parallel axes added up."""
        products: list[Matrix] = []
        base: Matrix | None = None
        turned: list[tuple[int, int]] = []  # joints since base, and the sense of each
        x, y, z, sense = 0, 0, 0, 1  # translation since base; -1 once the z axis points back

        def behind(ca: Cell, sa: Cell) -> Matrix:
            c, s = self._pair(turned) if turned else (sympy.Integer(1), sympy.Integer(0))
            within = [[c, -s * ca, s * sa, x], [s, c * ca, -c * sa, y],
                      [sympy.Integer(0), sa, ca, z], [0, 0, 0, 1]]
            T = within if base is None else product(base, within)
            return [[sympy.expand(cell) for cell in row] for row in T]

        for step in steps:
            for part in ('link', 'joint') if modified else ('joint', 'link'):
                if part == 'joint':
                    turned.append((step.row.index, sense))
                    z += sense * step.d
                    continue
                c, s = self._pair(turned) if turned else (1, 0)
                x, y = x + c * step.a, y + s * step.a
                ca, sa = (sense * value for value in self.cos_sin_constant(step.alpha))
                if sa == 0:
                    sense = int(ca)
                else:
                    base, turned, x, y, z, sense = behind(ca, sa), [], 0, 0, 0, 1
            products.append(base if base is not None and not turned and not (x or y or z)
                            and sense == 1 else behind(sympy.Integer(sense), sympy.Integer(0)))
        return products

    def _pair(self, turned: Sequence[tuple[int, int]]) -> tuple[Cell, Cell]:
        """Return cosine and sine of a sum of thetas: numbers if they are simple, else symbols."""
        angles = [(index, sense * self._angles[index]) for index, sense in turned]
        joints = [index for index, angle in angles if not angle.is_number]
        constant = sum((angle for _, angle in angles if angle.is_number), start=sympy.Integer(0))
        cc, sc = self.cos_sin_constant(constant)
        if not joints and (cc.is_Rational or sc.is_Rational or cc == sc or cc == -sc):
            return cc, sc
        if not joints:  # cos(100 deg) is not simple; the angle itself may be a symbol's
            joints, constant, cc, sc = [index for index, _ in angles], 0, 1, 0
        total = sum(angle for index, angle in angles if index in joints)
        signs = dict(turned)
        name = ('_' if max(self._angles) > 9 else '').join(  # c_12 or c_1_2; c_1m2
            f'{"m" if signs[index] < 0 else ""}{index}' for index in joints)
        c = self._define(f'c_{name}', sympy.cos(total, evaluate=False))
        s = self._define(f's_{name}', sympy.sin(total, evaluate=False))
        return c * cc - s * sc, s * cc + c * sc

    def _define(self, name: str, meaning: Cell) -> Cell:
        self.symbols[name] = meaning
        return sympy.Symbol(name)


def exact_mm(metres: float) -> Cell:
    """Return a length in mm as the fraction that was printed."""
    return sympy.Rational(Fraction(f'{1000 * metres:.12g}'))


def exact_angle(radians: float) -> Cell:
    """Return an angle as a part of pi if its degrees have at most four decimals, to 1e-12."""
    degrees = Fraction(f'{math.degrees(radians):.12g}')
    if 10_000 % degrees.denominator == 0:
        return sympy.pi * sympy.Rational(degrees) / 180
    return exact_number(radians)


def exact_number(value: float) -> Cell:
    """Return the fraction that was printed."""
    return sympy.Rational(Fraction(repr(value)))
