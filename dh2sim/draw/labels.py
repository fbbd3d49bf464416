"""Where labels go so that they do not cover each other.

In a picture that is looked at for long, ``place_labels`` weighs all places around what a label names, and what they
would cover. In a picture that moves, ``vertical_shift`` keeps a label where it is as far as possible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from dh2sim.typing import Array

ANGLES: Final = 24
RADII: Final = (5.0, 9.0, 14.0, 20.0, 28.0, 38.0, 50.0)
"""Distances between an anchor and the nearest edge of its label that are tried, pt."""
COVERED: Final = 4.0
"""Cost of every point of the drawing that a label covers; one pt of distance costs 0.1."""
OVERLAP: Final = 60.0
"""Cost of covering another label, besides the area."""
TURNED: Final = 1.2
"""Cost of a direction at a right angle to the one wanted."""
PADDING: Final = 1.5
MAX_STEPS: Final = 12
"""Half heights of a label that ``vertical_shift`` moves it at most, so that it stays near what it names."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Label:
    """A text and the point that it names."""

    text: str
    color: str
    size: float
    """Of the letters, pt."""
    box: tuple[float, float]
    """Width and height of the text, pt."""
    anchor: Array
    """The point, pt on the paper, shape (2,)."""
    towards: Array
    """The direction from the anchor in which the label is best placed, shape (2,)."""
    either: bool = False
    """Whether the opposite direction is as good."""
    clear: float = 0.0
    """Distance around the anchor that the label keeps off, pt."""


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
        labels: the most important first.
        ink: points of what is drawn, pt, shape (number, 2).
    """
    placed: list[PlacedLabel] = []
    boxes: list[Array] = []
    for label in labels:
        half = 0.5 * np.array(label.box) + PADDING
        candidates = [_candidate(label, half, k, radius) for radius in RADII for k in range(ANGLES)]
        near = _near(ink, candidates, half)
        costs = [_cost(label, half, centre, radius, boxes, near) for centre, radius in candidates]
        centre, radius = candidates[int(np.argmin(np.round(costs, 6)))]
        boxes.append(np.concatenate([centre - half, centre + half]))
        placed.append(PlacedLabel(label=label, centre=centre, distance=radius))
    return placed


def _candidate(label: Label, half: Array, step: int, radius: float) -> tuple[Array, float]:
    """Return the centre of the label's box whose edge is ``radius`` from the anchor in the direction of a step."""
    angle = math.tau * step / ANGLES
    way = np.array([math.cos(angle), math.sin(angle)])
    inside = float(np.min(half / np.maximum(np.abs(way), 1e-9)))
    return label.anchor + (label.clear + radius + inside) * way, radius


def _near(ink: Array, candidates: Sequence[tuple[Array, float]], half: Array) -> Array:
    """Return the points of the drawing that a label may cover in some place."""
    centres = np.array([centre for centre, _ in candidates])
    inside = (ink >= centres.min(axis=0) - half) & (ink <= centres.max(axis=0) + half)
    return np.asarray(ink[inside.all(axis=1)])


def _cost(label: Label, half: Array, centre: Array, radius: float, boxes: Sequence[Array], ink: Array) -> float:
    way = centre - label.anchor
    cosine = float(way @ label.towards) / float(np.linalg.norm(way) * np.linalg.norm(label.towards) + 1e-12)
    cost = 0.1 * radius + TURNED * (1.0 - (abs(cosine) if label.either else cosine))
    cost += COVERED * int(np.sum(np.all(np.abs(ink - centre) <= half, axis=1)))
    if boxes:
        low, high = np.split(np.array(boxes), 2, axis=1)
        sides = np.minimum(centre + half, high) - np.maximum(centre - half, low)
        for width, height in sides[(sides > 0.0).all(axis=1)]:
            cost += OVERLAP + float(width * height)
    return cost


def vertical_shift(y: float, beside: Array, height: float) -> float:
    """Return by how much a label goes up to the nearest free place; negative: down, 0 where there is none near.

    Args:
        y: where it would best be.
        beside: where labels are that it may cover, since they overlap with it horizontally, shape (count,).
        height: of a label.
    """
    if not beside.size:
        return 0.0
    shifts = 0.5 * height * np.array(sorted(range(-MAX_STEPS, MAX_STEPS + 1), key=lambda k: (abs(k), -k)))
    free = (np.abs(y + shifts[:, None] - beside) >= height).all(axis=1)
    return float(shifts[np.argmax(free)]) if free.any() else 0.0
