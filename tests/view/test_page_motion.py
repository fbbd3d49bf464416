"""What moves the joints of a page besides its user: simulated and recorded motion, by the clock."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dh2sim.kinematics.table import table_tool_pose
from dh2sim.robot.load import load_robot
from dh2sim.view.motion import Recording, Simulation
from dh2sim.view.opening import open_state
from dh2sim.view.replay import Replay, open_replay
from tests.program import dh2sim

STANFORD = open_state(load_robot("stanford"))


@pytest.fixture(scope="module")
def replay(tmp_path_factory: pytest.TempPathFactory) -> Replay:
    path: Path = tmp_path_factory.mktemp("run") / "run.zarr"
    done = dh2sim("rollout", "stanford", "--rollouts", "2", "--duration", "1", "--out", path, "--quiet")
    assert done.status == 0, done.err
    return open_replay(path, STANFORD.model)


def test_a_simulation_goes_with_the_clock_and_holds_the_robot_where_it_was() -> None:
    simulation = Simulation(STANFORD.model, STANFORD.q, gravity=True, drive="position")
    for now in (10.0, 10.05, 10.1, 10.15):
        q = simulation.tick(now, STANFORD)
    assert 0.0 < simulation.physics.time <= 0.15 + 1e-9
    assert np.allclose(q, STANFORD.q, rtol=0, atol=1e-3)
    assert simulation.told.startswith("Simulated: 0.")


def test_a_simulated_robot_follows_the_targets() -> None:
    simulation = Simulation(STANFORD.model, STANFORD.q, gravity=False, drive="position")
    target = (STANFORD.q[0] + 0.5, *STANFORD.q[1:])
    state = replace(STANFORD, target=target)
    for k in range(200):
        q = simulation.tick(0.05 * k, state)
        if abs(q[0] - target[0]) < 0.05:
            break
    assert q[0] == pytest.approx(target[0], abs=0.05)


def test_a_robot_that_nothing_drives_falls() -> None:
    simulation = Simulation(STANFORD.model, STANFORD.q, gravity=True, drive="free")
    for k in range(40):
        q = simulation.tick(0.05 * k, STANFORD)
    height = table_tool_pose(STANFORD.spec, q)[2, 3]
    assert height < table_tool_pose(STANFORD.spec, STANFORD.q)[2, 3] - 0.05


def test_a_recording_is_played_by_the_clock_again_and_again(replay: Replay) -> None:
    recording = Recording(replay, 1)
    assert recording.duration == pytest.approx(1.0)
    for now, instant in ((100.0, 0.0), (100.25, 0.25), (101.125, 0.125)):
        assert recording.tick(now, STANFORD) == tuple(replay.q_at(1, instant).tolist())
        assert recording.time == pytest.approx(instant)
    assert recording.told == "Rollout 1: 0.12 of 1.00 s."


def test_a_recording_can_be_stopped_slowed_down_and_wound(replay: Replay) -> None:
    recording = Recording(replay, 0)
    recording.tick(0.0, STANFORD)
    recording.seek(0.5)
    assert recording.tick(0.0, STANFORD) == tuple(replay.q_at(0, 0.5).tolist())
    recording.pace(playing=False, speed=1.0)
    recording.tick(0.3, STANFORD)
    assert recording.time == 0.5
    recording.pace(playing=True, speed=0.25)
    recording.tick(0.7, STANFORD)
    assert recording.time == pytest.approx(0.6)
    recording.seek(7.0)
    assert recording.time == recording.duration
