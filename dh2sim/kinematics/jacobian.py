"""The geometric Jacobian of a chain, for any number of configurations at once."""

from __future__ import annotations

from numpy.typing import ArrayLike

from dh2sim.kinematics.block import BlockFrame, Column, cross, difference, write_column
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import in_blocks, joint_frames
from dh2sim.kinematics.transforms import compose
from dh2sim.typing import Array

_NOTHING: Column = (0.0, 0.0, 0.0)


def geometric_jacobian(chain: KinematicChain, q: ArrayLike) -> Array:
    """Return the Jacobian of tool0 in base_link: [velocity; angular velocity] = J · dq/dt.

    For a joint that turns about the unit axis z through p the column is [z x (p_tool0 - p); z], for one that
    slides along z it is [z; 0]. Source: M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot Modeling and
    Control, 2006, section 4.6.

    Args:
        chain: The robot.
        q: Joint vectors, rad and m, shape (..., n).

    Returns:
        Shape (..., 6, n): rows 0-2 velocity of tool0's origin, m/s; rows 3-5 angular velocity, rad/s; both
        along the axes of base_link, for each rad/s or m/s of a joint coordinate.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    T_joint_tool0 = compose(chain.joints[-1].T_joint_dh, chain.T_dhn_tool0)

    def fill(out: Array, columns: Array) -> None:
        frames = list(joint_frames(chain, columns))
        tool = frames[-1].then(T_joint_tool0)
        moving = [pair for pair in zip(chain.joints, frames, strict=True) if pair[0].type.moves]
        for i, (joint, frame) in enumerate(moving):
            _write(out[:, :, i], frame, tool, turns=joint.type.turns, sign=joint.sign * frame.signs[2])

    return in_blocks(chain, q, (6, chain.n), fill)


def _write(out: Array, frame: BlockFrame, tool: BlockFrame, *, turns: bool, sign: float) -> None:
    """Put one joint's column, shape (N, 6), into ``out``."""
    linear, angular = (cross(frame.z, difference(tool.p, frame.p)), frame.z) if turns else (frame.z, _NOTHING)
    write_column(linear, sign, out[:, :3])
    write_column(angular, sign, out[:, 3:])
