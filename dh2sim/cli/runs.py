"""``dh2sim runs``."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import DONE, FELL_SHORT, QuietOption, complain
from dh2sim.cli.output import make_console, progress_bar, size_text, wrapped
from dh2sim.errors import Dh2simError
from dh2sim.messages import counted, did_you_mean, listed, printable, shown

if TYPE_CHECKING:
    from dh2sim.simulate.description import RunDescription

FORMATS = {"parquet": ".parquet", "hdf5": ".h5"}
SHOWN = 5
"""Number of rollouts that stopped early to list."""


def runs(
    paths: Annotated[list[str], typer.Argument(metavar="RUN.zarr", help="Runs made by 'dh2sim rollout'.")],
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON alone: an object for one run, a list for several.")
    ] = False,
    to: Annotated[
        str | None, typer.Option("--to", metavar="parquet|hdf5", help="Convert to this format instead of describing.")
    ] = None,
    verify: Annotated[
        bool,
        typer.Option("--verify", help="Read every chunk, and fail unless all blocks are there and what was written."),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE", help="File to write. [default: RUN.parquet or RUN.h5, beside the run]"
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", "--force", help="Overwrite existing files.")] = False,
    quiet: QuietOption = False,
) -> int:
    """Describe runs, or convert them to other formats.

    Prints robot, controller, the number of rollouts and which of them stopped early, what is recorded, size, speed
    and versions, and how to continue a run that is not complete, and which of its blocks are missing.

    Parquet makes three tables: FILE has a row for every rollout, step and joint, and beside it are FILE's
    .steps.parquet and .rollouts.parquet. HDF5 makes one file, which xarray reads as the same dataset (netCDF-4).

    \b
    Examples:
      dh2sim runs run.zarr
      dh2sim runs *.zarr --json
      dh2sim runs run.zarr --verify
      dh2sim runs run.zarr --to parquet
      dh2sim runs run.zarr --to hdf5 --out results/run.h5
    """
    if to is None:
        if out is not None or overwrite:
            option = "--overwrite" if out is None else "--out"
            raise typer.BadParameter("needs --to: without it nothing is written", param_hint=option)
        return _describe(paths, as_json=as_json, verify=verify)
    if verify:
        raise typer.BadParameter("must not be given together with --to", param_hint="--verify")
    if to not in FORMATS:
        guess = did_you_mean(to, FORMATS)
        raise typer.BadParameter(
            f"{shown(to)} is not one of {', '.join(FORMATS)}.{guess}".rstrip("."), param_hint="--to"
        )
    if as_json:
        raise typer.BadParameter("must not be given together with --to", param_hint="--json")
    if out is not None and len(paths) > 1:
        raise typer.BadParameter("is one file; convert one run at a time", param_hint="--out")
    _convert(paths, to, out, overwrite=overwrite, quiet=quiet)
    return DONE


def _describe(paths: list[str], *, as_json: bool, verify: bool) -> int:
    from dh2sim.simulate.description import describe
    from dh2sim.simulate.store.reader import damaged_blocks

    descriptions: list[RunDescription] = []
    errors: list[Dh2simError] = []
    sound = True
    for path in paths:
        try:
            damaged = damaged_blocks(path) if verify else []
            if damaged:
                sound = False
                complain(f"'{path}': {_blocks_text(damaged)} damaged; resume it to compute them again")
                continue
            descriptions.append(describe(path))
        except Dh2simError as error:
            errors.append(error)
    sound &= not verify or all(description.complete for description in descriptions)
    if as_json:
        if not errors and len(descriptions) == len(paths):
            values = [description.to_json() for description in descriptions]
            print(json.dumps(values[0] if len(values) == 1 else values, indent=2))
    else:
        for number, description in enumerate(descriptions):
            if number:
                print()
            _print(description, verified=verify)
    _raise_last(errors)
    return DONE if sound else FELL_SHORT


def _raise_last(errors: list[Dh2simError]) -> None:
    for error in errors[:-1]:
        complain(error)
    if errors:
        raise errors[-1]


def _convert(paths: list[str], to: str, out: Path | None, *, overwrite: bool, quiet: bool) -> None:
    from dh2sim.simulate.convert.hdf5 import to_hdf5
    from dh2sim.simulate.convert.parquet import to_parquet
    from dh2sim.simulate.description import describe

    convert = {"parquet": to_parquet, "hdf5": to_hdf5}[to]
    for summary in [describe(path) for path in paths]:
        path = summary.path
        target = _beside(path, FORMATS[to]) if out is None else out
        with progress_bar("converting", "rollouts", summary.rollouts, quiet=quiet) as advance:
            written = convert(path, target, overwrite=overwrite, advance=advance)
        if not quiet:
            for file in written:
                print(f"{printable(str(file))}  {size_text(file.stat().st_size)}", flush=True)
        if summary.not_run:
            print(
                f"dh2sim: {summary.not_run:,} of {summary.rollouts:,} rollouts of '{printable(path)}' are "
                "not run yet; their numbers are missing in what was written",
                file=sys.stderr,
            )


def _beside(run: str, suffix: str) -> Path:
    """Return a file beside a run; for one in an object store, a file in the current folder."""
    named = Path(run.rpartition("/")[2] if "://" in run else run)
    if named.name in ("", ".."):
        named = named.resolve()
    return named.with_name(named.name.removesuffix(".zarr") + suffix)


def _blocks_text(blocks: Sequence[int]) -> str:
    """Return numbers of blocks with the verb: 'block 3 is', 'blocks 3, 5 to 8 are'."""
    spans: list[list[int]] = []
    for block in blocks:
        if spans and spans[-1][1] == block - 1:
            spans[-1][1] = block
        else:
            spans.append([block, block])
    texts = [str(first) if first == last else f"{first} to {last}" for first, last in spans]
    return f"block {texts[0]} is" if len(blocks) == 1 else f"blocks {listed(texts)} are"


def _print(description: RunDescription, *, verified: bool) -> None:
    from rich.text import Text

    console = make_console()
    verdict = ("complete", "bold green") if description.complete else ("not complete", "bold yellow")
    console.print(Text.assemble((printable(description.path), "bold"), "  ", verdict), soft_wrap=True)
    for title, lines in _sections(description, verified=verified):
        for number, line in enumerate(lines):
            first = f"  {title if number == 0 else '':<11} "
            text = wrapped(line, first=first, rest=" " * 14, width=max(console.width, 40), commas=title != "command")
            console.print(Text("\n".join(text)), soft_wrap=True)


def _change(key: str, setting: float | str) -> str:
    """Return what is random, and how: ``mass ±10 %``, ``payload 0 to 2``, ``com normal:0.01``."""
    from dh2sim.simulate.quantities import QUANTITIES, key_parts

    quantity = QUANTITIES.get(key_parts(key)[0])
    if isinstance(setting, str) or quantity is None:
        return f"{key} {setting}"
    units = {"gravity": "rad", "push_force": "N"}.get(quantity.variable, quantity.unit.partition(",")[0])
    unit = f" {units}"
    match quantity.kind:
        case "factor":
            return f"{key} ±{100 * setting:g} %"
        case "offset":
            return f"{key} ±{setting:g}{unit}"
        case "size":
            return f"{key} 0 to {setting:g}{unit}"
        case _:
            return f"{key} {setting:g}{unit}"


def _designs(description: RunDescription) -> str:
    """Return which designs a run has, as in 'a2 ±5 %, d3 normal:0.01; 10 rollouts each'."""
    drawn = [
        f"{name} {how}" if ":" in how else f"{name} ±{100 * float(how):g} %" for name, how in description.vary.items()
    ]
    listed = [] if description.designs is None else [f"of {printable(description.designs) or 'a table'}"]
    return f"{', '.join([*listed, *drawn])}; {counted(description.per_design, 'rollout')} each"


def _sections(description: RunDescription, *, verified: bool) -> Iterator[tuple[str, list[str]]]:
    yield "robot", [description.robot]
    yield "controller", [description.controller]
    changes = ", ".join(_change(name, setting) for name, setting in description.randomize.items())
    yield "randomised", [changes or "nothing"]
    if description.vary or description.designs is not None:
        yield "designs", [_designs(description)]
    yield (
        "rollouts",
        [
            _counts(description),
            *_early_stops(description),
            *contacts(description),
            *loops(description),
            *clipped_controls(description),
        ],
    )
    if not description.complete or verified:
        yield "blocks", [_blocks_done(description, verified=verified)]
    every = "every one" if description.every == 1 else f"one in {description.every}"
    yield (
        "steps",
        [f"{description.steps:,} of {description.timestep:g} s = {description.duration:g} s, {every} recorded"],
    )
    yield "integrator", [description.integrator]
    if description.device:
        yield "engine", [f"{description.engine}, on {description.device}"]
    yield "start", [f"{description.start}, seed {description.seed}"]
    yield "recorded", list(_recorded(description))
    yield "size", [_sizes(description)]
    if description.steps_per_second is not None:
        yield "speed", [f"{description.steps_per_second:,.0f} steps/s over {description.seconds:,.3g} s"]
    yield "made", [_moment(description.created), f"with {', '.join(_versions(description))}"]
    if description.command:
        yield "command", [description.command]
    if not description.complete:
        again = description.resume_command
        yield "carry on", [again or "with the same call and resume=True; it was made by the library"]


def _versions(description: RunDescription) -> Iterator[str]:
    packages = {
        "mujoco": "MuJoCo",
        "numpy": "NumPy",
        "python": "Python",
        "mujoco_warp": "MuJoCo Warp",
        "warp": "Warp",
    }
    source = description.versions.get("mujoco_package", "")
    for name, version in description.versions.items():
        if name != "mujoco_package":
            other = f" ({source})" if name == "mujoco" and source not in ("", "mujoco") else ""
            yield f"{packages.get(name, name)} {version}{other}"


def _moment(created: str) -> str:
    try:
        return f"{datetime.fromisoformat(created).astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"
    except ValueError:
        return created


def _blocks_done(description: RunDescription, *, verified: bool) -> str:
    done = f"{description.blocks_done:,} of {description.blocks:,} done{' and verified' if verified else ''}"
    missing = description.blocks_missing
    return f"{done}; {_blocks_text(missing)} missing" if missing else done


def _counts(description: RunDescription) -> str:
    parts = [f"{description.finished:,} finished"]
    if description.unstable:
        parts.append(f"{description.unstable:,} stopped early")
    if description.not_run:
        parts.append(f"{description.not_run:,} not yet run")
    return f"{description.rollouts:,}: {', '.join(parts)}"


def contacts(description: RunDescription) -> list[str]:
    """Return in how many rollouts links touched, and where the first of them did; empty if in none."""
    first = description.first_contact
    if first is None:
        return []
    where = f"{' and '.join(first.links)} in rollout {first.rollout} at {first.time:.4g} s"
    return [f"links touched in {description.touched:,} (first: {where})"]


WIDE = 1e-3
"""Of the size of a mechanism: loops that open further are not closed well."""


def loops(description: RunDescription) -> list[str]:
    """Return how far loops were open at most, and what helps where that is much; empty for a robot without any."""
    found = description.loop_gap
    if found is None:
        return []
    text = f"loops open by at most {1000 * found.gap:.2g} mm, {found.share:.1g} of the size ({found.closure})"
    return [f"{text}; a shorter --timestep closes them better" if found.share > WIDE else text]


def clipped_controls(description: RunDescription) -> list[str]:
    """Return in how many rollouts controls were clipped, of which joints, and what helps; empty if in none."""
    if not description.saturated:
        return []
    from dh2sim.simulate.controllers.registry import slower

    counts = [f"{joint} in {count:,}" for joint, count in description.saturated_joints.items()]
    more = [f"{len(counts) - SHOWN} more joints"] if len(counts) > SHOWN else []
    text = f"controls clipped in {description.saturated:,}: {', '.join([*counts[:SHOWN], *more])}"
    gentler = slower(description.controller)
    return [f"{text}; a longer period takes less: --controller {gentler}" if gentler else text]


def _early_stops(description: RunDescription) -> Iterator[str]:
    """Why rollouts stopped early, and where the first of them did."""
    if not description.stopped:
        return
    reasons = ", ".join(f"{name} {count:,}" for name, count in description.reasons.items())
    yield f"stopped early: {reasons}"
    for each in description.stopped[:SHOWN]:
        time = each.step * description.timestep
        yield f"  rollout {each.rollout}: {each.reason} in step {each.step:,} ({time:.4g} s)"
    if len(description.stopped) > SHOWN:
        yield f"  and {len(description.stopped) - SHOWN:,} more (--json names all)"


def _recorded(description: RunDescription) -> Iterator[str]:
    rows = [
        (name, " x ".join(f"{size:,}" for size in each.shape), ", ".join(each.dimensions))
        for name, each in description.recorded.items()
    ]
    widths = [max(len(row[i]) for row in rows) for i in range(2)]
    for name, shape, dimensions in rows:
        yield f"{name:{widths[0]}}  {shape:{widths[1]}}  {dimensions}"


def _sizes(description: RunDescription) -> str:
    disk, memory = description.bytes_on_disk, description.bytes_in_memory
    if not memory:
        return f"{size_text(disk)} on disk"
    return f"{size_text(disk)} on disk for {size_text(memory)} of numbers ({100 * disk / memory:.0f} %)"
