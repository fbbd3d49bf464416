"""A picture of joint axes and the frames assigned to them: title, robot, legend, and the table beneath."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dh2sim.draw.frame_figure.paper import (
    A_COLOR,
    D_COLOR,
    X_COLOR,
    Y_COLOR,
    Z_COLOR,
    Paper,
    text_size,
)
from dh2sim.draw.frame_figure.robot import RobotDrawing
from dh2sim.draw.frame_figure.scene import Scene, make_scene
from dh2sim.draw.frame_figure.view import best_view
from dh2sim.draw.plot_style import GREY, INK, plot_style, require_plot
from dh2sim.importing.explain import GLUE, degrees, number, pose
from dh2sim.importing.result import Imported
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec

_LEGEND_SIZE = 8.0
_MARK = 22.0
"""Width of a symbol, pt."""
_LEGEND_GAP = 14.0


def draw_legend(paper: Paper, middle: float, y: float) -> None:
    """Draw the legend in one line around a middle, at a height, pt."""
    entries = (
        ("axis of a joint", GREY, 0.9, (0, (9, 3, 2, 3))),
        ("a, along x", A_COLOR, 1.5, "-"),
        ("d, along z", D_COLOR, 1.5, "-"),
    )
    arrows = (("x", X_COLOR), ("y", Y_COLOR), ("z", Z_COLOR))
    names = [text for text, *_ in entries] + [text for text, _ in arrows]
    total = sum(_MARK + 4.0 + text_size(name, _LEGEND_SIZE)[0] for name in names) + _LEGEND_GAP * (len(names) - 1)
    x = middle - 0.5 * total
    for text, color, lw, style in entries:
        paper.line(np.array([[x, y], [x + _MARK, y]]), color, lw, layer=3, ls=style)
        x = _write(paper, x, y, text)
    for text, color in arrows:
        paper.arrow(np.array([x, y]), np.array([x + _MARK, y]), color, 1.6, layer=3)
        x = _write(paper, x, y, text)


def _write(paper: Paper, x: float, y: float, text: str) -> float:
    paper.text(np.array([x + _MARK + 4.0, y]), text, INK, _LEGEND_SIZE)
    return x + _MARK + 4.0 + text_size(text, _LEGEND_SIZE)[0] + _LEGEND_GAP


_SIZE = 9.0
_LINE = 14.5
"""Height of a row, pt."""
_GAP = 24.0
"""Between columns, pt."""
_MINUS = "\N{MINUS SIGN}"
_LONGEST = 22
"""Letters of a joint's name."""


