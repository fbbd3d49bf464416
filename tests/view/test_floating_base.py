"""A recording in which base_link floats is shown in the world, where MuJoCo has it; and only in a recording."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import xarray as xr

from dh2sim.typing import Array
from dh2sim.view.events import CompareMisread, Event, Follow, FoundWorkspace, SetMode, Show
from dh2sim.view.motion.motion_source import Recording, Simulation
from dh2sim.view.motion.replay import open_replay
from dh2sim.view.panel.pose import frame_title
from dh2sim.view.scene.items import Polyline as Line
from dh2sim.view.scene.scene import BRANCHES, IN_BASE_LINK, scene_of
from dh2sim.view.state import IDENTITY, Matrix, Mode, Part, ViewState
from tests.program import dh2sim
from tests.view.states import STANFORD, WORKSPACE, after
from tests.view.test_solids import pose_in_scene

ELSEWHERE: Matrix = ((0.0, -1.0, 0.0, 0.5), (1.0, 0.0, 0.0, -2.0), (0.0, 0.0, 1.0, 3.0), (0.0, 0.0, 0.0, 1.0))
"""A pose of base_link: a quarter of a turn about z, and away."""
FOLLOW = Follow(q=STANFORD.q, T_world_base_link=ELSEWHERE)
EVERYTHING: tuple[Event, ...] = (
    CompareMisread(),
    FoundWorkspace(model=STANFORD.model, workspace=WORKSPACE),
    *(Show(part=part, on=True) for part in Part if part is not Part.BRANCHES),
)
"""Branches are drawn while joints are set by hand, and then no base floats."""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot that is not held falls, and turns as its joints move."""
    out = tmp_path_factory.mktemp("runs") / "run.zarr"
    options = ("--rollouts", "2", "--duration", "1", "--every", "25", "--record", "qpos", "--floating-base")
    done = dh2sim("rollout", "stanford", "--out", out, *options, "--quiet")
    assert done.status == 0, done.err
    return out


def simulated(path: Path, rollout: int) -> tuple[mujoco.MjModel, Array, Array]:
    """MuJoCo's model, the instants, s, and its positions in a rollout, as the run holds them."""
    with xr.open_dataset(path, engine="zarr", consolidated=False) as data:
        model = mujoco.MjModel.from_xml_string(data.attrs["mjcf"])
        qpos = np.hstack([data.base_pose.values[rollout], data.qpos.values[rollout]])
        return model, data.time.values, qpos


def test_the_robot_its_frames_and_its_trace_are_where_mujoco_has_them(run: Path) -> None:
    model, times, qpos = simulated(run, 1)
    data = mujoco.MjData(model)
    recording = Recording(open_replay(run, STANFORD.model), 1)
    state = after(STANFORD, SetMode(mode=Mode.REPLAY), Show(part=Part.TRACE, on=True))
    tool = []
    for time, positions in zip(times, qpos, strict=True):
        recording.seek(time / times[-1])
        q = recording.tick(0.0, replace(state, paused=True))
        state = after(state, Follow(q=q, T_world_base_link=recording.T_world_base_link))
        data.qpos[:] = positions
        mujoco.mj_kinematics(model, data)
        scene = scene_of(state)
        for name in ("base_link", *(f"link_{i}" for i in range(1, 7))):
            body = data.body(name)
            shown = pose_in_scene(scene, f"/robot/{name}")
            assert np.allclose(shown[:3, 3], body.xpos, rtol=0, atol=1e-9), (time, name)
            assert np.allclose(shown[:3, :3], body.xmat.reshape(3, 3), rtol=0, atol=1e-9), (time, name)
        carriers = ["base_link", *(f"link_{i}" for i in range(1, 7)), "link_6"]
        for carrier, name in zip(carriers, [*(f"dh_{i}" for i in range(7)), "tool0"], strict=True):
            site = data.site(name)
            shown = pose_in_scene(scene, f"/robot/{carrier}/{name}")
            assert np.allclose(shown[:3, 3], site.xpos, rtol=0, atol=1e-9), (time, name)
            assert np.allclose(shown[:3, :3], site.xmat.reshape(3, 3), rtol=0, atol=1e-9), (time, name)
        tool.append(data.site("tool0").xpos.copy())
    assert math.dist(qpos[-1, :3], qpos[0, :3]) > 4.0, "it has fallen"
    assert abs(qpos[-1, 3]) < 0.9999, "and turned"
    trace = scene_of(state)["/trace"]
    assert isinstance(trace, Line)
    distances = [min(math.dist(place, point) for point in trace.points) for place in tool]
    assert max(distances) <= 1e-3 * STANFORD.model.reach, "nearer points are left out"
    assert len(trace.points) > 15


