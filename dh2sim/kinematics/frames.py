"""Frames by the names that every export uses."""

from __future__ import annotations

import difflib

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import UnknownFrameError
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import forward_kinematics, frame_poses, joint_poses
from dh2sim.kinematics.transforms import identity
from dh2sim.typing import Array


def frame_names(chain: KinematicChain) -> tuple[str, ...]:
    """Return the names: base_link, link_1 … link_n, dh_0 … dh_n, tool0."""
    n = len(chain.joints)
    links = (f"link_{i}" for i in range(1, n + 1))
    return ("base_link", *links, *(f"dh_{i}" for i in range(n + 1)), "tool0")


def frame_pose(chain: KinematicChain, frame: str, q: ArrayLike) -> Array:
    """Return the pose of a named frame in base_link.

    Args:
        chain: The robot.
        frame: One of ``frame_names``; link_i stands at joint i, dh_i is the table's frame i.
        q: Joint vector, rad and m, shape (n,).

    Returns:
        Shape (4, 4).

    Raises:
        UnknownFrameError: There is no such frame.
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    names = frame_names(chain)
    if frame not in names:
        close = difflib.get_close_matches(frame, names, n=1)
        hint = f" Did you mean '{close[0]}'?" if close else ""
        n = len(chain.joints)
        raise UnknownFrameError(
            f"there is no frame '{frame}'.{hint} Frames: base_link, link_1 to link_{n}, dh_0 to dh_{n}, tool0"
        )
    tool = forward_kinematics(chain, q)
    if frame == "tool0":
        return tool
    if frame == "base_link":
        return identity()
    kind, index = frame.split("_")
    poses, number = (frame_poses(chain, q), int(index)) if kind == "dh" else (joint_poses(chain, q), int(index) - 1)
    return np.asarray(poses[number])
