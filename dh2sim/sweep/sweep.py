"""Sweeps: measures of many designs, computed by several processes, continued where they were interrupted."""

from __future__ import annotations

import hashlib
import inspect
import math
import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import Any, Final, SupportsIndex, TypedDict

import numpy as np

from dh2sim import arguments
from dh2sim.errors import Dh2simError, MeasureError, OutputError, Problem, RobotError, SettingsError
from dh2sim.messages import counted, listed
from dh2sim.model.build import build_model, model_of
from dh2sim.model.robot_model import RobotModel
from dh2sim.processors import end_with_parent
from dh2sim.robot.read import loaded
from dh2sim.robot.spec import SpecLike
from dh2sim.robot.write import robot_file_text
from dh2sim.simulate.designs import Designs, draws_of, read_design_table
from dh2sim.sweep.journal import Journal
from dh2sim.sweep.measures import MEASURES, UNITS, Sampled, check_measures, load_function, measure
from dh2sim.sweep.table import is_table, require_table, write_table
from dh2sim.typing import Array

CHUNK: Final = 32
"""Designs that a process measures at a time, and that are safe on disk together."""
DEFAULT_MEASURES: Final = ("workspace", "manipulability", "reach", "payload")
DEFAULT_COUNT: Final = 256
MOST_DESIGNS: Final = 10**8
MOST_SAMPLES: Final = 10**6
_VOXELS: Final = 8
"""To the reach of the robot file, by default."""

Rows = list[list[float]]


class SweepKeywords(TypedDict, total=False):
    """What a sweep is made from; each keyword may be left out."""

    vary: Mapping[str, Any]
    designs: Any
    count: SupportsIndex | None
    measure: str | Sequence[str]
    samples: SupportsIndex
    voxel: float | None
    seed: SupportsIndex
    jobs: SupportsIndex
    overwrite: bool
    advance: Callable[[int], None] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Best:
    """The design that a measure is greatest of."""

    design: int
    value: float
    parameters: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """What values of a measure there are."""

    unit: str
    least: float
    mean: float
    best: Best


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sweep:
    """What was measured of designs."""

    robot: str
    parameters: tuple[str, ...]
    """Names of the numbers that differ."""
    measures: Mapping[str, Spread]
    """By column; those that are not finite are left out of the mean, and are not the best."""
    count: int
    """Number of designs."""
    measured: int
    """Of them, those that were measured this time."""
    columns: Mapping[str, Array] = field(repr=False)
    """The whole table by column, each of shape (designs,): ``design``, the parameters in the units of the robot file,
    the measures. Empty where it was written to a file."""

    def __repr__(self) -> str:
        return f"<Sweep of '{self.robot}': {counted(self.count, 'design')}; {listed(self.measures)}>"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """What is measured; it travels to other processes."""

    designs: Designs
    measures: tuple[str, ...]
    samples: int
    voxel: float
    wrap: Callable[[RobotModel], object]

    def rows(self, chunk: int) -> tuple[list[str], Rows]:
        """Return the columns, and a row for each design of a chunk: its values, then its measures.

        Raises:
            Dh2simError: A design has no model, or a measure fails; the error names the design.
        """
        first = chunk * CHUNK
        columns: list[str] = []
        rows = []
        for design in range(first, min(first + CHUNK, self.designs.count)):
            try:
                model = build_model(self.designs.spec(design))
                found = measure(self.measures, Sampled(model, self.samples, self.voxel), self.wrap)
            except RobotError as error:
                raise self.designs.error(self.designs.problem(design, each) for each in error.problems) from None
            except MeasureError as error:
                raise MeasureError(f"{self.designs.name(design)}: {error}") from None
            except Dh2simError as error:
                problem = self.designs.problem(design, Problem(path="", message=str(error)))
                raise self.designs.error([problem]) from None
            if columns and list(found) != columns:
                raise MeasureError(
                    f"{self.designs.name(design)}: its measures are {', '.join(found)}, and those of the designs "
                    f"before {', '.join(columns)}"
                )
            columns = list(found)
            rows.append([*self.designs.values(design), *found.values()])
        return columns, rows


