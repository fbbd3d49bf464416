"""How a command ends: what is told where, and with which exit status."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, ParamSpec

from dh2sim.errors import Dh2simError, MismatchError, RobotFileError

if TYPE_CHECKING:
    from dh2sim.model.robot_model import RobotModel
    from dh2sim.robot.spec import RobotSpec

P = ParamSpec("P")

DONE, FELL_SHORT, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def guarded(command: Callable[P, int | None]) -> Callable[P, None]:
    """Turn what a command returns or raises into an exit status; errors go to standard error, without a traceback."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            status = command(*args, **kwargs) or DONE
            sys.stdout.flush()
        except MismatchError as error:
            status = complain(error, FELL_SHORT)
        except Dh2simError as error:
            status = complain(error, BAD_INPUT)
        except BrokenPipeError:
            # whoever read our output has had enough; a second complaint at exit is not wanted either
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            status = DONE
        except OSError as error:
            where = f"{error.filename}: " if error.filename else ""
            status = complain(f"{where}{error.strerror or error}", BAD_INPUT)
        except KeyboardInterrupt:
            status = complain("interrupted", INTERRUPTED)
        raise SystemExit(status)

    return run


def complain(error: object, status: int) -> int:
    """Print an error and return the exit status; problems of robot files stand on lines of their own."""
    text = str(error) if isinstance(error, RobotFileError) else f"dh2sim: {error}"
    print(text, file=sys.stderr)
    return status


def load_all(robots: Sequence[str]) -> list[RobotSpec]:
    """Read robot files, and tell the errors of all of them at once.

    Raises:
        RobotFileError: some are wrong.
        Dh2simError: one is not found or cannot be read; raised after the others' errors were printed.
    """
    from dh2sim.robot.load import load_robot

    specs: list[RobotSpec] = []
    errors: list[Dh2simError] = []
    for robot in robots:
        try:
            specs.append(load_robot(robot))
        except Dh2simError as error:
            errors.append(error)
    _raise_all(errors)
    return specs


def build_all(robots: Sequence[str]) -> list[RobotModel]:
    """Read robot files and build their models, and tell the errors of all of them at once.

    Raises:
        Dh2simError: a file is wrong, two robots have the same name, or a mesh cannot be used.
    """
    from dh2sim.model.build import build_model

    specs = load_all(robots)
    names = [spec.name for spec in specs]
    for name in names:
        if names.count(name) > 1:
            raise Dh2simError(f"two of the robots are named '{name}', and would be written to the same folder")
    models: list[RobotModel] = []
    errors: list[Dh2simError] = []
    for spec in specs:
        try:
            models.append(build_model(spec))
        except Dh2simError as error:
            errors.append(error)
    _raise_all(errors)
    return models


def _raise_all(errors: list[Dh2simError]) -> None:
    """Print all errors but the last, and raise that."""
    for error in errors[:-1]:
        complain(error, BAD_INPUT)
    if errors:
        raise errors[-1]
