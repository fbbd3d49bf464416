"""How a trajectory is planned: the keywords that are taken, and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, TypedDict, get_args

from dh2sim.errors import SettingsError
from dh2sim.inverse.goals import Free
from dh2sim.messages import did_you_mean, listed
from dh2sim.trajectory.limits import LimitValue
from dh2sim.trajectory.profiles import Profile
from dh2sim.trajectory.waypoints import MoveKind


class TrajectoryKeywords(TypedDict, total=False):
    """How a trajectory is planned; each keyword may be left out."""

    kind: str
    profile: str
    duration: float | None
    limits: Mapping[str, Any] | None
    through: bool
    free: Free | None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrajectoryOptions:
    """How a trajectory is planned, checked; see :func:`dh2sim.plan_trajectory`."""

    kind: MoveKind = MoveKind.JOINT
    profile: Profile = Profile.QUINTIC
    duration: float | None = None
    limits: Mapping[str, LimitValue] = field(default_factory=dict)
    through: bool = False
    free: Free | None = None

    @classmethod
    def of(cls, given: TrajectoryKeywords) -> TrajectoryOptions:
        """Check options.

        Raises:
            SettingsError: Some are wrong; the error holds all of them.
        """
        problems: list[tuple[str, str]] = []
        known = TrajectoryKeywords.__annotations__
        problems += [(name, f"is not an option.{did_you_mean(name, known)}") for name in given if name not in known]
        values: dict[str, Any] = {name: value for name, value in given.items() if value is not None and name in known}
        kinds: tuple[tuple[str, type[StrEnum]], ...] = (("kind", MoveKind), ("profile", Profile))
        for name, words in kinds:
            if name in values:
                try:
                    values[name] = words(values[name])
                except ValueError:
                    guess = did_you_mean(str(values[name]), words)
                    problems.append(
                        (name, f"must be one of {listed(words)}, got {values[name]!r}.{guess}".rstrip("."))
                    )
        if values.get("free") not in (None, *get_args(Free)):
            problems.append(("free", f"must be one of {listed(get_args(Free))}, got {values['free']!r}"))
        duration = values.get("duration")
        if duration is not None:
            number = isinstance(duration, int | float) and not isinstance(duration, bool)
            if not number or not (math.isfinite(duration) and duration > 0.0):
                problems.append(("duration", f"must be a finite time above 0 s, got {duration!r}"))
        if problems:
            raise SettingsError(problems)
        return cls(**values)
