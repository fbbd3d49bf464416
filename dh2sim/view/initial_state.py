"""Opens robots: the initial state of a page, its ghosts, and robot files uploaded from the browser.

Uploaded files are read like any other, but no path that they contain is followed.
"""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Final

from dh2sim.errors import Dh2simError, UnknownRobotError
from dh2sim.messages import did_you_mean, shown
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.catalog import builtin_path, builtin_robots
from dh2sim.robot.read import load_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.view.events import OpenText
from dh2sim.view.state import Ghost, ViewState, configurations
from dh2sim.view.table_edits import UNCHANGED, misread_ghost
from dh2sim.view.table_state import Invalid, Source, editable_text, read, table_state_of

MAX_PROBLEMS: Final = 12
"""Of an uploaded file that are shown; the number of others is shown, too."""
_NAMELESS: Final = "robot.yaml"
_MAX_NAME_LENGTH: Final = 60


def folder_of(robot: str) -> Path | None:
    """Return where paths in a robot's file start; ``robot`` is its path or the robot's name."""
    path = Path(robot) if os.path.lexists(robot) else builtin_path(robot)
    return None if path is None else path.absolute().parent


def open_state(spec: RobotSpec, folder: Path | None = None) -> ViewState:
    """Return the initial state of a page, with the robot at home.

    Args:
        spec: The robot.
        folder: Where paths in its file start; by default the current folder.

    Raises:
        Dh2simError: The robot cannot be shown.
    """
    file = "robot.yaml" if spec.source_file is None else spec.source_file.path
    source = Source(file=file, folder=folder or Path.cwd())
    text = editable_text(spec, source)
    model = read(text, source)
    if isinstance(model, Invalid):
        raise Dh2simError(f"{source.file}: {model.first}")
    return state_of(model, text, source)


def open_text(state: ViewState, event: OpenText) -> ViewState:
    """Return the state with the robot of another file at home; with a notice alone if the file is invalid.

    Parts shown, opacity, the unit of angles and the ghost are kept; nothing else of the former robot is.
    """
    source = Source(file=event.file, folder=event.folder)
    result = _read(event.text, source)
    if isinstance(result, Invalid):
        return replace(state, notice=f"{UNCHANGED}.\n{_problems(result)}")
    text, model = result
    return replace(
        state_of(model, text, source),
        shown=state.shown,
        opacity=state.opacity,
        angle=state.angle,
        ghost=misread_ghost(model) if state.ghost is not None and state.ghost.misread else state.ghost,
        notice=f"Opened {source.file}: {_summary(model)}.",
    )


def builtin_ghost(name: str) -> Ghost:
    """Return a built-in robot as a ghost.

    Raises:
        Dh2simError: The robot is unknown, or its file is damaged.
    """
    path = builtin_path(name)
    if path is None:  # names come from the browser: none of them becomes a path
        raise UnknownRobotError(f"unknown robot {shown(name)}.{did_you_mean(name, builtin_robots())}")
    return Ghost(model=build_model(load_robot(path)), label=name)


def uploaded_ghost(text: bytes, file: str) -> Ghost:
    """Return the robot of an uploaded file as a ghost.

    Args:
        text: The file's content.
        file: Its name, for messages.

    Raises:
        Dh2simError: The file is invalid; the message has a line for each problem.
    """
    result = _read(text, Source(file=file, folder=None))
    if isinstance(result, Invalid):
        raise Dh2simError(f"Ghost unchanged.\n{_problems(result)}")
    _, model = result
    return Ghost(model=model, label=f"{model.name} (uploaded)")


def state_of(model: RobotModel, text: str, source: Source) -> ViewState:
    """Return the state of a robot that was just read, at home."""
    return ViewState(
        model=model,
        text=text,
        file=source.file,
        folder=source.folder,
        table=table_state_of(text, model.spec),
        q=configurations(model)["home"],
        selected_row=telling_row(model.spec),
    )


def telling_row(spec: RobotSpec) -> int:
    """Return the row, from 0, that shows most of what a row is: the first with the fewest zeros."""
    zeros = [sum(value == 0.0 for value in (row.a, row.alpha, row.beta, row.d, row.theta)) for row in spec.rows]
    moving = [row.type.moves for row in spec.rows]
    return min(range(len(zeros)), key=lambda row: (not moving[row], zeros[row]))


def is_same_file(state: ViewState, other: ViewState) -> bool:
    """Return whether two states show the same robot file, edited or not."""
    return (state.file, state.folder) == (other.file, other.folder)


def file_name(given: str) -> str:
    """Return a file name from a browser without folders, printable, and not too long, for messages."""
    name = re.split(r"[/\\]", given[-10 * _MAX_NAME_LENGTH :])[-1]
    printable = "".join(letter if letter.isprintable() else "_" for letter in name).strip()
    short = len(printable) <= _MAX_NAME_LENGTH
    return (printable if short else f"{printable[: _MAX_NAME_LENGTH - 6]}…{printable[-5:]}") or _NAMELESS


def _read(text: str | bytes, source: Source) -> tuple[str, RobotModel] | Invalid:
    """Return the robot of a file, and its text in a form in which the table can be edited."""
    model = read(text, source)
    if isinstance(model, Invalid):
        return model
    try:
        editable = editable_text(model.spec, source)
    except Dh2simError as error:
        return Invalid(messages={"": str(error)})
    if model.spec.source_file is not None and editable == model.spec.source_file.text:
        return editable, model
    rewritten = read(editable, source)
    return rewritten if isinstance(rewritten, Invalid) else (editable, rewritten)


def _problems(invalid: Invalid) -> str:
    """Return all problems of a file, or the first of many, one line each."""
    lines = invalid.text.split("\n")
    more = len(lines) - MAX_PROBLEMS
    return "\n".join(lines if more <= 0 else [*lines[:MAX_PROBLEMS], f"… and {more} more."])


def _summary(model: RobotModel) -> str:
    joints = len(model.joints)
    return f"{model.name}, {joints} {'joint' if joints == 1 else 'joints'}"
