"""``dh2sim rollout``."""

from __future__ import annotations

import os
import shlex
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import INTERRUPTED, QuietOption, RobotArgument, build_any, named_values
from dh2sim.cli.output import json_text, print_wrapped, progress_bar, size_text
from dh2sim.cli.runs import clipped_controls, contacts, loops
from dh2sim.messages import counted, printable

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    from dh2sim.simulate.block import Job
    from dh2sim.simulate.description import RunDescription
    from dh2sim.simulate.run import Progress


def rollout(
    robot: RobotArgument,
    out: Annotated[
        str,
        typer.Option("--out", "-o", metavar="RUN.zarr", help="Folder to write the run to, or s3://BUCKET/RUN.zarr."),
    ],
    rollouts: Annotated[
        int | None,
        typer.Option(metavar="N", help="Number of rollouts. [default: 256, or one for each of --designs]"),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(metavar="S", help="Duration of each rollout, s. [default: 2, unless --steps is given]"),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(metavar="K", help="Length of each rollout in time steps, in place of --duration.")
    ] = None,
    timestep: Annotated[float, typer.Option(metavar="S", help="Time step, s.")] = 0.002,
    integrator: Annotated[
        str, typer.Option(metavar="NAME", help="Euler, RK4, implicit or implicitfast.")
    ] = "implicitfast",
    controller: Annotated[
        str,
        typer.Option(
            metavar="NAME[:key=value,…]",
            help="passive, hold, gravity-compensation, pd, computed-torque, sine, random, replay, "
            "or your own MODULE:NAME.",
        ),
    ] = "sine",
    start: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="home, zero, random, a configuration of the robot file, or a .csv or .npy file of joint positions; "
            "reference: where the file begins that the controller follows. [default: that, or home]",
            show_default=False,
        ),
    ] = "auto",
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the random number generator.")] = 0,
    threads: Annotated[
        int,
        typer.Option(
            min=0, max=1024, metavar="N", help="Number of threads; 0: one for each processor that it may use."
        ),
    ] = 0,
    record: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAMES",
            help="What to record, with commas or repeated: qpos, qvel, ctrl, tool_pose, reference, qacc, torque, "
            "energy, contacts. [default: the first five]",
        ),
    ] = None,
    every: Annotated[int, typer.Option(metavar="N", help="Record every N-th state.")] = 1,
    randomize: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=X,…|FILE.yaml",
            help="Draw for each rollout, link or joint factors in 1 - X to 1 + X of mass, friction, damping, "
            "armature, gain, kp, kv, effort; offsets in -X to X of com, payload_com, zero, row_length, row_angle, "
            "encoder_bias; payload, gravity (tilt), encoder_noise, sensor_delay, control_delay, push in 0 to X; SI "
            "units. NAME[joint_3]=X for one; X may be uniform:LOW:HIGH, loguniform:LOW:HIGH, normal:SIGMA, fixed:X. "
            "With commas or repeated.",
        ),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=HOW,…",
            help="Draw numbers of the robot file for each rollout: X (a factor from 1 - X to 1 + X), normal:SD, "
            "uniform:LOW:HIGH or loguniform:LOW:HIGH, in the file's units. A parameter of the file, a cell such as "
            "a2 or theta1, or a path such as joint_2.link.mass. With commas or repeated.",
        ),
    ] = None,
    designs: Annotated[
        Path | None,
        typer.Option(metavar="FILE.csv", help="Simulate the designs of a file: a column for each number."),
    ] = None,
    per_design: Annotated[
        int | None, typer.Option(metavar="N", help="Successive rollouts that have one design. [default: 1]")
    ] = None,
    engine: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="mujoco, or warp: MuJoCo Warp, for GPUs, in single precision (extra 'warp', see docs/warp.md).",
        ),
    ] = "mujoco",
    floating_base: Annotated[bool, typer.Option("--floating-base", help="Let base_link move freely.")] = False,
    executor: Annotated[
        str | None,
        typer.Option(
            metavar="WHERE",
            help="Simulate blocks in other processes: local, local:N for N of them, or dask://HOST:PORT for the "
            "workers of a Dask scheduler, which must see the same folder. Each has --threads threads, 1 by default.",
        ),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue an interrupted run, or start it.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", "--force", help="Replace an existing run.")] = False,
    share: Annotated[
        str,
        typer.Option(
            metavar="I/N",
            help="Simulate only the I-th of N shares of the run's blocks, beside other processes, on any machines, "
            "that simulate others. [default: all]",
            show_default=False,
        ),
    ] = "",
    blocks: Annotated[
        str,
        typer.Option(
            metavar="A:B",
            help="The same for blocks A to B - 1 of the run, counted from 0. [default: all]",
            show_default=False,
        ),
    ] = "",
    block_size: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Rollouts in a block. [default: some seconds' work, at most 64 MB]", show_default=False
        ),
    ] = None,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print a description of the run as JSON, as 'dh2sim runs --json' does, alone."),
    ] = False,
    quiet: QuietOption = False,
) -> int:
    """Simulate many rollouts in MuJoCo and write them as a dataset.

    The same seed gives the same bits, with any number of threads and after any interruption: Ctrl-C finishes the
    rollouts in progress, and --resume continues. Unstable rollouts are stopped one by one, and marked. At the end
    the number of rollouts is printed in which links of the robot touched, or an actuator was at its limit.

    With --share a run is made by many processes, in any order and on any machines that see the same folder: each
    simulates its share of the blocks of rollouts, and one that dies is started again. See docs/scale.md.

    \b
    Examples:
      dh2sim rollout stanford --out run.zarr
      dh2sim rollout scara --out run.zarr --controller pd:period=0.5
      dh2sim rollout ur5e --out run.zarr --start random --json -q
      dh2sim rollout my_arm.yaml --out run.zarr --rollouts 100000 --resume
      dh2sim rollout puma560 --out run.zarr --randomize mass=0.2,payload=2
      dh2sim rollout puma560 --out run.zarr --vary a2=0.05,d3=normal:0.01
      dh2sim rollout stanford --out run.zarr --rollouts 100000 --share 3/16
    Then:
      dh2sim runs run.zarr               what it contains
      dh2sim plot run.zarr --what joints
      dh2sim render run.zarr
    """
    model = build_any([robot])[0]
    from dh2sim.simulate.description import describe
    from dh2sim.simulate.options import DEFAULT_RECORD
    from dh2sim.simulate.prepare import options_for, prepare
    from dh2sim.simulate.run import check_share, choose_blocks, fill, open_run, with_block_size, workers_of

    options = options_for(
        model,
        rollouts=rollouts,  # type: ignore[arg-type]  # None is as if it were not given
        steps=steps,
        duration=duration,
        timestep=timestep,
        integrator=integrator,
        controller=controller,
        start=start,
        seed=seed,
        record=",".join(record) if record else DEFAULT_RECORD,
        every=every,
        randomize=_randomized(randomize),
        vary=named_values(vary, "--vary", "name=how, as in a2=0.05"),
        designs=None if designs is None else str(designs),
        per_design=per_design,
        engine=engine,
        floating_base=floating_base,
    )
    part, named, sharing = _share(share), _blocks(blocks), bool(share or blocks)
    check_share(part, alone=named is None)
    count = -(-options.rollouts // options.per_design)
    one = not options.vary and options.designs is None
    with progress_bar("checking", "designs", count, quiet=quiet or one) as checked:
        job = prepare(model, options, command=shlex.join(["dh2sim", *sys.argv[1:]]), checked=checked)
    job = with_block_size(job, block_size)
    if not os.path.lexists(out):
        _named(named, job.layout.blocks)  # makes no run that nothing is put into
    with (
        workers_of(executor, job) as workers,
        open_run(job, out, resume=resume, overwrite=overwrite, join=sharing) as writer,
    ):
        count = writer.layout.blocks
        chosen = choose_blocks(count, share=part, blocks=_named(named, count))
        total = sum(len(writer.layout.rollouts(block)) for block in chosen)
        with _patient(quiet) as patience, progress_bar("simulating", "rollouts", total, quiet=quiet) as advance:
            progress = fill(
                writer,
                job,
                blocks=chosen,
                threads=threads,
                workers=workers,
                advance=advance,
                stopping=lambda: patience.arrived is not None,
            )
        saved = total - sum(len(writer.layout.rollouts(block)) for block in writer.pending(chosen))
    summary = describe(out) if as_json or not sharing else None
    if not quiet:
        with redirect_stdout(sys.stderr) if as_json else nullcontext():
            if sharing:
                _print_part(job, progress, out, which=f"{len(chosen):,} of {count:,} blocks", rollouts=total)
            elif summary is not None:
                _print_summary(job, summary, progress, out)
    if as_json and summary is not None:
        print(json_text(summary.to_json()))
    if progress.finished:
        return 0
    print(
        f"dh2sim: interrupted; {saved:,} of {total:,} rollouts are saved in {printable(out)}. Continue with the same "
        f"command{'' if sharing else ' and --resume'}",
        file=sys.stderr,
    )
    return INTERRUPTED if patience.arrived == signal.SIGINT else 128 + int(patience.arrived or 0)


def _share(text: str) -> tuple[int, int] | None:
    """Read ``I/N``."""
    if not text:
        return None
    index, slash, count = text.partition("/")
    if not (slash and _is_number(index) and _is_number(count)):
        raise typer.BadParameter(f"'{text}' is not of the form I/N, as in 3/16", param_hint="--share")
    return int(index), int(count)


def _blocks(text: str) -> slice | None:
    """Read ``A:B``, of which either may be left out, or a single number."""
    if not text:
        return None
    first, colon, end = text.partition(":")
    if not all(not word or _is_number(word) for word in (first, end)) or (not colon and not first):
        raise typer.BadParameter(f"'{text}' is not of the form A:B, as in 10:20", param_hint="--blocks")
    if not colon:
        return slice(int(first), int(first) + 1)
    if first and end and int(first) >= int(end):
        raise typer.BadParameter(f"'{text}' ends before it begins", param_hint="--blocks")
    return slice(int(first or 0), int(end) if end else None)


def _named(blocks: slice | None, count: int) -> range | None:
    """Return the blocks of a run of ``count`` that are named, of which there must be some but for ``:0``."""
    chosen = None if blocks is None else range(count)[blocks]
    if blocks is not None and not chosen and blocks.stop != 0:
        there = "only block 0" if count == 1 else f"blocks 0 to {count - 1}"
        found = f"{blocks.start}:{blocks.stop or ''}"
        raise typer.BadParameter(f"must be of the run, which has {there}; got {found}", param_hint="--blocks")
    return chosen


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) < 19


