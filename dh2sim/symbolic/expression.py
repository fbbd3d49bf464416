"""Polynomials as people write them: nested sums of products, with sums that recur named.

The nesting is one recursive collection with another order of atoms: from the base, c1*(c23*(c4*c5*c6 - s4*s6) - …) as
in J. J. Craig, Introduction to Robotics; or from the tool, c6*(…) - s6*(…), as computer algebra prints it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from typing import Any, Final, NamedTuple, TypeAlias

from dh2sim.symbolic.angles import rate_row, slide_row, trig_of
from dh2sim.symbolic.polynomial import ROOTS, Atom, Monomial, Polynomial, Rational, magnitude


class Style(StrEnum):
    """How an expression is nested."""

    BASE = "base"
    """Collected by the angles of the first rows, then of the next ones; lengths inside."""
    TOOL = "tool"
    """Collected by the angles of the last rows first; lengths outside."""
    EXPANDED = "expanded"
    """A sum of products; of lengths times sums, where lengths are first."""


class Lengths(StrEnum):
    """Where lengths are in a nested expression."""

    FIRST = "first"
    LAST = "last"


@dataclass(frozen=True)
class Sum:
    """A sum of terms; zero has none."""

    terms: tuple[Term, ...] = ()

    @cached_property
    def key(self) -> tuple[Any, ...]:
        """A value by which sums with the same terms in any order are equal."""
        return tuple(sorted(term.key for term in self.terms))

    @cached_property
    def opposite_key(self) -> tuple[Any, ...]:
        """The key of the same sum with all signs changed."""
        return tuple(sorted((factors, -number) for factors, number in self.key))

    def __neg__(self) -> Sum:
        return Sum(tuple(-term for term in self.terms))


@dataclass(frozen=True)
class Term:
    """A number times powers of factors."""

    number: Rational
    factors: tuple[Factor, ...] = ()

    @cached_property
    def key(self) -> tuple[Any, ...]:
        """A value by which terms with the same factors in any order are equal: -a*(b - c) is a*(c - b)."""
        number, factors = self.number, []
        for base, power in self.factors:
            if isinstance(base, Sum):
                own, opposite = base.key, base.opposite_key
                if opposite < own and power % 2:
                    number = -number
                factors.append((1, min(own, opposite), power))
            else:
                factors.append((0, (base,), power))
        return (tuple(sorted(factors)), number)

    def __neg__(self) -> Term:
        return Term(-self.number, self.factors)


class Factor(NamedTuple):
    """An atom, the name of a sum, or a sum, to a power."""

    base: Atom | Sum
    power: int = 1


Named: TypeAlias = Mapping[Atom, Sum]
"""Sums by their names, each using only names before it."""


# ---------------------------------------------------------------------------- nesting


class Nesting:
    """Collects polynomials in one style; the order of atoms is that of all of them together."""

    def __init__(
        self,
        polynomials: Iterable[Polynomial],
        style: Style = Style.BASE,
        lengths: Lengths | None = None,
        outermost: Sequence[Sequence[Atom]] = (),
    ) -> None:
        """Find the order of atoms.

        Args:
            polynomials: All that will be collected.
            style: Their nesting.
            lengths: Where lengths are; by default as the style has them.
            outermost: Cosines and sines of constant angles that go before those of all coordinates, angle by angle.
        """
        atoms = {atom for polynomial in polynomials for atom in polynomial.atoms}
        by_angle: dict[Any, list[Atom]] = {}
        for atom in sorted(atoms):
            trig = trig_of(atom)
            if trig is not None and not trig.angle.is_constant:
                by_angle.setdefault(_place(atom), []).append(atom)
        groups = [by_angle[place] for place in sorted(by_angle)]
        order = {Style.BASE: groups, Style.TOOL: groups[::-1], Style.EXPANDED: []}
        before = [] if style is Style.EXPANDED else outermost
        self._groups: Sequence[Sequence[Atom]] = [*before, *order[style]]
        self._lengths = lengths or (Lengths.FIRST if style is Style.TOOL else Lengths.LAST)

    def __call__(self, polynomial: Polynomial) -> Sum:
        """Return a polynomial as a nested sum."""
        return tidied(self._collected(polynomial))

    def _collected(self, polynomial: Polynomial) -> Sum:
        if self._lengths is Lengths.LAST:
            return _collected(polynomial, self._groups)
        return _joined(
            _times(monomial, _collected(rest, self._groups), size)
            for monomial, part in _by(polynomial, lambda atom: trig_of(atom) is None)
            for size, rest in _by_magnitude(part)
        )


def _collected(polynomial: Polynomial, groups: Sequence[Sequence[Atom]]) -> Sum:
    shared = _shared_twists(polynomial) if groups else ()
    if shared:
        rest = {
            tuple(pair for pair in monomial if pair not in shared): number
            for monomial, number in polynomial.terms.items()
        }
        return _times(shared, _collected(Polynomial(rest), groups))
    for k, group in enumerate(groups):
        parts = _by(polynomial, set(group).__contains__)
        if len(parts) > 1 or (parts and parts[0][0]):
            return _joined(_times(monomial, _collected(rest, groups[k + 1 :])) for monomial, rest in parts)
    return _plain(polynomial)


def _shared_twists(polynomial: Polynomial) -> Monomial:
    """Return the cosines and sines of named twists that several terms have in common, all of them."""
    first, *others = polynomial.terms or ((),)
    if not others:
        return ()
    constant = [pair for pair in first if (trig := trig_of(pair[0])) is not None and trig.angle.is_constant]
    return tuple(pair for pair in constant if all(pair in monomial for monomial in others))


def _plain(polynomial: Polynomial) -> Sum:
    """Return a polynomial as a sum of products."""
    terms = sorted((_term(m, n) for m, n in polynomial.terms.items()), key=_printing_order)
    return Sum(tuple(terms))


def _by(polynomial: Polynomial, chosen: Any) -> list[tuple[Monomial, Polynomial]]:
    """Split a polynomial by the monomials of chosen atoms; what has none of them comes last."""
    parts: dict[Monomial, dict[Monomial, Rational]] = {}
    for monomial, number in polynomial.terms.items():
        outside = tuple([pair for pair in monomial if chosen(pair[0])])
        inside = tuple([pair for pair in monomial if pair not in outside]) if outside else monomial
        parts.setdefault(outside, {})[inside] = number
    order = sorted(parts, key=lambda monomial: (not monomial, [(_atom_order(a), p) for a, p in monomial]))
    return [(monomial, Polynomial(parts[monomial])) for monomial in order]


def _by_magnitude(polynomial: Polynomial) -> list[tuple[Rational, Polynomial]]:
    """Split a polynomial by the magnitudes of its coefficients, which are lengths where those are plain numbers."""
    parts: dict[Rational, dict[Monomial, Rational]] = {}
    for monomial, number in polynomial.terms.items():
        parts.setdefault(magnitude(number), {})[monomial] = 1 if number > 0 else -1
    return [(size, Polynomial(parts[size])) for size in sorted(parts)]


def _times(monomial: Monomial, rest: Sum, number: Rational = 1) -> Sum:
    """Return a product; a single term is multiplied in, and a sum that starts with a minus gives its sign up."""
    if not monomial and number == 1:
        return rest
    factors = _ordered(monomial)
    if len(rest.terms) == 1:
        term = rest.terms[0]
        return Sum((Term(term.number * number, (*factors, *term.factors)),))
    if all(term.number < 0 for term in rest.terms):
        return Sum((Term(-number, (*factors, Factor(-rest))),))
    return Sum((Term(number, (*factors, Factor(rest))),))


def tidied(sum_: Sum) -> Sum:
    """Return a sum with the factors of each product in the order of print, and a positive term in front."""
    terms = []
    for term in sum_.terms:
        factors = [Factor(tidied(base) if isinstance(base, Sum) else base, power) for base, power in term.factors]
        factors.sort(key=lambda factor: (1,) if _is_sum(factor.base) else (0, _atom_order(str(factor.base))))
        terms.append(Term(term.number, tuple(factors)))
    first = next((k for k, term in enumerate(terms) if term.number > 0), 0)
    return Sum((terms[first], *terms[:first], *terms[first + 1 :]) if terms else ())


def _positive_first(sum_: Sum) -> Sum:
    return Sum(tuple(sorted(tidied(sum_).terms, key=lambda term: term.number < 0)))


def _is_sum(base: Atom | Sum) -> bool:
    return isinstance(base, Sum) or base.startswith("#")


def _joined(sums: Iterable[Sum]) -> Sum:
    return Sum(tuple(term for part in sums for term in part.terms))


def _term(monomial: Monomial, number: Rational) -> Term:
    return Term(number, _ordered(monomial))


def _ordered(monomial: Monomial) -> tuple[Factor, ...]:
    return tuple(Factor(atom, power) for atom, power in sorted(monomial, key=lambda pair: _atom_order(pair[0])))


def _printing_order(term: Term) -> tuple[Any, ...]:
    """Order terms of a sum: positive ones first, then by their factors; a number comes last."""
    atoms = [_atom_order(base) for base, _ in term.factors if isinstance(base, str)]
    return (term.number < 0, not term.factors, atoms)


def _place(atom: Atom) -> Any:
    """Return where the angle of an atom is in the order of rows."""
    trig = trig_of(atom)
    assert trig is not None
    return (trig.angle.coordinates, trig.angle.names, trig.angle.degrees)


@lru_cache(maxsize=4096)
def _atom_order(atom: Atom) -> tuple[Any, ...]:
    """Order atoms of a product: roots, letters, named cosines, slides, then cosines and sines by row."""
    if atom in ROOTS:
        return (0, atom)
    if rate_row(atom) is not None:
        return (5, rate_row(atom))
    trig = trig_of(atom)
    if trig is None:
        return (3, slide_row(atom)) if slide_row(atom) is not None else (1, atom)
    if trig.angle.is_constant:
        return (2, trig.angle.names, trig.angle.degrees, trig.function)
    return (4, *_place(atom), trig.function)


# ---------------------------------------------------------------------------- naming


def name_sums(sums: Sequence[Sum]) -> tuple[dict[Atom, Sum], list[Sum]]:
    """Name nested sums that occur several times, up to their sign.

    Args:
        sums: Nested expressions.

    Returns:
        The named sums, each using only names before it, and the expressions with names in them.
    """
    count: dict[Any, int] = {}

    def visit(sum_: Sum) -> None:
        for term in sum_.terms:
            for base, _ in term.factors:
                if isinstance(base, Sum):
                    key = min(base.key, base.opposite_key)
                    count[key] = count.get(key, 0) + 1
                    if count[key] == 1:
                        visit(base)

    for sum_ in sums:
        visit(sum_)
    named: dict[Atom, Sum] = {}
    names: dict[Any, tuple[Atom, Any]] = {}

    def replaced(sum_: Sum) -> Sum:
        return Sum(tuple(_with_names(term) for term in sum_.terms))

    def _with_names(term: Term) -> Term:
        number, factors = term.number, []
        for base, power in term.factors:
            if not isinstance(base, Sum):
                factors.append(Factor(base, power))
                continue
            own, opposite = base.key, base.opposite_key
            key = min(own, opposite)
            if count[key] < 2 or _is_short(base):
                factors.append(Factor(replaced(base), power))
                continue
            if key not in names:
                definition = replaced(base)
                turned = 2 * sum(part.number < 0 for part in definition.terms) > len(definition.terms)
                name = f"#{len(named) + 1}"
                names[key] = (name, opposite if turned else own)
                named[name] = _positive_first(-definition) if turned else tidied(definition)
            name, defined_key = names[key]
            factors.append(Factor(name, power))
            if defined_key != own and power % 2:
                number = -number
        return Term(number, tuple(factors))

    return named, [replaced(sum_) for sum_ in sums]


def _is_short(sum_: Sum) -> bool:
    """Whether a sum is d2 + L2, say, which needs no name."""
    return len(sum_.terms) < 3 and all(len(t.factors) + (abs(t.number) != 1) <= 1 for t in sum_.terms)


# ---------------------------------------------------------------------------- what it costs, what it is


def operation_count(sums: Iterable[Sum]) -> tuple[int, int]:
    """Return how many multiplications and additions or subtractions expressions have as they are written."""
    multiplications = additions = 0
    for sum_ in sums:
        additions += max(0, len(sum_.terms) - 1)
        for term in sum_.terms:
            factors = sum(power for _, power in term.factors) + (abs(term.number) != 1 or not term.factors)
            multiplications += factors - 1
            m, a = operation_count(base for base, _ in term.factors if isinstance(base, Sum))
            multiplications, additions = multiplications + m, additions + a
    return multiplications, additions


def atoms_of(sum_: Sum) -> set[Atom]:
    """Return the atoms and names of an expression."""
    found: set[Atom] = set()
    for term in sum_.terms:
        for base, _ in term.factors:
            found |= atoms_of(base) if isinstance(base, Sum) else {base}
    return found


_ROOT_VALUES: Final = {atom: math.sqrt(number) for atom, number in ROOTS.items()}


def evaluated(sums: Sequence[Sum], named: Named, values: Mapping[Atom, Any]) -> list[Any]:
    """Return the values of expressions.

    Args:
        sums: The expressions.
        named: The sums that they name.
        values: Of every atom, numbers or arrays of one shape.
    """
    known: dict[Atom, Any] = {**_ROOT_VALUES, **values}

    def value(sum_: Sum) -> Any:
        total: Any = 0.0
        for term in sum_.terms:
            product: Any = float(term.number)
            for base, power in term.factors:
                factor = value(base) if isinstance(base, Sum) else known[base]
                for _ in range(power):
                    product = product * factor
            total = total + product
        return total

    for name, sum_ in named.items():
        known[name] = value(sum_)
    return [value(sum_) for sum_ in sums]
