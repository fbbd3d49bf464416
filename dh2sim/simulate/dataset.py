"""A run in memory."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from dh2sim.simulate.block import Block
from dh2sim.simulate.layout import Layout


def to_dataset(layout: Layout, arrays: Block) -> xr.Dataset:
    """Put the variables of a whole run together; the same dataset as one that was written and opened."""
    coordinates: dict[str, Any] = {
        item.name: (item.dimension, np.asarray(item.values), dict(item.attributes)) for item in layout.coordinates
    }
    variables = {
        variable.name: (variable.dimensions, arrays[variable.name], dict(variable.attributes))
        for variable in layout.variables
    }
    return xr.Dataset(variables, coordinates, dict(layout.attributes))
