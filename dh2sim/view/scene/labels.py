"""Labels that do not cover each other in the picture, wherever the eye stands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from dh2sim.typing import Array
from dh2sim.view.scene.items import Label
from dh2sim.view.scene.pinhole import Sight

HEIGHT: Final = 18.0
"""Pixels, of a label with a little room around it: viser's letters are 12 pixels high."""
_WIDTH_OF_LETTER: Final = 7.0
_MARGIN: Final = 6.0
_STEP: Final = 0.5 * HEIGHT
_FARTHEST: Final = 12
"""Steps that a label goes up or down at most, to keep near what it names."""


def spread(labels: Mapping[str, Label], sight: Sight, first: Iterable[str] = ()) -> dict[str, Label]:
    """Move labels up or down in the picture, so that none covers another.

    Each keeps its place if that is free, or goes to the nearest one that is; where there is none near, it stays.

    Args:
        labels: By name.
        sight: How they are seen, in the frame that their positions are in.
        first: Names of those that choose their places before the others, in this order.

    Returns:
        The same labels, by the same names.
    """
    names = list(dict.fromkeys([*(name for name in first if name in labels), *labels]))
    if not names:
        return {}
    seen = sight.in_picture([labels[name].position for name in names])
    places = np.full((len(names), 2), np.nan)
    widths = np.array([width(labels[name].text) for name in names])
    moved = dict(labels)
    for i, name in enumerate(names):
        x, y, depth = (float(value) for value in seen[i])
        if not depth > 0.0:
            continue
        shift = _shift(x, y, places[:i], 0.5 * (widths[:i] + widths[i]))
        places[i] = x, y + shift
        if shift != 0.0:
            moved[name] = replace(labels[name], position=sight.raised(labels[name].position, shift, depth))
    return moved


def width(text: str) -> float:
    """Return about how wide a label is, pixels."""
    return _WIDTH_OF_LETTER * len(text) + _MARGIN


def _shift(x: float, y: float, taken: Array, apart: Array) -> float:
    """Return by how many pixels a label must go up; ``taken`` are places of others, shape (count, 2)."""
    beside = taken[np.abs(taken[:, 0] - x) < apart, 1]
    if not beside.size:
        return 0.0
    shifts = _STEP * np.array(sorted(range(-_FARTHEST, _FARTHEST + 1), key=lambda k: (abs(k), -k)))
    free = (np.abs(y + shifts[:, None] - beside) >= HEIGHT).all(axis=1)
    return float(shifts[np.argmax(free)]) if free.any() else 0.0
