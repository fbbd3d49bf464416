"""The plants of designs: each compiled from its own table, compared with that table, and grouped for simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Final, TypeVar

import mujoco
import numpy as np

from dh2sim.errors import Dh2simError, MismatchError, Problem, RobotError
from dh2sim.formats.mjcf.elements import MjcfOptions
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.kinematics.table_oracle import table_mechanism_frames
from dh2sim.model.build import build_model
from dh2sim.model.mechanism import MechanismModel
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_actuators, with_base_mass, without_meshes
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.designs import Designs
from dh2sim.simulate.plant import Plant, compile_plant
from dh2sim.typing import Array, read_only

T = TypeVar("T")

TOLERANCE: Final = 1e-12
"""Of a model's rotations in rad, and of its positions as a share of the larger of 1 m and the robot's extent."""
_sizes: Final[Callable[[mujoco.MjModel], tuple[int, ...]]] = attrgetter(
    *sorted(
        name
        for name in dir(mujoco.MjModel)
        if name[0] == "n" and "_" not in name and name not in ("names", "numeric", "nbuffer", "narena")
    )
)
"""Returns the numbers of what a model has."""
_TREES: Final = ("bvh_child", "bvh_depth", "bvh_nodeid")
"""What MuJoCo has of a model and a batch cannot have of each simulation."""
TOGETHER: Final = 32
"""Designs that are made together."""
Scratch = dict[tuple[int, ...], mujoco.MjData]
"""Data for computations on models, by the models' sizes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantRecipe:
    """How the robots of a run become models."""

    actuation: ActuatorType | None
    """What drives every joint; None: what the robot file says."""
    mjcf: MjcfOptions

    def shown(self, model: RobotModel | MechanismModel) -> RobotModel | MechanismModel:
        """Return a robot as it is simulated, with its own actuators; the base of a mechanism does not float."""
        if self.mjcf.floating_base and isinstance(model, RobotModel):
            model = with_base_mass(model)
        return without_meshes(model)

    def text(self, model: RobotModel | MechanismModel) -> str:
        """Return the MJCF that is simulated.

        Raises:
            ModelError: An MJCF cannot hold the robot.
        """
        shown = self.shown(model)
        driven = shown if self.actuation is None else with_actuators(shown, self.actuation)
        return to_mjcf(driven, self.mjcf)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignPlant:
    """One design, ready to be simulated."""

    plant: Plant
    start: Array
    """Where it starts if that is a named configuration, rad and m, shape (n,)."""
    rows: Array
    """a, alpha, d, theta, beta of every row, m and rad, shape (rows, 5)."""
    layout: object = field(repr=False)
    """Equal for designs that MuJoCo can simulate in one batch."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignPlants:
    """Makes the plants of the designs of a run."""

    designs: Designs
    recipe: PlantRecipe
    per_design: int
    """Successive rollouts that have one design."""
    start: str
    """Name of a configuration that rollouts start in, or anything else."""
    as_fields: bool = False
    """Whether the models of a batch become fields of one model, which are randomized then."""

    def of(self, rollouts: Sequence[int], made: dict[int, DesignPlant]) -> list[DesignPlant]:
        """Return the design of each of some rollouts.

        Args:
            rollouts: Their indices.
            made: Those that were made before; left with those of these rollouts.

        Raises:
            Dh2simError: A design cannot be simulated: the error names all that cannot.
            MismatchError: A model is not as its table says.
        """
        wanted = [rollout // self.per_design for rollout in rollouts]
        for design in set(made) - set(wanted):
            del made[design]
        missing = [design for design in dict.fromkeys(wanted) if design not in made]
        problems: dict[int, list[Problem]] = {}
        scratch: Scratch = {}
        for start in range(0, len(missing), TOGETHER):
            made.update(self._made(missing[start : start + TOGETHER], problems, scratch))
        if problems:
            raise self.designs.error(each for design in sorted(problems) for each in problems[design])
        return [made[design] for design in wanted]

    def _made(
        self, designs: Sequence[int], problems: dict[int, list[Problem]], scratch: Scratch
    ) -> dict[int, DesignPlant]:
        """Make the plants of some designs, and compare each with its table.

        Step by step, each step of all designs before the next: that takes a fifth less time than design by design, as
        the code of a step stays in the processor's caches.

        Args:
            designs: Their numbers.
            problems: Takes what is wrong with those that cannot be simulated, by design.
            scratch: Kept from one call to the next.

        Raises:
            MismatchError: A model is not as its table says.
        """

        def each(work: Callable[[int], T], designs: Iterable[int]) -> dict[int, T]:
            done: dict[int, T] = {}
            for design in designs:
                try:
                    done[design] = work(design)
                except MismatchError as error:
                    raise MismatchError(f"{self.designs.name(design)}: {error}") from None
                except RobotError as error:
                    problems[design] = [self.designs.problem(design, found) for found in error.problems]
                except Dh2simError as error:
                    problems[design] = [self.designs.problem(design, Problem(path="", message=str(error)))]
            return done

        specs = each(self.designs.spec, designs)
        models = each(lambda design: build_model(specs[design]), specs)
        texts = each(lambda design: self.recipe.text(models[design]), models)
        plants = each(lambda design: compile_plant(texts[design], models[design]), texts)
        each(lambda design: compare_with_table(plants[design], models[design], scratch), plants)
        return each(lambda design: self._made_of(plants[design]), plants)

    def _made_of(self, plant: Plant) -> DesignPlant:
        return DesignPlant(
            plant=plant,
            start=plant.spec.named_configurations.get(self.start, plant.home),
            rows=read_only([[row.a, row.alpha, row.d, row.theta, row.beta] for row in plant.spec.rows]),
            layout=_layout(plant.model, as_fields=self.as_fields),
        )


def compare_with_table(plant: Plant, robot: RobotModel, scratch: Scratch) -> None:
    """Compare the poses of all DH frames and tool0 with the table's, at one configuration that is special in nothing.

    Args:
        plant: Of the robot, compiled.
        robot: The robot.
        scratch: Memory of models of the same sizes, which is used again: to get it takes as long as the rest.

    Raises:
        MismatchError: They differ by more than rounding.
    """
    spec, model = robot.spec, plant.model
    lower, upper = robot.travel
    share = np.modf(0.37 + 0.618034 * np.arange(plant.n))[0]
    q = lower + share * (upper - lower)
    sizes = _sizes(model)
    data = scratch.get(sizes)
    if data is None:
        data = scratch[sizes] = mujoco.MjData(model)
    data.qpos[model.nq - plant.n :] = q
    mujoco.mj_kinematics(model, data)
    frames = [*(f"dh_{i}" for i in range(len(spec.rows) + 1)), "tool0"]
    sites = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name) for name in frames]
    poses = table_mechanism_frames(spec, q)
    table = np.stack([poses[name] for name in frames])
    distance = float(np.abs(data.site_xpos[sites] - table[:, :3, 3]).max())
    turned = float(np.abs(data.site_xmat[sites].reshape(-1, 3, 3) - table[:, :3, :3]).max())
    angle = max(TOLERANCE, robot.angle_rounding)
    allowed = angle * max(1.0, robot.extent)
    if not (distance <= allowed and turned <= angle):
        raise MismatchError(
            f"the model differs from its table by {distance:.3g} m and {turned:.3g} rad (allowed: {allowed:.3g} m "
            f"and {angle:.3g} rad). This is a defect of dh2sim: please report it with the robot file"
        )


def _layout(model: mujoco.MjModel, *, as_fields: bool) -> object:
    heavy = (model.body_mass > 0.0).tobytes()
    return _sizes(model), heavy, *(getattr(model, name).tobytes() for name in _TREES if as_fields)


def groups(designs: Iterable[DesignPlant]) -> Iterator[list[int]]:
    """Yield the positions of designs that can be simulated together."""
    found: dict[object, list[int]] = {}
    for position, design in enumerate(designs):
        found.setdefault(design.layout, []).append(position)
    yield from found.values()
