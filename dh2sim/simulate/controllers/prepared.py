"""What a controller class may say of itself before it drives anything, where its attributes do not suffice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.protocol import Controller, Lanes


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """What the static method ``prepare`` of a controller class returns, given the options.

    A class has one if it reads files: their digest is a part of what a run is, and what they hold may decide how the
    robot is driven.
    """

    make: Callable[[Lanes], Controller] = field(repr=False)
    """Makes the controller of a group of rollouts."""
    actuation: ActuatorType | str | None = None
    """As the class attribute."""
    digest: str = ""
    """Hexadecimal SHA-256 of the files that were read."""
    follows: bool = False
    """Whether the controller has a ``reference``."""
