"""Exact numbers and formulas of an explanation, in sympy's expressions, and how they are written.

Cosine and sine of theta_3 are written c_3 and s_3. Turns about parallel axes add up: their angles
are one, such as theta_3 - theta_4, and its cosine is written c_(3-4). Numbers are exact as long as
they are simple, as sqrt(3)/2 is; others, such as cos(100 deg), are decimals.
"""

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from functools import cache, reduce
from importlib import import_module
import math
from operator import matmul
import re
from typing import Any

from icub_leg_fk.errors import MissingDependencyError
from icub_leg_fk.kinematics.chain_text import short

Cell = Any  # an entry of a matrix: a float, or an expression of sympy
Matrix = Any  # of numpy, or of sympy

MM = 1000.0  # per metre

_DECIMALS = 6  # of a number that is exact as it is printed: -0.9175
_NOISE = 14  # decimals; what differs less is rounding
_SUM = re.compile(r'_(\d+(?:[+-]\d+)+)')  # the subscript of a sum of angles
_LONGEST = 24  # characters of an exact number that is still read easily


@cache
def import_sympy(module: str = 'sympy') -> Any:
    """Return sympy or one of its modules, which takes half a second to import.

    Raises:
        MissingDependencyError: it is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingDependencyError(
            'sympy',
            'an explanation in exact numbers or as a formula',
            'pip install sympy (rosdep key python3-sympy); decimals need no library, such as '
            'with --degrees alone',
        ) from error


class Exact:
    """Arithmetic with sympy's expressions.

    Attributes:
        symbols: what each symbol in a matrix stands for.
    """

    def __init__(self) -> None:
        self._sympy = import_sympy()
        self.symbols: dict[str, Cell] = {}

    def number(self, value: float) -> Cell:
        """Return a number: exact if it has few decimals, as printed ones do."""
        exact = Fraction(repr(round(value, _NOISE)))
        if 10**_DECIMALS % exact.denominator == 0:
            return self._sympy.Rational(exact)
        return self._sympy.Float(value)

    def length(self, metres: float) -> Cell:
        """Return a length in mm."""
        return self.number(in_mm(metres))

    def angle(self, radians: float) -> Cell:
        """Return an angle: as a part of pi if its degrees have at most four decimals."""
        angle = degrees(radians)
        if 10_000 % angle.denominator == 0:
            return self._sympy.pi * self._sympy.Rational(angle) / 180
        return self.number(radians)

    def cos_sin(self, angle: Cell) -> tuple[Cell, Cell]:
        """Return cosine and sine: of a symbol, simple as 0 or sqrt(3)/2, or in decimals."""
        values = self._sympy.cos(angle), self._sympy.sin(angle)
        if angle.is_number:
            return tuple(
                value if (value**2).is_Rational else value.n() for value in values
            )
        return values

    def matrix(self, rows: Sequence[Sequence[Cell]]) -> Matrix:
        """Return a matrix of rows."""
        return self._sympy.Matrix(rows)

    def named(self, name: str, value: Cell) -> Cell:
        """Return what a parameter is called in matrices: its name, if it depends on a joint."""
        if value.is_number:
            return value
        self.symbols[name] = value
        return symbol(name)

    def product(self, *matrices: Matrix) -> Matrix:
        """Return the product of two or more matrices, each entry a sum of products."""
        return reduce(matmul, matrices).applyfunc(self._expanded)

    def with_sums_of_angles(self, T: Matrix) -> Matrix:
        """Return a transform in which turns about parallel axes are one turn.

        Only its rotation is looked at: what a later row adds to the translation goes along the
        axes of the rotation, and so has these sums already.
        """
        add_angles = import_sympy('sympy.simplify.fu').TR10i
        T = T.copy()
        T[:3, :3] = T[:3, :3].applyfunc(lambda entry: self._expanded(add_angles(entry)))
        return T

    def _expanded(self, entry: Cell) -> Cell:
        """Return an entry as a sum of products, each with one number before its symbols."""
        terms = []
        for number, symbols in _terms(self._sympy.expand(entry)):
            if number.has(self._sympy.Float):
                number = self._sympy.Float(round(float(number), _NOISE))
            terms.append(number * symbols)
        return self._sympy.Add(*terms)


def _terms(entry: Cell) -> Iterator[tuple[Cell, Cell]]:
    """Yield the terms of a sum, each as a number and its symbols."""
    sympy = import_sympy()
    for term in sympy.Add.make_args(entry):
        yield term.as_independent(sympy.Symbol, as_Add=False)


def symbol(name: str) -> Cell:
    """Return a symbol, such as theta_3."""
    return import_sympy().Symbol(name)


def in_mm(metres: float) -> float:
    """Return a length in mm, without the last digit's rounding."""
    return float(f'{MM * metres:.13g}')


