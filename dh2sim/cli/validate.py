"""``dh2sim validate``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import (
    FELL_SHORT,
    RobotsArgument,
    SamplesOption,
    SeedOption,
    StrictOption,
    ToleranceOption,
    build_any,
    complain,
    tolerance_of,
)
from dh2sim.cli.output import json_text, make_console, print_whole, progress_bar, wrapped
from dh2sim.errors import Dh2simError, OutputError
from dh2sim.extras import require_extra

if TYPE_CHECKING:
    from rich.table import Table

    from dh2sim.model.mechanism import MechanismModel
    from dh2sim.model.robot_model import RobotModel
    from dh2sim.validate.report import Check, RobotReport, ValidationReport


def validate(
    robots: RobotsArgument,
    samples: SamplesOption = 1000,
    seed: SeedOption = 0,
    tolerance: ToleranceOption = 1e-12,
    dynamics: Annotated[
        bool,
        typer.Option(
            "--dynamics",
            help="Simulate the robot, too: energy, momentum, rest, tracking, inverse dynamics, self-contact.",
        ),
    ] = False,
    folder: Annotated[
        Path | None,
        typer.Option("--dir", metavar="DIR", help="Check the files in DIR/<name>/ instead of a new export."),
    ] = None,
    source: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="URDF or MJCF that the robot was imported from: compare masses with it."),
    ] = None,
    base: Annotated[
        str | None, typer.Option(metavar="LINK", help="Link of --source that became base_link. [default: the root]")
    ] = None,
    tip: Annotated[
        str | None, typer.Option(metavar="LINK|SITE", help="Link or site of --source that became tool0.")
    ] = None,
    json_file: Annotated[
        str | None,
        typer.Option("--json", metavar="FILE|-", help="Write the report as JSON; - prints it alone."),
    ] = None,
    junit: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the report as JUnit XML.")] = None,
    strict: StrictOption = False,
) -> int:
    """Check every engine against the table: poses, Jacobians and dynamics.

    The engines are dh2sim itself, MuJoCo on the MJCF and on the URDF, and yourdfpy, pinocchio and PyBullet where they
    are installed. With --dynamics the robot is also simulated, and its motion is checked against the laws of physics.
    With --source the mass matrix and the forces of gravity are compared with those of the file that 'dh2sim import'
    read. The exit status is 1 if anything differs by more than the tolerance.

    \b
    Examples:
      dh2sim validate stanford
      dh2sim validate stanford --dynamics
      dh2sim validate my_arm.yaml --samples 100000 --json report.json
      dh2sim validate robots/*.yaml --dir generated --junit report.xml
      dh2sim validate panda.yaml --source panda.urdf
    """
    tolerance_of(tolerance)
    if dynamics:
        require_extra("data", "xarray", what="--dynamics")
    if source is not None and len(robots) > 1:
        raise typer.BadParameter("is the source of one robot", param_hint="--source")
    if source is None and (base is not None or tip is not None):
        option = "--base" if tip is None else "--tip"
        raise typer.BadParameter("needs --source", param_hint=option)
    from dh2sim.engines.yourdfpy_engine import start_yourdfpy

    start_yourdfpy()
    models = build_any(robots, strict=strict)
    if folder is not None:
        _require_folders(robots, models, folder)
    from dh2sim.model.mechanism import MechanismModel
    from dh2sim.validate.report import ValidationReport, to_junit
    from dh2sim.validate.run import engine_samples, validate_robot

    for model in models:
        if isinstance(model, MechanismModel) and (dynamics or source is not None):
            option = "--dynamics" if dynamics else "--source"
            raise Dh2simError(f"{model.name}: {option} is for serial robots; this one is a mechanism")
    serial = [model for model in models if not isinstance(model, MechanismModel)]
    poses = sum(engine_samples(samples, len(model.joints)) for model in serial)
    with progress_bar("comparing", "poses", poses) as advance:
        reports = []
        for model in models:
            found = validate_robot(
                model,
                samples=samples,
                seed=seed,
                tolerance=tolerance,
                folder=None if folder is None else folder / model.name,
                source=source,
                base=base,
                tip=tip,
                advance=advance,
            )
            if dynamics and not isinstance(model, MechanismModel):
                found = _simulated(model, found, seed)
            reports.append(found)
        report = ValidationReport(robots=tuple(reports))
    text = json_text(report.to_json())
    if json_file == "-":
        print(text)
    else:
        _print(report)
        if json_file is not None:
            _write(Path(json_file), text + "\n")
    if junit is not None:
        _write(junit, to_junit(report))
    return 0 if report.ok else FELL_SHORT


def _simulated(model: RobotModel, report: RobotReport, seed: int) -> RobotReport:
    """Add the physics checks to a robot's report."""
    from dh2sim.validate.motion.run import check_motion

    return replace(report, checks=(*report.checks, *check_motion(model, seed=seed)))


def _require_folders(robots: list[str], models: Sequence[RobotModel | MechanismModel], folder: Path) -> None:
    missing = [
        f"there is no folder '{folder / model.name}'; write it with 'dh2sim export {robot} --out {folder}'"
        for robot, model in zip(robots, models, strict=True)
        if not (folder / model.name).is_dir()
    ]
    for text in missing[:-1]:
        complain(text)
    if missing:
        raise Dh2simError(missing[-1])


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write '{path}': {error.strerror or error}") from error


def _print(report: ValidationReport) -> None:
    from rich.text import Text

    console = make_console()
    for robot in report.robots:
        verdict = ("matches its table", "bold green") if robot.ok else ("DOES NOT match its table", "bold red")
        console.print(Text.assemble((robot.name, "bold"), " ", verdict))
        print_whole(_table(robot))
        for remark, style in dict.fromkeys(_remarks(robot)):
            text = wrapped(remark, first="  ", rest="    ", width=console.width)
            console.print(Text("\n".join(text), style), soft_wrap=True)
        if not robot.ok:
            console.print()
    if len(report.robots) > 1:
        matching = sum(robot.ok for robot in report.robots)
        console.print(f"{matching} of {len(report.robots)} robots match their tables.")


def _table(robot: RobotReport) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("engine", no_wrap=True)
    table.add_column("compared", no_wrap=True)
    for column in ("samples", "worst error", "limit"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    marks = {True: Text("ok", "green"), False: Text("FAILED", "bold red"), None: Text("skipped", "yellow")}
    for check in robot.checks:
        if check.max_position_error is not None and check.max_rotation_error is not None:
            worst = f"{check.max_position_error:.1e} m {check.max_rotation_error:.1e} rad"
        else:
            worst = "" if check.max_error is None else f"{check.max_error:.1e}"
        table.add_row(
            check.engine,
            _compared(check),
            f"{check.samples:,}" if check.samples else "",
            worst,
            "" if check.tolerance is None else f"{check.tolerance:.0e}",
            marks[check.ok],
        )
    return table


def _remarks(robot: RobotReport) -> Iterator[tuple[str, str]]:
    """What did not hold or was not checked, each with its colour."""
    from dh2sim.validate.report import failure_text

    for check in robot.checks:
        if check.ok is False:
            yield f"{check.engine}, {check.quantity.value}: {failure_text(check)}", "red"
        elif check.ok is None:
            yield f"{check.engine}: {check.reason}", "yellow"
        if check.left_out is not None:
            yield f"{check.engine}, {check.quantity.value}: {check.left_out}", "yellow"
    for warning in robot.warnings:
        yield f"mujoco: {warning}", "yellow"


def _compared(check: Check) -> str:
    if check.frames is not None:
        return f"pose, {check.frames} frames"
    if check.reference == "central differences":
        return "jacobian (central)"
    if check.engine == "mujoco-mjcf":  # for all but a source it is the reference itself
        return {"mass matrix": "masses (source)", "gravity force": "gravity (source)"}.get(
            check.quantity.value, check.quantity.value
        )
    return check.quantity.value
