"""The normal form of trigonometric sums."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.symbolic.angles import Angle, derivative_by, trig_of
from dh2sim.symbolic.harmonics import Harmonics, Runs, is_zero, reduced
from dh2sim.symbolic.polynomial import ONE, ROOTS, ZERO, Polynomial

ANGLES = [
    Angle.of({2: 1}),
    Angle.of({2: 1, 3: 1}),
    Angle.of({3: 1}, {"b": 1}),
    Angle.of({4: 1}),
    Angle.of({2: 1, 3: 1, 4: -1}, {}, 30),
    Angle.of({7: 1}),
    Angle.of({}, {"al": 1}),
]
COORDINATES = {2: 0.3, 3: -1.1, 4: 2.2, 7: 0.9}
LETTERS = {"b": 0.7, "al": -0.4, "x": 1.3, "y": -0.6}


def value(angle: Angle) -> float:
    return math.fsum(
        [
            *(float(n) * COORDINATES[row] for row, n in angle.coordinates),
            *(float(n) * LETTERS[name] for name, n in angle.names),
            math.radians(angle.degrees),
        ]
    )


def evaluated(polynomial: Polynomial) -> float:
    def atom_value(atom: str) -> float:
        trig = trig_of(atom)
        if trig is not None:
            return math.cos(value(trig.angle)) if trig.function == "cos" else math.sin(value(trig.angle))
        return math.sqrt(ROOTS[atom]) if atom in ROOTS else LETTERS[atom]

    return math.fsum(
        math.prod([float(number), *(atom_value(atom) ** power for atom, power in monomial)])
        for monomial, number in polynomial.terms.items()
    )


atoms = st.sampled_from(
    [p for angle in ANGLES for p in angle.cos_sin()] + [Polynomial.atom("x"), Polynomial.atom("y")]
)


@st.composite
def polynomials(draw: st.DrawFn) -> Polynomial:
    total = ZERO
    for _ in range(draw(st.integers(1, 3))):
        term = Polynomial.number(draw(st.integers(-3, 3)))
        for _ in range(draw(st.integers(0, 3))):
            term = term * draw(atoms)
        total = total + term
    return total


@given(polynomials(), polynomials())
def test_products_in_normal_form_are_products_in_every_way_of_writing_them(a: Polynomial, b: Polynomial) -> None:
    runs = Runs(a.atoms | b.atoms)
    normal = Harmonics.of(runs, a) * Harmonics.of(runs, b)
    for written in (normal.flat(), normal.as_polynomial(), reduced(a * b)):
        assert evaluated(written) == pytest.approx(evaluated(a) * evaluated(b), abs=1e-10)


@given(polynomials())
def test_derivatives_in_normal_form_are_those_of_the_polynomial(a: Polynomial) -> None:
    normal = Harmonics.of(Runs(a.atoms), a).derivative(3, "none").flat()
    assert evaluated(normal) == pytest.approx(evaluated(a.derivative(lambda atom: derivative_by(3, atom))), abs=1e-11)


c2, s2 = ANGLES[0].cos_sin()
c23, s23 = ANGLES[1].cos_sin()
c3, s3 = Angle.of({3: 1}).cos_sin()


@pytest.mark.parametrize(
    ("long", "short"),
    [
        (c2 * c2 + s2 * s2, ONE),
        (c23 * c2 + s23 * s2, c3),
        (s23 * c2 - c23 * s2, s3),
        (c2 * c23, c2 * c23),
        (c2 * c2, c2 * c2),
        (s2 * s2 - ONE, -c2 * c2),
    ],
)
def test_dependent_angles_are_combined_where_that_is_shorter(long: Polynomial, short: Polynomial) -> None:
    assert reduced(long) == short


def test_zero_is_recognized_whatever_it_is_written_as() -> None:
    assert is_zero(c23 * c2 + s23 * s2 - c3)
    assert not is_zero(c23 * c2 + s23 * s2 + c3)


def test_double_angles_come_back_as_textbooks_print_them() -> None:
    half = Polynomial.number(Fraction(1, 2))
    double = Angle.of({2: 2}).cos_sin()[0]
    normal = Harmonics.of(Runs((double + c2).atoms), half + half * double)
    assert normal.as_polynomial() == c2 * c2
