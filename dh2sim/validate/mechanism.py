"""Checks of a mechanism: the poses of its tree, and its loops: closed at home, as free as ours, closed in motion."""

from __future__ import annotations

import time
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from dh2sim.engines.examined import Examined
from dh2sim.engines.mujoco_mechanism import MujocoMechanism
from dh2sim.engines.pinocchio_engine import PinocchioEngine
from dh2sim.engines.pybullet_engine import PybulletEngine
from dh2sim.engines.yourdfpy_engine import YourdfpyEngine
from dh2sim.errors import EngineCapacityError, EngineError
from dh2sim.export import export_robot
from dh2sim.files import signals_deferred
from dh2sim.kinematics.loop_closure import constraint_jacobian
from dh2sim.kinematics.parallelograms import find_couplings
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.kinematics.table_oracle import table_mechanism_frames
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.kinematics.tree import tree_frames
from dh2sim.messages import counted
from dh2sim.model.mechanism import MechanismModel
from dh2sim.typing import Array
from dh2sim.validate.report import Check, Quantity, RobotReport, Worst, unread_check

GAP_LIMIT = 1e-3
"""Of loops in motion, in sizes of the mechanism, and rad."""
_MOST_SAMPLES = 100
"""Configurations that one is computed at a time for."""
_OTHERS_SAMPLES = 20
"""Configurations of the readers of URDF that are not MuJoCo."""


def validate_mechanism(
    model: MechanismModel, *, samples: int = 1000, seed: int = 0, tolerance: float = 1e-12, folder: Path | None = None
) -> RobotReport:
    """Compare the library and all engines with the tables of a mechanism, and MuJoCo's loops with ours.

    Args:
        model: The mechanism.
        samples: Number of random configurations inside the limits; at most 100 are used.
        seed: Seed of the configurations.
        tolerance: Allowed angle, rad, and distance as a share of max(1 m, size).
        folder: Folder with its files; None to export them to a temporary one.

    Raises:
        OutputError: The files cannot be written to the temporary folder.
    """
    if folder is None:
        with TemporaryDirectory(prefix="dh2sim-") as temporary:
            export_robot(model, Path(temporary), verify=False)
            return _validate(model, Path(temporary) / model.name, samples, seed, tolerance, None)
    return _validate(model, folder, samples, seed, tolerance, Examined())


def _validate(
    model: MechanismModel, folder: Path, samples: int, seed: int, tolerance: float, examined: Examined | None
) -> RobotReport:
    lower, upper = (np.array([joint.travel[side] for joint in model.moving_joints]) for side in (0, 1))
    q = random_configurations(lower, upper, min(samples, _MOST_SAMPLES), seed)
    table = [table_mechanism_frames(model.spec, vector) for vector in q]
    checks = [_poses("dh2sim", model, [tree_frames(model.tree, vector) for vector in q], table, q, tolerance)]
    names = [joint.name for joint in model.moving_joints]
    for engine, suffix in (("mujoco-mjcf", "xml"), ("mujoco-urdf", "urdf")):
        path = folder / f"{model.name}.{suffix}"
        if not path.is_file():
            reason = f"{path}: no such file; write it with 'dh2sim export'"
            checks.append(Check(engine=engine, quantity=Quantity.FILE, ok=False, reason=reason))
            continue
        try:
            read = MujocoMechanism(path, compiled=None if examined is None else examined.model(path))
            poses = [read.frame_poses(dict(zip(names, vector.tolist(), strict=True))) for vector in q]
            checks.append(_poses(engine, model, poses, table, q, tolerance))
            if suffix == "xml" and model.tree.closures:
                checks += _loops(read, model, tolerance)
        except (EngineError, KeyError) as error:
            checks.append(Check(engine=engine, quantity=Quantity.FILE, ok=False, reason=str(error)))
    checks += _other_readers(folder / f"{model.name}.urdf", model, q[:_OTHERS_SAMPLES], tolerance, examined)
    return RobotReport(name=model.name, samples=len(q), reach=model.size, checks=tuple(checks))


