"""How a command ends: what is told where, and with which exit status."""

from __future__ import annotations

import functools
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from dh2sim.errors import Dh2simError, MismatchError, RobotFileError, SettingsError

if TYPE_CHECKING:
    from dh2sim.model.robot_model import RobotModel
    from dh2sim.robot.spec import RobotSpec

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
            text = "\n".join(f"dh2sim: {line}" for line in str(error).splitlines())
        case _:
            text = f"dh2sim: {error}"
    print(text, file=sys.stderr)
    return FELL_SHORT if isinstance(error, MismatchError) else BAD_INPUT


def load_all(robots: Sequence[str]) -> list[RobotSpec]:
    """Read robot files, and tell the errors of all of them at once.

    Raises:
        Dh2simError: files are wrong, not found or cannot be read; the last error, after the others were printed.
    """
    from dh2sim.robot.load import load_robot

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
