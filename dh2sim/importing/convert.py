"""A robot's table in the other convention, as a robot file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dh2sim.errors import Dh2simError, MismatchError
from dh2sim.kinematics.chain import SpecLike, build_chain, spec_of
from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.frame_assignment.recover import CONFIGURATIONS, SEED
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.messages import member
from dh2sim.model.limits import reach_bound
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import Convention, RobotSpec
from dh2sim.robot.write import robot_file_text

TOLERANCE = 1e-12
"""Of the reach, and rad: conversion moves numbers between rows, so that only rounding is left."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Converted:
    """A robot file in the other convention."""

    text: str = field(repr=False)
    """The robot file."""
    spec: RobotSpec
    """The robot, read back from the text."""
    notes: tuple[str, ...]
    """What could not be converted, a sentence each."""
    position_error: float
    """Greatest distance of tool0 from where it was, m."""
    rotation_error: float
    """Greatest angle of tool0 from where it was, rad."""

    @property
    def summary(self) -> str:
        """Name, rows, conventions and errors, in one line."""
        conventions = " and ".join(dict.fromkeys(row.convention.value for row in self.spec.rows))
        rows = f"{len(self.spec.rows)} {'row' if len(self.spec.rows) == 1 else 'rows'}"
        return (
            f"{self.spec.name}, {rows}, {conventions}; tool0 off by at most {self.position_error:.1e} m and "
            f"{self.rotation_error:.1e} rad at {CONFIGURATIONS} configurations"
        )


def convert_robot(spec: SpecLike, to: Convention | str, *, folder: Path | None = None) -> Converted:
    """Write a robot's table in another convention, and compare the text's tool poses with the robot's own.

    Args:
        spec: The robot, in any form.
        to: Standard or modified.
        folder: Of the robot file, to which paths of meshes are relative.

    Raises:
        MismatchError: The poses differ by more than rounding.
    """
    spec = spec_of(spec)
    to = member(Convention, to, "convention")
    if to is Convention.HAYATI:
        raise Dh2simError("a table can be converted to standard or modified, not to hayati")
    conversion = convert_rows(spec, to)
    notes = list(conversion.notes)
    if spec.parameters:
        notes.append("Parameters are replaced by their values.")
    text = robot_file_text(conversion.spec, header=[f"Note: {note}" for note in notes], folder=folder)
    read = parse_robot(text, file="the robot file", directory=folder)
    position, rotation = _errors(spec, read)
    reach = reach_bound(build_chain(spec), spec.rows)
    if not (position <= TOLERANCE * max(1.0, reach) and rotation <= TOLERANCE):
        raise MismatchError(
            f"{spec.name}: tool0 of the converted table is off by {position:.1e} m and {rotation:.1e} rad; "
            "nothing was written"
        )
    return Converted(text=text, spec=read, notes=tuple(notes), position_error=position, rotation_error=rotation)


def _errors(spec: RobotSpec, converted: RobotSpec) -> tuple[float, float]:
    bound = np.array([np.pi if row.type.turns else 1.0 for row in spec.moving_rows])
    q = random_configurations(-bound, bound, CONFIGURATIONS, SEED)
    position, rotation = pose_errors(table_tool_pose(converted, q), table_tool_pose(spec, q))
    return float(position.max()), float(rotation.max())
