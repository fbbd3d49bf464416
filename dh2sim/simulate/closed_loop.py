"""Simulating with controls that depend on the state: the engine stops before every time step to be looked at."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.simulate.checked import checked
from dh2sim.simulate.controllers.protocol import ClosedLoop
from dh2sim.simulate.group import Group
from dh2sim.simulate.observation import BatchObservation
from dh2sim.simulate.records import DERIVED, INTERVALS

SEGMENT = 64
"""Time steps after which what was seen is put into the arrays."""
BEFORE_STEP = (*DERIVED, "contacts")
"""Variables that MuJoCo has computed when a time step begins; the others of ``INTERVALS`` come with the step."""
AXES = "rollouts, actuators"


def simulate_closed_loop(group: Group, controller: ClosedLoop, observation: BatchObservation, name: str) -> None:
    """Simulate a group from its start to its end, recording.

    Before a step, what MuJoCo derives from positions and velocities is computed (``mjSTAGE_VEL``); the step goes on
    from there, so that looking costs nothing.

    Args:
        group: at its start; its batch is persistent.
        controller: of the group.
        observation: of its batch.
        name: of the controller, for errors.

    Raises:
        ControllerError: it returned what are no controls.
    """
    batch, recorder = group.batch, group.recorder
    controls = batch.bind("ctrl")
    derived = {field: batch.bind(field) for field in recorder.derived_fields}
    states = {field: batch.bind(field) for field in recorder.state_fields}
    pages = _Pages(group)
    group.look(0)
    for step in range(group.steps):
        if not group.alive.any():
            break
        for field, values in derived.items():
            if field != "qacc":
                pages.note(field, "before", values)
        wanted = checked(controller.control(observation), [controls.shape], AXES, controller=name, what="controls")
        controls[:], outside = group.clipped(wanted)
        pages.note("ctrl", "before", controls)
        failed = group.call(batch.step, group.ids)
        for field in ("qacc", "sensordata"):
            if field in derived:
                pages.note(field, "after", derived[field])
        for field, values in states.items():
            pages.note(field, "state", values)
        pages.turn()
        group.stop(failed, step)
        group.look(step + 1)
        if outside is not None:
            group.count(outside[:, None], step, 1)
        observation.advance()
    pages.flush()
    for field, values in derived.items():
        recorder.put_field(field, group.steps, values[:, None], only=DERIVED)


class _Pages:
    """Keeps what was seen in the order of time, and turns it over to the recorder many steps at once."""

    def __init__(self, group: Group) -> None:
        self._recorder = group.recorder
        self._kept: dict[tuple[str, str], NDArray[Any]] = {}
        self._first = self._count = 0

    def note(self, field: str, when: str, values: NDArray[Any]) -> None:
        """Keep a copy of what a field holds in the present step; shape (batch, …)."""
        if (field, when) not in self._kept:
            self._kept[field, when] = np.empty((SEGMENT, *values.shape), values.dtype)
        self._kept[field, when][self._count] = values

    def turn(self) -> None:
        """Go on to the next step."""
        self._count += 1
        if self._count == SEGMENT:
            self.flush()

    def flush(self) -> None:
        """Hand over what was kept."""
        for (field, when), values in self._kept.items():
            seen = values[: self._count].swapaxes(0, 1)
            match when:
                case "state":
                    self._recorder.put_field(field, self._first + 1, seen)
                case "before" if field == "ctrl":
                    self._recorder.put("ctrl", self._first, seen)
                case "before":
                    self._recorder.put_field(field, self._first, seen, only=BEFORE_STEP)
                case _:
                    self._recorder.put_field(field, self._first, seen, only=INTERVALS)
        self._first += self._count
        self._count = 0
