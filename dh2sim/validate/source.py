"""Masses of an imported robot: what was exported of it against the file that it was made from."""

from __future__ import annotations

import os
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from dh2sim.engines.mujoco_engine import MujocoEngine
from dh2sim.errors import Dh2simError
from dh2sim.formats.serial_robot import Mechanics
from dh2sim.importing.mechanics import TOLERANCE, relative_errors
from dh2sim.importing.serial import joint_names
from dh2sim.importing.sources import ImportOptions, read_arm
from dh2sim.messages import listed
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.validate.report import Check, Quantity, Worst


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SourceArm:
    """The arm that a robot was imported from."""

    file: Path
    mechanics: Mechanics | None
    n: int
    """Number of its joints."""
    places: tuple[int, ...]
    """The number among them of each joint of the robot; the others stay at zero."""

    @classmethod
    def read(cls, path: str | PathLike[str], options: ImportOptions, model: RobotModel) -> SourceArm:
        """Read the arm of a URDF or an MJCF.

        Raises:
            ImportedFileError: The file is wrong.
            Dh2simError: It cannot be read, or its arm lacks a joint of the robot.
        """
        arm = read_arm(path, options)
        known, _ = joint_names([joint.name for joint in arm.chain.joints])
        wanted = [joint.name for joint in model.moving_joints]
        missing = [name for name in wanted if name not in known]
        if missing:
            raise Dh2simError(
                f"{os.fspath(path)}: its arm has no joint {listed(missing)}, which {model.name} has. Joints: "
                f"{listed(known)}; base and tip choose another part of it"
            )
        return cls(
            file=Path(path), mechanics=arm.mechanics, n=len(known), places=tuple(known.index(name) for name in wanted)
        )


def check_source(engine: MujocoEngine, source: SourceArm, model: RobotModel, q: Array) -> list[Check]:
    """Compare mass matrix and gravity forces of an exported file with those of the source.

    Args:
        engine: MuJoCo on the exported file.
        source: The arm that the robot was imported from.
        model: The robot.
        q: Joint vectors, rad and m, shape (N, n).

    Returns:
        A check of each; its ``ok`` is None where the source gives no masses.
    """
    places = list(source.places)
    full = np.zeros((len(q), source.n))
    full[:, places] = q
    mass, load = (np.zeros(0), np.zeros(0)) if source.mechanics is None else source.mechanics(full)
    if not mass.any():
        reason = f"{source.file} gives no masses to compare with"
        return [Check(engine=engine.name, quantity=Quantity.MASS_MATRIX, ok=None, reason=reason)]
    terms = engine.dynamic_terms(q, np.zeros_like(q), model.spec.gravity)
    errors = relative_errors((terms.mass_matrix, terms.gravity), (mass[:, places][:, :, places], load[:, places]))
    names = [joint.name for joint in model.moving_joints]
    return [
        _check(engine.name, quantity, error, source.file, names, q)
        for quantity, error in zip((Quantity.MASS_MATRIX, Quantity.GRAVITY), errors, strict=True)
    ]


def _check(engine: str, quantity: Quantity, error: Array, file: Path, joints: list[str], q: Array) -> Check:
    sample, joint = divmod(int(np.argmax(error)), error.shape[1])  # a NaN is worse than any number
    largest = float(error[sample, joint])
    return Check(
        engine=engine,
        quantity=quantity,
        ok=bool(largest <= TOLERANCE),
        reference=file.name,
        samples=len(q),
        max_error=largest,
        tolerance=TOLERANCE,
        worst=Worst(where=joints[joint], q=tuple(q[sample].tolist()), sample=sample),
    )
