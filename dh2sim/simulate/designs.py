"""Designs: robots that differ in some numbers of one robot's file, drawn at random or listed in a CSV file."""

from __future__ import annotations

import hashlib
import io
import math
import zlib
from array import array
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from os import PathLike, fspath
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import DesignFileError, Problem, RobotError, SettingsError
from dh2sim.input_files import read_input, utf16_hint
from dh2sim.messages import shown
from dh2sim.robot.expressions import NumberError, to_number
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.variation import Variation
from dh2sim.typing import Array, read_only

STREAM: Final = 16
"""Of random numbers, beside those of ``Purpose``; each name has one of its own below it."""
_MOST_PROBLEMS: Final = 50
"""Of a file, that are reported."""
MOST_FILE_BYTES: Final = 2**27
"""Largest file of designs that is read."""
MOST_NAMES: Final = 1000
MOST_DESIGNS: Final = 10**6
"""Of a file; to check as many takes some minutes."""
MOST_REPORTED: Final = 20
"""Designs that are wrong and reported; those after them are not checked."""
_FORMS: Final = "X (a factor from 1 - X to 1 + X), normal:SD, uniform:LOW:HIGH or loguniform:LOW:HIGH"


@dataclass(frozen=True, slots=True)
class Draw:
    """How a number is drawn."""

    kind: str
    """'share', 'normal', 'uniform' or 'loguniform'."""
    numbers: tuple[float, ...]
    """The share; or the standard deviation; or the bounds."""

    @classmethod
    def parse(cls, given: object) -> Draw:
        """Read ``0.05``, ``normal:0.01``, ``uniform:0.3:0.5`` or ``loguniform:0.3:3``.

        Raises:
            ValueError: It is none of these.
        """
        if isinstance(given, Draw):
            return given
        if isinstance(given, bool) or not isinstance(given, str | float | int):
            raise ValueError(f"must be {_FORMS}, got {shown(given)}")
        kind, *texts = str(given).split(":")
        if kind not in _COUNTS:
            kind, texts = "share", [str(given)]
        try:
            numbers = tuple(float(text) for text in texts)
        except ValueError:
            raise ValueError(f"must be {_FORMS}, got {shown(given)}") from None
        if len(numbers) != _COUNTS[kind] or not all(map(math.isfinite, numbers)):
            raise ValueError(f"must be {_FORMS}, got {shown(given)}")
        if kind == "share" and not 0.0 <= numbers[0] < 1.0:
            raise ValueError(
                f"must be a share of at least 0 and below 1, got {numbers[0]:g}; a list of designs sets numbers"
            )
        if kind == "normal" and numbers[0] < 0.0:
            raise ValueError(f"must have a standard deviation of at least 0, got {numbers[0]:g}")
        if kind in ("uniform", "loguniform") and numbers[0] > numbers[1]:
            raise ValueError(f"must have bounds in ascending order, got {numbers[0]:g} and {numbers[1]:g}")
        if kind == "loguniform" and numbers[0] <= 0.0:
            raise ValueError(f"must have bounds above 0 for loguniform, got {numbers[0]:g}")
        return cls(kind, numbers)

    def __str__(self) -> str:
        """Return the text that ``parse`` reads."""
        texts = [f"{number!r}" for number in self.numbers]
        return texts[0] if self.kind == "share" else ":".join([self.kind, *texts])

    def problem(self, nominal: float) -> str | None:
        """Return why a number of the robot cannot be drawn in this way, or None."""
        if self.kind == "share" and nominal == 0.0:
            return f"is 0 in the robot file, and {self} of that is 0; use normal:SD or uniform:LOW:HIGH"
        if self.kind in ("share", "normal") and math.isnan(nominal):
            return "is not given in the robot file, so that there is nothing to vary it around; use uniform:LOW:HIGH"
        return None

    def value(self, nominal: float, generator: np.random.Generator) -> float:
        """Draw a number."""
        match self.kind:
            case "share":
                return nominal * (1.0 + self.numbers[0] * generator.uniform(-1.0, 1.0))
            case "normal":
                return nominal + self.numbers[0] * generator.standard_normal()
            case "uniform":
                return generator.uniform(self.numbers[0], self.numbers[1])
            case _:
                low, high = map(math.log, self.numbers)
                return min(max(math.exp(generator.uniform(low, high)), self.numbers[0]), self.numbers[1])


