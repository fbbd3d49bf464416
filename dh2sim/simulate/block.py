"""Simulation of a block of rollouts: a pure function of a job and a range of rollouts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from dh2sim.arguments import whole_number
from dh2sim.errors import ControllerError, EngineError
from dh2sim.messages import listed
from dh2sim.processors import available_processors
from dh2sim.progress import Advance
from dh2sim.robot.variation import CELLS
from dh2sim.simulate.batch import BatchObservation, GravityForces, MonitoredBatch
from dh2sim.simulate.controllers.position import holding_controls
from dh2sim.simulate.controllers.protocol import ClosedLoop, Controller, Follows, OpenLoop, RolloutBatch
from dh2sim.simulate.controllers.registry import ControllerChoice
from dh2sim.simulate.dataset_layout import Layout, design_variables
from dh2sim.simulate.design_plants import DesignPlant, DesignPlants, groups
from dh2sim.simulate.disturbances import (
    SENSING,
    DelayedClosedLoop,
    DelayedOpenLoop,
    Pushes,
    SensedObservation,
    delay_steps,
)
from dh2sim.simulate.initial_states import InitialStates
from dh2sim.simulate.loops import Observed, Scheduled, checked, simulate_closed_loop, simulate_open_loop
from dh2sim.simulate.mujoco_runtime import quiet_engine, set_models
from dh2sim.simulate.options import ENGINES, WARP, RolloutOptions
from dh2sim.simulate.plant import Plant, batch_plant
from dh2sim.simulate.randomization import Draws, Generators, Purpose, draw, push_time
from dh2sim.simulate.randomized_models import apply_draws
from dh2sim.simulate.records import Recorder
from dh2sim.simulate.turns import Turns
from dh2sim.simulate.warp_batch import TOLERANCE, WarpBatch
from dh2sim.typing import Array, read_only

BATCH_SIZE = 128
"""Most rollouts that are simulated together: enough that Python's share of the time is small, and few enough that
what a closed loop keeps of each between its steps stays in the processor's caches, those of addresses among them:
MjData takes some ten pages, and twice as many rollouts took a third longer a step where other programs ran."""
LEAST_SIZE = 32
"""Fewest for which a thread of their own is worth while."""
REFERENCE_STEPS = 512
"""Time steps of references computed at a time."""

Block = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Job:
    """A run that is ready to be simulated."""

    options: RolloutOptions
    mjcf: str = field(repr=False)
    """Text of the model."""
    plant: Plant
    """The model, compiled."""
    controller: ControllerChoice
    initial: InitialStates
    layout: Layout = field(repr=False)
    designs: DesignPlants | None = None
    """Where rollouts have designs of their own; ``plant`` is that of the robot file then."""


def simulate_block(job: Job, rollouts: range, *, threads: int = 0, advance: Advance | None = None) -> Block:
    """Simulate some rollouts of a run.

    Args:
        job: The run.
        rollouts: Which of its rollouts.
        threads: Number of threads; 0: one for each processor of this process. The result does not depend on it.
        advance: Called with the number of rollouts that have been simulated since the last call.

    Returns:
        Every variable of the run's dataset, rollouts first. The same bits whatever else is simulated with them.

    Raises:
        ControllerError: The controller failed, or returned an array of the wrong shape.
    """
    arrays = _empty(job, rollouts)
    made: dict[int, DesignPlant] = {}
    threads = whole_number("threads", threads) or available_processors()
    # what others wrote may need the main thread, and may have to be interrupted
    takers = threads if job.controller.own else 1
    parts = [rollouts] if job.options.engine == WARP else _divided(rollouts, takers)  # a device is to be filled
    workers = max(1, min(takers, len(parts)))
    turns = Turns(workers)

    def simulate(part: range) -> None:
        rows = slice(part.start - rollouts.start, part.stop - rollouts.start)
        own = {name: array[rows] for name, array in arrays.items()}
        _simulate(job, part, threads // workers, own, job.options.steps, made, turns)

    with quiet_engine(), closing(turns.run([partial(simulate, part) for part in parts])) as done:
        for part, _ in zip(parts, done, strict=True):
            if advance is not None:
                advance(len(part))
    return arrays


def _divided(rollouts: range, takers: int) -> list[range]:
    """Return the rollouts that are simulated together: as many groups as can take turns."""
    total = len(rollouts)
    count = max(-(-total // BATCH_SIZE), min(takers, total // LEAST_SIZE))
    workers = min(takers, count) or 1
    count = min(-(-count // workers) * workers, total)
    return [rollouts[total * k // count : total * (k + 1) // count] for k in range(count)]


def rehearse(job: Job) -> None:
    """Simulate one step of the first rollouts, so that a controller that fails does so before a run is made.

    With MuJoCo Warp that step is compared with MuJoCo's, where no links touch: where they do, contacts that are found
    in single precision differ by more.

    Raises:
        ControllerError: It fails.
        EngineError: MuJoCo Warp cannot simulate the robot, or not as MuJoCo does.
    """
    short, first = replace(job, options=job.options.replace(steps=1, every=1)), range(min(2, job.options.rollouts))
    with quiet_engine():
        found = _first_positions(short, first, job.options.steps)
        if job.options.engine == WARP:
            mujoco = replace(short, options=short.options.replace(engine=ENGINES[0]))
            _check_near(found, _first_positions(mujoco, first, job.options.steps))


def _first_positions(short: Job, first: range, run_steps: int) -> Array:
    """Return positions after a step, shape (rollouts, n); NaN for rollouts whose links touch in it."""
    arrays = {**_empty(short, first), "qpos": np.empty((len(first), 2, short.plant.n))}
    _simulate(short, first, 1, arrays, run_steps, {}, Turns(1))
    return np.where((arrays["contact_step"] == 0)[:, None], np.nan, arrays["qpos"][:, 1])


def _check_near(found: Array, expected: Array) -> None:
    away = np.abs(found - expected) / (1.0 + np.abs(expected))
    most = float(np.max(away[np.isfinite(away)], initial=0.0))
    if most > TOLERANCE:
        raise EngineError(
            f"MuJoCo Warp is {most:.1g} away from MuJoCo after the first time step, and {TOLERANCE:g} is allowed: "
            "single precision does not suffice for this robot. Use the engine 'mujoco'"
        )


def _empty(job: Job, rollouts: range) -> dict[str, NDArray[Any]]:
    records = job.options.records
    sizes = {**job.layout.sizes, "rollout": len(rollouts), "step": records + 1, "interval": records}
    return {
        variable.name: np.empty([sizes[name] for name in variable.dimensions], dtype=variable.dtype)
        for variable in job.layout.variables
    }


def _simulate(
    job: Job,
    rollouts: range,
    threads: int,
    arrays: Block,
    run_steps: int,
    made: dict[int, DesignPlant],
    turns: Turns,
) -> None:
    """Simulate some rollouts into their part of the block's arrays, in one batch, or one for each layout of models.

    The controller is made for ``run_steps`` time steps; ``made`` has designs that were made before.
    """
    if job.designs is None:
        _simulate_batch(job, job.plant, None, rollouts, threads, arrays, run_steps, turns)
        return
    designs = job.designs.of(rollouts, made)
    _note_designs(job.designs, designs, rollouts, arrays)
    for group in groups(designs):
        own = [designs[position] for position in group]
        whole = len(group) == len(rollouts)
        parts = arrays if whole else {name: array[group] for name, array in arrays.items()}
        which: Sequence[int] = rollouts if whole else [rollouts[position] for position in group]
        start = read_only([design.start for design in own])
        plant = batch_plant([design.plant for design in own])
        _simulate_batch(job, plant, start, which, threads, parts, run_steps, turns)
        if not whole:
            for name, array in arrays.items():
                array[group] = parts[name]


def _note_designs(plants: DesignPlants, designs: Sequence[DesignPlant], rollouts: range, arrays: Block) -> None:
    """Record what the designs of rollouts are."""
    numbers = [rollout // plants.per_design for rollout in rollouts]
    arrays["design"][:] = numbers
    values = {number: plants.designs.values(number) for number in set(numbers)}
    for i, name in enumerate(design_variables(plants.designs.names)):
        arrays[name][:] = [values[number][i] for number in numbers]
    for i, cell in enumerate(CELLS):
        if f"dh_{cell}" in arrays:
            arrays[f"dh_{cell}"][:] = [design.rows[:, i] for design in designs]


def _simulate_batch(
    job: Job,
    plant: Plant,
    start: Array | None,
    rollouts: Sequence[int],
    threads: int,
    arrays: Block,
    run_steps: int,
    turns: Turns,
) -> None:
    """Simulate rollouts in one batch; ``start`` has the named configuration of each where they have designs."""
    options, name = job.options, job.controller.name
    drawn = draw(plant, options, rollouts, run_steps)
    qpos0, qvel0 = job.initial.states(plant, options, rollouts, start)
    controlled = plant.controlled
    gravity = GravityForces(plant, len(rollouts), threads, drawn)
    started = RolloutBatch(
        plant=controlled,
        steps=run_steps,
        rollouts=rollouts,
        q0=read_only(qpos0[:, controlled.positions]),
        v0=read_only(qvel0[:, controlled.velocities]),
        qpos0=read_only(qpos0),
        gravity0=read_only(gravity.forces(qpos0)),
        generators=Generators(options.seed, rollouts, Purpose.CONTROLLER),
    )
    own = job.controller.make(started)
    controller = _delayed(own, started, drawn, name)
    sensing = SENSING & drawn.keys()
    if sensing and not isinstance(controller, ClosedLoop):
        raise ControllerError(
            f"controller '{name}' looks at no state: {listed(sorted(sensing))} would change nothing"
        )
    recorder = Recorder(plant, arrays, options.every)
    stepwise = isinstance(controller, ClosedLoop) or recorder.looks_between_steps or "push_force" in drawn
    if options.engine == WARP:
        batch: Any = _warp_batch(plant, len(rollouts), controller, name)
    else:
        # between the steps of a closed loop an MjData keeps what it has computed already
        batch = Batch(plant.model, len(rollouts), threads, persistent=stepwise)
        set_models(batch, plant, as_fields=bool(drawn))
        apply_draws(batch, plant, drawn)
    batch.bind("qpos")[:] = qpos0
    batch.bind("qvel")[:] = qvel0
    monitored = MonitoredBatch(plant, batch, recorder, options.steps, turns, drawn.get("effort_scale"))
    pushes = None
    if "push_force" in drawn:
        times = [push_time(options, name) for name in ("push_interval", "push_duration")]
        pushes = Pushes(plant, batch, drawn, *times)
    monitored.contacts.number_as(job.plant.model)
    for state in recorder.state_fields:
        recorder.put_field(state, 0, batch.bind(state)[:, None])
    if isinstance(controller, ClosedLoop):
        observation: Observed = BatchObservation(controlled, batch, gravity)
        if sensing:
            sources = Generators(options.seed, rollouts, Purpose.SENSE)
            seen = BatchObservation(controlled, batch, gravity)
            observation = SensedObservation(seen, drawn, sources, plant.timestep)
        simulate_closed_loop(monitored, controller, observation, name, pushes)
    elif not isinstance(controller, OpenLoop):
        raise ControllerError(f"controller '{name}' has neither 'control' nor 'controls'")
    elif stepwise:
        scheduled = Scheduled(controller, monitored, name)
        simulate_closed_loop(monitored, scheduled, BatchObservation(controlled, batch, gravity), name, pushes)
    else:
        simulate_open_loop(monitored, controller, name)
    _record_reference(recorder, own, job, len(rollouts))
    recorder.end(monitored.stop_step)
    arrays["status"][:], arrays["stop_step"][:] = monitored.status, monitored.stop_step
    arrays["saturation"][:] = monitored.saturation
    if plant.gaps:
        arrays["loop_gap"][:] = monitored.gaps
    monitored.contacts.forget_after(monitored.stop_step)
    arrays["contact_step"][:] = monitored.contacts.step
    arrays["contact_link_a"][:], arrays["contact_link_b"][:] = monitored.contacts.links.T
    for variable, values in drawn.items():
        arrays[variable][:] = values


def _warp_batch(plant: Plant, simulations: int, controller: Controller, name: str) -> WarpBatch:
    """Return a batch on the device, if its controller need not be asked between steps."""
    if isinstance(controller, ClosedLoop):
        raise ControllerError(
            f"controller '{name}' looks at the state before every time step, which the engine 'warp' keeps on its "
            "device. Use hold, passive, sine, random or replay, or the engine 'mujoco'"
        )
    return WarpBatch(plant, simulations)


def _delayed(controller: Controller, started: RolloutBatch, drawn: Draws, name: str) -> Controller:
    """Return a controller whose controls arrive as late as was drawn; one that is wrong is left to be reported."""
    if "control_delay" not in drawn or not isinstance(controller, OpenLoop | ClosedLoop):
        return controller
    delay = delay_steps(drawn["control_delay"], started.plant.timestep)
    held = holding_controls(started, against_gravity=True)
    if isinstance(controller, ClosedLoop):
        return DelayedClosedLoop(controller, delay, held, name)
    return DelayedOpenLoop(controller, delay, held, name)


def _record_reference(recorder: Recorder, controller: object, job: Job, simulations: int) -> None:
    if not (isinstance(controller, Follows) and recorder.wants("qpos_ref")):
        return
    name, total, plant = job.controller.name, job.options.steps + 1, job.plant
    for first in range(0, total, REFERENCE_STEPS):
        count = min(REFERENCE_STEPS, total - first)
        shapes, axes = [(simulations, count, plant.controlled.n)], "rollouts, time steps, joints"
        returned = controller.reference(first, count)
        try:
            q, v = returned
        except (TypeError, ValueError) as error:
            raise ControllerError(
                f"controller '{name}': its reference must be a pair of positions and velocities"
            ) from error
        for variable, what, values in (("qpos_ref", "positions", q), ("qvel_ref", "velocities", v)):
            given = checked(values, shapes, axes, controller=name, what=f"reference {what}")
            if plant.independent is not None:  # passive joints have no reference
                every = np.full((simulations, count, plant.n), np.nan)
                every[:, :, plant.independent] = given
                given = every
            recorder.put(variable, first, given)
