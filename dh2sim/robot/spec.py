"""What a robot file says, in SI units (m, rad, kg, N, N·m): the one description of a robot's fields.

Its parts are in ``row``, ``links`` and ``mechanism``. Each field is annotated with its kind (``fields``): what it
means, its unit in files and what is allowed. A ``RobotSpec`` checks itself and all its parts when it is made, from a
file or in code; parts are checked as part of a robot.
"""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final, Protocol, TypeAlias

import numpy as np

from dh2sim.errors import ArgumentError, ConfigurationError, Problem, RobotError
from dh2sim.messages import Loc, did_you_mean, listed, path_of, shown
from dh2sim.robot.checks import check
from dh2sim.robot.fields import (
    Choice,
    Configurations,
    Dimension,
    Name,
    Number,
    Numbers,
    Parameters,
    Scope,
    Text,
    Texts,
    Tree,
    UnitsLike,
)
from dh2sim.robot.links import BaseSpec, PayloadSpec, ToolSpec
from dh2sim.robot.magnitudes import ACCELERATION
from dh2sim.robot.mechanism import AssemblySpec, BranchSpec, ClosureSpec
from dh2sim.robot.mechanism_checks import check_mechanism, default_closure_name
from dh2sim.robot.parts import Internal, NamedParts, Part, Parts, kept, plain_part
from dh2sim.robot.row import CONVENTIONS, ActuatorSpec, Convention, Row, filled_in
from dh2sim.robot.units import Units
from dh2sim.typing import Array, read_only

