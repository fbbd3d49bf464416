"""What could make a table simpler."""

from __future__ import annotations

import math
from dataclasses import replace

from dh2sim.importing.serial import simpler_with
from dh2sim.robot.read import load_robot
from dh2sim.robot.spec import Convention, RobotSpec


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
