"""Exact polynomials in named atoms: sums of rational numbers times powers of atoms.

An atom is a text: a parameter ``a2``, the coordinate of a sliding row ``q3``, a root ``sqrt(2)``, or the cosine or
sine of an angle, whose texts ``angles`` writes and reads. Products of roots are reduced, so that two polynomials
over atoms without relations are equal only if their terms are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Final, TypeAlias

Rational: TypeAlias = int | Fraction
Atom: TypeAlias = str
Monomial: TypeAlias = tuple[tuple[Atom, int], ...]
"""Atoms in alphabetical order, each with its power, which is at least 1."""

ROOTS: Final[Mapping[Atom, int]] = {"sqrt(2)": 2, "sqrt(3)": 3}
"""Atoms whose squares are numbers."""


class NotPolynomialError(ArithmeticError):
    """The result of an operation is not a polynomial."""


class Polynomial:
    """A polynomial with rational coefficients; immutable."""

    __slots__ = ("terms",)

    def __init__(self, terms: Mapping[Monomial, Rational] | None = None) -> None:
        """``terms`` holds no zero."""
        self.terms: Mapping[Monomial, Rational] = {} if terms is None else terms

    @classmethod
    def number(cls, value: Rational) -> Polynomial:
        """Return a constant."""
        return cls({(): value} if value else {})

    @classmethod
    def atom(cls, name: Atom) -> Polynomial:
        """Return a single atom."""
        return cls({((name, 1),): 1})

    @property
    def constant(self) -> Rational | None:
        """The value of a polynomial without atoms, or None."""
        if not self.terms:
            return 0
        return self.terms.get(()) if len(self.terms) == 1 else None

    @property
    def atoms(self) -> set[Atom]:
        """The atoms that it has."""
        return {atom for monomial in self.terms for atom, _ in monomial}

    def __bool__(self) -> bool:
        return bool(self.terms)

    def __eq__(self, other: object) -> bool:
        return self.terms == other.terms if isinstance(other, Polynomial) else NotImplemented

    def __hash__(self) -> int:
        return hash(frozenset(self.terms.items()))

    def __repr__(self) -> str:
        return f"<Polynomial {self.terms!r}>"

    def __add__(self, other: Polynomial) -> Polynomial:
        if not other.terms:
            return self
        if not self.terms:
            return other
        return Polynomial(_sum(dict(self.terms), other.terms.items()))

    def __neg__(self) -> Polynomial:
        return Polynomial({monomial: -number for monomial, number in self.terms.items()})

    def __sub__(self, other: Polynomial) -> Polynomial:
        return self + -other

    def __mul__(self, other: Polynomial) -> Polynomial:
        if not self.terms or not other.terms:
            return ZERO
        if other.terms == _ONE:
            return self
        if self.terms == _ONE:
            return other
        products = (
            (left if not right else right if not left else multiplied(left, right), m * n)
            for left, m in self.terms.items()
            for right, n in other.terms.items()
        )
        return Polynomial(_sum({}, _reduced(products)))

    def __truediv__(self, other: Polynomial) -> Polynomial:
        divisor = other.constant
        if divisor is None:
            raise NotPolynomialError
        return self.scaled(Fraction(1) / divisor)

    def scaled(self, factor: Rational) -> Polynomial:
        """Return a multiple."""
        return Polynomial({m: simple(n * factor) for m, n in self.terms.items()}) if factor else ZERO

    def __pow__(self, exponent: int) -> Polynomial:
        result = ONE
        for _ in range(exponent):
            result = result * self
        return result

    def value(self, values: Mapping[Atom, float]) -> float:
        """Return the value for values of its atoms."""
        return math.fsum(
            math.prod([float(number), *(values[atom] ** power for atom, power in monomial)])
            for monomial, number in self.terms.items()
        )

    def derivative(self, of_atom: Callable[[Atom], Polynomial]) -> Polynomial:
        """Return the derivative, given that of every atom."""
        result = ZERO
        known: dict[Atom, Polynomial] = {}
        for monomial, number in self.terms.items():
            for index, (atom, power) in enumerate(monomial):
                if atom not in known:
                    known[atom] = of_atom(atom)
                if not known[atom]:
                    continue
                left = ((atom, power - 1),) if power > 1 else ()
                rest = (*monomial[:index], *left, *monomial[index + 1 :])
                result = result + Polynomial({rest: number * power}) * known[atom]
        return result

    def substituted(self, values: Mapping[Atom, Polynomial]) -> Polynomial:
        """Return it with atoms exchanged for polynomials."""
        result = ZERO
        for monomial, number in self.terms.items():
            kept = tuple((atom, power) for atom, power in monomial if atom not in values)
            term = Polynomial({kept: number})
            for atom, power in monomial:
                if atom in values:
                    term = term * values[atom] ** power
            result = result + term
        return result


_ONE: Final[Mapping[Monomial, Rational]] = {(): 1}
ZERO: Final = Polynomial()
ONE: Final = Polynomial(_ONE)


def simple(number: Rational) -> Rational:
    """Return a whole number as an int: arithmetic is faster with them."""
    return number.numerator if number.denominator == 1 else number


def exact_number(value: float) -> Rational:
    """Return the decimal fraction that a double is printed as."""
    return simple(Fraction(repr(float(value))))


def magnitude(number: Rational) -> Rational:
    """Return the absolute value."""
    return -number if number < 0 else number


def multiplied(left: Monomial, right: Monomial) -> Monomial:
    """Return the product of two monomials."""
    powers = dict(left)
    for atom, power in right:
        powers[atom] = powers.get(atom, 0) + power
    return tuple(sorted(powers.items()))


def _reduced(products: Iterable[tuple[Monomial, Rational]]) -> Iterable[tuple[Monomial, Rational]]:
    """Turn squares of roots into numbers."""
    for product, number in products:
        if any(power > 1 and atom in ROOTS for atom, power in product):
            factor: Rational = number
            kept = []
            for atom, power in product:
                if atom in ROOTS:
                    factor *= ROOTS[atom] ** (power // 2)
                    power %= 2
                if power:
                    kept.append((atom, power))
            yield tuple(kept), factor
        else:
            yield product, number


def _sum(terms: dict[Monomial, Rational], more: Iterable[tuple[Monomial, Rational]]) -> dict[Monomial, Rational]:
    for monomial, number in more:
        total = terms.get(monomial, 0) + number
        if total:
            terms[monomial] = simple(total)
        else:
            terms.pop(monomial, None)
    return terms


Matrix: TypeAlias = list[list[Polynomial]]


def product(left: Matrix, right: Matrix) -> Matrix:
    """Return the product of two matrices."""
    result: Matrix = []
    for row in left:
        entries = []
        for j in range(len(right[0])):
            total = ZERO
            for k, factor in enumerate(row):
                if factor.terms and right[k][j].terms:
                    total = total + factor * right[k][j]
            entries.append(total)
        result.append(entries)
    return result


def identity(size: int) -> Matrix:
    """Return the identity matrix."""
    return [[ONE if i == j else ZERO for j in range(size)] for i in range(size)]
