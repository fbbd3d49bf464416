"""The direction from which a robot's frames and lengths are seen best."""

from __future__ import annotations

import itertools
import math

import numpy as np

from dh2sim.draw.frame_figure.scene import SAME, Scene
from dh2sim.draw.projection import ParallelView, look_from
from dh2sim.typing import Array

_AZIMUTHS = tuple(sign * azimuth for azimuth in (*range(20, 75, 5), *range(110, 165, 5)) for sign in (-1, 1))
_ELEVATIONS = tuple(range(14, 40, 4))
_USUAL = (-55, 22)
"""Azimuth and elevation, degrees, unless others show more."""
_ENOUGH = 0.06
"""Share of the picture's size at which points are well apart."""
_LONG = 0.55
"""Share of its length with which an axis is well seen."""
_OPEN = math.radians(22)
"""Angle between axes in the picture at which they are well apart."""


def best_view(scene: Scene) -> ParallelView:
    """Return the view in which points, lines and directions that differ are farthest apart."""
    places = itertools.product(_AZIMUTHS, _ELEVATIONS)
    directions = _distinct_directions(scene)
    azimuth, elevation = max(places, key=lambda place: round(_merit(scene, directions, *place), 6))
    return look_from(azimuth, elevation)


def _merit(scene: Scene, directions: Array, azimuth: int, elevation: int) -> float:
    view = look_from(azimuth, elevation)
    corners = scene.corners
    size = float(np.ptp(view.project(corners), axis=0).max()) or 1.0
    turned = abs((azimuth - _USUAL[0] + 180) % 360 - 180)
    unusual = turned / 90 + abs(elevation - _USUAL[1]) / 60
    return (
        _directions(view.project(directions))
        + _distances(scene, view, size)
        - 0.5 * _crossings(scene, view)
        - 0.3 * unusual
    )


def _distinct_directions(scene: Scene) -> Array:
    """Return the directions of all x and z axes, opposite ones once, shape (number, 3)."""
    kept: list[Array] = []
    for pointer in scene.pointers:
        if pointer.letter != "y" and all(np.linalg.norm(np.cross(pointer.direction, other)) > SAME for other in kept):
            kept.append(pointer.direction)
    return np.array(kept)


def _directions(flat: Array) -> float:
    """Rate how well projected directions, shape (number, 2), are seen and distinguished."""
    lengths = np.linalg.norm(flat, axis=1)
    least = min(_LONG, float(lengths.min())) / _LONG
    angles = [
        math.asin(min(1.0, abs(float(a[0] * b[1] - a[1] * b[0])) / float(la * lb + 1e-12)))
        for (a, la), (b, lb) in itertools.combinations(zip(flat, lengths, strict=True), 2)
    ]
    return least + min([_OPEN, *angles]) / _OPEN


def _distances(scene: Scene, view: ParallelView, size: float) -> float:
    """Rate how far points are from each other, and from lengths that they do not belong to."""
    points = view.project(np.array(scene.origins))
    enough = _ENOUGH * size
    apart = [min(enough, float(np.linalg.norm(a - b))) / enough for a, b in itertools.combinations(points, 2)] or [
        1.0
    ]
    beside = [1.0]
    for segment in scene.segments:
        start, end = view.project([segment.start, segment.end])
        for origin, point in zip(scene.origins, points, strict=True):
            if min(_gap(origin, segment.start), _gap(origin, segment.end)) > SAME * size:
                beside.append(min(enough, _to_segment(point, start, end)) / enough)
    return min(apart) + float(np.mean(apart)) + min(beside)


def _crossings(scene: Scene, view: ParallelView) -> int:
    """Return how many lengths cross each other in the picture."""
    flat = [view.project([segment.start, segment.end]) for segment in scene.segments]
    return sum(_cross(a, b) for a, b in itertools.combinations(flat, 2))


def _cross(a: Array, b: Array) -> bool:
    """Return whether the interiors of two segments, each of shape (2, 2), meet on the paper."""
    (p, q), (r, s) = a, b
    sides = [_side(p, q, r), _side(p, q, s), _side(r, s, p), _side(r, s, q)]
    least = 1e-9 * (_gap(p, q) + _gap(r, s)) ** 2
    if min(map(abs, sides)) <= least:
        return False
    return sides[0] * sides[1] < 0.0 and sides[2] * sides[3] < 0.0


def _side(start: Array, end: Array, point: Array) -> float:
    way, there = end - start, point - start
    return float(way[0] * there[1] - way[1] * there[0])


def _gap(a: Array, b: Array) -> float:
    return float(np.linalg.norm(a - b))


def _to_segment(point: Array, start: Array, end: Array) -> float:
    way = end - start
    share = float((point - start) @ way) / (float(way @ way) or 1.0)
    return _gap(point, start + min(1.0, max(0.0, share)) * way)
