"""Where labels go, so that they cover neither each other nor what is drawn.

Paper to draw on, measured in points, and how pictures become files that are the same every time.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from dh2sim.errors import PictureError
from dh2sim.extras import require_extra
from dh2sim.files import atomic_file
from dh2sim.messages import shown
from dh2sim.typing import Array

ENDINGS: Final = (".svg", ".png", ".pdf")
X_COLOR: Final = "#c0392b"
Y_COLOR: Final = "#7fa88f"
Z_COLOR: Final = "#1f5fbf"
A_COLOR: Final = "#1e7d4f"
D_COLOR: Final = "#a35200"
QUIET: Final = "#8a8f98"
BODY: Final = "#d9dde3"
INK: Final = "#22262b"
_DPI: Final = 200
_SPACING: Final = 2.5
"""Between the points that stand for a line, pt."""
_SETTINGS: Final[Mapping[str, Any]] = {
    "font.family": "DejaVu Sans",
    # no random names: the same robot gives the same bytes
    "svg.hashsalt": "dh2sim",
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
}


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
        dates: dict[str, dict[str, Any]] = {
            ".svg": {"Date": None, "Creator": "dh2sim"},
            ".pdf": {"CreationDate": None, "Creator": "dh2sim", "Producer": None},
            ".png": {"Software": "dh2sim"},
        }
        (left, bottom), (right, top) = self.bounds
        self.axes.set_xlim(left - border, right + border)
        self.axes.set_ylim(bottom - border, top + border)
        self.figure.set_size_inches((right - left + 2 * border) / 72, (top - bottom + 2 * border) / 72)
        ending = out.suffix.lower()
        with atomic_file(out) as draft:
            self.figure.savefig(draft, dpi=_DPI, format=ending[1:], metadata=dates[ending])

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


@contextmanager
def drawing() -> Iterator[None]:
    """Draw with these settings, and with matplotlib's defaults whatever a user's own are; put back in the end."""
    import matplotlib as mpl

    with mpl.rc_context():
        # the backend is not a matter of looks, and choosing one would import it
        mpl.rcParams.update({name: value for name, value in mpl.rcParamsDefault.items() if name != "backend"})
        mpl.rcParams.update(_SETTINGS)
        yield


def require_picture_ending(path: Path) -> None:
    """Check the ending of a file's name, and that matplotlib is installed.

    Raises:
        PictureError: The ending is none of those allowed.
        MissingExtraError: matplotlib is not installed.
    """
    if path.suffix.lower() not in ENDINGS:
        raise PictureError(
            f"{shown(path.name)} is no picture that can be drawn; allowed endings: {', '.join(ENDINGS)}"
        )
    require_extra("plot", "matplotlib", what="a picture of frames")


_ANGLES = 24
_RADII = (5.0, 9.0, 14.0, 20.0, 28.0, 38.0, 50.0)
"""Between an anchor and the nearest edge of its label, pt."""
_COVERED = 4.0
"""Cost of every point of the drawing that a label covers; one pt of distance costs 0.1."""
_OVERLAP = 60.0
_TURNED = 1.2
"""Cost of standing at a right angle to where a label should be."""
_PADDING = 1.5
LEADER = 18.0
"""pt: labels that are farther off get a thin line to what they name."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Label:
    """A text and the point that it names."""

    text: str
    color: str
    size: float
    """pt."""
    anchor: Array
    """pt on the paper, shape (2,)."""
    towards: Array
    """Where from the anchor it should best stand, shape (2,)."""
    either: bool = False
    """Whether the opposite side is as good."""
    clear: float = 0.0
    """pt around the anchor that the label keeps off."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedLabel:
    """A label and its place."""

    label: Label
    centre: Array
    """pt, shape (2,)."""
    distance: float
    """Of its edge from the anchor, pt."""


def place_labels(labels: Sequence[Label], ink: Array) -> list[PlacedLabel]:
    """Place labels one after the other, each where it costs least.

    Args:
        labels: The most important first.
        ink: Points of what is drawn, pt, shape (number, 2).
    """
    placed: list[PlacedLabel] = []
    boxes: list[Array] = []
    for label in labels:
        half = 0.5 * np.array(text_size(label.text, label.size)) + _PADDING
        candidates = [_candidate(label, half, k, radius) for radius in _RADII for k in range(_ANGLES)]
        costs = [_cost(label, half, centre, radius, boxes, ink) for centre, radius in candidates]
        centre, radius = candidates[int(np.argmin(np.round(costs, 6)))]
        boxes.append(np.concatenate([centre - half, centre + half]))
        placed.append(PlacedLabel(label=label, centre=centre, distance=radius))
    return placed


def _candidate(label: Label, half: Array, step: int, radius: float) -> tuple[Array, float]:
    """Return the centre of the label's box whose edge is ``radius`` from the anchor in the direction of a step."""
    angle = math.tau * step / _ANGLES
    way = np.array([math.cos(angle), math.sin(angle)])
    inside = float(np.min(half / np.maximum(np.abs(way), 1e-9)))
    return label.anchor + (label.clear + radius + inside) * way, radius


def _cost(label: Label, half: Array, centre: Array, radius: float, boxes: Sequence[Array], ink: Array) -> float:
    way = centre - label.anchor
    cosine = float(way @ label.towards) / float(np.linalg.norm(way) * np.linalg.norm(label.towards) + 1e-12)
    cost = 0.1 * radius + _TURNED * (1.0 - (abs(cosine) if label.either else cosine))
    cost += _COVERED * int(np.sum(np.all(np.abs(ink - centre) <= half, axis=1)))
    for box in boxes:
        width = min(centre[0] + half[0], box[2]) - max(centre[0] - half[0], box[0])
        height = min(centre[1] + half[1], box[3]) - max(centre[1] - half[1], box[1])
        if width > 0.0 and height > 0.0:
            cost += _OVERLAP + float(width * height)
    return cost
