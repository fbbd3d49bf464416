"""Serial robots of any format to robot files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dh2sim.errors import Dh2simError, MismatchError
from dh2sim.formats.serial_robot import SerialRobot
from dh2sim.imports.assemble import assemble
from dh2sim.imports.hints import simpler_with
from dh2sim.imports.imported import Imported
from dh2sim.imports.names import joint_names, robot_name
from dh2sim.kinematics.assignment.findings import Step
from dh2sim.kinematics.assignment.recover import (
    CONFIGURATIONS,
    TOLERANCE,
    Recovery,
    recover_table,
    within,
)
from dh2sim.kinematics.assignment.residual import Residual, measure_residual
from dh2sim.robot.load import parse_robot
from dh2sim.robot.spec import Convention, RobotSpec
from dh2sim.robot.words import shown
from dh2sim.robot.writing.robot_file import robot_file_text


def import_serial(
    robot: SerialRobot,
    *,
    convention: Convention = Convention.STANDARD,
    tolerance: float = TOLERANCE,
    folder: Path | None = None,
    name: str | None = None,
    header: Sequence[str] = (),
    source: str = "",
    description: str = "",
) -> Imported:
    """Make a robot file of a serial robot, and compare it with the robot's own kinematics.

    What is compared is the text, read back: all joint axes and the tip at 1000 random configurations.

    Args:
        robot: As read from its file.
        convention: Of the table.
        tolerance: Greatest residual, rad, and m for a reach of up to 1 m, then of the reach.
        folder: Where the robot file will stand, which paths of meshes are relative to.
        name: Of the robot, instead of the file's.
        header: Comment lines to begin the file with.
        source: Where the numbers come from; by default the robot's description.
        description: What the robot is.

    Raises:
        MismatchError: The residual is above the tolerance.
        Dh2simError: The robot cannot be written as a robot file.
    """
    names, renamed = joint_names([joint.name for joint in robot.chain.joints])
    own_name = robot_name(robot.name if name is None else name)
    recovery = recover_table(robot.chain, convention=convention, tolerance=tolerance, name=own_name)
    spec = assemble(robot, recovery, name=own_name, joint_names=names)
    hint = simpler_with(spec, tolerance)
    notes = (*robot.notes, *_base_mass(robot), *renamed, *_tilted(recovery), *([hint] if hint else []))
    comments = [*header, *(f"Note: {note}" for note in notes)]
    origin = source or robot.description
    spec = replace(spec, description=description, source=origin)
    residual = _measure(robot, _read_back(spec, comments, folder), recovery)
    if not within(residual, tolerance, recovery.reach):
        raise MismatchError(
            f"{robot.description}: the table is off by {residual_text(residual)} at {residual.worst}; allowed is "
            f"{tolerance!r}. Nothing was written. Allow more with --tolerance, if that is good enough"
        )
    spec = replace(spec, source=f"{origin}{'' if origin.endswith('.') else '.'} {residual_sentence(residual)}")
    text = robot_file_text(spec, header=comments, folder=folder)
    return Imported(
        text=text,
        spec=_read(text, folder),
        notes=notes,
        residual=residual,
        chain=robot.chain,
        assignment=recovery.assignment,
    )


def residual_text(residual: Residual) -> str:
    """Return a residual as ``3e-16 m and 5e-16 rad``."""
    return f"{residual.position:.1e} m and {residual.rotation:.1e} rad"


def residual_sentence(residual: Residual) -> str:
    """Return what the robot file's source says of a residual."""
    return (
        f"Made by dh2sim; at {residual.configurations} random configurations all joint axes and the tip differ from "
        f"the source's by at most {residual_text(residual)}."
    )


def _measure(robot: SerialRobot, spec: RobotSpec, recovery: Recovery) -> Residual:
    return measure_residual(spec, robot.chain, CONFIGURATIONS, recovery.reach or 1.0)


def _read_back(spec: RobotSpec, comments: Sequence[str], folder: Path | None) -> RobotSpec:
    return _read(robot_file_text(spec, header=comments, folder=folder), folder)


def _read(text: str, folder: Path | None) -> RobotSpec:
    try:
        return parse_robot(text, file="the robot file", directory=folder)
    except Dh2simError as error:
        raise Dh2simError(f"the robot cannot be written as a robot file:\n{error}") from error


def _base_mass(robot: SerialRobot) -> list[str]:
    if robot.base.mass is None:
        return []
    return [f"The mass of the base {shown(robot.base.name)}, {robot.base.mass:.4g} kg, has no place in a robot file."]


def _tilted(recovery: Recovery) -> list[str]:
    """Return a sentence for every pair of nearly parallel axes."""
    links = recovery.assignment.links[1:]
    return [
        _tilt(step, recovery) for step, part in zip(recovery.assignment.steps, links, strict=False) if part.hayati
    ]


def _tilt(step: Step, recovery: Recovery) -> str:
    where = (
        "noise would decide where their common normal points"
        if step.normal_at is None
        else f"their common normal is {step.normal_at:.4g} m away, and the reach is {recovery.reach:.3g} m"
    )
    return (
        f"The axes of {step.joint} and {step.next_joint} are nearly parallel, {_angle(step)} apart: {where}. "
        f"So the row of {step.joint} is Hayati's: a, alpha and beta, no d."
    )


def _angle(step: Step) -> str:
    angle = math.pi - step.angle if step.antiparallel else step.angle
    return f"{angle:.2e} rad"
