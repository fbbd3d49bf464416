"""The printed closed forms as expressions: read from the source text of tests/robots/closed_forms.py.

Only the order of terms and factors is left open: what is nested in the book is nested here.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from dh2sim.symbolic.angles import Angle, slide
from dh2sim.symbolic.expression import Factor, Sum, Term
from dh2sim.symbolic.polynomial import Rational, simple

Atoms = dict[str, Factor]


def printed_entries(function: Callable[..., Any], first: int = 1) -> list[list[Sum]]:
    """Return the upper three rows that a closed form returns.

    Args:
        function: Of closed_forms.
        first: Row of the table that its first coordinate belongs to.
    """
    (definition,) = ast.parse(inspect.getsource(function)).body
    assert isinstance(definition, ast.FunctionDef)
    coordinates = [argument.arg for argument in definition.args.args]
    joints = {name: first + k for k, name in enumerate(coordinates)}
    atoms = {name: Factor(slide(row)) for name, row in joints.items()}
    for statement in definition.body:
        if isinstance(statement, ast.Assign):
            atoms |= _cosines(statement, joints)
        elif isinstance(statement, ast.Return):
            assert isinstance(statement.value, ast.Call)
            return [
                [_sum(entry, atoms) for entry in row.elts]
                for row in statement.value.args
                if isinstance(row, ast.List)
            ]
    raise AssertionError("no matrix is returned")


def _cosines(statement: ast.Assign, joints: dict[str, int]) -> Atoms:
    """Read ``s1, c1, … = _sines_and_cosines(q1, …)``."""
    (target,), call = statement.targets, statement.value
    assert isinstance(target, ast.Tuple)
    assert isinstance(call, ast.Call)
    names = [name.id for name in target.elts if isinstance(name, ast.Name)]
    found: Atoms = {}
    for k, argument in enumerate(call.args):
        rows = sorted(joints[node.id] for node in ast.walk(argument) if isinstance(node, ast.Name))
        c, s = Angle.of(dict.fromkeys(rows, 1)).cos_sin()
        (sine,), (cosine,) = s.atoms, c.atoms
        found[names[2 * k]], found[names[2 * k + 1]] = Factor(sine), Factor(cosine)
    return found


def _sum(node: ast.expr, atoms: Atoms) -> Sum:
    match node:
        case ast.BinOp(left, ast.Add(), right):
            return Sum((*_sum(left, atoms).terms, *_sum(right, atoms).terms))
        case ast.BinOp(left, ast.Sub(), right):
            return Sum((*_sum(left, atoms).terms, *(-_sum(right, atoms)).terms))
        case ast.UnaryOp(ast.USub(), operand) if not isinstance(operand, ast.BinOp):
            return -_sum(operand, atoms)
        case _:
            term = _term(node, atoms)
            return Sum((term,)) if term.number else Sum()


def _term(node: ast.expr, atoms: Atoms) -> Term:
    match node:
        case ast.BinOp(left, ast.Mult(), right):
            one, other = _term(left, atoms), _term(right, atoms)
            return Term(simple(one.number * other.number), (*one.factors, *other.factors))
        case ast.UnaryOp(ast.USub(), operand):
            return -_term(operand, atoms)
        case ast.Constant(value):
            number: Rational = simple(Fraction(str(value)))
            return Term(number)
        case ast.Name(name):
            return Term(1, (atoms.get(name, Factor(name)),))
        case _:
            return Term(1, (Factor(_sum(node, atoms)),))


def same_form(printed: Sum, ours: Sum) -> bool:
    """Whether two expressions differ in the order of terms and factors at most."""
    return printed.key == ours.key
