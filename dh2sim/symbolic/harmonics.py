"""Trigonometric sums in a normal form: products of cosines and sines of dependent angles turned into sums.

Coordinates that occur together in an angle, such as those of joints with parallel axes, make up a run. In the normal
form every term has at most one cosine or sine a run, of a whole combination of its coordinates: c2*c23 + s2*s23 is c3
here, and s4^2 + c4^2 is 1. Two expressions are equal only if their normal forms are. ``as_polynomial`` goes back to
products of the partial sums that textbooks print: cos(2 theta_2) becomes 2*c2^2 - 1.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from typing import Final, TypeAlias

from dh2sim.symbolic.angles import Angle, trig_of
from dh2sim.symbolic.polynomial import ONE, ZERO, Atom, Polynomial, Rational, simple

_COS, _SIN = 0, 1
Vector: TypeAlias = tuple[Rational, ...]
"""Multiples of the variables of a run."""
_Wave: TypeAlias = tuple[int, Vector] | None
"""A cosine or sine; None for 1."""
_Key: TypeAlias = tuple[_Wave, ...]
Variable: TypeAlias = int | str
"""A row's coordinate, a named angle, or '°'."""
_HALF: Final = Fraction(1, 2)


class Runs:
    """The runs of the angles that some atoms have."""

    def __init__(self, atoms: Iterable[Atom]) -> None:
        """Atoms that are neither cosines nor sines are letters."""
        angles = {trig.angle for trig in map(trig_of, atoms) if trig is not None}
        groups: list[set[Variable]] = []
        for angle in sorted(angles, key=str):
            merged: set[Variable] = {row for row, _ in angle.coordinates} or {name for name, _ in angle.names}
            for group in [group for group in groups if group & merged]:
                merged |= group
                groups.remove(group)
            groups.append(merged)
        self.variables: list[tuple[Variable, ...]] = []
        """Of each run: rows in order, then named angles, then '°' where degrees are left over."""
        for members in sorted(groups, key=lambda group: sorted(map(str, group))):
            rows = sorted(v for v in members if isinstance(v, int))
            own = [a for a in angles if any(v in members for v in _variables(a))]
            names = sorted({name for a in own for name, _ in a.names})
            degrees = ["°"] if any(a.degrees for a in own) else []
            self.variables.append((*rows, *names, *degrees))
        self._run: dict[Variable, int] = {}
        for k, run in enumerate(self.variables):
            turning = isinstance(run[0], int)
            self._run |= {v: k for v in run if isinstance(v, int) is turning and v != "°"}

    def wave(self, atom: Atom) -> tuple[int, int, Vector] | None:
        """Return run, function and vector of the atom of a cosine or sine; None for any other atom."""
        trig = trig_of(atom)
        if trig is None:
            return None
        run = self._run[next(_variables(trig.angle))]
        multiples: dict[Variable, Rational] = {**dict(trig.angle.coordinates), **dict(trig.angle.names)}
        multiples["°"] = trig.angle.degrees
        vector = tuple(multiples.get(v, 0) for v in self.variables[run])
        return run, _COS if trig.function == "cos" else _SIN, vector

    def angle(self, run: int, vector: Vector) -> Angle:
        """Return the angle that a vector of a run stands for."""
        pairs = list(zip(self.variables[run], vector, strict=True))
        return Angle.of(
            {v: n for v, n in pairs if isinstance(v, int)},
            {v: n for v, n in pairs if isinstance(v, str) and v != "°"},
            next((n for v, n in pairs if v == "°"), 0),
        )


def _variables(angle: Angle) -> Iterator[Variable]:
    yield from (row for row, _ in angle.coordinates)
    if not angle.coordinates:
        yield from (name for name, _ in angle.names)


