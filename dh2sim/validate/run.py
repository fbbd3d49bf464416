"""Validation of a robot: every engine on its files against its table."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from dh2sim.arguments import below_one, file_path, whole_number
from dh2sim.engines.examined import Examined
from dh2sim.engines.mujoco_engine import MujocoEngine
from dh2sim.engines.pinocchio_engine import PinocchioEngine
from dh2sim.engines.pybullet_engine import PybulletEngine
from dh2sim.engines.yourdfpy_engine import YourdfpyEngine, start_yourdfpy
from dh2sim.errors import Dh2simError, EngineCapacityError, EngineError
from dh2sim.export import export_robot, mixture
from dh2sim.files import finish_interrupted, signals_deferred
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.model.mechanism import MechanismModel, written_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.slips import find_slips
from dh2sim.mujoco_warnings import mujoco_warnings, warning_sentences
from dh2sim.progress import Advance
from dh2sim.robot.read import loaded
from dh2sim.robot.spec import SpecLike
from dh2sim.typing import Array
from dh2sim.validate.dynamics import check_dynamics, check_inertias
from dh2sim.validate.kinematics import (
    DIFFERENCE_STEP,
    DIFFERENCE_TOLERANCE,
    LibraryEngine,
    check_jacobian,
    check_poses,
    check_unit_quaternions,
    table_jacobian,
)
from dh2sim.validate.mechanism import validate_mechanism
from dh2sim.validate.report import Check, Quantity, RobotReport, unread_check

if TYPE_CHECKING:  # what reads sources takes a tenth of the time to start, and is seldom asked for
    from dh2sim.validate.source import SourceArm

SLOW_ROWS = 8000
"""Most table rows that engines looping in Python compute: 1000 configurations of 8 rows."""
SLOWEST_SAMPLES = 200
"""Most configurations of yourdfpy, which takes the longest for each."""
JACOBIAN_SAMPLES = 200
DYNAMICS_SAMPLES = 20

Mover = MujocoEngine | PinocchioEngine | PybulletEngine
"""An engine with Jacobians and dynamics."""
Engine = TypeVar("Engine", bound=Mover | YourdfpyEngine)


def slow_samples(samples: int, rows: int) -> int:
    """Return the number of configurations that engines looping in Python compute."""
    return min(samples, max(1, SLOW_ROWS // max(8, rows)))


def engine_samples(samples: int, rows: int) -> int:
    """Return the number of configurations of all engines together, for a progress bar."""
    slow = slow_samples(samples, rows)
    return 3 * samples + 2 * slow + min(slow, SLOWEST_SAMPLES)


def validate_robot(
    robot: SpecLike | str | PathLike[str],
    *,
    samples: int = 1000,
    seed: int = 0,
    tolerance: float = 1e-12,
    folder: str | PathLike[str] | None = None,
    source: str | PathLike[str] | None = None,
    base: str | None = None,
    tip: str | None = None,
    advance: Advance | None = None,
) -> RobotReport:
    """Compare every engine with the table.

    Args:
        robot: The robot, or its file or name.
        samples: Number of random configurations inside the limits, at least 1; of a mechanism at most 100 are used.
        seed: Seed of the configurations.
        tolerance: Allowed angle, rad, and distance as a share of max(1 m, reach).
        folder: Folder with the robot's files; None to export them to a temporary one.
        source: URDF or MJCF that the robot was imported from, to compare its masses with.
        base: Link of the source that became base_link; by default the root.
        tip: Link or site of the source that became tool0; by default where the arm ends.
        advance: Called with the number of configurations that an engine has computed.

    Returns:
        The report. A file that is missing or that an engine refuses is a check that failed.

    Raises:
        ArgumentError: An argument is of a wrong kind, ``samples`` is below 1, or ``tolerance`` is not above 0 and
            below 1.
        Dh2simError: The source is not of this robot.
        ImportedFileError: The source is wrong.
        ModelError: A format cannot hold the robot.
        OutputError: The files cannot be written to the temporary folder.
    """
    samples, seed = whole_number("samples", samples, least=1), whole_number("seed", seed)
    tolerance = below_one("tolerance", tolerance)
    if source is None and (base, tip) != (None, None):
        raise Dh2simError("base and tip are links of the source, and need it")
    if folder is not None:
        folder = file_path("folder", folder)
    if source is not None:
        source = file_path("source", source)
    model = written_model(loaded(robot))
    if isinstance(model, MechanismModel):
        if source is not None:
            raise Dh2simError(f"{model.name}: a mechanism has no source to be compared with")
        return validate_mechanism(model, samples=samples, seed=seed, tolerance=tolerance, folder=folder)
    start_yourdfpy()
    arm = None if source is None else _source_arm(source, base, tip, model)
    with mujoco_warnings() as warned:
        if folder is not None:
            finish_interrupted(folder.parent, folder.name)
            report = _validate(model, folder, samples, seed, tolerance, arm, advance, made=False)
            mixed = mixture(model, folder)
            if mixed:
                reason = f"{folder} {mixed}; write them again with 'dh2sim export'"
                check = Check(engine="files", quantity=Quantity.FILE, ok=False, reason=reason)
                report = replace(report, checks=(check, *report.checks))
        else:
            with TemporaryDirectory(prefix="dh2sim-") as temporary:
                export_robot(model, Path(temporary), verify=False)
                made = Path(temporary) / model.name
                report = _validate(model, made, samples, seed, tolerance, arm, advance, made=True)
    return replace(report, warnings=warning_sentences(warned, [joint.name for joint in model.moving_joints]))


def _validate(
    model: RobotModel,
    folder: Path,
    samples: int,
    seed: int,
    tolerance: float,
    source: SourceArm | None,
    advance: Advance | None,
    *,
    made: bool,
) -> RobotReport:
    """Validate the files in a folder, which were ``made`` here, or may be a stranger's."""
    lower, upper = model.travel
    q = random_configurations(lower, upper, samples, seed)
    library = LibraryEngine(model.chain)
    mjcf, urdf = folder / f"{model.name}.xml", folder / f"{model.name}.urdf"
    engines, unread = _read(model, mjcf, urdf, Examined() if not made else None)
    allowed = max(tolerance, model.angle_rounding)

    def poses(engine: Mover | YourdfpyEngine) -> list[Check]:
        quick = isinstance(engine, MujocoEngine)
        some, threads = (q, 0) if quick else (q[: slow_samples(len(q), len(model.joints))], 1)
        if isinstance(engine, YourdfpyEngine):
            some = some[:SLOWEST_SAMPLES]
        scale = model.longest_lever if isinstance(engine, PybulletEngine) else model.extent
        return [check_poses(engine, model.spec, some, allowed, scale, threads=threads, advance=advance)]

    def checks_of(engine: Mover | YourdfpyEngine) -> list[Check]:
        return _checks_of(engine, Quantity.POSE, poses)

    movers = [engine for engine in engines if not isinstance(engine, YourdfpyEngine)]
    with ThreadPoolExecutor(1) as pool:
        beside = {engine.name: pool.submit(checks_of, engine) for engine in engines if engine not in movers}
        own = check_poses(library, model.spec, q, allowed, model.extent, threads=0, advance=advance)
        found = {engine.name: checks_of(engine) for engine in movers}
        if any(engine.name == "mujoco-mjcf" for engine in engines):
            unread = [check_unit_quaternions(mjcf), *unread]
        others = [
            *unread,
            *_jacobians(model, library, movers, q[:JACOBIAN_SAMPLES], tolerance),
            *_dynamics(model, movers, q[:DYNAMICS_SAMPLES], seed),
            *([] if source is None else _masses(model, movers, source, q[:DYNAMICS_SAMPLES])),
        ]
        found |= {name: checks.result() for name, checks in beside.items()}
    return RobotReport(
        name=model.name,
        samples=samples,
        reach=model.reach,
        slips=find_slips(model),
        checks=(own, *(check for engine in engines for check in found[engine.name]), *others),
    )


