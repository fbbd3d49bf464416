"""Which parameters are to be fitted, and what is known of them beforehand, by name."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from dh2sim.calibrate.fit import Prior
from dh2sim.calibrate.observations import Observations
from dh2sim.calibrate.parameters import Group, RobotParameters
from dh2sim.errors import CalibrationError
from dh2sim.messages import did_you_mean, listed, shown


def requested_columns(robot: RobotParameters, unknown: Iterable[str] | None) -> set[int]:
    """Return the columns that are to be fitted.

    Raises:
        CalibrationError: A name is unknown.
    """
    if unknown is None:
        return set(range(len(robot.parameters)))
    found: set[int] = set()
    rows = [row.name for row in robot.spec.rows]
    names = {parameter.name: k for k, parameter in enumerate(robot.parameters)}
    for word in unknown:
        if word in (group.value for group in Group):
            found |= {k for k, parameter in enumerate(robot.parameters) if parameter.group == word}
        elif word in rows:
            found |= {k for k, parameter in enumerate(robot.parameters) if parameter.row == rows.index(word)}
        elif word in names:
            found.add(names[word])
        else:
            known = [*(group.value for group in Group), *rows, *names]
            raise CalibrationError(
                f"unknown parameter {shown(word)}.{did_you_mean(word, known)} Known: {listed(Group)}; the name of a "
                f"row; of a row and a column, such as {rows[0]}.theta; base.x, tool.rz and their like"
            )
    if not found:
        raise CalibrationError("nothing is to be fitted")
    return found


def prior_of(
    robot: RobotParameters, given: Mapping[str, float], free: set[int], observations: Observations
) -> Prior | None:
    """Return the prior on parameters.

    Raises:
        CalibrationError: A name is unknown, or a standard deviation is not positive.
    """
    if not given:
        return None
    sigma: dict[int, float] = {}
    for word, value in given.items():
        if not (math.isfinite(value) and value > 0.0):
            raise CalibrationError(f"prior of {word} must be a positive number, got {value!r}")
        if word in ("length", "angle"):
            columns = {
                k
                for k, parameter in enumerate(robot.parameters)
                if parameter.row >= 0 and parameter.is_angle == (word == "angle")
            }
        else:
            columns = requested_columns(robot, [word])
        sigma |= dict.fromkeys(columns & free, value)
    columns_sorted = sorted(sigma)
    return Prior(
        columns=np.array(columns_sorted, dtype=np.intp),
        sigma=np.array([sigma[k] for k in columns_sorted]),
        target=observations.start(robot.start),
    )
