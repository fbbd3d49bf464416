"""Where labels go, so that they cover neither each other nor what is drawn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dh2sim.imports.picture.paper import text_size
from dh2sim.typing import Array

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
