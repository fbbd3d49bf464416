"""Forms as plain data for programs: expressions as text in Python's grammar, and what their names stand for."""

from __future__ import annotations

import math
from typing import Any

from dh2sim.symbolic.angles import Angle
from dh2sim.symbolic.form import Form, moving_angles, used_letters
from dh2sim.symbolic.notation import written
from dh2sim.symbolic.polynomial import Atom
from dh2sim.symbolic.text import TextNotation


class _DataNotation(TextNotation):
    """Writes every name as an identifier, and powers with ``**``."""

    _in_full = True

    def __init__(self, form: Form) -> None:
        super().__init__(form.table, form.joint_names)
        self._angles = moving_angles(form.atoms)
        self._sum = "k"
        while any(name.startswith(self._sum) for name in form.table.letters):
            self._sum += "_"

    def atom(self, atom: Atom) -> str:
        return f"{self._sum}{atom[1:]}" if atom.startswith("#") else super().atom(atom)

    def short(self, letter: str, angle: Angle) -> str:
        name = super().short(letter, angle)
        if name.isidentifier():
            return name
        name = f"{letter}_{self._angles.index(angle) + 1}"
        while name in self._taken:
            name += "_"
        return name

    def power(self, base: str, exponent: int) -> str:
        return f"{base}**{exponent}"


def form_data(form: Form) -> dict[str, Any]:
    """Return a form as mappings, lists, texts and numbers, ready for JSON."""
    notation = _DataNotation(form)
    cosines = {
        notation.short(function[0], angle): f"{function}({notation.angle(angle)})"
        for angle in moving_angles(form.atoms)
        for function in ("cos", "sin")
    }
    return {
        "robot": form.table.spec.name,
        "what": form.what,
        "units": {"length": form.table.unit.value, "angle": "rad"},
        "equations": [
            {
                "name": equation.name,
                "meaning": equation.meaning,
                "entries": [[written(entry, notation) for entry in row] for row in equation.entries],
            }
            for equation in form.equations
        ],
        "sums": {notation.atom(name): written(sum_, notation) for name, sum_ in form.named.items()},
        "cosines": cosines,
        "letters": {
            letter.name: {
                "value": None if math.isnan(letter.value) else letter.value,
                "kind": letter.kind,
                "definition": letter.definition,
            }
            for letter in used_letters(form.table, form.atoms)
        },
        "singular": [
            {
                "zero": written(condition.expression, notation),
                "name": condition.name,
                "angle": None if condition.angle is None else notation.angle(condition.angle),
                "degrees": list(condition.degrees),
            }
            for condition in form.conditions
        ],
        "notes": list(form.notes),
        "error": form.error,
    }
