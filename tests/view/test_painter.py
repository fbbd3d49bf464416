"""The painter on a real viser server: what differs is sent, and nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dh2sim.view.scene.items import Arrow, Item, Label, Lines, Placed, Polyline, Solid, Triad
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


def test_frames_side_by_side_are_one_item_that_is_moved_as_a_whole(scene: viser.SceneApi) -> None:
    painter = Painter(scene)
    half = float(np.sqrt(0.5))
    turned = Triad(length=0.1, position=(0.0, 0.0, 2.0), orientation=(half, 0.0, half, 0.0))
    painter.draw({"/frames": Placed(), "/frames/a": Triad(length=0.1), "/frames/b": Triad(length=0.1)})
    axes = scene.get_handle_by_name("/frames/axes_0")
    assert painter.draw({"/frames": Placed(), "/frames/a": Triad(length=0.1), "/frames/b": turned}) == 1
    assert scene.get_handle_by_name("/frames/axes_0") is axes
    assert axes is not None
    assert axes.batched_positions.tolist() == [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]  # type: ignore[attr-defined]
    assert np.allclose(axes.batched_wxyzs, [(1.0, 0.0, 0.0, 0.0), turned.orientation])  # type: ignore[attr-defined]
    assert painter.draw({"/frames": Placed(), "/frames/b": turned}) == 1
    axes = scene.get_handle_by_name("/frames/axes_0")
    assert axes is not None
    assert axes.batched_positions.tolist() == [[0.0, 0.0, 2.0]]  # type: ignore[attr-defined]
