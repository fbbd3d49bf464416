"""The same robot in MuJoCo, for the pose that a page shows beside the table's."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dh2sim.errors import Dh2simError
from dh2sim.export import Format, render
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.robot_files import write_files

if TYPE_CHECKING:
    from dh2sim.engines.mujoco_engine import MujocoEngine


@dataclass(slots=True, eq=False)
class Twin:
    """Reads the MJCF of whatever robot it is asked for, once for each robot; not for two threads at a time."""

    _model: RobotModel | None = None
    _engine: MujocoEngine | None = None
    problem: str = field(default="", init=False)
    """Why there is no pose; empty where there is one."""

    def pose(self, model: RobotModel, frame: str, q: tuple[float, ...]) -> Array | None:
        """Return where MuJoCo has a frame, in base_link, shape (4, 4); None where MuJoCo cannot tell.

        Args:
            model: The robot.
            frame: ``dh_0`` … ``dh_n`` or ``tool0``; MuJoCo's file has sites for these alone.
            q: Joint coordinates, rad and m.
        """
        if model is not self._model:
            self._model, self._engine, self.problem = model, None, ""
            try:
                self._engine = _compiled(model)
            except Dh2simError as error:
                self.problem = str(error)
        if self._engine is None or frame not in self._engine.frames:
            return None
        try:
            poses = self._engine.frame_poses(np.array([q], dtype=np.float64).reshape(1, -1))
        except Dh2simError as error:
            self.problem = str(error)
            return None
        return np.asarray(poses[0, self._engine.frames.index(frame)])


def _compiled(model: RobotModel) -> MujocoEngine:
    from dh2sim.engines.mujoco_engine import MujocoEngine

    with tempfile.TemporaryDirectory() as folder:
        write_files(render(model, [Format.MJCF]), Path(folder))
        names = [joint.name for joint in model.moving_joints]
        return MujocoEngine(Path(folder) / f"{model.name}.xml", names, len(model.joints))
