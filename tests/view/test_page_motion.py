"""What moves the joints of a page besides its user: simulated and recorded motion, by the clock."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.view.motion.motion_source import Recording, Simulation
from dh2sim.view.motion.replay import Replay, open_replay
from dh2sim.view.state import LinkDrag
from tests.program import dh2sim
from tests.view.states import STANFORD

PAUSED = replace(STANFORD, paused=True)


@pytest.fixture(scope="module")
def replay(tmp_path_factory: pytest.TempPathFactory) -> Replay:
    path: Path = tmp_path_factory.mktemp("run") / "run.zarr"
    done = dh2sim("rollout", "stanford", "--rollouts", "2", "--duration", "1", "--out", path, "--quiet")
    assert done.status == 0, done.err
    return open_replay(path, STANFORD.model)


def test_a_simulation_follows_the_clock_and_holds_the_robot_in_place() -> None:
    simulation = Simulation(STANFORD.model, STANFORD.q, gravity=True, drive="position")
    for now in (10.0, 10.05, 10.1, 10.15):
        q = simulation.tick(now, STANFORD)
    assert 0.0 < simulation.physics.time <= 0.15 + 1e-9
    assert np.allclose(q, STANFORD.q, rtol=0, atol=1e-3)
    assert re.fullmatch(r"Simulated: 0\.\d{3} s, \d\.\d\d x real time\.", simulation.status)
    assert simulation.progress == 0.0


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


def test_a_paused_simulation_makes_only_the_requested_steps() -> None:
    simulation = Simulation(STANFORD.model, STANFORD.q, gravity=True, drive="free")
    step = simulation.physics.timestep
    simulation.tick(0.0, STANFORD)
    simulation.tick(5.0, PAUSED)
    assert simulation.physics.time == 0.0
    for steps, now in ((1, 5.1), (1, 5.2), (4, 5.3)):
        simulation.tick(now, replace(PAUSED, steps=steps))
        assert simulation.physics.time == pytest.approx(steps * step)
    assert simulation.status == f"Simulated: {4 * step:.3f} s."
    simulation.tick(9.0, replace(STANFORD, steps=4))
    assert simulation.physics.time == pytest.approx(4 * step), "the pause is not made up for"
    simulation.tick(9.05, replace(STANFORD, steps=4))
    assert simulation.physics.time > 4 * step


def test_gravity_and_actuators_are_switched_while_the_robot_moves() -> None:
    simulation = Simulation(STANFORD.model, STANFORD.q, gravity=True, drive="free")
    simulation.tick(0.0, STANFORD)
    for k in range(1, 11):
        simulation.tick(0.02 * k, STANFORD)
    moving = simulation.physics.qvel
    assert np.abs(moving).max() > 0.1
    simulation.set_physics(gravity=False, drive="free")
    assert simulation.physics.qvel.tolist() == moving.tolist(), "it goes on as fast as it is"
    before = sum(simulation.physics.energy)
    simulation.tick(0.25, STANFORD)
    assert simulation.physics.time == pytest.approx(0.25, abs=0.01)
    assert sum(simulation.physics.energy) == pytest.approx(before, rel=1e-2), "nothing drives it any more"
    simulation.set_physics(gravity=False, drive="position")
    for k in range(1, 101):
        simulation.tick(0.25 + 0.03 * k, STANFORD)
    assert np.allclose(simulation.physics.q, STANFORD.q, rtol=0, atol=0.02), "it is brought back"


def test_a_dragged_link_follows_the_mouse_until_it_is_released() -> None:
    simulation = Simulation(STANFORD.model, STANFORD.q, gravity=False, drive="free")
    drag = LinkDrag(link="link_3", point_in_link=(0.0, 0.0, 0.1), target=(0.5, 0.5, 0.5))
    pulled = replace(STANFORD, drag=drag)
    simulation.tick(0.0, pulled)
    assert simulation.physics.applied_force is not None
    point, force = simulation.physics.applied_force
    before = math.dist(point, drag.target)
    assert simulation.status == f"Simulated: 0.000 s. Force on link_3: {np.linalg.norm(force):.3g} N."
    for k in range(1, 41):
        simulation.tick(0.05 * k, pulled)
    assert math.dist(simulation.physics.applied_force[0], drag.target) < 0.5 * before
    simulation.tick(2.05, STANFORD)
    assert np.allclose(simulation.physics._data.qfrc_applied, 0.0)
    assert "pulled" not in simulation.status


def test_a_paused_recording_steps_from_one_recorded_time_to_the_next(replay: Replay) -> None:
    recording, times = Recording(replay, 0), replay.times(0)
    assert recording.tick(0.0, replace(PAUSED, steps=2)) == tuple(replay.q_at(0, times[2]).tolist())
    assert recording.time == times[2]
    recording.tick(7.0, replace(PAUSED, steps=3))
    assert recording.time == times[3]
    recording.seek(1.0)
    recording.tick(7.0, replace(PAUSED, steps=4))
    assert recording.time == times[0]


def test_a_recording_is_played_by_the_clock_again_and_again(replay: Replay) -> None:
    recording = Recording(replay, 1)
    assert recording.duration == pytest.approx(1.0)
    for now, instant in ((100.0, 0.0), (100.25, 0.25), (101.125, 0.125)):
        assert recording.tick(now, STANFORD) == tuple(replay.q_at(1, instant).tolist())
        assert recording.time == pytest.approx(instant)
    assert recording.status == "Rollout 1: 0.12 of 1.00 s."


def test_a_recording_can_be_stopped_slowed_down_and_wound(replay: Replay) -> None:
    recording = Recording(replay, 0)
    recording.tick(0.0, STANFORD)
    recording.seek(0.5)
    assert recording.tick(0.0, STANFORD) == tuple(replay.q_at(0, 0.5).tolist())
    assert recording.progress == pytest.approx(0.5)
    recording.tick(0.3, PAUSED)
    assert recording.time == 0.5
    recording.set_speed(0.25)
    recording.tick(0.7, STANFORD)
    assert recording.time == pytest.approx(0.6)
    recording.seek(7.0)
    assert recording.time == recording.duration
