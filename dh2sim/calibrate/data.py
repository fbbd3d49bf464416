"""A calibration as data: what ``--json`` prints, in m and rad."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from dh2sim.calibrate.held_out import Errors, HeldOut
from dh2sim.calibrate.measurements import Kind
from dh2sim.calibrate.result import Calibration, ParameterStatus
from dh2sim.messages import counted


def calibration_data(found: Calibration) -> dict[str, Any]:
    """Return what is known of a calibration as JSON values; what was not measured is None."""
    fit, measured = found.fit, found.measured
    observations = fit.observations
    sigma = {
        observations.unknowns[column].name: float(fit.covariance[k, k]) ** 0.5
        for k, column in enumerate(fit.basis.kept)
        if observations.unknowns[column].group is None
    }
    return {
        "robot": found.robot.name,
        "kind": measured.kind.value,
        "rows": len(measured),
        "groups": None if measured.groups is None else len(set(measured.groups)),
        "grouped_by": measured.group_name or None,
        "identifiable": found.identifiable,
        "possible": found.possible,
        "condition": fit.basis.condition,
        "steps": fit.iterations,
        "noise": {
            "length": fit.sigma.length,
            "angle": fit.sigma.angle if measured.rotation is not None else None,
            "given": fit.sigma.length_known,
        },
        "chi2": fit.chi2,
        "dof": fit.dof,
        "chi2_per_dof": _number(fit.chi2_per_dof),
        "chi2_per_dof_spread": _number(found.chi2_spread),
        "errors": {"nominal": _errors(found.errors_before), "calibrated": _errors(found.errors)},
        "held_out": None if found.held_out is None else _held_out(found.held_out),
        "predicted": _errors(found.predicted),
        "moved": _errors(found.moved),
        "parameters": [
            {
                "name": parameter.name,
                "unit": "rad" if parameter.is_angle else "m",
                "status": parameter.status.value,
                "nominal": parameter.nominal,
                "value": parameter.value,
                "change": parameter.change,
                "sigma": parameter.sigma,
                "folds_into": list(parameter.into),
                "reason": parameter.reason,
            }
            for parameter in found.parameters
        ],
        "table": [
            {
                "name": row.name,
                "type": row.type.value,
                "convention": row.convention.value,
                **{key: getattr(row, key) for key in ("a", "alpha", "d", "theta", "beta")},
            }
            for row in found.robot.rows
        ],
        "base": {"xyz": found.robot.base.pose.xyz.tolist(), "rpy": found.robot.base.pose.rpy.tolist()},
        "tool": {"xyz": found.robot.tool.xyz.tolist(), "rpy": found.robot.tool.rpy.tolist()},
        "stations": {
            name: {"T_station_base": T.tolist()}
            for name, T in zip(observations.station_names, fit.state.stations, strict=True)
        },
        "points": {
            name: point.tolist() for name, point in zip(observations.point_names, fit.state.points, strict=True)
        },
        "sigma_of_measurement": sigma,
        "outliers": [
            {
                "row": outlier.row,
                "line": measured.lines[outlier.row] if measured.lines else None,
                "group": outlier.group,
                "sigmas": outlier.times,
                "length": _number(outlier.length),
                "angle": _number(outlier.angle),
                "left_out": outlier.left_out,
            }
            for outlier in found.outliers
        ],
        "notes": list(found.notes),
    }


def summary(found: Calibration) -> list[tuple[str, str]]:
    """Return the facts that a report begins with, a word and a text each; the first says what was measured."""
    fit, measured = found.fit, found.measured
    rows = {Kind.SOCKET: "row"}.get(measured.kind, measured.kind.value)
    what = f"calibrated with {counted(len(measured), rows)}"
    if measured.socket is not None:
        what += f" in {counted(len(set(measured.socket_names())), 'socket')}"
    if measured.groups is not None and measured.group_name not in ("socket", ""):
        what += f", {counted(len(set(measured.groups)), measured.group_name)}"
    facts = [
        ("", what),
        ("identifiable", f"{found.identifiable} parameters of the robot, {found.possible} at most by this kind"),
    ]
    own = sum(each.status is ParameterStatus.FITTED for each in found.parameters)
    if len(fit.basis.kept) > own:
        facts.append(
            ("", f"and {len(fit.basis.kept) - own} of {'stations' if measured.socket is None else 'sockets'}")
        )
    facts.append(("condition", f"{fit.basis.condition:.3g}, in {counted(fit.iterations, 'step')}"))
    if fit.sigma.length_known:
        spread = f"expected 1 ± {found.chi2_spread:.3f} ({fit.dof} dof)"
        facts.append(("chi2 per dof", f"{fit.chi2_per_dof:.3f}, {spread}"))
    noise = f"{1e3 * fit.sigma.length:.4g} mm"
    if measured.rotation is not None:
        noise += f", {1e3 * fit.sigma.angle:.4g} mrad"
    given = "as given" if fit.sigma.length_known else f"estimated ({fit.dof} dof)"
    facts.append(("noise", f"{noise} a component, {given}"))
    moved = f"moved by {1e3 * found.moved.length:.3g} mm inside the limits"
    facts.append(("the tool", f"{moved}, known to {1e3 * found.predicted.length:.2g} mm"))
    return facts


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _errors(errors: Errors | None) -> dict[str, float | None] | None:
    return None if errors is None else {name: _number(value) for name, value in asdict(errors).items()}


def _held_out(held: HeldOut) -> dict[str, Any]:
    return {
        "by": held.by,
        "nominal": _errors(held.nominal),
        "calibrated": _errors(held.fitted),
        "predicted": _errors(held.predicted),
        "folds": [
            {
                "groups": list(fold.groups),
                "rows": fold.rows,
                "nominal": _errors(fold.nominal),
                "calibrated": _errors(fold.fitted),
                "predicted": _errors(fold.predicted),
                "reason": fold.reason,
            }
            for fold in held.folds
        ],
    }
