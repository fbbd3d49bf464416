"""The animation of a row: a frame that goes through the elementary steps of its product, one after the other."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from dh2sim.view.events import AdvanceRow, Event
from dh2sim.view.motion.motion_source import FRAME_RATE
from dh2sim.view.scene.annotations import ORDER, Quantity, row_steps
from dh2sim.view.state import Part, ViewState

STEP_SECONDS: Final = 1.5
"""s that a step takes."""
ZERO_SECONDS: Final = 0.4
"""s that a step by zero takes."""
_MATRICES: Final = {
    Quantity.A: "Tx",
    Quantity.ALPHA: "Rx",
    Quantity.D: "Tz",
    Quantity.THETA: "Rz",
    Quantity.BETA: "Ry",
}


def step_count(state: ViewState) -> int:
    """Return the number of elementary steps of the selected row."""
    return len(ORDER[state.spec.rows[state.selected_row].convention])


def played(state: ViewState, *, on: bool) -> ViewState:
    """Return the state with the animation of the selected row running, or paused where it is.

    One that has not been started, or has ended, starts from the beginning, in a scene that explains the row.
    """
    if not on:
        return replace(state, row_playing=False)
    done = state.row_progress
    start = 0.0 if done is None or done >= step_count(state) else done
    return replace(state, row_playing=True, row_progress=start, shown=state.shown | {Part.ANNOTATIONS})


def advanced(state: ViewState, seconds: float) -> ViewState:
    """Return the state some time later, if its animation is running; it ends with the last step."""
    if not state.row_playing or state.row_progress is None or not seconds > 0.0:
        return state
    steps = row_steps(state.spec, state.model.chain, state.selected_row, state.q)
    done = state.row_progress
    while seconds > 0.0 and done < len(steps):
        duration = STEP_SECONDS if steps[int(done)].is_drawn else ZERO_SECONDS
        left = (int(done) + 1 - done) * duration
        if seconds < left:
            done += seconds / duration
            break
        seconds -= left
        done = float(int(done) + 1)
    return replace(state, row_progress=done, row_playing=done < len(steps))


def step_text(state: ViewState) -> str:
    """Return what the animation of the selected row is doing, such as ``Step 2 of 4: Tz(d₁ = 0.4 m)``."""
    if state.row_progress is None:
        return ""
    steps = row_steps(state.spec, state.model.chain, state.selected_row, state.q)
    number = min(int(state.row_progress), len(steps) - 1)
    step = steps[number]
    return f"Step {number + 1} of {len(steps)}: {_MATRICES[step.quantity]}({step.text(state.angle)})"


class RowAnimation:
    """Advances a page's animation with the clock; used on the page's thread alone."""

    def __init__(self, state: Callable[[], ViewState], apply: Callable[[Event], None]) -> None:
        """Wait until an animation is running.

        Args:
            state: Returns the page's state.
            apply: Applies an event at once.
        """
        self._state = state
        self._apply = apply
        self._last: float | None = None

    @property
    def tick_interval(self) -> float | None:
        """Time between two frames, s; None while no animation is running."""
        return 1.0 / FRAME_RATE if self._state().row_playing else None

    def tick(self) -> None:
        """Advance a running animation to the present."""
        now = time.monotonic()
        if not self._state().row_playing:
            self._last = None
            return
        if self._last is not None:
            self._apply(AdvanceRow(seconds=now - self._last))
        self._last = now
