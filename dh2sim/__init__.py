"""From a Denavit-Hartenberg table to a simulated robot that provably matches it.

Names are imported when they are first used, so that ``import dh2sim`` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dh2sim.errors import Dh2simError, RobotFileError
    from dh2sim.formats.mjcf.scene import to_scene
    from dh2sim.formats.mjcf.write import to_mjcf
    from dh2sim.formats.urdf.write import to_urdf
    from dh2sim.importing.convert import convert_robot
    from dh2sim.importing.importing import ImportOptions, import_robot
    from dh2sim.kinematics.chain import KinematicChain, build_chain
    from dh2sim.kinematics.forward import forward_kinematics, frame_poses, geometric_jacobian
    from dh2sim.kinematics.frame_assignment.recover import recover_table
    from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint
    from dh2sim.model.build import build_model
    from dh2sim.model.robot_model import RobotModel
    from dh2sim.robot.read import load_robot, parse_robot
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.robot.write import robot_file_text

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
    "ImportOptions": "importing.importing",
    "KinematicChain": "kinematics.chain",
    "RobotFileError": "errors",
    "RobotModel": "model.robot_model",
    "RobotSpec": "robot.spec",
    "SerialChain": "kinematics.serial_chain",
    "SerialJoint": "kinematics.serial_chain",
    "build_chain": "kinematics.chain",
    "build_model": "model.build",
    "convert_robot": "importing.convert",
    "forward_kinematics": "kinematics.forward",
    "frame_poses": "kinematics.forward",
    "geometric_jacobian": "kinematics.forward",
    "import_robot": "importing.importing",
    "load_robot": "robot.read",
    "parse_robot": "robot.read",
    "recover_table": "kinematics.frame_assignment.recover",
    "robot_file_text": "robot.write",
    "to_mjcf": "formats.mjcf.write",
    "to_scene": "formats.mjcf.scene",
    "to_urdf": "formats.urdf.write",
}


def __getattr__(name: str) -> object:
    """Import a public name from where it is defined."""
    if name not in _HOMES:
        raise AttributeError(f"module 'dh2sim' has no attribute '{name}'")
    return getattr(import_module(f"dh2sim.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
