"""A robot's axes, lengths and frames, drawn."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from dh2sim.draw.frame_figure.paper import (
    A_COLOR,
    BODY,
    D_COLOR,
    X_COLOR,
    Y_COLOR,
    Z_COLOR,
    Paper,
    text_size,
)
from dh2sim.draw.frame_figure.scene import JointAxis, Scene
from dh2sim.draw.labels import Label, PlacedLabel, place_labels
from dh2sim.draw.plot_style import GREY, INK
from dh2sim.draw.projection import ParallelView
from dh2sim.typing import Array

_WIDTH, _HEIGHT = 380.0, 270.0
"""Of the robot at most, pt."""
_REACH = 76.0
"""How far an axis extends beyond the robot, pt."""
_POINTERS = {"x": (X_COLOR, 40.0, 1.9), "y": (Y_COLOR, 27.0, 1.3), "z": (Z_COLOR, 47.0, 1.9)}
"""Colour, length where it is not foreshortened, and width of frames' axes, pt."""
_COLORS = {"a": A_COLOR, "d": D_COLOR}
_SHORT = 1.5
"""Lengths below this are too short to be seen, and get no label, pt."""
_RING = 8.0
"""Radius of the arrow that shows a revolute joint, pt."""
_STEP = 22.0
"""Between the symbols of joints in line, pt."""
_LEADER = 18.0
"""Labels farther off than this get a thin line to what they name, pt."""


