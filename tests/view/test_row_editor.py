"""The fields of a row: what is typed is of the row that they name, however fast it is typed."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import pytest

from dh2sim.robot.read import parse_robot
from dh2sim.view.initial_state import open_state
from dh2sim.view.page import Page as ServedPage
from dh2sim.view.server import Viewer
from dh2sim.view.state import ViewState
from tests.view.on_page import wait_for_work, wait_until
from tests.view.states import STANFORD
from tests.view.without_browser import speaking

Speaker: TypeAlias = "tuple[ServedPage, Callable[..., None]]"

MIXED = (
    "name: mixed\nconvention: modified\njoints:\n  - {type: revolute, a: 0.5}\n"
    "  - {type: revolute, a: 0.25, alpha: 0.3, convention: hayati, beta: 0.1}\n"
)


@pytest.fixture(params=[STANFORD], ids=["stanford"])
def speaker(request: pytest.FixtureRequest) -> Iterator[Speaker]:
    """A page of a state without a browser, and what sends the server a message from it."""
    state: ViewState = request.param
    viewer = Viewer(state)
    try:
        with speaking(viewer.url) as say:
            wait_until(lambda: len(viewer.pages) == 1, "the page")
            (served,) = viewer.pages
            wait_for_work(served)  # whose turn comes once all is shown
            yield served, say
    finally:
        viewer.stop()


def widgets(served: ServedPage) -> dict[str, Any]:
    """Widgets with a value, by label; the last where several have it."""
    handles = list(served.client.gui._gui_input_handle_from_uuid.values())
    return {handle.label: handle for handle in handles if hasattr(handle, "label")}  # a progress bar has none


def fields(served: ServedPage, row: int) -> list[str]:
    """Labels of the fields of a row, from 0, of the grid."""
    cells = served._panel._table._cells._cells
    return [cell.handle.label for (number, _), cell in cells.items() if number == row]


def set_value(speaker: Speaker, label: str, value: str) -> None:
    served, say = speaker
    say("GuiUpdateMessage", uuid=widgets(served)[label]._impl.uuid, updates={"value": value})


def test_typing_into_a_cell_selects_its_row_and_changes_no_other(speaker: Speaker) -> None:
    served, _say = speaker
    set_value(speaker, "Row", "2: joint_2")
    set_value(speaker, "d₁", "0.25")
    wait_until(lambda: served.state.spec.rows[0].d == 0.25, "the cell")
    assert [row.d for row in served.state.spec.rows[:2]] == [0.25, 0.15]
    wait_until(lambda: widgets(served)["Row"].value == "1: joint_1", "the row that was typed into")
    set_value(speaker, "d₆", "2 * d6")
    wait_until(lambda: served.state.spec.rows[5].d == 0.6, "the cell")
    wait_until(lambda: "convention₆" in widgets(served), "the convention of that row")
    assert "convention₁" not in widgets(served)


def test_a_convention_chosen_before_another_row_is_shown_is_that_of_the_row_that_the_label_names(
    speaker: Speaker,
) -> None:
    served, _say = speaker
    first, go_on = widgets(served)["convention₁"], threading.Event()
    served.send(lambda: (go_on.wait(20.0), None)[1])  # the page's thread is busy
    set_value(speaker, "Row", "2: joint_2")
    set_value(speaker, "convention₁", "modified")
    wait_until(lambda: first.value == "modified", "the server has it")
    go_on.set()
    wait_until(lambda: "convention₂" in widgets(served), "the other row")
    assert [row.convention.value for row in served.state.spec.rows[:3]] == ["modified", "standard", "standard"]
    assert widgets(served)["convention₂"].value == "standard"


@pytest.mark.parametrize("speaker", [open_state(parse_robot(MIXED))], indirect=True, ids=["mixed"])
def test_fields_are_labelled_for_the_convention_of_the_row(speaker: Speaker) -> None:
    served, _say = speaker
    assert fields(served, 0) == ["a₀", "α₀", "d₁", "θ₁", "β₁"]
    assert fields(served, 1) == ["a₂", "α₂", "d₂", "θ₂", "β₂"]
    assert served.state.selected_row == 1, "the first row with the fewest zeros"
    set_value(speaker, "Row", "1: joint_1")
    wait_until(lambda: "convention₁" in widgets(served), "its convention")
    set_value(speaker, "convention₁", "hayati")
    wait_until(lambda: fields(served, 0) == ["a₁", "α₁", "d₁", "θ₁", "β₁"], "the new convention")
    set_value(speaker, "Row", "2: joint_2")
    wait_until(lambda: "convention₂" in widgets(served), "its convention")
    set_value(speaker, "convention₂", "standard")
    wait_until(lambda: served.state.table.errors != (), "beta means nothing there")
    assert fields(served, 1)[-1] == "β₂"


def test_a_parameter_is_shown_and_edited_and_moves_the_robot(speaker: Speaker) -> None:
    served, _say = speaker
    assert widgets(served)["d1"].value == "0.4"
    set_value(speaker, "d1", "2 * d2")
    wait_until(lambda: served.state.spec.rows[0].d == 0.3, "the row that names it")
    assert served.state.spec.parameters["d1"] == 0.3
    set_value(speaker, "d1", "2 *")
    wait_until(lambda: served.state.table.errors != (), "the error")
    wait_until(lambda: "<b>d1</b>: in &#x27;2 *&#x27;" in served._panel._table._notes.content, "it is shown")
    assert served.state.spec.rows[0].d == 0.3


def test_another_robot_is_chosen_with_its_own_fields(speaker: Speaker) -> None:
    served, _say = speaker
    set_value(speaker, "Robot", "puma560")
    wait_until(lambda: "d4" in widgets(served), "its parameters")
    assert served.state.spec.name == "puma560"
    assert "d6" not in widgets(served)
    assert fields(served, 0) == ["a₀", "α₀", "d₁", "θ₁"]
    set_value(speaker, "Robot", "stanford.yaml")
    wait_until(lambda: "d6" in widgets(served), "the first robot's")
    assert (served.state.file, served.state.folder) == (STANFORD.file, STANFORD.folder)


def test_an_unknown_row_cannot_be_selected(speaker: Speaker) -> None:
    served, _say = speaker
    set_value(speaker, "Row", "7: joint_7")
    set_value(speaker, "a₁", "0.125")
    wait_until(lambda: served.state.spec.rows[0].a == 0.125, "what came after it")
    assert served.state.selected_row == 0
    wait_until(lambda: widgets(served)["Row"].value == "1: joint_1", "the choice is put back")
