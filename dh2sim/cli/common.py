"""How a command ends: what is told where, and with which exit status.

Options that take one of a few words.

What prints in colour and in tables.

A bar that shows how far long work has come.

Sizes as people read them.

How commands that make robot files hand them over.
"""

from __future__ import annotations

import functools
import math
import os
import sys
import textwrap
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import typer

from dh2sim.errors import Dh2simError, MismatchError, OutputError, RobotFileError, SettingsError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from dh2sim.model.robot_model import RobotModel
    from dh2sim.robot.spec import RobotSpec

Word = TypeVar("Word", bound=StrEnum)


def choice(text: str | None, words: type[Word], option: str, *, without: tuple[Word, ...] = ()) -> Word | None:
    """Return the word of an enumeration that an option was given, None where it was not given.

    Raises:
        BadParameter: it is none of them.
    """
    if text is None:
        return None
    allowed = [word for word in words if word not in without]
    found = next((word for word in allowed if word.value == text.lower()), None)
    if found is None:
        from dh2sim.messages import did_you_mean, shown

        names = [word.value for word in allowed]
        hint = did_you_mean(text, names)
        raise typer.BadParameter(f"{shown(text)} is none of {', '.join(names)}.{hint}".rstrip("."), param_hint=option)
    return found


def tolerance_of(value: float) -> float:
    """Return a tolerance.

    Raises:
        BadParameter: it is not above 0 and below 1.
    """
    if not (math.isfinite(value) and 0.0 < value < 1.0):
        raise typer.BadParameter(f"{value} is not between 0 and 1", param_hint="--tolerance")
    return value


WIDEST = 1000
"""Columns; more than any table has."""


def make_console(width: int | None = None) -> Console:
    """Return a console on standard output, by default as wide as the terminal."""
    from rich.console import Console

    class PlainSpoken(Console):
        """Leaves it to the command what comes of a reader that has had enough; rich would end the program."""

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

    return PlainSpoken(highlight=False, width=width)


def print_whole(table: Table) -> None:
    """Print a table at the width it needs, however narrow the terminal: no column is cut short or left out."""
    make_console(WIDEST).print(table)


@contextmanager
def progress_bar(doing: str, what: str, total: int, *, quiet: bool = False) -> Iterator[Callable[[int], None]]:
    """Show a bar on standard error if that is a terminal; it vanishes in the end.

    Args:
        doing: what is done, as in 'comparing'.
        what: what is counted, as in 'poses'.
        total: how many there are.
        quiet: show nothing.

    Yields:
        A function to call with how many are done since the last call.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    with Progress(
        TextColumn(doing),
        BarColumn(),
        TextColumn("{task.completed:,.0f} of {task.total:,.0f} " + what),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    ) as bar:
        task = bar.add_task("", total=total)
        yield lambda done: bar.advance(task, done)


def size_text(count: int) -> str:
    """Return a number of bytes as in '12.3 MB'."""
    size, unit = float(count), "B"
    for larger in ("kB", "MB", "GB", "TB"):
        if size < 999.95:
            break
        size, unit = size / 1000.0, larger
    return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"


def require_free(out: Path | None, *, force: bool) -> None:
    """Refuse to write over a file, unless asked to.

    Raises:
        OutputError: There is a file, or no folder to put one in.
    """
    if out is None:
        return
    if out.is_dir():
        raise OutputError(f"cannot write '{out}': that is a folder")
    if not out.parent.is_dir():
        raise OutputError(f"cannot write '{out}': there is no folder '{out.parent}'")
    if out.exists() and not force:
        raise OutputError(f"'{out}' exists already; choose another name, or write over it with --force")


def hand_over(text: str, out: Path | None, *, summary: str, notes: Iterable[str] = (), quiet: bool = False) -> None:
    """Print a robot file, or write it whole; what there is to say of it goes where it does not mix with the file.

    Raises:
        OutputError: It cannot be written; what stood there before stands untouched.
    """
    if out is None:
        sys.stdout.write(text)
        sys.stdout.flush()
    else:
        from dh2sim.files import atomic_file

        with atomic_file(out) as draft:
            draft.write_text(text, encoding="utf-8")
    if quiet:
        return
    for note in notes:
        text = textwrap.fill(f"dh2sim: note: {note}", 80, subsequent_indent="  ", break_on_hyphens=False)
        print(text, file=sys.stderr)
    where = "" if out is None else f"{out}: "
    print(f"{where}{summary}", file=sys.stderr if out is None else sys.stdout)


P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")

_DRAWING = "gl_context.py"  # of MuJoCo
DONE, FELL_SHORT, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def guarded(command: Callable[P, int | None]) -> Callable[P, None]:
    """Turn what a command returns or raises into an exit status; errors go to standard error, without a traceback."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            status = command(*args, **kwargs) or DONE
            sys.stdout.flush()
        except Dh2simError as error:
            status = complain(error)
        except BrokenPipeError:
            # whoever read our output has had enough; a second complaint at exit is not wanted either
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            status = DONE
        except OSError as error:
            where = f"{error.filename}: " if error.filename else ""
            status = complain(f"{where}{error.strerror or error}")
        except MemoryError:
            status = complain("there is not enough memory for that")
        except (RuntimeError, ImportError, AttributeError) as error:
            if not _blames_drawing(error):
                raise
            chosen = os.environ.get("MUJOCO_GL")
            status = complain(f"MuJoCo cannot be imported with MUJOCO_GL={chosen}: {error}. Unset that variable")
        except KeyboardInterrupt:
            status = INTERRUPTED  # of which ``main`` tells
        raise SystemExit(status)

    return run


