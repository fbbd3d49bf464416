"""RobotModel -> the files of its export, as bytes."""

from __future__ import annotations

from collections.abc import Collection
from enum import StrEnum

from dh2sim.errors import ModelError
from dh2sim.formats.mjcf import to_mjcf
from dh2sim.formats.scene import to_scene
from dh2sim.formats.urdf import to_urdf
from dh2sim.model.robot_model import RobotModel


class Format(StrEnum):
    """What a robot can be exported as."""

    URDF = "urdf"
    MJCF = "mjcf"


def render(model: RobotModel, formats: Collection[Format], *, dh_frames: bool = True) -> dict[str, bytes]:
    """Return the files of an export.

    Args:
        model: the robot.
        formats: what to write.
        dh_frames: whether the URDF has a link for every DH frame.

    Returns:
        Contents by path relative to the robot's folder, with forward slashes.

    Raises:
        ModelError: a format cannot hold the robot, or its name is that of another file.
    """
    files: dict[str, bytes] = {}
    if Format.URDF in formats:
        files[f"{model.name}.urdf"] = to_urdf(model, dh_frames=dh_frames).encode()
    if Format.MJCF in formats:
        if model.name.lower() == "scene":
            raise ModelError(
                f"{model.name}: its MJCF and the scene around it would both be scene.xml; rename the robot"
            )
        files[f"{model.name}.xml"] = to_mjcf(model).encode()
        files["scene.xml"] = to_scene(model).encode()
    for link in model.all_links:
        if link.mesh is not None:
            files[f"meshes/{link.mesh.file_name}"] = link.mesh.data
    return files
