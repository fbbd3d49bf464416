"""The kinematic diagram of textbooks, and the same arm with the frames alone."""

from __future__ import annotations

import numpy as np

from dh2sim.draw.diagram.arm import Arm, JointPlace
from dh2sim.draw.diagram.sheet import Sheet, text_box
from dh2sim.draw.diagram.symbols import box, cylinder, gripper, ground, towards_viewer
from dh2sim.draw.frame_figure.paper import A_COLOR, D_COLOR, X_COLOR, Y_COLOR, Z_COLOR
from dh2sim.draw.frame_figure.view import best_view
from dh2sim.draw.labels import Label, place_labels
from dh2sim.draw.plot_style import GREY, INK
from dh2sim.draw.projection import ParallelView
from dh2sim.typing import Array

SIZE = 330.0
"""Of the arm on the paper, pt."""
_RADIUS, _HALF = 7.5, 11.0
"""Of a joint's symbol, pt."""
_APART = 27.0
"""Least distance of symbols, pt."""
_ARROW = {"x": 27.0, "y": 24.0, "z": 32.0}
_COLORS = {"x": X_COLOR, "y": Y_COLOR, "z": Z_COLOR}
_LETTERS = 12.0
_SHIFTS = (0, -1, 1, -2, 2, -3, 3, -4, 4)
"""Places that are tried for a symbol, in ``_APART``."""


def draw_kinematic(arm: Arm, *, symbols: bool) -> Sheet:
    """Draw an arm.

    Args:
        arm: The robot at a configuration.
        symbols: Whether to draw joints as cylinders and boxes; otherwise all axes of the frames, y too, and the arm
            as lines.
    """
    return _Diagram(arm, symbols=symbols).draw()


