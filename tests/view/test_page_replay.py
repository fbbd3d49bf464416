"""A run played in a real browser: what is shown at an instant is what was recorded then."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import xarray as xr

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.read import load_robot
from dh2sim.typing import Array
from dh2sim.view.initial_state import open_state
from dh2sim.view.page import Page as ServedPage
from dh2sim.view.scene.scene import scene_of
from dh2sim.view.state import Mode, Part
from tests.program import dh2sim
from tests.view.on_page import (
    Serve,
    choose,
    field,
    open_tab,
    wait_for_equal,
    wait_for_position,
    wait_for_whole_text,
    wait_until,
)
from tests.view.test_solids import pose_in_scene

if TYPE_CHECKING:
    from playwright.sync_api import Page

STANFORD = load_robot("stanford")
DURATION = 0.5
"""s."""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("runs"))


def recorded(folder: Path, *options: str) -> Path:
    out = folder / "run.zarr"
    start = ("--rollouts", "2", "--duration", str(DURATION), "--start", "random", "--record", "qpos", "--quiet")
    done = dh2sim("rollout", "stanford", "--out", out, *start, *options)
    assert done.status == 0, done.err
    return out


def positions(run: Path, rollout: int, time: float) -> list[float]:
    """Joint positions of a rollout at an instant, as the run holds them."""
    with xr.open_dataset(run, engine="zarr", consolidated=False) as data:
        values: list[float] = data.qpos.values[rollout, np.abs(data.time.values - time).argmin()].tolist()
        return values


def stand_at(page: Page, percent: int, rollout: int) -> float:
    """Pause the recording, and wind it to an instant; return that, s."""
    open_tab(page, "Motion")
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    field(page, "Time [%]").fill(str(percent))
    time = 0.01 * percent * DURATION
    wait_for_whole_text(page, "motion", f"Rollout {rollout}: {time:.2f} of {DURATION:.2f} s.")
    return time


@pytest.mark.slow
def test_a_recording_is_paused_searched_changed_and_stopped(serve: Serve, run: Path) -> None:
    page, served = serve(open_state(STANFORD), run)
    open_tab(page, "Motion")
    choose(page, "Mode", "recording")
    for rollout, percent in ((0, 40), (1, 70)):
        if rollout:
            choose(page, "Rollout", str(rollout))
            page.get_by_role("button", name="Pause").wait_for()
        q = positions(run, rollout, stand_at(page, percent, rollout))
        open_tab(page, "Joints")
        wait_for_position(page, STANFORD, q)
        assert served.state.q == pytest.approx(q, abs=1e-12)
        open_tab(page, "Motion")
    choose(page, "Mode", "manual")
    wait_until(lambda: served.state.mode is Mode.MANUAL, "the joints are given back")
    wait_for_whole_text(page, "motion", "")


@pytest.mark.slow
def test_the_path_of_the_tool_is_drawn_while_a_recording_plays(serve: Serve, run: Path) -> None:
    page, served = serve(open_state(STANFORD), run)
    open_tab(page, "Show")
    page.get_by_text("Path of tool0").click()
    wait_until(lambda: Part.TRACE in served.state.shown, "the trace")
    assert served.client.scene.get_handle_by_name("/trace") is None
    open_tab(page, "Motion")
    choose(page, "Speed", "0.1")
    choose(page, "Mode", "recording")
    trace = np.empty((0, 3))

    def is_drawn() -> bool:
        nonlocal trace
        trace = trace_sent(served)  # once: it starts again with the recording
        return len(trace) > 10

    wait_until(is_drawn, "tool0 goes about")
    with xr.open_dataset(run, engine="zarr", consolidated=False) as data:
        way = np.array([table_tool_pose(STANFORD, q)[:3, 3] for q in data.qpos.values[0]])
    distances = np.linalg.norm(trace[:, None] - way, axis=2).min(axis=1)
    assert distances.max() < 1e-6, "as exact as what viser sends, float32"


def trace_sent(served: ServedPage) -> Array:
    """The ends of the lines that viser draws as the trace, m."""
    handle = served.client.scene.get_handle_by_name("/trace")
    return np.empty((0, 3)) if handle is None else np.asarray(handle.points).reshape(-1, 3)  # type: ignore[attr-defined]


@pytest.mark.slow
def test_a_floating_base_moves_away_and_returns(serve: Serve, tmp_path: Path) -> None:
    run = recorded(tmp_path, "--floating-base")
    page, served = serve(open_state(STANFORD), run)
    open_tab(page, "Motion")
    choose(page, "Mode", "recording")
    time = stand_at(page, 80, 0)
    with xr.open_dataset(run, engine="zarr", consolidated=False) as data:
        base = data.base_pose.values[0, np.abs(data.time.values - time).argmin()]
    assert base[2] < -0.5, "it falls"
    wait_for_equal(lambda: drawn_at(served, "/robot"), pytest.approx(base, abs=1e-9))
    open_tab(page, "Joints")
    q = positions(run, 0, time)
    wait_for_position(page, STANFORD, q)
    wait_until(lambda: page.get_by_text("in base_link (which floats in the scene)").first.is_visible(), "it is said")
    open_tab(page, "Motion")
    choose(page, "Mode", "manual")
    wait_for_equal(lambda: drawn_at(served, "/robot"), pytest.approx([0, 0, 0, 1, 0, 0, 0], abs=0))
    assert pose_in_scene(scene_of(served.state), "/robot/link_6/tool0")[:3, 3] == pytest.approx(
        table_tool_pose(STANFORD, q)[:3, 3]
    )


def drawn_at(served: ServedPage, name: str) -> list[float]:
    """Where viser has an item: position, m, and quaternion (w, x, y, z)."""
    handle = served.client.scene.get_handle_by_name(name)
    assert handle is not None
    return [*handle.position.tolist(), *handle.wxyz.tolist()]
