"""What a controller returned, made sure of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dh2sim.errors import ControllerError
from dh2sim.typing import Array


def checked(returned: object, shapes: Sequence[tuple[int, ...]], axes: str, *, controller: str, what: str) -> Array:
    """Return what a controller returned as an array of double precision.

    Args:
        returned: by a controller, who may be a user's.
        shapes: which it may have.
        axes: what they count, for the message.
        controller: its name.
        what: it should be, as in 'controls'.

    Raises:
        ControllerError: it is no array of real numbers, or has another shape.
    """
    begun = f"controller '{controller}' returned"
    if returned is None:
        raise ControllerError(f"{begun} nothing for {what}")
    try:
        found = np.asarray(returned)
        if found.dtype.kind not in "biufO":
            raise TypeError(f"they are of type {found.dtype}")
        array: Array = found.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        raise ControllerError(f"{begun} {what} that are no array of numbers: {error}") from error
    if array.shape not in shapes:
        allowed = " or ".join(str(shape) for shape in dict.fromkeys(shapes))
        raise ControllerError(f"{begun} {what} of shape {array.shape}; expected is {allowed}: {axes}")
    return array
