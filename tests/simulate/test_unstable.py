"""Simulations that fail stop alone, and are marked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import xarray as xr

from dh2sim.simulate import block, rollout
from dh2sim.simulate import loops as open_loop
from dh2sim.simulate.block import simulate_block
from dh2sim.simulate.dataset_layout import STATUS
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.plant import compile_plant
from dh2sim.simulate.prepare import prepare
from dh2sim.typing import Array
from tests.simulate import plain, robots

DRIVERS = "tests.simulate.drivers"
RECORD = ("qpos", "qvel", "ctrl", "tool_pose", "qacc", "torque", "energy", "contacts")
RECORD_RK4 = tuple(name for name in RECORD if name != "qacc")
BOTH = pytest.mark.parametrize("driver", ["BadOpen", "BadClosed"])


def bad(value: float, *, rollout_: int = 3, step: int = 10) -> plain.Control:
    """Controls of the bad drivers."""

    def control(model: mujoco.MjModel, _data: mujoco.MjData, number: int, now: int) -> Array:
        return np.full(model.nu, value if number == rollout_ and now >= step else 0.2)

    return control


def run_of(driver: str, value: float, **how: Any) -> xr.Dataset:
    settings = {"rollouts": 6, "steps": 40, "timestep": 0.004, "record": RECORD, **how}
    return rollout(robots.arm(), controller=f"{DRIVERS}:{driver}:value={value}", **settings)


@pytest.mark.slow
@pytest.mark.parametrize("every", [1, 4, 5])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e11])
@BOTH
def test_one_rollout_with_a_bad_control_stops_in_its_step(driver: str, value: float, every: int) -> None:
    run = run_of(driver, value, every=every)
    # motors have ranges, into which what is not NaN is clipped
    stopped = bool(np.isnan(value))
    assert run.status.values.tolist() == [0, 0, 0, STATUS["bad_ctrl"] if stopped else 0, 0, 0]
    assert run.stop_step.values.tolist() == [-1, -1, -1, 10 if stopped else -1, -1, -1]
    assert run.saturation.values.tolist() == [[0, 0]] * 3 + [[0 if stopped else 30] * 2] + [[0, 0]] * 2
    plain.assert_equal(run, plain.expected(run, bad(value)))


@BOTH
def test_after_a_stop_numbers_are_blank_and_before_they_are_not(driver: str) -> None:
    run = run_of(driver, float("nan")).isel(rollout=3)
    assert np.isfinite(run.qpos[:11]).all()
    assert np.isnan(run.qpos[11:]).all()
    assert np.isnan(run.qvel[11:]).all()
    for name in ("tool_pose", "energy", "ctrl", "qacc", "torque"):
        assert np.isfinite(run[name][:10]).all()
        assert np.isnan(run[name][10:]).all()
    assert (run.contacts[:10] == 0).all()
    assert (run.contacts[10:] == -1).all()


@BOTH
def test_the_others_have_the_bits_of_a_run_in_which_none_fails(driver: str) -> None:
    run = run_of(driver, float("nan"))
    calm = run_of(driver, 0.2)
    assert not calm.status.values.any()
    others = [0, 1, 2, 4, 5]
    xr.testing.assert_identical(run.isel(rollout=others).drop_attrs(), calm.isel(rollout=others).drop_attrs())


@pytest.mark.parametrize("step", [0, 15, 16, 31, 39])
def test_open_and_closed_loop_agree(step: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(open_loop, "SEGMENT_BYTES", 1)
    runs = [
        rollout(
            robots.arm(),
            rollouts=6,
            steps=40,
            controller=f"{DRIVERS}:{driver}:step={step}",
            record=RECORD,
        )
        for driver in ("BadOpen", "BadClosed")
    ]
    xr.testing.assert_identical(runs[0].drop_attrs(), runs[1].drop_attrs())
    assert runs[0].stop_step.values[3] == step


@pytest.mark.parametrize("segment", [1, 2**23], ids=["short", "long"])
@BOTH
def test_clipped_controls_count_until_the_stop(driver: str, segment: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(open_loop, "SEGMENT_BYTES", segment)
    controller = f"{DRIVERS}:{driver}:before=1e3,step=21"
    run = rollout(robots.arm(), rollouts=5, steps=100, controller=controller)
    assert run.saturation.values.tolist() == [[0, 0], [0, 0], [0, 0], [21, 21], [0, 0]]
    assert run.stop_step.values.tolist() == [-1, -1, -1, 21, -1]
    assert (run.ctrl.values[3, :21] == 40.0).all()


@BOTH
def test_when_all_have_failed_the_run_is_over(driver: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(block, "BATCH_SIZE", 1)
    run = run_of(driver, float("nan"), rollouts=4)
    alone = rollout(robots.arm(), rollouts=1, steps=10**6, every=10**5, controller=f"{DRIVERS}:{driver}:rollout=0")
    assert run.status.values.tolist() == [0, 0, 0, STATUS["bad_ctrl"]]
    assert (alone.status.item(), alone.stop_step.item()) == (STATUS["bad_ctrl"], 10)


@pytest.fixture
def speeds(tmp_path: Path) -> Path:
    """Starts from still to absurd."""
    states = np.zeros((6, 2, 5))
    for i, speed in enumerate([0.0, 300.0, 1e11, 1.0, 3e4, 1e9]):
        states[i, 1] = speed
    np.save(tmp_path / "speeds.npy", states)
    return tmp_path / "speeds.npy"


@pytest.mark.slow
@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast"])
@pytest.mark.parametrize("driver", ["MotorWave", "Spring"])
def test_rollouts_that_blow_up_do_so_in_the_step_of_the_plain_loop(
    driver: str, integrator: str, floating: bool, speeds: Path
) -> None:
    run = rollout(
        robots.worm(),
        rollouts=6,
        steps=30,
        timestep=0.01,
        start=str(speeds),
        controller=f"{DRIVERS}:{driver}",
        record=RECORD_RK4 if integrator == "RK4" else RECORD,
        integrator=integrator,
        floating_base=floating,
        every=3,
    )
    plain.assert_equal(run, plain.expected(run, {"MotorWave": plain.wave, "Spring": plain.spring}[driver]))
    assert run.stop_step.values[2] == 0
    assert run.status.values[2] == STATUS["bad_qvel"]
    assert len(set(run.stop_step.values.tolist())) >= 3
    assert (run.status.values == 0).sum() >= 2


@pytest.mark.parametrize("driver", ["MotorWave", "Spring"])
def test_a_state_that_is_bad_at_the_very_end_is_marked_too(driver: str, speeds: Path) -> None:
    how = {"rollouts": 6, "timestep": 0.01, "start": str(speeds), "integrator": "RK4", "record": RECORD_RK4}
    run = rollout(robots.worm(), controller=f"{DRIVERS}:{driver}", steps=1, **how)  # type: ignore[arg-type]
    assert run.status.values.tolist() == [0, 0, STATUS["bad_qvel"], 0, STATUS["bad_qvel"], STATUS["bad_qpos"]]
    assert run.stop_step.values.tolist() == [-1, -1, 0, -1, 1, 1]
    assert np.isnan(run.tool_pose.values[4, 1]).all()
    assert np.isfinite(run.torque.values[4, 0]).all()
    plain.assert_equal(run, plain.expected(run, {"MotorWave": plain.wave, "Spring": plain.spring}[driver]))


@pytest.mark.parametrize("controller", ["pd", "computed-torque", "gravity-compensation", "sine", "random", "hold"])
def test_the_controllers_that_come_along_look_at_a_failed_rollout_without_a_warning(
    controller: str, speeds: Path
) -> None:
    run = rollout(robots.worm(), rollouts=6, steps=20, timestep=0.01, controller=controller, start=str(speeds))
    assert run.status.values[2] == STATUS["bad_qvel"]
    assert run.status.values[0] == 0


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
@pytest.mark.parametrize("controller", [f"{DRIVERS}:MotorWave", f"{DRIVERS}:Spring", "gravity-compensation", "pd"])
def test_a_simulation_that_mujoco_gives_up_on_is_an_error_of_its_own(controller: str, floating: bool) -> None:
    options = RolloutOptions(
        rollouts=4,
        steps=60,
        start="curled",
        controller=controller,
        record=("qpos", "contacts"),
        floating_base=floating,
    )
    job = prepare(robots.worm(), options)
    # too little memory for the contacts that come
    mjcf = job.mjcf.replace("<worldbody>", '<size memory="18K"/><worldbody>')
    assert mjcf != job.mjcf
    found = simulate_block(replace(job, plant=compile_plant(mjcf, robots.worm())), range(4))
    assert set(found["status"].tolist()) == {STATUS["error"]}
    assert (found["stop_step"] >= 0).all()
    assert np.isnan(found["qpos"][:, -1]).all()


@pytest.mark.parametrize("driver", ["BadOpen", "BadClosed"])
def test_warnings_are_neither_printed_nor_written_to_a_file(
    driver: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    run = run_of(driver, float("nan"), threads=3)
    assert run.status.values.any()
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr() == ("", "")
