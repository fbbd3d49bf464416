"""Names that a robot file allows, and what could make a table simpler."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.importing.serial import joint_names, robot_name, simpler_with
from dh2sim.robot.fields import name_problem
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec


def test_names_that_are_allowed_stay() -> None:
    names = ("shoulder_pan_joint", "A-1", "joint_2")
    assert joint_names(names) == (names, [])


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("arm/joint.1", "arm_joint_1"),
        ("2nd joint", "n2nd_joint"),
        ("関節", "joint_1"),
        ("link_3-flange", "link_3-flange_"),
        ("x" * 200, "x" * 92),
    ],
)
def test_a_name_that_is_not_allowed_is_changed_and_noted(name: str, changed: str) -> None:
    names, notes = joint_names([name])
    assert names == (changed,)
    assert len(notes) == 1
    assert notes[0].endswith(f"is named {changed} here, as a robot file does not allow its name.")


def test_a_changed_name_is_not_one_that_is_taken() -> None:
    assert joint_names(["a.b", "a_b", "a/b"])[0] == ("a_b_2", "a_b", "a_b_3")


def test_a_joint_without_a_name_gets_the_default_one_in_silence() -> None:
    assert joint_names(["", "shoulder", ""]) == (("joint_1", "shoulder", "joint_3"), [])


@given(st.lists(st.text(max_size=8), min_size=1, max_size=8))
def test_whatever_the_names_they_end_up_allowed_and_different(names: list[str]) -> None:
    changed, _ = joint_names(names)
    assert len(set(changed)) == len(names)
    assert not any(name_problem(name) for name in changed)
    assert name_problem(robot_name(names[0])) is None


def test_a_robot_of_no_usable_name_is_a_robot() -> None:
    assert robot_name("???") == "robot"
    assert robot_name("UR5 (v2)") == "UR5_v2"


def _with_alpha(alpha: float) -> RobotSpec:
    spec = load_robot("stanford")
    return replace(spec, rows=(replace(spec.rows[0], alpha=alpha), *spec.rows[1:]))


def test_an_angle_that_looks_rounded_is_noted_with_the_tolerance_that_helps() -> None:
    assert simpler_with(_with_alpha(-1.5708), 1e-9) == (
        "Angles look rounded in the source: alpha of joint_1 is 3.7e-06 rad off a multiple of 15 degrees. "
        "A tolerance of 1e-04 makes such numbers simple, if a residual of that size is good enough."
    )


def test_right_odd_and_tolerated_angles_are_not_noted() -> None:
    for alpha, tolerance in ((math.pi / 2, 1e-9), (math.radians(37.3), 1e-9), (1.571, 1e-9), (1.5708, 1e-5)):
        assert simpler_with(_with_alpha(alpha), tolerance) is None


def test_the_small_twists_of_a_hayati_row_are_not_noted() -> None:
    spec = _with_alpha(3e-6)
    hayati = replace(spec.rows[0], convention=Convention.HAYATI, d=0.0, beta=-4e-6)
    assert simpler_with(replace(spec, rows=(hayati, *spec.rows[1:])), 1e-9) is None
