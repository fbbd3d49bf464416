"""Pages of mechanisms: what moves them, what is drawn, and in a browser."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dh2sim.errors import SingularPositionError
from dh2sim.kinematics.loop_closure import closure_gaps
from dh2sim.kinematics.loop_motion import mechanism_configuration
from dh2sim.kinematics.rotations import rotations_of_quaternions
from dh2sim.kinematics.table_oracle import table_mechanism_frames
from dh2sim.model.mechanism import build_mechanism
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.simulate import rollout
from dh2sim.trajectory.files import SampledTrajectory
from dh2sim.view.mechanism.motion import MechanismMotion
from dh2sim.view.mechanism.scene import frame_path, mechanism_scene
from dh2sim.view.mechanism.server import MechanismViewer
from dh2sim.view.motion.replay import open_replay
from dh2sim.view.scene.items import Placed
from tests.program import dh2sim
from tests.view.on_page import field, shown, wait_for_equal, wait_for_text, wait_until, xyz

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext


def test_passive_joints_follow_the_driven_one_and_a_dead_position_stops_it() -> None:
    motion = MechanismMotion(build_mechanism(load_robot("four_bar")))
    motion.move({0: 2.0})
    assert motion.q[0] == 2.0
    assert max(gap.position for gap in closure_gaps(motion.model.tree, motion.q)) < 1e-11
    text = Path("robots/mechanisms/four_bar.yaml").read_text(encoding="utf-8").replace("crank: 0.6", "crank: 1.6")
    stiff = MechanismMotion(build_mechanism(parse_robot(text)))
    before = stiff.q
    with pytest.raises(SingularPositionError, match="dead or singular position at joint_1"):
        stiff.move({0: 3.1})
    assert stiff.q is before


def test_links_and_frames_are_drawn_where_the_table_has_them() -> None:
    model = build_mechanism(load_robot("slider_crank"))
    scene = mechanism_scene(model, model.q)
    table = table_mechanism_frames(model.spec, model.q)
    for name in ("dh_1", "tool0"):
        link = next(path.rpartition("/")[0] for path in scene if path.endswith(f"/{name}"))
        T = _pose(scene[link]) @ _pose(scene[f"{link}/{name}"])
        assert pytest.approx(table[name], abs=1e-12) == T
    assert {closure.name for closure in model.tree.closures} == {
        path.rpartition("closure ")[2] for path in scene if re.search(r"/closure \w+$", path)
    }


def _pose(item: Placed) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotations_of_quaternions(item.orientation), item.position
    return T


def test_the_simulation_holds_the_loops_and_ends_closed() -> None:
    motion = MechanismMotion(build_mechanism(load_robot("five_bar")))
    motion.simulate()
    motion.move({0: motion.wanted[0] + 0.2})
    gap = 0.0
    for _ in range(20):
        gap = max(gap, motion.tick() or 0.0)
    assert gap < 1e-3 * motion.model.size
    motion.stop()
    assert max(each.position for each in closure_gaps(motion.model.tree, motion.q)) < 1e-11


def test_a_page_of_a_mechanism_and_of_its_run_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rollout("four_bar", rollouts=1, steps=20, out="run.zarr")
    still, moving = (
        dh2sim("view", "four_bar", "--export", "a.html"),
        dh2sim("view", "four_bar", "run.zarr", "--export", "b.html"),
    )
    assert (still.out, moving.out) == ("a.html: four_bar\n", "b.html: four_bar, rollout 0 of run.zarr\n")
    assert (tmp_path / "a.html").stat().st_size < (tmp_path / "b.html").stat().st_size
    motion = MechanismMotion(build_mechanism(load_robot("four_bar")))
    replay = open_replay(tmp_path / "run.zarr", motion.model)
    motion.play(replay, 0)
    motion.step()
    gap = motion.tick()
    assert motion.q.tolist() == replay.positions(0)[1].tolist()
    assert gap is not None
    assert 0.0 < gap < 1e-3
    motion.move({0: 2.0})  # the recording moves it
    assert motion.wanted == [replay.positions(0)[1, 0]]
    motion.stop()
    assert max(each.position for each in closure_gaps(motion.model.tree, motion.q)) < 1e-12
    assert np.abs(motion.q - replay.positions(0)[1]).max() < 1e-3


def test_a_trajectory_file_of_all_joints_is_played_with_the_path_of_a_frame(tmp_path: Path) -> None:
    model = build_mechanism(load_robot("four_bar"))
    q = np.array([mechanism_configuration(model.spec, [angle]) for angle in (1.2, 1.5, 1.8)])
    SampledTrajectory.of([joint.name for joint in model.moving_joints], [0, 0.1, 0.2], q).save(tmp_path / "a.csv")
    path = frame_path(model, q, "tool0")
    table = [table_mechanism_frames(model.spec, each)["tool0"][:3, 3] for each in q]
    assert np.array(path.points) == pytest.approx(np.array(table), abs=1e-12)
    done = dh2sim("view", "four_bar", tmp_path / "a.csv", "--export", tmp_path / "a.html")
    assert done.out == f"{tmp_path / 'a.html'}: four_bar, {tmp_path / 'a.csv'}\n"
    (tmp_path / "b.csv").write_text("time,joint_1\n0,1\n1,2\n", encoding="utf-8")
    refused = dh2sim("view", "four_bar", tmp_path / "b.csv", "--no-browser")
    assert refused.status == 2
    assert "its joints are joint_1; the robot has joint_1, joint_2, rocker_joint_1" in refused.err


def test_sliders_move_the_passive_joints_in_the_browser(window: BrowserContext) -> None:
    viewer = MechanismViewer(build_mechanism(load_robot("four_bar")))
    page = window.new_page()
    try:
        page.goto(viewer.url)
        page.locator('[data-dh2sim="passive"] td').first.wait_for()
        before = shown(page, "passive")
        slider = field(page, "joint_1 [°]")
        slider.fill("90")
        slider.press("Enter")
        wait_until(lambda: shown(page, "passive") != before, "the passive joints did not follow")
        served = viewer.pages[0]
        wait_until(lambda: served.motion.q[0] == pytest.approx(0.5 * math.pi), "joint_1 is where it was typed")
        T = table_mechanism_frames(served.motion.model.spec, served.motion.q)["tool0"]
        wait_for_equal(lambda: xyz(page), pytest.approx(T[:3, 3].tolist(), abs=1e-6))
        served.send(lambda: served._start("physics"))
        wait_for_text(page, "readout", "loops open by")
        wait_for_text(page, "not-here", "its file")
    finally:
        page.close()
        viewer.stop()
