"""What every command shares: how it ends, its arguments ROBOT, and options that take one of a few words."""

from __future__ import annotations

import functools
import math
import os
import re
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ParamSpec, TypeVar

import typer

from dh2sim.errors import Dh2simError, MismatchError, RobotFileError, SettingsError
from dh2sim.messages import printable

if TYPE_CHECKING:
    from dh2sim.model.mechanism import MechanismModel
    from dh2sim.model.robot_model import RobotModel
    from dh2sim.robot.spec import RobotSpec

DONE, FELL_SHORT, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
MANY = "\0"
"""Stands between the words of an option that takes several; no word can contain it."""
MOST_ALIKE = 3
"""Notes of one kind that are printed of one file; reports in JSON list them all."""

P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")
Word = TypeVar("Word", bound=StrEnum)


# ---------------------------------------------------------------------------- arguments and options


def complete_robot(incomplete: str) -> list[str]:
    """Return what a shell offers for ROBOT: robots that come with dh2sim, robot files and folders."""
    from dh2sim.robot.catalog import builtin_mechanisms, builtin_robots

    names = [name for name in (*builtin_robots(), *builtin_mechanisms()) if name.startswith(incomplete)]
    folder, start = os.path.split(incomplete)
    try:
        entries = sorted(os.scandir(folder or "."), key=lambda entry: entry.name)
    except OSError:
        return names
    for entry in entries:
        if entry.name.startswith(start) and (start or not entry.name.startswith(".")):
            path = os.path.join(folder, entry.name)
            if entry.is_dir():
                names.append(f"{path}/")
            elif entry.name.endswith((".yaml", ".yml")):
                names.append(path)
    return names


RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="A robot file, or the name of a robot that comes with dh2sim.",
        autocompletion=complete_robot,
    ),
]
RobotsArgument = Annotated[
    list[str],
    typer.Argument(
        metavar="ROBOT",
        help="Robot files, or names of robots that come with dh2sim.",
        autocompletion=complete_robot,
    ),
]
StrictOption = Annotated[bool, typer.Option("--strict", help="Treat notes, which point out likely slips, as errors.")]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite existing files.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON alone, in m, rad, kg and s.")]
SeedOption = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the random number generator.")]
SamplesOption = Annotated[
    int, typer.Option(min=1, max=10**8, metavar="N", help="Number of random configurations, inside the limits.")
]
ToleranceOption = Annotated[
    float,
    typer.Option(
        metavar="T", help="Largest error: an angle in rad, a distance as a fraction of the reach or of 1 m."
    ),
]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def choice(
    text: str | None,
    words: type[Word],
    option: str,
    *,
    without: tuple[Word, ...] = (),
    other_names: Mapping[str, str] | None = None,
    others: Sequence[str] = (),
) -> Word | None:
    """Return the member of an enumeration that the value of an option names; None if it was not given.

    For the message, ``other_names`` are what people call its members elsewhere, and ``others`` what else the option
    takes.

    Raises:
        BadParameter: The value names no member.
    """
    if text is None:
        return None
    allowed = [word for word in words if word not in without]
    found = next((word for word in allowed if word.value == text.lower()), None)
    if found is None:
        from dh2sim.messages import did_you_mean, shown

        names = [*(word.value for word in allowed), *others]
        meant = (other_names or {}).get(text.lower())
        hint = f" It is called '{meant}' here" if meant in names else did_you_mean(text, names)
        raise typer.BadParameter(
            f"{shown(text)} is not one of {', '.join(names)}.{hint}".rstrip("."), param_hint=option
        )
    return found


def refuse_options(what: str, options: Mapping[str, object]) -> None:
    """Refuse options that were given and do not apply; None and False are what was not given.

    Raises:
        BadParameter: One of them was given.
    """
    for name, value in options.items():
        if value is not None and value is not False:
            raise typer.BadParameter(f"does not apply to {what}", param_hint=name)


def words_of(texts: Sequence[str] | None, option: str) -> list[str]:
    """Return the words of an option that takes several, with commas between them, or repeated, or both.

    Raises:
        BadParameter: The option is given without a word, as ``--only "$PARTS"`` of an unset variable is.
    """
    words: list[str] = []
    for text in texts or ():
        found = [word for part in re.split(f"[,{MANY}]", text) if (word := part.strip())]
        if not found:
            raise typer.BadParameter("must not be empty; leave it out for the default", param_hint=option)
        words += found
    return words


