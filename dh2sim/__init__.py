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
    from dh2sim.imports.converted import convert_robot
    from dh2sim.imports.files import ImportOptions, import_robot
    from dh2sim.kinematics.assignment.recover import recover_table
    from dh2sim.kinematics.chain import KinematicChain, build_chain
    from dh2sim.kinematics.forward import forward_kinematics, frame_poses
    from dh2sim.kinematics.jacobian import geometric_jacobian
    from dh2sim.kinematics.serial import SerialChain, SerialJoint
    from dh2sim.model.build import build_model
    from dh2sim.model.robot_model import RobotModel
    from dh2sim.robot.load import load_robot, parse_robot
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.robot.writing.robot_file import robot_file_text

__all__ = [
    "Dh2simError",
    "ImportOptions",
    "KinematicChain",
    "RobotFileError",
    "RobotModel",
    "RobotSpec",
    "SerialChain",
    "SerialJoint",
    "build_chain",
    "build_model",
    "convert_robot",
    "forward_kinematics",
    "frame_poses",
    "geometric_jacobian",
    "import_robot",
    "load_robot",
    "parse_robot",
    "recover_table",
    "robot_file_text",
    "to_mjcf",
    "to_scene",
    "to_urdf",
]

_HOMES = {
    "Dh2simError": "errors",
    "ImportOptions": "imports.files",
    "KinematicChain": "kinematics.chain",
    "RobotFileError": "errors",
    "RobotModel": "model.robot_model",
    "RobotSpec": "robot.spec",
    "SerialChain": "kinematics.serial",
    "SerialJoint": "kinematics.serial",
    "build_chain": "kinematics.chain",
    "build_model": "model.build",
    "convert_robot": "imports.converted",
    "forward_kinematics": "kinematics.forward",
    "frame_poses": "kinematics.forward",
    "geometric_jacobian": "kinematics.jacobian",
    "import_robot": "imports.files",
    "load_robot": "robot.load",
    "parse_robot": "robot.load",
    "recover_table": "kinematics.assignment.recover",
    "robot_file_text": "robot.writing.robot_file",
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
