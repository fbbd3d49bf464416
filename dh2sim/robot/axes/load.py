"""Axes files to AxesSpecs."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dh2sim.errors import ImportedFileError
from dh2sim.robot.axes.checks import check_axes
from dh2sim.robot.axes.schema import AxesEntry
from dh2sim.robot.axes.spec import AxesSpec, AxisJoint
from dh2sim.robot.compose import compose
from dh2sim.robot.convert import to_spec
from dh2sim.robot.document import Node, decode
from dh2sim.robot.fields import Context
from dh2sim.robot.parameters import evaluate_parameters
from dh2sim.robot.report import Report
from dh2sim.robot.schema import JointEntry, RobotEntry
from dh2sim.robot.spec import Convention, JointType, Pose, RobotSpec, SourceFile
from dh2sim.robot.structure import read_model
from dh2sim.robot.units import Units
from dh2sim.typing import Array, read_only


class _AxesReport(Report):
    """Collects the problems of an axes file."""

    def error(self) -> ImportedFileError:
        return ImportedFileError(dict.fromkeys(self.problems))


def read_axes(data: bytes, *, file: str, directory: Path) -> AxesSpec:
    """Return the joint axes that an axes file describes.

    Args:
        data: The file's content.
        file: Its name, for messages.
        directory: Where paths in it start.

    Raises:
        ImportedFileError: The file is wrong; the error holds everything that is.
    """
    report = _AxesReport(file)
    text = decode(data, report)
    root = compose(text, report, needs="axes need at least name and axes")
    parameters = evaluate_parameters(root, report)
    entry = read_model(AxesEntry, root, Context(parameters=parameters, directory=directory), report)
    check_axes(root, parameters, report)
    if entry is None or report.problems:
        raise report.error()
    source = SourceFile(name=Path(file).name, path=file, text=text, sha256=hashlib.sha256(data).hexdigest())
    return _to_axes(entry, _without_table(entry, root, source))


def _without_table(entry: AxesEntry, root: Node, source: SourceFile) -> RobotSpec:
    """Return a robot of rows without numbers: it has all that an axes file shares with a robot file, in SI units."""
    rows = [
        JointEntry.model_construct(
            name=axis.name,
            type=JointType(axis.type),
            limits=axis.limits,
            dynamics=axis.dynamics,
            actuator=axis.actuator,
        )
        for axis in entry.axes
    ]
    robot = RobotEntry.model_construct(
        name=entry.name,
        description=entry.description,
        source=entry.source,
        convention=Convention(entry.convention or Convention.STANDARD),
        units=entry.units,
        parameters=entry.parameters,
        gravity=entry.gravity,
        joints=rows,
        configurations=entry.configurations,
        actuators=entry.actuators,
    )
    return to_spec(robot, root, source)


def _to_axes(entry: AxesEntry, robot: RobotSpec) -> AxesSpec:
    units = Units(angle=entry.units.angle, length=entry.units.length)
    joints = tuple(
        AxisJoint(
            name=row.name,
            type=row.type,
            direction=_unit(axis.direction),
            point=None if axis.point is None else _lengths(axis.point, units),
            limits=row.limits,
            dynamics=row.dynamics,
            actuator=row.actuator,
        )
        for axis, row in zip(entry.axes, robot.rows, strict=True)
    )
    return AxesSpec(
        name=robot.name,
        joints=joints,
        description=robot.description,
        source=robot.source,
        convention=None if entry.convention is None else robot.convention,
        tool=_tool(entry, units),
        gravity=robot.gravity,
        configurations=robot.configurations,
        source_file=robot.source_file,
    )


def _tool(entry: AxesEntry, units: Units) -> Pose:
    """Return the tool's pose, its position by default a point of the last axis."""
    xyz = entry.tool.xyz or entry.axes[-1].point or (0.0, 0.0, 0.0)
    return Pose(xyz=_lengths(xyz, units), rpy=read_only([units.radians(angle) for angle in entry.tool.rpy]))


def _lengths(values: Sequence[float], units: Units) -> Array:
    return read_only([units.metres(value) for value in values])


def _unit(direction: Sequence[float]) -> Array:
    """Return a vector of length 1; scaled first, so that no square is too large or too small."""
    vector = np.array(direction) / np.abs(direction).max()
    return read_only(vector / np.linalg.norm(vector))