def named_values(texts: Sequence[str] | None, option: str, form: str) -> dict[str, str]:
    """Return the values by name of an option ``name=value,…``; ``form`` says what each is like.

    Raises:
        BadParameter: The text is empty or not of that form, or has a name twice.
    """
    values: dict[str, str] = {}
    for item in words_of(texts, option):
        name, equals, value = (part.strip() for part in item.partition("="))
        if not equals or not name or not value:
            raise typer.BadParameter(f"'{item}' is not of the form {form}", param_hint=option)
        if name in values:
            raise typer.BadParameter(f"'{name}' is given twice", param_hint=option)
        values[name] = value
    return values


def tolerance_of(value: float) -> float:
    """Return the value of ``--tolerance``.

    Raises:
        BadParameter: It is not above 0 and below 1.
    """
    if not (math.isfinite(value) and 0.0 < value < 1.0):
        raise typer.BadParameter(f"must be above 0 and below 1, got {value}", param_hint="--tolerance")
    return value


# ---------------------------------------------------------------------------- the end of a command


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
            _drop_output()  # its reader has closed it
            status = DONE
        except OSError as error:
            where = f"{error.filename}: " if error.filename else ""
            status = complain(f"{where}{error.strerror or error}")
            try:
                sys.stdout.flush()
            except OSError:
                _drop_output()
        except MemoryError:
            status = complain("not enough memory")
        except (RuntimeError, ImportError, AttributeError) as error:
            if not _blames_drawing(error):
                raise
            chosen = os.environ.get("MUJOCO_GL")
            status = complain(f"MuJoCo cannot be imported with MUJOCO_GL={chosen}: {error}. Unset that variable")
        except KeyboardInterrupt:
            status = INTERRUPTED  # ``main`` reports it
        raise SystemExit(status)

    return run


def _drop_output() -> None:
    """Send what is left of standard output nowhere: Python would complain at exit that it cannot be written."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _blames_drawing(error: BaseException) -> bool:
    """Whether MuJoCo failed to import the OpenGL library that the environment variable MUJOCO_GL names."""
    frames = traceback.extract_tb(error.__traceback__)
    return "MUJOCO_GL" in os.environ and any(Path(frame.filename).name == "gl_context.py" for frame in frames)


_BEGINS_WITH_PLACE = re.compile(r"(?:(?!: )[^\n'])+:\d+:\d+: ")
"""``file:line:column: ``, which editors and terminals make a link of: nothing may stand before it."""


def complain(error: object) -> int:
    """Print an error and return its exit status; problems of robot files and settings have a line each.

    Settings name arguments of the library, which are written as options: ``--floating-base``.
    """
    match error:
        case RobotFileError():
            text = str(error)
        case SettingsError():
            text = "\n".join(f"dh2sim: {_as_option(name, message)}" for name, message in error.problems)
        case _:
            text = str(error)
            if not _BEGINS_WITH_PLACE.match(text):
                text = f"dh2sim: {text}"
    text = printable(text)
    if sys.stderr.isatty() and not (isinstance(error, RobotFileError) or _BEGINS_WITH_PLACE.match(text)):
        text = _for_terminal(text)
    print(text, file=sys.stderr)
    return FELL_SHORT if isinstance(error, MismatchError) else BAD_INPUT


def _for_terminal(text: str) -> str:
    """Return a message whose lines end between words, but not inside quotes: commands and paths stay whole.

    Where standard error is a file or a pipe, a message stays on one line, so that it can be searched for.
    """
    import textwrap

    try:
        width = os.get_terminal_size(sys.stderr.fileno()).columns or 80
    except (OSError, ValueError):
        width = 80
    whole = re.sub(r"(?<!\w)'[^'\n]*'", lambda found: found[0].replace(" ", "\0"), text)
    lines = [
        textwrap.fill(
            line,
            width,
            subsequent_indent=" " * (len(line) - len(line.lstrip()) + 2),
            break_long_words=False,
            break_on_hyphens=False,
        )
        for line in whole.splitlines()
    ]
    return "\n".join(lines).replace("\0", " ")


def _as_option(name: str, message: str) -> str:
    """Return what is wrong with an argument of the library, and with the one it excludes, in options' names."""
    option = f"--{name.replace('_', '-')} " if name else ""
    return option + re.sub(
        r"\b(together with )(\w[\w-]*)(?:( or )(\w[\w-]*))?",
        lambda found: "".join(part if k % 2 == 0 else f"--{part}" for k, part in enumerate(found.groups()) if part),
        message,
    )


# ---------------------------------------------------------------------------- robots


def load_one(robot: str) -> RobotSpec:
    """Read a robot file, and check that loops can be closed.

    Raises:
        Dh2simError: The file is wrong, is not found, cannot be read or has another format.
    """
    from dh2sim.robot.read import load_robot

    refuse_other_formats(robot)
    spec = load_robot(robot)
    if spec.closures:
        from dh2sim.kinematics.loop_closure import assembly

        assembly(spec)
    return spec


