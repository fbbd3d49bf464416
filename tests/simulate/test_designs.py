"""Rollouts of different designs: each is what its own table gives alone."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import xarray as xr

from dh2sim.errors import SettingsError
from dh2sim.formats.mjcf.write import MjcfOptions, to_mjcf
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import quaternion_from_rotation
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_actuators
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate import rollout
from tests.simulate import plain

FILE = """
name: arm
convention: {convention}
units: {{angle: deg, length: mm}}
parameters: {{reach: {reach}, half: reach / 2}}
joints:
  - {{type: revolute, a: half, alpha: {alpha}, d: 120, limits: {{position: [-150, 160], velocity: 200}}}}
  - {{type: revolute, a: reach, alpha: -7, theta: 20, flip: true, limits: {{position: [-140, 150]}}}}
  - {{type: prismatic, a: 30, alpha: 12.7, d: 40, limits: {{position: [0, 200], effort: {effort}}}}}
tool: {{xyz: [10, 20, 60], rpy: [5, -8, 11], mass: {mass}}}
configurations: {{home: [20, -30, 90]}}
"""
VARY = {
    "reach": "uniform:250:350",
    "alpha1": "normal:3",
    "joint_3.limits.effort": "0.2",
    "tool.mass": "loguniform:0.1:1",
}


def file(
    reach: float = 300, alpha: float = 37.3, effort: float = 60, mass: float = 0.4, *, of: str = "standard"
) -> str:
    return FILE.format(convention=of, reach=repr(reach), alpha=repr(alpha), effort=repr(effort), mass=repr(mass))


def model_of_rollout(run: xr.Dataset, i: int, convention: str) -> RobotModel:
    """The robot of a rollout, from a file with its numbers in it."""
    names = ("reach", "alpha1", "joint_3_limits_effort", "tool_mass")
    return build_model(parse_robot(file(*(float(run[name][i]) for name in names), of=convention)))


@pytest.mark.parametrize(
    ("convention", "controller", "start"),
    [("standard", "sine", "home"), ("modified", "tests.simulate.drivers:Spring", "random")],
)
def test_each_rollout_is_bit_for_bit_that_of_its_own_file_compiled_alone(
    convention: str, controller: str, start: str
) -> None:
    run = rollout(
        build_model(parse_robot(file(of=convention))),
        rollouts=5,
        steps=40,
        vary=VARY,
        controller=controller,
        start=start,
        seed=3,
    )
    assert len(np.unique(run.reach.values)) == len(np.unique(run.tool_mass.values)) == 5
    for i in range(5):
        robot = model_of_rollout(run, i, convention)
        text = to_mjcf(
            robot if controller == "sine" else with_actuators(robot, ActuatorType.MOTOR),
            MjcfOptions(integrator="implicitfast", sensors=True),
        )
        own = mujoco.MjModel.from_xml_string(text)
        control = plain.replayed(run) if controller == "sine" else plain.spring
        found = plain.track(own, run.qpos.values[i, 0], run.qvel.values[i, 0], control, 40, i)
        np.testing.assert_array_equal(run.qpos.values[i], found.qpos)
        np.testing.assert_array_equal(run.qvel.values[i], found.qvel)
        np.testing.assert_array_equal(run.tool_pose.values[i], found.tool_pose)
        T = table_tool_pose(robot.spec, run.qpos.values[i, 7])
        np.testing.assert_allclose(run.tool_pose.values[i, 7, :3], T[:3, 3], atol=1e-12)
        quaternion = quaternion_from_rotation(T[:3, :3])
        assert abs(np.dot(quaternion, run.tool_pose.values[i, 7, 3:])) == pytest.approx(1.0, abs=1e-12)


def test_a_design_that_is_no_robot_is_named_before_anything_runs() -> None:
    with pytest.raises(SettingsError, match=r"design 0 \(joint_1.link.mass=-1\): joints\[0\].link.mass: must not be"):
        rollout("planar_2r", rollouts=2, steps=2, vary={"joint_1.link.mass": "uniform:-1:-1"})
