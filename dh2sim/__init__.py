"""From a Denavit-Hartenberg table to a simulated robot that provably matches it.

Names are imported when they are first used, so that ``import dh2sim`` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dh2sim.errors import Dh2simError, RobotFileError
    from dh2sim.formats.mjcf import to_mjcf
    from dh2sim.formats.scene import to_scene
    from dh2sim.formats.urdf import to_urdf
    from dh2sim.kinematics.chain import KinematicChain, build_chain
    from dh2sim.kinematics.forward import forward_kinematics, frame_poses
    from dh2sim.kinematics.jacobian import geometric_jacobian
    from dh2sim.model.build import build_model
    from dh2sim.model.robot_model import RobotModel
    from dh2sim.robot.load import load_robot, parse_robot
    from dh2sim.robot.spec import RobotSpec

__all__ = [
    "Dh2simError",
    "KinematicChain",
    "RobotFileError",
    "RobotModel",
    "RobotSpec",
    "build_chain",
    "build_model",
    "forward_kinematics",
    "frame_poses",
    "geometric_jacobian",
    "load_robot",
    "parse_robot",
    "to_mjcf",
    "to_scene",
    "to_urdf",
]

_HOMES = {
    "Dh2simError": "errors",
    "KinematicChain": "kinematics.chain",
    "RobotFileError": "errors",
    "RobotModel": "model.robot_model",
    "RobotSpec": "robot.spec",
    "build_chain": "kinematics.chain",
    "build_model": "model.build",
    "forward_kinematics": "kinematics.forward",
    "frame_poses": "kinematics.forward",
    "geometric_jacobian": "kinematics.jacobian",
    "load_robot": "robot.load",
    "parse_robot": "robot.load",
    "to_mjcf": "formats.mjcf",
    "to_scene": "formats.scene",
    "to_urdf": "formats.urdf",
}


def __getattr__(name: str) -> object:
    """Import a public name from where it is defined."""
    if name not in _HOMES:
        raise AttributeError(f"module 'dh2sim' has no attribute '{name}'")
    return getattr(import_module(f"dh2sim.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
