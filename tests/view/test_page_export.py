"""Pages that open without a server: what is in them."""

from __future__ import annotations

import math
import threading
from pathlib import Path

import numpy as np
import pytest

from dh2sim.errors import ConfigurationError, OutputError, PictureError
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.simulate.dataset_layout import POSE
from dh2sim.typing import Array
from dh2sim.view.page_export import (
    MAX_FRAME_RATE,
    MAX_FRAMES,
    BoundingSphere,
    bounding_sphere,
    export_page,
    page_html,
    robot_page_scene,
    rollout_keyframes,
    shown_records,
)
from dh2sim.view.scene.items import Arrow, Label, Placed, Scene, Solid, Triad
from dh2sim.view.scene.items import Polyline as Line
from tests.draw.datasets import rollout, stopped, swinging
from tests.sample_robots import NAMES, robot
from tests.view.test_solids import matrix

RED = (1.0, 0.0, 0.0)
UNIT = BoundingSphere(centre=(0.0, 0.0, 0.0), radius=1.0)


def world_pose(scene: Scene, name: str) -> Array:
    """The product of the poses down to an item."""
    parts = name.strip("/").split("/")
    T = np.eye(4)
    for k in range(len(parts)):
        item = scene.get("/" + "/".join(parts[: k + 1]))
        T = T if item is None else T @ matrix(item)
    return T


@pytest.mark.parametrize("name", NAMES)
def test_every_frame_of_the_table_is_below_its_link_with_its_name(name: str) -> None:
    model = build_model(robot(name))
    q = model.home + 0.1
    scene, frames = robot_page_scene(model, q), table_frame_poses(model.spec, q)
    carriers = ["base_link", *(f"link_{i}" for i in range(1, len(model.joints) + 1))]
    texts = []
    for i, (link, T) in enumerate(zip(carriers, frames, strict=True)):
        place = f"/robot/{link}/dh_{i}"
        assert isinstance(scene[place], Triad)
        np.testing.assert_allclose(world_pose(scene, place), T, rtol=0, atol=1e-12)
        label = scene[f"{place}/name"]
        assert isinstance(label, Label)
        texts.append(label.text)
    last, tool = f"dh_{len(model.joints)}", f"/robot/{carriers[-1]}/tool0"
    if (table_tool_pose(model.spec, q) == frames[-1]).all():
        assert texts[-1] == f"{last} = tool0"
        assert tool not in scene
    else:
        assert texts[-1] == last
        np.testing.assert_allclose(world_pose(scene, tool), table_tool_pose(model.spec, q), rtol=0, atol=1e-12)


def test_a_rollout_is_shown_with_the_tool_where_it_was_recorded() -> None:
    run, model = swinging("stanford"), build_model(robot("stanford"))
    moments = list(rollout_keyframes(model, rollout(run, 1)))
    times = run["time"].values
    assert len(moments) > 3
    assert moments[0][0] == 0.0
    assert moments[-1][0] == times[-1] - times[0]
    for time_shown, scene in moments:
        record = int(np.argmin(np.abs(times - times[0] - time_shown)))
        assert times[record] - times[0] == time_shown
        last = f"/robot/link_{len(model.joints)}"
        frame = f"{last}/tool0" if f"{last}/tool0" in scene else f"{last}/dh_{len(model.joints)}"
        recorded = run["tool_pose"].values[1, record, :3]
        assert world_pose(scene, frame)[:3, 3] == pytest.approx(recorded, abs=1e-9)


def test_a_rollout_that_stopped_is_shown_up_to_there() -> None:
    run, model = stopped(swinging("rpr"), 1, 4), build_model(robot("rpr"))
    times = run["time"].values
    assert list(rollout_keyframes(model, rollout(run, 1)))[-1][0] == times[4] - times[0]


def test_a_floating_base_takes_the_robot_along() -> None:
    run, model = swinging("rpr"), build_model(robot("rpr"))
    count = run.sizes["step"]
    angle = np.linspace(0.0, 1.0, count)
    poses = np.stack(
        [
            *np.linspace([0.0, 0.0, 1.0], [2.0, 3.0, 4.0], count).T,
            np.cos(angle / 2),
            0 * angle,
            0 * angle,
            np.sin(angle / 2),
        ],
        axis=1,
    )
    run = run.assign(base_pose=(("rollout", "step", "pose"), np.stack([poses, poses])))
    assert list(run["pose"].values) == list(POSE)
    base = list(rollout_keyframes(model, rollout(run)))[-1][1]["/robot"]
    assert base == Placed(position=(2.0, 3.0, 4.0), orientation=(math.cos(0.5), 0.0, 0.0, math.sin(0.5)))


