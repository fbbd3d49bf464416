"""The camera shows the whole robot in every window, until the user moves it."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.typing import Array
from dh2sim.view.initial_state import open_state
from dh2sim.view.scene.camera import FIELD_OF_VIEW, Viewpoint, viewpoint_of
from dh2sim.view.scene.items import Label
from dh2sim.view.scene.labels import HEIGHT, width
from dh2sim.view.server import Viewer
from dh2sim.view.state import ViewState
from tests.view.on_page import at_rest, choose, open_tab, pixel, wait_for_aim, wait_for_work, wait_until

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from dh2sim.view.page import Page as ServedPage

MESHED = """\
name: meshed
convention: standard
joints:
  - {name: turn, type: revolute, a: 0.1, d: 0.1, limits: {position: [-2, 2]}, link: {mesh: {file: beam.stl}}}
"""


def origins(state: ViewState) -> Array:
    """Origins of base_link, of all frames and of the tool at home, m, as the table has them."""
    frames = table_frame_poses(state.spec, state.q)[:, :3, 3]
    return np.vstack([np.zeros(3), frames, table_tool_pose(state.spec, state.q)[:3, 3]])


@settings(max_examples=min(40, settings().max_examples))
@given(st.sampled_from(builtin_robots()), st.floats(0.2, 4.0))
def test_the_robot_at_home_is_seen_in_pictures_of_any_aspect(robot: str, aspect: float) -> None:
    state = open_state(load_robot(robot))
    assert is_in_picture(origins(state), viewpoint_of(state.model, aspect), aspect)


def is_in_picture(points: Array, eye: Viewpoint, aspect: float) -> bool:
    """Whether points, m, are in a picture."""
    ahead = np.subtract(eye.look_at, eye.position)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    seen = points - eye.position
    depth = seen @ ahead
    sideways, up = seen @ right / depth, seen @ np.cross(right, ahead) / depth
    reach = math.tan(0.5 * FIELD_OF_VIEW)
    return bool((depth > 0.0).all() and (np.abs(up) < reach).all() and (np.abs(sideways) < aspect * reach).all())


def test_a_link_shown_by_a_large_mesh_is_seen_too(tmp_path: Path) -> None:
    trimesh.creation.box(extents=(0.2, 3.0, 0.2)).export(tmp_path / "beam.stl")
    file = tmp_path / "meshed.yaml"
    file.write_text(MESHED, encoding="utf-8")
    state = open_state(load_robot(file), tmp_path)
    T = table_frame_poses(state.spec, [0.0])[1]
    ends = np.array([T[:3, 3] + sign * 1.5 * T[:3, 1] for sign in (-1.0, 1.0)])
    assert is_in_picture(ends, viewpoint_of(state.model, 1.0), 1.0)
    assert not is_in_picture(ends, viewpoint_of(open_state(parse_robot(MESHED.split(", link")[0] + "}")).model), 1.0)


def is_seen(page: Page, served: ServedPage) -> bool:
    """Whether all of the robot is inside of the picture."""
    box = page.locator("canvas").first.bounding_box()
    assert box is not None
    places = np.array([pixel(page, served, origin) for origin in origins(served.state)])
    low, size = np.array([box["x"], box["y"]]), np.array([box["width"], box["height"]])
    return bool(((places > low) & (places < low + size)).all())


def test_in_a_narrower_window_the_camera_moves_back(open_page: Callable[[], Page], viewer: Viewer) -> None:
    page = open_page()
    (served,) = viewer.pages
    wait_for_aim(served)
    wait_until(lambda: is_seen(page, served), "it is seen beside the panel")
    near = math.dist(served.client.camera.position, served.client.camera.look_at)
    page.set_viewport_size({"width": 640, "height": 640})
    wait_until(lambda: served.client.camera.aspect < 0.5, "the window is narrow")
    wait_for_aim(served)
    wait_until(lambda: is_seen(page, served), "it is seen in the narrow window")
    assert math.dist(served.client.camera.position, served.client.camera.look_at) > 1.3 * near
    page.set_viewport_size({"width": 900, "height": 640})
    wait_until(
        lambda: math.dist(served.client.camera.position, served.client.camera.look_at) < 1.05 * near, "it comes back"
    )


def test_a_camera_that_the_user_has_moved_stays(open_page: Callable[[], Page], viewer: Viewer) -> None:
    page = open_page()
    (served,) = viewer.pages
    wait_for_aim(served)
    wait_until(lambda: is_seen(page, served), "it is seen")
    moved = move_the_camera(page, served, 120.0)
    page.set_viewport_size({"width": 700, "height": 640})
    wait_until(lambda: served.client.camera.aspect < 0.6, "the window is narrow")
    wait_for_work(served)  # to aim the camera would be a part of it
    page.wait_for_timeout(500)
    assert math.dist(served.client.camera.position, moved) < 1e-3
    page.set_viewport_size({"width": 900, "height": 640})


def move_the_camera(page: Page, served: ServedPage, pixels: float) -> Array:
    """Drag the scene to the right, and return where the camera comes to rest."""
    box = page.locator("canvas").first.bounding_box()
    assert box is not None
    before = served.client.camera.position.copy()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + box["height"] - 40.0
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + pixels, y, steps=5)
    page.mouse.up()
    wait_until(lambda: math.dist(served.client.camera.position, before) > 0.1, "the user moves the camera")
    return np.array(at_rest(lambda: served.client.camera.position.tolist()))


def test_the_labels_of_a_row_can_be_read_wherever_the_camera_is(
    open_page: Callable[[], Page], viewer: Viewer
) -> None:
    page = open_page()
    (served,) = viewer.pages
    open_tab(page, "Table")
    choose(page, "Row", "2: joint_2")
    wait_until(lambda: "α₂ = 90°" in {label.text for label in drawn_labels(served)}, "the row is explained")
    wait_for_aim(served)
    before = served.state.pinhole
    for pixels in (90.0, -170.0):
        move_the_camera(page, served, pixels)
        wait_until(lambda: served.state.pinhole not in (None, before), "the camera is reported")
        wait_until(lambda: not covered(page, served), lambda: f"{covered(page, served)} cover each other")


def drawn_labels(served: ServedPage) -> list[Label]:
    return [item for item in tuple(served._painter._drawn.values()) if isinstance(item, Label)]


def covered(page: Page, served: ServedPage) -> list[tuple[str, str]]:
    """Which labels cover each other by more than the camera may move without them: a few pixels."""
    labels = {item.text: item for item in drawn_labels(served)}
    found = []
    for (here, a), (there, b) in combinations(labels.items(), 2):
        (xa, ya), (xb, yb) = pixel(page, served, a.position), pixel(page, served, b.position)
        if abs(xa - xb) < 0.5 * (width(here) + width(there)) - 6.0 and abs(ya - yb) < HEIGHT - 6.0:
            found.append((here, there))
    return found
