"""Keys that move joints, in a real browser."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dh2sim.robot.read import load_robot
from dh2sim.view.initial_state import open_state
from dh2sim.view.page import Page as ServedPage
from tests.view.on_page import Serve, choose, field, open_tab, wait_for_aim, wait_for_position, wait_until

if TYPE_CHECKING:
    from playwright.sync_api import Page

SSRMS, STANFORD = load_robot("ssrms"), load_robot("stanford")
PAIRS = [("1", "3"), ("4", "6"), ("7", "9"), ("r", "y"), ("f", "h"), ("v", "n"), ("g", "Shift+G")]
"""Keys that decrease and increase joints 1 to 7."""
STEP = math.radians(3.0)


def press(page: Page, key: str, served: ServedPage, expected: list[float]) -> None:
    """Press a key, and wait until the joints are where that should bring them, and nowhere else."""
    page.keyboard.press(key)
    wait_until(
        lambda: np.allclose(served.state.q, expected, rtol=0, atol=1e-12),
        lambda: f"{key}: {served.state.q}, not {expected}",
    )


@pytest.mark.slow
def test_each_of_seven_joints_has_a_key_for_less_and_one_for_more(serve: Serve) -> None:
    page, served = serve(open_state(SSRMS))
    expected = SSRMS.configurations["home"].tolist()
    page.locator("canvas").first.focus()
    for joint, (down, up) in enumerate(PAIRS):
        expected[joint] -= STEP
        press(page, down, served, expected)
        for _ in range(2):
            expected[joint] += STEP
            press(page, up, served, expected)
    wait_for_position(page, SSRMS, expected)


@pytest.mark.slow
def test_keys_typed_into_a_field_move_nothing(serve: Serve) -> None:
    page, served = serve(open_state(SSRMS))
    home = SSRMS.configurations["home"].tolist()
    field(page, "joint_1 [°]").click()
    page.keyboard.press("Control+A")
    page.keyboard.type("149.7")
    wait_until(lambda: served.state.q[0] == pytest.approx(math.radians(149.7)), "joint_1 is where it was typed")
    wait_for_position(page, SSRMS, [math.radians(149.7), *home[1:]])
    open_tab(page, "Table")
    choose(page, "Row", "2: joint_2")
    field(page, "α₂").click()
    page.keyboard.type("147rfvgGyhn")
    wait_until(lambda: "147rfvgGyhn" in served.state.table.rows[1].cells[1], "the cell")
    assert served.state.q[1:] == pytest.approx(home[1:], abs=1e-12)
    assert served.state.table.errors, "it is not a number, and the robot is unchanged"


@pytest.mark.slow
def test_a_key_moves_a_sliding_joint_by_a_hundredth_of_its_travel(serve: Serve) -> None:
    page, served = serve(open_state(STANFORD))
    expected = STANFORD.configurations["home"].tolist()
    page.locator("canvas").first.focus()
    expected[2] += 0.0127
    press(page, "9", served, expected)
    for _ in range(2):
        expected[2] -= 0.0127
        press(page, "7", served, expected)
    wait_for_position(page, STANFORD, expected)


@pytest.mark.slow
def test_an_arrow_key_held_on_a_slider_moves_the_joint_and_not_the_camera(serve: Serve) -> None:
    page, served = serve(open_state(STANFORD))
    wait_for_aim(served)
    camera = served.client.camera
    position = camera.position.copy()
    page.get_by_role("slider").first.focus()
    page.keyboard.down("ArrowRight")
    page.wait_for_timeout(1000)  # viser would turn the camera by 50 degrees
    page.keyboard.up("ArrowRight")
    wait_until(lambda: served.state.q[0] > STANFORD.configurations["home"][0], "the joint moves")
    page.wait_for_timeout(500)
    assert np.allclose(camera.position, position, rtol=0, atol=1e-6)
    page.evaluate("document.activeElement.blur()")
    page.keyboard.down("ArrowRight")
    wait_until(lambda: not np.allclose(camera.position, position, rtol=0, atol=0.1), "it turns elsewhere")
    page.keyboard.up("ArrowRight")
