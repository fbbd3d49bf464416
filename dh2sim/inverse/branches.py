"""Names of branches: where the shoulder, the elbow and the wrist of a configuration are, from its own geometry."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.inverse.textbook_axes import arm_axes
from dh2sim.inverse.textbook_forms import TextbookForm, textbook_form
from dh2sim.kinematics.chain import ChainLike, chain_of, joint_vectors
from dh2sim.typing import Array

ABOUT: Final = 0.02
"""Angles, rad, and lengths as a share of the arm's size, by which an arm may miss the class that names it."""


def branch_names(robot: ChainLike, q: ArrayLike) -> tuple[str, ...]:
    """Return the name of each configuration's branch, such as ``left, above, no flip``.

    Args:
        robot: The robot, in any form.
        q: Joint vectors, rad and m, shape (k, n).

    Returns:
        k names; '' where the arm is of no class that has them, or its shoulder, elbow and wrist are all singular.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    chain = chain_of(robot)
    vectors, _ = joint_vectors(chain, q)
    form = textbook_form(arm_axes(chain, ABOUT))
    if isinstance(form, str):
        return ("",) * len(vectors)
    return tuple(branch_name(form, np.asarray(vector)) for vector in vectors)


def branch_name(form: TextbookForm, q: Array) -> str:
    """Return the name of one configuration's branch, q of shape (n,), rad and m."""
    return ", ".join(form.names(q))
