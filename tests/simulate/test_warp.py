"""Rollouts on MuJoCo Warp.

Its kernels take a minute and more to compile where they are not cached, so it is in no extra for tests: they are
skipped where it is not installed (``pip install 'dh2sim[warp]'``).
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mujoco.batch import SimulationError

from dh2sim.errors import ControllerError, MissingExtraError, RunDiffersError, SettingsError
from dh2sim.simulate.block import Block, simulate_block
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.run import open_run, workers_of
from dh2sim.simulate.store.writer import RunWriter
from dh2sim.simulate.warp_batch import WarpBatch
from tests.refusals import refusal
from tests.sample_robots import model

INSTALLED = find_spec("mujoco_warp") is not None
needs_warp = pytest.mark.skipif(not INSTALLED, reason="MuJoCo Warp is not installed: pip install 'dh2sim[warp]'")


def block(robot: str, **options: Any) -> Block:
    job = prepare(model(robot), RolloutOptions(**options))
    return simulate_block(job, range(job.options.rollouts))


@pytest.mark.skipif(INSTALLED, reason="MuJoCo Warp is installed")
def test_without_the_extra_it_is_named() -> None:
    assert refusal(MissingExtraError, block, "planar_2r", engine="warp") == (
        "the engine 'warp' needs the extra 'warp': pip install 'dh2sim[warp]'"
    )


def test_the_engine_is_a_setting_of_runs_on_warp_alone() -> None:
    assert "engine" not in RolloutOptions().to_json()
    on_warp = RolloutOptions(engine="Warp")
    assert on_warp.to_json()["engine"] == "warp"
    assert RolloutOptions.from_json(on_warp.to_json()) == on_warp
    assert RolloutOptions.from_json(RolloutOptions().to_json()).engine == "mujoco"


def test_an_unknown_engine_and_what_warp_cannot_record_are_refused() -> None:
    assert refusal(SettingsError, RolloutOptions, engine="wrap") == (
        "engine must be one of mujoco, warp, got 'wrap'. Did you mean 'warp'?"
    )
    assert refusal(SettingsError, RolloutOptions, engine="warp", integrator="RK4", record="energy") == (
        "record must not contain 'energy' or 'contacts' with RK4 and the engine 'warp'; use Euler"
    )


@needs_warp
@pytest.mark.slow
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("controller", ["sine", "hold"])
def test_a_two_joint_arm_moves_as_in_mujoco(controller: str) -> None:
    record = ("qpos", "qvel", "ctrl", "tool_pose", "energy", "contacts")
    options: dict[str, Any] = {
        "rollouts": 3,
        "steps": 50,
        "timestep": 0.01,
        "start": "random",
        "controller": controller,
    }
    expected, found = (block("planar_2r", engine=name, record=record, **options) for name in ("mujoco", "warp"))
    assert np.ptp(expected["qpos"][:, :, 0], axis=1).min() > (0.01 if controller == "sine" else -1.0)
    np.testing.assert_array_equal(found["ctrl"], expected["ctrl"])
    for name in ("qpos", "tool_pose"):
        np.testing.assert_allclose(found[name], expected[name], rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(found["qvel"], expected["qvel"], rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(found["energy"], expected["energy"], rtol=1e-4, atol=1e-4)
    for name in ("contacts", "status", "stop_step", "contact_step", "saturation"):
        np.testing.assert_array_equal(found[name], expected[name])
    assert any((found[name] != expected[name]).any() for name in ("qpos", "tool_pose"))  # not the same bits


@needs_warp
@pytest.mark.slow
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize(("controller", "way"), [("random", 1e-3), ("passive", 0.01)])
def test_an_arm_with_stiff_actuators_moves_as_in_mujoco_where_no_links_touch(controller: str, way: float) -> None:
    options: dict[str, Any] = {"rollouts": 12, "steps": 50, "start": "random", "seed": 3, "controller": controller}
    expected, found = (
        block("stanford", engine=name, record=("qpos", "qvel"), **options) for name in ("mujoco", "warp")
    )
    apart = expected["contact_step"] < 0
    assert apart.sum() >= 6
    assert np.ptp(expected["qpos"][apart], axis=1).max(axis=1).min() > way
    np.testing.assert_allclose(found["qpos"][apart], expected["qpos"][apart], rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(found["qvel"][apart], expected["qvel"][apart], rtol=0.0, atol=1e-3)


@needs_warp
@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_one_that_goes_wrong_stops_alone() -> None:
    job = prepare(model("planar_2r"), RolloutOptions(rollouts=3, steps=4))
    batch = WarpBatch(job.plant, 3)
    batch.bind("qvel")[1] = 1e12
    out = {"qpos": np.empty((3, 4, 2))}
    with pytest.raises(SimulationError) as caught:
        batch.rollout(4, np.zeros((3, 4, 2)), record=["qpos"], out=out)
    assert caught.value.ids.tolist() == [1]
    assert np.isfinite(out["qpos"][[0, 2]]).all()
    ids = np.array([0, 2], np.int32)
    batch.rollout(4, np.zeros((2, 4, 2)), record=["qpos"], ids=ids, out={"qpos": out["qpos"][:2]})


@needs_warp
@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_what_needs_the_host_or_several_processes_is_refused(tmp_path: Path) -> None:
    assert refusal(ControllerError, block, "planar_2r", engine="warp", controller="pd") == (
        "controller 'pd' looks at the state before every time step, which the engine 'warp' keeps on its device. Use "
        "hold, passive, sine, random or replay, or the engine 'mujoco'"
    )
    assert refusal(SettingsError, block, "planar_2r", engine="warp", randomize={"mass": 0.1}) == (
        "randomize must not be given with the engine 'warp': all rollouts have one model there"
    )
    job = prepare(model("planar_2r"), RolloutOptions(engine="warp", rollouts=2, steps=4))
    once = "its numbers differ in last bits from one time to the next, so that one process must make them all"
    assert refusal(SettingsError, workers_of, "local", job) == (
        f"engine must not be 'warp' together with executor: {once}"
    )
    assert refusal(SettingsError, open_run, job, tmp_path / "run.zarr", join=True) == (
        f"engine must not be 'warp' together with share or blocks: {once}"
    )


@needs_warp
@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_run_of_one_engine_is_not_resumed_with_the_other(tmp_path: Path) -> None:
    robot, path = model("planar_2r"), tmp_path / "run.zarr"
    on_warp = prepare(robot, RolloutOptions(engine="warp", rollouts=2, steps=4)).layout
    on_mujoco = prepare(robot, RolloutOptions(rollouts=2, steps=4)).layout
    RunWriter.create(path, on_warp).close()
    RunWriter.resume(path, on_warp).close()
    told = refusal(RunDiffersError, RunWriter.resume, path, on_mujoco)
    assert "engine was 'warp' and is now 'mujoco'. Use" in told
