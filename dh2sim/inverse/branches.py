"""Names of branches: where the shoulder, the elbow and the wrist of a configuration are, from its own geometry."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.inverse.textbook_axes import arm_axes
from dh2sim.inverse.textbook_forms import TextbookForm, textbook_form
from dh2sim.kinematics.chain import ChainLike, KinematicChain, chain_of, joint_vectors
from dh2sim.typing import Array

ABOUT: Final = 0.02
"""Angles, rad, and lengths as a share of the arm's size, by which an arm may miss the class that names it."""


def branch_names(robot: ChainLike, q: ArrayLike) -> tuple[str, ...]:
    """Return the name of each configuration's branch, such as ``left, above, no flip``.

    Args:
        robot: The robot, in any form.
        q: Joint vectors, rad and m, shape (k, n).

    Returns:
        k names; '' where the arm is of no class that has them. What is singular is named: ``left, elbow straight``.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    chain = chain_of(robot)
    vectors, _ = joint_vectors(chain, q)
    form = _form(chain)
    if isinstance(form, str) or not len(vectors):
        return ("",) * len(vectors)
    # rounded, so that those that differ by whole turns have the same name
    turns = np.array([joint.type.turns for joint in chain.moving_joints])
    places = np.where(turns, np.mod(vectors, 2.0 * np.pi), vectors)
    return names_of_form(form, np.asarray(np.round(places, 12), dtype=np.float64))


@lru_cache(maxsize=32)
def _form(chain: KinematicChain) -> TextbookForm | str:
    return textbook_form(arm_axes(chain, ABOUT))


def names_of_form(form: TextbookForm, q: Array) -> tuple[str, ...]:
    """Return the name of each configuration's branch, q of shape (k, n), rad and m."""
    return tuple(", ".join(parts) for parts in form.names(q))
