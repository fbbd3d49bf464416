"""Inverse dynamics of what was recorded give what was recorded; what was tampered with is found."""

from __future__ import annotations

import re

import mujoco
import numpy as np
import pytest
import xarray as xr

from dh2sim.simulate.run import rollout
from dh2sim.validate.motion.tracking import check_inverse, recorded_rollouts
from tests.robot_files import ODD, RICH
from tests.sample_robots import COSTLY_NAMES
from tests.validate.motion.robots import FRICTION, built

RECORD = ("qpos", "qvel", "qacc", "torque")


@pytest.fixture
def runs() -> tuple[xr.Dataset, ...]:
    return recorded_rollouts(built("stanford"))


@pytest.mark.slow
@pytest.mark.parametrize("robot", [*COSTLY_NAMES, ODD, RICH, FRICTION], ids=lambda text: text.split("\n")[0])
def test_recorded_accelerations_take_the_recorded_torques(robot: str) -> None:
    check = check_inverse(recorded_rollouts(built(robot)))
    assert check.ok
    assert check.max_error is not None
    assert check.max_error < 1e-12
    assert check.reference == "mj_inverse"
    assert check.samples > 400


@pytest.mark.parametrize("controller", ["sine", "computed-torque", "passive", "hold", "random"])
@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast"])
def test_so_they_do_with_any_controller_and_every_integrator_that_keeps_accelerations(
    controller: str, integrator: str
) -> None:
    run = rollout(
        built("planar_2r"),
        rollouts=2,
        steps=60,
        every=3,
        timestep=1e-3,
        controller=controller,
        integrator=integrator,
        record=RECORD,
    )
    assert check_inverse([run]).ok


@pytest.mark.parametrize("name", ["qpos", "qvel", "qacc", "torque"])
@pytest.mark.parametrize("which", [0, 1], ids=["open loop", "closed loop"])
def test_a_record_of_another_instant_is_found(runs: tuple[xr.Dataset, ...], name: str, which: int) -> None:
    values = runs[which][name].values
    values[:, 20:100] = values[:, 21:101].copy()
    check = check_inverse(runs)
    assert check.ok is False
    assert check.max_error is not None
    assert check.max_error > 1e-6
    assert check.worst is not None
    assert check.reason == (
        f"the recorded force on {check.worst.where} differs by {check.max_error:.2g} of its greatest from that of "
        "the recorded acceleration (tolerance 1e-09)"
    )


def test_a_torque_off_by_a_hundred_millionth_is_found(runs: tuple[xr.Dataset, ...]) -> None:
    runs[1]["torque"].values[...] *= 1.0 + 1e-8
    check = check_inverse(runs)
    assert check.ok is False
    assert check.max_error == pytest.approx(1e-8, rel=0.01)


def test_a_model_of_another_mass_is_found(runs: tuple[xr.Dataset, ...]) -> None:
    changed = re.sub(r'mass="([^"]+)"', lambda found: f'mass="{1.01 * float(found[1])!r}"', runs[0].attrs["mjcf"])
    assert changed != runs[0].attrs["mjcf"]
    runs[0].attrs["mjcf"] = changed
    assert check_inverse(runs).ok is False


def test_instants_at_which_a_limit_pushes_are_left_out() -> None:
    # let go at home, the arm falls into its limits
    run = rollout(built("puma560"), rollouts=1, steps=500, controller="passive", record=RECORD)
    model = mujoco.MjModel.from_xml_string(run.attrs["mjcf"])
    free = 0
    data = mujoco.MjData(model)
    for q in run["qpos"].values[0, :500]:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        free += data.nefc == 0
    assert 0 < free < 500
    check = check_inverse([run])
    assert (check.ok, check.samples) == (True, free)


def test_nothing_is_checked_where_friction_acts_all_the_time() -> None:
    run = rollout(built(FRICTION), rollouts=1, steps=20, controller="sine", record=RECORD)
    check = check_inverse([run])
    assert check.ok is None
    assert check.reason == "inverse dynamics: limits or contacts are active at every recorded instant"


def test_what_follows_after_a_rollout_became_unstable_is_left_out(runs: tuple[xr.Dataset, ...]) -> None:
    for name in RECORD:
        runs[0][name].values[1, 50:] = np.nan
    check = check_inverse(runs)
    assert check.ok
    assert check.samples == check_inverse(recorded_rollouts(built("stanford"))).samples - 150
