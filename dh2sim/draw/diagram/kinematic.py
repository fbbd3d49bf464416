"""The kinematic diagram of textbooks, and the same arm with the frames alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dh2sim.draw.diagram.arm import Arm, ClosurePlace, JointPlace
from dh2sim.draw.diagram.linkage import plane_view
from dh2sim.draw.diagram.sheet import Sheet, subscripted, text_box
from dh2sim.draw.diagram.symbols import ball, box, cylinder, gripper, ground, hull, towards_viewer
from dh2sim.draw.frame_figure.paper import A_COLOR, D_COLOR, X_COLOR, Y_COLOR, Z_COLOR
from dh2sim.draw.frame_figure.scene import SAME, Segment
from dh2sim.draw.frame_figure.view import best_view
from dh2sim.draw.labels import Label, place_labels
from dh2sim.draw.plot_style import GREY, INK
from dh2sim.draw.projection import ParallelView
from dh2sim.robot.mechanism import ClosureType
from dh2sim.typing import Array

SIZE = 330.0
"""Of the arm on the paper, pt."""
_RADIUS, _HALF = 7.5, 11.0
"""Of a joint's symbol, pt."""
_APART = 27.0
"""Least distance of symbols, pt."""
_ARROW = {"x": 27.0, "y": 24.0, "z": 32.0}
_COLORS = {"x": X_COLOR, "y": Y_COLOR, "z": Z_COLOR}
_SHORT = 18.0
_LETTERS, _SMALL_LETTERS = 12.0, 9.0
_SHORT_NAME = 2
"""Most characters of a name in letters of the usual size."""
_PLATE, DRIVEN, OPEN = "#e9ecf0", "#f6d98b", "#c62828"
_FEW = 8
"""Most joints of a mechanism whose lengths are named; more names would hide it."""
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
        across = plane_view(arm) if symbols and arm.spec.is_mechanism else None
        self._view: ParallelView = across or best_view(arm.scene)
        flat = self._view.project(np.vstack([arm.scene.corners, arm.T_base_tool[:3, 3]]))
        extent = float(np.ptp(flat, axis=0).max())
        self._scale = SIZE / extent if extent > 0.0 else 1.0
        self._sheet = Sheet()
        self._labels: list[Label] = []

    def draw(self) -> Sheet:
        places = self._spread() if self._symbols else {}
        self._draw_arm(places)
        if not self._arm.spec.is_mechanism:
            self._draw_lengths()
        elif self._symbols and len(self._arm.spec.moving_rows) <= _FEW:
            self._name_lengths()
        for joint in sorted(self._arm.joints, key=lambda joint: self._depth(joint, places)):
            if joint.index in places:
                self._draw_joint(joint, places[joint.index])
        for closure in sorted(self._arm.closures, key=lambda closure: float(closure.middle @ self._towards)):
            self._draw_closure(closure)
        if not self._arm.spec.is_mechanism:
            self._draw_frames()
        elif not self._symbols:
            self._draw_named_frames()
        for placed in place_labels(self._labels, self._sheet.ink):
            if placed.distance > 12.0:
                self._lead(placed.label, placed.centre)
            self._sheet.write(placed.centre, placed.label.text, placed.label.size, placed.label.color)
        return self._sheet

    def _at(self, point: Array) -> Array:
        return self._scale * self._view.project(point)

    def _depth(self, joint: JointPlace, places: dict[int, Array]) -> float:
        place = places.get(joint.index, joint.reached)
        return float(place @ self._towards)

    @property
    def _towards(self) -> Array:
        return towards_viewer(self._view)

    def _spread(self) -> dict[int, Array]:
        """Return a place in space for each joint that moves, apart from the others, on its own axis."""
        step = _APART / self._scale
        fixed = [self._at(np.zeros(3)) - np.array([0.0, 6.0]), self._at(self._arm.T_base_tool[:3, 3])]
        taken: list[Array] = [self._at(closure.middle) for closure in self._arm.closures]
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
        for plate in arm.plates if self._symbols else ():
            corners = hull(self._at(plate))
            if len(corners) > 2:
                sheet.area(corners, _PLATE, GREY, 1.0)
        for place in arm.grounds:
            ground(sheet, self._at(place), INK)
        for path in arm.paths:
            points = list(path.start)
            for joint in path.joints:
                on_axis = [places[joint.index]] if joint.index in places else []
                points += [joint.reached, *on_axis, joint.left, joint.end]
            line = self._at(np.array([*points, *path.end]))
            sheet.line(line, GREY if self._symbols else INK, 4.0 if self._symbols else 2.4)
        tool = self._at(arm.T_base_tool[:3, 3])
        if not arm.spec.is_mechanism:
            gripper(sheet, self._view, tool, arm.T_base_tool[:3, :3], INK)
        elif self._symbols:
            ball(sheet, tool, 3.0, (INK, INK, 1.0))
            self._label("tool0", INK, tool, np.array([1.0, 1.0]))

    def _draw_joint(self, joint: JointPlace, place: Array) -> None:
        at, reach = self._at(place), 30.0 * self._view.project(joint.direction)
        self._sheet.line([at - reach, at + reach], GREY, 0.8, dash=(7.0, 2.5, 1.5, 2.5))
        style = (DRIVEN if joint.driven else "#ffffff", INK, 1.2)
        if joint.type.turns:
            cylinder(self._sheet, self._view, at, joint.direction, (_RADIUS, _HALF), style)
        else:
            box(self._sheet, self._view, at, (joint.direction, joint.side), (0.85 * _RADIUS, 1.15 * _HALF), style)
        named = not self._arm.spec.is_mechanism and any(
            s.letter == "d" and s.index == joint.index for s in self._arm.segments
        )
        if joint.type.turns or not named:
            letter = "θ" if joint.type.turns else "d"
            aside = np.array([reach[1], -reach[0]])
            self._label(f"{letter}_{joint.index}", INK, at, aside, either=True, clear=8.0)

    def _draw_closure(self, closure: ClosurePlace) -> None:
        """Draw the joint that closes a loop with its name, and how far it is open where it is."""
        sheet, at = self._sheet, self._at(closure.middle)
        a, b = closure.T_base_a, closure.T_base_b
        slides = closure.type in (ClosureType.PRISMATIC, ClosureType.CYLINDRICAL)
        if np.linalg.norm(a[:3, 3] - b[:3, 3]) > SAME * self._arm.reach:
            line = ((GREY, 4.0) if self._symbols else (INK, 2.4)) if slides else (OPEN, 1.2)
            sheet.line(self._at(np.array([a[:3, 3], b[:3, 3]])), *line, dash=() if slides else (4.0, 3.0))
        axis = a[:3, 2]
        style = ("#ffffff", INK, 1.2)
        if not self._symbols:
            ball(sheet, at, 4.0, style)
        elif closure.type is ClosureType.SPHERICAL:
            ball(sheet, at, 0.8 * _RADIUS, style)
        elif closure.type is ClosureType.FIXED:
            ball(sheet, at, 0.4 * _RADIUS, (INK, INK, 1.0))
        else:
            along = 30.0 * self._view.project(axis)
            sheet.line([at - along, at + along], GREY, 0.8, dash=(7.0, 2.5, 1.5, 2.5))
            if closure.type is ClosureType.PRISMATIC:
                box(sheet, self._view, at, (axis, a[:3, 0]), (0.85 * _RADIUS, 1.15 * _HALF), style)
            elif closure.type is ClosureType.UNIVERSAL:
                for each in sorted((axis, b[:3, 2]), key=lambda each: float(abs(each @ self._towards))):
                    cylinder(sheet, self._view, at, each, (0.6 * _RADIUS, _HALF), style)
            else:
                longer = 1.6 if closure.type is ClosureType.CYLINDRICAL else 1.0
                cylinder(sheet, self._view, at, axis, (_RADIUS, longer * _HALF), style)
        if self._symbols:
            self._label(closure.name, INK, at, np.array([0.0, 1.0]), either=True, clear=8.0)

    def _draw_lengths(self) -> None:
        for segment in self._arm.segments:
            color = A_COLOR if segment.letter == "a" else D_COLOR
            self._sheet.line([self._at(segment.start), self._at(segment.end)], color, 1.6)
            self._name_length(segment, f"{segment.letter}_{segment.index}", color)

    def _name_lengths(self) -> None:
        """Name the lengths of a mechanism as its file does; a bar along a line is seen already."""
        for segment in self._arm.segments:
            color = A_COLOR if segment.letter == "a" else D_COLOR
            self._name_length(segment, segment.name or f"{segment.letter}_{segment.index}", color)

    def _name_length(self, segment: Segment, text: str, color: str) -> None:
        start, end = self._at(segment.start), self._at(segment.end)
        way = end - start
        aside = np.array([-way[1], way[0]]) if np.linalg.norm(way) > 1e-6 else np.array([1.0, 0.0])
        self._label(text, color, 0.5 * (start + end), aside, either=True)

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

    def _draw_named_frames(self) -> None:
        """Draw all axes of a mechanism's frames, and name the frames at each place."""
        for pointer in self._arm.pointers:
            start = self._at(pointer.origin)
            way = _SHORT * self._view.project(pointer.direction)
            self._sheet.arrow(start, start + way, _COLORS[pointer.letter], 1.1)
        least = SAME * self._arm.reach
        for origin in self._arm.scene.origins:
            here = [
                name
                for name, T in zip(self._arm.names, self._arm.frames, strict=True)
                if np.linalg.norm(T[:3, 3] - origin) <= least
            ]
            self._label(", ".join(_together(here)), INK, self._at(origin), np.array([1.0, -1.0]), clear=4.0)

    def _label(
        self, text: str, color: str, anchor: Array, towards: Array, *, either: bool = False, clear: float = 0.0
    ) -> None:
        size = _LETTERS if len(subscripted(text)[0]) <= _SHORT_NAME else _SMALL_LETTERS
        self._labels.append(
            Label(
                text=text,
                color=color,
                size=size,
                box=text_box(text, size),
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


def _together(names: Sequence[str]) -> list[str]:
    """Return names of frames with those of one chain together, such as ``leg/dh_0…2``."""
    chains: dict[str, list[int]] = {}
    for name in names:
        prefix, _, index = name.rpartition("_")
        chains.setdefault(prefix, []).append(int(index))
    return [f"{prefix}_{_run(tuple(indices))}" for prefix, indices in chains.items()]
