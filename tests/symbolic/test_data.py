"""Forms as data: expressions that Python itself can evaluate."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest

from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.robot.read import parse_robot
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


def test_names_of_the_data_are_apart_from_parameters() -> None:
    file = """
name: x
convention: standard
parameters: {k1: 0.1, c1: 0.2, theta_1: 0.3, c_1: 0.4, d3: 0.5}
joints:
  - {type: revolute, a: k1, d: c1, alpha: 0.4}
  - {type: revolute, a: theta_1, d: c_1, alpha: 0.5}
  - {type: prismatic, d: d3, a: 0.2}
"""
    data = symbolic_form(parse_robot(file)).data()
    names = [*data["letters"], *data["cosines"], *data["sums"]]
    assert len(names) == len(set(names))
    assert "k_1" in data["sums"]
    assert not {"theta_1", "d3"} & {word for text in data["cosines"].values() for word in re.findall(r"\w+", text)}
