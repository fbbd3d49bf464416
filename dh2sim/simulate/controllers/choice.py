"""Which controller a run uses, and with which options."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.protocol import Controller, Lanes


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerChoice:
    """A controller by name, with its options checked."""

    text: str
    """As on the command line, ``NAME`` or ``NAME:key=value,…``: all options that were given, in a fixed order."""
    name: str
    make: Callable[[Lanes], Controller] = field(compare=False, repr=False)
    """Makes the controller of a group of rollouts, options already bound."""
    actuation: ActuatorType | None
    """The actuators that the model is simulated with, one at every joint (none: no actuators at all); None: those of
    the robot file."""
    options: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}), compare=False)
    digest: str = ""
    """SHA-256 of what the options do not show: files that the controller reads, code that is not dh2sim's own."""
    follows: bool = False
    """Whether it follows a reference, which can be recorded."""
