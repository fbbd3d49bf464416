"""Labels that do not cover each other in the picture."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from dh2sim.draw.labels import vertical_shift
from dh2sim.draw.projection import Pinhole
from dh2sim.view.scene.items import Label

HEIGHT: Final = 18.0
"""Pixels, of a label with a margin: viser's letters are 12 pixels high."""
_LETTER_WIDTH: Final = 7.0
_MARGIN: Final = 6.0


def spread_labels(labels: Mapping[str, Label], pinhole: Pinhole, first: Iterable[str] = ()) -> dict[str, Label]:
    """Move labels up or down in the picture until none covers another.

    A label keeps its place if that is free; otherwise it goes to the nearest free one; if none is near, it stays.

    Args:
        labels: By name.
        pinhole: The camera, in the frame that the labels' positions are given in.
        first: Names of the labels that are placed before the others, in this order.

    Returns:
        The same labels by the same names.
    """
    names = list(dict.fromkeys([*(name for name in first if name in labels), *labels]))
    if not names:
        return {}
    seen = pinhole.project([labels[name].position for name in names])
    places = np.full((len(names), 2), np.nan)
    widths = np.array([width(labels[name].text) for name in names])
    moved = dict(labels)
    for i, name in enumerate(names):
        x, y, depth = (float(value) for value in seen[i])
        if not depth > 0.0:
            continue
        beside = places[:i][np.abs(places[:i, 0] - x) < 0.5 * (widths[:i] + widths[i]), 1]
        shift = vertical_shift(y, beside, HEIGHT)
        places[i] = x, y + shift
        if shift != 0.0:
            moved[name] = replace(labels[name], position=pinhole.raised(labels[name].position, shift, depth))
    return moved


def width(text: str) -> float:
    """Return the approximate width of a label, pixels."""
    return _LETTER_WIDTH * len(text) + _MARGIN
