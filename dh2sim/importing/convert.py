"""A robot's table in the other convention, or with every frame within reach of the arm, as a robot file."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import TypeAlias

import numpy as np

from dh2sim.errors import Dh2simError, MismatchError
from dh2sim.importing.source_errors import MADE, errors_of
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.compaction import compact_rows
from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.frame_assignment.recover import CONFIGURATIONS, SEED
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.kinematics.table_oracle import table_tool_errors, table_tool_pose
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.messages import member
from dh2sim.model.limits import frame_extent, travels_of
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec, SpecLike, spec_of
from dh2sim.robot.units import AngleUnit, Units
from dh2sim.robot.write import robot_file_text
from dh2sim.typing import Array

TOLERANCE = 1e-12
"""Of the reach, and rad: conversion moves numbers between rows, so that only rounding is left."""


EXACT_CONFIGURATIONS = 100
"""At how many configurations a compact table is compared, in exact arithmetic."""


class TableForm(StrEnum):
    """What a table can be converted to."""

    STANDARD = "standard"
    MODIFIED = "modified"
    COMPACT = "compact"
    """Every frame within reach of the arm, with Hayati rows where they are needed."""


TableFormLike: TypeAlias = TableForm | Convention | str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Converted:
    """A robot file with the table in another form."""

    text: str = field(repr=False)
    """The robot file."""
    spec: RobotSpec
    """The robot, read back from the text."""
    notes: tuple[str, ...]
    """What could not be converted; of a compact table, what was changed and why; one sentence each."""
    position_error: float
    """Greatest distance of tool0 from where it was, m."""
    rotation_error: float
    """Greatest angle of tool0 from where it was, rad."""
    configurations: int
    """At how many random configurations they were measured."""

    @property
    def summary(self) -> str:
        """Name, rows, conventions and errors, in one line."""
        conventions = " and ".join(dict.fromkeys(row.convention.value for row in self.spec.rows))
        rows = f"{len(self.spec.rows)} {'row' if len(self.spec.rows) == 1 else 'rows'}"
        return (
            f"{self.spec.name}, {rows}, {conventions}; tool0 off by at most {self.position_error:.1e} m and "
            f"{self.rotation_error:.1e} rad at {self.configurations} configurations"
        )


def convert_robot(spec: SpecLike, to: TableFormLike, *, folder: Path | None = None) -> Converted:
    """Write a robot's table in another form, and compare the text's tool poses with the robot's own.

    Args:
        spec: The robot, in any form.
        to: Standard, modified or compact.
        folder: Of the robot file, to which paths of meshes are relative.

    Raises:
        MismatchError: The poses differ by more than rounding.
    """
    spec = spec_of(spec)
    if isinstance(to, str) and to == Convention.HAYATI:
        raise Dh2simError("a table can be converted to standard, modified or compact, not to hayati")
    form = member(TableForm, str(to), "form of a table")
    compact = form is TableForm.COMPACT
    conversion = compact_rows(spec) if compact else convert_rows(spec, Convention(form.value))
    notes = list(conversion.notes)
    if compact and not notes:
        notes.append("Every frame is within reach of the arm already: no row was changed.")
    if spec.parameters:
        notes.append("Parameters are replaced by their values.")
    units = spec.units if spec.source_file is not None else Units(angle=AngleUnit.DEG)
    text = robot_file_text(
        conversion.spec,
        header=[f"Note: {note}" for note in notes],
        folder=folder,
        angle=units.angle,
        length=units.length,
    )
    with errors_of(spec.name if spec.source_file is None else spec.source_file.path):
        read = parse_robot(text, file=MADE, directory=folder)
    count = EXACT_CONFIGURATIONS if compact else CONFIGURATIONS
    q = _configurations(spec, count)
    position, rotation = table_tool_errors(read, spec, q) if compact else _errors(spec, read, q)
    chain = build_chain(conversion.spec)
    extent = frame_extent(chain, travels_of(chain, spec.rows))
    if not (position <= TOLERANCE * max(1.0, extent) and rotation <= TOLERANCE):
        raise MismatchError(
            f"{spec.name}: tool0 of the converted table is off by {position:.1e} m and {rotation:.1e} rad; "
            "nothing was written"
        )
    return Converted(
        text=text,
        spec=read,
        notes=tuple(notes),
        position_error=position,
        rotation_error=rotation,
        configurations=count,
    )


def _configurations(spec: RobotSpec, count: int) -> Array:
    bound = np.array([np.pi if row.type.turns else 1.0 for row in spec.moving_rows])
    return random_configurations(-bound, bound, count, SEED)


def _errors(spec: RobotSpec, converted: RobotSpec, q: Array) -> tuple[float, float]:
    position, rotation = pose_errors(table_tool_pose(converted, q), table_tool_pose(spec, q))
    return float(position.max()), float(rotation.max())
