"""A number of a robot file: a finite number, or an arithmetic expression in a string."""

from __future__ import annotations

import math
from collections.abc import Mapping

from dh2sim.robot.expressions import ExpressionError, evaluate
from dh2sim.robot.words import shown


class NumberError(ValueError):
    """A value is no finite number; the text is fit for a user."""


def to_number(value: object, names: Mapping[str, float]) -> float:
    """Return the number that a value of a robot file stands for.

    Args:
        value: What the file holds.
        names: Values of the parameters.

    Returns:
        A finite number; NaN where the expression uses a parameter that is wrong itself.

    Raises:
        NumberError: With what was found and what is allowed.
    """
    match value:
        case str():
            try:
                return evaluate(value, names)
            except ExpressionError as error:
                raise NumberError(str(error)) from None
        case int() | float() if not isinstance(value, bool):
            try:
                number = float(value)
            except OverflowError:
                number = math.inf
            if math.isfinite(number):
                return number
            raise NumberError(f"expected a finite number, found {shown(value)}")
        case _:
            raise NumberError(f"expected a number or an expression in a string, found {shown(value)}")
