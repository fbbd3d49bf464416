"""A goal that the tool does not reach is described and marked."""

from __future__ import annotations

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.view.events import Event, MoveJoint, MoveTool, SetMode, Show
from dh2sim.view.scene.items import Polyline
from dh2sim.view.scene.scene import goal_text, scene_of
from dh2sim.view.state import Matrix, Mode, Part
from tests.view.states import STANFORD, after

HANDLE = Show(part=Part.HANDLE, on=True)
TOOL = table_tool_pose(STANFORD.spec, STANFORD.q)


def wanted(*, reached: bool, turned: bool = False) -> MoveTool:
    """tool0 wanted half a metre above where it is; and turned by a right angle about its z."""
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) if turned else np.eye(3)
    goal = TOOL.copy()
    goal[:3, :3] = TOOL[:3, :3] @ turn
    goal[2, 3] += 0.5
    rows: Matrix = tuple(tuple(row) for row in goal.tolist())
    return MoveTool(T_base_link_tool0=rows, q=STANFORD.q, reached=reached)


@pytest.mark.parametrize(("turned", "how_far"), [(False, "0.5 m away"), (True, "0.5 m away and turned by 90°")])
def test_a_missed_goal_is_described_and_marked_by_a_line(turned: bool, how_far: str) -> None:
    state = after(STANFORD, HANDLE, wanted(reached=False, turned=turned))
    assert goal_text(state) == f"The handle is out of reach, or too far for one step: tool0 is {how_far}."
    line = scene_of(state)["/goal"]
    assert isinstance(line, Polyline)
    x, y, z = TOOL[:3, 3]
    assert np.allclose(line.points, [(x, y, z), (x, y, z + 0.5)], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "happened",
    [
        (HANDLE, wanted(reached=True)),
        (HANDLE, wanted(reached=False), MoveJoint(joint=0, value=0.1)),
        (HANDLE, wanted(reached=False), SetMode(mode=Mode.PHYSICS)),
        (HANDLE, wanted(reached=False), Show(part=Part.HANDLE, on=False)),
    ],
    ids=["reached", "moved otherwise", "simulated", "no handle"],
)
def test_a_goal_that_is_reached_or_given_up_is_not_marked(happened: tuple[Event, ...]) -> None:
    state = after(STANFORD, *happened)
    assert goal_text(state) == ""
    assert "/goal" not in scene_of(state)


def test_a_handle_shown_again_is_at_the_tool() -> None:
    assert after(STANFORD, HANDLE, wanted(reached=False), Show(part=Part.HANDLE, on=False), HANDLE).goal is None
