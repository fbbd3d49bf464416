"""``dh2sim sweep``: what each of many designs can do."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import QuietOption, RobotArgument, build_serial, named_values
from dh2sim.cli.output import json_text, progress_bar, table_lines
from dh2sim.errors import Dh2simError
from dh2sim.messages import counted, printable

if TYPE_CHECKING:
    from dh2sim.sweep.sweep import Sweep


def sweep(
    robot: RobotArgument,
    designs: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="File of designs: a column for each number.")
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=HOW,…",
            help="Draw numbers of the robot file, with commas or repeated: X (a factor from 1 - X to 1 + X), "
            "normal:SD, uniform:LOW:HIGH or loguniform:LOW:HIGH, in the file's units.",
        ),
    ] = None,
    count: Annotated[
        int | None, typer.Option(metavar="N", help="Number of designs that --vary draws. [default: 256]")
    ] = None,
    measure: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAMES",
            help="What to measure, with commas or repeated: workspace, manipulability, reach, payload, or "
            "MODULE:FUNCTION of your own, which is given a Robot. [default: the first four]",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="Table to write, .parquet or .csv. The same command continues it.",
        ),
    ] = None,
    samples: Annotated[
        int, typer.Option(metavar="N", help="Number of configurations evaluated for each design.")
    ] = 2000,
    voxel: Annotated[
        float | None,
        typer.Option(metavar="M", help="Edge of the workspace's voxels, m. [default: an eighth of the reach]"),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the random number generator.")] = 0,
    jobs: Annotated[
        int, typer.Option(metavar="N", help="Number of processes; 0: one for each processor; changes no result.")
    ] = 1,
    overwrite: Annotated[bool, typer.Option("--overwrite", "--force", help="Measure everything again.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON, alone.")] = False,
    quiet: QuietOption = False,
) -> None:
    """Measure what each of many designs can do, without simulating it.

    A design is the robot with other numbers in its file: parameters, cells such as a2 or theta1, or paths such as
    joint_2.link.mass. What was measured is kept beside the table, so that the same command continues it after an
    interruption, and adds to it with a larger --count.

    \b
    Examples:
      dh2sim sweep stanford --vary d1=uniform:0.3:0.5,d2=0.2 -o arms.csv
      dh2sim sweep puma560 --designs designs.csv --measure reach -o arms.csv
      dh2sim sweep ur5e --vary d4=0.1 --count 32 --measure reach --json
    """
    if not any(vary or ()) and designs is None:
        raise Dh2simError("there is nothing to vary: give --vary or --designs")
    model = build_serial(robot)
    from dh2sim.robot_facade import Robot
    from dh2sim.simulate.designs import read_design_table
    from dh2sim.sweep.sweep import DEFAULT_COUNT, DEFAULT_MEASURES, measure_designs, prepare_task

    draws = named_values(vary, "--vary", "name=how, as in a2=0.05")
    table = None if designs is None else read_design_table(designs)
    total = len(table) if table is not None else DEFAULT_COUNT if count is None else count
    with progress_bar("checking", "designs", total, quiet=quiet) as checked:
        task = prepare_task(
            model,
            vary=draws,
            designs=table,
            count=count,
            names=",".join(measure) if measure else DEFAULT_MEASURES,
            samples=samples,
            voxel=voxel,
            seed=seed,
            wrap=Robot.of_model,
            checked=checked,
        )
    with progress_bar("measuring", "designs", total, quiet=quiet) as advance:
        found = measure_designs(model, task, jobs=jobs, out=out, overwrite=overwrite, advance=advance)
    if as_json:
        print(json_text({**_as_json(found), "out": None if out is None else str(out)}))
    elif not quiet:
        print("\n".join(_lines(found)))
        if out is not None:
            print(printable(f"\nwritten: {out}"))


def _as_json(found: Sweep) -> dict[str, object]:
    return {
        "robot": found.robot,
        "designs": found.count,
        "measured": found.measured,
        "parameters": list(found.parameters),
        "measures": {
            name: {
                "unit": spread.unit,
                "least": spread.least,
                "mean": spread.mean,
                "best": {
                    "design": spread.best.design,
                    "value": spread.best.value,
                    "parameters": dict(spread.best.parameters),
                },
            }
            for name, spread in found.measures.items()
        },
    }


def _lines(found: Sweep) -> list[str]:
    before = found.count - found.measured
    kept = f", {before:,} of them before" if before else ""
    lines = [f"{found.robot}: {counted(found.count, 'design')} measured{kept}", ""]
    table: list[tuple[str, ...]] = [("measure", "least", "mean", "best", "design")]
    for name, spread in found.measures.items():
        values = (f"{value:.5g}" for value in (spread.least, spread.mean, spread.best.value))
        unit = f", {spread.unit}" if spread.unit else ""
        table.append((f"{name}{unit}", *values, str(spread.best.design)))
    lines += [line.rstrip() for line in table_lines(table, left=1)]
    lines.append("")
    for design in dict.fromkeys(spread.best.design for spread in found.measures.values()):
        parameters = next(s.best.parameters for s in found.measures.values() if s.best.design == design)
        pairs = ", ".join(f"{key}={value:.6g}" for key, value in parameters.items())
        lines.append(f"design {design}: {pairs}")
    return [printable(line) for line in lines]
