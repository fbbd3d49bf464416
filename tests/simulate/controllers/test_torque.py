from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.controllers.protocol import ClosedLoop, RolloutBatch
from dh2sim.simulate.controllers.torque import PD, ComputedTorque, GravityCompensation, steady_gains
from dh2sim.typing import Array, read_only
from tests.simulate.controllers.samples import arm, driven, observe, plant, see, started

MOTORS = driven(arm(), ActuatorType.MOTOR)


def simulated(controller: ClosedLoop, group: RolloutBatch, steps: int) -> Array:
    """Positions of the first rollout after each time step, by a plain loop over ``mj_step``."""
    plant = group.plant
    data = mujoco.MjData(plant.model)
    data.qpos[:] = group.q0[0]
    states = []
    for step in range(steps):
        data.ctrl[:] = controller.control(observe(plant, step, data.qpos[None].copy(), data.qvel[None].copy()))[0]
        mujoco.mj_step(plant.model, data)
        states.append(data.qpos.copy())
    return np.array(states)


def state() -> tuple[Array, Array]:
    q, v = np.random.default_rng(11).normal(size=(2, 7, 3))
    return q, v


def test_gravity_compensation_keeps_a_simulated_arm_still() -> None:
    group = started(MOTORS, range(1))
    states = simulated(GravityCompensation(group), group, 300)
    np.testing.assert_allclose(states, np.tile(group.q0, (300, 1)), rtol=0, atol=1e-9)


def test_gravity_compensation_damps_motion_where_it_is_asked_to() -> None:
    group, (q, v) = started(MOTORS), state()
    seen = observe(group.plant, 0, q, v)
    plain, damped = GravityCompensation(group).control(seen), GravityCompensation(group, damping=3.0).control(seen)
    np.testing.assert_allclose(plain - damped, 3.0 * v, rtol=0, atol=1e-12)


def test_pd_pulls_with_the_robots_gains_and_balances_gravity() -> None:
    group, (q, v) = started(MOTORS), state()
    controller, seen = PD(group), observe(group.plant, 120, q, v)
    q_ref, v_ref = (array[:, 0] for array in controller.reference(120, 1))
    expected = [50.0, 60.0, 70.0] * (q_ref - q) + [0.5, 0.6, 0.7] * (v_ref - v) + seen.gravity
    np.testing.assert_allclose(controller.control(seen), expected, rtol=1e-12)


@pytest.mark.parametrize("timestep", [0.001, 0.002, 0.02])
def test_pd_is_as_soft_as_the_time_step_requires(timestep: float) -> None:
    made = plant(MOTORS, timestep=timestep)
    strong = replace(made, kv=read_only([40.0, 900.0, 3.0]), kp=read_only([4000.0, 90000.0, 300.0]))
    kp, kd = steady_gains(strong)
    lower, upper = (np.nan_to_num(each, posinf=math.pi, neginf=-math.pi) for each in (strong.lower, strong.upper))
    somewhere = np.random.default_rng(8).uniform(lower, upper, (40, 3))

    def taken(q: Array) -> float:
        inertia = see(strong, q, np.zeros(3)).mass_matrix
        return float(max(np.linalg.eigvals(np.linalg.solve(inertia, np.diag(timestep * kd))).real))

    assert taken(strong.home) < 0.402
    assert max(map(taken, somewhere)) < 1.0
    assert max(taken(strong.home) / 0.4, max(map(taken, somewhere)) / 0.8) > 0.3  # and is no softer than it has to be
    np.testing.assert_allclose(kd / strong.kv, np.sqrt(kp / strong.kp), rtol=1e-12)


def test_pd_follows_its_reference_without_trembling() -> None:
    group = started(MOTORS, range(1), steps=500, q0=np.array([0.4, 0.05, 0.2]))
    group = replace(group, plant=replace(group.plant, kv=read_only([400, 900, 30]), kp=read_only([4e4, 9e4, 3e3])))
    controller = PD(group, amplitude=0.2)
    states = simulated(controller, group, 500)
    assert np.abs(states - controller.reference(1, 500)[0][0]).max() < 0.02
    steps = np.diff(states, axis=0)
    assert np.mean(np.sign(np.diff(steps, axis=0))[1:] != np.sign(np.diff(steps, axis=0))[:-1]) < 0.1


def test_pd_uses_the_gains_of_its_options() -> None:
    group, (q, v) = started(MOTORS), state()
    controller, seen = PD(group, kp=9.0, kd=0.0, gravity=False), observe(group.plant, 120, q, v)
    q_ref = controller.reference(120, 1)[0][:, 0]
    np.testing.assert_allclose(controller.control(seen), 9.0 * (q_ref - q), rtol=1e-13)


def test_computed_torque_makes_errors_vanish_like_a_critically_damped_oscillator() -> None:
    group, (q, v) = started(MOTORS), state()
    controller = ComputedTorque(group, bandwidth=12.0, period=0.3)
    torque = controller.control(observe(group.plant, 40, q, v))
    before, here, after = np.moveaxis(controller.reference(39, 3)[1], 1, 0)
    a_ref, q_ref = (after - before) / 0.004, controller.reference(40, 1)[0][:, 0]
    wanted = a_ref + 24.0 * (here - v) + 144.0 * (q_ref - q)
    model = group.plant.model
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    for i in range(7):
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q[i], v[i], torque[i]
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qacc, wanted[i], rtol=1e-3, atol=0.02)


def test_computed_torque_follows_its_reference() -> None:
    group = started(MOTORS, range(1), steps=1000, timestep=0.001, q0=np.array([0.4, 0.05, 0.2]))
    controller = ComputedTorque(group, amplitude=0.2)
    states = simulated(controller, group, 1000)
    reference = controller.reference(1, 1000)[0][0]
    assert np.abs(reference - group.q0).max() > 0.05
    assert np.abs(states - reference).max() < 1e-3
