"""Do the files that were written hold the table? Asked of MuJoCo, which reads both formats."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dh2sim.errors import EngineError, MismatchError
from dh2sim.export.render import Format
from dh2sim.kinematics.comparison import pose_errors
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.kinematics.table import table_frame_poses, table_tool_pose
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array

TOLERANCE = 1e-12
"""Of rotations in rad, and of positions as a share of the larger of 1 m and the reach."""
SAMPLES = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Verified:
    """How far the poses that MuJoCo reads from a file are from the table's."""

    format: Format
    position_error: float
    """Greatest distance, m."""
    rotation_error: float
    """Greatest angle, rad."""


def sampling_limits(model: RobotModel) -> tuple[Array, Array]:
    """Lower and upper joint coordinates to sample between, rad and m, shape (n,) each; ±π for continuous joints."""
    ranges = [joint.range for joint in model.moving_joints]
    lower = [-np.pi if r is None else r.lower for r in ranges]
    upper = [np.pi if r is None else r.upper for r in ranges]
    return np.array(lower, dtype=np.float64), np.array(upper, dtype=np.float64)


def verify(model: RobotModel, folder: Path, formats: Collection[Format]) -> list[Verified]:
    """Compare all frames of the files in ``folder`` with the table at scattered configurations.

    Raises:
        EngineError: MuJoCo refuses a file.
        MismatchError: a pose differs by more than rounding.
    """
    from dh2sim.engines.mujoco_engine import MujocoEngine  # only exports that verify pay for MuJoCo

    lower, upper = sampling_limits(model)
    q = scattered_configurations(lower, upper, SAMPLES)
    table = np.concatenate([table_frame_poses(model.spec, q), table_tool_pose(model.spec, q)[:, None]], axis=1)
    names = [joint.name for joint in model.moving_joints]
    results = []
    for format_ in formats:
        path = folder / f"{model.name}.{'urdf' if format_ is Format.URDF else 'xml'}"
        try:
            engine = MujocoEngine(path, names, len(model.joints))
        except EngineError as error:
            told = str(error).replace(str(path), path.name)  # the temporary folder is nobody's business
            raise EngineError(f"{model.name}: {told}; nothing was written") from error
        reference = table if len(engine.frames) > 1 else table[:, -1:]
        position, rotation = pose_errors(engine.frame_poses(q), reference)
        result = Verified(
            format=format_, position_error=float(np.max(position)), rotation_error=float(np.max(rotation))
        )
        allowed = TOLERANCE * max(1.0, model.reach)
        if not (result.position_error <= allowed and result.rotation_error <= TOLERANCE):
            raise MismatchError(
                f"{model.name}: the {format_.value.upper()} differs from the table by {result.position_error:.3g} m "
                f"and {result.rotation_error:.3g} rad (allowed: {allowed:.3g} m and {TOLERANCE:.3g} rad); nothing "
                "was written. This is a defect of dh2sim: please report it with the robot file"
            )
        results.append(result)
    return results
