"""Layout of a run's dataset: its dimensions, coordinates and variables, the same on disk and in memory."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.robot.row import Convention, Row
from dh2sim.robot.variation import CELLS, Variation
from dh2sim.simulate.contacts import NO_CONTACT, links_with_shapes
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.quantities import AXES, QUANTITIES, randomized
from dh2sim.simulate.randomization import links, push_count

FORMAT = 1
"""Version of the layout, in the attribute ``dh2sim_run``."""
POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
NOT_RUN, FINISHED = -1, 0
STATUS = {
    "not_run": NOT_RUN,
    "finished": FINISHED,
    "warning_inertia": 1,
    "warning_contacts_full": 2,
    "warning_constraints_full": 3,
    "bad_qpos": 4,
    "bad_qvel": 5,
    "bad_qacc": 6,
    "bad_ctrl": 7,
    "error": 8,
    "other_warning": 9,
}
"""Meaning of the values of ``status``; all but the first two mark a rollout that stopped early."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coordinate:
    """Labels along one dimension."""

    name: str
    dimension: str
    values: NDArray[Any] | Sequence[str]
    attributes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Variable:
    """One array of a run; its first dimension is ``rollout``."""

    name: str
    dimensions: tuple[str, ...]
    dtype: np.dtype[Any]
    fill: float | int
    """Value where nothing was recorded: NaN, or one that ``attributes`` explain."""
    attributes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layout:
    """A run's dataset without the numbers of its variables."""

    sizes: Mapping[str, int]
    """Size of every dimension; ``rollout`` is the number of rollouts."""
    coordinates: tuple[Coordinate, ...]
    variables: tuple[Variable, ...]
    attributes: Mapping[str, Any]
    """JSON values."""
    block: int
    """Rollouts in a block, and in a chunk along ``rollout``."""

    @property
    def blocks(self) -> int:
        """Number of blocks; the last may be smaller."""
        return -(-self.sizes["rollout"] // self.block)

    def rollouts(self, block: int) -> range:
        """Return the rollouts of a block."""
        return range(block * self.block, min((block + 1) * self.block, self.sizes["rollout"]))

    def shape(self, variable: Variable) -> tuple[int, ...]:
        """Return the shape of a variable over the whole run."""
        return tuple(self.sizes[dimension] for dimension in variable.dimensions)


ENERGY = ("potential", "kinetic")
JOINT_UNITS = "rad or m, see joint_unit"
JOINT_RATES = "rad/s or m/s"
FORCES = "N*m or N"
DOUBLE, LONG, INT, BYTE = np.dtype(np.float64), np.dtype(np.int64), np.dtype(np.int32), np.dtype(np.int8)


def run_layout(
    plant: Plant,
    options: RolloutOptions,
    attributes: Mapping[str, Any],
    *,
    follows: bool,
    block: int,
    variation: Variation | None = None,
    rows: Sequence[Row] = (),
) -> Layout:
    """Return the layout of a run's dataset.

    Args:
        plant: The robot as it is simulated.
        options: What is simulated and recorded.
        attributes: Those of the dataset, JSON values.
        follows: Whether the controller has a reference to record.
        block: Rollouts in a block.
        variation: What differs between designs, if there are such.
        rows: Those of the table.
    """
    variables = tuple(_variables(plant, options, follows=follows, variation=variation, rows=rows))
    sizes = _sizes(plant, options, variables, len(rows))
    return Layout(
        sizes=sizes,
        coordinates=tuple(_coordinates(plant, options, sizes, rows)),
        variables=variables,
        attributes=attributes,
        block=block,
    )


def rollout_bytes(
    plant: Plant,
    options: RolloutOptions,
    *,
    follows: bool,
    variation: Variation | None = None,
    rows: Sequence[Row] = (),
) -> int:
    """Return how many bytes a rollout records; the arguments are those of ``run_layout``."""
    variables = tuple(_variables(plant, options, follows=follows, variation=variation, rows=rows))
    sizes = _sizes(plant, options, variables, len(rows))
    return sum(math.prod(sizes[name] for name in each.dimensions[1:]) * each.dtype.itemsize for each in variables)


def _sizes(plant: Plant, options: RolloutOptions, variables: Iterable[Variable], rows: int) -> dict[str, int]:
    """Return the size of every dimension that the variables have."""
    sizes = {
        "rollout": options.rollouts,
        "step": options.records + 1,
        "interval": options.records,
        "joint": plant.n,
        "actuator": len(plant.actuators),
        "pose": len(POSE),
        "energy_kind": len(ENERGY),
        "twist": len(TWIST),
        "link": len(links(plant)),
        "row": rows or len(plant.spec.rows),
        "closure": len(plant.gaps),
        "push": push_count(options, options.steps),
        **{name: len(labels) for name, labels in AXES.items()},
    }
    used = {"step", "interval", "joint", *(name for variable in variables for name in variable.dimensions)}
    return {name: size for name, size in sizes.items() if name in used}


def _variables(
    plant: Plant, options: RolloutOptions, *, follows: bool, variation: Variation | None, rows: Sequence[Row]
) -> Iterator[Variable]:
    for name in options.record:
        if name != "reference" or follows:
            yield from _recorded(name, plant)
    flags = {"flag_values": list(STATUS.values()), "flag_meanings": " ".join(STATUS)}
    yield _per_rollout("status", (), BYTE, NOT_RUN, "1", "how the rollout ended", **flags)
    yield _per_rollout("stop_step", (), LONG, -1, "1", "time step in which the rollout stopped early, or -1")
    yield _per_rollout(
        "saturation", ("actuator",), LONG, 0, "1", "time steps in which the wanted control was out of range"
    )
    words = "time step at whose beginning links of the robot first touched, or -1"
    yield _per_rollout("contact_step", (), LONG, NO_CONTACT, "1", words)
    bodies = {NO_CONTACT: "none", **links_with_shapes(plant.model)}
    if plant.gaps:
        words = "greatest distance, at any time step, between what the closure holds together"
        yield _per_rollout("loop_gap", ("closure",), DOUBLE, np.nan, "m", words, size=plant.size)
    flags = {"flag_values": list(bodies), "flag_meanings": " ".join(bodies.values())}
    for name, which in (("contact_link_a", "one"), ("contact_link_b", "the other")):
        yield _per_rollout(name, (), INT, NO_CONTACT, "1", f"{which} of the links that touched then", **flags)
    for name in randomized(options.randomize):
        quantity = QUANTITIES[name]
        pushes = ("push",) if name == "push" else ()
        dimensions = tuple(filter(None, (quantity.owner, *pushes, quantity.axis)))
        yield _per_rollout(quantity.variable, dimensions, DOUBLE, np.nan, quantity.unit, quantity.words)
        if pushes:
            yield _per_rollout("push_start", pushes, DOUBLE, np.nan, "s", "when a push begins")
    if variation is not None:
        yield from _of_design(variation, rows)


TAKEN: Final = frozenset(
    """qpos qvel ctrl tool_pose qpos_ref qvel_ref qacc torque energy contacts base_pose base_twist status stop_step
    saturation contact_step contact_link_a contact_link_b design blocks rollout step interval joint actuator pose
    energy_kind twist link row axis length angle push push_start
    time interval_time joint_unit joint_lower joint_upper joint_velocity_limit
    actuator_unit""".split()  # noqa: SIM905
) | {quantity.variable for quantity in QUANTITIES.values()}
"""Names of variables, coordinates and dimensions of runs, which no number of a design can have."""


def design_variables(names: Iterable[str]) -> dict[str, str]:
    """Return names of numbers of a robot file by the names of their variables, which have letters, digits and _."""
    return {re.sub("[^A-Za-z0-9]+", "_", name).strip("_"): name for name in names}


def _of_design(variation: Variation, rows: Sequence[Row]) -> Iterator[Variable]:
    yield _per_rollout("design", (), LONG, -1, "1", "number of the design")
    units = dict(zip(variation.names, variation.units, strict=True))
    for variable, name in design_variables(variation.names).items():
        words = f"{name} of the robot file, in its units"
        yield _per_rollout(variable, (), DOUBLE, np.nan, units[name] or "as in the robot file", words, parameter=name)
    has_beta = any(row.convention is Convention.HAYATI for row in rows)
    for cell in CELLS if has_beta else CELLS[:-1]:
        unit = "m" if cell in ("a", "d") else "rad"
        yield _per_rollout(f"dh_{cell}", ("row",), DOUBLE, np.nan, unit, f"{cell} of every row of the table")


def _per_rollout(
    name: str, dimensions: tuple[str, ...], dtype: np.dtype[Any], fill: float, units: str, words: str, **more: Any
) -> Variable:
    return Variable(
        name=name,
        dimensions=("rollout", *dimensions),
        dtype=dtype,
        fill=fill,
        attributes={"units": units, "long_name": words, **more},
    )


def _recorded(name: str, plant: Plant) -> Iterator[Variable]:
    match name:
        case "qpos":
            yield _per_rollout("qpos", ("step", "joint"), DOUBLE, np.nan, JOINT_UNITS, "joint position")
            if plant.floating:
                pose = "m; unit quaternion"
                yield _per_rollout(
                    "base_pose", ("step", "pose"), DOUBLE, np.nan, pose, "pose of base_link in the world"
                )
        case "qvel":
            yield _per_rollout("qvel", ("step", "joint"), DOUBLE, np.nan, JOINT_RATES, "joint velocity")
            if plant.floating:
                words = "velocity of base_link's origin in the world, angular velocity in base_link"
                yield _per_rollout("base_twist", ("step", "twist"), DOUBLE, np.nan, "m/s; rad/s", words)
        case "ctrl":
            words = "control applied from the beginning of the interval"
            yield _per_rollout("ctrl", ("interval", "actuator"), DOUBLE, np.nan, "see actuator_unit", words)
        case "tool_pose":
            words = "pose of tool0 in the world"
            yield _per_rollout("tool_pose", ("step", "pose"), DOUBLE, np.nan, "m; unit quaternion", words)
        case "reference":
            dimensions = ("step", "joint")
            yield _per_rollout("qpos_ref", dimensions, DOUBLE, np.nan, JOINT_UNITS, "reference position")
            yield _per_rollout("qvel_ref", dimensions, DOUBLE, np.nan, JOINT_RATES, "reference velocity")
        case "qacc":
            words = "joint acceleration at the beginning of the interval"
            yield _per_rollout("qacc", ("interval", "joint"), DOUBLE, np.nan, "rad/s2 or m/s2", words)
        case "torque":
            words = "force of the actuators on the joint at the beginning of the interval"
            yield _per_rollout("torque", ("interval", "joint"), DOUBLE, np.nan, FORCES, words)
        case "energy":
            yield _per_rollout("energy", ("step", "energy_kind"), DOUBLE, np.nan, "J", "mechanical energy")
        case _:
            words = "contacts at the beginning of the interval; -1 after an early stop"
            yield _per_rollout("contacts", ("interval",), INT, -1, "1", words)


def _coordinates(
    plant: Plant, options: RolloutOptions, sizes: Mapping[str, int], rows: Sequence[Row]
) -> Iterator[Coordinate]:
    time = plant.timestep * options.every * np.arange(options.records + 1)
    units = ["rad" if turns else "m" for turns in plant.turns]
    yield Coordinate(name="rollout", dimension="rollout", values=np.arange(options.rollouts, dtype=np.int64))
    yield Coordinate(
        name="time", dimension="step", values=time, attributes={"units": "s", "long_name": "time since the start"}
    )
    yield Coordinate(
        name="interval_time",
        dimension="interval",
        values=time[:-1],
        attributes={"units": "s", "long_name": "time at the beginning of the interval"},
    )
    yield Coordinate(name="joint", dimension="joint", values=plant.joints)
    yield Coordinate(name="joint_unit", dimension="joint", values=units)
    for name, values, words in (
        ("joint_lower", plant.lower, "least position"),
        ("joint_upper", plant.upper, "greatest position"),
        ("joint_velocity_limit", plant.velocity, "greatest speed that references have"),
    ):
        rate = JOINT_RATES if "velocity" in name else JOINT_UNITS
        yield Coordinate(name=name, dimension="joint", values=values, attributes={"units": rate, "long_name": words})
    labels: dict[str, tuple[str, ...]] = {
        "actuator": plant.actuators,
        "pose": POSE,
        "energy_kind": ENERGY,
        "twist": TWIST,
        "link": tuple(plant.model.body(i).name for i in links(plant)),
        "row": tuple(row.name for row in rows or plant.spec.rows),
        "closure": tuple(sensor.closure for sensor in plant.gaps),
        **AXES,
    }
    for name, texts in labels.items():
        if name in sizes:
            yield Coordinate(name=name, dimension=name, values=texts)
    if "push" in sizes:
        yield Coordinate(name="push", dimension="push", values=np.arange(sizes["push"], dtype=np.int64))
    if "actuator" in sizes:
        yield Coordinate(name="actuator_unit", dimension="actuator", values=_actuator_units(plant))


def _actuator_units(plant: Plant) -> list[str]:
    units = {"position": ("rad", "m"), "velocity": ("rad/s", "m/s"), "motor": ("N*m", "N")}
    return [
        units[name.rsplit("_", 1)[1]][0 if plant.turns[joint] else 1]
        for name, joint in zip(plant.actuators, plant.driven, strict=True)
    ]
