"""From a robot and what is wanted of it to everything that a run needs."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from types import MappingProxyType
from typing import Any

import numpy as np

from dh2sim.errors import Dh2simError, SettingsError
from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.formats.mjcf.write import MjcfOptions, to_mjcf
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_actuators, with_base_mass, without_meshes
from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.block import plant_of, rehearse
from dh2sim.simulate.controllers.options import ControllerChoice
from dh2sim.simulate.controllers.registry import choose
from dh2sim.simulate.dataset_layout import FORMAT, Layout, run_layout, run_sizes, run_variables
from dh2sim.simulate.initial_states import Start, check_start, read_start
from dh2sim.simulate.options import Wish, check_wish
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.records import SENSED
from dh2sim.simulate.settings import RANDOMIZABLE, Settings

BLOCK_BYTES = 2**26
"""What a block of rollouts records, at most; two of them are in memory at a time."""
BLOCK_STEPS = 2**21
"""Time steps of all rollouts of a block together, at most: some seconds, after which it is safe on disk."""
MOST_BYTES = 2**30
"""What one rollout may record, times included."""
TIME_BYTES = 16
"""Of every record's times."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """Everything that a run needs."""

    mjcf: str
    """The model as it is simulated."""
    settings: Settings
    layout: Layout


def prepare(model: RobotModel, wish: Wish, *, command: str = "") -> Job:
    """Make a robot ready to be simulated.

    Args:
        model: the robot.
        wish: what is wanted.
        command: the command line, for the run's attributes.

    Raises:
        SettingsError: the wish cannot be met; the error tells everything that is wrong with it.
        ControllerError: there is no such controller, its options are wrong, or it fails at once.
        ModelError: an MJCF cannot hold the robot.
    """
    steps, problems = check_wish(wish)
    choice = _tried(problems, lambda: choose(wish.controller))
    joints = tuple(joint.name for joint in model.moving_joints)
    if not joints:
        problems.append(f"{model.name} has no joint that moves: there is nothing to simulate")
    start = _tried(problems, lambda: read_start(wish.start, joints, model.spec.configurations, wish.rollouts))
    if problems or choice is None or start is None:
        raise SettingsError("\n".join(problems))
    settings = _settings(model, wish, choice, start, steps)
    options = MjcfOptions(
        timestep=wish.timestep,
        integrator=wish.integrator_name,
        energy="energy" in wish.record,
        sensors=not SENSED.isdisjoint(wish.record),
        floating_base=wish.floating_base,
    )
    shown = without_meshes(with_base_mass(model) if wish.floating_base else model)
    driven = shown if choice.actuation is None else with_actuators(shown, choice.actuation)
    mjcf = to_mjcf(driven, options)
    plant = plant_of(mjcf, settings)
    _check_start(plant, settings)
    _check_randomize(plant, wish.randomize)
    layout = _layout(plant, settings, _attributes(model, wish, settings, mjcf, to_scene(shown), command))
    rehearse(plant, settings)
    return Job(mjcf=mjcf, settings=settings, layout=layout)


def _tried(problems: list[str], make: Any) -> Any:
    try:
        return make()
    except Dh2simError as error:
        problems.append(str(error))
        return None


def _settings(model: RobotModel, wish: Wish, choice: ControllerChoice, start: Start, steps: int) -> Settings:
    stiff = with_actuators(model, ActuatorType.POSITION).moving_joints
    return Settings(
        rollouts=wish.rollouts,
        steps=steps,
        every=wish.every,
        seed=wish.seed,
        controller=choice,
        start=start.name,
        start_states=start.states,
        start_digest=start.digest,
        home=tuple(model.home.tolist()),
        record=wish.recorded,
        randomize=MappingProxyType({name: wish.randomize[name] for name in RANDOMIZABLE if name in wish.randomize}),
        velocity=tuple(joint.velocity for joint in model.moving_joints),
        kp=tuple(joint.actuator.kp for joint in stiff),
        kv=tuple(joint.actuator.kv for joint in stiff),
    )


def _check_start(plant: Plant, settings: Settings) -> None:
    try:
        if settings.start_states is not None:
            check_start(plant, settings.start_states[:, 0], settings.start)
        elif settings.start == "zero":
            check_start(plant, np.zeros((1, plant.n)), "zero")
    except Dh2simError as error:
        raise SettingsError(f"--{error}") from error


def _check_randomize(plant: Plant, wanted: Mapping[str, float]) -> None:
    model, joints = plant.model, slice(plant.model.nv - plant.n, None)
    there = {
        "friction": model.dof_frictionloss[joints],
        "damping": model.dof_damping[joints],
        "armature": model.dof_armature[joints],
        "gain": model.actuator_biasprm,  # motors have none
    }
    idle = [name for name in wanted if name in there and not there[name].any()]
    if idle:
        raise SettingsError(
            "\n".join(
                f"--randomize {name}: the robot as simulated has no {name}, and 0 times a factor is 0"
                for name in idle
            )
        )


def _attributes(
    model: RobotModel, wish: Wish, settings: Settings, mjcf: str, scene: str, command: str
) -> dict[str, Any]:
    source = model.spec.source_file
    return {
        "dh2sim_run": FORMAT,
        "robot": model.name,
        "robot_file": "" if source is None else source.text,
        "robot_file_sha256": "" if source is None else source.sha256,
        "mjcf": mjcf,
        "scene": scene,
        "command": command,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "seed": settings.seed,
        "controller": settings.controller.text,
        "randomize": dict(settings.randomize),
        "settings": settings.to_json(),
        "timestep": wish.timestep,
        "integrator": wish.integrator_name,
        "versions": {
            "dh2sim": version("dh2sim"),
            "mujoco": version("mujoco"),
            "numpy": np.__version__,
            "python": platform.python_version(),
        },
    }


def _layout(plant: Plant, settings: Settings, attributes: Mapping[str, Any]) -> Layout:
    sizes = run_sizes(plant, settings)
    size = sum(
        math.prod(sizes[name] for name in variable.dimensions[1:]) * variable.dtype.itemsize
        for variable in run_variables(plant, settings)
    )
    whole = size + TIME_BYTES * settings.records
    if whole > MOST_BYTES:
        raise SettingsError(
            f"one rollout would record {whole / 2**30:,.1f} GB, and at most {MOST_BYTES / 2**30:g} GB can be held; "
            "record a state in so many (--every) or fewer quantities (--record)"
        )
    block = max(1, min(settings.rollouts, BLOCK_BYTES // size, BLOCK_STEPS // settings.steps))
    return run_layout(plant, settings, attributes, block)
