"""The page in a real browser: what its panel shows is what the library computes."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from dh2sim.engines.mujoco_engine import MujocoEngine
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.view.server import Viewer
from tests.view.on_page import DEADLINE, OpenPage, field, open_tab, shown, wait_for_position, wait_until

HOME = load_robot("stanford").configurations["home"].tolist()


@pytest.fixture(scope="module")
def drawn() -> bool:
    return False


def test_a_number_beyond_a_limit_stops_there_and_nonsense_moves_nothing(open_page: OpenPage) -> None:
    page, spec = open_page(), load_robot("stanford")
    field(page, "joint_5 [°]").fill("1000")
    wait_for_position(page, spec, [*HOME[:4], math.pi / 2, HOME[5]])
    field(page, "joint_5 [°]").fill("-")
    field(page, "joint_1 [°]").fill("abc")
    field(page, "joint_3 [m]").fill("0.1")
    wait_for_position(page, spec, [*HOME[:2], 0.1, HOME[3], math.pi / 2, HOME[5]])


def test_pages_have_states_of_their_own_and_a_reload_begins_anew(open_page: OpenPage, viewer: Viewer) -> None:
    first, second, spec = open_page(), open_page(), load_robot("stanford")
    first.get_by_role("button", name="zero").click()
    wait_for_position(first, spec, [0.0] * 6)
    wait_for_position(second, spec, HOME)
    first.reload()
    first.get_by_role("tab", name="Joints").wait_for()
    wait_for_position(first, spec, HOME)
    wait_until(lambda: len(viewer.pages) == 2, "the page of before the reload is closed")


def test_the_pose_is_shown_in_every_form_beside_that_of_mujoco(open_page: OpenPage, tmp_path: Path) -> None:
    page, spec = open_page(), load_robot("stanford")
    open_tab(page, "Pose")
    wait_until(lambda: "Difference to MuJoCo" in shown(page, "mujoco"), "MuJoCo's pose")
    matrix = np.array(shown(page, "matrix").split(), dtype=np.float64).reshape(4, 4)
    assert np.allclose(matrix, table_tool_pose(spec, HOME), rtol=0, atol=1e-6)
    found = re.search(r"Difference to MuJoCo: (\S+) m, (\S+) rad", shown(page, "mujoco"))
    assert found is not None
    assert all(float(number) < 1e-12 for number in found.groups())
    page.screenshot(path=tmp_path / "pose.png")


def test_files_are_handed_out_as_edited_and_the_model_matches_the_table(open_page: OpenPage, tmp_path: Path) -> None:
    page = open_page()
    open_tab(page, "Table")
    field(page, "a₁").fill("0.123")
    wait_until(lambda: "0.123" in shown(page, "table"), "the cell")
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
    wait_until(lambda: "stanford.xml: largest difference to the table" in shown(page, "notice"), "the comparison")


def test_a_page_of_somebody_else_is_turned_away(viewer: Viewer) -> None:
    client = pytest.importorskip("websockets.sync.client")
    closed = pytest.importorskip("websockets.exceptions").ConnectionClosed
    import viser

    address, protocols = viewer.url.replace("http", "ws"), [f"viser-v{viser.__version__}"]
    with client.connect(address, origin=viewer.url, subprotocols=protocols) as connection:
        connection.recv(timeout=DEADLINE)
    for origin in ("http://elsewhere.example", f"http://elsewhere.example:{viewer.port}", "null"):
        with client.connect(address, origin=origin, subprotocols=protocols) as connection, pytest.raises(closed):
            connection.recv(timeout=DEADLINE)
