"""``dh2sim calibrate``: a table fitted to measurements."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from dh2sim.cli.common import (
    ForceOption,
    JsonOption,
    QuietOption,
    RobotArgument,
    SeedOption,
    choice,
    load_one,
    refuse_options,
    words_of,
)
from dh2sim.cli.output import WIDTH, json_text, require_free, table_lines, wrapped
from dh2sim.messages import counted, listed, printable, shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dh2sim.calibrate.held_out import Errors
    from dh2sim.calibrate.measurements import Kind, Measurements
    from dh2sim.calibrate.result import Calibration, ParameterResult
    from dh2sim.robot.spec import RobotSpec

_UNITS: Final = {
    "m": (1.0, False), "mm": (1e-3, False), "um": (1e-6, False), "µm": (1e-6, False), "cm": (1e-2, False),
    "rad": (1.0, True), "mrad": (1e-3, True), "deg": (math.pi / 180.0, True),
}  # fmt: skip


def calibrate(
    robot: RobotArgument,
    data: Annotated[
        Path | None,
        typer.Argument(
            metavar="DATA",
            help="Measurements, a CSV file: a column for each joint by name, and x, y, z with an orientation, or "
            "distance, or socket; units in the header, as in 'joint_1 [deg]'.",
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            metavar="pose|position|distance|socket",
            help="What was measured. [default: as the columns say]",
        ),
    ] = None,
    unknown: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAMES",
            help="What to fit, with commas or repeated: base, tool, a, alpha, d, theta, beta; a row's name; or one "
            "number such as joint_2.theta. [default: all]",
        ),
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SIGMAS",
            help="How far the table's numbers may be off, one sigma: '1mm,1mrad', or by name: 'theta=5mrad,d=2mm'; "
            "with commas or repeated. [default: not known]",
        ),
    ] = None,
    robust: Annotated[bool, typer.Option("--robust", help="Find rows that are far off, and leave them out.")] = False,
    groups: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN",
            help="Rows with the same value are held out together. [default: placement, group, station or socket]",
        ),
    ] = None,
    noise: Annotated[
        str | None,
        typer.Option(
            metavar="SIGMA",
            help="Standard deviation of a component of the measurements: '5e-5' (m, and rad), '0.05mm', "
            "'0.05mm,0.1mrad'. [default: estimated]",
        ),
    ] = None,
    from_run: Annotated[
        Path | None,
        typer.Option(
            "--from-run", metavar="RUN", help="Use recordings of a run as measurements, with --noise added to them."
        ),
    ] = None,
    rows: Annotated[
        int | None, typer.Option("--rows", metavar="N", help="Rows to take from the run. [default: 100]")
    ] = None,
    plan: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Choose N configurations to measure, inside limits and without self-contact. [kind: position]",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE", help="Write the calibrated robot file; with --plan, configurations as CSV."
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a report as HTML, one file with all plots.")
    ] = None,
    seed: SeedOption = 0,
    force: ForceOption = False,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Fit a robot's table, base and tool to measurements, and say how far to trust it.

    Only what the measurements determine is fitted: one of parameters with the same effect; the report names them.
    Rows between nearly parallel axes become Hayati rows. Errors are also found at measurements held out of the fit,
    by placement.

    \b
    Examples:
      dh2sim calibrate franka_panda sockets.csv --groups placement -o panda.yaml
      dh2sim calibrate ur5e poses.csv --noise 0.05mm,0.1mrad
      dh2sim calibrate puma560 points.csv --unknown base,tool,theta --robust
      dh2sim calibrate stanford --from-run run.zarr --noise 5e-5 -o fitted.yaml
      dh2sim calibrate ur5e poses.csv -o my_ur5e.yaml --report report.html
      dh2sim calibrate ur5e --plan 30 -o configurations.csv
    """
    require_free(out, force=force)
    require_free(report, force=force)
    spec = load_one(robot)
    if plan is not None:
        refuse_options(
            "--plan",
            {
                "DATA": data, "--from-run": from_run, "--unknown": unknown, "--prior": prior, "--robust": robust,
                "--groups": groups, "--rows": rows, "--report": report,
            },
        )  # fmt: skip
        _plan(spec, plan, kind, noise, out, seed, as_json=as_json, quiet=quiet)
        return
    if (data is None) == (from_run is None):
        raise typer.BadParameter(
            "is missing: give a file of measurements, or a run with --from-run"
            if data is None
            else "must not be given together with DATA",
            param_hint="DATA" if data is None else "--from-run",
        )
    if out is not None and report is not None and out.resolve() == report.resolve():
        raise typer.BadParameter("must not be the file of --out", param_hint="--report")
    if rows is not None and from_run is None:
        raise typer.BadParameter("needs --from-run", param_hint="--rows")

    from dh2sim.calibrate.calibration import calibrate_robot

    sigma, names, expected = _noise(noise), words_of(unknown, "--unknown") or None, _prior(prior)
    measured = _measured(spec, data, from_run, kind, groups, sigma, rows, seed)
    found = calibrate_robot(spec, measured, unknown=names, prior=expected, robust=robust, noise=sigma, seed=seed)
    _write(found, out, report)
    if as_json:
        from dh2sim.calibrate.data import calibration_data

        print(json_text(calibration_data(found)))
    elif not quiet:
        print("\n".join(_lines(found)))
        written = [str(file) for file in (out, report) if file is not None]
        if written:
            print(printable(f"\nwritten: {', '.join(written)}"))


