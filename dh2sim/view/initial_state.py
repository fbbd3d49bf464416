"""The state that a page begins with."""

from __future__ import annotations

import os
from pathlib import Path

from dh2sim.errors import Dh2simError, UnknownRobotError
from dh2sim.messages import did_you_mean, shown
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.read import builtin_path, builtin_robots, load_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.view.state import Ghost, ViewState, configurations
from dh2sim.view.table_state import Source, Wrong, draft_of, editable_text, read


def folder_of(robot: str) -> Path | None:
    """Return where paths in a robot's file start; ``robot`` is the path of one, or a robot's name."""
    path = Path(robot) if os.path.lexists(robot) else builtin_path(robot)
    return None if path is None else path.absolute().parent


def open_state(spec: RobotSpec, folder: Path | None = None) -> ViewState:
    """Return the state that a page begins with: the robot at home.

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
    if isinstance(model, Wrong):
        raise Dh2simError(f"{source.file}: {model.first}")
    return state_of(model, text, source)


def builtin_ghost(name: str) -> Ghost:
    """Return a robot that comes with dh2sim, to stand beside the one that a page shows.

    Raises:
        Dh2simError: There is no such robot, or its file is damaged.
    """
    path = builtin_path(name)
    if path is None:  # a page may ask for any name: none of them becomes a path
        raise UnknownRobotError(f"there is no robot named {shown(name)}.{did_you_mean(name, builtin_robots())}")
    return Ghost(model=build_model(load_robot(path)), label=name)


def state_of(model: RobotModel, text: str, source: Source) -> ViewState:
    """Return the state in which a robot that was just read is at home."""
    return ViewState(
        model=model,
        text=text,
        file=source.file,
        folder=source.folder,
        draft=draft_of(text, model.spec),
        q=configurations(model)["home"],
    )


def is_same_file(state: ViewState, other: ViewState) -> bool:
    """Whether two states show the same robot file, edited or not."""
    return (state.file, state.folder) == (other.file, other.folder)
