"""``dh2sim grade``: students' tables against a solution."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import DONE, FELL_SHORT, ForceOption, JsonOption, choice, complete_robot, tolerance_of
from dh2sim.cli.diff import print_item
from dh2sim.cli.output import json_text, require_free, table_lines
from dh2sim.errors import Dh2simError
from dh2sim.messages import listed, printable

if TYPE_CHECKING:
    from dh2sim.compare.grading import Grade


def grade(
    solution: Annotated[
        str,
        typer.Argument(
            metavar="SOLUTION",
            help="The right robot: a robot file, another file that dh2sim reads, or a name.",
            autocompletion=complete_robot,
        ),
    ],
    submissions: Annotated[
        list[Path],
        typer.Argument(metavar="SUBMISSION", help="Files with students' tables, or folders of them."),
    ],
    rubric: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Points by what is wrong. [default: 10, and shares of them]")
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(metavar="T", help="Largest difference of tool0: rad, and m for a reach of up to 1 m."),
    ] = 1e-3,
    convention: Annotated[
        str | None,
        typer.Option(metavar="standard|modified", help="Convention of tables that do not say it."),
    ] = None,
    angle: Annotated[
        str | None, typer.Option(metavar="deg|rad", help="Unit of angles of tables that do not say it.")
    ] = None,
    length: Annotated[
        str | None, typer.Option(metavar="m|mm|cm|in", help="Unit of lengths of tables that do not say it.")
    ] = None,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print CSV, a line for each submission.")] = False,
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="CLASS.csv", help="Write CSV to a file.")] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> int:
    """Grade students' tables against a solution.

    A table that is equal up to the free choices of frames is right. Otherwise the misreading is named, as by 'dh2sim
    diff', and gives its points; what cannot be read is graded as unreadable.

    Exit status: 0 all have full points, 1 some have not, 2 bad input.

    \b
    Examples:
      dh2sim grade solution.yaml anna.yaml ben.csv
      dh2sim grade solution.yaml hand_in/ --rubric rubric.yaml -o class.csv
    """
    from dh2sim.compare.grading import class_csv, read_rubric
    from dh2sim.compare.grading import grade as graded
    from dh2sim.importing.sources import ImportOptions
    from dh2sim.robot.row import CONVENTIONS, Convention
    from dh2sim.robot.units import AngleUnit, LengthUnit

    if as_csv and as_json:
        raise typer.BadParameter("must not be given together with --json", param_hint="--csv")
    options = ImportOptions(
        convention=choice(
            convention, Convention, "--convention", without=(Convention.HAYATI,), other_names=CONVENTIONS
        ),
        angle=choice(angle, AngleUnit, "--angle"),
        length=choice(length, LengthUnit, "--length"),
    )
    allowed = tolerance_of(tolerance)
    require_free(out, force=force)
    files = _files(submissions)
    grades = graded(
        solution, files, rubric=None if rubric is None else read_rubric(rubric), tolerance=allowed, options=options
    )
    if out is not None:
        from dh2sim.files import atomic_file

        with atomic_file(out) as draft:
            draft.write_text(class_csv(grades), encoding="utf-8")
    if as_json:
        print(json_text([given.to_dict() for given in grades], ensure_ascii=False))
    elif as_csv:
        print(class_csv(grades), end="")
    else:
        _print(grades)
        if out is not None:
            print(printable(f"\n{out}: {len(grades)} submissions"))
    return DONE if all(given.full for given in grades) else FELL_SHORT


def _files(paths: Sequence[Path]) -> list[Path]:
    """Return the files that are named, and those in folders that are.

    Raises:
        Dh2simError: There are no such files.
    """
    missing = [str(path) for path in paths if not path.exists()]
    if missing:
        raise Dh2simError(f"no such file or folder: {listed(missing)}")
    files = []
    for path in paths:
        inner = sorted(entry for entry in path.iterdir() if entry.is_file()) if path.is_dir() else [path]
        files += [file for file in inner if not file.name.startswith(".")]
    if not files:
        raise Dh2simError(f"there are no files in {listed(str(path) for path in paths)}")
    return files


def _print(grades: Sequence[Grade]) -> None:
    for given in grades:
        print(printable(f"{given.submission}: {given.points:g} of {given.out_of:g}, {given.outcome}"))
        for comment in given.comments:
            print_item(comment)
    if len(grades) > 1:
        counts = Counter(given.outcome for given in grades)
        print()
        rows = [["outcome", "submissions"], *([outcome, str(count)] for outcome, count in counts.most_common())]
        print("\n".join(table_lines(rows, left=1)))
        mean = sum(given.points for given in grades) / len(grades)
        print(f"\nmean {mean:.4g} of {grades[0].out_of:g} points")
