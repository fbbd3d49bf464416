"""Rollouts against the oracle: bit for bit what a plain loop over ``mj_step`` gives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import quaternion_from_rotation
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.row import ActuatorType
from dh2sim.robot.spec import RobotSpec
from dh2sim.simulate import rollout
from dh2sim.simulate.options import RECORDABLE
from tests.sample_robots import model
from tests.simulate import plain, robots
from tests.strategies import robot_specs

DRIVERS = "tests.simulate.drivers"
ORACLES = {"Wave": plain.wave, "MotorWave": plain.wave, "Spring": plain.spring}
ALWAYS = {"status", "stop_step", "saturation", "contact_step", "contact_link_a", "contact_link_b"}
"""Variables of every run."""
INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")


def everything(integrator: str) -> tuple[str, ...]:
    return tuple(name for name in RECORDABLE if not (integrator == "RK4" and name == "qacc"))


def assert_as_the_plain_loop(
    robot: RobotModel, driver: str, *, integrator: str = "implicitfast", **how: object
) -> xr.Dataset:
    run = rollout(
        robot,
        controller=f"{DRIVERS}:{driver}",
        integrator=integrator,
        **{"rollouts": 3, "record": everything(integrator), **how},  # type: ignore[arg-type]
    )
    plain.assert_equal(run, plain.expected(run, ORACLES[driver]))
    return run


@pytest.mark.slow
@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("driver", ["MotorWave", "Spring"])
def test_links_that_touch_rub_and_meet_their_limits_do_so_as_in_the_plain_loop(
    driver: str, integrator: str, floating: bool
) -> None:
    run = assert_as_the_plain_loop(
        robots.worm(),
        driver,
        integrator=integrator,
        floating_base=floating,
        start="curled",
        steps=120,
        timestep=0.004,
        every=4,
    )
    assert run.contacts.values.max() > 0
    assert (run.contact_step.values >= 0).any()
    assert set(run.data_vars) - ALWAYS == {
        *("qpos", "qvel", "ctrl", "tool_pose", "torque", "contacts", "energy"),
        *(("qacc",) if integrator != "RK4" else ()),
        *(("base_pose", "base_twist") if floating else ()),
    }


@pytest.mark.parametrize("driver", ["Wave", "Spring"])
@pytest.mark.parametrize("name", ["odd", "stanford", "puma560", "scara", "ssrms", "planar_2r"])
def test_robots_of_any_table_move_as_in_the_plain_loop(name: str, driver: str) -> None:
    run = assert_as_the_plain_loop(model(name), driver, steps=30, start="random", seed=5)
    assert np.ptp(run.qpos.values, axis=1).max() > 1e-4


@pytest.mark.parametrize("kind", [ActuatorType.VELOCITY, ActuatorType.MOTOR, ActuatorType.POSITION])
def test_a_robots_own_actuators_are_driven(kind: ActuatorType) -> None:
    run = assert_as_the_plain_loop(robots.arm(kind), "Wave", steps=40)
    assert list(run.actuator.values) == [f"joint_1_{kind.value}", f"joint_2_{kind.value}"]


def test_a_robot_without_actuators_moves_as_in_the_plain_loop() -> None:
    run = assert_as_the_plain_loop(robots.arm(ActuatorType.NONE), "Wave", steps=40)
    assert run.ctrl.shape == (3, 40, 0)
    assert np.ptp(run.qpos.values[0, :, 0]) > 0.01


@pytest.mark.parametrize("joints", [1, 12])
@pytest.mark.parametrize("driver", ["MotorWave", "Spring"])
def test_one_joint_or_many(joints: int, driver: str) -> None:
    assert_as_the_plain_loop(robots.arm(joints=joints), driver, steps=20, every=5)


@pytest.mark.parametrize("driver", ["MotorWave", "Spring"])
def test_a_run_of_one_step_has_a_start_and_an_end(driver: str) -> None:
    run = assert_as_the_plain_loop(robots.arm(), driver, steps=1, rollouts=1)
    assert (run.sizes["step"], run.sizes["interval"]) == (2, 1)


@pytest.mark.parametrize(
    "controller", ["passive", "hold", "gravity-compensation", "pd", "computed-torque", "sine", "random"]
)
def test_what_a_controller_did_is_recorded_so_that_the_plain_loop_can_do_it_again(controller: str) -> None:
    run = rollout(
        model("stanford"),
        rollouts=3,
        steps=150,
        controller=controller,
        start="random",
        record=everything(""),
        randomize={"mass": 0.2},
    )
    plain.assert_equal(run, plain.expected(run, plain.replayed(run)))


@pytest.mark.slow
@settings(max_examples=min(40, settings().max_examples))
@given(
    spec=robot_specs(max_rows=5),
    driver=st.sampled_from(sorted(ORACLES)),
    integrator=st.sampled_from(INTEGRATORS),
    floating=st.booleans(),
    every=st.sampled_from([1, 3]),
    timestep=st.sampled_from([0.001, 0.02]),
)
def test_any_robot_moves_as_in_the_plain_loop_and_fails_in_the_same_step(
    spec: RobotSpec, driver: str, integrator: str, floating: bool, every: int, timestep: float
) -> None:
    assert_as_the_plain_loop(
        build_model(spec),
        driver,
        integrator=integrator,
        floating_base=floating,
        every=every,
        timestep=timestep,
        rollouts=2,
        steps=15,
        start="random",
        randomize={"mass": 0.3},
    )


def test_the_recorded_pose_is_that_of_the_table() -> None:
    robot = model("odd")
    run = rollout(robot, rollouts=2, steps=20, start="random", record="qpos,tool_pose")
    for q, pose in zip(run.qpos.values.reshape(-1, 5), run.tool_pose.values.reshape(-1, 7), strict=True):
        T = table_tool_pose(robot.spec, q)
        np.testing.assert_allclose(pose[:3], T[:3, 3], rtol=0, atol=1e-12)
        quaternion = quaternion_from_rotation(T)
        np.testing.assert_allclose(np.abs(pose[3:] @ quaternion), 1.0, rtol=0, atol=1e-12)


def test_less_that_is_recorded_changes_nothing_of_the_rest() -> None:
    everything_recorded = rollout(robots.worm(), rollouts=3, steps=60, start="curled", record=everything(""))
    for name in ("qpos", "qvel", "ctrl", "tool_pose", "qacc", "torque", "energy", "contacts"):
        run = rollout(robots.worm(), rollouts=3, steps=60, start="curled", record=name)
        assert np.array_equal(run[name].values, everything_recorded[name].values)
        assert set(run.data_vars) == {name, *ALWAYS}
        for always in ALWAYS:
            assert np.array_equal(run[always].values, everything_recorded[always].values)


def test_contacts_in_substeps_are_found_where_they_are_not_recorded() -> None:
    how: dict[str, Any] = {"rollouts": 8, "steps": 120, "timestep": 0.004, "start": "random", "seed": 3}
    how["integrator"] = "RK4"
    looked = rollout(robots.worm(), record=("qpos", "contacts"), controller=f"{DRIVERS}:MotorWave", **how)
    guessed = rollout(robots.worm(), record=("qpos",), controller=f"{DRIVERS}:MotorWave", **how)
    assert np.array_equal(looked.qpos.values, guessed.qpos.values)
    assert (looked.contact_step.values >= 0).any()
    assert np.abs(looked.contact_step.values - guessed.contact_step.values).max() <= 1


@pytest.mark.parametrize("driver", ["MotorWave", "Spring", "Wave"])
def test_records_of_every_few_steps_are_a_part_of_all(driver: str) -> None:
    how = {"rollouts": 2, "steps": 60, "record": everything(""), "controller": f"{DRIVERS}:{driver}"}
    whole = rollout(robots.worm(), **how)  # type: ignore[arg-type]
    for every in (2, 3, 20, 60):
        run = rollout(robots.worm(), every=every, **how)  # type: ignore[arg-type]
        for name in ("qpos", "qvel", "tool_pose", "energy", "ctrl", "qacc", "torque", "contacts"):
            assert np.array_equal(run[name].values, whole[name].values[:, ::every]), (name, every)
        assert np.array_equal(run.time.values, whole.time.values[::every])
        assert np.array_equal(run.saturation.values, whole.saturation.values)


def test_references_stand_beside_the_states_that_follow_them() -> None:
    how = {"rollouts": 2, "steps": 600, "controller": "computed-torque"}
    whole = rollout(model("stanford"), **how)  # type: ignore[arg-type]
    assert np.abs(whole.qpos - whole.qpos_ref).max() < 1e-3
    rates = np.gradient(whole.qpos_ref.values, 0.002, axis=1)
    np.testing.assert_allclose(rates[:, 1:-1], whole.qvel_ref.values[:, 1:-1], rtol=0, atol=2e-4)
    run = rollout(model("stanford"), every=8, **how)  # type: ignore[arg-type]
    assert np.array_equal(run.qpos_ref.values, whole.qpos_ref.values[:, ::8])
    assert np.array_equal(run.qvel_ref.values, whole.qvel_ref.values[:, ::8])


def test_a_run_goes_on_in_plain_mujoco_as_the_pages_say(tmp_path: Path) -> None:
    run = rollout(model("stanford"), out=tmp_path / "run.zarr", rollouts=1, steps=20, controller="passive")
    compiled = mujoco.MjModel.from_xml_string(run.attrs["mjcf"])
    data = mujoco.MjData(compiled)
    data.qpos, data.qvel = run.qpos[0, 10], run.qvel[0, 10]
    for k in range(11, 21):
        mujoco.mj_step(compiled, data)
        assert np.array_equal(data.qpos, run.qpos[0, k])
