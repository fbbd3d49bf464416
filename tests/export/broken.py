"""Models whose writers and table disagree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dh2sim.kinematics.chain import KinematicChain, build_chain
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import read_only

SHIFT = 1e-6
"""m; how far joint 2 is put from where it belongs."""


def shifted_chain(spec: RobotSpec) -> KinematicChain:
    """The robot's chain with joint 2 a little beside its place: what a defect in ``build_chain`` would make."""
    chain = build_chain(spec)
    T = np.array(chain.joints[1].T_parent_joint)
    T[0, 3] += SHIFT
    wrong = replace(chain.joints[1], T_parent_joint=read_only(T))
    return replace(chain, joints=(chain.joints[0], wrong, *chain.joints[2:]))
