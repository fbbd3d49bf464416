"""``dh2sim import``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.choices import choice, tolerance_of
from dh2sim.cli.robot_file import hand_over, require_free

if TYPE_CHECKING:
    from dh2sim.imports.imported import Imported


def import_robot(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="URDF, MJCF, or a table in Markdown, CSV or TSV; - reads a table.")
    ],
    base: Annotated[
        str | None, typer.Option(metavar="LINK", help="What becomes base_link. [default: the root]")
    ] = None,
    tip: Annotated[
        str | None, typer.Option(metavar="LINK|SITE", help="What becomes tool0. [default: where the arm ends]")
    ] = None,
    convention: Annotated[
        str | None,
        typer.Option(metavar="standard|modified", help="Of the table made (default standard), or of the table read."),
    ] = None,
    angle: Annotated[str | None, typer.Option(metavar="deg|rad", help="Unit of a table's angles.")] = None,
    length: Annotated[str | None, typer.Option(metavar="m|mm|cm|in", help="Unit of a table's lengths.")] = None,
    tolerance: Annotated[
        float, typer.Option(metavar="T", help="Greatest residual, rad and m; numbers within it are made simple.")
    ] = 1e-9,
    package_path: Annotated[
        list[Path] | None,
        typer.Option(metavar="FOLDER", help="Where package:// is looked for; may be repeated."),
    ] = None,
    name: Annotated[str | None, typer.Option(help="Name of the robot. [default: the file's]")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="ROBOT.yaml", help="Write it there. [default: print it]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over a file that exists.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the robot file, and errors.")] = False,
) -> None:
    """Make a robot file of a URDF, an MJCF, or a table.

    A URDF's or MJCF's joints become DH rows, whatever way their axes lie. All joint axes and the tip are
    compared with the file's own kinematics at 1000 random configurations; a residual above the tolerance is an
    error. Limits, masses, inertias and meshes come along; what cannot is listed. Where axes are nearly parallel
    the row is Hayati's. Angles such as 1.5708 become 90 degrees with --tolerance 1e-4.

    \b
    Examples:
      dh2sim import panda.urdf --tip panda_link8 -o panda.yaml
      dh2sim import arm.xml --base base_link --tip attachment_site
      dh2sim import table.md --convention modified --angle deg -o arm.yaml
      dh2sim import - --convention standard < table.csv
    """
    from dh2sim.imports.files import STDIN, ImportOptions, import_data, read_file
    from dh2sim.robot.spec import Convention
    from dh2sim.robot.units import AngleUnit, LengthUnit

    require_free(out, force=force)
    options = ImportOptions(
        base=base,
        tip=tip,
        convention=choice(convention, Convention, "--convention", without=(Convention.HAYATI,)),
        angle=choice(angle, AngleUnit, "--angle"),
        length=choice(length, LengthUnit, "--length"),
        tolerance=tolerance_of(tolerance),
        package_paths=tuple(package_path or ()),
        name=name,
    )
    folder = Path.cwd() if out is None else out.resolve().parent
    data = sys.stdin.buffer.read() if file == STDIN else read_file(Path(file))
    imported = import_data(data, file, options, folder=folder)
    hand_over(imported.text, out, summary=summary(imported), notes=imported.notes, quiet=quiet)


def summary(imported: Imported) -> str:
    """Return one line on a robot file that was made."""
    from dh2sim.imports.serial import residual_text

    spec = imported.spec
    conventions = list(dict.fromkeys(row.convention.value for row in spec.rows))
    rows = f"{spec.name}, {len(spec.rows)} {'row' if len(spec.rows) == 1 else 'rows'}, {' and '.join(conventions)}"
    residual = imported.residual
    if residual is None:
        return rows
    return f"{rows}; off by at most {residual_text(residual)} at {residual.configurations} configurations"
