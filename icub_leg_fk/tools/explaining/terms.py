"""Matrix entries as words: decimals of a float, textbook notation of a sympy expression.

Factors stand in the order of the joints (of the first ten), `-0.9175 s_0 c_1 c_2`, which no
printer of sympy gives, and fractions as decimals where those are as exact: -0.9175 is easier on
the eye than -367/400.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from icub_leg_fk.tools.text import short

Cell = Any


@dataclass(frozen=True)
class Style:
    """How to write a symbol, a constant, a sum in parentheses."""

    symbol: Callable[[str], str]
    constant: Callable[[Cell], str]
    parentheses: str


def _latex_constant(number: Cell) -> str:
    import sympy

    return str(sympy.latex(number))


def symbol_latex(name: str) -> str:
    """Return `theta_0` with a backslash before it, and its index in braces."""
    letter, _, index = name.partition('_')
    greek = rf'\{letter}' if len(letter) > 1 else letter
    return f'{greek}_{{{index.replace("_", chr(32)).replace("m", "-")}}}'


TEXT = Style(str, lambda number: str(number).replace('**', '^').replace('*', ' '), '({})')
LATEX = Style(symbol_latex, _latex_constant, r'\left({}\right)')


def cell_words(cell: Cell, style: Style = TEXT) -> str:
    """Return an entry of a matrix on one line."""
    return ' '.join(terms(cell, style))


def terms(cell: Cell, style: Style = TEXT) -> list[str]:
    """Return the terms of an entry, each but the first with its sign before it."""
    if isinstance(cell, (int, float)):
        return [short(cell, 4)]
    words: list[str] = []
    for term in sorted(cell.as_ordered_terms(), key=_order):
        negative = term.could_extract_minus_sign()
        body = _factors(-term if negative else term, style)
        words.append((f'- {body}' if words else f'-{body}') if negative
                     else f'+ {body}' if words else body)
    return words


def filled(words: list[str], width: int) -> list[str]:
    """Join terms to lines no wider than `width`, unless a term itself is."""
    lines = ['']
    for word in words:
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append(word)
        else:
            lines[-1] = f'{lines[-1]} {word}' if lines[-1] else word
    return lines


def _factors(term: Cell, style: Style) -> str:
    """Write a term that is not negative: number, symbols by joint, sums in parentheses."""
    if not term.free_symbols:
        return _number(term, style)
    number, rest = term.as_independent(*term.free_symbols)
    factors = sorted(rest.as_ordered_factors(), key=_order)
    words = [_number(number, style)] if number != 1 else []
    for factor in factors:
        if factor.is_Symbol:
            words.append(style.symbol(factor.name))
        elif factor.is_Add:
            words.append(style.parentheses.format(cell_words(factor, style)))
        else:  # cos(theta_3 - theta_4), where it is defined
            words.append(style.constant(factor))
    return ' '.join(words)


def _number(number: Cell, style: Style) -> str:
    if number.is_Rational and 10**6 % number.q == 0:
        return f'{float(number):.12g}'
    return style.constant(number)


def _order(part: Cell) -> tuple[bool, int, list[tuple[int, str]]]:
    """Sort key: bare numbers last, short before long, and symbols by the number of their joint."""
    names = sorted((int(name.split('_')[1][:1]), name)
                   for name in (symbol.name for symbol in part.free_symbols))
    return not names, len(names), names