_COUNTS: Final = {"share": 1, "normal": 1, "uniform": 2, "loguniform": 2}


def read_draws(given: object) -> Mapping[str, Draw]:
    """Return how numbers are drawn, by name.

    Raises:
        SettingsError: Something is wrong.
    """
    if not isinstance(given, Mapping):
        raise SettingsError([("vary", f"must map names of numbers to how they are drawn, got {given!r}")])
    draws: dict[str, Draw] = {}
    problems = []
    for name, how in given.items():
        try:
            draws[str(name)] = Draw.parse(how)
        except ValueError as error:
            problems.append(("vary", f"{name}: {error}"))
    if problems:
        raise SettingsError(problems)
    return MappingProxyType(draws)


def draws_of(spec: RobotSpec, given: Mapping[str, Any]) -> Mapping[str, Draw]:
    """Return what ``read_draws`` does; its error has the names that are not known as well.

    Raises:
        SettingsError: Something is wrong.
    """
    try:
        return read_draws(given)
    except SettingsError as error:
        raise SettingsError([*error.problems, *unknown_names(spec, given)]) from None


def unknown_names(spec: RobotSpec, given: object) -> list[tuple[str, str]]:
    """Return problems for a ``SettingsError``: names in ``vary`` that are not of numbers of the robot."""
    try:
        Variation(spec, [str(name) for name in given] if isinstance(given, Mapping) else [])
    except RobotError as error:
        return [("vary", str(each)) for each in error.problems]
    return []


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignTable:
    """Designs that are listed: a column for each number that differs."""

    columns: tuple[str, ...]
    values: Array = field(repr=False)
    """In the units of the robot file, shape (designs, columns)."""
    name: str = ""
    """The file; empty for designs made in code."""
    lines: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, np.int32), repr=False)
    """Of the file: that of the names and those of the designs, from 1, shape (1 + designs,)."""
    places: tuple[int, ...] = field(default=(), repr=False)
    """Where the names begin in their line, from 1."""

    @property
    def digest(self) -> str:
        """SHA-256 of names and values."""
        whole = hashlib.sha256("\0".join(self.columns).encode())
        whole.update(self.values.tobytes())
        return whole.hexdigest()

    def __len__(self) -> int:
        """Return the number of designs."""
        return len(self.values)


def read_design_table(given: object) -> DesignTable:
    """Return designs that are listed.

    Args:
        given: A CSV file, whose first line has the names; or a mapping of names to values, such as a data frame.

    Raises:
        DesignFileError: The file is wrong; the error has everything that is.
        SettingsError: It is neither, or the file cannot be read.
    """
    if isinstance(given, DesignTable):
        return given
    if isinstance(given, str | PathLike):
        return _read_csv(fspath(given))
    names: list[str] = []
    columns = []
    try:
        for name, values in given.items():  # type: ignore[attr-defined]
            names.append(str(name))
            columns.append(np.asarray(values, dtype=np.float64))
    except AttributeError:
        raise _refused(f"must be a CSV file, or map names to lists of values, got {given!r}") from None
    except (TypeError, ValueError):
        raise _refused(f"must have numbers for '{names[-1]}'") from None
    if (
        not names
        or any(column.ndim != 1 for column in columns)
        or len({*map(len, columns)}) != 1
        or not len(columns[0])
    ):
        raise _refused("must have a list of values for each name, all of one length of at least 1")
    table = np.column_stack(columns)
    if not np.isfinite(table).all():
        row, column = (int(k) for k in np.argwhere(~np.isfinite(table))[0])
        raise _refused(f"must have finite numbers, got {table[row, column]} for '{names[column]}' of design {row}")
    return DesignTable(columns=tuple(names), values=read_only(table))


def _refused(problem: str) -> SettingsError:
    return SettingsError([("designs", problem)])