def degrees(radians: float) -> Fraction:
    """Return an angle in degrees, without the last digit's rounding."""
    return Fraction(f'{math.degrees(radians):.12g}')


@cache
def plain(cell: Cell) -> str:
    """Return an entry as text: `-0.9175 c_0 s_(3-4) + 10`."""
    if isinstance(cell, str):
        return cell
    if isinstance(cell, float):
        return short(cell)
    words = import_sympy().sstr(_as_shown(cell), full_prec=False).replace('*', ' ')
    return _SUM.sub(r'_(\1)', words)


def latex(cell: Cell) -> str:
    """Return an entry in LaTeX."""
    if isinstance(cell, float):
        return short(cell)
    return str(import_sympy().latex(_as_shown(cell), mul_symbol=r'\,'))


def sums_of_angles(matrices: Iterable[Matrix]) -> dict[str, str]:
    """Return the cosines and sines of sums that are in formulas, `c_(3-4)`, with their meaning."""
    sympy = import_sympy()
    found: set[Cell] = set()
    for matrix in matrices:
        found |= matrix.atoms(sympy.cos, sympy.sin)
    meanings = {str(_abbreviation(function)): function for function in found}
    sums = sorted(name for name in meanings if _SUM.search(name))
    return {plain(symbol(name)): str(meanings[name]) for name in sums}


@cache
def _as_shown(expression: Cell) -> Cell:
    """Return an expression with short names for cosines and sines, and with short numbers."""
    sympy = import_sympy()
    if expression.is_number:
        return _short_number(expression)
    terms = []
    for number, symbols in _terms(expression):
        functions = symbols.atoms(sympy.cos, sympy.sin)
        names = {function: _abbreviation(function) for function in functions}
        terms.append(_short_number(number) * symbols.xreplace(names))
    return sympy.Add(*terms)


def _short_number(number: Cell) -> Cell:
    """Return a number as a decimal, unless it is a simple fraction or root."""
    sympy = import_sympy()
    is_decimal = number.is_Rational and 10**_DECIMALS % number.q == 0
    if is_decimal or number.has(sympy.Float) or len(str(number)) > _LONGEST:
        words = short(float(number), _DECIMALS if is_decimal else 4)
        return sympy.Float(words) if '.' in words else sympy.Integer(words)
    return number


def _abbreviation(function: Cell) -> Cell:
    """Return c_3 for cos(theta_3), and c_3-4 for cos(theta_3 - theta_4)."""
    angle = function.args[0]
    signs = angle.as_coefficients_dict()
    if any(not theta.is_Symbol or abs(sign) != 1 for theta, sign in signs.items()):
        return function
    added = sorted(_index(theta) for theta, sign in signs.items() if sign > 0)
    taken = sorted(_index(theta) for theta, sign in signs.items() if sign < 0)
    subscript = '+'.join(map(str, added)) + ''.join(f'-{index}' for index in taken)
    return symbol(f'{function.func.__name__[0]}_{subscript}')


def _index(theta: Cell) -> int:
    """Return 3 for theta_3."""
    return int(theta.name.removeprefix('theta_'))
