"""Solutions that are not isolated: at some singularities joints move against each other while the tool stands still.

A regular solution is isolated. A singular one may be, too, as that of a stretched arm, where two solutions meet. Or
it belongs to a family, as where two axes of a wrist are in line. A step along its null vector tells which: from there
one comes back to the pose nearby, or only where the step began.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from dh2sim.inverse.elimination import CONVERGED, NEARLY_SINGULAR, Found
from dh2sim.inverse.loop import Arm, Flags
from dh2sim.inverse.polish import polish
from dh2sim.inverse.self_motion import SELF_MOTION, Path, follow, lies_on, null_directions
from dh2sim.typing import Array

SINGULAR: Final = 1e-7
"""Least singular value, in the arm's units, below which a solution may belong to a family."""
STEP: Final = 0.02
"""Along a null vector, in rad and lengths of the arm."""
MOVES: Final = 1e-6
"""Joints that move by less along a family stand still."""
MOST: Final = 16
"""Families that are followed of one pose: where they have two parameters, there are endless ones."""


def split_families(arm: Arm, T: Array, moving: Flags, found: Found) -> tuple[Found, dict[int, list[Path]]]:
    """Separate isolated solutions from families, and follow these.

    Args:
        arm: The arm.
        T: Poses, positions in units of the arm's length, shape (N, 4, 4).
        moving: Which joints are not locked, bool, shape (n,).
        found: The solutions of the poses.

    Returns:
        The isolated ones, and the families' curves by the index of their pose.
    """
    isolated = np.ones(len(found.q), dtype=np.bool_)
    families = {}
    for pose in dict.fromkeys(found.pose[found.sigma <= NEARLY_SINGULAR].tolist()):
        own = np.flatnonzero(found.pose == pose)
        alone, paths = _split(arm, T[pose], moving, found.of(own))
        isolated[own] = alone
        if paths:
            families[pose] = paths
    return found.of(isolated), families


def _split(arm: Arm, T: Array, moving: Flags, found: Found) -> tuple[Flags, list[Path]]:
    """Return which solutions of one pose, shape (4, 4), are isolated, and the curves of the others."""
    turns = np.array(arm.turns)
    isolated = np.ones(len(found.q), dtype=np.bool_)
    paths: list[Path] = []
    flat = False
    for i in np.argsort(found.sigma, kind="stable"):
        if found.sigma[i] > NEARLY_SINGULAR:
            break
        several = int((np.linalg.svd(found.J[i][:, moving], compute_uv=False) < SINGULAR).sum()) > 1
        if (several and flat) or any(lies_on(path.q, found.q[i], turns, closed=path.closed) for path in paths):
            isolated[i] = False
        elif found.sigma[i] <= SINGULAR and len(paths) < MOST and _goes_on(arm, found.q[i], T, moving):
            isolated[i] = False
            paths.append(follow(arm, found.q[i], T, moving))
            flat |= several
    return isolated, paths


def _goes_on(arm: Arm, q: Array, T: Array, moving: Flags) -> bool:
    """Return whether there are other configurations near a singular one that reach its pose."""
    there = q + STEP * null_directions(arm, q, moving)
    back, error, _ = polish(arm, there, np.broadcast_to(T, (len(there), 4, 4)), moving)
    return bool(((error < CONVERGED) & (np.linalg.norm(back - q, axis=1) > 0.5 * STEP)).any())


def family_kind(path: Path, joints: int, turns: Sequence[bool]) -> str:
    """Return what textbooks call the singularity at which a family of six joints, or of a wrist's three, is found.

    Args:
        path: The family.
        joints: How many joints the robot has.
        turns: Whether each joint turns: slides that make up for each other have no name of their own.
    """
    moves = moving_joints(path, joints)
    if joints not in (3, 6) or not moves:
        return SELF_MOTION
    if joints == 6 and 0 in moves:
        return "shoulder singularity" if turns[0] else SELF_MOTION
    wrist = joints - 1 in moves and joints - 2 not in moves and turns[joints - 1]
    return "wrist singularity" if wrist else SELF_MOTION


def moving_joints(path: Path, joints: int) -> Sequence[int]:
    """Return the indices of the robot's joints that move along a family."""
    return [int(joint) for joint in np.flatnonzero(np.ptp(path.q[:, :joints], axis=0) > MOVES)]