def _blames_drawing(error: BaseException) -> bool:
    """Whether MuJoCo failed to import what the environment variable MUJOCO_GL tells it to draw with."""
    frames = traceback.extract_tb(error.__traceback__)
    return "MUJOCO_GL" in os.environ and any(Path(frame.filename).name == _DRAWING for frame in frames)


def complain(error: object) -> int:
    """Print an error and return its exit status; problems of robot files and settings have a line each."""
    match error:
        case RobotFileError():
            text = str(error)
        case SettingsError():
            options = ((name and f"--{name.replace('_', '-')} ", message) for name, message in error.problems)
            text = "\n".join(f"dh2sim: {option}{message}" for option, message in options)
        case _:
            text = f"dh2sim: {error}"
    print(text, file=sys.stderr)
    return FELL_SHORT if isinstance(error, MismatchError) else BAD_INPUT


def load_all(robots: Sequence[str]) -> list[RobotSpec]:
    """Read robot files, and tell the errors of all of them at once.

    Raises:
        Dh2simError: files are wrong, not found or cannot be read; the last error, after the others were printed.
    """
    from dh2sim.robot.read import load_robot

    return _all(load_robot, robots)


def build_all(robots: Sequence[str]) -> list[RobotModel]:
    """Read robot files and build their models, and tell the errors of all of them at once.

    Raises:
        Dh2simError: a file is wrong, two robots have the same name, or a mesh cannot be used.
    """
    from dh2sim.model.build import build_model

    specs = load_all(robots)
    first: dict[str, str] = {}
    for robot, spec in zip(robots, specs, strict=True):
        if spec.name in first:
            raise Dh2simError(
                f"{first[spec.name]} and {robot}: both robots are named '{spec.name}', but every robot has a folder "
                "of its name to itself"
            )
        first[spec.name] = robot
    return _all(build_model, specs)


def _all(make: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """Apply a function to all items; print all errors but the last, and raise that."""
    made: list[R] = []
    errors: list[Dh2simError] = []
    for item in items:
        try:
            made.append(make(item))
        except Dh2simError as error:
            errors.append(error)
    for earlier in errors[:-1]:
        complain(earlier)
    if errors:
        raise errors[-1]
    return made
