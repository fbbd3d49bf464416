"""Solids of the diagram, drawn as outlines: cylinders, boxes, the base and the tool."""

from __future__ import annotations

import math

import numpy as np

from dh2sim.draw.diagram.sheet import Sheet
from dh2sim.draw.projection import ParallelView
from dh2sim.typing import Array

_CORNERS = 48
"""Of a circle."""


def towards_viewer(view: ParallelView) -> Array:
    """Return the direction from the picture to who looks at it, a unit vector, shape (3,)."""
    return np.cross(view.right, view.up)


def cylinder(
    sheet: Sheet, view: ParallelView, at: Array, axis: Array, size: tuple[float, float], style: tuple[str, str, float]
) -> None:
    """Draw a cylinder.

    Args:
        sheet: The drawing.
        view: The projection.
        at: Its middle on the paper, pt, shape (2,).
        axis: Unit vector, shape (3,).
        size: Radius and half the length, pt.
        style: Fill, colour and width of the outline.
    """
    radius, half = size
    fill, color, width = style
    first, second = _across(axis)
    angles = np.array([math.tau * k / _CORNERS for k in range(_CORNERS)])[:, None]
    ring = radius * view.project(np.cos(angles) * first + np.sin(angles) * second)
    along = half * view.project(axis)
    front = along if float(axis @ towards_viewer(view)) >= 0.0 else -along
    sheet.area(at + hull(np.vstack([ring + along, ring - along])), fill, color, width)
    sheet.area(at + ring + front, fill, color, width)


def box(
    sheet: Sheet,
    view: ParallelView,
    at: Array,
    axes: tuple[Array, Array],
    size: tuple[float, float],
    style: tuple[str, str, float],
) -> None:
    """Draw a box with a square section.

    Args:
        sheet: The drawing.
        view: The projection.
        at: Its middle on the paper, pt, shape (2,).
        axes: Direction of its length and of a side, unit vectors, shape (3,).
        size: Half the width and half the length, pt.
        style: Fill, colour and width of the outline.
    """
    fill, color, width = style
    along, side = axes
    edges = (size[1] * along, size[0] * side, size[0] * np.cross(along, side))
    for k, normal in enumerate(edges):
        sign = 1.0 if float(normal @ towards_viewer(view)) >= 0.0 else -1.0
        u, v = edges[(k + 1) % 3], edges[(k + 2) % 3]
        corners = [sign * normal + a * u + b * v for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
        sheet.area(at + view.project(np.array(corners)), fill, color, width)


def ball(sheet: Sheet, at: Array, radius: float, style: tuple[str, str, float]) -> None:
    """Draw a ball around a point on the paper, given its fill, colour and width of the outline."""
    angles = np.array([math.tau * k / _CORNERS for k in range(_CORNERS)])
    fill, color, width = style
    sheet.area(at + radius * np.column_stack([np.cos(angles), np.sin(angles)]), fill, color, width)


def ground(sheet: Sheet, at: Array, color: str) -> None:
    """Draw the sign of what does not move, below a point on the paper."""
    x, y = at.tolist()
    sheet.line([(x - 15.0, y), (x + 15.0, y)], color, 1.6)
    for k in range(6):
        start = x - 12.0 + 5.4 * k
        sheet.line([(start, y), (start - 5.0, y - 6.0)], color, 0.9)


def gripper(sheet: Sheet, view: ParallelView, at: Array, R: Array, color: str) -> None:
    """Draw a gripper whose fingers point along z of tool0, the side by side direction being y."""
    y, z = 7.0 * view.project(R[:, 1]), 11.0 * view.project(R[:, 2])
    if np.linalg.norm(y) < 3.0:
        y = 7.0 * view.project(R[:, 0])
    sheet.line([at + y + z, at + y, at - y, at - y + z], color, 2.2)


def _across(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors at right angles to an axis and each other."""
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def hull(points: Array) -> Array:
    """Return the corners of the convex hull of points on the paper, shape (count, 2)."""
    order = sorted(map(tuple, np.round(points, 6).tolist()))
    halves: list[tuple[float, float]] = []
    for run in (order, order[::-1]):
        half: list[tuple[float, float]] = []
        for x, y in run:
            while len(half) > 1 and (half[-1][0] - half[-2][0]) * (y - half[-2][1]) <= (half[-1][1] - half[-2][1]) * (
                x - half[-2][0]
            ):
                half.pop()
            half.append((x, y))
        halves += half[:-1]
    return np.array(halves)
