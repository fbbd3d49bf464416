"""A page to draw on with matplotlib, measured in points, that remembers what is drawn where."""

from __future__ import annotations

import itertools
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from dh2sim.draw.plot_style import INK, save
from dh2sim.typing import Array

X_COLOR: Final = "#c0392b"
Y_COLOR: Final = "#7fa88f"
Z_COLOR: Final = "#1f5fbf"
A_COLOR: Final = "#1e7d4f"
D_COLOR: Final = "#a35200"
BODY: Final = "#d9dde3"
_DPI: Final = 200
_SPACING: Final = 2.5
"""Between the points that represent a line, pt."""


class Paper:
    """A page without edges, on which everything that is drawn is remembered; it is cut to size in the end."""

    def __init__(self) -> None:
        """Make a white page."""
        from matplotlib.figure import Figure

        self.figure: Any = Figure(facecolor="white")
        self.axes: Any = self.figure.add_axes((0, 0, 1, 1))
        self.axes.set_axis_off()
        self._ink: list[Array] = []
        self._texts: list[Array] = []

    @property
    def ink(self) -> Array:
        """Points on all lines drawn so far, pt, shape (number, 2)."""
        return np.concatenate(self._ink) if self._ink else np.empty((0, 2))

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The lower left and upper right corner of everything drawn so far, pt, each of shape (2,)."""
        points = np.concatenate([*self._ink, *self._texts])
        return points.min(axis=0), points.max(axis=0)

    def line(self, points: Array, color: str, width: float, *, layer: int, **style: Any) -> None:
        """Draw a line through points, shape (number, 2)."""
        self.axes.plot(points[:, 0], points[:, 1], color=color, lw=width, zorder=layer, **style)
        self._remember(points)

    def arrow(self, start: Array, end: Array, color: str, width: float, *, layer: int, style: str = "-|>") -> None:
        """Draw a straight arrow."""
        from matplotlib.patches import FancyArrowPatch

        look: dict[str, Any] = {"arrowstyle": style, "mutation_scale": 5.5 + 2.6 * width, "shrinkA": 0, "shrinkB": 0}
        self.axes.add_patch(
            FancyArrowPatch(tuple(start), tuple(end), lw=width, color=color, zorder=layer, joinstyle="miter", **look)
        )
        self._remember(np.array([start, end]))

    def dot(self, point: Array, color: str, size: float, *, layer: int, marker: str = "o") -> None:
        """Mark a point."""
        edge = {"markeredgecolor": "white", "markeredgewidth": 0.7}
        self.axes.plot([point[0]], [point[1]], marker, color=color, ms=size, zorder=layer, **edge)
        self._ink.append(np.asarray(point)[None])

    def text(
        self,
        at: Array,
        text: str,
        color: str = INK,
        size: float = 9.0,
        *,
        align: str = "left",
        weight: str = "normal",
    ) -> None:
        """Write a text that stands out from what is below it; its middle is at the height of ``at``."""
        style = {"ha": align, "va": "center_baseline", "weight": weight, "zorder": 20}
        paper = {"boxstyle": "round,pad=0.06", "fc": "white", "ec": "none", "alpha": 0.75}
        self.axes.text(*at, text, color=color, fontsize=size, bbox=paper, **style)
        width, height = text_size(text, size, weight)
        left = at[0] - width * {"left": 0.0, "center": 0.5, "right": 1.0}[align]
        self._texts.append(np.array([[left, at[1] - 0.5 * height], [left + width, at[1] + 0.5 * height]]))

    def save(self, out: Path, border: float) -> None:
        """Cut the page to size, with a border in pt, and write it, whole or not at all.

        Raises:
            OutputError: It cannot be written.
        """
        (left, bottom), (right, top) = self.bounds
        self.axes.set_xlim(left - border, right + border)
        self.axes.set_ylim(bottom - border, top + border)
        self.figure.set_size_inches((right - left + 2 * border) / 72, (top - bottom + 2 * border) / 72)
        save(self.figure, out, dpi=_DPI, formulas=True)

    def _remember(self, points: Array) -> None:
        for start, end in itertools.pairwise(points):
            count = 2 + int(np.linalg.norm(end - start) / _SPACING)
            self._ink.append(np.linspace(start, end, count))


@cache
def text_size(text: str, size: float, weight: str = "normal") -> tuple[float, float]:
    """Return the width and height of a text, pt."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    font = FontProperties(family="DejaVu Sans", weight=weight)
    box = TextPath((0.0, 0.0), text, size=size, prop=font).get_extents()
    return float(box.width), max(float(box.height), 0.72 * size)
