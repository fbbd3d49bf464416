"""The library itself as an engine."""

from __future__ import annotations

import numpy as np

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import forward_kinematics, frame_poses
from dh2sim.kinematics.jacobian import geometric_jacobian
from dh2sim.typing import Array


class LibraryEngine:
    """dh2sim's own kinematics, by way of the chain that the writers use."""

    name = "dh2sim"

    def __init__(self, chain: KinematicChain) -> None:
        """Take a chain."""
        self._chain = chain
        self.frames = (*(f"dh_{i}" for i in range(len(chain.joints) + 1)), "tool0")

    def frame_poses(self, q: Array) -> Array:
        """Poses of all frames in base_link, shape (N, number of frames, 4, 4); q of shape (N, n)."""
        return np.concatenate([frame_poses(self._chain, q), forward_kinematics(self._chain, q)[:, None]], axis=1)

    def jacobian(self, q: Array) -> Array:
        """Geometric Jacobian of tool0 in base_link, shape (N, 6, n); q of shape (N, n)."""
        return geometric_jacobian(self._chain, q)