def _read_csv(name: str) -> DesignTable:
    """Read a CSV file; lines that are empty or begin with # are passed over."""
    path = Path(name)
    try:
        data = read_input(path, MOST_FILE_BYTES)
    except OSError as error:
        raise _refused(f"cannot be read: {name}: {error.strerror or error}") from error
    if len(data) > MOST_FILE_BYTES:
        raise _refused(f"must be a file of at most {MOST_FILE_BYTES / 2**20:g} MB, got {name}: give it in parts")
    problems: list[Problem] = []

    def wrong(line: int, column: int, message: str, path: str = "") -> None:
        problems.append(Problem(file=name, line=line, column=column, path=path, message=message))

    try:
        data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        message = f"is not UTF-8 text{utf16_hint(data)}"
        wrong(before.count(b"\n") + 1, error.start - before.rfind(b"\n"), message)
        raise DesignFileError(problems) from None
    text = io.TextIOWrapper(io.BytesIO(data), "utf-8-sig")
    rows = (
        (line, row.rstrip("\n"))
        for line, row in enumerate(text, start=1)
        if row.strip(" ,;\t\n") and not row.lstrip().startswith("#")
    )
    first, names = next(rows, (1, ""))
    head = _cells(names)
    columns = [cell for _, cell in head]
    if len(columns) > MOST_NAMES:
        wrong(first, 1, f"found {len(columns)} columns; at most {MOST_NAMES} are allowed")
        raise DesignFileError(problems)
    for index, (place, cell) in enumerate(head):
        if not cell:
            wrong(first, place, f"column {index + 1} has no name")
        elif cell in columns[:index]:
            wrong(first, place, f"duplicate column {shown(cell)}")
    values, lines = array("d"), array("i", [first])
    for line, row in rows:
        if len(lines) > MOST_DESIGNS:
            wrong(line, 1, f"at most {MOST_DESIGNS:,} designs are allowed in a file: give them in parts")
            break
        if len(problems) >= _MOST_PROBLEMS:
            wrong(line, 1, "nothing was read from here on: too many errors")
            break
        lines.append(line)
        try:  # most rows are nothing but plain numbers
            numbers = [float(cell) for cell in row.split(_separator(row))]
        except ValueError:
            numbers = []
        if len(numbers) == len(columns) and math.isfinite(sum(numbers)):
            values.extend(numbers)
            continue
        cells = _cells(row)
        if len(cells) != len(columns):
            wrong(line, 1, f"expected {len(columns)} cells, as in line {first}, found {len(cells)}")
            continue
        for (place, cell), column in zip(cells, columns, strict=True):
            try:
                values.append(_number(cell))
            except NumberError as error:
                wrong(line, place, str(error), column)
    if len(lines) < 2:
        del problems[:]
        wrong(first, 1, "expected a line of names, and a line of numbers for each design")
    if problems:
        raise DesignFileError(problems)
    return DesignTable(
        columns=tuple(columns),
        values=read_only(np.array(values).reshape(-1, len(columns))),
        name=name,
        lines=np.array(lines, dtype=np.int32),
        places=tuple(place for place, _ in head),
    )


def _number(text: str) -> float:
    """Return the number in a cell: an expression of numbers and pi.

    Raises:
        NumberError: It is not one, or not finite.
    """
    try:
        number: object = float(text)
    except ValueError:
        number = text or None
    return to_number(number, {})


def _separator(row: str) -> str:
    return next((mark for mark in "\t;," if mark in row), ",")


def _cells(row: str) -> list[tuple[int, str]]:
    """Return where the cells of a line begin, from 1, and their texts."""
    found, place = [], 0
    for part in row.split(_separator(row)):
        inner = part.strip()
        found.append((place + len(part) - len(part.lstrip()) + 1, inner.strip('"')))
        place += len(part) + 1
    return found


