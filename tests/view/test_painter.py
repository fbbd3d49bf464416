"""The painter on a real viser server: what differs is sent, and nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dh2sim.view.scene.items import Arrow, Item, Label, Lines, Placed, Points, Polyline, Solid, Triad
from dh2sim.view.scene.painter import Painter

if TYPE_CHECKING:
    import viser

CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    from dh2sim.view.server import start_server, stop_server

    made = start_server("127.0.0.1", 0)
    yield made
    stop_server(made)


@pytest.fixture
def scene(server: viser.ViserServer) -> viser.SceneApi:
    server.scene.reset()
    return server.scene


def triangle(color: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> Solid:
    return Solid(vertices=CORNERS, faces=((0, 1, 2),), color=color)


def test_every_kind_of_item_is_drawn(scene: viser.SceneApi) -> None:
    items: dict[str, Item] = {
        "/a": Placed(position=(1.0, 2.0, 3.0)),
        "/a/solid": triangle(),
        "/a/triad": Triad(length=0.2),
        "/a/triad/label": Label(text="of the triad"),
        "/a/lines": Lines(segments=(CORNERS[:2], CORNERS[1:]), color=(0.0, 1.0, 0.0)),
        "/a/path": Polyline(points=CORNERS, color=(0.0, 1.0, 0.0)),
        "/a/arrow": Arrow(start=CORNERS[0], end=CORNERS[1], color=(0.0, 0.0, 1.0), thickness=0.1),
        "/a/label": Label(text="x"),
        "/a/points": Points(points=CORNERS, colors=((1.0, 0.0, 0.0),) * 3, size=0.1),
    }
    assert Painter(scene).draw(items) == len(items)
    drawn = {name: type(scene.get_handle_by_name(name)).__name__ for name in items}
    assert drawn == {
        "/a": "FrameHandle",
        "/a/solid": "MeshHandle",
        "/a/triad": "FrameHandle",
        "/a/triad/label": "LabelHandle",
        "/a/lines": "LineSegmentsHandle",
        "/a/path": "LineSegmentsHandle",
        "/a/arrow": "ArrowsHandle",
        "/a/points": "PointCloudHandle",
        "/a/label": "LabelHandle",
    }
    placed = scene.get_handle_by_name("/a")
    assert placed is not None
    assert placed.position.tolist() == [1.0, 2.0, 3.0]


def test_a_move_keeps_what_hangs_below_and_sends_no_solid_again(scene: viser.SceneApi) -> None:
    painter = Painter(scene)
    painter.draw({"/link": Placed(), "/link/shape": triangle()})
    link, shape = scene.get_handle_by_name("/link"), scene.get_handle_by_name("/link/shape")
    half = float(np.sqrt(0.5))
    turned = Placed(position=(0.0, 0.0, 1.0), orientation=(half, 0.0, 0.0, half))
    assert painter.draw({"/link": turned, "/link/shape": triangle()}) == 1
    assert scene.get_handle_by_name("/link") is link
    assert scene.get_handle_by_name("/link/shape") is shape
    assert link is not None
    assert link.position.tolist() == [0.0, 0.0, 1.0]
    assert np.allclose(link.wxyz, turned.orientation)


def test_the_same_scene_again_sends_nothing(scene: viser.SceneApi) -> None:
    painter = Painter(scene)
    items: dict[str, Item] = {"/a": Placed(), "/a/b": triangle(), "/c": Label(text="c")}
    painter.draw(items)
    assert painter.draw(dict(items)) == 0


def test_an_item_that_looks_different_is_replaced(scene: viser.SceneApi) -> None:
    painter = Painter(scene)
    painter.draw({"/a": Placed(), "/a/b": triangle()})
    assert painter.draw({"/a": Placed(), "/a/b": triangle((0.0, 1.0, 0.0))}) == 1
    handle = scene.get_handle_by_name("/a/b")
    assert handle is not None
    assert tuple(handle.color) == (0, 255, 0)  # type: ignore[attr-defined]


def test_plain_solids_are_shaded_in_steps(scene: viser.SceneApi) -> None:
    painter = Painter(scene)
    materials = []
    for plain in (False, True):
        painter.draw({"/a": replace(triangle(), plain=plain)})
        handle = scene.get_handle_by_name("/a")
        assert handle is not None
        materials.append(handle.material)  # type: ignore[attr-defined]
    assert materials == ["standard", "toon5"]


def test_what_is_gone_is_removed_with_all_below_it(scene: viser.SceneApi) -> None:
    painter = Painter(scene)
    painter.draw({"/a": Placed(), "/a/b": Placed(), "/a/b/c": triangle(), "/d": Label(text="d")})
    assert painter.draw({"/d": Label(text="d")}) == 3
    assert [scene.get_handle_by_name(name) for name in ("/a", "/a/b", "/a/b/c")] == [None] * 3
    assert scene.get_handle_by_name("/d") is not None


def test_what_can_change_is_changed_in_place_and_the_rest_is_added_again(scene: viser.SceneApi) -> None:
    painter = Painter(scene)
    line = Polyline(points=CORNERS, color=(0.0, 1.0, 0.0))
    arrow = Arrow(start=CORNERS[0], end=CORNERS[1], color=(0.0, 0.0, 1.0), thickness=0.1)
    old: dict[str, Item] = {"/a": triangle(), "/b": line, "/c": arrow, "/d": Label(text="x"), "/e": Triad(length=0.2)}
    painter.draw(old)
    handles = {name: scene.get_handle_by_name(name) for name in old}
    changed: dict[str, Item] = {
        "/a": replace(triangle(), opacity=0.5, scale=(1.0, 2.0, 3.0)),
        "/b": replace(line, points=CORNERS[1:]),
        "/c": replace(arrow, end=(0.0, 0.0, 0.1)),
        "/d": Label(text="y"),
        "/e": Triad(length=0.2, position=(0.0, 0.0, 1.0)),
    }
    assert painter.draw(changed) == 5
    assert {name: scene.get_handle_by_name(name) for name in old} == handles
    found: dict[str, Any] = handles
    assert (found["/a"].opacity, found["/a"].scale) == (0.5, (1.0, 2.0, 3.0))
    assert found["/b"].points.tolist() == [[list(CORNERS[1]), list(CORNERS[2])]]
    assert found["/c"].points.tolist() == [[[0.0, 0.0, 0.0], [0.0, 0.0, pytest.approx(0.1)]]]
    assert found["/c"].head_length == pytest.approx(0.06)
    assert found["/d"].text == "y"
    assert found["/e"].position.tolist() == [0.0, 0.0, 1.0]
    other = {**changed, "/b": replace(line, width=7.0), "/e": Triad(length=0.3)}
    assert painter.draw(other) == 2
    replaced = {name for name in old if scene.get_handle_by_name(name) is not handles[name]}
    assert replaced == {"/b", "/e"}
