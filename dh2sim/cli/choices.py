"""Options that take one of a few words."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TypeVar

import typer

Word = TypeVar("Word", bound=StrEnum)


def choice(text: str | None, words: type[Word], option: str, *, without: tuple[Word, ...] = ()) -> Word | None:
    """Return the word of an enumeration that an option was given, None where it was not given.

    Raises:
        BadParameter: it is none of them.
    """
    if text is None:
        return None
    allowed = [word for word in words if word not in without]
    found = next((word for word in allowed if word.value == text.lower()), None)
    if found is None:
        from dh2sim.robot.words import did_you_mean, shown

        names = [word.value for word in allowed]
        hint = did_you_mean(text, names)
        raise typer.BadParameter(f"{shown(text)} is none of {', '.join(names)}.{hint}".rstrip("."), param_hint=option)
    return found


def tolerance_of(value: float) -> float:
    """Return a tolerance.

    Raises:
        BadParameter: it is not above 0 and below 1.
    """
    if not (math.isfinite(value) and 0.0 < value < 1.0):
        raise typer.BadParameter(f"{value} is not between 0 and 1", param_hint="--tolerance")
    return value
