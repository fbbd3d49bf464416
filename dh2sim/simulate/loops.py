"""The two loops that simulate a batch.

With controls that are known beforehand MuJoCo simulates many time steps in one call; with controls that depend on the
state it stops before every time step for the controller.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import ControllerError
from dh2sim.simulate.batch import MonitoredBatch
from dh2sim.simulate.controllers.protocol import ClosedLoop, Observation, OpenLoop
from dh2sim.simulate.mujoco_runtime import VELOCITY_STAGE
from dh2sim.simulate.records import DERIVED, INTERVALS
from dh2sim.typing import Array


def checked(returned: object, shapes: Sequence[tuple[int, ...]], axes: str, *, controller: str, what: str) -> Array:
    """Return what a controller returned as an array of double precision.

    Args:
        returned: What the controller returned.
        shapes: Allowed shapes.
        axes: What the axes count, for the message.
        controller: Name of the controller.
        what: What it should be, as in 'controls'.

    Raises:
        ControllerError: It is not an array of real numbers, or has another shape.
    """
    start = f"controller '{controller}' returned"
    if returned is None:
        raise ControllerError(f"{start} None for {what}")
    try:
        found = np.asarray(returned)
        if found.dtype.kind not in "biufO":
            raise TypeError(f"their type is {found.dtype}")
        array: Array = found.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        raise ControllerError(f"{start} {what} that are not an array of numbers: {error}") from error
    if array.shape not in shapes:
        allowed = " or ".join(str(shape) for shape in dict.fromkeys(shapes))
        raise ControllerError(f"{start} {what} of shape {array.shape}, expected {allowed}: {axes}")
    return array


SEGMENT_BYTES = 2**23
"""Most that is recorded in one call of MuJoCo, so that it stays in the cache."""
SCHEDULED_STEPS = 64
"""Time steps of controls computed at a time where MuJoCo stops before each."""
_OPEN_LOOP_AXES = "rollouts, time steps or 1, actuators"
_CLOSED_LOOP_AXES = "rollouts, actuators"


def simulate_open_loop(monitored: MonitoredBatch, controller: OpenLoop, name: str) -> None:
    """Simulate a batch from its start to its end, recording.

    Args:
        monitored: The batch, at its start.
        controller: Its controller.
        name: Name of the controller, for errors.

    Raises:
        ControllerError: It did not return controls.
    """
    segment = _Segment(monitored)
    for first in range(0, monitored.steps, segment.steps):
        if not monitored.running:
            break
        count = min(segment.steps, monitored.steps - first)
        controls, outside = monitored.clipped(controls_of(controller, first, count, monitored.shape, name))
        segment.run(controls, first, count)
        monitored.count(outside, first, count)
    _end(monitored)


def controls_of(controller: OpenLoop, first: int, count: int, shape: tuple[int, ...], name: str) -> Array:
    """Return the controls of some time steps, shape (batch, count or 1, actuators); ``shape`` is that of one step's.

    Raises:
        ControllerError: They are not such an array.
    """
    simulations, actuators = shape
    shapes = [(simulations, count, actuators), (simulations, 1, actuators)]
    return checked(controller.controls(first, count), shapes, _OPEN_LOOP_AXES, controller=name, what="controls")


def control_of(controller: ClosedLoop, observation: Observation, shape: tuple[int, ...], name: str) -> Array:
    """Return the controls of a time step, shape (batch, actuators).

    Raises:
        ControllerError: They are not such an array.
    """
    returned = controller.control(observation)
    return checked(returned, [shape], _CLOSED_LOOP_AXES, controller=name, what="controls")


class Scheduled:
    """An open-loop controller, asked step by step: slower, for what can only be recorded between steps."""

    def __init__(self, controller: OpenLoop, monitored: MonitoredBatch, name: str) -> None:
        """Wrap a controller of the batch; ``name`` is its name."""
        self._controller, self._monitored, self._name = controller, monitored, name
        self._controls: Array | None = None

    def control(self, observation: Observation) -> Array:
        """Return the controls of this time step, shape (batch, actuators)."""
        step = observation.step % SCHEDULED_STEPS
        if step == 0 or self._controls is None:
            first = observation.step - step
            count = min(SCHEDULED_STEPS, self._monitored.steps - first)
            self._controls = controls_of(self._controller, first, count, self._monitored.shape, self._name)
        return self._controls[:, min(step, self._controls.shape[1] - 1)]


class _Segment:
    """Some time steps of a batch, in buffers that are used again and again."""

    def __init__(self, monitored: MonitoredBatch) -> None:
        self._monitored = monitored
        self._qpos = monitored.batch.bind("qpos")
        recorder, data = monitored.recorder, mujoco.MjData(monitored.plant.model)
        # positions and the number of contacts always, for the first contact of each rollout
        gaps = ("sensordata",) if monitored.plant.gaps else ()
        fields = (*recorder.state_fields, *recorder.derived_fields, "qpos", "ncon", *gaps)
        self._fields = tuple(dict.fromkeys(fields))
        shapes = {field: np.shape(getattr(data, field)) for field in self._fields}
        width = monitored.plant.model.nu + sum(int(np.prod(shape)) for shape in shapes.values())
        self.steps = max(16, min(monitored.steps, SEGMENT_BYTES // (8 * monitored.batch.nsim * max(1, width))))
        self._buffers = {
            field: np.empty((monitored.batch.nsim, self.steps, *shape), np.int32 if field == "ncon" else np.float64)
            for field, shape in shapes.items()
        }

    def run(self, controls: Array, first: int, count: int) -> None:
        """Simulate ``count`` time steps from ``first``; controls of shape (batch, count or 1, actuators)."""
        monitored, batch = self._monitored, self._monitored.batch
        before, start = batch.state.copy(), self._qpos.copy()
        ids, rows = monitored.ids, monitored.rows
        out = self._out(count, rows)
        failed = monitored.call(self._advance, controls, rows, ids, count, out)
        for field, values in out.items():
            monitored.recorder.put_field(field, first + (field in monitored.recorder.state_fields), values, rows)
        monitored.recorder.put("ctrl", first, np.broadcast_to(controls, (len(controls), count, controls.shape[2])))
        running = np.arange(batch.nsim)[rows]
        if len(failed):
            out["ncon"][np.isin(running, failed)] = 0
            self._step_by_step(failed, before, controls, first, count)
        monitored.contacts.see_many(running, first, out["ncon"], start, out["qpos"])
        if monitored.plant.gaps:
            went_on = np.flatnonzero(~np.isin(running, failed))
            monitored.see_gaps(running[went_on], out["sensordata"][went_on])

    def _advance(
        self, controls: Array, rows: Any, ids: NDArray[np.int32] | None, count: int, out: dict[str, NDArray[Any]]
    ) -> None:
        batch = self._monitored.batch
        if controls.shape[1] == count:
            batch.rollout(count, controls[rows], record=self._fields, ids=ids, out=out)
            return
        if controls.shape[2]:
            batch.bind("ctrl")[:] = controls[:, 0]
        batch.rollout(count, None, record=self._fields, ids=ids, out=out)

    def _out(self, count: int, rows: Any) -> dict[str, NDArray[Any]]:
        if count == self.steps and isinstance(rows, slice):
            return self._buffers
        alive = int(np.count_nonzero(self._monitored.alive))
        return {name: np.empty((alive, count, *old.shape[2:]), old.dtype) for name, old in self._buffers.items()}

    def _step_by_step(self, failed: NDArray[np.intp], before: Array, controls: Array, first: int, count: int) -> None:
        """Simulate again those that failed, to find the step in which they did, and record what came before."""
        monitored = self._monitored
        monitored.put_back(failed, before)
        left = failed
        for j in range(count):
            now, start = controls[left, min(j, controls.shape[1] - 1)][:, None], self._qpos.copy()
            ids = left.astype(np.int32)
            out = {name: np.empty((len(left), 1, *old.shape[2:]), old.dtype) for name, old in self._buffers.items()}
            stopped = monitored.call(self._one, now, ids, out)
            stopped = stopped[np.isin(stopped, left)]
            monitored.stop(stopped, first + j)
            for field, values in out.items():
                monitored.recorder.put_field(
                    field, first + j + (field in monitored.recorder.state_fields), values, left
                )
            went_on = ~np.isin(left, stopped)
            monitored.contacts.see_many(left[went_on], first + j, out["ncon"][went_on], start, out["qpos"][went_on])
            if monitored.plant.gaps:
                monitored.see_gaps(left[went_on], out["sensordata"][went_on])
            left = left[went_on]
            if not len(left):
                return

    def _one(self, controls: Array, ids: NDArray[np.int32], out: dict[str, NDArray[Any]]) -> None:
        given = controls if controls.shape[2] else None
        self._monitored.batch.rollout(1, given, record=self._fields, ids=ids, out=out)


def _end(monitored: MonitoredBatch) -> None:
    """Record what MuJoCo derives from the last state."""
    fields = {
        field: monitored.batch.bind(field)
        for field in ("sensordata", "energy")
        if field in monitored.recorder.derived_fields
    }
    sensors = monitored.batch.bind("sensordata") if monitored.plant.gaps else None
    monitored.look(monitored.steps)
    if sensors is not None:
        monitored.see_gaps(monitored.rows, sensors[monitored.rows][:, None])
    for field, values in fields.items():
        monitored.recorder.put_field(field, monitored.steps, values[monitored.rows][:, None], monitored.rows, DERIVED)


class Observed(Observation, Protocol):
    """An observation that follows a batch."""

    def advance(self) -> None:
        """Note that the batch has taken a step."""
        ...


class Applied(Protocol):
    """Something that acts on a batch before each of its steps."""

    def apply(self, step: int) -> None:
        """Act in a time step."""
        ...

    def apply_again(self, simulations: NDArray[np.intp]) -> None:
        """Act on some simulations that are put back, as before."""
        ...


PAGE_STEPS = 64
"""Time steps that are kept before they are recorded together."""
BEFORE_STEP = (*DERIVED, "contacts")
"""Variables that MuJoCo has computed before a time step; the others of ``INTERVALS`` come with the step."""


def simulate_closed_loop(
    monitored: MonitoredBatch,
    controller: ClosedLoop,
    observation: Observed,
    name: str,
    pushes: Applied | None = None,
) -> None:
    """Simulate a batch from its start to its end, recording.

    Before a step, what MuJoCo derives from positions and velocities is computed (``mjSTAGE_VEL``), in the same call
    as the step before it; the step continues from there, so that observing costs nothing.

    Args:
        monitored: The batch, at its start and persistent.
        controller: Its controller.
        observation: What the controller sees of the batch.
        name: Name of the controller, for errors.
        pushes: Forces that are applied from outside.

    Raises:
        ControllerError: It did not return controls.
    """
    batch, recorder = monitored.batch, monitored.recorder
    controls = batch.bind("ctrl")
    derived = {field: batch.bind(field) for field in recorder.derived_fields}
    contacts, qpos = batch.bind("ncon"), batch.bind("qpos")
    sensors = batch.bind("sensordata") if monitored.plant.gaps else None
    pages = _Pages(monitored)
    monitored.look(0)
    for step in range(monitored.steps):
        if not monitored.running:
            break
        if np.count_nonzero(contacts):
            rows = monitored.rows
            monitored.contacts.see(np.flatnonzero(monitored.alive), step, contacts[rows], qpos[rows])
        if sensors is not None:
            monitored.see_gaps(monitored.rows, sensors[monitored.rows][:, None])
        for field, values in derived.items():
            if field != "qacc":
                pages.note(field, values, BEFORE_STEP)
        wanted = control_of(controller, observation, controls.shape, name)
        if pushes is not None:
            pushes.apply(step)
        given, outside = monitored.clipped(wanted)
        controls[:] = given
        # step and look at once: what is kept of a simulation is in the processor's cache then
        failed = in_step = monitored.call(batch.step, monitored.ids, stage=VELOCITY_STAGE)
        if len(failed):  # again, one after the other, to tell which of them fails
            monitored.put_back(failed, pages.before)
            controls[failed] = given[failed]
            if pushes is not None:
                pushes.apply_again(failed)
            in_step = monitored.call(batch.step, failed.astype(np.int32))
        for field in ("qacc", "sensordata"):
            if field in derived:
                pages.note(field, derived[field], INTERVALS)
        pages.turn()
        if len(failed):
            monitored.stop(in_step, step)
            monitored.look(step + 1, np.setdiff1d(failed, in_step))
        if outside is not None:
            monitored.count(outside[:, None], step, 1)
        observation.advance()
    pages.flush()
    if sensors is not None:
        monitored.see_gaps(monitored.rows, sensors[monitored.rows][:, None])
    for field, values in derived.items():
        recorder.put_field(field, monitored.steps, values[:, None], only=DERIVED)


class _Pages:
    """Keeps states, controls and other fields step by step, and passes many steps at once to the recorder."""

    def __init__(self, monitored: MonitoredBatch) -> None:
        """Begin at the first step."""
        self._recorder, self._state = monitored.recorder, monitored.batch.state
        parts = (mujoco.mjtState.mjSTATE_QPOS, mujoco.mjtState.mjSTATE_QVEL, mujoco.mjtState.mjSTATE_CTRL)
        model = monitored.plant.model
        # a component of a row comes after those of the lesser bits
        starts = [mujoco.mj_stateSize(model, int(part) - 1) for part in parts]
        ends = [start + mujoco.mj_stateSize(model, int(part)) for start, part in zip(starts, parts, strict=True)]
        self._qpos, self._qvel, self._ctrl = map(slice, starts, ends)
        self._rows = np.empty((1 + PAGE_STEPS, monitored.batch.nsim, ends[-1]))
        """Beginnings of the rows of states: before the page, and after each step with the controls of that step."""
        self._rows[0] = self._state[:, : ends[-1]]
        self._kept: dict[tuple[str, tuple[str, ...]], NDArray[Any]] = {}
        self._first = self._count = 0

    @property
    def before(self) -> Array:
        """All of the states before the current step that a step changes, as the beginnings of their rows."""
        before: Array = self._rows[self._count]
        return before

    def note(self, field: str, values: NDArray[Any], variables: tuple[str, ...]) -> None:
        """Keep a copy of a field in the current step, shape (batch, …), for some variables."""
        key = field, variables
        if key not in self._kept:
            self._kept[key] = np.empty((PAGE_STEPS, *values.shape), values.dtype)
        self._kept[key][self._count] = values

    def turn(self) -> None:
        """Keep states and controls after a step, and proceed to the next one."""
        self._count += 1
        self._rows[self._count] = self._state[:, : self._rows.shape[2]]
        if self._count == PAGE_STEPS:
            self.flush()

    def flush(self) -> None:
        """Record what was kept."""
        rows, recorder = self._rows[1 : 1 + self._count].swapaxes(0, 1), self._recorder
        recorder.put("ctrl", self._first, rows[..., self._ctrl])
        recorder.put_field("qpos", self._first + 1, rows[..., self._qpos])
        recorder.put_field("qvel", self._first + 1, rows[..., self._qvel])
        for (field, variables), values in self._kept.items():
            recorder.put_field(field, self._first, values[: self._count].swapaxes(0, 1), only=variables)
        self._rows[0] = self._rows[self._count]
        self._first += self._count
        self._count = 0
