"""The stick plot as MATLAB's Robotics Toolbox draws it: the arm in the box of its workspace, base line and shadow.

The view is MATLAB's usual one, from azimuth -37.5 and elevation 30 degrees by its count (P. Corke, Robotics Toolbox
for MATLAB, release 9, ``SerialLink.plot``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from dh2sim.draw.diagram.arm import Arm
from dh2sim.draw.diagram.sheet import Sheet, text_box
from dh2sim.draw.diagram.symbols import ball, box, cylinder, towards_viewer
from dh2sim.draw.frame_figure.paper import X_COLOR, Y_COLOR, Z_COLOR
from dh2sim.draw.labels import Label, place_labels
from dh2sim.draw.plot_style import INK
from dh2sim.draw.projection import look_from
from dh2sim.typing import Array

SIZE = 380.0
"""Of the box on the paper, pt."""
_VIEW = look_from(-127.5, 30.0)
_GRID, _EDGE, _SHADOW, _ARM, _JOINT = "#d8dce2", "#5b6168", "#b9bfc7", "#2f6fb5", "#f0b429"
_LETTERS = 9.5
_TICKS = 5
"""Ticks of an axis, about."""
_RADIUS, _HALF, _AXES = 0.022, 0.04, 0.12
"""Radius and half length of joints, and length of the tool's axes, as shares of the reach."""

Box = tuple[float, float, float, float, float, float]
"""Least and greatest x, y and z of a workspace, m."""


def usual_workspace(arm: Arm) -> Box:
    """Return a cube around the arm's base that holds the arm, with rounded edges."""
    points = np.vstack([np.zeros((1, 3)), arm.frames[:, :3, 3], arm.T_base_tool[None, :3, 3]])
    size = max(float(np.abs(points).max()), 0.6 * arm.reach)
    step = tick_step(2.0 * size)
    edge = step * math.ceil(1.05 * size / step)
    return (-edge, edge, -edge, edge, -edge, edge)


def tick_step(length: float) -> float:
    """Return the distance of ticks along an axis of a length: 1, 2 or 5 times a power of ten."""
    raw = length / _TICKS
    power = 10.0 ** math.floor(math.log10(raw))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= 0.999 * raw)


def draw_stick(arm: Arm, workspace: Box | None, reach: float | None) -> Sheet:
    """Draw an arm in the box of its workspace.

    Args:
        arm: The robot at a configuration.
        workspace: The box, m; by default a cube that holds the arm.
        reach: Length that the size of joints and of the tool's axes is measured by, m; by default the arm's.
    """
    low, high = _corners(workspace or usual_workspace(arm))
    corners = np.array(
        [[(low, high)[k][0], (low, high)[j][1], (low, high)[i][2]] for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    )
    scale = SIZE / float(np.ptp(_VIEW.project(corners), axis=0).max())
    sheet = Sheet()

    def at(point: Sequence[float] | Array) -> Array:
        return scale * _VIEW.project(np.asarray(point, float))

    labels = _draw_box(sheet, at, low, high)
    base, tool = np.zeros(3), arm.T_base_tool[:3, 3]
    for path in arm.paths:
        shadow = path.points * [1.0, 1.0, 0.0] + [0.0, 0.0, low[2]]
        sheet.line(at(shadow), _SHADOW, 4.0)
    foot = np.array([0.0, 0.0, low[2]])
    sheet.line([at(foot), at(base)], INK, 2.0, dash=(5.0, 4.0))
    for path in arm.paths:
        sheet.line(at(path.points), _ARM, 4.5)
    size = arm.reach if reach is None else reach
    for joint in sorted(arm.joints, key=lambda joint: float(joint.reached @ towards_viewer(_VIEW))):
        middle = at(joint.origin if joint.type.turns else 0.5 * (joint.reached + joint.left))
        style, across = (_JOINT, INK, 0.8), (scale * _RADIUS * size, scale * _HALF * size)
        if joint.type.turns:
            cylinder(sheet, _VIEW, middle, joint.direction, across, style)
        elif joint.type.moves:
            box(sheet, _VIEW, middle, (joint.direction, joint.side), across, style)
    for closure in arm.closures:
        ball(sheet, at(closure.middle), max(2.5, scale * _RADIUS * size), ("#ffffff", INK, 0.8))
    for letter, column, color in (("x", 0, X_COLOR), ("y", 1, Y_COLOR), ("z", 2, Z_COLOR)):
        end = tool + _AXES * size * arm.T_base_tool[:3, column]
        sheet.arrow(at(tool), at(end), color, 1.4)
        way = at(end) - at(tool)
        labels.append(_label(letter, color, at(end), way if np.linalg.norm(way) > 1e-6 else np.array([0.0, 1.0])))
    labels.append(_label(arm.spec.name, INK, at(foot), np.array([-1.0, -0.6])))
    for placed in place_labels(labels, sheet.ink):
        sheet.write(placed.centre, placed.label.text, placed.label.size, placed.label.color)
    return sheet


def _corners(workspace: Box) -> tuple[Array, Array]:
    return np.array(workspace[0::2]), np.array(workspace[1::2])


def _draw_box(sheet: Sheet, at: Callable[[Sequence[float] | Array], Array], low: Array, high: Array) -> list[Label]:
    """Draw the floor and the walls behind the arm with a grid; return the labels of axes and ticks."""
    back = [(low if side < 0.0 else high)[k] for k, side in enumerate(-towards_viewer(_VIEW))]
    front = [(high if side < 0.0 else low)[k] for k, side in enumerate(-towards_viewer(_VIEW))]
    ticks = [_ticks(low[k], high[k]) for k in range(3)]
    labels: list[Label] = []
    for k in range(3):  # the wall at a fixed coordinate k
        u, v = (k + 1) % 3, (k + 2) % 3
        for along, across in ((u, v), (v, u)):
            for value in ticks[along]:
                ends = []
                for end in (low[across], high[across]):
                    point = [0.0, 0.0, 0.0]
                    point[k], point[along], point[across] = back[k], value, end
                    ends.append(point)
                sheet.line(at(np.array(ends)), _GRID, 0.6)
        square = []
        for p, q in ((low, low), (high, low), (high, high), (low, high)):
            point = [0.0, 0.0, 0.0]
            point[k], point[u], point[v] = back[k], p[u], q[v]
            square.append(point)
        sheet.line(at(np.array([*square, square[0]])), _EDGE, 0.8)
    middle = at(0.5 * (low + high))
    free = {0: (None, front[1], back[2]), 1: (front[0], None, back[2]), 2: (back[0], front[1], None)}
    for k, place in free.items():

        def on_edge(value: float, place: tuple[float | None, ...] = place) -> Array:
            return at([value if fixed is None else fixed for fixed in place])

        outward = on_edge(0.5 * (low[k] + high[k])) - middle
        labels += [_label(_shown(value), _EDGE, on_edge(value), outward) for value in ticks[k]]
        labels.append(_label("XYZ"[k], INK, on_edge(0.5 * (low[k] + high[k])), outward, clear=16.0))
    return labels


def _ticks(low: float, high: float) -> list[float]:
    step = tick_step(high - low)
    return [step * k for k in range(math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6) + 1)]


def _shown(value: float) -> str:
    return f"{value + 0.0:.6g}".replace("-", "\N{MINUS SIGN}")


def _label(text: str, color: str, anchor: Array, towards: Array, *, clear: float = 0.0) -> Label:
    return Label(
        text=text,
        color=color,
        size=_LETTERS,
        box=text_box(text, _LETTERS),
        anchor=anchor,
        towards=towards,
        clear=clear,
    )
