"""Joint vectors as they come in: checked, and as one array of shape (count, n)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.typing import Array


def joint_vectors(chain: KinematicChain, q: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """Check joint vectors and flatten their batch shape.

    Args:
        chain: The robot.
        q: Joint coordinates, rad and m, shape (..., n).

    Returns:
        The joint vectors, shape (count, n), and the batch shape ``...``, whose product is count.

    Raises:
        ConfigurationError: ``q`` is no array of real numbers, its last axis does not have length n, or a
            coordinate is not finite.
    """
    array = _numbers(q)
    n = chain.n
    if array.ndim == 0 or array.shape[-1] != n:
        names = ", ".join(joint.name for joint in chain.moving_joints)
        expected = f"{n} joint coordinate{'' if n == 1 else 's'}" + (f" ({names})" if names else "")
        raise ConfigurationError(f"expected {expected} along the last axis, got shape {array.shape}")
    if not _all_finite(array):
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        where = f" of the joint vector at index {place[:-1]}" if place[:-1] else ""
        name = chain.moving_joints[place[-1]].name
        raise ConfigurationError(f"coordinate of {name}{where} is {array[place]}: it must be finite")
    batch = array.shape[:-1]
    return array.reshape(math.prod(batch), n), batch


def _numbers(q: ArrayLike) -> Array:
    """Return ``q`` as doubles; complex numbers, text and lists of unequal length are refused."""
    try:
        array = np.asarray(q)
    except (TypeError, ValueError):
        raise ConfigurationError("joint vectors must have equal lengths") from None
    if array.dtype.kind not in "biuf":
        raise ConfigurationError(f"joint coordinates must be real numbers, got an array of {array.dtype}")
    return array.astype(np.float64, copy=False)


def _all_finite(array: Array) -> bool:
    """Whether every element is finite; the sum is quicker to look at than each element."""
    with np.errstate(over="ignore", invalid="ignore"):
        total = array.sum()
    return bool(np.isfinite(total)) or bool(np.isfinite(array).all())