class RowsTable:
    """The rows as text in columns, and the remainder in base and tool."""

    def __init__(self, spec: RobotSpec) -> None:
        """Make the texts."""
        self._hayati = any(row.convention is Convention.HAYATI for row in spec.rows)
        self._mixed = len({row.convention for row in spec.rows}) > 1
        self._cells = [self._head(spec.convention)]
        for i, row in enumerate(spec.rows, start=1):
            self._cells.append(self._row(i, row, spec.convention))
        base, tool = pose(spec.base.pose), pose(spec.tool)
        self._notes = [
            _plain(f"{name}: {left}").replace(GLUE, " ") for name, left in (("base", base), ("tool", tool)) if left
        ]
        self._widths = [
            max(text_size(cell, _SIZE)[0] for cell in column) for column in zip(*self._cells, strict=True)
        ]

    @property
    def width(self) -> float:
        """In pt."""
        return sum(self._widths) + _GAP * (len(self._widths) - 1)

    def draw(self, paper: Paper, left: float, top: float) -> None:
        """Draw it with its upper left corner there, pt."""
        self._rule(paper, left, top, 1.1)
        y = top - 9.0
        for k, cells in enumerate(self._cells):
            self._draw_row(paper, left, y, cells)
            y -= _LINE
            if k == 0:
                self._rule(paper, left, y + 0.5 * _LINE, 0.6)
                y -= 2.0
        self._rule(paper, left, y + 0.5 * _LINE - 1.0, 1.1)
        for note in self._notes:
            paper.text(np.array([left, y - 4.0]), note, INK, 8.5)
            y -= _LINE

    def _rule(self, paper: Paper, left: float, y: float, width: float) -> None:
        paper.line(np.array([[left, y], [left + self.width, y]]), INK, width, layer=3)

    def _draw_row(self, paper: Paper, left: float, y: float, cells: Sequence[str]) -> None:
        x = left
        for k, (cell, width) in enumerate(zip(cells, self._widths, strict=True)):
            if k == 1:
                paper.text(np.array([x, y]), cell, size=_SIZE)
            else:
                paper.text(np.array([x + width, y]), cell, size=_SIZE, align="right")
            x += width + _GAP

    def _head(self, convention: Convention) -> list[str]:
        if convention is Convention.MODIFIED and not self._mixed:
            return ["i", "joint", "$a_{i-1}$ [m]", r"$\alpha_{i-1}$ [°]", "$d_i$ [m]", r"$\theta_i$ [°]"]
        head = ["i", "joint", r"$\theta_i$ [°]", "$d_i$ [m]", "$a$ [m]", r"$\alpha$ [°]"]
        if not self._mixed or convention is Convention.STANDARD:
            head[4:] = ["$a_i$ [m]", r"$\alpha_i$ [°]"]
        if self._hayati:
            head.append(r"$\beta_i$ [°]")
        return [*head, "row"] if self._mixed else head

    def _row(self, i: int, row: Row, convention: Convention) -> list[str]:
        name = row.name if len(row.name) <= _LONGEST else f"{row.name[: _LONGEST - 1]}…"
        theta, d, a, alpha = map(_plain, (degrees(row.theta), number(row.d), number(row.a), degrees(row.alpha)))
        variable = f"$q_{{{i}}}$"
        if row.type.turns:
            theta = variable if row.theta == 0.0 else f"{variable} {_signed(theta)}"
        else:
            d = variable if row.d == 0.0 else f"{variable} {_signed(d)}"
        cells = [str(i), name]
        if convention is Convention.MODIFIED and not self._mixed:
            return [*cells, a, alpha, d, theta]
        cells += [theta, "–" if row.convention is Convention.HAYATI and row.type.turns else d, a, alpha]
        if self._hayati:
            cells.append(_plain(degrees(row.beta)) if row.convention is Convention.HAYATI else "–")
        return [*cells, row.convention.value] if self._mixed else cells


def _signed(text: str) -> str:
    return f"{text[0]} {text[1:]}" if text.startswith(_MINUS) else f"+ {text}"


def _plain(text: str) -> str:
    """Return text with typographic minus signs."""
    return text.replace("-", _MINUS)


_BORDER = 14.0
_TITLE = 11.0


def require_frame_figure(path: Path) -> None:
    """Check that a picture of frames can be written to a file of this name.

    Raises:
        PictureError: The ending is none of those allowed.
        MissingExtraError: matplotlib is not installed.
    """
    require_plot(path, what="a picture of frames")


def draw_assignment(imported: Imported, path: Path) -> None:
    """Draw a robot's joint axes, its frames 0 … n and the lengths between them, with its table beneath.

    The joints are at zero, but for prismatic ones whose length would be hidden there. Parallel projection, from where
    most is seen. The same robot gives the same bytes.

    Args:
        imported: A robot made of a chain.
        path: .svg, .png or .pdf; an existing file is replaced.

    Raises:
        PictureError: The ending is none of those allowed.
        MissingExtraError: matplotlib is not installed.
        OutputError: The file cannot be written.
        ValueError: The robot was made of a table, to which no frames were assigned.
    """
    require_frame_figure(path)
    scene = make_scene(imported)
    with plot_style():
        paper = Paper()
        RobotDrawing(paper, scene, best_view(scene)).draw()
        _write_around(paper, scene)
        paper.save(path, _BORDER)


def _write_around(paper: Paper, scene: Scene) -> None:
    """Put the title above the robot, legend and table below it."""
    (left, bottom), (right, top) = paper.bounds
    middle = 0.5 * (left + right)
    table, title = RowsTable(scene.spec), _title(scene)
    draw_legend(paper, middle, bottom - 24.0)
    table.draw(paper, middle - 0.5 * table.width, bottom - 44.0)
    paper.text(np.array([middle, top + 26.0]), title, INK, _TITLE, align="center", weight="bold")


def _title(scene: Scene) -> str:
    where = "joint coordinates zero"
    if scene.extended:
        where += ", but " + ", ".join(f"$q_{{{joint}}}$ = {number(value)} m" for joint, value in scene.extended)
    return f"{scene.spec.name}: {scene.spec.convention.value} frames at {where}"
