"""The tool is dragged with the mouse, by its handle in the scene of a real browser."""

from __future__ import annotations

import re
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.read import load_robot
from dh2sim.typing import Array
from dh2sim.view.branches import branches_of
from dh2sim.view.page import Page as ServedPage
from dh2sim.view.scene.link_poses import triad_length
from dh2sim.view.server import Viewer
from dh2sim.view.state import Goal, Part
from dh2sim.workspace import workspace
from tests.view.on_page import (
    DEADLINE,
    OpenPage,
    at_rest,
    field,
    is_soon,
    open_tab,
    pixel,
    shown,
    wait_for_aim,
    wait_for_position,
    wait_for_text,
    wait_for_whole_text,
    wait_until,
)

if TYPE_CHECKING:
    from playwright.sync_api import Page

STANFORD = load_robot("stanford")
ARROW = 1.6 * 0.9
"""Where the middle of an arrow's head is, as a share of the length of frames' axes."""


def goal_of(served: ServedPage) -> Goal:
    goal = served.state.goal
    assert goal is not None
    return goal


def drag(page: Page, served: ServedPage, axis: int, metres: float) -> None:
    """Drag the arrow of an axis of tool0 with the mouse, and let go; again where the handle was not there yet."""
    wait_for_aim(served)
    before, T = served.state.goal, table_tool_pose(STANFORD, served.state.q)

    def pulled() -> bool:
        head = ARROW * triad_length(served.state.model)
        start, end = (pixel(page, served, T[:3, 3] + far * T[:3, axis]) for far in (head, head + metres))
        page.mouse.move(*start)
        page.mouse.down()
        page.mouse.move(*end, steps=8)
        page.mouse.up()
        return is_soon(lambda: served.state.goal is not before)

    wait_until(pulled, "the handle is grabbed")
    wait_until(lambda: abs(far_along(served, T, axis) / metres - 1.0) < 0.03, "the handle is where the mouse is")


def far_along(served: ServedPage, T: Array, axis: int) -> float:
    """How far the goal is from a pose along one of its axes, m; it is nowhere else."""
    moved = np.linalg.inv(T) @ np.array(goal_of(served).T_base_link_tool0)
    assert np.allclose(np.delete(moved[:3, 3], axis), 0.0, rtol=0, atol=1e-5)
    assert np.allclose(moved[:3, :3], np.eye(3), rtol=0, atol=1e-5)
    return float(moved[axis, 3])


def assert_joints_are_inside_their_limits(served: ServedPage) -> None:
    for row, value in zip(STANFORD.moving_rows, served.state.q, strict=True):
        assert row.limits.position is not None
        lower, upper = row.limits.position
        assert lower <= value <= upper, row.name


def test_tool0_follows_its_handle_and_the_page_says_where_it_cannot(
    open_page: OpenPage, viewer: Viewer, tmp_path: Path
) -> None:
    page = open_page()
    (served,) = viewer.pages
    assert Part.HANDLE in served.state.shown
    before = table_tool_pose(STANFORD, served.state.q)

    drag(page, served, 1, 0.12)
    wait_until(lambda: goal_of(served).reached, "tool0 is there")
    state = at_rest(lambda: served.state)
    tool = table_tool_pose(STANFORD, state.q)
    assert state.goal is not None
    assert np.allclose(tool, state.goal.T_base_link_tool0, rtol=0, atol=2e-6)
    assert tool[:3, 3] @ before[:3, 1] - before[:3, 3] @ before[:3, 1] > 0.1
    assert_joints_are_inside_their_limits(served)
    wait_for_whole_text(page, "notice", "")
    open_tab(page, "Joints")
    wait_for_position(page, STANFORD, state.q)

    drag(page, served, 0, 2.0)
    wait_until(lambda: not goal_of(served).reached, "that is out of reach")
    notice = r"The handle is out of reach, or too far for one step: tool0 is (\S+) m away and turned by (\S+)°\."

    def told_and_true() -> bool:  # the notice follows the handle, which is still being dragged at first
        found, state = re.fullmatch(notice, shown(page, "notice")), served.state
        assert state.goal is not None
        tool, goal = table_tool_pose(STANFORD, state.q), np.array(state.goal.T_base_link_tool0)
        distance = float(np.linalg.norm(tool[:3, 3] - goal[:3, 3]))
        return found is not None and bool(np.isclose(float(found.group(1)), distance, rtol=1e-2))

    wait_until(told_and_true, lambda: shown(page, "notice"))
    assert_joints_are_inside_their_limits(served)
    wait_for_position(page, STANFORD, lambda: served.state.q)

    page.get_by_role("button", name="home").click()
    wait_for_whole_text(page, "notice", "")  # another move is another goal


def test_branches_are_listed_and_clicked_through(open_page: OpenPage, viewer: Viewer) -> None:
    page = open_page()
    open_tab(page, "Pose")
    (served,) = viewer.pages
    page.get_by_label("All in scene").click()
    page.get_by_role("button", name="2", exact=True).wait_for()
    listed = branches_of(served.state).branches
    other = next(number for number, branch in enumerate(listed, start=1) if not branch.here)
    page.get_by_role("button", name=str(other), exact=True).click()
    wait_until(lambda: served.state.q == listed[other - 1].q, "the robot is in the other branch")
    wait_for_text(page, "branch", listed[other - 1].name)


def test_the_workspace_is_searched_while_the_page_goes_on(
    open_page: OpenPage, viewer: Viewer, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on = threading.Event()

    def compute_workspace(*arguments: Any, **options: Any) -> workspace.Workspace:
        assert go_on.wait(DEADLINE), "a search is held up until it has been seen"
        return searched(*arguments, **options)

    searched = workspace.compute_workspace
    monkeypatch.setattr(workspace, "compute_workspace", compute_workspace)
    page = open_page()
    open_tab(page, "Pose")
    (served,) = viewer.pages
    page.get_by_label("Reachable points").first.click()
    wait_for_text(page, "workspace", "…")
    go_on.set()
    wait_until(lambda: "/workspace/points" in served._painter._drawn, "the points")
    wait_for_text(page, "workspace", "best manipulability")
    page.get_by_label("Section in scene").first.click()
    wait_until(lambda: "/section/plane/limits" in served._painter._drawn, "the section")
    wait_for_text(page, "workspace", "section")
    go_on.clear()
    open_tab(page, "Table")
    field(page, "d₂").fill("0.25")
    wait_until(lambda: served.state.spec.rows[1].d == 0.25, "another robot")
    wait_until(lambda: served.state.workspace is None, "whose workspace is another")
    go_on.set()
    wait_until(lambda: served.state.workspace is not None, "and is searched by itself")
