"""Validating one robot: from its table and its files to a report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from dh2sim.engines.mujoco_engine import MujocoEngine
from dh2sim.engines.pinocchio_engine import PinocchioEngine
from dh2sim.engines.yourdfpy_engine import YourdfpyEngine
from dh2sim.errors import EngineError
from dh2sim.export.run import export_robot
from dh2sim.export.verify import sampling_limits
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.validate.dynamics import check_dynamics, check_inertias
from dh2sim.validate.jacobians import DIFFERENCE_TOLERANCE, check_jacobian, table_jacobian
from dh2sim.validate.library import LibraryEngine
from dh2sim.validate.poses import check_poses
from dh2sim.validate.quaternions import check_unit_quaternions
from dh2sim.validate.report import Check, Quantity, RobotReport

SLOW_SAMPLES = 1000
"""At most so many configurations are asked of engines that loop in Python."""
JACOBIAN_SAMPLES = 200
DYNAMICS_SAMPLES = 20

Advance = Callable[[int], None]


def engine_samples(samples: int) -> int:
    """How many poses ``validate_robot`` compares in all, for a progress bar."""
    return 3 * samples + 2 * min(samples, SLOW_SAMPLES)


def validate_robot(
    model: RobotModel,
    *,
    samples: int = 1000,
    seed: int = 0,
    tolerance: float = 1e-12,
    folder: Path | None = None,
    advance: Advance | None = None,
) -> RobotReport:
    """Compare every engine with the table.

    Args:
        model: the robot.
        samples: number of random configurations inside the limits.
        seed: of the configurations.
        tolerance: allowed angle, rad, and distance as a share of max(1 m, reach).
        folder: where the robot's files stand; None to export them afresh.
        advance: told how many configurations an engine has done.

    Returns:
        The report. A file that is missing or that an engine refuses is a check that failed.

    Raises:
        ModelError: a format cannot hold the robot.
        OutputError: the files cannot be written to the temporary folder.
    """
    if folder is not None:
        return _validate(model, folder, samples, seed, tolerance, advance)
    with TemporaryDirectory(prefix="dh2sim-") as temporary:
        export_robot(model, Path(temporary), verified=False)
        return _validate(model, Path(temporary) / model.name, samples, seed, tolerance, advance)


def _validate(
    model: RobotModel, folder: Path, samples: int, seed: int, tolerance: float, advance: Advance | None
) -> RobotReport:
    lower, upper = sampling_limits(model)
    q = random_configurations(lower, upper, samples, seed)
    library = LibraryEngine(model.chain)
    checks: list[Check] = []
    engines: list[MujocoEngine | PinocchioEngine | YourdfpyEngine] = []
    mjcf, urdf = folder / f"{model.name}.xml", folder / f"{model.name}.urdf"
    names = [joint.name for joint in model.moving_joints]
    for name, path, make in (
        ("mujoco-mjcf", mjcf, MujocoEngine),
        ("mujoco-urdf", urdf, MujocoEngine),
        ("yourdfpy", urdf, YourdfpyEngine),
        ("pinocchio", urdf, PinocchioEngine),
    ):
        if not path.is_file():
            checks.append(_failed(name, f"{path}: no such file; write it with 'dh2sim export'"))
            continue
        try:
            engines.append(make(path, names, len(model.joints)))
        except ImportError as error:
            checks.append(_absent(name, error))
        except EngineError as error:
            checks.append(_failed(name, str(error)))
    poses = [check_poses(library, model.spec, q, tolerance, model.reach, threads=0, advance=advance)]
    for engine in engines:
        some = q if isinstance(engine, MujocoEngine) else q[:SLOW_SAMPLES]
        threads = 0 if isinstance(engine, MujocoEngine) else 1
        poses.append(check_poses(engine, model.spec, some, tolerance, model.reach, threads=threads, advance=advance))
    if mjcf.is_file() and any(engine.name == "mujoco-mjcf" for engine in engines):
        poses.append(check_unit_quaternions(mjcf))
    movers = [engine for engine in engines if not isinstance(engine, YourdfpyEngine)]
    return RobotReport(
        name=model.name,
        samples=samples,
        reach=model.reach,
        checks=(
            *poses,
            *checks,
            *_jacobians(model, library, movers, q[:JACOBIAN_SAMPLES], tolerance),
            *_dynamics(model, movers, q[:DYNAMICS_SAMPLES], seed),
        ),
    )


def _jacobians(
    model: RobotModel,
    library: LibraryEngine,
    engines: list[MujocoEngine | PinocchioEngine],
    q: Array,
    tolerance: float,
) -> list[Check]:
    if q.shape[1] == 0:
        return []
    differences = table_jacobian(model.spec, q)
    own = library.jacobian(q)
    checks = [check_jacobian(library, differences, q, DIFFERENCE_TOLERANCE, model.reach, differences=True)]
    return checks + [check_jacobian(engine, own, q, tolerance, model.reach) for engine in engines]


def _dynamics(model: RobotModel, engines: list[MujocoEngine | PinocchioEngine], q: Array, seed: int) -> list[Check]:
    checks = [check_inertias(engine, model) for engine in engines if isinstance(engine, MujocoEngine)]
    if q.shape[1] == 0 or not engines or engines[0].name != "mujoco-mjcf":
        return checks
    velocity = np.random.default_rng(seed).uniform(-1.0, 1.0, q.shape)
    gravity = model.spec.gravity
    reference = engines[0].dynamic_terms(q, velocity, gravity)
    names = [joint.name for joint in model.moving_joints]
    for engine in engines[1:]:
        checks += check_dynamics(engine.name, engine.dynamic_terms(q, velocity, gravity), reference, names, q)
    return checks


def _failed(engine: str, reason: str) -> Check:
    return Check(engine=engine, quantity=Quantity.FILE, ok=False, reason=reason)


def _absent(engine: str, error: ImportError) -> Check:
    return Check(engine=engine, quantity=Quantity.POSE, ok=None, reason=f"not installed ({error})")
