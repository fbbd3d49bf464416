"""Groups of rollouts and what they see, made with plain MuJoCo."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np

import dh2sim
from dh2sim.errors import ControllerError
from dh2sim.robot.row import ActuatorSpec, ActuatorType, Convention, Dynamics, JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.simulate.controllers.protocol import Controller, RolloutBatch
from dh2sim.simulate.controllers.registry import choose
from dh2sim.simulate.plant import Plant, make_plant
from dh2sim.typing import Array, read_only
from tests.refusals import refusal

ODD = 0.651


def arm(actuators: Sequence[ActuatorType] | ActuatorType = ActuatorType.POSITION) -> RobotSpec:
    """A turning, a sliding and an endlessly turning joint, with odd twists."""
    kinds = [actuators] * 3 if isinstance(actuators, ActuatorType) else list(actuators)
    types = [JointType.REVOLUTE, JointType.PRISMATIC, JointType.CONTINUOUS]
    limits = [
        Limits(position=(-1.0, 2.5), velocity=1.2, effort=40.0),
        Limits(position=(-0.2, 0.3), velocity=0.25, effort=90.0),
        Limits(velocity=2.0),
    ]
    rows = tuple(
        Row(
            name=f"joint_{i}",
            type=types[i - 1],
            convention=Convention.STANDARD,
            a=0.3,
            alpha=ODD,
            d=0.2,
            limits=limits[i - 1],
            dynamics=Dynamics(damping=0.3, armature=0.02),
            actuator=ActuatorSpec(type=kinds[i - 1]),
        )
        for i in (1, 2, 3)
    )
    return RobotSpec(name="odd", rows=rows)


def plant(spec: RobotSpec, *, timestep: float = 0.002) -> Plant:
    """A robot compiled as it is."""
    model = dh2sim.build_model(spec)
    compiled = mujoco.MjModel.from_xml_string(dh2sim.to_mjcf(model))
    compiled.opt.timestep = timestep
    made = make_plant(compiled, model)
    return replace(
        made,
        kp=read_only([50.0 + 10.0 * i for i in range(made.n)]),
        kv=read_only([0.5 + 0.1 * i for i in range(made.n)]),
    )


def started(
    spec: RobotSpec,
    rollouts: range = range(7),
    *,
    steps: int = 300,
    timestep: float = 0.002,
    seed: int = 1,
    q0: Array | None = None,
) -> RolloutBatch:
    """Rollouts that start at random inside the limits, or at ``q0``; each as it is in any other group."""
    made = plant(spec, timestep=timestep)
    lower, upper = np.maximum(made.lower, -3.0), np.minimum(made.upper, 3.0)
    starts = [np.random.default_rng([seed, 0, i]).uniform(lower, upper) for i in rollouts]
    q = np.stack(starts) if q0 is None else np.tile(q0, (len(rollouts), 1))
    return RolloutBatch(
        plant=made,
        steps=steps,
        rollouts=rollouts,
        q0=read_only(q),
        v0=read_only(np.zeros_like(q)),
        gravity0=read_only([see(made, q_i, np.zeros(made.n)).bias for q_i in q]),
        generators=[np.random.default_rng([seed, 1, i]) for i in rollouts],
    )


def driven(spec: RobotSpec, kind: ActuatorType) -> RobotSpec:
    """The same robot with one kind of actuator at every joint."""
    actuator = ActuatorSpec(type=kind)
    rows = (replace(row, actuator=actuator) if row.type.moves else row for row in spec.rows)
    return replace(spec, rows=tuple(rows))


def make(text: str, spec: RobotSpec, rollouts: range = range(7), **options: Any) -> tuple[Controller, RolloutBatch]:
    """A controller, and the rollouts that it drives with the actuators that it asks for."""
    choice = choose(text)
    group = started(spec if choice.actuation is None else driven(spec, choice.actuation), rollouts, **options)
    return choice.make(group), group


def refused(text: str, rollouts: range = range(7)) -> str:
    """Why there is no such controller of the arm."""
    return refusal(ControllerError, make, text, arm(), rollouts)


@dataclass(frozen=True, slots=True, kw_only=True)
class Single:
    """Dynamics of one state, dense."""

    mass_matrix: Array
    bias: Array
    passive: Array


def see(made: Plant, q: Array, v: Array) -> Single:
    """Ask plain MuJoCo for the dynamics of one state."""
    data = mujoco.MjData(made.model)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(made.model, data)
    M = np.zeros((made.n, made.n))
    mujoco.mj_fullM(made.model, data, M)
    return Single(mass_matrix=M, bias=data.qfrc_bias.copy(), passive=data.qfrc_passive.copy())


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """An observation, computed beforehand."""

    step: int
    time: float
    q: Array
    v: Array
    mass_matrix: Array
    bias: Array
    passive: Array
    gravity: Array


def observe(made: Plant, step: int, q: Array, v: Array) -> Seen:
    """What a controller sees of states of shape (batch, n)."""
    states = [see(made, q_i, v_i) for q_i, v_i in zip(q, v, strict=True)]
    return Seen(
        step=step,
        time=step * made.timestep,
        q=q,
        v=v,
        mass_matrix=np.stack([state.mass_matrix for state in states]),
        bias=np.stack([state.bias for state in states]),
        passive=np.stack([state.passive for state in states]),
        gravity=np.stack([see(made, q_i, np.zeros(made.n)).bias for q_i in q]),
    )


def cuts(total: int, sizes: Sequence[int]) -> list[tuple[int, int]]:
    """First and number of consecutive pieces of ``total`` steps, of the given sizes in turn."""
    pieces: list[tuple[int, int]] = []
    first = 0
    for size in itertools.cycle(sizes):
        if first >= total:
            return pieces
        pieces.append((first, min(size, total - first)))
        first += size
    return pieces