def _randomized(texts: list[str] | None) -> dict[str, float | str]:
    """Read ``name=value,…``, or the file that is named."""
    match texts:
        case [text] if text.strip().lower().endswith((".yaml", ".yml")):
            from dh2sim.simulate.randomization_file import read_randomization

            return read_randomization(text.strip())
    settings: dict[str, float | str] = {}
    for name, value in named_values(texts, "--randomize", "name=value, as in mass=0.1 or com=normal:0.01").items():
        try:
            settings[name] = float(value)
        except ValueError:
            settings[name] = value
    return settings


@dataclass
class _Patience:
    """Whether somebody has asked for an end."""

    arrived: int | None = None


@contextmanager
def _patient(quiet: bool) -> Iterator[_Patience]:
    """Let a first SIGINT or SIGTERM wait until the rollouts in progress are saved; a second one stops at once."""
    patience = _Patience()
    previous: dict[signal.Signals, Callable[[int, FrameType | None], None] | int | None] = {}

    def note(number: int, _frame: FrameType | None) -> None:
        patience.arrived = number
        for kind, handler in previous.items():
            signal.signal(kind, signal.SIG_DFL if handler is None else handler)
        if not quiet:
            print("dh2sim: finishing the rollouts in progress; interrupt again to stop at once", file=sys.stderr)

    for kind in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(kind) is not signal.SIG_IGN:
            previous[kind] = signal.signal(kind, note)
    try:
        yield patience
    finally:
        for kind, handler in previous.items():
            signal.signal(kind, signal.SIG_DFL if handler is None else handler)


