"""Where rollouts start."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import mujoco
import numpy as np
import pytest

from dh2sim.errors import SettingsError
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.row import Limits
from dh2sim.simulate import rollout
from dh2sim.simulate.randomization import Purpose, generator
from dh2sim.typing import Array, read_only
from tests.sample_robots import NAMES, model
from tests.simulate import robots


def first(robot: RobotModel, start: str, rollouts: int = 4, **how: object) -> Array:
    """Joint positions at the start; velocities are zero."""
    run = rollout(robot, rollouts=rollouts, steps=1, start=start, controller="passive", **how)  # type: ignore[arg-type]
    assert not run.qvel.values[:, 0].any()
    assert run.attrs["settings"]["start"] == start
    q: Array = run.qpos.values[:, 0]
    return q


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
def test_home_is_that_of_the_robot(floating: bool) -> None:
    found = first(model("odd"), "home", floating_base=floating)
    assert np.array_equal(found, np.tile([0.4, 0.2, -2.5, 0.3, 1.1], (4, 1)))


def test_zero_is_zero() -> None:
    assert not first(model("odd"), "zero").any()


def test_zero_is_that_of_the_robot_file_if_it_has_one() -> None:
    spec = replace(robots.arm().spec, configurations={"zero": read_only([0.25, -0.5])})
    assert np.array_equal(first(build_model(spec), "zero"), np.tile([0.25, -0.5], (4, 1)))


def test_a_configuration_of_the_robot_file_has_its_name() -> None:
    assert np.array_equal(first(robots.worm(), "curled"), np.tile([0.3, 1.2, 1.5, -1.7, 0.9], (4, 1)))


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_random_starts_are_inside_the_limits_and_nothing_touches(name: str) -> None:
    run = rollout(model(name), rollouts=40, steps=1, start="random", controller="passive")
    compiled = mujoco.MjModel.from_xml_string(run.attrs["mjcf"])
    data = mujoco.MjData(compiled)
    q = run.qpos.values[:, 0]
    assert (q >= run.joint_lower.values).all()
    assert (q <= run.joint_upper.values).all()
    for one in q:
        data.qpos[:] = one
        mujoco.mj_forward(compiled, data)
        assert data.ncon == 0
    assert len(np.unique(q, axis=0)) == 40


def test_a_random_start_is_the_first_draw_in_which_nothing_touches() -> None:
    run = rollout(robots.worm(), rollouts=30, steps=1, start="random", seed=3, controller="passive")
    compiled = mujoco.MjModel.from_xml_string(run.attrs["mjcf"])
    data = mujoco.MjData(compiled)
    again = 0
    for i in range(30):
        source = generator(3, i, Purpose.START)
        while True:
            data.qpos[:] = source.uniform([-2.9] * 5, [2.9] * 5)
            mujoco.mj_forward(compiled, data)
            if not data.ncon:
                break
            again += 1
        assert np.array_equal(run.qpos.values[i, 0], data.qpos)
    assert again > 0


def test_a_joint_without_limits_starts_anywhere_within_half_a_turn() -> None:
    spec = robots.arm().spec
    free = build_model(replace(spec, rows=(replace(spec.rows[0], limits=Limits()), spec.rows[1])))
    q = first(free, "random", 500)[:, 0]
    assert np.abs(q).max() <= np.pi
    assert q.max() > 0.95 * np.pi
    assert q.min() < -0.95 * np.pi


def test_a_start_outside_the_limits_is_refused() -> None:
    spec = robots.arm().spec
    rows = (replace(spec.rows[0], limits=Limits(position=(0.25, 1.5))), spec.rows[1])
    configurations = {"home": read_only([1.0, 0.0])}
    robot = build_model(replace(spec, rows=rows, configurations=MappingProxyType(configurations)))
    with pytest.raises(SettingsError) as caught:
        first(robot, "zero")
    assert str(caught.value) == "start zero: joint_1 would start at 0 rad, outside its limits 0.25 to 1.5 rad"


def test_a_floating_base_starts_at_the_origin_and_still() -> None:
    run = rollout(robots.worm(), rollouts=3, steps=1, start="random", floating_base=True)
    assert np.array_equal(run.base_pose.values[:, 0], np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (3, 1)))
    assert not run.base_twist.values[:, 0].any()
