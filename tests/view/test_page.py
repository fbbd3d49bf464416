"""The page in a real browser: what its panel shows is what the library computes."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dh2sim.engines.mujoco_engine import MujocoEngine
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.row import Convention
from dh2sim.view.initial_state import folder_of, open_state
from dh2sim.view.motion import row_animation
from dh2sim.view.motion.row_animation import STEP_SECONDS, ZERO_SECONDS
from dh2sim.view.scene.ghost import misread_text
from dh2sim.view.server import Viewer
from tests.view.on_page import (
    OpenPage,
    Serve,
    at_rest,
    choose,
    field,
    is_soon,
    open_tab,
    pixel,
    shown,
    wait_for_aim,
    wait_for_equal,
    wait_for_matrix,
    wait_for_position,
    wait_for_text,
    wait_for_value,
    wait_for_whole_text,
    wait_until,
    xyz,
)

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

    from dh2sim.view.page import Page as ServedPage

HOME = load_robot("stanford").configurations["home"].tolist()


def test_a_number_beyond_a_limit_stops_there_and_nonsense_moves_nothing(open_page: OpenPage) -> None:
    page, spec = open_page(), load_robot("stanford")
    field(page, "joint_5 [°]").fill("1000")
    wait_for_position(page, spec, [*HOME[:4], math.pi / 2, HOME[5]])
    field(page, "joint_5 [°]").fill("-")
    field(page, "joint_1 [°]").fill("abc")
    field(page, "joint_3 [m]").fill("0.1")
    wait_for_position(page, spec, [*HOME[:2], 0.1, HOME[3], math.pi / 2, HOME[5]])


def test_pages_have_their_own_states_and_a_reload_starts_again(open_page: OpenPage, viewer: Viewer) -> None:
    first, second, spec = open_page(), open_page(), load_robot("stanford")
    first.get_by_role("button", name="zero").click()
    wait_for_position(first, spec, [0.0] * 6)
    wait_for_position(second, spec, HOME)
    first.reload()
    first.get_by_role("tab", name="Joints").wait_for()
    wait_for_position(first, spec, HOME)
    wait_until(lambda: len(viewer.pages) == 2, "the page of before the reload is closed")


def test_the_pose_is_shown_in_all_notations_with_its_difference_to_mujoco(
    open_page: OpenPage, viewer: Viewer, tmp_path: Path
) -> None:
    page, spec = open_page(), load_robot("stanford")
    open_tab(page, "Pose")
    wait_for_matrix(page, "matrix", table_tool_pose(spec, HOME))
    wait_for_text(page, "mujoco", "Difference to MuJoCo")
    found = re.search(r"Difference to MuJoCo: (\S+) m, (\S+) rad", shown(page, "mujoco"))
    assert found is not None
    assert all(float(number) < 1e-12 for number in found.groups())
    choose(page, "in", "dh_2")
    wait_until(lambda: "tool0 in dh_2" in page.get_by_text("Pose of ").inner_text(), "another frame")
    relative = np.linalg.solve(table_frame_poses(spec, HOME)[2], table_tool_pose(spec, HOME))
    wait_for_matrix(page, "matrix", relative)
    page.get_by_text("Ellipsoid in scene").click()
    wait_until(lambda: "/ellipsoid/surface" in viewer.pages[0]._painter._drawn, "the ellipsoid")


def test_files_are_downloaded_as_edited_and_the_model_matches_the_table(
    open_page: OpenPage, viewer: Viewer, tmp_path: Path
) -> None:
    page = open_page()
    (served,) = viewer.pages
    open_tab(page, "Table")
    field(page, "a₁").fill("0.123")
    wait_until(lambda: served.state.spec.rows[0].a == 0.123, "the cell")
    open_tab(page, "Files")
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save robot file").click()
    assert saved.value.suggested_filename == "stanford.yaml"
    text = saved.value.path().read_text(encoding="utf-8")
    robot = parse_robot(text)
    assert robot.rows[0].a == 0.123
    assert "# printed in the slides" in text, "comments are kept"
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save MJCF").click()
    saved.value.save_as(tmp_path / "stanford.xml")
    engine = MujocoEngine(tmp_path / "stanford.xml", [row.name for row in robot.moving_rows], len(robot.rows))
    tool = engine.frame_poses(np.array([HOME]))[0, engine.frames.index("tool0")]
    assert np.allclose(tool, table_tool_pose(robot, HOME), rtol=0, atol=1e-12)
    wait_for_text(page, "notice", "stanford.xml: largest difference to the table")


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
    page.get_by_role("button", name="zero").click()
    wait_for_position(page, spec, [0.0] * 6)
    wait_for_value(page, "joint_1 [°]", "0")


def test_the_table_is_edited_marked_reread_and_restored(open_page: OpenPage, viewer: Viewer, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    (served,) = viewer.pages
    open_tab(page, "Table")
    field(page, "d₂").fill("d2 + 0.1")
    wait_until(lambda: served.state.spec.rows[1].d == 0.25, "the cell")
    wait_for_value(page, "Row", "2: joint_2")
    open_tab(page, "Joints")
    edited = parse_robot(spec.source_file.text.replace("d: d2", "d: 0.25"))  # type: ignore[union-attr]
    wait_for_position(page, edited, HOME)
    open_tab(page, "Table")
    field(page, "α₂").fill("90 +")
    wait_for_text(page, "cell-errors", "it ends too early")
    red, color = "rgb(180, 35, 24)", "cell => getComputedStyle(cell).color"
    wait_until(lambda: field(page, "α₂").evaluate(color) == red, "the cell is marked")
    assert field(page, "α₁").evaluate(color) != red
    wait_for_whole_text(page, "notice", "Robot unchanged: joints[1].alpha: in '90 +': it ends too early")
    open_tab(page, "Joints")
    wait_for_position(page, edited, HOME)
    open_tab(page, "Table")
    field(page, "α₂").fill("pi / pi * 45")
    choose(page, "convention₂", "modified")
    wait_for_text(page, "conventions", "modified")
    wait_for_equal(page.locator("label", has_text="α₂").count, 0)
    wait_for_equal(page.locator("label", has_text="α₁").count, 2)  # its index in this convention
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


def test_cells_are_a_grid_and_an_error_moves_nothing(open_page: OpenPage) -> None:
    page = open_page()
    open_tab(page, "Table")
    labels = ("a₁", "α₁", "d₁", "θ₁", "a₆", "θ₆")
    boxes = at_rest(lambda: {label: box_of(field(page, label)) for label in labels})
    for row in (("a₁", "α₁", "d₁", "θ₁"), ("a₆", "θ₆")):
        assert len({boxes[label]["y"] for label in row}) == 1, "a row is a line"
        edges = [boxes[label]["x"] for label in row]
        assert edges == sorted(edges)
    assert boxes["a₁"]["x"] == boxes["a₆"]["x"], "a column, too"
    panel = page.get_by_role("tab", name="Table").bounding_box()
    field(page, "α₂").fill("90 +")
    wait_for_text(page, "notice", "it ends too early")
    wait_for_text(page, "cell-errors", "it ends too early")
    assert at_rest(lambda: {label: box_of(field(page, label)) for label in labels}) == boxes
    assert page.get_by_role("tab", name="Table").bounding_box() == panel
    notice = at_rest(page.locator('[data-dh2sim="notice"]').bounding_box)
    assert notice is not None
    assert notice["y"] > 0.7 * 640, "at the bottom of the window"


def box_of(cell: Locator) -> dict[str, float]:
    box = cell.bounding_box()
    assert box is not None
    return {"x": box["x"], "y": box["y"], "width": box["width"], "height": box["height"]}


def test_a_row_plays_step_by_step(open_page: OpenPage, viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]  # stands still while a step is looked at
    monkeypatch.setattr(row_animation, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    page = open_page()
    (served,) = viewer.pages
    open_tab(page, "Table")
    page.get_by_role("button", name="2", exact=True).click()
    wait_until(lambda: served.state.selected_row == 1, "the button of a row selects it")
    page.get_by_role("button", name="Play the row's steps").click()
    wait_for_text(page, "step", "Step 1 of 4: Rz(θ₂* = 50.0°)")
    wait_until(lambda: "/row/moving_frame" in served._painter._drawn, "the frame that moves")
    clock[0] = 1.1 * STEP_SECONDS
    wait_for_text(page, "step", "Step 2 of 4: Tz(d₂ = 0.15 m)")
    clock[0] = 2.1 * STEP_SECONDS + ZERO_SECONDS
    wait_for_text(page, "step", "Step 4 of 4: Rx(α₂ = 90°)")
    clock[0] = 3.1 * STEP_SECONDS + ZERO_SECONDS
    wait_until(lambda: not served.state.row_playing, "the end")


def test_physics_moves_the_robot_until_manual_mode_is_chosen(open_page: OpenPage, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    open_tab(page, "Motion")
    choose(page, "Actuators", "free")
    choose(page, "Mode", "physics")
    wait_until(lambda: simulated(page) >= 1.0, "a second is simulated")
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    before = at_rest(lambda: simulated(page))
    page.get_by_role("button", name="Step", exact=True).click()
    wait_until(lambda: simulated(page) == pytest.approx(before + 0.002), "a time step")
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


def test_a_link_is_dragged_with_the_mouse(open_page: OpenPage, viewer: Viewer, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    open_tab(page, "Motion")
    choose(page, "Mode", "physics")
    wait_until(lambda: simulated(page) > 0.1, "the simulation runs")
    (served,) = viewer.pages
    wait_for_aim(served)
    shoulder, wrist = table_frame_poses(spec, HOME)[[2, 3], :3, 3]
    x, y = pixel(page, served, 0.5 * (shoulder + wrist))  # amid link 3, a long beam

    def grabbed() -> bool:  # unless the browser does not have the link there yet
        page.mouse.up()
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 40, y, steps=4)
        page.mouse.move(x + 60, y - 10, steps=4)
        return is_soon(lambda: served.state.drag is not None)

    wait_until(grabbed, "the link is grabbed")
    drag = served.state.drag
    assert drag is not None
    assert drag.link == "link_3"
    wait_for_text(page, "motion", f"Force on {drag.link}: ")
    wait_until(lambda: math.dist(pixel(page, served, target(served)), (x + 60, y - 10)) < 3.0, "the mouse is there")
    page.mouse.up()
    wait_until(lambda: served.state.drag is None, "the link is released")
    wait_until(lambda: "Force on" not in shown(page, "motion"), "the force is gone")


def target(served: ServedPage) -> Sequence[float]:
    """Where the mouse pulls to, m."""
    drag = served.state.drag
    assert drag is not None
    return drag.target


def test_another_robot_or_the_misread_table_is_shown_as_a_ghost(open_page: OpenPage, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    open_tab(page, "Show")
    choose(page, "Ghost", "this table, misread")
    wait_for_text(page, "ghost", "Read as modified, this table has tool0 ")
    wait_for_whole_text(page, "ghost", misread_text(spec, HOME))
    choose(page, "Ghost", "scara")
    wait_until(lambda: shown(page, "ghost").startswith("scara has tool0 "), "another robot")
    choose(page, "Ghost", "none")
    wait_for_whole_text(page, "ghost", "")


@pytest.mark.slow
@pytest.mark.parametrize("robot", builtin_robots())
def test_every_built_in_robot_opens_at_home(serve: Serve, robot: str) -> None:
    spec = load_robot(robot)
    page, served = serve(open_state(spec, folder_of(robot)))
    zero = [0.0] * len(spec.moving_rows)
    wait_for_position(page, spec, spec.configurations["home"].tolist() if "home" in spec.configurations else zero)
    wait_until(lambda: page.get_by_role("slider").count() >= len(spec.moving_rows), "a slider for each joint")
    for number in range(1, len(spec.rows) + 1):
        assert served.client.scene.get_handle_by_name(f"/robot/link_{number}") is not None
    wait_until(lambda: page.get_by_text(f"dh2sim · {spec.name}").first.is_visible(), "its name")
