"""Robots compiled by MuJoCo from memory, with their meshes."""

from __future__ import annotations

import mujoco

from dh2sim.errors import EngineError
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.mechanism import written_model
from dh2sim.mujoco_warnings import mujoco_warnings, warning_sentences
from dh2sim.robot.spec import SpecLike


def compile_robot(robot: SpecLike, *, scene: str | None = None) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """Compile a robot.

    Args:
        robot: The robot, in any form.
        scene: MJCF that includes ``<name>.xml``, the robot; by default the robot alone.

    Returns:
        The compiled model, and what MuJoCo warns of, in sentences.

    Raises:
        EngineError: MuJoCo refuses it.
    """
    model = written_model(robot)
    mjcf = to_mjcf(model)
    files = {link.mesh.file_name: link.mesh.data for link in model.all_links if link.mesh is not None}
    with mujoco_warnings() as warned:
        try:
            compiled = mujoco.MjModel.from_xml_string(scene or mjcf, {f"{model.name}.xml": mjcf.encode(), **files})
        except ValueError as error:
            raise EngineError(f"{model.name}: MuJoCo refuses the model: {' '.join(str(error).split())}") from error
    return compiled, warning_sentences(warned, [joint.name for joint in model.moving_joints])