_XML_ROOT = re.compile(rb"(?:<\?.*?\?>|<!--.*?-->|<![^>]*>|\s)*<\s*([A-Za-z_][\w:.-]*)", re.DOTALL)
_TABLES = {".csv": "a CSV table", ".tsv": "a TSV table", ".md": "a Markdown table"}


def refuse_other_formats(robot: str) -> None:
    """Refuse a file that is to be imported first: a URDF, an MJCF, or a table.

    Raises:
        Dh2simError: The file's ending or content is that of another format than a robot file's.
    """
    kind = other_format(robot)
    if kind is not None:
        import shlex

        path = Path(robot)
        name = f"{path.stem}.yaml"
        if name == path.name:
            name = f"{path.stem}_imported.yaml"
        raise Dh2simError(
            f"{robot}: this is {kind}, not a robot file: run 'dh2sim import {shlex.quote(robot)} -o "
            f"{shlex.quote(name)}' first"
        )


def other_format(file: str) -> str | None:
    """Return what a file is, from how it begins and from its ending; None for what may be YAML, or cannot be read."""
    path = Path(file)
    if not file or not path.is_file():
        return None
    try:
        with path.open("rb") as stream:
            head = stream.read(8192).removeprefix(b"\xef\xbb\xbf").lstrip()
    except OSError:
        return None  # whoever reads it reports that
    suffix = path.suffix.lower()
    if head.startswith(b"<"):
        found = _XML_ROOT.match(head)
        root = b"" if found is None else found[1]
        kinds = {b"robot": "a URDF", b"mujoco": "an MJCF", b"mujocoinclude": "an MJCF"}
        return kinds.get(root, "a URDF" if suffix == ".urdf" else "XML")
    if suffix in _TABLES:
        return _TABLES[suffix]
    if suffix not in (".yaml", ".yml"):
        first = head.split(b"\n", 1)[0]
        if max(first.count(b","), first.count(b"\t")) >= 2 and b":" not in first:
            return "a table"
    return "a Markdown table" if head.startswith(b"|") else None


def build_serial(robot: str) -> RobotModel:
    """Read the file of a serial robot and build its model.

    Raises:
        Dh2simError: The file is wrong, or a mesh cannot be used.
    """
    from dh2sim.model.build import build_model

    return build_model(load_one(robot))


def build_any(robots: Sequence[str], *, strict: bool | None = None) -> list[RobotModel | MechanismModel]:
    """Read files of robots and mechanisms and build their models, and report the errors of all of them at once.

    Args:
        robots: Files or names.
        strict: What becomes of likely slips: errors, notes on standard error, or nothing if this is None.

    Raises:
        Dh2simError: A file is wrong, two robots have the same name, or a mesh cannot be used.
    """
    from dh2sim.model.mechanism import MechanismModel, written_model

    models = _all(written_model, _load_distinct(robots))
    if strict is not None:
        report_slips([model for model in models if not isinstance(model, MechanismModel)], strict=strict)
    return models


def _load_distinct(robots: Sequence[str]) -> list[RobotSpec]:
    """Read robot files; each robot needs a folder of its own name.

    Raises:
        Dh2simError: A file is wrong, or two robots have the same name.
    """
    specs = _all(load_one, robots)
    first: dict[str, str] = {}
    for robot, spec in zip(robots, specs, strict=True):
        if spec.name in first:
            raise Dh2simError(
                f"{first[spec.name]} and {robot}: both robots are named '{spec.name}', but each needs a folder of "
                "its own name"
            )
        first[spec.name] = robot
    return specs


def report_slips(models: Sequence[RobotModel], *, strict: bool) -> None:
    """Print what looks like a slip in robots on standard error.

    Raises:
        RobotFileError: There is something, and ``strict`` makes it an error.
    """
    from dh2sim.model.slips import find_slips

    slips = [slip for model in models for slip in find_slips(model)]
    if strict and slips:
        raise RobotFileError(slips)
    alike = Counter((slip.file, slip.kind) for slip in slips)
    printed: Counter[tuple[str, str]] = Counter()
    for slip in slips:
        which = (slip.file, slip.kind)
        printed[which] += 1
        if printed[which] <= MOST_ALIKE:
            text = f"{slip.path}: {slip.message}" if slip.path else slip.message
            print(printable(f"{slip.file}:{slip.line}:{slip.column}: note: {text}"), file=sys.stderr)
        elif printed[which] == alike[which]:
            print(f"{slip.file}: note: and {alike[which] - MOST_ALIKE} more like the last one", file=sys.stderr)


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