class Harmonics:
    """A sum of waves with polynomials over letters as coefficients; immutable."""

    __slots__ = ("runs", "terms")

    def __init__(self, runs: Runs, terms: Mapping[_Key, Polynomial] | None = None) -> None:
        """``terms`` holds no zero."""
        self.runs = runs
        self.terms: Mapping[_Key, Polynomial] = {} if terms is None else terms

    @classmethod
    def of(cls, runs: Runs, polynomial: Polynomial) -> Harmonics:
        """Return the normal form of a polynomial."""
        terms: dict[_Key, Polynomial] = {}
        for monomial, number in polynomial.terms.items():
            letters = Polynomial({tuple(pair for pair in monomial if trig_of(pair[0]) is None): number})
            partial: dict[_Key, Polynomial] = {(None,) * len(runs.variables): letters}
            for atom, power in monomial:
                wave = runs.wave(atom)
                if wave is not None:
                    for _ in range(power):
                        partial = _times_wave(partial, *wave)
            for key, value in partial.items():
                _add(terms, key, value)
        return cls(runs, terms)

    def __bool__(self) -> bool:
        return bool(self.terms)

    def __eq__(self, other: object) -> bool:
        return self.terms == other.terms if isinstance(other, Harmonics) else NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def __add__(self, other: Harmonics) -> Harmonics:
        terms = dict(self.terms)
        for key, value in other.terms.items():
            _add(terms, key, value)
        return Harmonics(self.runs, terms)

    def __neg__(self) -> Harmonics:
        return Harmonics(self.runs, {key: -value for key, value in self.terms.items()})

    def __sub__(self, other: Harmonics) -> Harmonics:
        return self + -other

    def __mul__(self, other: Harmonics) -> Harmonics:
        terms: dict[_Key, Polynomial] = {}
        for left, one in self.terms.items():
            for right, another in other.terms.items():
                partial = {left: one * another}
                for run, wave in enumerate(right):
                    if wave is not None:
                        partial = _times_wave(partial, run, *wave)
                for key, value in partial.items():
                    _add(terms, key, value)
        return Harmonics(self.runs, terms)

    def times(self, factor: Polynomial) -> Harmonics:
        """Return a multiple; ``factor`` has no cosines or sines."""
        if not factor:
            return Harmonics(self.runs)
        return Harmonics(self.runs, {key: value * factor for key, value in self.terms.items()})

    def derivative(self, row: int, slide_atom: Atom) -> Harmonics:
        """Return the derivative by the coordinate of a row, which is ``slide_atom`` where the row slides."""
        terms: dict[_Key, Polynomial] = {}
        for key, value in self.terms.items():
            along = value.derivative(lambda atom: ONE if atom == slide_atom else ZERO)
            _add(terms, key, along)
            for run, wave in enumerate(key):
                if wave is None or row not in self.runs.variables[run]:
                    continue
                kind, vector = wave
                multiple = vector[self.runs.variables[run].index(row)]
                if multiple:
                    turned: _Wave = (_SIN if kind == _COS else _COS, vector)
                    sign = -1 if kind == _COS else 1
                    _add(terms, (*key[:run], turned, *key[run + 1 :]), value.scaled(sign * multiple))
        return Harmonics(self.runs, terms)

    def flat(self) -> Polynomial:
        """Return it as a polynomial with one cosine or sine a run and term."""
        result = ZERO
        for key, value in self.terms.items():
            product = value
            for run, wave in enumerate(key):
                if wave is not None:
                    product = product * self.runs.angle(run, wave[1]).cos_sin()[wave[0]]
            result = result + product
        return result

    def as_polynomial(self) -> Polynomial:
        """Return it as a polynomial in cosines and sines of partial sums of coordinates, as textbooks print it."""
        terms = {(key, ZERO_PRODUCT): value for key, value in self.terms.items()}
        for run, variables in enumerate(self.runs.variables):
            terms = _split_double_angles(terms, run, len([v for v in variables if isinstance(v, int)]))
        result = ZERO
        for (key, product), value in terms.items():
            polynomial = value
            for run, wave in enumerate(key):
                if wave is not None:
                    polynomial = polynomial * self.runs.angle(run, wave[1]).cos_sin()[wave[0]]
            for run, kind, vector in product:
                polynomial = polynomial * self.runs.angle(run, vector).cos_sin()[kind]
            result = result + polynomial
        return result


def reduced(polynomial: Polynomial) -> Polynomial:
    """Return a polynomial with dependent cosines and sines combined, if that makes it shorter."""
    if len(polynomial.terms) < 2:
        return polynomial
    normal = Harmonics.of(Runs(polynomial.atoms), polynomial)
    return min((polynomial, normal.flat(), normal.as_polynomial()), key=lambda p: (len(p.terms), _degree(p)))


def is_zero(polynomial: Polynomial) -> bool:
    """Whether a polynomial is zero at all configurations."""
    return not polynomial or not Harmonics.of(Runs(polynomial.atoms), polynomial)


def _degree(polynomial: Polynomial) -> int:
    return sum(power for monomial in polynomial.terms for _, power in monomial)


def _add(terms: dict[_Key, Polynomial], key: _Key, value: Polynomial) -> None:
    if not value:
        return
    total = terms[key] + value if key in terms else value
    if total:
        terms[key] = total
    else:
        del terms[key]


