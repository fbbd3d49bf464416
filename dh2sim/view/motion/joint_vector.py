"""A joint vector as a page gives it: one, of the right length, finite."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.chain import KinematicChain, joint_vectors
from dh2sim.typing import Array


def joint_vector(chain: KinematicChain, q: ArrayLike) -> Array:
    """Return one joint vector, rad and m, shape (n,).

    Raises:
        ConfigurationError: it is none.
    """
    vectors, batch = joint_vectors(chain, q)
    if batch:
        raise ConfigurationError(f"expected one joint vector of shape ({chain.n},), got shape {np.shape(q)}")
    return np.asarray(vectors[0])
