"""How a robot is simulated, as far as its MJCF says so."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dh2sim.formats.mjcf.elements import MjcfOptions
from dh2sim.formats.mjcf.write import EXPORTED, to_mjcf
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.variants import with_base_mass
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.formats.readers import parsed
from tests.sample_robots import NAMES, in_limits, model
from tests.strategies import robot_specs

TINY = RobotSpec(
    name="tiny", rows=(Row(name="j", type=JointType.REVOLUTE, convention=Convention.STANDARD, d=6.1e-05),)
)
"""A base of this size has less inertia than MuJoCo accepts, unless it gets the same lower bound as other links."""


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_defaults_are_the_exported_file_byte_for_byte(name: str) -> None:
    assert to_mjcf(model(name), MjcfOptions()) == to_mjcf(model(name)) == to_mjcf(model(name), EXPORTED)
    option = parsed(to_mjcf(model(name))).find("option")
    assert option is not None
    assert set(option.attrib) == {"timestep", "integrator", "gravity"}
    assert list(option) == []


def test_the_mass_of_the_base_changes_nothing_of_a_base_that_is_fixed() -> None:
    assert to_mjcf(with_base_mass(model("odd"))) == to_mjcf(model("odd"))


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("Euler", mujoco.mjtIntegrator.mjINT_EULER),
        ("RK4", mujoco.mjtIntegrator.mjINT_RK4),
        ("implicit", mujoco.mjtIntegrator.mjINT_IMPLICIT),
        ("implicitfast", mujoco.mjtIntegrator.mjINT_IMPLICITFAST),
    ],
)
def test_the_integrator_reaches_mujoco(name: str, number: int) -> None:
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(model("odd"), MjcfOptions(integrator=name)))
    assert compiled.opt.integrator == number


@settings(max_examples=min(50, settings().max_examples))
@given(st.floats(1e-12, 1.0))
def test_the_timestep_reaches_mujoco_as_the_same_double(timestep: float) -> None:
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(model("planar_2r"), MjcfOptions(timestep=timestep)))
    assert compiled.opt.timestep == timestep


@pytest.mark.parametrize("energy", [False, True])
def test_energy_is_computed_on_request(energy: bool) -> None:
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(model("stanford"), MjcfOptions(energy=energy)))
    data = mujoco.MjData(compiled)
    data.qvel[:] = 1.0
    mujoco.mj_forward(compiled, data)
    assert bool(data.energy.all()) == energy


def floating(name: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(to_mjcf(with_base_mass(model(name)), MjcfOptions(floating_base=True)))


def sites(compiled: mujoco.MjModel, qpos: Array) -> dict[str, Array]:
    """Poses of the sites in the world."""
    data = mujoco.MjData(compiled)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(compiled, data)
    poses = {}
    for i in range(compiled.nsite):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = data.site_xmat[i].reshape(3, 3), data.site_xpos[i]
        poses[compiled.site(i).name] = T
    return poses


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_frames_on_a_floating_base_are_those_of_the_table_wherever_it_is(name: str) -> None:
    robot, compiled = model(name), floating(name)
    quaternion = np.array([0.5, -0.1, 0.7, 0.3])
    quaternion /= np.linalg.norm(quaternion)
    T_world_base = np.eye(4)
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, quaternion)
    T_world_base[:3, :3], T_world_base[:3, 3] = rotation.reshape(3, 3), [0.3, -2.0, 1.1]
    for q in in_limits(robot, 5, seed=2):
        found = sites(compiled, np.concatenate([T_world_base[:3, 3], quaternion, q]))
        for i, T in enumerate(table_frame_poses(robot.spec, q)):
            np.testing.assert_allclose(found[f"dh_{i}"], T_world_base @ T, rtol=0, atol=1e-11)
        np.testing.assert_allclose(found["tool0"], T_world_base @ table_tool_pose(robot.spec, q), rtol=0, atol=1e-11)


@settings(max_examples=min(25, settings().max_examples))
@given(robot_specs(max_rows=6))
@example(TINY)
def test_any_robot_can_float(spec: RobotSpec) -> None:
    robot = with_base_mass(build_model(spec))
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(robot, MjcfOptions(floating_base=True)))
    assert compiled.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    assert [compiled.joint(i).name for i in range(1, compiled.njnt)] == [j.name for j in robot.moving_joints]
    assert compiled.nu == len(robot.moving_joints)
    data = mujoco.MjData(compiled)
    M = np.zeros((compiled.nv, compiled.nv))
    mujoco.mj_forward(compiled, data)
    mujoco.mj_fullM(compiled, data, M)
    assert np.linalg.eigvalsh(M).min() > 0.0
    assert M[0, 0] == pytest.approx(robot.mass + robot.base.inertial.mass, rel=1e-9)  # type: ignore[union-attr]


def test_keyframes_of_a_floating_base_start_at_the_origin() -> None:
    compiled = floating("odd")
    home = compiled.key("home")
    assert home.qpos.tolist() == [0, 0, 0, 1, 0, 0, 0, 0.4, 0.2, -2.5, 0.3, 1.1]
    fixed = mujoco.MjModel.from_xml_string(to_mjcf(model("odd")))
    assert home.ctrl.tolist() == fixed.key("home").ctrl.tolist()


def test_a_free_joint_takes_no_name_from_the_table() -> None:
    root = parsed(to_mjcf(with_base_mass(model("odd")), MjcfOptions(floating_base=True)))
    joint = root.find(".//freejoint")
    assert joint is not None
    assert joint.attrib == {}
