"""The fields of a row: what is typed is of the row that they name, however fast it is typed."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import pytest

from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.view.initial_state import open_state
from dh2sim.view.page import Page as ServedPage
from dh2sim.view.server import Viewer
from dh2sim.view.state import ViewState
from tests.view.on_page import wait_until
from tests.view.without_browser import speaking

Speaker: TypeAlias = "tuple[ServedPage, Callable[..., None]]"

MIXED = (
    "name: mixed\nconvention: modified\njoints:\n  - {type: revolute, a: 0.5}\n"
    "  - {type: revolute, a: 0.25, alpha: 0.3, convention: hayati, beta: 0.1}\n"
)


@pytest.fixture(params=[open_state(load_robot("stanford"))], ids=["stanford"])
def speaker(request: pytest.FixtureRequest) -> Iterator[Speaker]:
    """A page of a state without a browser, and what sends the server a message from it."""
    state: ViewState = request.param
    viewer = Viewer(state)
    try:
        with speaking(viewer.url) as say:
            wait_until(lambda: len(viewer.pages) == 1, "the page")
            (served,) = viewer.pages
            wait_until(lambda: "Compare with a robot file" in widgets(served), "its panel")
            yield served, say
    finally:
        viewer.stop()


def widgets(served: ServedPage) -> dict[str, Any]:
    """Widgets with a value, by label; the last where several have it."""
    handles = list(served.client.gui._gui_input_handle_from_uuid.values())
    return {handle.label: handle for handle in handles}


def fields(served: ServedPage) -> list[str]:
    """Labels of the fields of a row that are seen."""
    return [label for label, handle in widgets(served).items() if label[0] in "aαdθβ" and handle.visible]


def set_value(speaker: Speaker, label: str, value: str) -> None:
    served, say = speaker
    say("GuiUpdateMessage", uuid=widgets(served)[label]._impl.uuid, updates={"value": value})


def test_typing_before_another_row_is_shown_changes_the_row_that_the_label_names(speaker: Speaker) -> None:
    served, _say = speaker
    first, go_on = widgets(served)["d₁"], threading.Event()
    served.send(lambda: (go_on.wait(20.0), None)[1])  # the page's thread is busy
    set_value(speaker, "Edit row", "2: joint_2")
    set_value(speaker, "d₁", "0.25")
    wait_until(lambda: first.value == "0.25", "the server has it")
    go_on.set()
    wait_until(lambda: "d₂" in fields(served), "the other row")
    assert served.state.selected_row == 1
    assert [row.d for row in served.state.spec.rows[:2]] == [0.25, 0.15]
    assert widgets(served)["d₂"].value == "d2"


def test_another_row_has_its_own_fields(speaker: Speaker) -> None:
    served, _say = speaker
    assert fields(served) == ["a₁", "α₁", "d₁", "θ₁"]
    set_value(speaker, "Edit row", "6: joint_6")
    wait_until(lambda: fields(served) == ["a₆", "α₆", "d₆", "θ₆"], "the fields of row 6")
    set_value(speaker, "d₆", "2 * d6")
    wait_until(lambda: served.state.spec.rows[5].d == 0.6, "the cell")
    assert [row.d for row in served.state.spec.rows[:2]] == [0.4, 0.15]


@pytest.mark.parametrize("speaker", [open_state(parse_robot(MIXED))], indirect=True, ids=["mixed"])
def test_fields_are_labelled_for_the_convention_of_the_row(speaker: Speaker) -> None:
    served, _say = speaker
    assert fields(served) == ["a₀", "α₀", "d₁", "θ₁"]
    set_value(speaker, "convention₁", "hayati")
    wait_until(lambda: fields(served) == ["a₁", "α₁", "d₁", "θ₁", "β₁"], "the new convention")
    set_value(speaker, "Edit row", "2: joint_2")
    wait_until(lambda: fields(served) == ["a₂", "α₂", "d₂", "θ₂", "β₂"], "a Hayati row")
    set_value(speaker, "convention₂", "standard")
    wait_until(lambda: "β₂" in fields(served) and served.state.table.errors != (), "beta means nothing there")


def test_an_unknown_row_cannot_be_selected(speaker: Speaker) -> None:
    served, _say = speaker
    set_value(speaker, "Edit row", "7: joint_7")
    set_value(speaker, "a₁", "0.125")
    wait_until(lambda: served.state.spec.rows[0].a == 0.125, "what came after it")
    assert served.state.selected_row == 0
    wait_until(lambda: widgets(served)["Edit row"].value == "1: joint_1", "the choice is put back", seconds=10.0)
