"""An assignment of frames, told step by step as a textbook tells it."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from dh2sim.imports.explain.ends import axes_words, base_words, slide_words, tip_words
from dh2sim.imports.explain.links import link_words, numbers
from dh2sim.imports.explain.words import GLUE
from dh2sim.imports.imported import Imported
from dh2sim.imports.placed import PlacedFrames, placed_frames
from dh2sim.imports.serial import residual_text
from dh2sim.robot.spec import Convention

WIDTH = 98
"""Columns of a line at most, so that it fits a robot file as a comment."""
_INDENT = 10


def explanation(imported: Imported) -> tuple[str, ...]:
    """Tell how the frames of a robot were assigned.

    The rules are those of ``kinematics.assignment``, the words those of M. W. Spong, S. Hutchinson, M. Vidyasagar,
    Robot Modeling and Control, 2006, section 3.2 (standard), and of J. J. Craig, Introduction to Robotics, 3rd ed.,
    2005, section 3.4 (modified).

    Args:
        imported: A robot made of a chain.

    Returns:
        Lines of plain text, at most 98 columns each: degrees and metres, with six significant digits.

    Raises:
        ValueError: The robot was made of a table, to which no frames were assigned.
    """
    placed = placed_frames(imported)
    lines = _wrapped(_opening(placed))
    for label, text in _paragraphs(imported, placed):
        lines += _wrapped(text, label, _INDENT)
    return tuple(lines)


def _paragraphs(imported: Imported, placed: PlacedFrames) -> Iterator[tuple[str, str]]:
    n = placed.n
    yield "z axes", axes_words(placed)
    yield from (("sliding", sentence) for sentence in slide_words(placed))
    yield "frame 0", base_words(placed)
    for joint in range(1, n):
        yield f"frame {joint}", link_words(placed, joint)
        yield "", numbers(placed, joint)
    yield f"frame {n}", tip_words(placed)
    yield "", numbers(placed, n)
    if imported.residual is not None:
        residual = imported.residual
        yield (
            "residual",
            f"At {residual.configurations} random configurations all joint axes and tool0 differ from the source's "
            f"by at most {residual_text(residual)}.",
        )


def _opening(placed: PlacedFrames) -> str:
    return (
        f"{_convention(placed)} Points and directions are in base_link at joint coordinates zero, in m and degrees "
        "to six digits. x(i) can point two ways; unless something else is said, the one with the smaller theta is "
        "taken."
    )


def _convention(placed: PlacedFrames) -> str:
    name = placed.spec.name
    standard = "z(i-1) is the axis of joint i, x(i) lies along the common normal from z(i-1) to z(i)"
    if placed.spec.convention is Convention.STANDARD:
        return f"Frames of {name}, standard convention: {standard}."
    modified = (
        "z(i) is the axis of joint i, x(i) lies along the common normal from z(i) to z(i+1); "
        "a(i) and alpha(i) stand in row i+1"
    )
    p = placed.distal
    if p == 0:
        return f"Frames of {name}, modified convention: {modified}."
    rows = "Row 1 ends" if p == 1 else f"Rows 1 to {p} end"
    return (
        f"Frames of {name}. {rows} with the link part, as Hayati's row {p} has to: {standard}. "
        f"The rows behind are modified ones: {modified}."
    )


def _wrapped(text: str, label: str = "", indent: int = 0) -> list[str]:
    lines = textwrap.wrap(
        text,
        WIDTH,
        initial_indent=f"{label:<{indent}}",
        subsequent_indent=" " * indent,
        break_on_hyphens=False,
        break_long_words=False,
    )
    return [line.replace(GLUE, " ") for line in lines]
