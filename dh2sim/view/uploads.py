"""Robot files that come from the browser: read as any other, but nothing that they name is looked at."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Final

from dh2sim.errors import Dh2simError
from dh2sim.model.robot_model import RobotModel
from dh2sim.view.draft import Source, Wrong, editable_text, read
from dh2sim.view.events import OpenText
from dh2sim.view.opening import state_of
from dh2sim.view.state import Ghost, ViewState
from dh2sim.view.table_edits import reading_of

MOST_PROBLEMS: Final = 12
"""That are told; how many more there are is told, too."""
_NAMELESS: Final = "robot.yaml"
_LONGEST_NAME: Final = 60
_STANDS: Final = "The robot is the one of before"


def file_name(given: str) -> str:
    """Return what messages call a file that a browser gave a name: no folders, printable, and not long."""
    name = re.split(r"[/\\]", given[-10 * _LONGEST_NAME :])[-1]
    printable = "".join(letter if letter.isprintable() else "_" for letter in name).strip()
    cut = printable if len(printable) <= _LONGEST_NAME else f"{printable[: _LONGEST_NAME - 6]}…{printable[-5:]}"
    return cut or _NAMELESS


def opened(state: ViewState, event: OpenText) -> ViewState:
    """Return the state with the robot of another file, at home; the one of before and a notice where that is wrong.

    What moves the joints ends, and nothing points at places of the robot that was shown before. Of that stay what is
    drawn, the unit of angles, and another robot to compare with.
    """
    source = Source(file=event.file, folder=event.folder)
    result = _read(event.text, source)
    if isinstance(result, Wrong):
        return replace(state, notice=f"{_STANDS}.\n{_told(result)}")
    text, model = result
    return replace(
        state_of(model, text, source),
        shown=state.shown,
        angle=state.angle,
        ghost=reading_of(model) if state.ghost is not None and state.ghost.reading else state.ghost,
        notice=f"Opened {source.file}: {_summary(model)}.",
    )


def uploaded_ghost(text: bytes, file: str) -> Ghost:
    """Return the robot of a file that comes from the browser, to stand beside the one that a page shows.

    Args:
        text: The file's content.
        file: Its name, for messages.

    Raises:
        Dh2simError: It is wrong; the text has a line for each problem.
    """
    result = _read(text, Source(file=file, folder=None))
    if isinstance(result, Wrong):
        raise Dh2simError(f"There is nothing new to compare with.\n{_told(result)}")
    _, model = result
    return Ghost(model=model, label=f"{model.name} (uploaded)")


def _read(text: str | bytes, source: Source) -> tuple[str, RobotModel] | Wrong:
    """Return the robot of a file, and its text as the table can be edited in."""
    model = read(text, source)
    if isinstance(model, Wrong):
        return model
    try:
        own = editable_text(model.spec, source)
    except Dh2simError as error:
        return Wrong(messages={"": str(error)})
    if model.spec.source_file is not None and own == model.spec.source_file.text:
        return own, model
    rewritten = read(own, source)
    return rewritten if isinstance(rewritten, Wrong) else (own, rewritten)


def _told(wrong: Wrong) -> str:
    """Return all that is wrong with a file, or the first of many problems; a line for each."""
    lines = wrong.told.split("\n")
    more = len(lines) - MOST_PROBLEMS
    return "\n".join(lines if more <= 0 else [*lines[:MOST_PROBLEMS], f"… and {more} more."])


def _summary(model: RobotModel) -> str:
    joints = len(model.joints)
    return f"{model.name}, {joints} {'joint' if joints == 1 else 'joints'}"
