"""Names for array types; imports nothing of the package."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""An array of doubles; the docstring of whatever carries it gives its shape."""
ComplexArray: TypeAlias = NDArray[np.complex128]
"""An array of complex doubles."""


Point: TypeAlias = tuple[float, float, float]
"""x, y, z: for sums in plain arithmetic, where an array a point would be slow."""


def read_only(values: object) -> Array:
    """Return a copy of ``values`` as doubles that nobody can write to."""
    array = np.array(values, np.float64)
    array.setflags(write=False)
    return array
