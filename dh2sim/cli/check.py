"""``dh2sim check``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from dh2sim.cli.common import (
    FELL_SHORT,
    SamplesOption,
    SeedOption,
    ToleranceOption,
    choice,
    refuse_other_formats,
    tolerance_of,
    words_of,
)
from dh2sim.cli.output import progress_bar
from dh2sim.messages import printable


def check(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(metavar="PATH", help="Robot files, and folders that are searched for them. [default: .]"),
    ] = None,
    exports: Annotated[
        Path | None,
        typer.Option(
            "--dir",
            metavar="DIR",
            help="Folder of the exports, DIR/<name>/; then every robot must have some. [default: generated, where "
            "robots may have none]",
        ),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="files,drift,poses",
            help="Parts to check, with commas or repeated. files: schema, meshes, likely slips. drift: exports up to "
            "date. poses: all engines match the table. [default: all]",
        ),
    ] = None,
    form: Annotated[
        str,
        typer.Option("--format", metavar="text|github|sarif|json|junit|markdown", help="What to print."),
    ] = "text",
    json_: Annotated[bool, typer.Option("--json", help="The same as --format json.")] = False,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="Also write a report, in the form of its ending: .sarif, .json, .xml (JUnit), .md or .txt; may be "
            "repeated.",
        ),
    ] = None,
    baseline: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Findings that are accepted, from --write-baseline.")
    ] = None,
    write_baseline: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Accept all that is found: write it to FILE.")
    ] = None,
    changed_since: Annotated[
        str | None,
        typer.Option(
            metavar="REV",
            help="Check only robots with a file, mesh or export that changed since the branch left this commit of "
            "git.",
        ),
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Draw robots that changed, before and after; with --changed-since."),
    ] = None,
    samples: SamplesOption = 200,
    seed: SeedOption = 0,
    tolerance: ToleranceOption = 1e-12,
) -> int:
    """Check everything that should hold in a repository with robots.

    Robot files: are they valid, do they point out likely slips? Exports: are they what the robot files say? Poses: do
    all engines read the table from the exports, or from a new export where there is none? The exit status is 1 if
    anything is found that no baseline accepts; an invalid robot file counts as a finding.

    \b
    Examples:
      dh2sim check
      dh2sim check robots --dir generated
      dh2sim check robots --format github -o report.sarif -o summary.md
      dh2sim check robots --changed-since origin/main --pictures changes
      dh2sim check robots --write-baseline accepted.json
      dh2sim check robots --baseline accepted.json
    """
    tolerance_of(tolerance)
    if pictures is not None and changed_since is None:
        raise typer.BadParameter("needs --changed-since", param_hint="--pictures")
    if baseline is not None and write_baseline is not None:
        raise typer.BadParameter("must not be given together with --write-baseline", param_hint="--baseline")
    if json_ and form not in ("text", "json"):
        raise typer.BadParameter("must not be given together with --format", param_hint="--json")
    from dh2sim.checking.files import find_robot_files
    from dh2sim.checking.findings import Baseline, CheckPart
    from dh2sim.checking.formats import ReportFormat, format_of, report_text
    from dh2sim.checking.run import check_files

    shown = ReportFormat.JSON if json_ else choice(form, ReportFormat, "--format")
    assert shown is not None
    parts = [part for name in words_of(only, "--only") if (part := choice(name, CheckPart, "--only")) is not None]
    forms = [(path, format_of(path)) for path in out or ()]
    accepted = None if baseline is None else Baseline.read(baseline)
    for path in paths or ():
        refuse_other_formats(str(path))
    files = find_robot_files(paths or [Path()])
    with progress_bar("checking", "robots", len(files)) as advance:
        report = check_files(
            files,
            exports=exports,
            parts=parts or list(CheckPart),
            samples=samples,
            seed=seed,
            tolerance=tolerance,
            baseline=accepted,
            changed_since=changed_since,
            advance=advance,
        )
    for path, kind in forms:
        _write(path, report_text(report, kind))
    if write_baseline is not None:
        _write(write_baseline, Baseline.of(report.findings).text())
    drawn: list[Path] = []
    if pictures is not None and changed_since is not None:
        from dh2sim.checking.pictures import draw_changes

        drawn = draw_changes(report, pictures, changed_since)
    sys.stdout.write(report_text(report, shown))
    for path in drawn:
        print(printable(f"dh2sim: drew {path}"), file=sys.stderr)
    if write_baseline is not None:
        count = len(report.findings)
        print(
            printable(f"dh2sim: {write_baseline} accepts {count} {'finding' if count == 1 else 'findings'}"),
            file=sys.stderr,
        )
        return 0
    return 0 if report.ok else FELL_SHORT


def _write(path: Path, text: str) -> None:
    from dh2sim.files import atomic_file

    with atomic_file(path) as draft:
        draft.write_text(text, encoding="utf-8")