def _read(
    model: RobotModel, mjcf: Path, urdf: Path, examined: Examined | None
) -> tuple[list[Mover | YourdfpyEngine], list[Check]]:
    """Return the engines that read their files, and why others did not; files of strangers are ``examined``."""
    engines: list[Mover | YourdfpyEngine] = []
    unread: list[Check] = []
    names = [joint.name for joint in model.moving_joints]
    for name, path, make, package in (
        ("mujoco-mjcf", mjcf, MujocoEngine, "mujoco"),
        ("mujoco-urdf", urdf, MujocoEngine, "mujoco"),
        ("yourdfpy", urdf, YourdfpyEngine, "'dh2sim[engines]'"),
        ("pinocchio", urdf, PinocchioEngine, "pin"),
        ("pybullet", urdf, PybulletEngine, "pybullet"),
    ):
        if not path.is_file():
            reason = f"{path}: no such file; write it with 'dh2sim export'"
            unread.append(Check(engine=name, quantity=Quantity.FILE, ok=False, reason=reason))
            continue
        try:
            # an interrupted import would look like an engine that is not installed
            with signals_deferred(), np.errstate(all="ignore"):
                compiled = None if examined is None else examined.model(path)
                if make is MujocoEngine:
                    engines.append(MujocoEngine(path, names, len(model.joints), compiled=compiled))
                else:
                    engines.append(make(path, names, len(model.joints)))
        except (ImportError, EngineCapacityError, EngineError) as error:
            unread.append(unread_check(name, package, error))
    return engines, unread


