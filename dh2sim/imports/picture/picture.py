"""A picture of joint axes and the frames that were assigned to them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dh2sim.imports.explain.words import number
from dh2sim.imports.imported import Imported
from dh2sim.imports.picture.legend import draw_legend
from dh2sim.imports.picture.paper import INK, Paper, drawing, require_picture_ending
from dh2sim.imports.picture.robot import RobotDrawing
from dh2sim.imports.picture.scene import Scene, make_scene
from dh2sim.imports.picture.table import RowsTable
from dh2sim.imports.picture.view import best_view

__all__ = ["draw_assignment", "require_picture_ending"]

_BORDER = 14.0
_TITLE = 11.0


def draw_assignment(imported: Imported, path: Path) -> None:
    """Draw a robot's joint axes, its frames 0 … n and the lengths between them, with its table beneath.

    The joints are at zero, but for sliding ones that would hide a length there. Parallel projection, from where most
    is seen. The same robot gives the same bytes.

    Args:
        imported: A robot made of a chain.
        path: .svg, .png or .pdf; a file that stands there is replaced.

    Raises:
        PictureError: The ending is another one.
        OutputError: The file cannot be written.
        ValueError: The robot was made of a table, to which no frames were assigned.
    """
    require_picture_ending(path)
    scene = make_scene(imported)
    with drawing():
        paper = Paper()
        RobotDrawing(paper, scene, best_view(scene)).draw()
        _write_around(paper, scene)
        paper.save(path, _BORDER)


def _write_around(paper: Paper, scene: Scene) -> None:
    """Put the title above the robot, and signs and table below it."""
    (left, bottom), (right, top) = paper.bounds
    middle = 0.5 * (left + right)
    table, title = RowsTable(scene.spec), _title(scene)
    draw_legend(paper, middle, bottom - 24.0)
    table.draw(paper, middle - 0.5 * table.width, bottom - 44.0)
    paper.text(np.array([middle, top + 26.0]), title, INK, _TITLE, align="center", weight="bold")


def _title(scene: Scene) -> str:
    where = "joint coordinates zero"
    if scene.drawn_out:
        where += ", but " + ", ".join(f"$q_{{{joint}}}$ = {number(value)} m" for joint, value in scene.drawn_out)
    return f"{scene.spec.name}: {scene.spec.convention.value} frames at {where}"