class _Diagram:
    def __init__(self, arm: Arm, *, symbols: bool) -> None:
        self._arm = arm
        self._symbols = symbols
        self._view: ParallelView = best_view(arm.scene)
        flat = self._view.project(np.vstack([arm.scene.corners, arm.T_base_tool[:3, 3]]))
        extent = float(np.ptp(flat, axis=0).max())
        self._scale = SIZE / extent if extent > 0.0 else 1.0
        self._sheet = Sheet()
        self._labels: list[Label] = []

    def draw(self) -> Sheet:
        places = self._spread() if self._symbols else {}
        self._draw_arm(places)
        self._draw_lengths()
        for joint in sorted(self._arm.joints, key=lambda joint: self._depth(joint, places)):
            if joint.index in places:
                self._draw_joint(joint, places[joint.index])
        self._draw_frames()
        for placed in place_labels(self._labels, self._sheet.ink):
            if placed.distance > 12.0:
                self._lead(placed.label, placed.centre)
            self._sheet.write(placed.centre, placed.label.text, placed.label.size, placed.label.color)
        return self._sheet

    def _at(self, point: Array) -> Array:
        return self._scale * self._view.project(point)

    def _depth(self, joint: JointPlace, places: dict[int, Array]) -> float:
        place = places.get(joint.index, joint.reached)
        return float(place @ towards_viewer(self._view))

    def _spread(self) -> dict[int, Array]:
        """Return a place in space for each joint that moves, apart from the others, on its own axis."""
        step = _APART / self._scale
        fixed = [self._at(np.zeros(3)) - np.array([0.0, 6.0]), self._at(self._arm.T_base_tool[:3, 3])]
        taken: list[Array] = []
        places: dict[int, Array] = {}
        moving = [joint for joint in self._arm.joints if joint.type.moves]
        for joint in sorted(moving, key=lambda joint: -round(float(np.linalg.norm(joint.left - joint.reached)), 9)):
            middle = 0.5 * (joint.reached + joint.left)
            costs = []
            for order, shift in enumerate(_SHIFTS):
                place = middle + 0.5 * shift * step * joint.direction
                flat = self._at(place)
                near = sum(max(0.0, _APART - float(np.linalg.norm(flat - other))) for other in taken)
                near += 0.5 * sum(max(0.0, 18.0 - float(np.linalg.norm(flat - other))) for other in fixed)
                costs.append(near + 0.8 * order)
            best = int(np.argmin(np.round(costs, 6)))
            places[joint.index] = middle + 0.5 * _SHIFTS[best] * step * joint.direction
            taken.append(self._at(places[joint.index]))
        return places

    def _draw_arm(self, places: dict[int, Array]) -> None:
        arm, sheet = self._arm, self._sheet
        points = [np.zeros(3), arm.frames[0][:3, 3]]
        for joint, here in zip(arm.joints, arm.frames[1:], strict=True):
            on_axis = [places[joint.index]] if joint.index in places else []
            points += [joint.reached, *on_axis, joint.left, here[:3, 3]]
        points.append(arm.T_base_tool[:3, 3])
        ground(sheet, self._at(np.zeros(3)), INK)
        sheet.line(self._at(np.array(points)), GREY if self._symbols else INK, 4.0 if self._symbols else 2.4)
        gripper(sheet, self._view, self._at(arm.T_base_tool[:3, 3]), arm.T_base_tool[:3, :3], INK)

    def _draw_joint(self, joint: JointPlace, place: Array) -> None:
        at, reach = self._at(place), 30.0 * self._view.project(joint.direction)
        self._sheet.line([at - reach, at + reach], GREY, 0.8, dash=(7.0, 2.5, 1.5, 2.5))
        style = ("#ffffff", INK, 1.2)
        if joint.type.turns:
            cylinder(self._sheet, self._view, at, joint.direction, (_RADIUS, _HALF), style)
        else:
            box(self._sheet, self._view, at, (joint.direction, joint.side), (0.85 * _RADIUS, 1.15 * _HALF), style)
        slides = any(s.letter == "d" and s.index == joint.index for s in self._arm.segments)
        if joint.type.turns or not slides:
            letter = "θ" if joint.type.turns else "d"
            aside = np.array([reach[1], -reach[0]])
            self._label(f"{letter}_{joint.index}", INK, at, aside, either=True, clear=8.0)

    def _draw_lengths(self) -> None:
        for segment in self._arm.segments:
            start, end = self._at(segment.start), self._at(segment.end)
            color = A_COLOR if segment.letter == "a" else D_COLOR
            self._sheet.line([start, end], color, 1.6)
            way = end - start
            self._label(
                f"{segment.letter}_{segment.index}",
                color,
                0.5 * (start + end),
                np.array([-way[1], way[0]]) if np.linalg.norm(way) > 1e-6 else np.array([1.0, 0.0]),
                either=True,
            )

    def _draw_frames(self) -> None:
        for pointer in self._arm.pointers:
            if pointer.letter == "y" and self._symbols:
                continue
            start = self._at(pointer.origin)
            way = _ARROW[pointer.letter] * self._view.project(pointer.direction)
            self._sheet.arrow(start, start + way, _COLORS[pointer.letter], 1.3)
            towards = way if np.linalg.norm(way) > 1e-6 else np.array([0.0, 1.0])
            indices = _run(pointer.indices)
            self._label(f"{pointer.letter}_{indices}", _COLORS[pointer.letter], start + way, towards)
        for origin in self._arm.scene.origins:
            at = self._at(origin)
            ring = 2.2 * np.array([[np.cos(a), np.sin(a)] for a in np.arange(12) * np.pi / 6.0])
            self._sheet.area(at + ring, INK)

    def _label(
        self, text: str, color: str, anchor: Array, towards: Array, *, either: bool = False, clear: float = 0.0
    ) -> None:
        self._labels.append(
            Label(
                text=text,
                color=color,
                size=_LETTERS,
                box=text_box(text, _LETTERS),
                anchor=anchor,
                towards=towards,
                either=either,
                clear=clear,
            )
        )

    def _lead(self, label: Label, centre: Array) -> None:
        """Draw a thin line from a label that is far from what it names."""
        way = label.anchor - centre
        half = 0.5 * np.array(label.box) + 1.0
        inside = float(np.min(half / np.maximum(np.abs(way), 1e-9)))
        if inside < 0.8:
            self._sheet.line([centre + inside * way, label.anchor - 0.08 * way], label.color, 0.4)


def _run(indices: tuple[int, ...]) -> str:
    """Return indices that share an axis, such as ``3,5`` or ``0…4``."""
    if len(indices) > 2 and indices == tuple(range(indices[0], indices[-1] + 1)):
        return f"{indices[0]}…{indices[-1]}"
    return ",".join(map(str, indices))