def state_tool(state: ViewState) -> Array:
    return pose_in_scene(scene_of(state), "/robot/link_6/tool0")[:3, 3]


def test_everything_in_base_link_moves_with_it_and_the_ground_does_not() -> None:
    still = after(STANFORD, *EVERYTHING)
    here, there = scene_of(still), scene_of(after(still, SetMode(mode=Mode.REPLAY), FOLLOW))
    assert here.keys() - {"/pedestal"} == there.keys() - {"/trace"}, "a base that floats needs no pedestal"
    here = {name: item for name, item in here.items() if name != "/pedestal"}
    roots = {f"/{name.split('/')[1]}" for name in here}
    assert roots == {*IN_BASE_LINK, "/grid"}
    for root in roots - {BRANCHES}:
        inside = [name for name in here if name.startswith(f"{root}/")]
        assert inside, root
        moved = np.eye(4) if root == "/grid" else np.array(ELSEWHERE)
        for name in inside:
            assert np.allclose(pose_in_scene(there, name), moved @ pose_in_scene(here, name), rtol=0, atol=1e-12), (
                name
            )
    unchanged = [name for name in here if here[name] == there[name]]
    assert {*here} - {*unchanged} == {*IN_BASE_LINK}, "only what carries the rest is drawn again"


def test_whoever_takes_the_joints_back_takes_base_link_back_too() -> None:
    floating = after(STANFORD, SetMode(mode=Mode.REPLAY), FOLLOW)
    assert floating.T_world_base_link == ELSEWHERE
    for mode in Mode:
        back = after(floating, SetMode(mode=mode))
        assert back.T_world_base_link == IDENTITY
        assert not back.floats
    assert scene_of(after(floating, SetMode(mode=Mode.MANUAL))) == scene_of(STANFORD)


def test_a_trace_ends_where_the_recording_does() -> None:
    with_trace = after(STANFORD, Show(part=Part.TRACE, on=True), SetMode(mode=Mode.REPLAY), FOLLOW)
    assert len(with_trace.trace) == 2
    assert after(with_trace, SetMode(mode=Mode.MANUAL)).trace == ()


def test_a_trace_continues_while_only_base_link_moves() -> None:
    with_trace = after(STANFORD, SetMode(mode=Mode.REPLAY), Show(part=Part.TRACE, on=True), FOLLOW)
    x, y, z = state_tool(STANFORD)
    assert np.allclose(with_trace.trace, [(x, y, z), (0.5 - y, x - 2.0, z + 3.0)], rtol=0, atol=1e-12)


def test_only_a_recording_moves_base_link_and_only_to_a_place() -> None:
    assert after(STANFORD, FOLLOW) == STANFORD
    assert not after(STANFORD, SetMode(mode=Mode.PHYSICS), FOLLOW).floats
    nowhere = replace(FOLLOW, T_world_base_link=((math.nan,) * 4, *ELSEWHERE[1:]))
    floating = after(STANFORD, SetMode(mode=Mode.REPLAY), FOLLOW)
    assert after(floating, nowhere).T_world_base_link == ELSEWHERE
    assert after(floating, Follow(q=STANFORD.q)).T_world_base_link == IDENTITY


def test_a_base_that_is_fixed_has_no_pose_of_its_own(tmp_path: Path) -> None:
    out = tmp_path / "run.zarr"
    done = dh2sim("rollout", "stanford", "--out", out, "--rollouts", "1", "--steps", "4", "--quiet")
    assert done.status == 0, done.err
    assert Recording(open_replay(out, STANFORD.model), 0).T_world_base_link is None
    simulation = Simulation(STANFORD.model, STANFORD.q, gravity=True, drive="free")
    assert simulation.T_world_base_link is None


def test_the_pose_is_labelled_as_in_base_link_even_if_that_moves() -> None:
    assert frame_title(STANFORD) == "<b>tool0</b> in base_link"
    floating = after(STANFORD, SetMode(mode=Mode.REPLAY), FOLLOW)
    assert frame_title(floating) == "<b>tool0</b> in base_link (which floats in the scene)"
