"""What came out of an import, whatever the format."""

from __future__ import annotations

from dataclasses import dataclass, field

from dh2sim.kinematics.assignment.findings import Assignment
from dh2sim.kinematics.assignment.residual import Residual
from dh2sim.kinematics.serial import SerialChain
from dh2sim.robot.spec import RobotSpec


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Imported:
    """A robot file, and how it came about."""

    text: str = field(repr=False)
    """The robot file."""
    spec: RobotSpec
    """The robot, read back from the text."""
    notes: tuple[str, ...]
    """What was chosen, changed or left out, a sentence each."""
    residual: Residual | None = None
    """Measured on the text; None where there is no other kinematics to compare with."""
    chain: SerialChain | None = field(default=None, repr=False)
    """The source's own kinematics."""
    assignment: Assignment | None = field(default=None, repr=False)
    """How the frames were assigned."""
