"""Forms as data: expressions that Python itself can evaluate."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.symbolic.request import symbolic_form
from tests.sample_robots import NAMES
from tests.sample_robots import robot as spec_of


@pytest.mark.parametrize("name", NAMES)
def test_expressions_of_the_data_evaluate_to_the_pose(name: str) -> None:
    spec = spec_of(name)
    data = json.loads(json.dumps(symbolic_form(spec).data()))
    q = np.random.default_rng(5).uniform(-1.0, 1.0, len(spec.moving_rows))
    names: dict[str, object] = {"sqrt": math.sqrt, "cos": math.cos, "sin": math.sin}
    names |= {letter: about["value"] for letter, about in data["letters"].items()}
    moving = [i for i, row in enumerate(spec.rows, start=1) if row.type.moves]
    for i, value in zip(moving, q.tolist(), strict=True):
        names[f"theta_{i}" if spec.rows[i - 1].type.turns else f"d{i}"] = value
    for cosine, text in data["cosines"].items():
        names[cosine] = eval(text.replace("°", "*0.017453292519943295"), {}, names)
    for sum_, text in data["sums"].items():
        names[sum_] = eval(text, {}, names)
    found = [[eval(entry, {}, names) for entry in row] for row in data["equations"][0]["entries"]]
    assert found == pytest.approx(forward_kinematics(build_chain(spec), q), abs=1e-12)


def test_data_of_a_jacobian_says_where_it_is_singular() -> None:
    data = symbolic_form(spec_of("puma560"), "jacobian").data()
    assert data["what"] == "jacobian"
    assert 0.0 < data["error"] <= 1e-13
    assert data["units"] == {"length": "m", "angle": "rad"}
    assert data["singular"][0] == {"zero": "s5", "name": "wrist", "angle": "theta_5", "degrees": [0.0, 180.0]}
    assert data["letters"]["a2"] == {"value": 0.4318, "kind": "length", "definition": ""}