class RobotDrawing:
    """Draws a scene, base_link's origin at the origin of the paper; lengths on the paper are in pt."""

    def __init__(self, paper: Paper, scene: Scene, view: ParallelView) -> None:
        """Choose the scale."""
        self._paper, self._scene, self._view = paper, scene, view
        size = np.ptp(view.project(scene.corners), axis=0)
        self._scale = float(np.min(np.array([_WIDTH, _HEIGHT]) / np.maximum(size, 1e-9)))
        self._pointers = self._pointer_scale()
        self._labels: list[tuple[int, Label]] = []

    def draw(self) -> None:
        """Draw everything; the labels come last, where there is room for them."""
        self._base()
        for axis in self._scene.axes:
            self._axis(axis)
        self._lengths()
        self._frames()
        self._tip()
        ordered = [label for _, label in sorted(self._labels, key=lambda item: item[0])]
        for placed in place_labels(ordered, self._paper.ink):
            self._write(placed)

    def _at(self, point: Array) -> Array:
        return np.asarray(self._scale * self._view.project(point))

    def _pointer_scale(self) -> float:
        """Return by how much frames' axes are shortened where frames are close to each other."""
        places = self._at(np.array(self._scene.origins))
        gaps = [float(np.linalg.norm(a - b)) for a, b in itertools.combinations(places, 2)]
        return min(1.0, max(0.6, 0.6 * min([1e3, *gaps]) / _POINTERS["z"][1]))

    def _label(
        self, rank: int, text: str, color: str, size: float, anchor: Array, towards: Array, **how: Any
    ) -> None:
        label = Label(
            text=text,
            color=color,
            size=size,
            box=text_size(text, size),
            anchor=anchor,
            towards=towards,
            **how,
        )
        self._labels.append((rank, label))

    def _write(self, placed: PlacedLabel) -> None:
        label = placed.label
        if placed.distance > _LEADER:
            way = placed.centre - label.anchor
            share = (placed.distance + label.clear) / float(np.linalg.norm(way))
            ends = np.array([label.anchor + 2.0 * way / np.linalg.norm(way), label.anchor + share * way])
            self._paper.line(ends, label.color, 0.5, layer=10, alpha=0.7)
        self._paper.text(placed.centre, label.text, label.color, label.size, align="center")

    def _base(self) -> None:
        """Draw the ground below base_link, and a dashed line to frame 0."""
        x, y = self._at(np.zeros(3)).tolist()
        self._paper.line(np.array([[x - 17.0, y], [x + 17.0, y]]), INK, 1.3, layer=3)
        for tick in np.linspace(x - 17.0, x + 11.0, 6).tolist():
            self._paper.line(np.array([[tick + 6.0, y], [tick, y - 6.0]]), INK, 0.7, layer=3)
        self._label(3, "base_link", INK, 8.0, np.array([x - 17.0, y - 3.0]), np.array([-1.0, -0.3]))
        self._dashed(np.zeros(3), self._scene.origins[0])

    def _tip(self) -> None:
        at = self._at(self._scene.tip)
        self._dashed(self._scene.last_origin, self._scene.tip)
        self._paper.dot(at, INK, 6.0, layer=9, marker="D")
        self._label(2, "tool0", INK, 8.5, at, np.array([1.0, 0.0]), either=True, clear=2.0)

    def _dashed(self, start: Array, end: Array) -> None:
        ends = np.array([self._at(start), self._at(end)])
        if np.linalg.norm(ends[1] - ends[0]) > 0.5:
            self._paper.line(ends, GREY, 1.2, layer=2, ls=(0, (2, 2)))

    def _lengths(self) -> None:
        for segment in self._scene.segments:
            ends = np.array([self._at(segment.start), self._at(segment.end)])
            self._paper.line(ends, BODY, 9.0, layer=1, solid_capstyle="round")
        for segment in self._scene.segments:
            ends = np.array([self._at(segment.start), self._at(segment.end)])
            color = _COLORS[segment.letter]
            self._paper.line(ends, color, 1.5, layer=4)
            way = ends[1] - ends[0]
            aside = np.array([-way[1], way[0]])
            text = f"${segment.letter}_{{{segment.index}}}$"
            if np.linalg.norm(way) < _SHORT:
                continue
            self._label(1, text, color, 11.0, ends.mean(axis=0), aside, either=True, clear=2.0)

    def _frames(self) -> None:
        for pointer in self._scene.pointers:
            color, length, width = _POINTERS[pointer.letter]
            start = self._at(pointer.origin)
            way = self._pointers * length * self._view.project(pointer.direction)
            layer = {"x": 7, "y": 5, "z": 6}[pointer.letter]
            if np.linalg.norm(way) > 4.0:
                self._paper.arrow(start, start + way, color, width, layer=layer)
            if pointer.letter != "y":
                text = _names(pointer.letter, pointer.indices)
                self._label(0, text, color, 10.5, start + way, way)
        for origin in self._scene.origins:
            self._paper.dot(self._at(origin), INK, 4.6, layer=8)

    def _axis(self, axis: JointAxis) -> None:
        """Draw the line, and a symbol for every joint: the first beyond one end, the others beyond the other."""
        flat = self._view.project(axis.direction)
        along = flat / max(0.25, float(np.linalg.norm(flat)))
        start, end = self._at(axis.start), self._at(axis.end)
        many = len(axis.joints) > 1
        upper = _REACH + _STEP * max(0, len(axis.joints) - 2)
        ends = np.array([start - (_REACH if many else 0.35 * _REACH) * along, end + upper * along])
        self._paper.line(ends, GREY, 0.9, layer=2, ls=(0, (9, 3, 2, 3)))
        for k, (joint, sense) in enumerate(zip(axis.joints, axis.senses, strict=True)):
            if many and k == 0:
                place = start - (_REACH - 11.0) * along
            else:
                place = end + (_REACH - 11.0 + _STEP * (k - many)) * along
            turns = self._scene.spec.rows[joint - 1].type.turns
            symbol: Callable[[Array, Array], None] = self._revolute if turns else self._prismatic
            symbol(place, sense * axis.direction)
            aside = np.array([along[1], -along[0]])
            self._label(1, f"joint {joint}", INK, 8.5, place, aside, either=True, clear=7.0)

    def _revolute(self, at: Array, direction: Array) -> None:
        """Draw an arrow around the axis, right-handed."""
        ring = _RING * self._view.project(ring_around(direction, self._view.up))
        self._paper.line(at + ring[:-2], INK, 1.1, layer=5)
        self._paper.arrow(at + ring[-6], at + ring[-1], INK, 1.1, layer=5)

    def _prismatic(self, at: Array, direction: Array) -> None:
        """Draw a box with an arrow along the axis."""
        flat = self._view.project(direction)
        along = flat / (float(np.linalg.norm(flat)) or 1.0)
        aside = 4.2 * np.array([-along[1], along[0]])
        box = np.array([at - 8.0 * along - aside, at + 8.0 * along - aside, at + 8.0 * along + aside])
        box = np.vstack([box, at - 8.0 * along + aside, box[0]])
        self._paper.axes.fill(box[:, 0], box[:, 1], color="white", lw=0, zorder=4)
        self._paper.line(box, INK, 1.1, layer=5)
        self._paper.arrow(at - 12.5 * along, at + 12.5 * along, INK, 1.1, layer=5, style="<|-|>")


def ring_around(direction: Array, up: Array) -> Array:
    """Return most of a circle of radius 1, right-handed about a direction; its gap is where ``up`` points.

    Returns:
        Points in the order in which the circle runs, shape (59, 3).
    """
    first = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    first /= np.linalg.norm(first)
    second = np.cross(direction, first)
    begin = math.atan2(float(second @ up), float(first @ up)) + math.radians(35.0)
    angles = begin + np.radians(np.linspace(0.0, 290.0, 59))[:, None]
    return np.asarray(np.cos(angles) * first + np.sin(angles) * second)


def _names(letter: str, indices: tuple[int, ...]) -> str:
    """Return the names of axes that coincide, such as x_4, x_5, x_6."""
    run = len(indices) > 3 and indices == tuple(range(indices[0], indices[-1] + 1))
    if run:
        return f"${letter}_{{{indices[0]}}} \\ldots {letter}_{{{indices[-1]}}}$"
    return f"${', '.join(f'{letter}_{{{index}}}' for index in indices)}$"
