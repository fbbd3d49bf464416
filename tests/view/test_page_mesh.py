"""A robot with a mesh in a real browser."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import trimesh

from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.robot.read import load_robot
from dh2sim.typing import Array
from dh2sim.view.initial_state import folder_of, open_state
from dh2sim.view.page import Page as ServedPage
from dh2sim.view.state import Part
from tests.view.on_page import Serve, open_tab, pixel, wait_for_aim, wait_until

if TYPE_CHECKING:
    from playwright.sync_api import Page

ROBOT = """\
name: meshed
convention: standard
joints:
  - {name: turn, type: revolute, a: 0.3, d: 0.2, limits: {position: [-2, 2]}, link: {mesh: {file: block.stl}}}
"""
SIDES = (0.1, 0.06, 0.08)
"""Of the mesh, a block whose middle is the origin of DH frame 1, m."""
WHITE = (255, 255, 255)


@pytest.fixture
def drawn() -> bool:
    return True


def color_at(page: Page, served: ServedPage, point: Array) -> tuple[int, int, int] | None:
    """What is seen at a point of base_link, m: red, green, blue; None where that is not in the picture."""
    from PIL import Image

    x, y = pixel(page, served, point)
    box = page.locator("canvas").first.bounding_box()
    if box is None or not (box["x"] < x < box["x"] + box["width"] and box["y"] < y < box["y"] + box["height"]):
        return None
    clip = {"x": round(x) - 1, "y": round(y) - 1, "width": 3, "height": 3}
    with Image.open(io.BytesIO(page.screenshot(clip=clip))) as picture:  # type: ignore[arg-type]
        red, green, blue = picture.convert("RGB").getpixel((1, 1))  # type: ignore[misc]
    return red, green, blue


def test_the_mesh_of_a_link_is_sent_to_the_browser_and_seen(serve: Serve, tmp_path: Path) -> None:
    trimesh.creation.box(extents=SIDES).export(tmp_path / "block.stl")
    file = tmp_path / "meshed.yaml"
    file.write_text(ROBOT, encoding="utf-8")
    spec = load_robot(file)
    page, served = serve(open_state(spec, folder_of(str(file))))
    sent = served.client.scene.get_handle_by_name("/robot/link_1/mesh")
    assert sent is not None
    assert len(sent.vertices) == 8  # type: ignore[attr-defined]
    assert np.allclose(np.abs(sent.vertices), 0.5 * np.array(SIDES), rtol=0, atol=1e-7)  # type: ignore[attr-defined]
    assert len(sent.faces) == 12  # type: ignore[attr-defined]
    assert served.client.scene.get_handle_by_name("/robot/link_1/shape_0") is None

    wait_for_aim(served)
    open_tab(page, "Show")
    hidden = {"DH frames": Part.FRAMES, "Floor": Part.GRID, "Explained row": Part.ANNOTATIONS}
    for label in (*hidden, "Handle to drag tool0"):
        page.get_by_text(label, exact=True).click()
    wait_until(lambda: served.state.shown.isdisjoint(hidden.values()), "nothing but the robot is shown")
    middle = table_frame_poses(spec, [0.0])[1][:3, 3]
    wait_until(lambda: color_at(page, served, middle) not in (WHITE, None), "the mesh is seen")
    page.get_by_text("Shapes", exact=True).click()
    wait_until(lambda: color_at(page, served, middle) == WHITE, "the robot is hidden, and so is its mesh")
