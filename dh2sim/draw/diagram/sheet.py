"""A line drawing as plain values, and its text as SVG or TikZ.

Lengths are points, x to the right and y upwards. Numbers are written with two decimals, so that the same drawing is
the same text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.typing import Array

MARGIN = 8.0
"""Around everything that is drawn, pt."""
_SUB = 0.7
"""Size of a subscript, as a share of that of its letter."""
_WIDE = 0.62
"""Width of a character, as a share of the size: a little more than fonts have."""
_GREEK = {"θ": r"\theta", "α": r"\alpha", "…": r"\ldots "}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stroke:
    """A line through points, an area, or both."""

    points: Array
    """pt, shape (count, 2)."""
    color: str | None = "#000000"
    """Of the line; None for an area without one."""
    width: float = 1.0
    fill: str | None = None
    dash: tuple[float, ...] = ()
    arrow: bool = False
    """Whether it ends in an arrow head."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Text:
    """A text around its middle."""

    centre: Array
    """pt, shape (2,)."""
    text: str
    """A word, or a letter with a subscript, such as ``z_0`` or ``x_3,4``."""
    size: float
    color: str = "#000000"


@dataclass(slots=True)
class Sheet:
    """What is drawn, from the back to the front."""

    strokes: list[Stroke] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)

    def line(self, points: ArrayLike, color: str, width: float, *, dash: tuple[float, ...] = ()) -> None:
        """Draw a line through points."""
        self.strokes.append(Stroke(points=np.asarray(points, float), color=color, width=width, dash=dash))

    def area(self, points: ArrayLike, fill: str, color: str | None = None, width: float = 1.0) -> None:
        """Fill an area, with or without an outline."""
        self.strokes.append(Stroke(points=np.asarray(points, float), color=color, width=width, fill=fill))

    def arrow(self, start: ArrayLike, end: ArrayLike, color: str, width: float) -> None:
        """Draw an arrow, if it is long enough to have a head."""
        points = np.array([start, end], float)
        if np.linalg.norm(points[1] - points[0]) > 1.0:
            self.strokes.append(Stroke(points=points, color=color, width=width, arrow=True))

    def write(self, centre: ArrayLike, text: str, size: float, color: str) -> None:
        """Write a text around a point."""
        self.texts.append(Text(centre=np.asarray(centre, float), text=text, size=size, color=color))

    @property
    def ink(self) -> Array:
        """Points of all lines, 5 pt apart, shape (count, 2)."""
        parts = [_along(a, b) for stroke in self.strokes for a, b in _pairs(stroke)]
        return np.concatenate([np.zeros((0, 2)), *parts])

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Left, bottom, right and top of everything with a margin, pt."""
        corners = [stroke.points for stroke in self.strokes]
        for text in self.texts:
            half = 0.5 * np.array(text_box(text.text, text.size))
            corners.append(np.array([text.centre - half, text.centre + half]))
        points = np.concatenate([np.zeros((0, 2)), *corners])
        low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def text_box(text: str, size: float) -> tuple[float, float]:
    """Return the width and height of a text, pt, rather too much than too little."""
    letter, index = subscripted(text)
    width = _WIDE * (len(letter) + _SUB * len(index)) + 0.25 * letter.count("\N{MINUS SIGN}")
    return size * width, size * (1.15 if index else 0.9)


def head_of(stroke: Stroke) -> Array:
    """Return the corners of an arrow's head, shape (3, 2); its line ends at the middle of the head."""
    start, end = stroke.points[-2:]
    along = (end - start) / np.linalg.norm(end - start)
    length = min(6.0 + 1.5 * stroke.width, 0.7 * float(np.linalg.norm(end - start)))
    aside = 0.36 * length * np.array([-along[1], along[0]])
    return np.array([end, end - length * along + aside, end - length * along - aside])


def shaft_of(stroke: Stroke) -> Array:
    """Return the points of an arrow's line, which ends inside its head."""
    end, left, right = head_of(stroke)
    return np.vstack([stroke.points[:-1], 0.25 * end + 0.375 * (left + right)])


