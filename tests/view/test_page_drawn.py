"""The page in a real browser that draws: screenshots are kept among the files of the run."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.spec import Convention
from dh2sim.view.scene.ghost import misread_text
from dh2sim.view.server import Viewer
from tests.view.on_page import OpenPage, choose, field, open_tab, pixel, shown, wait_for_position, wait_until, xyz

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from dh2sim.view.page import Page as ServedPage

HOME = load_robot("stanford").configurations["home"].tolist()


def test_joints_are_moved_by_number_slider_key_and_name(open_page: OpenPage, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    wait_for_position(page, spec, HOME)
    q = list(HOME)
    field(page, "joint_1 [°]").fill("-45.5")
    q[0] = math.radians(-45.5)
    wait_for_position(page, spec, q)
    page.get_by_role("slider").nth(2).focus()
    page.keyboard.press("End")
    q[2] = 1.27
    wait_for_position(page, spec, q)
    page.locator("canvas").first.focus()
    page.keyboard.press("6")
    q[1] += math.radians(3.0)
    wait_for_position(page, spec, q)
    page.screenshot(path=tmp_path / "joints.png")
    page.get_by_role("button", name="zero").click()
    wait_for_position(page, spec, [0.0] * 6)
    assert field(page, "joint_1 [°]").input_value() == "0"


def test_the_table_is_edited_marked_read_another_way_and_taken_back(open_page: OpenPage, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    open_tab(page, "Table")
    choose(page, "Edit row", "2: joint_2")
    field(page, "d₂").fill("d2 + 0.1")
    wait_until(lambda: "d2 + 0.1" in shown(page, "table"), "the cell")
    open_tab(page, "Joints")
    edited = parse_robot(spec.source_file.text.replace("d: d2", "d: 0.25"))  # type: ignore[union-attr]
    wait_for_position(page, edited, HOME)
    open_tab(page, "Table")
    field(page, "α₂").fill("90 +")
    wait_until(lambda: "it ends too early" in shown(page, "error"), "the error")
    assert shown(page, "notice") == "Robot unchanged: joints[1].alpha: in '90 +': it ends too early"
    page.screenshot(path=tmp_path / "table.png")
    open_tab(page, "Joints")
    wait_for_position(page, edited, HOME)
    open_tab(page, "Table")
    field(page, "α₂").fill("pi / pi * 45")
    choose(page, "convention₂", "modified")
    wait_until(lambda: "modified" in shown(page, "table"), "the convention")
    assert field(page, "α₁").input_value() == "pi / pi * 45", "its index in this convention"
    open_tab(page, "Joints")
    text = edited.source_file.text.replace(  # type: ignore[union-attr]
        "alpha: 90, d: 0.25", "alpha: 45, d: 0.25, convention: modified"
    )
    other = parse_robot(text)
    assert other.rows[1].convention is Convention.MODIFIED
    wait_for_position(page, other, HOME)
    open_tab(page, "Table")
    undo = page.get_by_role("button", name="Undo", exact=True)
    for _ in range(3):  # the convention, the angle, the length
        undo.click()
    wait_until(undo.is_disabled, "all edits are taken back")
    open_tab(page, "Joints")
    wait_for_position(page, spec, HOME)


def test_physics_moves_the_robot_until_it_is_given_back(open_page: OpenPage, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    open_tab(page, "Motion")
    choose(page, "Actuators", "free")
    choose(page, "Mode", "physics")
    wait_until(lambda: simulated(page) >= 1.0, "a second is simulated")
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    before = simulated(page)
    page.get_by_role("button", name="Step", exact=True).click()
    wait_until(lambda: simulated(page) == pytest.approx(before + 0.002), "a time step")
    page.screenshot(path=tmp_path / "motion.png")
    open_tab(page, "Joints")
    home = table_tool_pose(spec, HOME)[:3, 3]
    wait_until(lambda: math.dist(xyz(page), home) > 0.1, "the arm falls")
    open_tab(page, "Motion")
    choose(page, "Mode", "manual")
    open_tab(page, "Joints")
    page.get_by_role("button", name="home").click()
    wait_for_position(page, spec, HOME)


def simulated(page: Page) -> float:
    """The simulated time that the page shows, s."""
    found = re.match(r"Simulated: (\S+) s", shown(page, "motion"))
    return float(found.group(1)) if found else -1.0


def test_a_link_is_pulled_at_with_the_mouse(open_page: OpenPage, viewer: Viewer, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    open_tab(page, "Motion")
    choose(page, "Mode", "physics")
    wait_until(lambda: simulated(page) > 0.1, "the simulation runs")
    (served,) = viewer.pages
    shoulder, wrist = table_frame_poses(spec, HOME)[[2, 3], :3, 3]
    x, y = pixel(page, served, 0.5 * (shoulder + wrist))  # amid link 3, a long beam
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y, steps=4)
    page.mouse.move(x + 60, y - 10, steps=4)
    wait_until(lambda: served.state.drag is not None, "the link is grabbed")
    drag = served.state.drag
    assert drag is not None
    assert drag.link == "link_3"
    wait_until(lambda: f"Force on {drag.link}: " in shown(page, "motion"), "it is told")
    wait_until(lambda: math.dist(pixel(page, served, target(served)), (x + 60, y - 10)) < 3.0, "the mouse is there")
    page.screenshot(path=tmp_path / "drag.png")
    page.mouse.up()
    wait_until(lambda: served.state.drag is None, "the link is let go")
    wait_until(lambda: "Force on" not in shown(page, "motion"), "no more is told")


def target(served: ServedPage) -> Sequence[float]:
    """Where the mouse pulls to, m."""
    drag = served.state.drag
    assert drag is not None
    return drag.target


def test_another_robot_or_the_table_misread_stands_beside_as_a_ghost(open_page: OpenPage, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    open_tab(page, "Show")
    choose(page, "Ghost", "this table, misread")
    wait_until(lambda: "Read as modified, this table has tool0 " in shown(page, "ghost"), "the misread table")
    assert shown(page, "ghost") == misread_text(spec, HOME)
    choose(page, "Ghost", "scara")
    wait_until(lambda: shown(page, "ghost").startswith("scara has tool0 "), "another robot")
    page.screenshot(path=tmp_path / "ghost.png")
    choose(page, "Ghost", "none")
    wait_until(lambda: not shown(page, "ghost"), "no ghost")
