"""Fixed rows of odd angles: one transform in numbers, equal to the rows."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import frame_pose
from dh2sim.robot.read import parse_robot
from dh2sim.symbolic.check import SampledConfigurations, check_form
from dh2sim.symbolic.form import used_letters
from dh2sim.symbolic.request import symbolic_form

ARM = """
name: arm
units: {angle: deg}
convention: %s
parameters: {phi: 33.3}
joints:
  - {type: revolute, a: 0.2, alpha: 90, d: 0.1}
  - {type: fixed, a: 0.13, alpha: 17.7, d: 0.31, theta: 33.1}
  - {type: fixed, a: 0.03, alpha: %s, d: 0.11, theta: -12.7}
  - {type: revolute, a: 0.2, alpha: 12.5, d: 0.1}
"""
ANGLES = st.sampled_from([0, 90, -90, 180, 37.3, -71.9, 0.001, 179.9999999])
LENGTHS = st.sampled_from([0, 0.3, -0.12, 1.7])
FIXED = st.fixed_dictionaries({"a": LENGTHS, "alpha": ANGLES, "d": LENGTHS, "theta": ANGLES})


@given(
    st.lists(FIXED, max_size=4), st.sampled_from(["standard", "modified"]), st.sampled_from(["revolute", "prismatic"])
)
def test_poses_of_all_frames_are_those_of_the_table(
    fixed: list[dict[str, float]], convention: str, last: str
) -> None:
    rows = "".join(
        f"  - {{type: fixed, a: {row['a']}, alpha: {row['alpha']}, d: {row['d']}, theta: {row['theta']}}}\n"
        for row in fixed
    )
    spec = parse_robot(
        f"name: arm\nunits: {{angle: deg}}\nconvention: {convention}\njoints:\n"
        f"  - {{type: revolute, a: 0.4, alpha: 21.4}}\n{rows}"
        f"  - {{type: {last}, a: 0.1, alpha: -8.3, limits: [0, 1]}}\n"
    )
    n = len(spec.rows)
    for source, target in (("base_link", "tool0"), ("tool0", "dh_0"), ("dh_1", f"dh_{n - 1}")):
        form = symbolic_form(spec, source=source, target=target).form
        sampled = SampledConfigurations(form.table, seed=4)
        chain = build_chain(spec)
        T = np.linalg.inv(frame_pose(chain, source, sampled.q)) @ frame_pose(chain, target, sampled.q)
        assert check_form(form, {form.equations[0].name: T}, sampled) <= 1e-13


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_fixed_rows_are_printed_as_their_common_normal(convention: str) -> None:
    form = symbolic_form(parse_robot(ARM % (convention, "-44.1")))
    assert {letter.name for letter in used_letters(form.form.table, form.form.atoms)} >= {
        "zeta_2", "xi_2", "psi_2", "u_2", "v_2", "w_2",
    }  # fmt: skip
    assert len(str(form).splitlines()) < 40
    assert not re.search(r"phi_[23]", str(form))


def test_parameters_and_letters_of_fixed_rows_stay() -> None:
    spec = parse_robot(ARM % ("standard", "phi"))
    assert "cos(phi)" in str(symbolic_form(spec))
    in_numbers = str(symbolic_form(spec, numbers=True))
    assert "xi_2" in in_numbers
    assert "phi)" not in in_numbers
    letters = str(symbolic_form(parse_robot(ARM % ("standard", "-44.1")), letters=True))
    assert "alpha_3" in letters
    assert "xi_2" not in letters
