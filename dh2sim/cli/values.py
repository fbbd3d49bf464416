"""Values of arguments and options, converted without pydantic.

typer converts them with pydantic, whose import takes longer than most commands run. What is plainly right is
converted here; everything else is left to typer, which has the words for what is wrong with it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from types import UnionType
from typing import Any, Final, TypeAlias, get_args, get_origin, get_type_hints

Convert: TypeAlias = Callable[[Any], Any]

_INTEGER: Final = re.compile(r"-?[0-9]{1,18}")
_NUMBER: Final = re.compile(r"-?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


class _NotPlainError(Exception):
    """A value is wrong, or unusual."""


class PlainValues:
    """Mixed into a command of typer, lets its parameters convert plain values by themselves."""

    callback: Any

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, options that typer adds among them."""
        parameters: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        new = [parameter for parameter in parameters if "process_value" not in vars(parameter)]
        hints = get_type_hints(self.callback, include_extras=True) if new else {}
        for parameter in new:
            annotation, settings, *_ = get_args(hints.get(parameter.name)) or (None, None)
            parameter.process_value = _processing(parameter, _conversion(annotation, settings))
        return parameters


def _processing(parameter: Any, convert: Convert) -> Callable[[Any, Any], Any]:
    typers = parameter.process_value
    nothing = () if parameter.multiple or parameter.nargs == -1 else None

    def process_value(ctx: Any, value: Any) -> Any:
        try:
            if value is not None and value != ():
                plain = convert(value)
            elif parameter.required:
                raise _NotPlainError
            else:
                plain = nothing
        except _NotPlainError:
            return typers(ctx, value)
        return plain if parameter.callback is None else parameter.callback(ctx, parameter, plain)

    return process_value


def _conversion(annotation: Any, settings: Any) -> Convert:
    """Return how values of a kind are converted."""
    if get_origin(annotation) is UnionType:  # with None, which is not a value
        annotation = get_args(annotation)[0]
    collection = get_origin(annotation)
    if collection in (list, tuple):
        each = _conversion(get_args(annotation)[0], settings)
        return lambda values: collection(map(each, values))
    if annotation in (int, float):
        return _number(annotation, settings)
    return {str: _text, Path: _path}.get(annotation, _left_to_typer)


def _left_to_typer(value: Any) -> Any:  # noqa: ARG001
    raise _NotPlainError


def _text(value: Any) -> Any:
    if not isinstance(value, str):
        raise _NotPlainError
    return value


def _path(value: Any) -> Any:
    """Return a path that does not exist, or that may be read."""
    if not isinstance(value, str | Path) or (os.path.exists(value) and not os.access(value, os.R_OK)):
        raise _NotPlainError
    return Path(value)


def _number(kind: type[int | float], settings: Any) -> Convert:
    """Return how a number between the limits of an option is read."""
    form = _INTEGER if kind is int else _NUMBER

    def convert(value: Any) -> Any:
        if isinstance(value, str) and form.fullmatch(value):
            value = kind(value)
        if type(value) is not kind:
            raise _NotPlainError
        if (settings.min is not None and value < settings.min) or (settings.max is not None and value > settings.max):
            raise _NotPlainError
        return value

    return convert