GRAVITY: Final = Number("", size=ACCELERATION)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SourceFile:
    """The text a robot was read from."""

    name: str
    """Name of the file, without its folder."""
    path: str
    """The file as the user named it, for messages."""
    text: str = field(repr=False)
    sha256: str
    """Hexadecimal SHA-256 of the file's bytes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotSpec:
    """A robot described by its Denavit-Hartenberg table.

    Strings are taken where an enumeration is meant, and any real numbers and sequences of them; the spec that is
    made holds enumerations, floats and read-only arrays.

    Raises:
        RobotError: Something is wrong; the error holds everything that is, with its path as in a robot file.
    """

    name: Annotated[str, Name("Name of the robot; names the exported files.", required=True)]
    description: Annotated[str, Text("What the robot is.")] = ""
    source: Annotated[str, Text("Where the numbers come from.")] = ""
    convention: Annotated[
        Convention,
        Choice(
            "standard: Rz(theta) Tz(d) Tx(a) Rx(alpha); modified: Tx(a) Rx(alpha) Rz(theta) Tz(d); "
            "hayati: Rz(theta) Tx(a) Rx(alpha) Ry(beta).",
            Convention,
            other_names=CONVENTIONS,
            required=True,
        ),
    ] = Convention.STANDARD
    """Of rows that name none."""
    units: Annotated[Units, Part("Units of this file; default rad and m.", Units)] = field(default_factory=Units)
    """Of the file that the robot was read from, and of its parameters; everything else here is in SI units."""
    parameters: Annotated[
        Mapping[str, float], Parameters("Named constants for expressions, in the file's units.")
    ] = field(default_factory=lambda: MappingProxyType({}))
    """Evaluated."""
    base: Annotated[BaseSpec, Part("DH frame 0 in base_link.", BaseSpec)] = field(default_factory=BaseSpec)
    tool: Annotated[ToolSpec, Part("tool0 in DH frame n, and the tool.", ToolSpec)] = field(default_factory=ToolSpec)
    payload: Annotated[
        PayloadSpec,
        Part(
            "Nominal payload, which assumed efforts and gains hold; a number is its mass, kg.",
            PayloadSpec,
            number_is="mass",
        ),
    ] = field(default_factory=PayloadSpec)
    gravity: Annotated[Array, Numbers("m/s² in base_link.", GRAVITY)] = field(
        default_factory=lambda: read_only([0, 0, -9.81])
    )
    rows: Annotated[
        tuple[Row, ...],
        Parts("The DH table, a row each, base first.", Part("", Row), required=True, key="joints"),
    ]
    configurations: Annotated[
        Mapping[str, Array],
        Configurations("Named joint vectors, a number for each moving row, in the file's units."),
    ] = field(default_factory=lambda: MappingProxyType({}))
    """Each of shape (number of moving rows,)."""
    branches: Annotated[
        Mapping[str, BranchSpec],
        NamedParts("Further chains by name, each from a frame of those before it.", Part("", BranchSpec)),
    ] = field(default_factory=lambda: MappingProxyType({}))
    closures: Annotated[
        tuple[ClosureSpec, ...],
        Parts("Joints that close loops: frames that must coincide.", Part("", ClosureSpec), may_be_empty=True),
    ] = ()
    actuated: Annotated[
        tuple[str, ...] | None,
        Texts("Names of the joints that are driven; the others are passive. Default all.", of="joint names"),
    ] = None
    assembly: Annotated[AssemblySpec | None, Part("How the loops are assembled.", AssemblySpec)] = None
    source_file: Annotated[SourceFile | None, Internal("", SourceFile)] = None
    """None for a robot made in code."""

    def __repr__(self) -> str:
        conventions = " and ".join(dict.fromkeys(row.convention.value for row in self.all_rows))
        return f"<RobotSpec '{self.name}': {len(self.all_rows)} rows, {conventions}>"

    def __post_init__(self) -> None:
        """Check the robot and fill in what is left out."""
        problems = _Problems()
        scope = Scope(report=problems, parameters=None, directory=Path())
        tree = ROBOT.check({"convention": Convention.STANDARD.value, **plain_part(self)}, (), scope)
        check_robot(tree, scope)
        if problems.found:
            raise RobotError(problems.found)
        for name, value in robot_fields(tree, Units()).items():
            object.__setattr__(self, name, kept(getattr(self, name), value))

    def __reduce__(self) -> tuple[Any, ...]:
        """Let a robot be pickled and copied: read-only mappings cannot be."""
        given = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        plain = {name: dict(value) if isinstance(value, Mapping) else value for name, value in given.items()}
        return _restored, (plain,)

    @property
    def all_rows(self) -> tuple[Row, ...]:
        """The rows of the main chain, then those of the branches."""
        return (*self.rows, *(row for branch in self.branches.values() for row in branch.rows))

    @property
    def moving_rows(self) -> tuple[Row, ...]:
        """The rows that have a joint coordinate, in the order of a joint vector: main chain first, then branches."""
        return tuple(row for row in self.all_rows if row.type.moves)

    @property
    def is_mechanism(self) -> bool:
        """Whether there is more than one serial chain."""
        return bool(self.branches or self.closures)

    @property
    def named_configurations(self) -> Mapping[str, Array]:
        """Home and zero, which every serial robot has, and those of the robot file: rad and m, each of shape (n,).

        Where the file has no ``home``, it is the assembly, or zero moved inside the limits. Where there are loops,
        these are what they are closed from, and there is no zero but the file's.
        """
        limits = [row.limits.position or (0.0, 0.0) for row in self.moving_rows]
        home = read_only([min(max(0.0, lower), upper) for lower, upper in limits])
        if self.closures:
            return MappingProxyType(
                {"home": home if self.assembly is None else self.assembly.q, **self.configurations}
            )
        return MappingProxyType({"home": home, "zero": read_only([0.0] * len(limits)), **self.configurations})

    def configuration(self, name: str) -> Array:
        """Return one of ``named_configurations``, rad and m, shape (n,).

        Raises:
            ConfigurationError: There is none of that name.
        """
        known = self.named_configurations
        if name not in known:
            raise ConfigurationError(
                f"{self.name} has no configuration {shown(name)}.{did_you_mean(name, known)} "
                f"Configurations: {listed(known)}"
            )
        return known[name]


class HasSpec(Protocol):
    """A robot in a larger form, such as a ``Robot`` or a ``RobotModel``."""

    @property
    def spec(self) -> RobotSpec:
        """The robot as its file describes it."""
        ...


SpecLike: TypeAlias = RobotSpec | HasSpec


def spec_of(robot: SpecLike) -> RobotSpec:
    """Return the specification of a robot, whatever form it is given in.

    Raises:
        ArgumentError: It is not a robot.
    """
    spec = robot if isinstance(robot, RobotSpec) else getattr(robot, "spec", None)
    if not isinstance(spec, RobotSpec):
        raise not_a_robot(robot, "a Robot or a RobotSpec")
    return spec


def not_a_robot(value: object, expected: str) -> ArgumentError:
    """Return the error of a value that is not the robot that a function takes."""
    if isinstance(value, str | os.PathLike):
        found = f"{value!r}; Robot.load reads a file, or a robot that comes with dh2sim"
    else:
        found = "None" if value is None else type(value).__name__
    return ArgumentError(f"expected {expected}, got {found}")


ROBOT: Final = Part("", RobotSpec, more={"actuators": Part("What drives every joint.", ActuatorSpec)})
"""The robot file as a whole."""


def robot_of_checked(given: Mapping[str, Any]) -> RobotSpec:
    """Return the robot of fields that ``robot_fields`` made of a tree without problems, without another check."""
    robot = object.__new__(RobotSpec)
    for each in dataclasses.fields(RobotSpec):
        if each.name in given or each.default is not dataclasses.MISSING:
            value = given.get(each.name, each.default)
            value = MappingProxyType(value) if isinstance(value, dict) else value
        else:
            assert each.default_factory is not dataclasses.MISSING
            value = each.default_factory()
        object.__setattr__(robot, each.name, value)
    return robot


def _restored(given: Mapping[str, Any]) -> RobotSpec:
    """Return a robot that was pickled; numpy lets arrays be written to then."""
    robot = robot_of_checked(given)
    _freeze(robot)
    return robot


def _freeze(value: object) -> None:
    """Make all arrays of a robot, or of a part of it, read-only."""
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    elif isinstance(value, Mapping | tuple):
        for inner in value.values() if isinstance(value, Mapping) else value:
            _freeze(inner)
    elif dataclasses.is_dataclass(value):
        for each in dataclasses.fields(value):
            _freeze(getattr(value, each.name))


class _Problems:
    """Takes the problems of a robot made in code."""

    def __init__(self) -> None:
        self.found: list[Problem] = []

    def __call__(self, loc: Loc, message: str, *, at_key: bool = False, path: Loc | None = None) -> None:  # noqa: ARG002
        self.found.append(Problem(path=path_of(loc if path is None else path), message=message))

    def line(self, *locs: Loc) -> str:  # noqa: ARG002
        return ""


def check_robot(tree: Tree, scope: Scope) -> None:
    """Report what does not go together in a robot."""
    check(tree, scope)
    check_mechanism(tree, scope)


def robot_fields(tree: Tree, units: UnitsLike) -> dict[str, Any]:
    """Return the fields of the robot that a checked tree describes: what is left out is filled in.

    Args:
        tree: Without anything wrong.
        units: That its values are in.
    """
    rows = filled_in(tree["joints"], tree)
    branches = {
        name: {**branch, "joints": filled_in(branch["joints"], tree, name)}
        for name, branch in tree.get("branches", {}).items()
    }
    closures = [
        {"name": default_closure_name(index), **closure} for index, closure in enumerate(tree.get("closures", ()))
    ]
    whole = {**tree, "joints": rows, "branches": branches, "closures": closures}
    fields = ROBOT.fields(whole, units)
    every = [*rows, *(row for branch in branches.values() for row in branch["joints"])]
    fields["configurations"] = joint_vectors(tree, every, units)
    if "assembly" in tree:
        q = joint_vector_si(tree["assembly"]["q"], every, units)
        fields["assembly"] = AssemblySpec(q=q, location=tree["assembly"].get("location", ""))
    return fields


def joint_vectors(robot: Tree, rows: Sequence[Tree], units: UnitsLike) -> Mapping[str, Array]:
    """Return the configurations of a checked tree in SI units."""
    vectors = robot.get("configurations", {})
    return MappingProxyType({name: joint_vector_si(vector, rows, units) for name, vector in vectors.items()})


def joint_vector_si(vector: Sequence[float], rows: Sequence[Tree], units: UnitsLike) -> Array:
    """Return a joint vector of a checked tree in SI units."""
    turns = [row["type"].turns for row in rows if row["type"].moves]
    pairs = zip(vector, turns, strict=True)
    return read_only([units.to_si(value, Dimension.COORDINATE, turns=turn) for value, turn in pairs])
