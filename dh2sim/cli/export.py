"""``dh2sim export``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.running import FELL_SHORT, build_all

if TYPE_CHECKING:
    from dh2sim.export.render import Format
    from dh2sim.export.run import ExportReport
    from dh2sim.model.robot_model import RobotModel


def export(
    robots: Annotated[
        list[str],
        typer.Argument(metavar="ROBOT...", help="Robot files, or names of robots that come with dh2sim."),
    ],
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Where to write; every robot gets a folder of its own.")
    ] = Path("generated"),
    formats: Annotated[
        list[str] | None,
        typer.Option("--format", metavar="urdf|mjcf", help="What to write; may be repeated. [default: both]"),
    ] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="Write nothing; compare with the files that are there, exit 1 if they differ."),
    ] = False,
    no_verify: Annotated[
        bool, typer.Option("--no-verify", help="Do not compare the written files with the table.")
    ] = False,
    no_dh_frames: Annotated[
        bool, typer.Option("--no-dh-frames", help="Leave the links dh_0 … dh_n out of the URDF.")
    ] = False,
) -> int:
    """Write a robot as URDF and MJCF, and verify them against its table.

    Every pose that MuJoCo reads from the written files is compared with the textbook product of the table before the
    files are put in place. Files are written all together or not at all.

    \b
    Examples:
      dh2sim export stanford.yaml
      dh2sim export my_arm.yaml --out build --format urdf
      dh2sim export robots/*.yaml --check        # in CI: are the files up to date?
    """
    wanted = _formats(formats)
    models = build_all(robots)
    if check:
        return _check(models, out, wanted, dh_frames=not no_dh_frames)
    from dh2sim.export.run import export_robot

    for model in models:
        report = export_robot(model, out, formats=wanted, dh_frames=not no_dh_frames, verified=not no_verify)
        _tell(report, model)
    return 0


def _formats(names: list[str] | None) -> list[Format]:
    from dh2sim.export.render import Format

    wanted = []
    for name in names or [format_.value for format_ in Format]:
        if name not in list(Format):
            raise typer.BadParameter(f"'{name}' is no format. Allowed: urdf, mjcf", param_hint="--format")
        wanted.append(Format(name))
    return list(dict.fromkeys(wanted))


def _check(models: list[RobotModel], out: Path, formats: list[Format], *, dh_frames: bool) -> int:
    from dh2sim.export.run import drift

    status = 0
    for model in models:
        found = drift(model, out, formats=formats, dh_frames=dh_frames)
        if not found:
            print(f"{model.name}: up to date")
        for entry in found:
            status = FELL_SHORT
            print(f"{model.name}: {entry.path}: {entry.what}")
    if status:
        print(
            "dh2sim: some files are not what the robot files say; write them with 'dh2sim export'",
            file=sys.stderr,
        )
    return status


def _tell(report: ExportReport, model: RobotModel) -> None:
    """Print a table of files with their errors, then what was lost, estimated and assumed."""
    width = max(len(str(file.path)) for file in report.files)
    errors = {check.format.value: check for check in report.verified}
    print(f"{report.name}")
    print(f"  {'file':{width}}  {'size':>9}  {'worst pose error against the table':34}")
    for file in report.files:
        kind = {".urdf": "urdf", ".xml": "mjcf"}.get(file.path.suffix, "") if file.path.name != "scene.xml" else ""
        check = errors.get(kind)
        told = "" if check is None else f"{check.position_error:.1e} m  {check.rotation_error:.1e} rad"
        if kind and check is None:
            told = "not verified"
        state = "" if file.changed else "  (unchanged)"
        print(f"  {file.path!s:{width}}  {file.size:>7} B  {told}{state}".rstrip())
    _list("not carried over", report.losses)
    _list("estimated", _estimated(model))
    _list("assumed", _assumed(model))


def _list(title: str, lines: list[str] | tuple[str, ...]) -> None:
    import textwrap

    for line in lines:
        lead = f"  {title}: "
        print(textwrap.fill(line, 100, initial_indent=lead, subsequent_indent="    "))


def _estimated(model: RobotModel) -> list[str]:
    from dh2sim.formats.xml import estimates

    return [line.removeprefix("Estimated from the shapes, not measured: ") for line in estimates(model.links)]


def _assumed(model: RobotModel) -> list[str]:
    from dh2sim.formats.xml import assumptions

    return [line.removeprefix("Assumed, not given: ") for line in assumptions(model.joints)]
