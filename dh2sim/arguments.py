"""Checks of the kinds of arguments: an error names the argument, before anything fails on the inside."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable, Mapping
from numbers import Real
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from dh2sim.errors import ArgumentError
from dh2sim.typing import Array

Instance = TypeVar("Instance")


def whole_number(name: str, value: object, *, least: int = 0) -> int:
    """Return a whole number that is at least so much.

    Raises:
        ArgumentError: It is something else.
    """
    try:
        number = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        number = least - 1
    if number < least:
        raise ArgumentError(f"{name} must be a whole number of at least {least}, got {_short(value)}")
    return number


def whole_numbers(name: str, value: object, *, count: int | None = None) -> list[int]:
    """Return whole numbers, of any sign; ``count`` of them if that is given.

    Raises:
        ArgumentError: It is something else.
    """
    try:
        found = [operator.index(each) for each in value]  # type: ignore[attr-defined]
    except TypeError:
        found = None
    if found is None or count not in (None, len(found)):
        what = "whole numbers" if count is None else f"{count} whole numbers"
        raise ArgumentError(f"{name} must be {what}, got {_short(value)}")
    return found


def number(name: str, value: object) -> float:
    """Return a real number.

    Raises:
        ArgumentError: It is something else.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ArgumentError(f"{name} must be a number, got {_short(value)}")
    return float(value)


def below_one(name: str, value: object) -> float:
    """Return a real number above 0 and below 1, as tolerances are.

    Raises:
        ArgumentError: It is something else.
    """
    if not 0.0 < (given := number(name, value)) < 1.0:
        raise ArgumentError(f"{name} must be above 0 and below 1, got {_short(value)}")
    return given


def flag(name: str, value: object) -> bool:
    """Return whether something is wanted.

    Raises:
        ArgumentError: It is neither True nor False.
    """
    if not isinstance(value, bool | np.bool_):
        raise ArgumentError(f"{name} must be True or False, got {_short(value)}")
    return bool(value)


def real_array(name: str, value: object) -> Array:
    """Return real numbers as an array of doubles, of the shape that they have.

    Raises:
        ArgumentError: They are not real numbers.
    """
    try:
        given = np.asarray(value)
        if given.dtype.kind in "fiu":
            return given.astype(np.float64)
    except ValueError:  # lists of different lengths
        pass
    raise ArgumentError(f"{name} must be real numbers, got {_short(value)}")


def mapping(name: str, value: object) -> Mapping[Any, Any]:
    """Return values by name.

    Raises:
        ArgumentError: It is not a mapping.
    """
    if not isinstance(value, Mapping):
        raise ArgumentError(f"{name} must be a mapping of names to values, got {_short(value)}")
    return value


def names(name: str, value: object) -> list[str]:
    """Return names, of which one may be given alone.

    Raises:
        ArgumentError: It is neither text nor a collection of texts.
    """
    if isinstance(value, str):
        return [value]
    given: list[Any] = list(value) if isinstance(value, Iterable) else [value]
    if not all(isinstance(each, str) for each in given):
        raise ArgumentError(f"{name} must be a name or several, got {_short(value)}")
    return given


def text(name: str, value: object) -> str:
    """Return a text.

    Raises:
        ArgumentError: It is something else.
    """
    if not isinstance(value, str):
        raise ArgumentError(f"{name} must be a string, got {_short(value)}")
    return value


def file_path(name: str, value: object) -> Path:
    """Return the path of a file or folder.

    Raises:
        ArgumentError: It is neither a string nor a path.
    """
    if not isinstance(value, str | os.PathLike):
        raise ArgumentError(f"{name} must be a path, got {_short(value)}")
    return Path(value)


def file_paths(name: str, value: object) -> list[Path]:
    """Return paths of files or folders, of which one may be given alone.

    Raises:
        ArgumentError: It is neither a path nor a collection of paths.
    """
    if isinstance(value, str | os.PathLike):
        return [Path(value)]
    given: list[Any] = list(value) if isinstance(value, Iterable) else [value]
    if not all(isinstance(each, str | os.PathLike) for each in given):
        raise ArgumentError(f"{name} must be a path or several, got {_short(value)}")
    return [Path(each) for each in given]


def instance(name: str, value: object, kind: type[Instance]) -> Instance:
    """Return an object of a class.

    Raises:
        ArgumentError: It is something else.
    """
    if not isinstance(value, kind):
        raise ArgumentError(f"{name} must be of type {kind.__name__}, got {_short(value)}")
    return value


def _short(value: object) -> str:
    """Return how a message shows a value: large ones by their kind."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} of shape {value.shape}"
    found = repr(value)
    return found if len(found) <= 60 and "\n" not in found else f"a value of type {type(value).__name__}"
