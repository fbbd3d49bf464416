"""A block of rollouts: a pure function of (model text, settings, range of rollouts)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from dh2sim.errors import ControllerError, EngineError
from dh2sim.simulate.batch import BatchObservation, GravityForces, MonitoredBatch
from dh2sim.simulate.controllers.protocol import ClosedLoop, Follows, OpenLoop, RolloutBatch
from dh2sim.simulate.dataset_layout import run_sizes, run_variables
from dh2sim.simulate.initial_states import starts
from dh2sim.simulate.loops import Scheduled, checked, simulate_closed_loop, simulate_open_loop
from dh2sim.simulate.mujoco_runtime import quiet_engine
from dh2sim.simulate.plant import Plant, make_plant
from dh2sim.simulate.randomization import Generators, Purpose, apply_scales, scales
from dh2sim.simulate.records import Recorder
from dh2sim.simulate.settings import Settings
from dh2sim.typing import Array, read_only

BATCH_SIZE = 256
"""Simulations that run together: so many that Python's share is small, and so few that what a closed loop keeps of
each of them between its steps stays in the processor's cache."""
REFERENCE_STEPS = 512
"""Time steps of references asked for at once."""

Block = Mapping[str, NDArray[Any]]


def simulate_block(
    mjcf: str,
    settings: Settings,
    rollouts: range,
    *,
    threads: int = 0,
    advance: Callable[[int], None] | None = None,
) -> Block:
    """Simulate some rollouts of a run.

    Args:
        mjcf: text of the model, as ``to_mjcf`` writes it.
        settings: of the run.
        rollouts: which of its rollouts.
        threads: number of threads, 0 for all processors; the result does not depend on it.
        advance: told how many rollouts are done.

    Returns:
        Every variable of the run's dataset, rollouts first. The same bits whatever else is simulated with them.

    Raises:
        ControllerError: the controller returned something of the wrong shape.
    """
    plant = plant_of(mjcf, settings)
    arrays = _empty(plant, settings, rollouts)
    with quiet_engine():
        for first in range(rollouts.start, rollouts.stop, BATCH_SIZE):
            part = range(first, min(first + BATCH_SIZE, rollouts.stop))
            rows = slice(part.start - rollouts.start, part.stop - rollouts.start)
            own = {name: array[rows] for name, array in arrays.items()}
            _simulate(plant, settings, part, threads, own, told=settings.steps)
            if advance is not None:
                advance(len(part))
    return arrays


def rehearse(plant: Plant, settings: Settings) -> None:
    """Simulate one step of the first rollouts, so that a controller that fails does so before a run is made.

    Raises:
        ControllerError: it fails.
    """
    short, first = replace(settings, steps=1, every=1), range(min(2, settings.rollouts))
    with quiet_engine():
        _simulate(plant, short, first, 1, _empty(plant, short, first), told=settings.steps)


def _empty(plant: Plant, settings: Settings, rollouts: range) -> dict[str, NDArray[Any]]:
    sizes = {**run_sizes(plant, settings), "rollout": len(rollouts)}
    return {
        variable.name: np.empty([sizes[name] for name in variable.dimensions], dtype=variable.dtype)
        for variable in run_variables(plant, settings)
    }


def plant_of(mjcf: str, settings: Settings) -> Plant:
    """Compile a run's model and describe it.

    Raises:
        EngineError: MuJoCo refuses it.
    """
    return make_plant(_compiled(mjcf), velocity=settings.velocity, kp=settings.kp, kv=settings.kv, home=settings.home)


@lru_cache(maxsize=4)
def _compiled(mjcf: str) -> mujoco.MjModel:
    try:
        return mujoco.MjModel.from_xml_string(mjcf)
    except ValueError as error:
        raise EngineError(
            f"MuJoCo refuses the robot as it would be simulated: {' '.join(str(error).split())}"
        ) from error


def _simulate(plant: Plant, settings: Settings, rollouts: range, threads: int, arrays: Block, *, told: int) -> None:
    """Simulate a group into its part of the block's arrays; the controller is told of so many steps."""
    factors = scales(plant, settings, rollouts)
    q0, v0 = starts(plant, settings, rollouts)
    qpos0 = np.concatenate([np.tile(_base(plant), (len(q0), 1)), q0], axis=1)
    gravity = GravityForces(plant, len(rollouts), threads, factors)
    started = RolloutBatch(
        plant=plant,
        steps=told,
        rollouts=rollouts,
        q0=read_only(q0),
        v0=read_only(v0),
        gravity0=read_only(gravity.forces(qpos0)),
        generators=Generators(settings.seed, rollouts, Purpose.CONTROLLER),
    )
    controller = settings.controller.make(started)
    recorder = Recorder(plant, arrays, settings.every)
    looks = isinstance(controller, ClosedLoop) or recorder.looks_between_steps
    # between the steps of a closed loop an MjData keeps what it has computed already
    batch = Batch(plant.model, len(rollouts), threads, persistent=looks)
    apply_scales(batch, plant, factors)
    batch.bind("qpos")[:] = qpos0
    batch.bind("qvel")[:, plant.model.nv - plant.n :] = v0
    monitored = MonitoredBatch(plant, batch, recorder, settings.steps)
    _record_start(recorder, batch)
    name = settings.controller.name
    if isinstance(controller, ClosedLoop):
        simulate_closed_loop(monitored, controller, BatchObservation(plant, batch, gravity), name)
    elif not isinstance(controller, OpenLoop):
        raise ControllerError(f"controller '{name}' has neither 'control' nor 'controls'")
    elif looks:
        simulate_closed_loop(
            monitored, Scheduled(controller, monitored, name), BatchObservation(plant, batch, gravity), name
        )
    else:
        simulate_open_loop(monitored, controller, name)
    _record_reference(recorder, controller, settings, len(rollouts))
    recorder.end(monitored.stop_step)
    arrays["status"][:], arrays["stop_step"][:] = monitored.status, monitored.stop_step
    arrays["saturation"][:] = monitored.saturation
    for name, values in factors.items():
        arrays[f"{name}_scale"][:] = values


def _base(plant: Plant) -> Array:
    return np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0] if plant.floating else [])


def _record_start(recorder: Recorder, batch: Batch) -> None:
    for field in recorder.state_fields:
        recorder.put_field(field, 0, batch.bind(field)[:, None])


def _record_reference(recorder: Recorder, controller: object, settings: Settings, simulations: int) -> None:
    if not (isinstance(controller, Follows) and recorder.wants("qpos_ref")):
        return
    name = settings.controller.name
    for first in range(0, settings.steps + 1, REFERENCE_STEPS):
        count = min(REFERENCE_STEPS, settings.steps + 1 - first)
        shapes, axes = [(simulations, count, recorder.joints)], "rollouts, time steps, joints"
        returned = controller.reference(first, count)
        try:
            q, v = returned
        except (TypeError, ValueError) as error:
            raise ControllerError(
                f"controller '{name}': its reference is no pair of positions and velocities"
            ) from error
        for variable, what, values in (("qpos_ref", "positions", q), ("qvel_ref", "velocities", v)):
            given = checked(values, shapes, axes, controller=name, what=f"reference {what}")
            recorder.put(variable, first, given)
