from __future__ import annotations

import mujoco
import numpy as np
import pytest

from dh2sim.formats.mjcf.elements import MjcfOptions
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.build import build_model
from dh2sim.model.variants import with_actuators, with_base_mass
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate import rollout
from dh2sim.simulate.batch import JointSpace
from dh2sim.simulate.plant import make_plant


@pytest.mark.parametrize("floating", [False, True], ids=["fixed base", "floating base"])
@pytest.mark.parametrize("robot", ["stanford", "ssrms", "scara"])
def test_the_force_that_it_asks_for_makes_the_acceleration_that_is_wanted(robot: str, floating: bool) -> None:
    built = with_base_mass(with_actuators(build_model(load_robot(robot)), ActuatorType.NONE))
    model = mujoco.MjModel.from_xml_string(to_mjcf(built, MjcfOptions(floating_base=floating)))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT)
    n = len(built.moving_joints)
    plant = make_plant(model, built)
    random = np.random.default_rng(5)
    data = mujoco.MjData(model)
    data.qpos[model.nq - n :], data.qvel[:] = random.uniform(-1, 1, n), random.uniform(-1, 1, model.nv)
    if floating:
        data.qpos[3:7] = (0.8, 0.0, 0.6, 0.0)
    wanted = random.uniform(-1, 1, n)
    mujoco.mj_forward(model, data)
    space = JointSpace(plant)
    mass, bias = data.M[None].copy(), data.qfrc_bias[None].copy()
    force = space.inertia(mass)[0] @ wanted + space.force(mass, bias)[0]
    data.qfrc_applied[model.nv - n :] = force
    mujoco.mj_forward(model, data)
    assert data.qacc[model.nv - n :] == pytest.approx(wanted, rel=1e-8, abs=1e-8)


def test_an_arm_in_free_fall_needs_no_force_against_gravity() -> None:
    run = rollout("ssrms", rollouts=2, steps=50, controller="gravity-compensation", floating_base=True)
    assert float(abs(run.qpos - run.qpos[:, 0]).max()) < 1e-9
    assert float(abs(run.ctrl).max()) < 1e-6  # N·m, of an arm of many tonnes
    fallen = 0.5 * 9.81 * (0.002 * 50) ** 2
    assert float(run.base_pose[0, -1, 2]) == pytest.approx(-fallen, rel=0.03)


def test_computed_torque_tracks_on_a_floating_base() -> None:
    run = rollout("stanford", rollouts=3, steps=300, controller="computed-torque:period=2", floating_base=True)
    assert not run.saturation.any()
    assert float(abs(run.qpos - run.qpos_ref).max()) < 2e-3
