"""What the signs of the picture mean."""

from __future__ import annotations

import numpy as np

from dh2sim.imports.picture.paper import (
    A_COLOR,
    D_COLOR,
    INK,
    QUIET,
    X_COLOR,
    Y_COLOR,
    Z_COLOR,
    Paper,
    text_size,
)

_SIZE = 8.0
_MARK = 22.0
"""Width of a sign, pt."""
_GAP = 14.0


def draw_legend(paper: Paper, middle: float, y: float) -> None:
    """Draw one line of signs around a middle, at a height, pt."""
    entries = (
        ("axis of a joint", QUIET, 0.9, (0, (9, 3, 2, 3))),
        ("a, along x", A_COLOR, 1.5, "-"),
        ("d, along z", D_COLOR, 1.5, "-"),
    )
    arrows = (("x", X_COLOR), ("y", Y_COLOR), ("z", Z_COLOR))
    names = [text for text, *_ in entries] + [text for text, _ in arrows]
    total = sum(_MARK + 4.0 + text_size(name, _SIZE)[0] for name in names) + _GAP * (len(names) - 1)
    x = middle - 0.5 * total
    for text, color, lw, style in entries:
        paper.line(np.array([[x, y], [x + _MARK, y]]), color, lw, layer=3, ls=style)
        x = _write(paper, x, y, text)
    for text, color in arrows:
        paper.arrow(np.array([x, y]), np.array([x + _MARK, y]), color, 1.6, layer=3)
        x = _write(paper, x, y, text)


def _write(paper: Paper, x: float, y: float, text: str) -> float:
    paper.text(np.array([x + _MARK + 4.0, y]), text, INK, _SIZE)
    return x + _MARK + 4.0 + text_size(text, _SIZE)[0] + _GAP
