"""Trajectory files in the viewer: played like a run, with the path of the tool."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim import plan_trajectory
from dh2sim.errors import TrajectoryError
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.view.motion.motion_source import Recording
from dh2sim.view.motion.replay import open_replay
from dh2sim.view.page_export import tool_path, trajectory_keyframes
from dh2sim.view.scene.items import Polyline
from tests.program import dh2sim
from tests.sample_robots import model, robot


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    file = tmp_path / "motion.csv"
    plan_trajectory(model("puma560"), ["zero", "home"], duration=2.0).save(file, rate=50.0)
    return file


def test_a_trajectory_file_plays_as_a_recording(motion: Path) -> None:
    replay = open_replay(motion, model("puma560"))
    assert replay.rollouts == (0,)
    assert replay.duration(0) == 2.0
    np.testing.assert_allclose(replay.q_at(0, 2.0), model("puma560").home, atol=1e-12)
    recording = Recording(replay, 0)
    assert recording.status == "Trajectory: 0.00 of 2.00 s."
    assert recording.T_world_base_link is None


def test_a_trajectory_of_another_robot_is_refused(motion: Path) -> None:
    with pytest.raises(TrajectoryError, match=r"'.*motion.csv' is not of ur5e: its joints are joint_1, "):
        open_replay(motion, model("ur5e"))


def test_a_page_shows_the_path_of_the_tool_in_every_frame(motion: Path) -> None:
    planned = plan_trajectory(model("puma560"), ["zero", "home"], duration=2.0).sample(rate=50.0)
    frames = list(trajectory_keyframes(model("puma560"), planned))
    assert frames[-1][0] == 2.0
    path = frames[3][1]["/planned"]
    assert isinstance(path, Polyline)
    expected = table_tool_pose(robot("puma560"), planned.q)[:, :3, 3]
    np.testing.assert_allclose(path.points, expected, atol=1e-9)
    assert tool_path(model("puma560"), planned) == path.points


def test_the_command_writes_a_page_of_it(motion: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    run = dh2sim("view", "puma560", motion, "--export", page)
    assert (run.status, run.out) == (0, f"{page}: puma560, {motion}\n")
    assert page.stat().st_size > 10_000
    again = dh2sim("view", "puma560", motion, "--export", tmp_path / "other.html", "--rollout", "1")
    assert again.status == 2
    assert "does not apply to a trajectory file" in again.err
    for arguments in (("ur5e", motion), ("puma560", tmp_path / "none.csv")):
        refused = dh2sim("view", *arguments, "--export", tmp_path / "third.html")
        assert refused.status == 2
        assert "Traceback" not in refused.err
