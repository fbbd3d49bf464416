"""How atoms, numbers and products are written: what text, LaTeX and code have in common and where they differ."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Final, Protocol

from dh2sim.symbolic.expression import Sum
from dh2sim.symbolic.polynomial import Atom, Rational, magnitude

_DIGITS: Final = 12
"""Behind the decimal point, of a number that is written exactly."""

_LISTED: Final = 6
"""Rows in the name of a cosine: c123456."""


class Notation(Protocol):
    """Writes the parts of an expression."""

    times: str
    """Between the factors of a product."""

    def atom(self, atom: Atom) -> str:
        """Return an atom, or the name of a sum."""

    def number(self, number: Rational) -> str:
        """Return a number that is not negative."""

    def power(self, base: str, exponent: int) -> str:
        """Return ``base`` to a power greater than 1; a sum comes in parentheses."""

    def parenthesized(self, text: str) -> str:
        """Return a sum as a factor."""


def written(sum_: Sum, notation: Notation) -> str:
    """Return an expression; spaces are around the plus and minus signs between terms, and nowhere else."""
    text = ""
    for term in sum_.terms:
        factors = []
        for base, power in term.factors:
            factor = notation.parenthesized(written(base, notation)) if isinstance(base, Sum) else notation.atom(base)
            factors.append(factor if power == 1 else notation.power(factor, power))
        number = magnitude(term.number)
        if number != 1 or not factors:
            factors.insert(0, notation.number(number))
        body = notation.times.join(factors)
        if text:
            text += f" - {body}" if term.number < 0 else f" + {body}"
        else:
            text = f"-{body}" if term.number < 0 else body
    return text or notation.number(0)


def decimal(number: Rational) -> str:
    """Return a number that is not negative: exactly if that takes few digits, else as the double next to it."""
    fraction = Fraction(number)
    for digits in range(_DIGITS + 1):
        scaled = fraction * 10**digits
        if scaled.denominator == 1:
            text = str(scaled.numerator).rjust(digits + 1, "0")
            return f"{text[: len(text) - digits]}.{text[len(text) - digits :]}" if digits else text
    return repr(float(fraction))


def is_simple_quotient(number: Rational) -> bool:
    """Whether a number is better written as a quotient, such as 1/3."""
    denominator = Fraction(number).denominator
    rest = denominator
    for prime in (2, 5):
        while rest % prime == 0:
            rest //= prime
    return rest > 1 and denominator < 1000


def is_long_run(rows: Sequence[int]) -> bool:
    """Whether rows follow one another and are too many to be listed in the name of a cosine."""
    return len(rows) > _LISTED and rows[-1] - rows[0] == len(rows) - 1
