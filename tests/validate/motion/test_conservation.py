"""A free motion conserves energy as RK4 can, and momentum; whatever spoils that is found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_base_mass
from dh2sim.simulate.mujoco_runtime import quiet_engine
from dh2sim.typing import Array
from dh2sim.validate.motion.conservation import check_energy, check_momentum
from dh2sim.validate.motion.free_motion import RECORDS, State, free_model, random_states
from dh2sim.validate.report import Check
from tests.robot_files import ODD
from tests.sample_robots import COSTLY_NAMES
from tests.validate.motion.robots import FRICTION, LIFT, PENDULUM, TURNTABLE, built, heavier


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    """As in ``check_motion``: unstable simulations are part of the search for a timestep."""
    with quiet_engine():
        yield


def error(check: Check) -> float:
    assert check.max_error is not None
    return check.max_error


@pytest.mark.parametrize("name", COSTLY_NAMES)
def test_the_energy_error_of_a_robot_falls_with_the_fourth_power_of_the_timestep(name: str) -> None:
    model = built(name)
    check = check_energy(model, free_model(model))
    assert check.ok
    assert error(check) < 0.2


@pytest.mark.parametrize("robot", [ODD, PENDULUM, FRICTION], ids=["odd", "pendulum", "armature"])
@pytest.mark.parametrize("seed", [0, 1, 2**70])
def test_so_does_that_of_robots_of_any_kind(robot: str, seed: int) -> None:
    model = built(robot)
    assert check_energy(model, free_model(model), seed=seed).ok


@pytest.mark.parametrize("robot", [TURNTABLE, LIFT], ids=["turns evenly", "falls freely"])
def test_a_motion_without_an_error_passes(robot: str) -> None:
    model = built(robot)
    check = check_energy(model, free_model(model))
    assert (check.ok, check.max_error) == (True, 0.0)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_an_integrator_of_first_order_is_found_out(integrator: str) -> None:
    model = built("stanford")
    check = check_energy(model, free_model(model, integrator=integrator))
    assert check.ok is False
    assert error(check) == pytest.approx(3.0, abs=0.1)
    assert check.reason is not None
    assert check.reason.startswith("the energy error with RK4 decreases with the power 1.0")


def spoilt(compiled: mujoco.MjModel, how: str) -> mujoco.MjModel:
    """Change something about a model by a thousandth or less."""
    match how:
        case "damping":
            compiled.dof_damping[-1] = 1e-4
        case "gravity":
            compiled.opt.gravity[2] *= 1.001
        case "side wind":
            compiled.opt.gravity[0] = 1e-3
        case "mass":
            compiled.body_mass[2] *= 1.001
        case "inertia":
            compiled.body_inertia[2] *= 1.001
        case "centre of mass":
            compiled.body_ipos[2, 0] += 1e-4
        case "armature":
            compiled.dof_armature[0] += 1e-3
        case "joint":
            compiled.body_pos[3, 1] += 1e-4
    return compiled


@pytest.mark.slow
@pytest.mark.parametrize(
    "how",
    ["damping", "gravity", "side wind", "mass", "inertia", "centre of mass", "armature", "joint"],
)
def test_a_simulation_of_another_robot_does_not_conserve_this_ones_energy(how: str) -> None:
    model = built("stanford")
    check = check_energy(model, spoilt(free_model(model), how))
    assert check.ok is False
    assert error(check) > 3.0


def test_an_unstable_simulation_conserves_nothing() -> None:
    model = built("planar_2r")
    compiled = free_model(model)
    compiled.dof_damping[:] = -1e8
    check = check_energy(model, compiled)
    assert check.ok is False
    assert check.reason == (
        "the energy error with RK4 decreases with the power 0.00 of the timestep instead of 4: from inf of the "
        "energy to inf in 3 halvings"
    )


@pytest.mark.parametrize("name", COSTLY_NAMES)
def test_a_floating_robot_conserves_momentum_while_its_motors_work(name: str) -> None:
    model = built(name)
    check = check_momentum(model, free_model(model, floating_base=True))
    assert check.ok
    assert error(check) < 1e-10


@pytest.mark.parametrize("robot", [ODD, FRICTION, LIFT], ids=["odd", "armature", "slide"])
@pytest.mark.parametrize("seed", [0, 1, 2**70])
def test_so_does_one_of_any_kind(robot: str, seed: int) -> None:
    model = built(robot)
    assert check_momentum(model, free_model(model, floating_base=True), seed=seed).ok


def test_a_force_from_outside_changes_momentum() -> None:
    model = built("stanford")
    compiled = free_model(model, floating_base=True)
    compiled.opt.gravity[1] = 1e-6
    check = check_momentum(model, compiled)
    assert check.ok is False
    assert check.reason is not None
    assert check.reason.startswith("linear momentum changes by ")
    assert check.reason.endswith(" (tolerance 1e-09)")


@pytest.mark.slow
@pytest.mark.parametrize("how", ["mass", "inertia", "centre of mass", "joint"])
def test_a_simulation_of_another_robot_does_not_conserve_this_ones_momentum(how: str) -> None:
    model = built("stanford")
    check = check_momentum(model, spoilt(free_model(model, floating_base=True), how))
    assert check.ok is False
    assert error(check) > 1e-7


def test_a_base_of_another_mass_is_found_out() -> None:
    model = built("stanford")
    compiled = free_model(model, floating_base=True)
    compiled.body_mass[1] *= 1.001
    assert check_momentum(model, compiled).ok is False


@pytest.mark.slow
def test_a_link_of_another_mass_in_the_model_is_found_out() -> None:
    model = built(ODD)
    other = heavier(model, 1, 1.001)
    assert check_energy(other, free_model(model)).ok is False
    assert check_momentum(other, free_model(model, floating_base=True)).ok is False


def momenta_by_mujoco(compiled: mujoco.MjModel, state: State, substeps: int) -> Array:
    """Linear and angular momentum at the recorded instants as MuJoCo has them, shape (RECORDS + 1, 2, 3)."""
    compiled.opt.timestep = state.duration / (RECORDS * substeps)
    data = mujoco.MjData(compiled)
    data.qpos[:], data.qvel[:], data.ctrl[:] = state.qpos, state.qvel, state.ctrl
    found = []
    for k in range(RECORDS + 1):
        if k:
            mujoco.mj_step(compiled, data, nstep=substeps)
        mujoco.mj_forward(compiled, data)
        mujoco.mj_subtreeVel(compiled, data)
        found.append([compiled.body_subtreemass[1] * data.subtree_linvel[1], data.subtree_angmom[1].copy()])
    return np.array(found)


@pytest.mark.parametrize("seed", range(3))
def test_ssrms_in_free_fall_conserves_momentum_as_mujoco_has_it(seed: int) -> None:
    model = with_base_mass(built("ssrms"))
    compiled = free_model(model, floating_base=True)
    [state] = random_states(model, compiled, 1, np.random.default_rng(seed))
    assert np.abs(state.ctrl).min() > 0.0
    runs = [momenta_by_mujoco(compiled, state, substeps) for substeps in (32, 64)]
    size = np.linalg.norm(runs[0], axis=2).max(axis=0)[:, None]
    changes = [np.abs(run - run[0]).max(axis=0) / size for run in runs]
    assert np.max(changes[1]) < 1e-5
    # MuJoCo's RK4 was of second order where a body turns freely, and is of fourth since 4.0
    factor, least, most = (4.0, 3.8, 4.2) if mujoco.mj_version() < 4_000_000 else (16.0, 10.0, 20.0)
    assert least < np.max(changes[0]) / np.max(changes[1]) < most
    extrapolated = (factor * runs[1] - runs[0]) / (factor - 1.0)
    assert np.max(np.abs(extrapolated - extrapolated[0]) / size) < 1e-9


def test_the_free_model_feels_no_friction_no_limits_and_no_contacts() -> None:
    model = built(FRICTION)
    data = mujoco.MjData(compiled := free_model(model))
    data.qpos[:] = [5.0, 3.0]  # outside the limits
    data.qvel[:] = 1.0
    mujoco.mj_forward(compiled, data)
    assert (data.nefc, data.ncon, compiled.nu) == (0, 0, 0)
    assert not compiled.dof_damping.any()
    assert not compiled.dof_frictionloss.any()
    assert compiled.dof_armature.tolist() == [0.05, 0.02]
    floating = free_model(model, floating_base=True)
    assert (floating.nu, floating.nv, floating.opt.gravity.any()) == (2, 8, np.False_)


def test_states_are_drawn_inside_the_limits_and_torques_within_the_effort() -> None:
    model = replace_effort(built("stanford"), 0.5)
    compiled = free_model(model, floating_base=True)
    states = random_states(model, compiled, 20, np.random.default_rng(0))
    q = np.array([state.qpos[7:] for state in states])
    for column, joint in zip(q.T, model.moving_joints, strict=True):
        assert joint.position_range is not None
        lower, upper = joint.position_range
        assert lower <= column.min() < column.max() <= upper
    torques = np.abs([state.ctrl for state in states])
    assert torques.min() > 0.0
    assert torques.max() == 0.5


def replace_effort(model: RobotModel, effort: float) -> RobotModel:
    return replace(
        model, joints=tuple(replace(joint, limits=replace(joint.limits, effort=effort)) for joint in model.joints)
    )
