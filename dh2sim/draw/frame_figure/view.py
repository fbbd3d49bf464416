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
    i, j = np.triu_indices(len(flat), 1)
    if not i.size:
        return least + 1.0
    a, b = flat[i], flat[j]
    crossed = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / (lengths[i] * lengths[j] + 1e-12)
    angle = math.asin(min(1.0, float(crossed.min())))
    return least + min(_OPEN, angle) / _OPEN


def _distances(scene: Scene, view: ParallelView, size: float) -> float:
    """Rate how far points are from each other, and from lengths that they do not belong to."""
    points = view.project(np.array(scene.origins))
    enough = _ENOUGH * size
    i, j = np.triu_indices(len(points), 1)
    apart = np.minimum(enough, _norms(points[i] - points[j])) / enough if i.size else np.ones(1)
    starts, ends = _ends(scene)
    beside = 1.0
    if len(starts):
        origins = np.array(scene.origins)[:, None]
        others = np.minimum(_norms(origins - starts), _norms(origins - ends)) > SAME * size
        gaps = _to_segments(points[:, None], view.project(starts), view.project(ends))
        beside = float(np.min(gaps, where=others, initial=enough)) / enough
    return float(apart.min()) + float(apart.mean()) + beside


def _crossings(scene: Scene, view: ParallelView) -> int:
    """Return how many lengths cross each other in the picture: the interiors of two segments meet on the paper."""
    starts, ends = _ends(scene)
    i, j = np.triu_indices(len(starts), 1)
    if not i.size:
        return 0
    starts, ends = view.project(starts), view.project(ends)
    p, q, r, s = starts[i], ends[i], starts[j], ends[j]
    sides = np.array([_side(p, q, r), _side(p, q, s), _side(r, s, p), _side(r, s, q)])
    clear = np.abs(sides).min(axis=0) > 1e-9 * (_norms(p - q) + _norms(r - s)) ** 2
    return int(np.sum(clear & (sides[0] * sides[1] < 0.0) & (sides[2] * sides[3] < 0.0)))


def _ends(scene: Scene) -> tuple[Array, Array]:
    """Return the starts and the ends of all lengths, shape (number, 3) each."""
    segments = scene.segments
    starts = np.array([segment.start for segment in segments]).reshape(-1, 3)
    return starts, np.array([segment.end for segment in segments]).reshape(-1, 3)


def _side(start: Array, end: Array, point: Array) -> Array:
    way, there = end - start, point - start
    return np.asarray(way[..., 0] * there[..., 1] - way[..., 1] * there[..., 0])


def _norms(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.sum(vectors**2, axis=-1)))


def _to_segments(points: Array, starts: Array, ends: Array) -> Array:
    """Return the distances of points from segments."""
    ways = ends - starts
    lengths = np.sum(ways * ways, axis=-1)
    shares = np.sum((points - starts) * ways, axis=-1) / np.where(lengths > 0.0, lengths, 1.0)
    return _norms(points - starts - np.clip(shares, 0.0, 1.0)[..., None] * ways)