class Designs:
    """The designs of a run or a sweep: their number, and the values and the robot of each."""

    def __init__(
        self, spec: RobotSpec, *, draws: Mapping[str, Draw], table: DesignTable | None, count: int, seed: int
    ) -> None:
        """Look up the names.

        Args:
            spec: The robot that they differ from.
            draws: What is drawn for each design.
            table: What is listed, a row for each design.
            count: Number of designs; that of the table if there is one.
            seed: Of the draws.

        Raises:
            SettingsError: A name is not one of a number of the robot, or a number cannot be drawn as it should be.
        """
        columns = () if table is None else table.columns
        self.names = (*columns, *draws)
        self.count = count if table is None else len(table)
        self._draws, self._table, self._seed = tuple(draws.values()), table, seed
        try:
            self.variation = Variation(spec, self.names)
        except RobotError as error:
            if table is not None and table.name and any(each.path in columns for each in error.problems):
                raise DesignFileError(self._of_head(each) for each in error.problems) from None
            raise SettingsError(
                ("designs" if each.path in columns else "vary", str(each)) for each in error.problems
            ) from None
        self._nominal = self.variation.nominal[len(columns) :]
        wrong = [
            (name, problem)
            for name, draw, nominal in zip(draws, self._draws, self._nominal, strict=True)
            if (problem := draw.problem(nominal))
        ]
        if wrong:
            raise SettingsError(("vary", f"{name}: {problem}") for name, problem in wrong)
        self._keys = [zlib.crc32(name.encode()) for name in draws]

    def _of_head(self, problem: Problem) -> Problem:
        """Return a problem of a name with its place in the file, if it has one."""
        table = self._table
        if table is None or problem.path not in table.columns:
            return problem
        column = table.places[table.columns.index(problem.path)]
        return replace(problem, file=table.name, line=int(table.lines[0]), column=column)

    def settings(self) -> dict[str, Any]:
        """Return what the designs are made from, JSON values; not how many of them there are."""
        drawn_names = self.names[len(self.names) - len(self._draws) :]
        drawn = {name: str(draw) for name, draw in zip(drawn_names, self._draws, strict=True)}
        found: dict[str, Any] = {"vary": drawn, "seed": self._seed} if self._draws else {}
        return found if self._table is None else {**found, "designs_sha256": self._table.digest}

    def values(self, design: int) -> list[float]:
        """Return the values of a design, in the units of the robot file."""
        given = [] if self._table is None else self._table.values[design].tolist()
        drawn = []
        for key, draw, nominal in zip(self._keys, self._draws, self._nominal, strict=True):
            sequence = np.random.SeedSequence(self._seed, spawn_key=(design, STREAM, key))
            drawn.append(draw.value(nominal, np.random.Generator(np.random.PCG64(sequence))))
        return [*given, *map(float, drawn)]

    def name(self, design: int) -> str:
        """Return what messages call a design: its number, from 0, and its values."""
        pairs = zip(self.names, self.values(design), strict=True)
        return f"design {design} ({', '.join(f'{name}={value:.6g}' for name, value in pairs)})"

    def place(self, design: int) -> dict[str, Any]:
        """Return the file and line that a design stands in, for a ``Problem``; empty if it stands in none."""
        table = self._table
        if table is None or not table.name:
            return {}
        return {"file": table.name, "line": int(table.lines[design + 1]), "column": 1}

    def spec(self, design: int) -> RobotSpec:
        """Return the robot of a design.

        Raises:
            RobotError: There is none.
        """
        return self.variation.make(self.values(design))

    def check(self, advance: Callable[[int], None] = lambda _: None) -> None:
        """Check that there is a robot of every design.

        Args:
            advance: Called with the number of designs that were checked since the last call.

        Raises:
            DesignFileError: There is none of some; the error names the first ``MOST_REPORTED`` of them.
            SettingsError: Likewise, for designs that come from no file.
        """
        problems: list[Problem] = []
        wrong = 0
        for design in range(self.count):
            try:
                self.variation.check(self.values(design))
            except RobotError as error:
                wrong += 1
                problems += [self.problem(design, each) for each in error.problems]
                left = self.count - design - 1
                if wrong == MOST_REPORTED and left:
                    rest = f"too many designs are wrong: the {left:,} from here on were not checked"
                    problems.append(Problem(**self.place(design + 1), path="", message=rest))
                    break
            advance(1)
        if problems:
            raise self.error(problems)

    def problem(self, design: int, found: Problem) -> Problem:
        """Return what is wrong with the robot of a design as a problem of that design."""
        message = f"{found.path}: {found.message}" if found.path else found.message
        return Problem(**self.place(design), path=self.name(design), message=message)

    def error(self, problems: Iterable[Problem]) -> DesignFileError | SettingsError:
        """Return the error of designs that are wrong."""
        if self._table is not None and self._table.name:
            return DesignFileError(problems)
        option = "vary" if self._table is None else "designs"
        return SettingsError((option, str(problem)) for problem in problems)
