"""The rows that a robot is made of in code: ``Revolute``, ``Continuous``, ``Prismatic``, ``Fixed``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields
from functools import wraps
from typing import ClassVar

from dh2sim.errors import Problem, RobotError
from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.row import ActuatorSpec, Convention, Dynamics, JointType, Limits, Row


@dataclass(frozen=True, kw_only=True, eq=False)
class TableRow:
    """A row of the DH table of a robot made in code: lengths in m, angles in rad, everything else SI."""

    type: ClassVar[JointType]

    name: str | None = None
    """By default ``joint_<i>``, counted from 1."""
    a: float = 0.0
    alpha: float = 0.0
    d: float = 0.0
    theta: float = 0.0
    beta: float = 0.0
    """Second twist; of a Hayati row only."""
    flip: bool = False
    """True: the joint coordinate subtracts instead."""
    limits: Sequence[float] | Limits | None = None
    """Lower and upper joint coordinate, rad or m; or :class:`Limits`, which hold velocity and effort too."""
    dynamics: Dynamics = field(default_factory=Dynamics)
    link: LinkSpec = field(default_factory=LinkSpec)
    """Mass, inertia and looks of the link that the joint moves."""
    actuator: ActuatorSpec = field(default_factory=ActuatorSpec)
    """What drives the joint; by default position control with gains that dh2sim chooses."""
    convention: Convention | str | None = None
    """By default the robot's."""


def _reporting_arguments(init: Callable[..., None]) -> Callable[..., None]:
    """Let ``__init__`` of a row report wrong arguments under the row's own name, and show the ones it has."""

    @wraps(init)
    def checked(self: TableRow, *unnamed: object, **values: object) -> None:
        row, names = type(self).__name__, [argument.name for argument in fields(TableRow)]
        if unnamed:
            raise TypeError(f"{row} takes named arguments only, as in {row}(d=0.4, alpha=-pi / 2)")
        for name in values:
            if name not in names:
                raise TypeError(
                    f"{row} has no argument '{name}'.{did_you_mean(name, names)} Arguments: {listed(names)}"
                )
        init(self, **values)

    return checked


TableRow.__init__ = _reporting_arguments(TableRow.__init__)  # type: ignore[method-assign]


class Revolute(TableRow):
    """A row whose joint coordinate adds to theta."""

    type = JointType.REVOLUTE


class Continuous(TableRow):
    """A row whose joint coordinate adds to theta, without position limits."""

    type = JointType.CONTINUOUS


class Prismatic(TableRow):
    """A row whose joint coordinate adds to d."""

    type = JointType.PRISMATIC


class Fixed(TableRow):
    """A row that does not move."""

    type = JointType.FIXED


def spec_rows(rows: object) -> object:
    """Return rows as a specification holds them; what is wrong with them is for the specification to say.

    Raises:
        RobotError: A text is given.
    """
    if isinstance(rows, str):
        message = f"expected a list of rows, found {shown(rows)}; Robot.load reads a robot file"
        raise RobotError([Problem(path="joints", message=message)])
    return [_spec_row(row) for row in rows] if isinstance(rows, Iterable) else rows


def _spec_row(row: object) -> object:
    if not isinstance(row, TableRow):
        return row
    given = {field.name: getattr(row, field.name) for field in fields(row)}
    return Row(type=row.type, **{**given, "limits": Limits() if row.limits is None else row.limits})
