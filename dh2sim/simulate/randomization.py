"""Random numbers of each rollout, and what is drawn with them.

Every rollout has a generator of its own for each purpose, so that its numbers depend on no other rollout.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import Final, TypeAlias, overload

import mujoco
import numpy as np

from dh2sim.robot.row import Convention, JointType
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.quantities import (
    AXES,
    QUANTITIES,
    USUAL,
    Setting,
    distribution_of,
    randomized,
    settings_of,
)
from dh2sim.typing import Array


class Purpose(IntEnum):
    """What random numbers are drawn for; each purpose has its own stream."""

    START = 0
    RANDOMIZE = 1
    CONTROLLER = 2
    SENSE = 3
    # 16: the numbers of designs (``designs.STREAM``), which have streams by name


FIRST_OF_QUANTITIES: Final = 32
"""Number of the stream of the first of ``QUANTITIES``; those of the others follow."""


def generator(seed: int, rollout: int, purpose: int) -> np.random.Generator:
    """Return a rollout's own generator: child number ``purpose`` of child number ``rollout`` of the seed.

    It is what ``SeedSequence(seed).spawn(…)[rollout].spawn(…)[purpose]`` gives, made without the others.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=(rollout, int(purpose)))
    return np.random.Generator(np.random.PCG64(sequence))


