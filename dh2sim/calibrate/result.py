"""What comes out of a calibration: the robot, and how well measurements tell each of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from dh2sim.calibrate.fit import Fit
from dh2sim.calibrate.held_out import Errors, HeldOut
from dh2sim.calibrate.measurements import Measurements
from dh2sim.calibrate.outliers import Outlier, chi2_spread
from dh2sim.calibrate.parameters import Group
from dh2sim.robot.spec import RobotSpec


class ParameterStatus(StrEnum):
    """What became of a parameter."""

    FITTED = "fitted"
    FOLDED = "folded"
    """Other parameters do the same; it stays as it was."""
    UNSEEN = "unseen"
    """It does nothing to what was measured; it stays as it was."""
    HELD = "held"
    """It was not to change, or is left to what takes its place."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterResult:
    """A parameter of the robot and what came out."""

    name: str
    group: Group
    is_angle: bool
    status: ParameterStatus
    nominal: float | None
    """rad or m; None of a component of a pose, whose change counts."""
    value: float | None
    change: float
    """rad or m."""
    sigma: float | None
    """Standard deviation of what was fitted, rad or m."""
    into: tuple[str, ...] = ()
    """What it folds into."""
    reason: str = ""
    """Why it was held."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """A calibrated robot, and how well measurements tell it."""

    robot: RobotSpec
    """With the fitted numbers; a robot like any other."""
    nominal: RobotSpec
    """The same table before: rows between nearly parallel axes are Hayati's already."""
    original: RobotSpec
    """As it was given."""
    measured: Measurements
    parameters: tuple[ParameterResult, ...]
    fit: Fit
    before: Fit
    """With the table as it was; base, tool and what belongs to the measurement alone were fitted."""
    errors_before: Errors
    errors: Errors
    identifiable: int
    """Of the robot's parameters, how many the measurements determine by themselves."""
    possible: int
    """How many any measurements of this kind could determine of those that were asked for."""
    outliers: tuple[Outlier, ...]
    held_out: HeldOut | None
    predicted: Errors
    """Of the tool at random configurations, by the covariance."""
    moved: Errors
    """How far the fit moved the tool there, as compared to the table as it was with base and tool fitted."""
    notes: tuple[str, ...]
    robust: bool = False
    prior: Mapping[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        error = f"{1e3 * self.errors_before.length:.3g} mm to {1e3 * self.errors.length:.3g} mm"
        return f"<Calibration of '{self.robot.name}': {self.identifiable} parameters fitted, rms {error}>"

    @property
    def chi2_spread(self) -> float:
        """Standard deviation of chi-squared per degree of freedom, where all is well."""
        return chi2_spread(self.fit.dof)
