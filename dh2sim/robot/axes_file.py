"""Axes files: joint axes of a serial robot, to which frames are yet to be assigned."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final

import numpy as np

from dh2sim.errors import ImportedFileError
from dh2sim.messages import Loc, closest
from dh2sim.robot.checks import check_actuators, check_configurations, check_names, check_type, placed_rows
from dh2sim.robot.fields import (
    LENGTHS,
    WRONG,
    Choice,
    Configurations,
    Name,
    Numbers,
    Parameters,
    Scope,
    Text,
    Tree,
    UnitsLike,
)
from dh2sim.robot.links import Pose
from dh2sim.robot.parts import Internal, Part, Parts
from dh2sim.robot.read import read_tree, units_of
from dh2sim.robot.row import (
    CONVENTIONS,
    JOINT_LETTERS,
    ActuatorSpec,
    Convention,
    Dynamics,
    JointType,
    Limits,
    filled_in,
)
from dh2sim.robot.spec import GRAVITY, SourceFile, joint_vectors
from dh2sim.robot.units import Units
from dh2sim.robot.yaml_tree import Report
from dh2sim.typing import Array, read_only


class Direction(Numbers):
    """A vector of any length but 0, which becomes a unit vector."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return the vector as given."""
        vector = Numbers.check(self, value, loc, scope)
        if vector is WRONG or any(vector):  # NaN counts as something: it has been reported
            return vector
        return scope.wrong(loc, "the direction is of length 0; any other vector along the axis is allowed")

    def to_si(self, value: Any, units: UnitsLike, *, turns: bool) -> Array:  # noqa: ARG002
        """Return it with length 1; scaled first, so that no square is too large or too small."""
        vector = np.array(value) / np.abs(value).max()
        return read_only(vector / np.linalg.norm(vector))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxisJoint:
    """A joint, and its axis in base_link at joint coordinates zero."""

    name: Annotated[str, Name("Default joint_<i>, counted from 1.")]
    type: Annotated[
        JointType,
        Choice("How the joint moves.", JointType, without=("fixed",), short=JOINT_LETTERS, required=True),
    ]
    point: Annotated[Array | None, Numbers("A point of the axis; a prismatic joint needs none.", LENGTHS)] = None
    """m, shape (3,); None only for a prismatic joint, whose axis may be put anywhere."""
    direction: Annotated[Array, Direction("Along the axis, of any length.", required=True)]
    """Unit vector, shape (3,): the positive coordinate turns about it, or slides along it."""
    limits: Annotated[Limits, Part("", Limits, list_is="position")] = field(default_factory=Limits)
    dynamics: Annotated[Dynamics, Part("", Dynamics)] = field(default_factory=Dynamics)
    actuator: Annotated[ActuatorSpec, Part("", ActuatorSpec)] = field(default_factory=ActuatorSpec)


class Axis(Part):
    """An entry of the axes."""

    def check(self, value: object, loc: Loc, scope: Scope) -> Any:
        """Return its tree; a turning joint has a point that its axis goes through."""
        tree = Part.check(self, value, loc, scope)
        if tree is WRONG or not isinstance(value, dict) or "point" in tree:
            return tree
        kind = tree.get("type")
        if isinstance(kind, JointType) and kind.turns and all(closest(key, self.keys) != "point" for key in value):
            message = f"missing key 'point': a {kind} joint needs a point of its axis; only a prismatic one does not"
            scope.report(loc, message)
        return tree


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxesSpec:
    """A serial robot as an axes file describes it; every number is finite and in SI units."""

    name: Annotated[str, Name("Name of the robot.", required=True)]
    description: Annotated[str, Text("What the robot is.")] = ""
    source: Annotated[str, Text("Where the numbers come from.")] = ""
    convention: Annotated[
        Convention | None,
        Choice(
            "Convention of the table to make.",
            Convention,
            without=("hayati",),
            other_names=CONVENTIONS,
        ),
    ] = None
    units: Annotated[Units, Part("Units of this file.", Units)] = field(default_factory=Units)
    """Of the file; everything else here is in SI units."""
    parameters: Annotated[Mapping[str, float], Parameters("Named constants for expressions.")] = field(
        default_factory=lambda: MappingProxyType({})
    )
    joints: Annotated[
        tuple[AxisJoint, ...], Parts("The joint axes, base first.", Axis("", AxisJoint), required=True, key="axes")
    ]
    """Base first; at least one."""
    tool: Annotated[Pose, Part("Its position is by default a point of the last axis.", Pose)] = field(
        default_factory=Pose
    )
    """Pose of tool0 in base_link at joint coordinates zero."""
    gravity: Annotated[Array, Numbers("m/s² in base_link.", GRAVITY)] = field(
        default_factory=lambda: read_only([0, 0, -9.81])
    )
    configurations: Annotated[Mapping[str, Array], Configurations("Named joint vectors.")] = field(
        default_factory=lambda: MappingProxyType({})
    )
    """Each of shape (number of joints,)."""
    source_file: Annotated[SourceFile | None, Internal("", SourceFile)] = None
    """None for axes made in code."""


_AXES: Final = Part("", AxesSpec, more={"actuators": Part("What drives every joint.", ActuatorSpec)})


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
    needs = "axes need at least name and axes"
    tree, _ = read_tree(_AXES, _check, data, _AxesReport(file), directory, needs=needs)
    units = units_of(tree)
    joints = filled_in(tree["axes"], tree)
    point = joints[-1].get("point")
    tool = {**({} if point is None else {"xyz": point}), **tree.get("tool", {})}
    fields = _AXES.fields({**tree, "axes": joints, "tool": tool}, units)
    return AxesSpec(**{**fields, "configurations": joint_vectors(tree, joints, units)})


def _check(tree: Tree, scope: Scope) -> None:
    """Report what does not go together in an axes file."""
    axes = placed_rows(tree, "axes")
    check_names(axes, scope)
    for placed in axes:
        check_type(placed.row, placed.loc, scope)
    check_configurations(tree, axes, scope, each="axis")
    check_actuators(tree, axes, scope)
