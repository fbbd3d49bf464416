"""Whether a calibration makes sense: measurements and fits that are refused, and remarks on those that are not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import Final

import numpy as np

from dh2sim.calibrate.fit import Fit
from dh2sim.calibrate.held_out import errors_of
from dh2sim.calibrate.identify import find_basis
from dh2sim.calibrate.measurements import Kind, Measurements
from dh2sim.calibrate.observations import Observations
from dh2sim.calibrate.outliers import Outlier, chi2_spread
from dh2sim.calibrate.parameters import Group, RobotParameters, Values
from dh2sim.errors import CalibrationError
from dh2sim.messages import counted, listed
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

_USELESS: Final = 3.0
"""Times the error before it, by which a table may be worse known than it is corrected."""
_FAR: Final = 0.1
"""m, by which a base has been moved that is not only corrected."""
_VAGUE: Final = 3e-3
"""m or rad: a standard deviation that is greater than errors of most robots."""
_UNITS: Final = {"mm": 1e-3, "cm": 1e-2, "inches": 0.0254}
_SPREAD: Final = 0.01
"""m, over which the tool must move for a unit to show."""
_GROWTH: Final = 2.0
"""Times the size of its table, that no arm is built off."""
_COARSE: Final = 0.05
"""Of the arm's size, that no measurement is as uncertain as."""
_TWISTED: Final = 0.2
"""rad."""
_MOST_NAMED: Final = 6
"""Parameters in a message."""
_ADVICE: Final = (
    "Measure more, at configurations that are spread over the limits, fit fewer parameters (unknown), or say how far "
    "off they may be (prior)."
)


def require_metres(robot: RobotParameters, measured: Measurements) -> None:
    """Check that positions are not spread as many times wider than the table's as a unit is.

    Raises:
        CalibrationError: They are.
    """
    if measured.kind not in (Kind.POSE, Kind.POSITION) or measured.position is None:
        return
    _, p = robot.tool_poses(robot.start, measured.q)
    expected, found = (float(np.sqrt(np.var(points, axis=0).sum())) for points in (p, measured.position))
    for unit, size in _UNITS.items():
        for times, given, meant in ((1.0 / size, unit, "m"), (size, "m", unit)):
            if abs(found - times * expected) < 0.1 * times * expected and expected > _SPREAD:
                raise CalibrationError(
                    f"{described(measured)}: positions are spread over {found:.3g} m, where the table says "
                    f"{expected:.3g} m: they look like {given} taken for {meant}"
                )


def require_enough(observations: Observations, J: Array, columns: Sequence[int], could: AbstractSet[int]) -> None:
    """Check that measurements determine the parameters that others of their kind could.

    Args:
        observations: The measurements.
        J: Derivatives of their equations, in standard deviations, shape (E, U).
        columns: Unknowns that are fitted.
        could: Parameters that as many measurements could determine, at configurations all over the limits.

    Raises:
        CalibrationError: They do not.
    """
    measured, parameters = observations.measured, observations.robot.parameters
    robot = len(parameters)
    basis = find_basis(J, observations.unknowns, columns)
    mine = {k for k in basis.kept if k < robot}
    count = f"{len(could)} parameters of the robot" + (
        f" and {len(observations.unknowns) - robot} of the measurement" if len(observations.unknowns) > robot else ""
    )
    if len(J) < len(could) + len(basis.kept) - len(mine):
        raise CalibrationError(
            f"{described(measured)} cannot fix {count}: they are only {counted(len(J), 'equation')}. {_ADVICE}"
        )
    if len(mine) >= len(could):
        return
    missing = [parameters[k].name for k in sorted(could - mine)]
    still = _still_joints(observations.robot.spec, measured.q)
    if len(still) == observations.robot.n:
        why = " No joint moves."
    else:
        why = f" {listed(still)} {'does' if len(still) == 1 else 'do'} not move." if still else ""
    raise CalibrationError(
        f"{described(measured)} cannot fix {count}: they determine only {len(mine)} of them, not "
        f"{_some(missing)}.{why} {_ADVICE}"
    )


def require_size(whole: Fit, q: Array) -> None:
    """Check that the fitted arm is about as large as its table says, and fits the measurements as such an arm does.

    Args:
        whole: The fit of everything.
        q: Random joint vectors, shape (N, n).

    Raises:
        CalibrationError: It is, or does, not.
    """
    measured, robot = whole.observations.measured, whole.observations.robot
    start = robot.start
    extent = _extent(robot, start, q, tool=False)
    found = _extent(robot, whole.state.values, q, tool=False)  # a tool may be any other than the table's
    size = max(extent, _extent(robot, start, q, tool=True))
    if size > _SPREAD and not (1.0 / _GROWTH - 1.0) * size < found - extent < (_GROWTH - 1.0) * size:
        raise CalibrationError(
            f"{described(measured)}: they would make the arm {found / max(extent, 1e-12):.4g} times as large as "
            "its table says: lengths are in another unit, or the robot is not the one that was measured"
        )
    if size > _SPREAD and whole.sigma.length > _COARSE * size and not whole.sigma.length_known:
        raise CalibrationError(
            f"{described(measured)}: what is left is {1e3 * whole.sigma.length:.3g} mm a component, of an arm "
            f"that gets around by {1e3 * size:.3g} mm: columns or rows are exchanged, a sign is wrong, or the "
            "robot is not the one that was measured"
        )


