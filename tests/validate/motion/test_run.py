"""All physics checks of a robot together."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings

from dh2sim import build_model
from dh2sim.errors import EngineError
from dh2sim.robot.row import Convention, JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.validate.motion import run as physics
from dh2sim.validate.motion.free_motion import compile_model
from dh2sim.validate.motion.run import check_motion
from tests.robot_files import snake
from tests.strategies import robot_specs
from tests.validate.motion.robots import LIFT, built, heavier

QUANTITIES = ["energy order", "momentum", "rest", "tracking", "inverse dynamics", "self-contact"]

NEARLY_CENTERED = RobotSpec(
    name="arm",
    convention=Convention.STANDARD,
    rows=(
        Row(name="A0", type=JointType.FIXED),
        Row(name="A1", type=JointType.PRISMATIC, alpha=math.pi, limits=Limits(position=(0.0, 0.05))),
        Row(name="A2", type=JointType.REVOLUTE, convention=Convention.HAYATI, a=0.4318, alpha=-1.58, beta=-2.83),
        Row(name="A3", type=JointType.CONTINUOUS, a=-6.1e-05),
    ),
)
"""The last link's centre of mass is 19 nm from the body's origin, and MuJoCo by itself takes it for the origin."""


@pytest.mark.slow
def test_every_check_is_made_and_the_same_seed_finds_the_same() -> None:
    first, again, other = (check_motion(built("scara"), seed=seed) for seed in (4, 4, 5))
    assert [check.quantity.value for check in first] == QUANTITIES
    assert {check.engine for check in first} == {"mujoco-rollout"}
    assert all(check.ok for check in first)
    assert all(check.seconds > 0.0 for check in first)
    assert first == again
    assert first != other


@pytest.mark.slow
@settings(
    max_examples=min(6, settings().max_examples),
    deadline=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
)
@given(robot_specs(max_rows=5))
@example(NEARLY_CENTERED)
def test_any_robot_moves_as_physics_has_it(spec: RobotSpec) -> None:
    """Motors may be too weak to be asked, since efforts are drawn at random."""
    checks = check_motion(build_model(replace(spec, name="arm")))
    assert [check for check in checks if check.ok is False] == []
    assert {check.quantity.value for check in checks if check.ok is None} <= {"rest", "tracking"}


def test_a_single_slide_passes_all_checks() -> None:
    assert [check.ok for check in check_motion(built(LIFT))] == [True] * 6


def test_a_robot_that_does_not_move_is_not_simulated() -> None:
    model = built("name: post\nconvention: standard\njoints:\n  - {type: fixed, a: 0.4}\n")
    checks = check_motion(model)
    assert [(check.ok, check.reason) for check in checks] == [
        (None, f"{quantity}: the robot has no joint that moves") for quantity in QUANTITIES
    ]


def test_a_very_long_chain_is_not_simulated() -> None:
    [check, *_] = check_motion(built(snake(61)))
    assert check.ok is None
    assert check.reason == "energy order: the table has 61 rows; at most 60 are simulated"


def test_a_model_that_mujoco_refuses_is_reported() -> None:
    model = heavier(built("planar_2r"), 0, 1e-30)
    with pytest.raises(EngineError, match=r"^MuJoCo refuses the model: .*mass and inertia") as raised:
        compile_model(model)
    check = next(check for check in check_motion(model) if check.quantity.value == "energy order")
    assert (check.ok, check.reason) == (None, f"energy order: {raised.value}")


def test_a_check_that_breaks_down_has_failed_and_the_others_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise KeyError("qpos")

    monkeypatch.setattr(physics, "check_rest", broken)
    checks = check_motion(built(LIFT))
    assert [check.ok for check in checks] == [True, True, False, True, True, True]
    assert checks[2].reason == "broke down: KeyError: 'qpos'"


def test_no_warning_of_mujoco_is_left_in_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Timesteps that are too long make some of the simulations unstable, of which MuJoCo warns."""
    monkeypatch.chdir(tmp_path)
    check_motion(built("puma560"), seed=1)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")
