"""The commands of the ``dh2sim`` program."""

from __future__ import annotations

from typing import Annotated

import typer

from dh2sim.cli.common import guarded
from dh2sim.cli.export import export
from dh2sim.cli.fk import fk
from dh2sim.cli.importing import convert, frames, import_robot
from dh2sim.cli.info import info
from dh2sim.cli.pictures import plot, render
from dh2sim.cli.robots import list_robots, schema
from dh2sim.cli.rollout import rollout
from dh2sim.cli.runs import runs
from dh2sim.cli.validate import validate
from dh2sim.cli.view import view

HELP = """\
From a Denavit-Hartenberg table to a simulated robot that provably matches it.

\b
Examples:
  dh2sim list                        the robots that come with it
  dh2sim info stanford               its table, frames, mass and reach
  dh2sim export stanford             write URDF and MJCF to generated/stanford/
  dh2sim validate stanford           check every engine against the table
  dh2sim fk stanford 0.3 -0.7 0.5 1.1 0.6 -0.4
  dh2sim view stanford --export stanford.html
  dh2sim import arm.urdf -o arm.yaml
  dh2sim convert stanford --to modified
  dh2sim frames axes.yaml            from joint axes to a table
  dh2sim rollout stanford --out run.zarr
  dh2sim runs run.zarr               what a run holds
  dh2sim plot run.zarr               how its joints move
  dh2sim render run.zarr             a film of it

ROBOT is the path of a robot file, or the name of a robot that comes with dh2sim.

Exit status: 0 done, 1 a check fell short, 2 bad input or usage, 130 interrupted.
"""

# Plain help texts: importing rich for them would double the time that --help takes.
app = typer.Typer(
    help=HELP,
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"dh2sim {version('dh2sim')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Hold the options of the program itself."""


app.command(short_help="Write URDF and MJCF, verified against the table.")(guarded(export))
app.command(short_help="Check every engine against the table.")(guarded(validate))
# a negative number is no option
app.command(context_settings={"ignore_unknown_options": True}, short_help="Print the pose of a frame.")(guarded(fk))
app.command(short_help="Print the table, frames, mass and reach.")(guarded(info))
app.command(short_help="See a robot in the browser, and edit its table.")(guarded(view))
app.command("import", short_help="Make a robot file of a URDF, an MJCF or a table.")(guarded(import_robot))
app.command(short_help="Write a table in the other convention.")(guarded(convert))
app.command(short_help="Assign DH frames to joint axes, step by step.")(guarded(frames))
app.command(short_help="Simulate many rollouts into a dataset.")(guarded(rollout))
app.command(short_help="Render a rollout as a film, or a robot.")(guarded(render))
app.command(short_help="Plot joints, tool, energy or tracking.")(guarded(plot))
app.command(short_help="Tell what a run holds, or convert it to Parquet or HDF5.")(guarded(runs))
app.command("list", short_help="List the robots that come with dh2sim.")(guarded(list_robots))
app.command(short_help="Print the JSON Schema of robot files.")(guarded(schema))
