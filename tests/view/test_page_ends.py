"""What a page's thread makes of a browser that is gone."""

from __future__ import annotations

import pytest

from dh2sim.view.page import says_that_nobody_is_there


@pytest.mark.parametrize(
    "error",
    [
        UserWarning("Queued a GuiUpdateMessage on a closed connection (e.g. via a handle owned by a disconnected"),
        RuntimeError("Event loop is closed"),
    ],
    ids=["viser", "asyncio"],
)
def test_a_browser_that_was_closed_is_no_defect(error: Exception) -> None:
    assert says_that_nobody_is_there(error)


@pytest.mark.parametrize("error", [RuntimeError("dictionary changed size"), UserWarning("something else")])
def test_everything_else_is(error: Exception) -> None:
    assert not says_that_nobody_is_there(error)