def _print_part(job: Job, progress: Progress, out: str, *, which: str, rollouts: int) -> None:
    """Print what became of a part of a run, without reading what others have written."""
    from dh2sim.simulate.store.reader import open_run

    robot, controller = job.layout.attributes["robot"], str(job.options.controller)
    print_wrapped(f"{robot}: {which}, {rollouts:,} rollouts, {controller}, in {out}", commas=True)
    if rollouts:
        _print_speed(job, progress)
    run = open_run(out)
    done, count = len(run.recorded_blocks()), run.manifest.blocks
    print(f"  the run has {done:,} of {count:,} blocks{': it is complete' if done == count else ''}")


def _print_speed(job: Job, progress: Progress) -> None:
    if not progress.rollouts:
        print("  all of them were simulated before")
        return
    rate = progress.rollouts * job.options.steps / progress.seconds
    took = f"{progress.seconds:.1f}" if progress.seconds >= 1.0 else f"{progress.seconds:.2g}"
    print(f"  simulated {progress.rollouts:,} in {took} s: {rate:,.0f} steps/s")


def _print_summary(job: Job, summary: RunDescription, progress: Progress, out: str) -> None:
    options = job.options
    print_wrapped(
        f"{summary.robot}: {counted(summary.rollouts, 'rollout')} of {counted(summary.steps, 'step')} "
        f"({summary.duration:g} s), {options.controller}, in {out}",
        commas=True,
    )
    _print_speed(job, progress)
    recorded = [each.name for each in job.layout.variables if {"step", "interval"} & {*each.dimensions}]
    print_wrapped(f"recorded {', '.join(recorded)}: {size_text(summary.bytes_on_disk)}", first="  ", rest="    ")
    counts = [f"finished {summary.finished:,}"]
    if summary.unstable:
        reasons = ", ".join(f"{reason} {count:,}" for reason, count in summary.reasons.items())
        counts.append(f"stopped early {summary.unstable:,} ({reasons})")
    if summary.not_run:
        counts.append(f"not run {summary.not_run:,}")
    counts += [*contacts(summary), *loops(summary), *clipped_controls(summary)]
    print_wrapped(", ".join(counts), first="  ", rest="    ", commas=True)
