"""What a pose and a Jacobian say, in numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dh2sim.kinematics.forward import frame_pose, geometric_jacobian
from dh2sim.kinematics.transforms import pose_errors, quaternion_from_rotation, rpy_from_rotation
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.state import ViewState

_KEPT = 8
"""Several parts of a page tell of the same state."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Readings:
    """What is told of a frame, and of tool0's Jacobian."""

    T_base_frame: Array
    """Pose of the frame in base_link, shape (4, 4)."""
    xyz: tuple[float, ...]
    """m."""
    rpy: tuple[float, ...]
    """rad."""
    quaternion: tuple[float, ...]
    """(w, x, y, z)."""
    manipulability: float
    """sqrt(det(J Jᵀ)); sqrt(det(Jᵀ J)) of fewer than six joints, where the former is zero.

    T. Yoshikawa, Manipulability of robotic mechanisms, Int. J. Robotics Research 4(2), 1985.
    """
    smallest_singular_value: float
    """Of J, in m and rad: how far J is from a matrix of lower rank, in the spectral norm; zero at a singularity.

    G. H. Golub and C. F. Van Loan, Matrix Computations, 4th edition, section 2.4.
    """


def readings_of(state: ViewState) -> Readings:
    """Return what is told of a state."""
    return _readings(state.model, state.frame, state.q)


@lru_cache(maxsize=_KEPT)
def _readings(model: RobotModel, frame: str, q: tuple[float, ...]) -> Readings:
    chain = model.chain
    T = np.asarray(frame_pose(chain, frame, q))
    values = singular_values(geometric_jacobian(chain, q))
    return Readings(
        T_base_frame=T,
        xyz=tuple(T[:3, 3].tolist()),
        rpy=tuple(rpy_from_rotation(T).tolist()),
        quaternion=tuple(quaternion_from_rotation(T).tolist()),
        manipulability=math.prod(values) if values else 0.0,
        smallest_singular_value=min(values, default=0.0),
    )


def singular_values(jacobian: Array) -> list[float]:
    """Return the singular values of a Jacobian, shape (6, n): as many as the smaller of 6 and n."""
    return [float(value) for value in np.linalg.svd(jacobian, compute_uv=False)] if jacobian.size else []


def difference(T_a: Array, T_b: Array) -> tuple[float, float]:
    """Return how far two poses, shape (4, 4), are apart, m and rad."""
    position, rotation = pose_errors(T_a, T_b)
    return float(position), float(rotation)
