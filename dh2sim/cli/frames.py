"""``dh2sim frames``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from dh2sim.cli.choices import choice, tolerance_of
from dh2sim.cli.import_robot import summary
from dh2sim.cli.robot_file import hand_over, require_free


def frames(
    axes: Annotated[str, typer.Argument(metavar="AXES.yaml", help="Joint axes: points and directions.")],
    convention: Annotated[
        str | None, typer.Option(metavar="standard|modified", help="Of the table. [default: the file's, or standard]")
    ] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="Tell every step at the head of the robot file, and draw the frames.")
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw them: .svg, .png or .pdf. [with --explain: NAME-frames.svg]"),
    ] = None,
    tolerance: Annotated[
        float, typer.Option(metavar="T", help="Greatest residual, rad and m; numbers within it are made simple.")
    ] = 1e-9,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="ROBOT.yaml", help="Write it there. [default: print it]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over files that exist.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the robot file, and errors.")] = False,
) -> None:
    """Assign DH frames to joint axes, step by step as in a textbook.

    The file lists the axes, base first, in base_link at joint coordinates zero:

    \b
      name: two_joints
      axes:
        - {type: revolute, point: [0, 0, 0], direction: [0, 0, 1]}
        - {type: prismatic, direction: [1, 0, 0]}
      tool: {xyz: [0.5, 0, 0.2]}

    Every case is met: axes that intersect, are parallel, antiparallel, coincident, skew or nearly parallel.

    \b
    Examples:
      dh2sim frames axes.yaml
      dh2sim frames axes.yaml --explain -o arm.yaml
    """
    from dh2sim.imports.axes import import_axes
    from dh2sim.imports.files import read_file
    from dh2sim.robot.axes.load import read_axes
    from dh2sim.robot.spec import Convention

    wanted = choice(convention, Convention, "--convention", without=(Convention.HAYATI,))
    allowed = tolerance_of(tolerance)
    if picture is not None:
        _require_picture_ending(picture)
    require_free(out, force=force)
    spec = read_axes(read_file(Path(axes)), file=axes, directory=Path(axes).parent)
    drawing = picture
    if drawing is None and explain:
        drawing = (out.parent if out is not None else Path()) / f"{spec.name}-frames.svg"
    require_free(drawing, force=force)
    folder = Path.cwd() if out is None else out.resolve().parent
    imported = import_axes(spec, convention=wanted, tolerance=allowed, explain=explain, folder=folder)
    hand_over(imported.text, out, summary=summary(imported), notes=imported.notes, quiet=quiet)
    if drawing is not None:
        from dh2sim.imports.picture.picture import draw_assignment

        draw_assignment(imported, drawing)
        if not quiet:
            print(f"{drawing}: axes and frames", file=sys.stderr if out is None else sys.stdout)


def _require_picture_ending(path: Path) -> None:
    from dh2sim.imports.picture.picture import require_picture_ending

    require_picture_ending(path)