def _plan(
    spec: RobotSpec,
    count: int,
    kind: str | None,
    noise: str | None,
    out: Path | None,
    seed: int,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    from dh2sim.calibrate.measurements import Kind
    from dh2sim.calibrate.plan import plan_measurements

    if count < 1:
        raise typer.BadParameter(f"must be at least 1, got {count}", param_hint="--plan")
    sigma = _noise(noise)
    found = plan_measurements(
        spec, count, kind=_kind(kind) or Kind.POSITION, noise=1e-4 if sigma is None else sigma, seed=seed
    )
    names = [row.name for row in spec.moving_rows]
    if out is not None:
        from dh2sim.calibrate.data_file import configurations_text
        from dh2sim.files import atomic_file

        with atomic_file(out) as draft:
            draft.write_text(configurations_text(spec, found.q), encoding="utf-8")
    if as_json:
        content = {
            "robot": spec.name,
            "kind": found.kind.value,
            "joints": names,
            "q": found.q.tolist(),
            "identifiable": found.parameters,
            "noise": found.noise,
            "predicted": found.error * found.noise,
            "predicted_random": found.random_error * found.noise,
            "ratio": found.error / found.random_error,
            "touching": found.touching,
            "note": found.note,
        }
        print(json_text(content))
        return
    if quiet:
        return
    from dh2sim.calibrate.data_file import configurations_text

    lines = [f"{spec.name}: {counted(count, 'configuration')} to measure {found.kind}s at", ""]
    share = found.error / found.random_error
    facts = [
        ("identifiable", f"{found.parameters} parameters of the robot"),
        ("the tool", f"known to {found.error:.2f} times the noise, rms inside the limits"),
        (
            "at random",
            f"to {found.random_error:.2f} times, by the median of as many: the plan has {share:.2f} of that",
        ),
        ("self-contact", f"{counted(found.touching, 'candidate')} left out"),
    ]
    lines += [f"{left:<12}  {right}" for left, right in facts]
    if out is None:
        head, *rows = [line.split(",") for line in configurations_text(spec, found.q).splitlines()]
        table = [["", *head], *([str(k), *row] for k, row in enumerate(rows, start=1))]
        whole = table_lines(table, left=0)
        if len(whole[1]) > WIDTH:  # joints by number, as the file may have them too
            units = [name.rpartition(" ")[2] for name in head]
            table[0] = ["", *(f"q{k} {unit}" for k, unit in enumerate(units, start=1))]
            whole = table_lines(table, left=0)
        lines += ["", *whole]
    if found.note:
        lines += ["", *wrapped(f"Note: {found.note}", rest="      ")]
    if out is not None:
        lines += ["", f"written: {out}"]
    print(printable("\n".join(lines)))


def _measured(
    spec: RobotSpec,
    data: Path | None,
    run: Path | None,
    kind: str | None,
    groups: str | None,
    sigma: float | tuple[float, float] | None,
    rows: int | None,
    seed: int,
) -> Measurements:
    if data is not None:
        from dh2sim.calibrate.data_file import read_measurements

        return read_measurements(data, spec, kind=_kind(kind), groups=groups)
    assert run is not None
    if sigma is None:
        raise typer.BadParameter("needs --noise: recordings of a simulation have none", param_hint="--from-run")
    if groups is not None:
        raise typer.BadParameter(
            "cannot be combined with --from-run, whose rollouts are the groups", param_hint="--groups"
        )
    from dh2sim.calibrate.measurements import Kind
    from dh2sim.simulate.run_measurements import COUNT, run_measurements

    count = COUNT if rows is None else rows
    if count < 1:
        raise typer.BadParameter(f"must be at least 1, got {count}", param_hint="--rows")
    return run_measurements(spec, run, noise=sigma, kind=_kind(kind) or Kind.POSE, count=count, seed=seed)


def _kind(text: str | None) -> Kind | None:
    from dh2sim.calibrate.measurements import OTHER_KINDS, Kind

    return choice(text, Kind, "--kind", other_names=OTHER_KINDS)


def _quantity(text: str, option: str, *, angle: bool | None = None) -> tuple[float, bool | None]:
    """Return a number in SI units, and whether it is an angle; None where no unit says.

    Raises:
        BadParameter: It is not a positive number with a unit that is known.
    """
    word = text.strip()
    unit = next((unit for unit in sorted(_UNITS, key=len, reverse=True) if word.endswith(unit)), "")
    number = word.removesuffix(unit).strip() if unit else word
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise typer.BadParameter(
            f"must be a positive number with a unit ({listed(_UNITS)}), got {shown(text)}", param_hint=option
        )
    factor, is_angle = _UNITS.get(unit, (1.0, None))
    if angle is not None and is_angle is not None and is_angle is not angle:
        raise typer.BadParameter(f"{shown(text)} is {'an angle' if is_angle else 'a length'}", param_hint=option)
    return value * factor, is_angle


def _noise(text: str | None) -> float | tuple[float, float] | None:
    if text is None:
        return None
    parts = [_quantity(part, "--noise", angle=k == 1) for k, part in enumerate(text.split(","))]
    if len(parts) > 2:
        raise typer.BadParameter("must be one number, or two, of lengths and of angles", param_hint="--noise")
    return (parts[0][0], parts[1][0]) if len(parts) == 2 else parts[0][0]


def _prior(texts: list[str] | None) -> dict[str, float] | None:
    found: dict[str, float] = {}
    for part in words_of(texts, "--prior"):
        name, is_named, number = part.partition("=")
        if is_named:
            found[name.strip()] = _quantity(number, "--prior")[0]
            continue
        value, angle = _quantity(part, "--prior")
        if angle is None:
            raise typer.BadParameter(
                f"{shown(part.strip())} needs a unit, such as 1mm or 1mrad", param_hint="--prior"
            )
        found["angle" if angle else "length"] = value
    return found or None


def _write(found: Calibration, out: Path | None, report: Path | None) -> None:
    """Write the robot file and the report; both are made before either is written."""
    texts: list[tuple[Path, str]] = []
    if out is not None:
        from dh2sim.calibrate.robot_text import calibrated_text

        texts.append((out, calibrated_text(found, header=_header(found), folder=out.absolute().parent)))
    if report is not None:
        from dh2sim.calibrate.html_report import html_report

        texts.append((report, html_report(found)))
    if texts:
        from dh2sim.files import atomic_file

        for file, text in texts:
            with atomic_file(file) as draft:
                draft.write_text(text, encoding="utf-8")


def _header(found: Calibration) -> list[str]:
    measured = found.measured
    source = f" of {os.path.basename(measured.file)}" if measured.file else ""
    from dh2sim.calibrate.data import summary

    line = f"Note: {summary(found)[0][1]}{source}: {_error(found.errors, measured.kind)} off"
    if found.held_out is not None and found.held_out.fitted is not None:
        line += f", {_error(found.held_out.fitted, measured.kind)} where it had not been measured"
    return [f"{line}; {_error(found.errors_before, measured.kind)} before."]


# ---------------------------------------------------------------------------- the report


def _error(errors: Errors, kind: str) -> str:
    text = f"{1e3 * errors.length:.3g} mm"
    return text if math.isnan(errors.angle) or kind != "pose" else f"{text} and {1e3 * errors.angle:.3g} mrad"


def _lines(found: Calibration) -> list[str]:
    """Return what is printed, at most 80 columns wide as far as names allow."""
    from dh2sim.calibrate.data import summary

    (_, what), *rows = summary(found)
    lines = [f"{found.robot.name}: {what}", ""]
    width = max(len(left) for left, _ in rows)
    lines += [f"{left:<{width}}  {right}" for left, right in rows]
    lines += ["", *_error_lines(found)]
    lines += ["", *_parameter_lines(found)]
    for title, which in (("Folded", "folded"), ("Without effect", "unseen"), ("Held", "held")):
        lines += _status_lines(found, title, which)
    lines += _outlier_lines(found)
    for note in found.notes:
        lines += wrapped(f"Note: {note}", rest="      ")
    return [printable(line) for line in lines]


def _cells(errors: Errors | None, columns: Sequence[str]) -> list[str]:
    values = [math.nan if errors is None else getattr(errors, column) for column in columns]
    return ["-" if math.isnan(value) else f"{1e3 * value:.3f}" for value in values]


def _error_lines(found: Calibration) -> list[str]:
    """Return the errors before and after, and held out."""
    columns, heads = ["length"], {"length": "mm", "angle": "mrad", "artefact": "distance mm"}
    if found.measured.kind == "pose":
        columns.append("angle")
    if not math.isnan(found.errors.artefact):
        columns.append("artefact")
    whole = [("error, rms", *(heads[column] for column in columns))]
    whole.append(("as it was", *_cells(found.errors_before, columns)))
    whole.append(("calibrated", *_cells(found.errors, columns)))
    held = found.held_out
    if held is not None and held.fitted is not None:
        whole.append((f"held out by {held.by}: as it was", *_cells(held.nominal, columns)))
        whole.append(("  calibrated", *_cells(held.fitted, columns)))
        whole.append(("  predicted", *_cells(held.predicted, columns)))
    lines = table_lines(whole, left=1)
    if held is None:
        lines.append("Nothing is held out: there is only one group.")
    elif any(fold.reason for fold in held.folds):
        failed = next(fold for fold in held.folds if fold.reason)
        lines += wrapped(f"Without {listed(failed.groups)}: {failed.reason}", rest="")
    return lines


def _nominal(parameter: ParameterResult, spec: RobotSpec) -> str:
    from dh2sim.robot.number_text import UnitWriter

    if parameter.nominal is None:
        return ""
    writer = UnitWriter(units=spec.units)
    text = writer.angle(parameter.nominal) if parameter.is_angle else writer.length(parameter.nominal)
    return text if len(text) <= 12 else f"{float(text):.9g}"


def _parameter_lines(found: Calibration) -> list[str]:
    units = found.original.units
    rows = [("parameter", f"was ({units.angle}, {units.length})", "change", "sigma", "")]
    for parameter in found.parameters:
        if parameter.status.value == "fitted" and parameter.sigma is not None:
            unit = "mrad" if parameter.is_angle else "mm"
            rows.append(
                (
                    parameter.name,
                    _nominal(parameter, found.original),
                    f"{1e3 * parameter.change:+.4f}",
                    f"{1e3 * parameter.sigma:.4f}",
                    unit,
                )
            )
    return [line.rstrip() for line in table_lines(rows, left=1)]


def _status_lines(found: Calibration, title: str, which: str) -> list[str]:
    """Return which parameters stay as they were, and why: those with the same reason together."""
    reasons: dict[str, list[str]] = {}
    for parameter in found.parameters:
        if parameter.status.value == which:
            reason = parameter.reason if which == "held" else ", ".join(parameter.into)
            reasons.setdefault(reason, []).append(parameter.name)
    lines = []
    for reason, names in reasons.items():
        into = f" into {reason}" if which == "folded" else f": {reason}" if reason else ""
        text = f"{title}: {', '.join(names)}{into}"
        lines += wrapped(text)
    return ["", *lines] if lines else []


def _outlier_lines(found: Calibration, most: int = 10) -> list[str]:
    if not found.outliers:
        return [""] if found.notes else []
    rows = [("outlier", "", "sigmas", "mm", "")]
    rows += [
        (
            outlier.place,
            outlier.group,
            f"{outlier.times:.1f}",
            "-" if math.isnan(outlier.length) else f"{1e3 * outlier.length:.3f}",
            "left out" if outlier.left_out else "",
        )
        for outlier in found.outliers[:most]
    ]
    lines = ["", *(line.rstrip() for line in table_lines(rows, left=2))]
    if len(found.outliers) > most:
        lines.append(f"and {len(found.outliers) - most} more")
    return [*lines, ""] if found.notes else lines
