"""``dh2sim draw``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from dh2sim.cli.common import MANY, RobotArgument, load_one
from dh2sim.cli.joint_vector import (
    DegreesOption,
    QArgument,
    RadiansOption,
    read_joint_vector,
    warn_open_loops,
)
from dh2sim.messages import printable


def draw(
    robot: RobotArgument,
    q: QArgument = None,
    configuration: Annotated[
        str | None, typer.Option(metavar="NAME", help="Configuration in place of Q. [default: home]")
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option("--as", metavar="svg|tikz|png|pdf", help="Format. [default: by the ending of --out, else svg]"),
    ] = None,
    style: Annotated[
        str,
        typer.Option(
            metavar="kinematic|frames|stick",
            help="kinematic: joints as cylinders and boxes, axes, frames, lengths. frames: all axes of the frames. "
            "stick: a stick plot in the box of the workspace.",
        ),
    ] = "kinematic",
    workspace: Annotated[
        str | None,
        typer.Option(
            metavar="XMIN XMAX YMIN YMAX ZMIN ZMAX", help="Box of a stick plot, m. [default: a cube around the arm]"
        ),
    ] = None,
    reach: Annotated[
        float | None,
        typer.Option(
            metavar="R", help="Length that joints and axes of a stick plot are scaled by, m. [default: the arm's]"
        ),
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(
            "--out", "-o", metavar="FILE|-", help="File to write; - prints svg or tikz. [default: ROBOT.svg]"
        ),
    ] = None,
    degrees: DegreesOption = False,
    radians: RadiansOption = False,
) -> None:
    """Draw a robot as textbooks do: its kinematic diagram, its frames, or a stick plot.

    Without Q the robot is at its configuration 'home', or at zero moved inside the limits if its file has none. SVG
    and TikZ need no other package; PNG and PDF need the extra 'plot'. The same robot gives the same bytes. Mechanisms
    are drawn with the joints that close their loops, the driven ones coloured.

    \b
    Examples:
      dh2sim draw stanford
      dh2sim draw puma560 --style frames --out puma.pdf
      dh2sim draw scara 30 -45 0.1 0 --as tikz -o scara.tex
      dh2sim draw four_bar 120 -o four_bar.png
      dh2sim draw stanford 45 60 0.2 45 0 -60 --style stick
        --workspace -1 1 -1 1 -1 1 --reach 1 -o stanford.png
    """
    from dh2sim.draw.diagram.drawing import DrawingFormat, draw_robot, format_of
    from dh2sim.kinematics.tree import build_tree
    from dh2sim.messages import member

    if q and configuration is not None:
        raise typer.BadParameter("gives the configuration already; leave Q out", param_hint="--configuration")
    spec = load_one(robot)
    texts = [configuration] if configuration is not None else q
    vector = read_joint_vector(spec, texts, degrees=degrees, radians=radians)
    if spec.is_mechanism:
        warn_open_loops(build_tree(spec), vector)
    format_ = DrawingFormat.SVG if kind is None else member(DrawingFormat, kind, "format")
    path = None if out == "-" else Path(f"{spec.name}.{format_.value}") if out is None else Path(out)
    if kind is None and path is not None:
        format_ = format_of(path)
    drawing = draw_robot(
        spec, vector.q, style=style, workspace=None if workspace is None else _numbers(workspace), reach=reach
    )
    if path is None:
        if format_ not in (DrawingFormat.SVG, DrawingFormat.TIKZ):
            raise typer.BadParameter("prints svg or tikz; name a file for png or pdf", param_hint="--out -")
        sys.stdout.write(drawing.svg if format_ is DrawingFormat.SVG else drawing.tikz)
        return
    drawing.save(path, format_)
    print(printable(f"{path}: {spec.name}, {style}, {vector}"))


def _numbers(text: str) -> list[float]:
    words = text.replace(MANY, " ").replace(",", " ").split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != 6:
        raise typer.BadParameter(
            f"must be six numbers, least and greatest x, y and z, m, got '{' '.join(words)}'",
            param_hint="--workspace",
        )
    return numbers