def sweep_designs(
    robot: SpecLike | str | PathLike[str],
    *,
    vary: Mapping[str, Any] | None = None,
    designs: Any = None,
    count: SupportsIndex | None = None,
    measure: str | Sequence[str] = DEFAULT_MEASURES,
    samples: SupportsIndex = 2000,
    voxel: float | None = None,
    seed: SupportsIndex = 0,
    jobs: SupportsIndex = 1,
    out: str | PathLike[str] | None = None,
    overwrite: bool = False,
    advance: Callable[[int], None] | None = None,
    wrap: Callable[[RobotModel], object] = lambda model: model,
) -> Sweep:
    """Measure what each of many designs can do.

    Args:
        robot: The robot, or its file or name.
        vary: Numbers of the robot file that are drawn, and how, as for rollouts.
        designs: A CSV file of designs, or a mapping of names to values, as for rollouts.
        count: Number of designs to draw, 256 by default; with ``designs`` it is that of the table.
        measure: 'workspace', 'manipulability', 'reach', 'payload', or ``module:function`` of your own, which takes a
            robot and returns a number, or numbers by name; several, or one text with commas.
        samples: Number of configurations evaluated for each design.
        voxel: Edge of the voxels of the workspace, m; by default an eighth of the reach of the robot file.
        seed: Of the draws.
        jobs: Number of processes; 0: one for each processor; the result does not depend on it.
        out: File to write, .parquet or .csv; None to keep the table in memory. What was measured is kept beside it,
            and the same call continues it.
        overwrite: Whether to measure again what is there.
        advance: Called with the number of designs that are done since the last call.
        wrap: Makes what functions of one's own are given of the model of a design.

    Raises:
        SettingsError: An option is wrong.
        DesignFileError: Designs of a file are wrong.
        MeasureError: A measure is not known or fails.
        RunDiffersError: What is there was measured with other settings.
        OutputError: The table cannot be written.
    """
    model = model_of(loaded(robot))
    task = prepare_task(
        model,
        vary={} if vary is None else arguments.mapping("vary", vary),
        designs=designs,
        count=count,
        names=measure,
        samples=samples,
        voxel=voxel,
        seed=seed,
        wrap=wrap,
    )
    return measure_designs(model, task, jobs=jobs, out=out, overwrite=overwrite, advance=advance)


