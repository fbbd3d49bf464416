"""Preparation of a run: from a robot and options to a job, with everything checked that can be."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any, Final, TypeVar, Unpack

import mujoco
import numpy as np

from dh2sim.errors import AssemblyError, ControllerError, SettingsError
from dh2sim.formats.mjcf.elements import MjcfOptions
from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.kinematics.loop_motion import named_configuration
from dh2sim.messages import listed
from dh2sim.model.mechanism import MechanismModel
from dh2sim.model.robot_model import RobotModel
from dh2sim.progress import Advance, no_progress
from dh2sim.simulate.block import Job, rehearse
from dh2sim.simulate.controllers.registry import ControllerChoice, choose
from dh2sim.simulate.dataset_layout import FORMAT, TAKEN, design_variables, rollout_bytes, run_layout
from dh2sim.simulate.design_plants import DesignPlants, PlantRecipe
from dh2sim.simulate.designs import Designs, unknown_names
from dh2sim.simulate.initial_states import InitialStates, read_initial_states, reference_start
from dh2sim.simulate.mujoco_runtime import mujoco_package
from dh2sim.simulate.options import AUTO, ENGINES, REFERENCE, WARP, RolloutKeywords, RolloutOptions
from dh2sim.simulate.plant import Plant, compile_plant
from dh2sim.simulate.quantities import randomized, unknown_labels
from dh2sim.simulate.randomization import owners, push_time
from dh2sim.simulate.randomized_models import motors
from dh2sim.simulate.records import SENSED
from dh2sim.simulate.warp_batch import require_warp, warp_device, warp_versions
from dh2sim.typing import Array

BLOCK_BYTES = 2**26
"""Most that a block of rollouts records; two of them are in memory at a time."""
WARP_BLOCKS = 8
"""Times as much with the engine 'warp', to fill a device."""
BLOCK_STEPS = 2**21
"""Most time steps of all rollouts of a block together: some seconds, after which it is safe on disk."""
MOST_BYTES = 2**30
"""Most that one rollout may record, times included."""
TIME_BYTES = 16
"""Of the times of every record."""

T = TypeVar("T")


def options_for(model: RobotModel | MechanismModel, **given: Unpack[RolloutKeywords]) -> RolloutOptions:
    """Return options of a robot's run.

    Raises:
        SettingsError: Options are wrong; the error reports the names in ``vary`` that the robot does not have, too.
    """
    try:
        return RolloutOptions(**given)
    except SettingsError as error:
        raise SettingsError([*error.problems, *unknown_names(model.spec, given.get("vary"))]) from None


def prepare(
    model: RobotModel | MechanismModel,
    options: RolloutOptions,
    *,
    command: str = "",
    checked: Advance = no_progress,
) -> Job:
    """Make a robot ready to be simulated.

    Args:
        model: The robot.
        options: What is simulated and recorded.
        command: The command line, for the run's attributes.
        checked: Called with the number of designs that were checked since the last call.

    Raises:
        SettingsError: Options do not fit the robot; the error reports all that are wrong.
        ControllerError: The controller fails at once.
        ModelError: An MJCF cannot hold the robot.
        MissingExtraError, EngineError: The engine is not installed, or cannot simulate the robot.
    """
    if options.engine == WARP:
        require_warp()
        _check_warp(model, options)
    controller, initial = _resolved(model, options)
    options = options.replace(controller=controller.text, start=initial.name)
    if isinstance(model, MechanismModel):
        _check_mechanism(model, options)
    recipe = PlantRecipe(
        actuation=controller.actuation,
        mjcf=MjcfOptions(
            timestep=options.timestep,
            integrator=options.integrator,
            energy="energy" in options.record,
            sensors=not SENSED.isdisjoint(options.record) or isinstance(model, MechanismModel),
            floating_base=options.floating_base,
        ),
    )
    mjcf = recipe.text(model)
    plant = compile_plant(mjcf, model)
    initial.check(plant)
    if isinstance(model, MechanismModel):
        initial = initial.on_loops(plant, model)
        _check_driven(plant, controller)
    idle = [("randomize", problem) for problem in _unusable(plant, options)]
    if idle:
        raise SettingsError(idle)
    digests = {"controller_digest": controller.digest, "start_digest": initial.digest}
    if options.designs is not None:
        digests["designs_digest"] = options.designs.digest
    designs = None
    if options.vary or options.designs is not None:
        designs = DesignPlants(
            designs=_designs(model, options, checked),
            recipe=replace(recipe, mjcf=replace(recipe.mjcf, keyframes=False)),
            per_design=options.per_design,
            start=initial.name,
            as_fields=bool(options.randomize),
        )
    scene = to_scene(recipe.shown(model))
    attributes = _attributes(model, options, plant, digests, mjcf=mjcf, scene=scene, command=command)
    variation = None if designs is None else designs.designs.variation
    rows = model.spec.rows
    recorded = rollout_bytes(plant, options, follows=controller.follows, variation=variation, rows=rows)
    block = _block_size(recorded, options)
    layout = run_layout(
        plant, options, attributes, follows=controller.follows, block=block, variation=variation, rows=rows
    )
    job = Job(
        options=options,
        mjcf=mjcf,
        plant=plant,
        controller=controller,
        initial=initial,
        layout=layout,
        designs=designs,
    )
    rehearse(job)
    return job


def _designs(model: RobotModel | MechanismModel, options: RolloutOptions, checked: Advance) -> Designs:
    """Return the designs of a run, each of which there is a robot of.

    Raises:
        DesignFileError: There is none of some.
        SettingsError: Likewise, or a name is not one of a number of the robot.
    """
    designs = Designs(
        model.spec,
        draws=options.vary,
        table=options.designs,
        count=-(-options.rollouts // options.per_design),
        seed=options.seed,
    )
    variables = design_variables(designs.names)
    problems = [f"{name}: is the name of a variable of every run" for name in designs.names if name in TAKEN]
    if len(variables) < len(designs.names):
        problems.append(f"must have names that differ in letters and digits, got {listed(designs.names)}")
    if problems:
        raise SettingsError(("vary" if options.designs is None else "designs", problem) for problem in problems)
    designs.check(checked)
    return designs


def _check_warp(model: RobotModel | MechanismModel, options: RolloutOptions) -> None:
    """Refuse what is not done on a device.

    Raises:
        SettingsError: The error names each option.
    """
    problem = f"must not be given with the engine '{WARP}': all rollouts have one model there"
    given = {"randomize": options.randomize, "vary": options.vary, "designs": options.designs}
    problems = [(name, problem) for name, value in given.items() if value]
    if isinstance(model, MechanismModel):
        problems.append(("engine", f"must be '{ENGINES[0]}' for {model.name}: it is a mechanism"))
    if problems:
        raise SettingsError(problems)


INDEPENDENT = frozenset({"sine", "random", "pd", "computed-torque", "gravity-compensation"})
"""Controllers that give each driven joint something of its own."""


def _check_mechanism(model: MechanismModel, options: RolloutOptions) -> None:
    """Refuse what works on serial robots alone.

    Raises:
        SettingsError: The error names each option.
    """
    given = {"floating_base": options.floating_base, "vary": options.vary, "designs": options.designs}
    problem = f"must not be given for {model.name}: it is a mechanism"
    if problems := [(name, problem) for name, value in given.items() if value]:
        raise SettingsError(problems)


def _check_driven(plant: Plant, controller: ControllerChoice) -> None:
    """Refuse to move the driven joints of a mechanism independently where its loops do not let them.

    Raises:
        SettingsError: They are more than the freedoms.
    """
    loops = plant.loops
    if controller.name not in INDEPENDENT or loops is None or len(loops.driven) <= loops.freedoms:
        return
    names = listed(plant.controlled.joints)
    problem = (
        f"must be one of hold, passive, replay: {controller.name} moves {names} independently of each other, but the "
        f"loops leave {loops.freedoms} freedom{'s' * (loops.freedoms != 1)} at the assembly. Say in 'actuated' which "
        "joints are driven"
    )
    raise SettingsError([("controller", problem)])


def _named(model: RobotModel | MechanismModel, start: str) -> Mapping[str, Array]:
    """Return the configurations that have a name, of a mechanism with the loops closed in the one that is used.

    Raises:
        SettingsError: They cannot be closed near it.
    """
    configurations = model.spec.named_configurations
    if not isinstance(model, MechanismModel) or start not in configurations:
        return configurations
    try:
        return {**configurations, start: named_configuration(model.spec, start)}
    except AssemblyError as error:
        raise SettingsError([("start", str(error))]) from error


def _resolved(model: RobotModel | MechanismModel, options: RolloutOptions) -> tuple[ControllerChoice, InitialStates]:
    """Find the controller and the initial states, and report at once what is wrong with either."""
    problems: list[tuple[str, str]] = []

    def attempt(find: Callable[[], T]) -> T | None:
        try:
            return find()
        except SettingsError as error:
            problems.extend(error.problems)
        except ControllerError as error:
            problems.append(("", str(error)))
        return None

    controller = attempt(lambda: choose(options.controller))
    joints = tuple(joint.name for joint in model.moving_joints)
    if not joints:
        problems.append(("", f"{model.name} has no joint that moves: there is nothing to simulate"))
    configurations = model.spec.named_configurations
    first = None if controller is None else controller.first
    start = options.start
    if start == AUTO:
        start = "home" if first is None or set(first) != set(joints) else REFERENCE
    initial = attempt(
        lambda: (
            reference_start(first, joints)
            if start == REFERENCE and REFERENCE not in configurations and controller is not None
            else read_initial_states(start, joints, _named(model, start), options.rollouts)
        )
    )
    if problems or controller is None or initial is None:
        raise SettingsError(problems)
    return controller, initial


_SERIAL: Final = (
    "payload",
    "zero",
    "row_length",
    "row_angle",
    "encoder_bias",
    "encoder_noise",
    "sensor_delay",
)
"""Quantities that mechanisms cannot have."""


def _unusable(plant: Plant, options: RolloutOptions) -> Iterator[str]:
    """Yield what is wrong with what is randomized of a robot."""
    names = randomized(options.randomize)
    yield from unknown_labels(options.randomize, owners(plant))
    interval = push_time(options, "push_interval")
    if interval < options.timestep:
        yield f"must have push_interval of at least a time step, got {interval:g}"
    if plant.loops is not None and (serial := [name for name in _SERIAL if name in names]):
        yield f"must not contain {listed(serial)}, which are of serial robots alone"
    yield from _idle(plant, names)


def _idle(plant: Plant, names: Sequence[str]) -> Iterator[str]:
    """Yield what is wrong with randomizing a quantity that is zero in every joint or actuator."""
    model, joints = plant.model, plant.velocities
    values = {
        "friction": model.dof_frictionloss[joints],
        "damping": model.dof_damping[joints],
        "armature": model.dof_armature[joints],
        "gain": model.actuator_biasprm,  # motors have none
        "kp": model.actuator_biasprm[:, 1],
        "kv": model.actuator_biasprm[:, 2],
        "effort": np.concatenate(
            [model.jnt_actfrcrange, model.actuator_forcerange, model.actuator_ctrlrange[motors(plant)]]
        ),
        "gravity": model.opt.gravity,
    }
    words = {"effort": "limit of effort", "kp": "stiffness", "kv": "damping of actuators"}
    for name in names:
        verb = "tilt" if name == "gravity" else "multiply"
        if name in values and not values[name].any():
            yield f"must not contain '{name}': the robot as simulated has no {words.get(name, name)} to {verb}"


def _attributes(
    model: RobotModel | MechanismModel,
    options: RolloutOptions,
    plant: Plant,
    digests: Mapping[str, str],
    *,
    mjcf: str,
    scene: str,
    command: str,
) -> dict[str, Any]:
    """Return the attributes that say what a run was made from, and what a resumed run is compared with."""
    source = model.spec.source_file
    of_robot = {"home": plant.home, "velocity_limits": plant.velocity, "kp": plant.kp, "kv": plant.kv}
    return {
        "dh2sim_run": FORMAT,
        "robot": model.name,
        "robot_file": "" if source is None else source.text,
        "robot_file_sha256": "" if source is None else source.sha256,
        "mjcf": mjcf,
        "scene": scene,
        "command": command,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "seed": options.seed,
        "controller": options.controller,
        "randomize": dict(options.randomize),
        "settings": {
            **options.to_json(),
            **digests,
            **{name: values.tolist() for name, values in of_robot.items()},
        },
        "timestep": options.timestep,
        "integrator": options.integrator,
        "versions": {
            "dh2sim": version("dh2sim"),
            "mujoco": mujoco.__version__,
            "mujoco_package": mujoco_package(),
            "numpy": np.__version__,
            "python": platform.python_version(),
            **(warp_versions() if options.engine == WARP else {}),
        },
        **({"device": warp_device()} if options.engine == WARP else {}),
    }


def _block_size(recorded: int, options: RolloutOptions) -> int:
    """Return how many rollouts make a block.

    Args:
        recorded: Bytes that a rollout records, without times.
        options: Those of the run.

    Raises:
        SettingsError: A single rollout is too large.
    """
    whole = recorded + TIME_BYTES * options.records
    if whole > MOST_BYTES:
        problem = (
            f"one rollout would record {whole / 2**30:,.1f} GB, and at most {MOST_BYTES / 2**30:g} GB are possible; "
            "record fewer states (every) or fewer quantities (record)"
        )
        raise SettingsError([("", problem)])
    more = WARP_BLOCKS if options.engine == WARP else 1
    return max(1, min(options.rollouts, more * BLOCK_BYTES // recorded, more * BLOCK_STEPS // options.steps))