class Generators(Sequence[np.random.Generator]):
    """The generators of some rollouts, each made when it is first used, since that takes longer than a time step."""

    def __init__(self, seed: int, rollouts: Sequence[int], purpose: int) -> None:
        """Make none yet."""
        self._seed, self._rollouts, self._purpose = seed, rollouts, purpose
        self._made: dict[int, np.random.Generator] = {}

    def __len__(self) -> int:
        """Return the number of rollouts."""
        return len(self._rollouts)

    @overload
    def __getitem__(self, index: int) -> np.random.Generator: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[np.random.Generator]: ...
    def __getitem__(self, index: int | slice) -> np.random.Generator | Sequence[np.random.Generator]:
        """Return the generator of the ``index``-th of the rollouts, the same one every time."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        rollout = self._rollouts[index]
        if rollout not in self._made:
            self._made[rollout] = generator(self._seed, rollout, self._purpose)
        return self._made[rollout]


SCALES: Final = ("mass", "friction", "damping", "armature", "gain")
"""Quantities whose numbers are shares of one common stream; all others have a stream each."""
Draws: TypeAlias = dict[str, Array]
"""What is drawn, by variable of the dataset, rollouts first."""


def owners(plant: Plant) -> dict[str, tuple[str, ...]]:
    """Return the names of links with mass, joints, driven joints and rows: what quantities belong to."""
    return {
        "link": tuple(plant.model.body(i).name for i in links(plant)),
        "joint": plant.joints,
        "actuator": tuple(plant.joints[joint] for joint in plant.driven),
        "row": tuple(row.name for row in plant.spec.rows),
        "": ("",),
    }


def links(plant: Plant) -> list[int]:
    """Return the links that have mass."""
    bodies = range(1, plant.model.nbody)
    return [i for i in bodies if plant.model.body_mass[i] > 0.0 and i not in plant.helpers]


def push_count(options: RolloutOptions, steps: int) -> int:
    """Return how many pushes a rollout of some time steps can have."""
    return math.ceil(steps * options.timestep / push_time(options, "push_interval"))


def push_time(options: RolloutOptions, name: str) -> float:
    """Return the interval or the duration of pushes, s."""
    return distribution_of(QUANTITIES[name], options.randomize.get(name, USUAL[name])).first


def draw(plant: Plant, options: RolloutOptions, rollouts: Sequence[int], steps: int) -> Draws:
    """Draw everything that is randomized.

    Args:
        plant: The robot.
        options: What is randomized.
        rollouts: Of which rollouts.
        steps: Time steps of the run.
    """
    drawn: Draws = {}
    names = owners(plant)
    shares = _shares(plant, options, rollouts)
    for name in randomized(options.randomize):
        quantity = QUANTITIES[name]
        settings = settings_of(options.randomize, name, names[quantity.owner])
        if name == "push":
            drawn |= _pushes(options, rollouts, steps, settings[0])
        elif name == "gravity":
            drawn["gravity"] = _tilted(plant, _values(options, rollouts, name, settings, more=1))
        else:
            values = _values(options, rollouts, name, settings)
            if name in shares:
                numbers = [isinstance(setting, float) for setting in settings]
                own = np.array([setting if isinstance(setting, float) else 0.0 for setting in settings])
                values = np.where(numbers, 1.0 + own * shares[name], values)
            if quantity.owner == "row":
                values = values * _in_table(plant, quantity.axis)
            drawn[quantity.variable] = values if quantity.owner else values[:, 0]
    still = plant.model.actuator_biastype == mujoco.mjtBias.mjBIAS_NONE  # motors have no gains
    for variable in ("gain_scale", "kp_scale", "kv_scale"):
        if variable in drawn:
            drawn[variable][:, still] = 1.0
    return drawn


def _shares(plant: Plant, options: RolloutOptions, rollouts: Sequence[int]) -> dict[str, Array]:
    """Draw from -1 to 1 for each quantity that has a stream with others in common, shape (batch, owners)."""
    if not set(SCALES) & set(randomized(options.randomize)):
        return {}
    counts = {"mass": len(links(plant)), "gain": len(plant.actuators)}
    found: dict[str, list[Array]] = {name: [] for name in SCALES}
    for source in Generators(options.seed, rollouts, Purpose.RANDOMIZE):
        for name in SCALES:  # always all of them, so that one does not depend on which others are randomized
            found[name].append(source.uniform(-1.0, 1.0, counts.get(name, plant.n)))
    return {name: np.array(values) for name, values in found.items()}


def _values(
    options: RolloutOptions,
    rollouts: Sequence[int],
    name: str,
    settings: Sequence[Setting | None],
    *,
    more: int = 0,
) -> Array:
    """Draw a quantity for each owner, shape (batch, owners) or (batch, owners, components).

    With ``more``, as many numbers from 0 to 1 follow each value, in place of components.
    """
    quantity = QUANTITIES[name]
    count = 1 + more if more else len(AXES.get(quantity.axis, ("",)))
    neutral = 1.0 if quantity.kind == "factor" else 0.0
    found = [None if setting is None else distribution_of(quantity, setting) for setting in settings]
    values = np.full((len(rollouts), len(settings), count), neutral)
    if not (name in SCALES and all(setting is None or isinstance(setting, float) for setting in settings)):
        for row, source in enumerate(_stream(options, rollouts, name)):
            numbers = source.random((len(settings), count)).tolist()
            for k, distribution in enumerate(found):
                if distribution is not None:
                    first = 1 if more else count
                    values[row, k, :first] = [distribution.at(u) for u in numbers[k][:first]]
                    values[row, k, first:] = numbers[k][first:]
    return values if quantity.axis else values[:, :, 0]


def _stream(options: RolloutOptions, rollouts: Sequence[int], name: str) -> Generators:
    return Generators(options.seed, rollouts, FIRST_OF_QUANTITIES + list(QUANTITIES).index(name))


def _in_table(plant: Plant, axis: str) -> Array:
    """Return 1 for each component that rows have, else 0, shape (rows, components).

    Only Hayati rows have a beta; where they turn, nearly parallel axes leave their d free.
    """
    hayati = np.array([row.convention is Convention.HAYATI for row in plant.spec.rows])
    slides = np.array([row.type is JointType.PRISMATIC for row in plant.spec.rows])
    always = np.ones(len(hayati))
    columns = [always, ~hayati | slides] if axis == "length" else [always, always, hayati]
    return np.stack(columns, axis=-1).astype(np.float64)


def _tilted(plant: Plant, drawn: Array) -> Array:
    """Return gravity turned by an angle, towards a direction across it, m/s², shape (batch, 3)."""
    tilted = np.empty((len(drawn), 3))
    for k, (tilt, turn) in enumerate(drawn[:, 0].tolist()):
        g = np.array(plant.models[k % len(plant.models)].opt.gravity)
        down = g / np.linalg.norm(g)
        x = np.eye(3)[int(np.argmin(np.abs(down)))]
        x = x - (x @ down) * down
        x /= np.linalg.norm(x)
        across = math.cos(2.0 * math.pi * turn) * x + math.sin(2.0 * math.pi * turn) * np.cross(down, x)
        tilted[k] = np.linalg.norm(g) * (math.cos(tilt) * down + math.sin(tilt) * across)
    return tilted


def _pushes(options: RolloutOptions, rollouts: Sequence[int], steps: int, setting: Setting | None) -> Draws:
    """Draw pushes: one in every interval, all equally late in it, each in a direction of its own."""
    count, interval = push_count(options, steps), push_time(options, "push_interval")
    assert setting is not None
    size = distribution_of(QUANTITIES["push"], setting)
    force, start = np.empty((len(rollouts), count, 3)), np.empty((len(rollouts), count))
    for row, source in enumerate(_stream(options, rollouts, "push")):
        start[row] = interval * (source.random() + np.arange(count))
        numbers = source.random((count, 3))
        z, turn = 2.0 * numbers[:, 0] - 1.0, 2.0 * math.pi * numbers[:, 1]
        across = np.sqrt(1.0 - z * z)
        direction = np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=-1)
        force[row] = np.array([size.at(u) for u in numbers[:, 2].tolist()])[:, None] * direction
    return {"push_force": force, "push_start": start}
