"""Labels do not cover each other in the picture."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.draw.projection import Pinhole
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot
from dh2sim.view.events import SelectRow, SetCamera, Show
from dh2sim.view.initial_state import open_state
from dh2sim.view.reduce import reduce
from dh2sim.view.scene.camera import FIELD_OF_VIEW, viewpoint_of
from dh2sim.view.scene.items import Label, Scene, Vector
from dh2sim.view.scene.labels import HEIGHT, spread_labels, width
from dh2sim.view.scene.scene import scene_of
from dh2sim.view.state import Part, ViewState

FROM_AFAR = Pinhole(position=(0.0, -10.0, 0.0), right=(1.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), focal=1000.0)
"""Looks along y; shows a metre where the labels are with 100 pixels."""


def covers(labels: Scene, pinhole: Pinhole) -> list[tuple[str, str]]:
    """Which labels cover each other, by rectangles around their places in the picture."""
    found = []
    for here, there in combinations(labels, 2):
        a, b = labels[here], labels[there]
        assert isinstance(a, Label)
        assert isinstance(b, Label)
        (xa, ya, _), (xb, yb, _) = pinhole.project([a.position, b.position])
        if abs(xa - xb) < 0.5 * (width(a.text) + width(b.text)) - 1e-6 and abs(ya - yb) < HEIGHT - 1e-6:
            found.append((here, there))
    return found


places = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))


@given(st.lists(places, max_size=6))
def test_few_labels_never_cover_each_other(points: list[Vector]) -> None:
    labels = {f"label {i}": Label(text=f"θ{i} = 37.3°", position=point) for i, point in enumerate(points)}
    moved = spread_labels(labels, FROM_AFAR)
    assert list(moved) == list(labels)
    assert not covers(moved, FROM_AFAR)
    for name, label in labels.items():
        before, after = FROM_AFAR.project([label.position, moved[name].position])
        assert after[0] == pytest.approx(before[0], abs=1e-6)
        assert after[2] == pytest.approx(before[2])
        assert abs(after[1] - before[1]) <= 6 * HEIGHT + 1e-6
        assert moved[name].text == label.text


def test_labels_with_room_stay_and_those_that_are_first_keep_their_places() -> None:
    labels = {
        "far": Label(text="far", position=(3.0, 0.0, 0.0)),
        "second": Label(text="second", position=(0.0, 0.0, 0.0)),
        "first": Label(text="first", position=(0.0, 0.0, 0.05)),
    }
    moved = spread_labels(labels, FROM_AFAR, first=["first", "none"])
    assert (moved["far"], moved["first"]) == (labels["far"], labels["first"])
    assert moved["second"].position == pytest.approx((0.0, 0.0, -0.18), abs=1e-12), "two half heights down"


def test_a_label_without_free_space_nearby_stays() -> None:
    labels = {str(i): Label(text="x", position=(0.0, 0.0, 0.0)) for i in range(20)}
    moved = spread_labels(labels, FROM_AFAR)
    stayed = [name for name, label in moved.items() if label == labels[name]]
    assert stayed == ["0", *map(str, range(13, 20))]


def test_labels_behind_the_camera_stay_and_take_no_space() -> None:
    labels = {
        "behind": Label(text="x", position=(0.0, -20.0, 0.0)),
        "at the camera": Label(text="x", position=FROM_AFAR.position),
        "ahead": Label(text="x", position=(0.0, 0.0, 0.0)),
    }
    assert spread_labels(labels, FROM_AFAR) == labels
    assert spread_labels({}, FROM_AFAR) == {}


def seen_at_first(state: ViewState) -> Pinhole:
    """How a page of 800 pixels sees a robot before its user moves the camera; by cross products of its own."""
    eye = viewpoint_of(state.model)
    ahead = np.subtract(eye.look_at, eye.position)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    focal = 400.0 / np.tan(0.5 * FIELD_OF_VIEW)
    return Pinhole(position=eye.position, right=tuple(right), up=tuple(up), focal=float(focal))


@pytest.mark.parametrize("name", builtin_robots())
def test_every_row_of_every_robot_is_explained_with_labels_that_can_be_read(name: str) -> None:
    opened = open_state(load_robot(name))
    pinhole = seen_at_first(opened)
    state = reduce(reduce(opened, Show(part=Part.ANNOTATIONS, on=True)), SetCamera(pinhole=pinhole))
    for row in range(len(state.table.rows)):
        scene = scene_of(reduce(state, SelectRow(row=row)))
        labels = {name: item for name, item in scene.items() if isinstance(item, Label)}
        assert len(labels) > 6
        assert covers(labels, pinhole) == []


def test_a_sight_of_nonsense_is_not_taken() -> None:
    state = open_state(load_robot("stanford"))
    nonsense = Pinhole(position=(0.0, float("nan"), 0.0), right=(1.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), focal=1.0)
    assert reduce(state, SetCamera(pinhole=nonsense)) is state
