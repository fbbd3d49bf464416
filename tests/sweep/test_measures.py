from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dh2sim.model.build import build_model
from dh2sim.robot.links import PayloadSpec, ToolSpec
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.sweep.measures import MEASURES, Sampled, gravity_torques
from dh2sim.typing import read_only
from tests.kinematics.test_table_batch import spec as mixed

PLANAR = """
name: planar
convention: standard
gravity: [0, -9.81, 0]
joints:
  - {type: revolute, a: 0.5, limits: {position: [-3, 3], effort: 40}, link: {mass: 2, com: [-0.25, 0, 0]}}
  - {type: revolute, a: 0.3, limits: {position: [-2.5, 2.5], effort: 12}, link: {mass: 1, com: [-0.15, 0, 0]}}
"""


def test_weights_are_held_as_the_exact_sum_says() -> None:
    for robot in (mixed({}), load_robot("stanford"), load_robot("puma560")):
        model = build_model(replace(robot, gravity=read_only([1.0, -2.0, -9.0])))
        sampled = Sampled(model, 5, 0.1)
        found = gravity_torques(model, sampled.frames, sampled.q)
        wanted = [model.gravity_loads(q) for q in sampled.q]
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12 * max(1.0, np.abs(wanted).max()))


def test_the_payload_at_the_tool_brings_some_joint_to_its_effort_limit_and_none_beyond() -> None:
    spec = parse_robot(PLANAR)
    sampled = Sampled(build_model(spec), 400, 0.1)
    most = MEASURES["payload"](sampled)["payload"]
    loaded = replace(spec, tool=ToolSpec(mass=most), payload=PayloadSpec(mass=0.0))
    torques = np.abs([build_model(loaded).gravity_loads(q) for q in sampled.q])
    assert (torques / [40.0, 12.0]).max() == pytest.approx(1.0, abs=1e-9)
    # by hand, both arms level: 40 = g (2 · 0.25 + 1 · 0.65 + m · 0.8), 12 = g (0.15 + m · 0.3)
    level = min((40 / 9.81 - 1.15) / 0.8, (12 / 9.81 - 0.15) / 0.3)
    assert level < most < 1.05 * level


def test_an_arm_that_cannot_hold_itself_carries_nothing() -> None:
    weak = PLANAR.replace("effort: 12", "effort: 0.5")
    assert MEASURES["payload"](Sampled(build_model(parse_robot(weak)), 100, 0.1))["payload"] == 0.0


def test_reach_and_workspace_of_a_planar_arm_are_those_of_its_links() -> None:
    sampled = Sampled(build_model(parse_robot(PLANAR)), 20_000, 0.05)
    assert MEASURES["reach"](sampled)["reach"] == pytest.approx(0.8, abs=1e-12)
    ring = np.pi * (0.8**2 - (0.5**2 + 0.3**2 + 2 * 0.5 * 0.3 * np.cos(2.5)))  # the elbow does not fold entirely
    assert MEASURES["workspace"](sampled)["workspace"] == pytest.approx(ring * 0.05, rel=0.1)


def test_manipulability_is_yoshikawas() -> None:
    sampled = Sampled(build_model(mixed({})), 50, 0.1)
    J = sampled.jacobian
    w = np.sqrt(np.linalg.det(J.swapaxes(1, 2) @ J))
    found = MEASURES["manipulability"](sampled)
    assert found["manipulability_mean"] == pytest.approx(w.mean(), rel=1e-9)
    assert found["manipulability_best"] == pytest.approx(w.max(), rel=1e-9)
