"""Angles as exact sums of joint coordinates, named angles and degrees, and their sines and cosines as atoms.

Angles of neighbouring rows with parallel axes are added up here, before any cosine is taken: c23 exists from the
start, and no trigonometric identity is needed afterwards. A constant angle that is a multiple of 15 degrees has an
exact sine and cosine.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Final, Literal, NamedTuple, TypeVar

from dh2sim.symbolic.polynomial import ONE, ZERO, Atom, Polynomial, Rational, simple

_Key = TypeVar("_Key", int, str)


@dataclass(frozen=True, slots=True)
class Angle:
    """A sum of multiples of coordinates, of named angles, and degrees."""

    coordinates: tuple[tuple[int, Rational], ...] = ()
    """Rows, counted from 1, in order, and the multiples of their coordinates."""
    names: tuple[tuple[str, Rational], ...] = ()
    """Named constant angles in alphabetical order, and their multiples."""
    degrees: Rational = 0

    @classmethod
    def of(
        cls,
        coordinates: Mapping[int, Rational] | None = None,
        names: Mapping[str, Rational] | None = None,
        degrees: Rational = 0,
    ) -> Angle:
        """Return the angle with these multiples; zeros may be among them."""
        return cls(_kept(coordinates or {}), _kept(names or {}), simple(degrees))

    @property
    def is_constant(self) -> bool:
        """Whether no coordinate is in it."""
        return not self.coordinates

    def __bool__(self) -> bool:
        return bool(self.coordinates or self.names or self.degrees)

    def __add__(self, other: Angle) -> Angle:
        return Angle(
            _kept(_added(self.coordinates, other.coordinates)),
            _kept(_added(self.names, other.names)),
            simple(self.degrees + other.degrees),
        )

    def __neg__(self) -> Angle:
        return self.scaled(-1)

    def __sub__(self, other: Angle) -> Angle:
        return self + -other

    def scaled(self, factor: Rational) -> Angle:
        """Return a multiple."""
        return Angle(
            tuple((row, simple(n * factor)) for row, n in self.coordinates),
            tuple((name, simple(n * factor)) for name, n in self.names),
            simple(self.degrees * factor),
        )

    def cos_sin(self) -> tuple[Polynomial, Polynomial]:
        """Return cosine and sine: numbers where they are exact, else atoms with their sign.

        The angle in an atom begins with a positive multiple, and its degrees are from 0 to 90.
        """
        if not self.coordinates and not self.names:
            exact = exact_cos_sin(self.degrees)
            if exact is not None:
                return exact
        quarters, degrees = divmod(self.degrees, 90)
        rest = Angle(self.coordinates, self.names, simple(degrees))
        c, s = rest._first_quarter()
        return _turned(c, s, int(quarters))

    def _first_quarter(self) -> tuple[Polynomial, Polynomial]:
        """Return cosine and sine of an angle whose degrees are from 0 to 90."""
        if all(n > 0 for _, n in (*self.coordinates, *self.names)[:1]):
            return self._atoms()
        negative = -self
        if not self.degrees:
            c, s = negative._atoms()
            return c, -s
        complement = Angle(negative.coordinates, negative.names, simple(90 - self.degrees))
        c, s = complement._atoms()
        return s, c

    def _atoms(self) -> tuple[Polynomial, Polynomial]:
        text = str(self)
        return Polynomial.atom(f"cos({text})"), Polynomial.atom(f"sin({text})")

    def __str__(self) -> str:
        parts = [*((str(row), n) for row, n in self.coordinates), *self.names]
        text = "".join(f"{_signed(n)}{name}" for name, n in parts)
        if self.degrees or not text:
            text += f"{'+' if self.degrees >= 0 else ''}{self.degrees}°"
        return text.removeprefix("+")


class Trig(NamedTuple):
    """What the atom of a cosine or sine stands for."""

    function: Literal["cos", "sin"]
    angle: Angle


_PART: Final = re.compile(r"([-+]?)(?:([0-9/]+)\*)?(?:([0-9]+)|([A-Za-z_][A-Za-z0-9_]*)|([0-9/]+)°)(?=[-+]|$)")


@lru_cache(maxsize=4096)
def trig_of(atom: Atom) -> Trig | None:
    """Return what the atom of a cosine or sine stands for; None for any other atom."""
    function = atom[:3]
    if atom[3:4] != "(" or function not in ("cos", "sin"):
        return None
    coordinates: dict[int, Rational] = {}
    names: dict[str, Rational] = {}
    degrees: Rational = 0
    for sign, multiple, row, name, number in _PART.findall(atom[4:-1]):
        n = simple(Fraction(multiple or 1)) * (-1 if sign == "-" else 1)
        if row:
            coordinates[int(row)] = n
        elif name:
            names[name] = n
        else:
            degrees = n * simple(Fraction(number))
    return Trig("cos" if function == "cos" else "sin", Angle.of(coordinates, names, degrees))


def slide(row: int) -> Atom:
    """Return the atom of the coordinate of a prismatic row."""
    return f"q{row}()"


@lru_cache(maxsize=4096)
def slide_row(atom: Atom) -> int | None:
    """Return the row whose coordinate a sliding atom is; None for any other atom."""
    return int(atom[1:-2]) if atom.endswith("()") and atom[0] == "q" else None


def rate(row: int) -> Atom:
    """Return the atom of the velocity of the coordinate of a row."""
    return f"v{row}()"


@lru_cache(maxsize=4096)
def rate_row(atom: Atom) -> int | None:
    """Return the row whose velocity an atom is; None for any other atom."""
    return int(atom[1:-2]) if atom.endswith("()") and atom[0] == "v" else None


def derivative_by(row: int, atom: Atom) -> Polynomial:
    """Return the derivative of an atom by the coordinate of a row."""
    trig = trig_of(atom)
    if trig is None:
        return ONE if atom == slide(row) else ZERO
    multiple = dict(trig.angle.coordinates).get(row, 0)
    if not multiple:
        return ZERO
    c, s = trig.angle.cos_sin()
    return s.scaled(-multiple) if trig.function == "cos" else c.scaled(multiple)


@lru_cache(maxsize=1024)
def exact_cos_sin(degrees: Rational) -> tuple[Polynomial, Polynomial] | None:
    """Return cosine and sine of a multiple of 15 degrees; None for any other angle."""
    quarters, rest = divmod(degrees, 90)
    if rest not in _FIRST_QUARTER:
        return None
    return _turned(*_FIRST_QUARTER[rest], int(quarters))


def _turned(c: Polynomial, s: Polynomial, quarters: int) -> tuple[Polynomial, Polynomial]:
    """Return cosine and sine of an angle and so many quarter turns, from those of the angle."""
    return ((c, s), (-s, c), (-c, -s), (s, -c))[quarters % 4]


def _roots(**multiples: Fraction) -> Polynomial:
    """Return a sum of multiples of 1, sqrt(2), sqrt(3) and sqrt(6) = sqrt(2) sqrt(3)."""
    monomials = {
        "one": (),
        "two": (("sqrt(2)", 1),),
        "three": (("sqrt(3)", 1),),
        "six": (("sqrt(2)", 1), ("sqrt(3)", 1)),
    }
    return Polynomial({monomials[name]: multiple for name, multiple in multiples.items()})


_HALF, _QUARTER = Fraction(1, 2), Fraction(1, 4)
_FIRST_QUARTER: Final[Mapping[Rational, tuple[Polynomial, Polynomial]]] = {
    0: (ONE, ZERO),
    15: (_roots(six=_QUARTER, two=_QUARTER), _roots(six=_QUARTER, two=-_QUARTER)),
    30: (_roots(three=_HALF), _roots(one=_HALF)),
    45: (_roots(two=_HALF), _roots(two=_HALF)),
    60: (_roots(one=_HALF), _roots(three=_HALF)),
    75: (_roots(six=_QUARTER, two=-_QUARTER), _roots(six=_QUARTER, two=_QUARTER)),
}


def _kept(multiples: Mapping[_Key, Rational]) -> tuple[tuple[_Key, Rational], ...]:
    return tuple((key, simple(n)) for key, n in sorted(multiples.items()) if n)


def _added(left: Iterable[tuple[_Key, Rational]], right: Iterable[tuple[_Key, Rational]]) -> dict[_Key, Rational]:
    total = dict(left)
    for key, n in right:
        total[key] = total.get(key, 0) + n
    return total


def _signed(n: Rational) -> str:
    return "+" if n == 1 else "-" if n == -1 else f"{'+' if n > 0 else ''}{n}*"
