"""The line where tool0 was: only ways that it went."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.view.events import Follow, SetMode, Show
from dh2sim.view.motion.motion_source import Recording
from dh2sim.view.motion.replay import open_replay
from dh2sim.view.state import Mode, Part
from tests.program import dh2sim
from tests.view.states import STANFORD, after

PLACES = [(0.1 * k, 0.5, 0.3, 0.0, 0.2, 0.0) for k in range(4)]


def tool(q: tuple[float, ...]) -> list[float]:
    place: list[float] = table_tool_pose(STANFORD.spec, q)[:3, 3].tolist()
    return place


def test_a_jump_of_a_recording_starts_another_trace() -> None:
    played = after(STANFORD, Show(part=Part.TRACE, on=True), SetMode(mode=Mode.REPLAY))
    begun = after(played, Follow(q=PLACES[0], jumps=True), Follow(q=PLACES[1]), Follow(q=PLACES[2]))
    assert np.allclose(begun.trace, [tool(q) for q in PLACES[:3]], rtol=0, atol=1e-12)
    wound = after(begun, Follow(q=PLACES[0], jumps=True), Follow(q=PLACES[3]))
    assert np.allclose(wound.trace, [tool(PLACES[0]), tool(PLACES[3])], rtol=0, atol=1e-12)


def test_a_recording_jumps_only_at_its_start_its_end_and_when_searched(tmp_path: Path) -> None:
    out = tmp_path / "run.zarr"
    done = dh2sim("rollout", "stanford", "--out", out, "--rollouts", "1", "--duration", "1", "--quiet")
    assert done.status == 0, done.err
    recording = Recording(open_replay(out, STANFORD.model), 0)
    jumps = []
    for now, share in ((0.0, None), (0.3, None), (0.6, 0.2), (0.7, None), (1.3, None), (1.6, None), (1.7, None)):
        if share is not None:
            recording.seek(share)
        recording.tick(now, STANFORD)
        jumps.append((round(recording.time, 6), recording.jumps))
    assert jumps == [(0.0, True), (0.3, False), (0.5, True), (0.6, False), (0.2, True), (0.5, False), (0.6, False)]
    recording.tick(1.8, replace(STANFORD, paused=True))
    assert recording.time == pytest.approx(0.6)
    assert not recording.jumps