def test_a_rollout_of_another_robot_is_refused() -> None:
    with pytest.raises(PictureError) as caught:
        list(rollout_keyframes(build_model(robot("scara")), rollout(swinging("rpr"))))
    here = ", ".join(row.name for row in robot("scara").moving_rows)
    there = ", ".join(row.name for row in robot("rpr").moving_rows)
    assert str(caught.value) == f"run.zarr, rollout 0 is of a robot with the joints {there}; scara has {here}"


def test_a_rollout_without_positions_is_refused() -> None:
    with pytest.raises(PictureError, match="a page needs qpos, which the run does not contain"):
        list(rollout_keyframes(build_model(robot("rpr")), rollout(swinging("rpr", without=("qpos",)))))


@pytest.mark.parametrize(
    ("duration", "count", "expected"),
    [(2.0, 2001, 61), (2.0, 21, 21), (1000.0, 100_001, MAX_FRAMES), (0.0, 1, 1), (0.01, 11, 2)],
)
def test_as_many_records_are_shown_as_can_be_seen(duration: float, count: int, expected: int) -> None:
    times = np.linspace(5.0, 5.0 + duration, count)
    shown = shown_records(times)
    assert len(shown) == expected
    assert (shown[0], shown[-1]) == (0, count - 1)
    assert shown == sorted(set(shown))
    if expected > 2:
        steps = np.diff(times[shown])
        assert steps.max() <= max(duration / (expected - 1), 1 / MAX_FRAME_RATE) * 1.1


def test_the_extent_holds_everything_at_every_moment() -> None:
    model = build_model(robot("puma560"))
    scenes = [robot_page_scene(model, model.home + step) for step in (0.0, 0.5, 1.0)]
    bounds = bounding_sphere(scenes)
    for scene in scenes:
        for name, item in scene.items():
            if isinstance(item, Solid):
                T = world_pose(scene, name)
                points = np.array(item.vertices) @ T[:3, :3].T + T[:3, 3]
                assert np.linalg.norm(points - bounds.centre, axis=1).max() <= bounds.radius
    assert bounds.radius < 2.0 * model.reach


def test_the_extent_counts_lines_and_arrows_and_is_never_nothing() -> None:
    scene: Scene = {
        "/a": Placed(position=(1.0, 0.0, 0.0)),
        "/a/line": Line(points=((0.0, 0.0, 0.0), (0.0, 4.0, 0.0)), color=RED),
        "/arrow": Arrow(start=(1.0, 0.0, 0.0), end=(1.0, 0.0, 3.0), color=RED, thickness=0.1),
    }
    assert bounding_sphere([scene]) == BoundingSphere(centre=(1.0, 2.0, 1.5), radius=2.5)
    assert bounding_sphere([{"/a": Placed()}]) == BoundingSphere(centre=(0.0, 0.0, 0.0), radius=1.0)


@pytest.fixture(scope="module")
def puma() -> RobotModel:
    return build_model(robot("puma560"))


def test_a_page_is_one_file_and_nothing_is_printed_and_no_server_stays(
    puma: RobotModel, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    threads = set(threading.enumerate())
    path = tmp_path / "puma.html"
    export_page(puma, puma.home, path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["puma.html"]
    assert path.read_text(encoding="utf-8").count("<title>puma560</title>") == 1
    assert capfd.readouterr() == ("", "")
    assert not [thread for thread in set(threading.enumerate()) - threads if thread.is_alive()]


def test_a_page_that_stood_there_stays_where_the_new_one_cannot_be_made(puma: RobotModel, tmp_path: Path) -> None:
    path = tmp_path / "puma.html"
    path.write_text("old")
    with pytest.raises(ConfigurationError, match="expected 6 joint coordinates"):
        export_page(puma, [0.0], path)
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["puma.html"]


def test_a_missing_folder_is_an_error(puma: RobotModel, tmp_path: Path) -> None:
    path = tmp_path / "none" / "puma.html"
    with pytest.raises(OutputError) as caught:
        export_page(puma, puma.home, path)
    assert str(caught.value) == f"cannot write '{path}': there is no folder '{path.parent}'"


def test_the_title_cannot_break_the_page() -> None:
    page = page_html([(0.0, {"/a": Placed()})], title="</title><script>alert(1)</script>", bounds=UNIT)
    assert "<title>&lt;/title&gt;&lt;script&gt;alert(1)&lt;/script&gt;</title>" in page
