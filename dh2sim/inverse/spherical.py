"""Three turns about given directions that make a given rotation: a wrist, and an arm with three slides."""

from __future__ import annotations

import numpy as np

from dh2sim.inverse.loop import Indices, joint_motion
from dh2sim.typing import Array

_BEYOND = 1.05
"""Cosines up to here are taken for 1: rounding has moved a double root."""


def spherical_angles(A: Array, B: Array, R: Array) -> tuple[Indices, Array]:
    """Solve Rz(x) A Rz(y) B Rz(z) = R.

    The cosine of the angle between the first and the last axis is linear in cos y and sin y: two solutions. Source:
    D. L. Pieper, The kinematics of manipulators under computer control, 1968, for the Euler angles of a wrist.

    Args:
        A: Rotation from the first axis to the second, shape (M, 3, 3).
        B: Rotation from the second axis to the third, shape (M, 3, 3).
        R: What they are to make, shape (M, 3, 3).

    Returns:
        Index of the problem that each solution belongs to, shape (S,), and x, y, z, rad, shape (S, 3). Where the
        first and the last axis are parallel only x ± z counts, and x is 0.
    """
    a, b = A[:, 2], B[:, :, 2]
    cosine = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]
    sine = a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1]
    with np.errstate(all="ignore"):
        ratio = (R[:, 2, 2] - a[:, 2] * b[:, 2]) / np.hypot(cosine, sine)
    (problem,) = np.nonzero(np.abs(ratio) <= _BEYOND)
    middle = np.arctan2(sine[problem], cosine[problem])
    spread = np.arccos(np.clip(ratio[problem], -1.0, 1.0))
    problem, y = np.concatenate([problem, problem]), np.concatenate([middle + spread, middle - spread])
    inner = A[problem] @ joint_motion(True, y)[:, :3, :3] @ B[problem]
    last, goal = inner[:, :, 2], R[problem][:, :, 2]
    x = np.arctan2(goal[:, 1], goal[:, 0]) - np.arctan2(last[:, 1], last[:, 0])
    x = np.where(np.hypot(last[:, 0], last[:, 1]) > 1e-9, x, 0.0)
    left = np.swapaxes(joint_motion(True, x)[:, :3, :3] @ inner, 1, 2) @ R[problem]
    z = np.arctan2(left[:, 1, 0] - left[:, 0, 1], left[:, 0, 0] + left[:, 1, 1])
    return problem, np.stack([x, y, z], axis=1)