def require_improvement(before: Fit, whole: Fit, known: float) -> None:
    """Check that the tool is known better by a fit than by the table as it was.

    Args:
        before: The fit of base and tool alone.
        whole: The fit of everything.
        known: Standard deviation of the tool's position inside the limits, by the latter, m.

    Raises:
        CalibrationError: It is not.
    """
    measured = whole.observations.measured
    was = errors_of(before.observations, before.state).length
    if known > _USELESS * max(was, 3.0 * whole.sigma.length):
        parameters = len(whole.observations.robot.parameters)
        count = counted(sum(k < parameters for k in whole.basis.kept), "parameter")
        raise CalibrationError(
            f"{described(measured)} cannot fix {count}: the tool would be known to {1e3 * known:.3g} mm inside "
            f"the limits, and is {1e3 * was:.3g} mm off as it is. {_ADVICE}"
        )


def remarks(whole: Fit, outliers: Sequence[Outlier], *, robust: bool) -> list[str]:
    """Return what speaks against a fit, or is to be known when it is used, in sentences.

    Args:
        whole: The fit of everything.
        outliers: Rows that are far off.
        robust: Whether the fit has left them out.
    """
    robot = whole.observations.robot
    notes = []
    spread, per_dof = chi2_spread(whole.dof), whole.chi2_per_dof
    if whole.sigma.length_known and whole.dof > 0 and abs(per_dof - 1.0) > 4.0 * spread:
        notes.append(
            f"What is left is {math.sqrt(per_dof):.3g} times the noise that was given: "
            + (
                "there is more than noise and the table's numbers (backlash, bending, outliers), or the noise is "
                "greater. The standard deviations do not account for that."
                if per_dof > 1.0
                else "the noise is less."
            )
        )
    if whole.dof < 10:
        notes.append(
            f"There are only {whole.dof} more equations than parameters: what is left says little about the noise."
        )
    away = float(np.linalg.norm(whole.state.values.base[:3, 3] - robot.spec.base.pose.xyz))
    if away > _FAR:
        notes.append(
            f"base_link is the frame of the measurements now, {away:.3g} m from where it was; with a station "
            "for each row it would stay. Gravity in the robot file is as it was: check it if the frame is not "
            "level."
        )
    vague = [
        robot.parameters[column].name
        for k, column in enumerate(whole.basis.kept)
        if column < len(robot.parameters) and math.sqrt(whole.covariance[k, k]) > _VAGUE
    ]
    if vague:
        notes.append(
            f"{listed(vague)} {'is' if len(vague) == 1 else 'are'} determined to no better than "
            f"{1e3 * _VAGUE:g} mm or mrad: only together do these numbers mean anything. A prior keeps them near "
            "the robot file's."
        )
    change = robot.change(whole.state.values, robot.start)
    twisted = [
        parameter.name
        for k, parameter in enumerate(robot.parameters)
        if parameter.group in (Group.ALPHA, Group.BETA) and abs(change[k]) > _TWISTED
    ]
    if twisted:
        notes.append(
            f"{listed(twisted)} changed by more than any arm is built off: columns may be exchanged, a joint may "
            "turn the other way, or the robot is not the one that was measured."
        )
    copies = _copies(whole.observations.measured)
    if copies:
        notes.append(
            f"{counted(copies, 'row')} {'is an exact copy' if copies == 1 else 'are exact copies'} of another: "
            "remove what was not measured again, since each row counts."
        )
    if outliers and not robust:
        notes.append("There are outliers; a robust fit leaves them out.")
    return notes


def described(measured: Measurements) -> str:
    """Return the file and what it contains: ``arm.csv: 60 poses of 3 stations``."""
    where = f"{measured.file}: " if measured.file else ""
    rows = counted(
        len(measured),
        {Kind.POSE: "pose", Kind.POSITION: "position", Kind.DISTANCE: "distance"}.get(measured.kind, "row"),
    )
    if measured.groups is None:
        return f"{where}{rows}"
    return f"{where}{rows} of {counted(len(set(measured.groups)), measured.group_name or 'group')}"


def _copies(measured: Measurements) -> int:
    """Return how many rows are exact copies of rows before them, in what was measured and where."""
    count = len(measured)
    given = (measured.q, measured.position, measured.rotation, measured.distance)
    numbers = np.concatenate([each.reshape(count, -1) for each in given if each is not None], axis=1)
    names = (
        texts or ("",) * count
        for texts in (measured.station, measured.placement, measured.socket, measured.to, measured.pair)
    )
    return count - len(set(zip((row.tobytes() for row in numbers), *names, strict=True)))


def _extent(robot: RobotParameters, values: Values, q: Array, *, tool: bool) -> float:
    """Return how far the last DH frame, or tool0, gets around: the rms distance from its mean position, m."""
    _, p = robot.tool_poses(values if tool else replace(values, tool=np.eye(4)), q)
    return float(np.sqrt(((p - p.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _some(names: Sequence[str]) -> str:
    if len(names) <= _MOST_NAMED + 1:
        return listed(names)
    return f"{listed(names[:_MOST_NAMED])} and {len(names) - _MOST_NAMED} others"


def _still_joints(spec: RobotSpec, q: Array) -> list[str]:
    names = [row.name for row in spec.moving_rows]
    return [name for name, spread in zip(names, np.ptp(q, axis=0).tolist(), strict=True) if spread < 1e-3]
