"""``dh2sim convert``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dh2sim.cli.choices import choice
from dh2sim.cli.robot_file import hand_over, require_free


def convert(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="Robot file, or name of a robot that comes with dh2sim.")
    ],
    to: Annotated[str, typer.Option(metavar="standard|modified", help="The convention wanted.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="ROBOT.yaml", help="Write it there. [default: print it]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over a file that exists.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the robot file, and errors.")] = False,
) -> None:
    """Write a robot's table in the other convention.

    a and alpha move by one row; what they leave over at the ends goes to base and tool. The arm stays the same:
    poses of tool0 are compared at 1000 configurations. DH frames 1 to n do not: masses and meshes are moved along.

    \b
    Examples:
      dh2sim convert stanford --to modified
      dh2sim convert my_arm.yaml --to standard -o my_arm_standard.yaml
    """
    from dh2sim.imports.converted import convert_robot
    from dh2sim.robot.load import load_robot
    from dh2sim.robot.spec import Convention

    wanted = choice(to, Convention, "--to", without=(Convention.HAYATI,))
    require_free(out, force=force)
    spec = load_robot(robot)
    folder = Path.cwd() if out is None else out.resolve().parent
    converted = convert_robot(spec, wanted or Convention.STANDARD, folder=folder)
    hand_over(converted.text, out, summary=converted.summary, notes=converted.notes, quiet=quiet)
