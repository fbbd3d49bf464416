"""Poses in symbols against sympy's product of the table's matrices, to 40 digits."""

from __future__ import annotations

from typing import Any

import pytest

from dh2sim.symbolic.request import symbolic_form
from dh2sim.symbolic.table import Fold
from tests.sample_robots import NAMES
from tests.sample_robots import robot as spec_of

pytestmark = pytest.mark.slow

LETTERED = [name for name in NAMES if spec_of(name).parameters and name != "so101"]
"""Robots with parameters whose angles are exact; an odd offset of so101 has a value of its own."""


@pytest.mark.parametrize("fold", list(Fold))
@pytest.mark.parametrize("name", LETTERED)
def test_pose_is_sympys_for_any_values_of_the_letters(name: str, fold: Fold) -> None:
    sp: Any = pytest.importorskip("sympy")
    spec = spec_of(name)
    form = symbolic_form(spec, source="dh_0", target=f"dh_{len(spec.rows)}", fold=fold)
    data = form.data()
    values = {sp.Symbol(letter): sp.Rational(7 * k + 3, 11) for k, letter in enumerate(data["letters"])}
    T = sp.eye(4)
    symbols: dict[str, Any] = {}
    for i, row in enumerate(spec.rows, start=1):
        q = sp.Symbol(f"theta_{i}" if row.type.turns else f"d{i}")
        symbols[q.name] = q
        assert spec.source_file is not None
        cells = _cells(spec.source_file.text, i - 1)
        a, d, alpha, theta = (_exact(sp, cells.get(key, 0), spec) for key in ("a", "d", "alpha", "theta"))
        alpha, theta = (_angle(sp, value, spec) for value in (alpha, theta))
        sign = -1 if row.flip else 1
        theta, d = (theta + sign * q, d) if row.type.turns else (theta, d + sign * q)
        Rz = sp.diag(_rotation(sp, theta), sp.eye(2))
        Rz[2, 3] = d
        Rx = sp.diag(1, _rotation(sp, alpha), 1)
        Rx[0, 3] = a
        T = T * Rz * Rx if row.convention == "standard" else T * Rx * Rz
    point = {symbol: sp.Rational(3 * k - 5, 7) for k, symbol in enumerate(symbols.values())}
    names = {letter: sp.Symbol(letter) for letter in data["letters"]} | symbols | {"cos": sp.cos, "sin": sp.sin}
    for cosine, text in data["cosines"].items():
        names[cosine] = sp.sympify(text.replace("°", "*pi/180"), locals=dict(names))
    for sum_, text in data["sums"].items():
        names[sum_] = sp.sympify(text, locals=dict(names), rational=True)
    for ours, theirs in zip(data["equations"][0]["entries"], T.tolist(), strict=True):
        for one, other in zip(ours, theirs, strict=True):
            mine = sp.sympify(one, locals=dict(names), rational=True)
            difference = (mine - other).subs(values).subs(point)
            assert abs(sp.N(difference, 50)) < sp.Float("1e-40")


def _rotation(sp: Any, angle: Any) -> Any:
    return sp.Matrix([[sp.cos(angle), -sp.sin(angle)], [sp.sin(angle), sp.cos(angle)]])


def _cells(text: str, index: int) -> dict[str, Any]:
    from ruamel.yaml import YAML

    joints: list[dict[str, Any]] = YAML(typ="safe").load(text)["joints"]
    return joints[index]


def _exact(sp: Any, value: object, spec: Any) -> Any:
    return sp.sympify(str(value), locals={name: sp.Symbol(name) for name in spec.parameters}, rational=True)


def _angle(sp: Any, value: Any, spec: Any) -> Any:
    return value * sp.pi / 180 if spec.units.angle == "deg" else value
