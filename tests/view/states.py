"""States of pages that tests begin with, and what becomes of them."""

from __future__ import annotations

from dh2sim.robot.read import load_robot
from dh2sim.view.events import Event
from dh2sim.view.initial_state import open_state
from dh2sim.view.reduce import reduce
from dh2sim.view.state import ViewState

STANFORD = open_state(load_robot("stanford"))


def after(state: ViewState, *events: Event) -> ViewState:
    """Return the state after events."""
    for event in events:
        state = reduce(state, event)
    return state
