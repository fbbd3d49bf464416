"""Equations of motion as textbooks print them, equal to those of a numeric library of rigid bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim import Robot
from dh2sim.errors import Dh2simError, MismatchError
from dh2sim.model.build import build_model
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.symbolic import dynamics
from dh2sim.symbolic.angles import rate
from dh2sim.symbolic.check import SampledConfigurations
from dh2sim.symbolic.expression import evaluated
from dh2sim.symbolic.request import symbolic_form
from tests.sample_robots import robot as spec_of
from tests.strategies import robot_specs

PLANAR = parse_robot(
    """
name: planar
convention: standard
gravity: [0, -9.81, 0]
parameters: {l1: 1.0, l2: 0.7}
joints: [{type: revolute, a: l1}, {type: revolute, a: l2}]
"""
)
ELBOW = parse_robot(
    """
name: elbow
convention: standard
units: {angle: deg}
parameters: {d1: 0.5, l2: 0.4, l3: 0.3}
joints: [{type: revolute, d: d1, alpha: 90}, {type: revolute, a: l2}, {type: revolute, a: l3}]
"""
)


def lines(spec: RobotSpec, **options: Any) -> list[str]:
    text = str(symbolic_form(spec, "dynamics", letters=True, names=False, **options))
    return [" ".join(line.split()) for line in text.splitlines()]


def entries(spec: RobotSpec) -> dict[str, str]:
    data = symbolic_form(spec, "dynamics", letters=True, names=False).data()
    return {
        f"{equation['name']}{i}{j}": entry
        for equation in data["equations"]
        for i, row in enumerate(equation["entries"], start=1)
        for j, entry in enumerate(row, start=1)
    }


def test_two_links_in_a_vertical_plane_have_the_textbooks_equations() -> None:
    found = entries(PLANAR)
    assert found["M11"] == "lc1**2*m1 + m2*(l1**2 + 2*l1*lc2*c2 + lc2**2) + I1 + I2"
    assert found["M12"] == found["M21"] == "m2*(l1*lc2*c2 + lc2**2) + I2"
    assert found["M22"] == "lc2**2*m2 + I2"
    assert found["C11"] == "-l1*lc2*m2*s2*dtheta_2"
    assert found["C21"] == "l1*lc2*m2*s2*dtheta_1"
    assert found["C22"] == "0"
    assert found["g11"] == "g*(lc1*m1*c1 + m2*(l1*c1 + lc2*c12))"
    assert found["g21"] == "g*lc2*m2*c12"


def test_an_elbow_arm_has_squares_where_textbooks_have_them() -> None:
    found = entries(ELBOW)
    assert found["M11"] == (
        "lc2**2*m2*c2**2 + m3*(l2*c2 + lc3*c23)**2 + I1 + Ixx2*s2**2 + Ixx3*s23**2 + Iyy2*c2**2 + Iyy3*c23**2"
    )
    assert found["M12"] == "0"
    assert found["M23"] == "m3*(l2*lc3*c3 + lc3**2) + Izz3"


@pytest.mark.parametrize("name", ["planar_2r", "rpr", "cylindrical", "spherical_wrist", "scara"])
def test_numbers_of_the_model_give_the_torques_of_mujoco(name: str) -> None:
    import mujoco

    arm = Robot.load(name)
    form = arm.symbolic("dynamics").form
    model = arm.mjmodel()
    data = mujoco.MjData(model)
    random = np.random.default_rng(6)
    q, qd, qdd = (random.uniform(-0.5, 0.5, (3, arm.n)) for _ in range(3))
    configurations = SampledConfigurations(form.table, q=q)
    values = configurations.values(form.atoms)
    values |= {rate(i): qd[:, k] for k, i in enumerate(form.table.moving)}
    M, C, g = (
        np.stack([np.broadcast_to(v, 3) for v in evaluated(e.flat, form.named, values)], axis=1).reshape(
            3, len(e.entries), -1
        )
        for e in form.equations
    )
    for k in range(3):
        tau = M[k] @ qdd[k] + C[k] @ qd[k] + g[k, :, 0]
        data.qpos, data.qvel, data.qacc = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(model, data)
        passive = data.qfrc_passive + data.qfrc_constraint
        armature = model.dof_armature * qdd[k]
        friction = data.qfrc_inverse + passive - armature
        assert tau == pytest.approx(friction, abs=1e-9 * max(1.0, float(np.abs(tau).max())))


@settings(max_examples=15)
@given(robot_specs(max_rows=2), st.booleans())
def test_equations_of_any_two_rows_pass_their_check(spec: RobotSpec, letters: bool) -> None:
    form = symbolic_form(spec if letters else build_model(spec), "dynamics", letters=letters)
    assert len(form.equations) == 3


def test_a_wrong_coriolis_term_would_be_found(monkeypatch: pytest.MonkeyPatch) -> None:
    right = dynamics._coriolis_matrix

    def wrong(table: Any, M: Any) -> Any:
        C = right(table, M)
        C[0][1] = C[0][1] + C[1][0]
        return C

    monkeypatch.setattr(dynamics, "_coriolis_matrix", wrong)
    with pytest.raises(MismatchError, match="planar: C in symbols differs"):
        symbolic_form(PLANAR, "dynamics", letters=True)


def test_an_arm_in_a_horizontal_plane_feels_no_gravity() -> None:
    assert "Gravity does no work on this arm." in lines(spec_of("planar_2r"))


def test_four_joints_come_with_a_note_and_more_are_refused() -> None:
    assert "Four joints are the most that is printed" in " ".join(lines(spec_of("scara")))
    with pytest.raises(
        Dh2simError, match="arm_5r: has 5 joints that move; equations of motion are printed for 1 to 4"
    ):
        lines(spec_of("arm_5r"))


def test_numbers_need_bodies() -> None:
    with pytest.raises(Dh2simError, match="dynamics in numbers needs a Robot or a RobotModel; pass letters=True"):
        symbolic_form(PLANAR, "dynamics")


def test_a_slide_moves_a_mass_at_its_frame() -> None:
    found = entries(spec_of("cylindrical"))
    assert found["M22"] == "m2 + m3"
    assert found["g21"] == "g*(m2 + m3)"


def test_millimetres_are_the_unit_of_the_equations() -> None:
    file = "{name: x, convention: standard, gravity: [0, -9.81, 0], units: {length: mm}, parameters: {l1: 500}, "
    spec = parse_robot(file + "joints: [{type: revolute, a: l1}, {type: prismatic, d: 20}]}")
    text = str(symbolic_form(spec, "dynamics", letters=True))
    assert "g = 9810 mm/s²" in text
    assert "Lengths are in mm: M is in kg mm^2 between turning joints." in text
    assert "kg mm^2" in str(symbolic_form(build_model(spec), "dynamics"))
