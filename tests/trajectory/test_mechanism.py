"""Motions of mechanisms: the driven joints keep their limits, and the passive ones are where closed forms say."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from dh2sim import Robot
from dh2sim.errors import SettingsError, TrajectoryError
from dh2sim.kinematics.table_oracle import table_mechanism_frames
from dh2sim.model.mechanism import MechanismModel, build_mechanism
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.simulate import rollout
from dh2sim.trajectory.files import read_trajectory
from dh2sim.trajectory.mechanism import plan_mechanism_trajectory
from dh2sim.typing import Array
from tests.program import dh2sim
from tests.refusals import refusal

GROUND, CRANK, COUPLER, ROCKER = 2.0, 0.6, 1.8, 1.4
TEXT = Path("robots/mechanisms/four_bar.yaml").read_text(encoding="utf-8")


def _pin(crank: Array) -> Array:
    """Where the circles of coupler and rocker meet above the line through their centres, shape (N, 2)."""
    B = CRANK * np.stack([np.cos(crank), np.sin(crank)], axis=1)
    way = np.array([GROUND, 0.0]) - B
    distance = np.linalg.norm(way, axis=1)
    along = (distance**2 + COUPLER**2 - ROCKER**2) / (2.0 * distance)
    u = way / distance[:, None]
    up = np.sqrt(COUPLER**2 - along**2)[:, None] * np.stack([-u[:, 1], u[:, 0]], axis=1)
    return np.asarray(B + along[:, None] * u + up)


def _with(change: str) -> MechanismModel:
    """The four-bar with one text in place of another."""
    old, new = change.split(" -> ")
    assert old in TEXT
    return build_mechanism(parse_robot(TEXT.replace(old, new)))


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("trapezoid", "jerk")]


@pytest.mark.parametrize("profile", ["quintic", *SLOW])
def test_passive_joints_are_where_the_circles_of_coupler_and_rocker_meet(profile: str) -> None:
    model = build_mechanism(load_robot("four_bar"))
    planned = plan_mechanism_trajectory(model, ["home", [4.5]], profile=profile)
    motion = planned.sample(rate=20)
    C = _pin(motion.q[:, 0])
    rocker = np.arctan2(C[:, 1], C[:, 0] - GROUND)
    assert np.abs(np.exp(1j * motion.q[:, 2]) - np.exp(1j * rocker)).max() < 1e-12
    assert motion.q[-1, 0] == 4.5
    velocity = model.moving_joints[0].velocity
    assert (1.0 - 1e-3) * velocity < planned.peaks.rates[0, 0] <= velocity
    h = 1e-5
    between = np.linspace(0.1, 0.9, 5) * planned.duration
    (behind, _), (_, rates), (ahead, _) = (planned.all_joints(between + step) for step in (-h, 0.0, h))
    assert rates == pytest.approx((ahead - behind) / (2.0 * h), abs=1e-4)
    tool = np.array([table_mechanism_frames(model.spec, each)["tool0"][:3, 3] for each in motion.q[[0, -1]]])
    assert planned.tool_path(2) == pytest.approx(tool, abs=1e-12)


def test_many_turns_of_a_crank_are_those_of_the_first_one() -> None:
    """Also backwards, from a motion back and forth; progress is shown, and the passive joints are on the circles."""
    model = build_mechanism(load_robot("four_bar"))
    seen: dict[str, tuple[int, int]] = {}

    @contextmanager
    def stage(doing: str, _what: str, total: int) -> Iterator[Callable[[int], None]]:
        seen[doing] = (0, total)

        def advance(done: int) -> None:
            seen[doing] = (seen[doing][0] + done, total)

        yield advance

    planned = plan_mechanism_trajectory(model, ["home", [-60.0], [3.0]], stage=stage)
    assert set(seen) == {"planning", "following loops", "closing loops"}
    assert all(0 < done <= total for done, total in seen.values())
    times = np.linspace(0.0, planned.duration, 301)
    q, _ = planned.all_joints(times)
    C = _pin(q[:, 0])
    pin = CRANK * np.exp(1j * q[:, 0]) + COUPLER * np.exp(1j * (q[:, 0] + q[:, 1]))
    assert np.abs(pin - C @ [1, 1j]).max() < 1e-12
    assert np.abs(np.diff(q[:, 1] + q[:, 0])).max() < 1.0  # the coupler swings, and joint_2 turns back all the way
    assert q[:, 1].max() > 60.0 - 7.0


def test_two_cranks_that_turn_often_have_their_pin_where_their_circles_meet() -> None:
    text = Path("robots/mechanisms/five_bar.yaml").read_text(encoding="utf-8").replace("crank: 0.8", "crank: 0.2")
    model = build_mechanism(parse_robot(text.replace("revolute, a: crank, limits: [0, 180]", "continuous, a: crank")))
    planned = plan_mechanism_trajectory(model, ["home", [12.0, -9.0]])
    q, _ = planned.all_joints(np.linspace(0.0, planned.duration, 101))
    A, B = 0.2 * np.exp(1j * q[:, 0]), 1.0 + 0.2 * np.exp(1j * q[:, 2])
    E = 0.5 * (A + B) + 1j * (B - A) / np.abs(B - A) * np.sqrt(1.44 - 0.25 * np.abs(B - A) ** 2)
    assert np.abs(A + 1.2 * np.exp(1j * (q[:, 0] + q[:, 1])) - E).max() < 1e-12
    assert np.abs(B + 1.2 * np.exp(1j * (q[:, 2] + q[:, 3])) - E).max() < 1e-12
    far = refusal(TrajectoryError, plan_mechanism_trajectory, model, ["home", [1e7, 0.0]])
    assert far.startswith("the driven joints go too far: the loops would be closed at ")


def test_a_dead_position_on_the_way_refuses_the_motion() -> None:
    stuck = _with("crank: 0.6 -> crank: 1.6")
    message = refusal(TrajectoryError, plan_mechanism_trajectory, stuck, ["home", [3.1]])
    reached = math.radians(float(message.split("joint_1 = ")[1].split(" deg")[0]))
    assert math.dist((1.6 * math.cos(reached), 1.6 * math.sin(reached)), (2.0, 0.0)) == pytest.approx(3.2, abs=1e-3)


def test_limits_of_passive_joints_hold_too() -> None:
    """The rocker swings from 99.6 to 142.4 degrees, at up to 74.4 degrees a second."""
    rocker = "{type: revolute, a: rocker} -> {type: revolute, a: rocker, limits: "
    slow = plan_mechanism_trajectory(_with(f"{rocker}{{velocity: 30}}}}"), ["home", [3.49]])
    free = plan_mechanism_trajectory(build_mechanism(load_robot("four_bar")), ["home", [3.49]])
    assert slow.passive["rocker_joint_1"][2] <= math.radians(30)
    assert slow.duration == pytest.approx(free.duration * free.passive["rocker_joint_1"][2] / math.radians(30), 1e-3)
    times = np.linspace(0.0, slow.duration, 20_001)
    C = _pin(slow.at(times)[0][:, 0])
    angle = np.degrees(np.arctan2(C[:, 1], C[:, 0] - GROUND))
    assert np.abs(np.diff(angle)).max() / times[1] == pytest.approx(30.0, rel=5e-6)
    narrow = _with(f"{rocker}{{position: [0, {angle.max() - 1e-3}]}}}}")
    assert "leaves its limits" in refusal(TrajectoryError, plan_mechanism_trajectory, narrow, ["home", [3.49]])
    message = refusal(
        TrajectoryError,
        plan_mechanism_trajectory,
        _with(f"{rocker}{{position: [90, 130]}}}}"),
        ["home", [3.49]],
    )
    assert message.startswith("passive joint rocker_joint_1 leaves its limits of 90 to 130 deg at ")


def test_what_only_arms_can_do_is_refused_in_a_sentence() -> None:
    model = build_mechanism(load_robot("five_bar"))
    options = {"profile": "optimal", "kind": "line", "through": True, "limits": {"tool_speed": 1.0}}
    with pytest.raises(SettingsError) as caught:
        plan_mechanism_trajectory(model, ["home", "home"], **options)  # type: ignore[arg-type]
    assert [name for name, _ in caught.value.problems] == ["profile", "kind", "through", "limits"]
    message = refusal(TrajectoryError, plan_mechanism_trajectory, model, ["home", np.eye(4)])
    assert message == (
        "waypoint 2: a mechanism is moved by its driven joints; give the coordinates of joint_1, right_joint_1, or "
        "the name of a configuration"
    )
    loose = _with("actuated: [joint_1] -> actuated: []")
    assert "no driven joint" in refusal(TrajectoryError, plan_mechanism_trajectory, loose, ["home", "home"])
    other = _with("assembly: -> configurations: {crossed: [70, -130, -140]}\nassembly:")
    message = refusal(TrajectoryError, plan_mechanism_trajectory, other, ["home", "crossed"])
    assert message.startswith("waypoint 2: the driven joints lead to another assembly than configuration 'crossed'")


def test_a_rollout_and_a_page_play_what_the_command_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = dh2sim("trajectory", "four_bar", "home", "90", "-o", "motion.csv", "--duration", "0.6", "--rate", "50")
    assert done.status == 0, done.err
    assert "passive joint   unit" in done.out
    motion = read_trajectory("motion.csv")
    assert motion.joints == ("joint_1", "joint_2", "rocker_joint_1")
    planned = Robot.load("four_bar").trajectory(["home", [math.pi / 2]], duration=0.6)
    assert np.array_equal(motion.q, planned.sample(50).q)
    for controller in ("replay:motion.csv", "computed-torque:reference=motion.csv"):
        run = rollout("four_bar", rollouts=1, steps=300, controller=controller)
        assert np.abs(run["qpos"].values[0, -1] - motion.q[-1]).max() < 0.02
