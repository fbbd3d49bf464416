"""What is printed has the form that the course documents print: the same nesting, term by term."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import pytest

from dh2sim.symbolic.expression import Factor, Lengths, Style, Sum, Term
from dh2sim.symbolic.request import symbolic_form
from tests.robots.closed_forms import PARTS, ROBOTS, Form
from tests.sample_robots import robot as spec_of
from tests.symbolic.printed import printed_entries, same_form


class Case(NamedTuple):
    form: Form
    robot: str
    first: int
    last: int


CASES = {name: Case(form, name, 1, len(spec_of(name).rows)) for name, form in ROBOTS.items()} | {
    name: Case(*part) for name, part in PARTS.items()
}

AXIS_SUMS = {("ssrms", 0, 3), ("ssrms", 1, 3), ("ssrms", 2, 3)}
"""Entries that are written as sums over axes, 12*(c3 + c34)*c1*c2, which no order of angles gives."""

STYLES: dict[str, tuple[Style, Lengths | None]] = {
    "stanford": (Style.TOOL, None),
    "ssrms": (Style.TOOL, None),
    "cylindrical_wrist": (Style.EXPANDED, None),
}
"""What the document prints, where it is not nested from the base with lengths inside."""

BY_ENTRY = {
    ("stanford_shoulder_origin", 0, 3): (Style.EXPANDED, Lengths.FIRST),
    ("stanford_shoulder_origin", 1, 3): (Style.EXPANDED, Lengths.FIRST),
    ("stanford_shoulder_origin", 2, 3): (Style.BASE, Lengths.FIRST),
}
"""Positions that are written in another style than the rotation beside them."""


def entries(case: Case, style: Style, lengths: Lengths | None) -> list[tuple[Sum, ...]]:
    form = symbolic_form(
        spec_of(case.robot),
        source=f"dh_{case.first - 1}",
        target=f"dh_{case.last}",
        style=style,
        lengths=lengths,
        names=False,
    )
    return list(form.equations[0].entries[:3])


@pytest.mark.parametrize("name", CASES)
def test_entries_are_nested_as_the_document_prints_them(name: str) -> None:
    case = CASES[name]
    printed = printed_entries(case.form, case.first)
    for i, j in product(range(3), range(4)):
        if (name, i, j) in AXIS_SUMS:
            continue
        style, lengths = BY_ENTRY.get((name, i, j), STYLES.get(name, (Style.BASE, None)))
        assert same_form(printed[i][j], entries(case, style, lengths)[i][j]), f"entry {i + 1}, {j + 1}"


@pytest.mark.parametrize("name", CASES)
def test_every_entry_multiplied_out_has_the_terms_of_the_document(name: str) -> None:
    case = CASES[name]
    printed = printed_entries(case.form, case.first)
    ours = entries(case, Style.EXPANDED, None)
    for i, j in product(range(3), range(4)):
        assert same_form(Sum(tuple(multiplied_out(printed[i][j]))), ours[i][j]), f"entry {i + 1}, {j + 1}"


def multiplied_out(expression: Sum) -> list[Term]:
    terms = []
    for term in expression.terms:
        products = [Term(term.number)]
        for base, _ in term.factors:
            parts = multiplied_out(base) if isinstance(base, Sum) else [Term(1, (Factor(base),))]
            products = [Term(a.number * b.number, (*a.factors, *b.factors)) for a in products for b in parts]
        terms += products
    return terms