def _other_readers(
    path: Path, model: MechanismModel, q: Array, tolerance: float, examined: Examined | None
) -> list[Check]:
    """Compare the poses of the tree that other programs read from a URDF with the table."""
    names = [joint.name for joint in model.moving_joints]
    couplings = find_couplings(model.spec).joints if model.tree.closures else {}
    checks = []
    for engine, make, package in (
        ("yourdfpy", YourdfpyEngine, "'dh2sim[engines]'"),
        ("pinocchio", PinocchioEngine, "pin"),
        ("pybullet", PybulletEngine, "pybullet"),
    ):
        if not path.is_file():
            continue  # which is said of MuJoCo
        own, vectors = list(range(len(names))), q
        if make is YourdfpyEngine:  # the only one that moves joints that mimic others
            vectors = q.copy()
            for k, coupling in couplings.items():
                vectors[:, k] = coupling.sign * q[:, coupling.root] + coupling.offset
            own = [k for k in own if k not in couplings]
        table = [table_mechanism_frames(model.spec, vector) for vector in vectors]
        if make is PybulletEngine:  # which tells nothing of the link that is its base
            table = [{frame: T for frame, T in poses.items() if frame != "base_link"} for poses in table]
        try:
            with signals_deferred():
                if examined is not None:
                    examined.model(path)
                reader = make(path, [names[k] for k in own], tuple(table[0]))
            poses = reader.frame_poses(np.ascontiguousarray(vectors[:, own]))
        except (ImportError, EngineCapacityError, EngineError) as error:
            checks.append(unread_check(engine, package, error))
        except MemoryError:
            raise
        except Exception as error:  # a file may contain anything
            reason = f"{engine} failed: {type(error).__name__}: {' '.join(str(error).split())}"
            checks.append(Check(engine=engine, quantity=Quantity.FILE, ok=False, reason=reason))
        else:
            found = [dict(zip(reader.frames, each, strict=True)) for each in poses]
            checks.append(_poses(engine, model, found, table, vectors, tolerance))
    return checks


def _poses(
    engine: str,
    model: MechanismModel,
    found: list[dict[str, Array]],
    table: list[dict[str, Array]],
    q: Array,
    tolerance: float,
) -> Check:
    """Compare the frames that an engine has with those of the table."""
    start = time.perf_counter()
    names = [name for name in table[0] if name in found[0]]
    missing = [name for name in table[0] if name not in found[0]]
    T = np.array([[poses[name] for name in names] for poses in found])
    T_table = np.array([[poses[name] for name in names] for poses in table])
    position, rotation = pose_errors(T, T_table)
    worst = np.unravel_index(int(np.argmax(position)), position.shape)
    ok = bool(position.max() <= tolerance * max(1.0, model.size) and rotation.max() <= tolerance) and not missing
    return Check(
        engine=engine,
        quantity=Quantity.POSE,
        ok=ok,
        samples=len(q),
        frames=len(names),
        max_position_error=float(position.max()),
        max_rotation_error=float(rotation.max()),
        tolerance=tolerance,
        reason=f"frames are missing: {', '.join(missing)}" if missing else None,
        worst=Worst(where=names[worst[1]], q=tuple(q[worst[0]].tolist()), sample=int(worst[0])),
        seconds=time.perf_counter() - start,
    )


def _loops(read: MujocoMechanism, model: MechanismModel, tolerance: float) -> list[Check]:
    """Compare the loops at home with ours, and measure how far they open in motion."""
    gap, freedoms = read.loops_at_home()
    own = model.tree.n - int(np.linalg.matrix_rank(constraint_jacobian(model.tree, model.q), tol=1e-8))
    allowed = tolerance * max(1.0, model.size)
    moving = read.gap_in_motion() / model.size
    rank = f"MuJoCo's constraints leave {counted(freedoms, 'freedom')} at home, ours {own}"
    return [
        _finding(Quantity.CLOSED, gap, allowed, ""),
        _finding(Quantity.FREEDOMS, float(abs(freedoms - own)), 0.0, rank),
        _finding(Quantity.LOOP_GAP, moving, GAP_LIMIT, "" if isfinite(moving) else "the simulation is unstable"),
    ]


def _finding(quantity: Quantity, error: float, tolerance: float, failure: str) -> Check:
    ok = bool(error <= tolerance)
    return Check(
        engine="mujoco-mjcf",
        quantity=quantity,
        ok=ok,
        reference="loops",
        samples=1,
        max_error=error,
        tolerance=tolerance,
        reason=None if ok or not failure else failure,
    )