def _jacobians(
    model: RobotModel, library: LibraryEngine, engines: list[Mover], q: Array, tolerance: float
) -> list[Check]:
    if q.shape[1] == 0:
        return []
    names = [joint.name for joint in model.moving_joints]
    own = library.jacobian(q)
    checks = [
        check_jacobian(
            library,
            table_jacobian(model.spec, q),
            q,
            max(DIFFERENCE_TOLERANCE, model.angle_rounding / DIFFERENCE_STEP),
            model.extent,
            names,
            differences=True,
        )
    ]
    scale = model.longest_lever  # MuJoCo computes relative to the centre of mass of all
    for engine in engines:
        checks += _checks_of(
            engine, Quantity.JACOBIAN, lambda engine: [check_jacobian(engine, own, q, tolerance, scale, names)]
        )
    return checks


def _dynamics(model: RobotModel, engines: list[Mover], q: Array, seed: int) -> list[Check]:
    checks = [check_inertias(engine, model) for engine in engines if isinstance(engine, MujocoEngine)]
    if q.shape[1] == 0 or not engines or engines[0].name != "mujoco-mjcf":
        return checks
    velocity = np.random.default_rng(seed).uniform(-1.0, 1.0, q.shape)
    reference = engines[0].dynamic_terms(q, velocity, model.spec.gravity)
    for engine in engines[1:]:
        checks += _checks_of(
            engine,
            Quantity.MASS_MATRIX,
            lambda engine: check_dynamics(engine, reference, model, q, velocity),
        )
    return checks


def _source_arm(source: str | PathLike[str], base: str | None, tip: str | None, model: RobotModel) -> SourceArm:
    from dh2sim.importing.sources import ImportOptions
    from dh2sim.validate.source import SourceArm

    return SourceArm.read(source, ImportOptions(base=base, tip=tip), model)


def _masses(model: RobotModel, engines: list[Mover], source: SourceArm, q: Array) -> list[Check]:
    """Compare the exported MJCF with the source; one that was not read has failed already."""
    from dh2sim.validate.source import check_source

    checks: list[Check] = []
    for engine in engines:
        if isinstance(engine, MujocoEngine) and engine.name == "mujoco-mjcf":
            checks += _checks_of(engine, Quantity.MASS_MATRIX, lambda engine: check_source(engine, source, model, q))
    return checks


def _checks_of(engine: Engine, quantity: Quantity, check: Callable[[Engine], list[Check]]) -> list[Check]:
    """Make checks of an engine; one that raises anything has failed on its file."""
    try:
        with np.errstate(all="ignore"):  # a file may contain anything; what is not finite fails
            return check(engine)
    except MemoryError:
        raise
    except EngineCapacityError as error:
        return [Check(engine=engine.name, quantity=quantity, ok=None, reason=str(error))]
    except Exception as error:
        reason = f"{engine.name} failed: {type(error).__name__}: {' '.join(str(error).split())}"
        return [Check(engine=engine.name, quantity=quantity, ok=False, reason=reason)]