def to_svg(sheet: Sheet) -> str:
    """Return a drawing as SVG, with letters as text in a serif font."""
    left, bottom, right, top = sheet.bounds
    width, height = right - left, top - bottom

    def path(points: Array, closed: bool = False) -> str:
        pairs = [f"{_number(x - left)} {_number(top - y)}" for x, y in points.tolist()]
        return f"M{'L'.join(pairs)}{'Z' if closed else ''}"

    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_number(width)}pt" height="{_number(height)}pt" '
        f'viewBox="0 0 {_number(width)} {_number(height)}" font-family="Latin Modern Math, STIX Two Text, '
        'Times New Roman, serif" stroke-linecap="round" stroke-linejoin="round">',
        f'<rect width="{_number(width)}" height="{_number(height)}" fill="#ffffff"/>',
    ]
    for stroke in sheet.strokes:
        line = "none" if stroke.color is None else f'{stroke.color}" stroke-width="{_number(stroke.width)}'
        dash = f' stroke-dasharray="{" ".join(map(_number, stroke.dash))}"' if stroke.dash else ""
        points = shaft_of(stroke) if stroke.arrow else stroke.points
        closed = stroke.fill is not None
        lines.append(f'<path d="{path(points, closed)}" fill="{stroke.fill or "none"}" stroke="{line}"{dash}/>')
        if stroke.arrow:
            lines.append(f'<path d="{path(head_of(stroke), True)}" fill="{stroke.color}" stroke="none"/>')
    for text in sheet.texts:
        x, y = _number(text.centre[0] - left), _number(top - text.centre[1] + 0.32 * text.size)
        lines.append(
            f'<text x="{x}" y="{y}" font-size="{_number(text.size)}" fill="{text.color}" text-anchor="middle">'
            f"{_svg_text(text)}</text>"
        )
    return "\n".join([*lines, "</svg>", ""])


def _svg_text(text: Text) -> str:
    letter, index = subscripted(text.text)
    if not index:
        return escape(letter)
    small, down = _number(_SUB * text.size), _number(0.25 * text.size)
    below = f'<tspan font-size="{small}" dy="{down}">{escape(index)}</tspan>'
    return f'<tspan font-style="italic">{escape(letter)}</tspan>{below}'


def to_tikz(sheet: Sheet) -> str:
    """Return a drawing as a TikZ picture, to be included in a document that uses the package ``tikz``."""
    left, bottom, _, _ = sheet.bounds
    colors = sorted(
        {color for stroke in sheet.strokes for color in (stroke.color, stroke.fill) if color}
        | {text.color for text in sheet.texts}
    )
    lines = [r"\begin{tikzpicture}[x=1bp, y=1bp, line cap=round, line join=round]"]
    lines += [rf"  \definecolor{{{_color(color)}}}{{HTML}}{{{color[1:].upper()}}}" for color in colors]

    def path(points: Array) -> str:
        return " -- ".join(f"({_number(x - left)},{_number(y - bottom)})" for x, y in points.tolist())

    for stroke in sheet.strokes:
        options = (
            [] if stroke.color is None else [f"draw={_color(stroke.color)}", f"line width={_number(stroke.width)}bp"]
        )
        if stroke.fill is not None:
            options.append(f"fill={_color(stroke.fill)}")
        if stroke.dash:
            on = " ".join(f"{'off' if k % 2 else 'on'} {_number(length)}bp" for k, length in enumerate(stroke.dash))
            options.append(f"dash pattern={on}")
        points = shaft_of(stroke) if stroke.arrow else stroke.points
        lines.append(rf"  \path[{', '.join(options)}] {path(points)}{' -- cycle' if stroke.fill else ''};")
        if stroke.arrow:
            lines.append(rf"  \path[fill={_color(stroke.color or '#000000')}] {path(head_of(stroke))} -- cycle;")
    for text in sheet.texts:
        x, y = _number(text.centre[0] - left), _number(text.centre[1] - bottom)
        size = f"font=\\fontsize{{{_number(text.size)}}}{{{_number(1.2 * text.size)}}}\\selectfont"
        lines.append(
            rf"  \node[inner sep=0pt, text={_color(text.color)}, {size}] at ({x},{y}) {{{tex_text(text.text)}}};"
        )
    return "\n".join([*lines, r"\end{tikzpicture}", ""])


def subscripted(text: str) -> tuple[str, str]:
    """Return a letter and its subscript; any other text has none."""
    found = re.fullmatch(r"(\w)_(.+)", text)
    return (text, "") if found is None else (found[1], found[2])


def tex_text(text: str) -> str:
    """Return a text for TeX."""
    letter, index = subscripted(text)
    if not index:
        plain = re.sub(r"([#$%&_{}])", r"\\\1", letter)
        return plain.replace("\N{MINUS SIGN}", "$-$").replace("^", r"\^{}").replace("~", r"\~{}")
    for plain, tex in _GREEK.items():
        letter, index = letter.replace(plain, tex), index.replace(plain, tex)
    index = index.replace("_", r"\_")
    return f"${letter}_{{{index}}}$"


def _pairs(stroke: Stroke) -> Iterator[tuple[Array, Array]]:
    points = stroke.points if stroke.fill is None else np.vstack([stroke.points, stroke.points[:1]])
    return pairwise(points)


def _along(start: Array, end: Array) -> Array:
    count = max(2, 1 + round(float(np.linalg.norm(end - start)) / 5.0))
    return np.linspace(start, end, count)


def _color(color: str) -> str:
    return f"dh{color[1:]}"


def _number(value: float) -> str:
    return f"{round(float(value), 2) + 0.0:.2f}".rstrip("0").rstrip(".")