def measure_designs(
    model: RobotModel,
    task: Task,
    *,
    jobs: SupportsIndex = 1,
    out: str | PathLike[str] | None = None,
    overwrite: bool = False,
    advance: Callable[[int], None] | None = None,
) -> Sweep:
    """Measure the designs that ``prepare_task`` has checked; the arguments are those of ``sweep_designs``.

    Raises:
        Dh2simError: As ``sweep_designs``.
    """
    processes = _whole("jobs", jobs, 0, 1024) or len(os.sched_getaffinity(0))
    path = None if out is None else Path(out)
    if path is not None:
        require_table(path)
    report = advance or (lambda _: None)
    total = task.designs.count
    with Journal.open(path, settings_of(model, task), overwrite=arguments.flag("overwrite", overwrite)) as journal:
        chunks = range(-(-total // CHUNK))
        sizes = {chunk: min(CHUNK, total - chunk * CHUNK) for chunk in chunks}
        pending = [chunk for chunk in chunks if journal.length(chunk) < sizes[chunk]]
        report(total - sum(sizes[chunk] for chunk in pending))
        for chunk, (columns, rows) in _measured(task, pending, processes):
            journal.add(chunk, columns, rows)
            report(len(rows))
        columns = journal.columns
        parameters = task.designs.names
        units = dict(zip(parameters, task.designs.variation.units, strict=True)) | {
            column: UNITS.get(column, "") for column in columns
        }
        names = (*parameters, *columns)

        def watched() -> tuple[_Summary, Iterator[list[float]]]:
            summary = _Summary(task, columns)
            return summary, summary.watch(_checked_rows(journal, task, sizes))

        summary, seen = watched()
        if path is None:
            table = np.array(list(seen))
            found = {"design": np.arange(total, dtype=np.float64)} | {
                name: table[:, i] for i, name in enumerate(names)
            }
        else:
            try:
                write_table(path, names, units, seen, journal.settings)
            except OutputError:  # nothing needs to be written where the whole table is there
                summary, seen = watched()
                if pending or not is_table(path, names, units, seen, journal.settings):
                    raise
            found = {}
    return Sweep(
        robot=model.name,
        parameters=parameters,
        measures=summary.spreads(),
        count=total,
        measured=sum(sizes[chunk] for chunk in pending),
        columns=found,
    )


def prepare_task(
    model: RobotModel,
    *,
    vary: Mapping[str, Any],
    designs: Any,
    count: SupportsIndex | None,
    names: str | Sequence[str],
    samples: SupportsIndex,
    voxel: float | None,
    seed: SupportsIndex,
    wrap: Callable[[RobotModel], object],
    checked: Callable[[int], None] = lambda _: None,
) -> Task:
    """Check what a sweep is made from; the arguments are those of ``sweep_designs``.

    ``checked`` is called with the number of designs that were checked since the last call.

    Raises:
        SettingsError: An option is wrong.
        DesignFileError: Designs of a file are wrong.
        MeasureError: A measure is not known.
    """
    chosen = tuple(name for given in arguments.names("measure", names) for name in given.split(",") if name.strip())
    chosen = tuple(name.strip() for name in chosen)
    check_measures(chosen)
    draws, table = draws_of(model.spec, vary), None if designs is None else read_design_table(designs)
    if table is None and not draws:
        raise SettingsError([("", "there is nothing to vary: give vary or designs")])
    if table is not None and count is not None:
        raise SettingsError([("count", "must not be given together with designs")])
    if table is not None and (twice := [name for name in draws if name in table.columns]):
        raise SettingsError([("vary", f"must not contain {', '.join(twice)}, which the designs have too")])
    number = DEFAULT_COUNT if count is None else _whole("count", count, 1, MOST_DESIGNS)
    edge = _usual_voxel(model) if voxel is None else arguments.number("voxel", voxel)
    if not (math.isfinite(edge) and edge > 0.0):
        raise SettingsError([("voxel", f"must be above 0 m, got {edge}")])
    task = Task(
        designs=Designs(model.spec, draws=draws, table=table, count=number, seed=_whole("seed", seed, 0, None)),
        measures=chosen,
        samples=_whole("samples", samples, 1, MOST_SAMPLES),
        voxel=edge,
        wrap=wrap,
    )
    task.designs.check(checked)
    return task


def _whole(name: str, value: SupportsIndex, least: int, most: int | None) -> int:
    try:
        number = value.__index__()
    except (AttributeError, TypeError):
        raise SettingsError([(name, f"must be a whole number, got {value!r}")]) from None
    if number < least or (most is not None and number > most):
        allowed = f"at least {least}" if most is None or number < least else f"at most {most:,}"
        raise SettingsError([(name, f"must be {allowed}, got {number}")])
    return number


def _usual_voxel(model: RobotModel) -> float:
    return float(f"{max(model.reach, 1e-6) / _VOXELS:.2g}")


def settings_of(model: RobotModel, task: Task) -> dict[str, Any]:
    """Return what a sweep that is continued must have been made with, JSON values."""
    designs = task.designs
    own: dict[str, Any] = {
        "robot": model.name,
        "robot_sha256": hashlib.sha256(robot_file_text(model.spec).encode()).hexdigest(),
        "parameters": list(designs.names),
        **designs.settings(),
        "measure": list(task.measures),
        "samples": task.samples,
        "voxel": task.voxel,
        "dh2sim": version("dh2sim"),
    }
    for name in task.measures:
        if name not in MEASURES:
            try:
                file = inspect.getsourcefile(inspect.unwrap(load_function(name)))
            except TypeError:  # it is compiled, or an object that can be called
                file = None
            if file is not None:
                own[f"code of {name}"] = hashlib.sha256(Path(file).read_bytes()).hexdigest()
    return own


_task: Task | None = None


def _start(task: Task) -> None:
    global _task
    _task = task
    end_with_parent()


def _rows(chunk: int) -> tuple[int, tuple[list[str], Rows]]:
    assert _task is not None
    return chunk, _task.rows(chunk)


def _measured(task: Task, chunks: Iterable[int], jobs: int) -> Iterator[tuple[int, tuple[list[str], Rows]]]:
    """Yield chunks and what was measured of them, as they are done; only a few are in memory at a time."""
    left = list(chunks)
    if jobs == 1 or len(left) < 2:
        for chunk in left:
            yield chunk, task.rows(chunk)
        return
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(jobs, len(left)), mp_context=context, initializer=_start, initargs=(task,))
    with pool:
        waiting: set[Future[tuple[int, tuple[list[str], Rows]]]] = set()
        remaining = iter(left)
        try:
            while True:
                for chunk in remaining:
                    waiting.add(pool.submit(_rows, chunk))
                    if len(waiting) >= 2 * jobs:
                        break
                if not waiting:
                    return
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for each in done:
                    yield each.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _checked_rows(journal: Journal, task: Task, sizes: Mapping[int, int]) -> Iterator[list[float]]:
    """Yield the rows of all designs; those that a journal had must be of these designs.

    Raises:
        RunDamagedError: They are of others.
    """
    width = len(task.designs.names) + len(journal.columns)
    for chunk, size in sizes.items():
        for design, row in enumerate(journal.rows(chunk)[:size], start=chunk * CHUNK):
            values = [*map(float, task.designs.values(design))]
            if len(row) != width or row[: len(values)] != values:
                journal.damaged()
            yield row


class _Summary:
    """Notes the least, the mean and the best of each measure while rows pass by."""

    def __init__(self, task: Task, columns: Sequence[str]) -> None:
        self._names, self._columns = task.designs.names, tuple(columns)
        self._least = [math.inf] * len(columns)
        self._total, self._count = [0.0] * len(columns), [0] * len(columns)
        self._best: list[tuple[int, list[float]] | None] = [None] * len(columns)

    def watch(self, rows: Iterable[list[float]]) -> Iterator[list[float]]:
        """Yield the rows on."""
        own = len(self._names)
        for design, row in enumerate(rows):
            for i, value in enumerate(row[own:]):
                if not math.isfinite(value):
                    continue
                self._least[i] = min(self._least[i], value)
                self._total[i] += value
                self._count[i] += 1
                best = self._best[i]
                if best is None or value > best[1][own + i]:
                    self._best[i] = design, row
            yield row

    def spreads(self) -> dict[str, Spread]:
        """Return them by column; a measure that is nowhere finite is left out."""
        own, found = len(self._names), {}
        for i, column in enumerate(self._columns):
            best = self._best[i]
            if best is not None:
                design, row = best
                found[column] = Spread(
                    unit=UNITS.get(column, ""),
                    least=self._least[i],
                    mean=self._total[i] / self._count[i],
                    best=Best(
                        design=design,
                        value=row[own + i],
                        parameters=dict(zip(self._names, row[:own], strict=True)),
                    ),
                )
        return found