def _times_wave(terms: Mapping[_Key, Polynomial], run: int, kind: int, vector: Vector) -> dict[_Key, Polynomial]:
    """Multiply by a cosine or sine: product to sum within its run."""
    result: dict[_Key, Polynomial] = {}
    for key, value in terms.items():
        old = key[run]
        if old is None:
            _put(result, key, run, kind, vector, value)
            continue
        other, k = old
        plus = tuple(map(_plus, k, vector))
        minus = tuple(map(_minus, k, vector))
        half = value.scaled(_HALF)
        if other == _COS and kind == _COS:
            _put(result, key, run, _COS, minus, half)
            _put(result, key, run, _COS, plus, half)
        elif other == _SIN and kind == _SIN:
            _put(result, key, run, _COS, minus, half)
            _put(result, key, run, _COS, plus, -half)
        elif other == _SIN:
            _put(result, key, run, _SIN, plus, half)
            _put(result, key, run, _SIN, minus, half)
        else:
            _put(result, key, run, _SIN, plus, half)
            _put(result, key, run, _SIN, minus, -half)
    return result


def _plus(a: Rational, b: Rational) -> Rational:
    return a + b


def _minus(a: Rational, b: Rational) -> Rational:
    return a - b


def _put(terms: dict[_Key, Polynomial], key: _Key, run: int, kind: int, vector: Vector, value: Polynomial) -> None:
    """Add a wave whose first multiple is made positive."""
    first = next((n for n in vector if n), 0)
    if first == 0:
        if kind == _SIN:
            return
        wave: _Wave = None
    else:
        if first < 0:
            vector = tuple(-n for n in vector)
            if kind == _SIN:
                value = -value
        wave = (kind, vector)
    _add(terms, (*key[:run], wave, *key[run + 1 :]), value)


# ---------------------------------------------------------------------------- back to products

_Product: TypeAlias = tuple[tuple[int, int, Vector], ...]
"""Cosines and sines that were split off: run, function, vector."""
ZERO_PRODUCT: Final[_Product] = ()
_Split: TypeAlias = dict[tuple[_Key, _Product], Polynomial]


def _split_double_angles(terms: _Split, run: int, rows: int) -> _Split:
    """Exchange waves of sums of two partial sums for products: c(2*2+3) + c3 becomes 2*c2*c23.

    Args:
        terms: What there is; waves of this run may be split.
        run: The run.
        rows: How many variables of the run are coordinates.
    """
    result = dict(terms)
    doubles = sorted(
        (entry for entry in terms if (wave := entry[0][run]) is not None and max(wave[1][:rows], default=0) > 1),
        key=lambda entry: (entry[0][run], str(entry)),
    )
    for key, product in doubles:
        wave = key[run]
        assert wave is not None
        kind, vector = wave
        parts = _two_parts(vector, rows)
        if parts is None:
            continue
        value = result.pop((key, product), ZERO)
        if not value:
            continue
        low, high = parts
        difference = tuple(map(_minus, high, low))
        rest: dict[_Key, Polynomial] = {}
        _put(rest, key, run, kind, difference, ONE)
        there = next(iter(rest), None)
        sign = rest[there].constant if there is not None else 0
        before = result.get((there, product), ZERO) if there is not None else ZERO
        if kind == _COS:  # c(l + h) = 2 cl ch - c(h - l) = c(h - l) - 2 sl sh
            as_sines = before == -value
            factors = ((run, _SIN, low), (run, _SIN, high)) if as_sines else ((run, _COS, low), (run, _COS, high))
            _gather(result, _without(key, run), (*product, *factors), value.scaled(-2 if as_sines else 2))
            assert there is not None
            _gather(result, there, product, value if as_sines else -value)
        else:  # s(l + h) = 2 sl ch + s(h - l) = 2 cl sh - s(h - l)
            other = there is not None and sign is not None and before.scaled(sign) == value
            factors = ((run, _COS, low), (run, _SIN, high)) if other else ((run, _SIN, low), (run, _COS, high))
            _gather(result, _without(key, run), (*product, *factors), value.scaled(2))
            if there is not None and sign:
                _gather(result, there, product, value.scaled(-sign if other else sign))
    return result


def _without(key: _Key, run: int) -> _Key:
    return (*key[:run], None, *key[run + 1 :])


def _gather(terms: _Split, key: _Key, product: _Product, value: Polynomial) -> None:
    place = (key, product)
    total = terms.get(place, ZERO) + value
    if total:
        terms[place] = total
    else:
        terms.pop(place, None)


def _two_parts(vector: Vector, rows: int) -> tuple[Vector, Vector] | None:
    """Return two partial sums of coordinates that add up to a vector, the shorter one first.

    Named angles and degrees belong to the row before which they come in a partial sum; they are split evenly where
    both sums are the same, and otherwise not at all.
    """
    multiples = vector[:rows]
    if any(n not in (0, 1, 2) for n in multiples):
        return None
    low = tuple(1 if n == 2 else 0 for n in multiples)
    high = tuple(1 if n else 0 for n in multiples)
    constants = vector[rows:]
    if any(constants):
        if low != high:
            return None
        half = tuple(simple(Fraction(n) / 2) for n in constants)
        return (*low, *half), (*high, *half)
    zeros = (0,) * len(constants)
    return (*low, *zeros), (*high, *zeros)
