"""``dh2sim export``."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dh2sim.cli.common import (
    DONE,
    FELL_SHORT,
    JsonOption,
    RobotsArgument,
    StrictOption,
    build_any,
    choice,
    complain,
    words_of,
)
from dh2sim.cli.output import json_text, print_wrapped
from dh2sim.errors import Dh2simError, OutputError
from dh2sim.messages import listed, printable

if TYPE_CHECKING:
    from dh2sim.export import ExportReport, Format
    from dh2sim.model.mechanism import AnyModel


def export(
    robots: RobotsArgument,
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Folder to write to; each robot gets a folder of its own in it."
        ),
    ] = Path("generated"),
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format", metavar="urdf,mjcf", help="Formats to write, with commas or repeated. [default: both]"
        ),
    ] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="Write nothing; exit with status 1 if the existing files are out of date."),
    ] = False,
    no_verify: Annotated[
        bool, typer.Option("--no-verify", help="Do not compare the written files with the table.")
    ] = False,
    no_dh_frames: Annotated[
        bool, typer.Option("--no-dh-frames", help="Leave the links dh_0 … dh_n out of the URDF.")
    ] = False,
    strict: StrictOption = False,
    no_wait: Annotated[
        bool, typer.Option("--no-wait", help="Fail if another process is writing the files of the same robot.")
    ] = False,
    as_json: JsonOption = False,
) -> int:
    """Write a robot as URDF and MJCF, and verify them against its table.

    The poses that MuJoCo reads from the written files are compared with the textbook product of the table before the
    files are moved into place. The files of a robot are written all together or not at all.

    \b
    Examples:
      dh2sim export stanford
      dh2sim export my_arm.yaml --out build --format urdf
      dh2sim export robots/*.yaml --check       # in CI: are the files up to date?
      dh2sim export stanford --json             # what was written, lost, estimated
    """
    chosen = _formats(formats)
    models = build_any(robots, strict=strict)
    if check:
        return _check(models, out, chosen, dh_frames=not no_dh_frames, as_json=as_json)
    from dh2sim.export import export_robot

    status, written, printed = DONE, list[str](), list[dict[str, Any]]()
    for position, model in enumerate(models):
        try:
            report = export_robot(
                model,
                out,
                formats=chosen,
                dh_frames=not no_dh_frames,
                verify=not no_verify,
                wait=not no_wait,
                waiting=_report_waiting,
            )
        except OutputError as error:  # the next robot would fare no better
            if not written:
                raise
            status = complain(f"{model.name}: {error}")
            left = listed([each.name for each in models[position:]])
            print(f"dh2sim: exported before it: {listed(written)}; not exported: {left}", file=sys.stderr)
            break
        except Dh2simError as error:
            status = max(status, complain(error))
        else:
            written.append(model.name)
            if as_json:
                printed.append(report.to_json())
            else:
                _print_report(report, out)
    if as_json:
        print(json_text({"ok": status == DONE, "robots": printed}))
    return status


def _report_waiting(folder: Path) -> None:
    print(printable(f"dh2sim: waiting for another process that is writing to '{folder}'"), file=sys.stderr)


def _formats(names: list[str] | None) -> list[Format]:
    from dh2sim.export import Format

    option = "--format"
    chosen = [format_ for name in words_of(names, option) if (format_ := choice(name, Format, option)) is not None]
    return list(dict.fromkeys(chosen or Format))


def _check(models: Sequence[AnyModel], out: Path, formats: list[Format], *, dh_frames: bool, as_json: bool) -> int:
    from dh2sim.export import drift

    found = {model.name: drift(model, out, formats=formats, dh_frames=dh_frames) for model in models}
    status = FELL_SHORT if any(found.values()) else DONE
    if as_json:
        robots = [
            {
                "name": name,
                "ok": not drifted,
                "drift": [{"path": str(each.path), "what": each.what} for each in drifted],
            }
            for name, drifted in found.items()
        ]
        print(json_text({"ok": status == DONE, "robots": robots}))
        return status
    for name, drifted in found.items():
        if not drifted:
            print(f"{name}: up to date")
        for entry in drifted:
            print(printable(f"{name}: {entry.path}: {entry.what}"))
    if status:
        print(
            "dh2sim: some files are not what the robot files say; write them with 'dh2sim export'",
            file=sys.stderr,
        )
    return status


def _print_report(report: ExportReport, out: Path) -> None:
    """Print a table of the files with their errors, then what was lost, estimated and assumed."""
    folder = out / report.name
    errors = {check.format.value: check for check in report.verified}
    lines = [("file", "size", "worst pose error", "")]
    for file in report.files:
        name = file.path.relative_to(folder).as_posix()
        kind = {f"{report.name}.urdf": "urdf", f"{report.name}.xml": "mjcf"}.get(name)
        check = errors.get(kind or "")
        worst = "not verified" if kind else ""
        if check is not None:
            worst = f"{check.position_error:.1e} m, {check.rotation_error:.1e} rad"
        lines.append((name, f"{file.size:,} B", worst, "" if file.changed else "unchanged"))
    widths = [max(len(line[i]) for line in lines) for i in range(3)]
    print(printable(f"{report.name}: {folder}"))
    for name, size, worst, state in lines:
        print(f"  {name:{widths[0]}}  {size:>{widths[1]}}  {worst:{widths[2]}}  {state}".rstrip())
    _list("not carried over", map(str, report.losses))
    _list("estimated from the shapes", (f"{entry}." for entry in report.estimates))
    _list("assumed", (f"{entry}." for entry in report.assumptions))
    _list("MuJoCo", report.warnings)


def _list(title: str, lines: Iterable[str]) -> None:
    for line in lines:
        print_wrapped(f"{title}: {line}", first="  ", rest="    ")
