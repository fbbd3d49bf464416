"""What a video shows: a compiled model and the positions that it goes through."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from dh2sim.errors import PictureError, RunError
from dh2sim.simulate.recorded_model import recorded_model
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    from dh2sim.draw.rollout_data import RolloutData
    from dh2sim.model.mechanism import MechanismModel
    from dh2sim.model.robot_model import RobotModel

MOST_POSES = 600
"""Largest number of poses in which the extent of a motion is measured, and of points of the tool's path."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """A model in its scene and a sequence of its positions."""

    model: Any = field(repr=False)
    """``mujoco.MjModel``."""
    qpos: Array = field(repr=False)
    """Positions, MuJoCo's ``qpos``, shape (count, nq)."""
    time: Array = field(repr=False)
    """s, shape (count,), ascending."""

    @property
    def floats(self) -> bool:
        """Whether base_link floats: the first seven positions are its pose."""
        free = mujoco.mjtJoint.mjJNT_FREE.value
        return bool(self.model.njnt > 0 and self.model.jnt_type[0] == free)

    @property
    def travel(self) -> Array:
        """Displacement of base_link from its first position, m, shape (count, 3)."""
        return self.qpos[:, :3] - self.qpos[0, :3] if self.floats else np.zeros((len(self.qpos), 3))

    def place(self, data: Any, number: int) -> None:
        """Put the robot, its cameras and lights where they are in a position."""
        data.qpos[:] = self.qpos[number]
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        mujoco.mj_camlight(self.model, data)

    def nearest(self, time: float) -> int:
        """Return the index of the position nearest in time, s."""
        after = int(np.searchsorted(self.time, time))
        if after == 0:
            return 0
        if after == len(self.time) or time - self.time[after - 1] <= self.time[after] - time:
            return after - 1
        return after

    def number_at(self, time: float | None) -> int:
        """Return the index of the position at a time, s; None: the last.

        Raises:
            PictureError: the motion does not include that time.
        """
        if time is None:
            return len(self.time) - 1
        first, last = float(self.time[0]), float(self.time[-1])
        if not first <= time <= last * (1.0 + 1e-9):
            raise PictureError(f"the motion lasts from {first:g} to {last:g} s, got {time:g} s")
        return self.nearest(time)

    def sampled(self) -> list[int]:
        """Return indices of at most ``MOST_POSES`` positions, evenly spread from the first to the last."""
        last = len(self.time) - 1
        return sorted({round(k) for k in np.linspace(0, last, min(last + 1, MOST_POSES))})


def motion_of_run(rollout: RolloutData) -> Motion:
    """Return the motion of one rollout, up to where it stopped.

    Raises:
        PictureError: positions were not recorded, or the model in the run's attributes cannot be read.
    """
    rollout.require("qpos", what="a video")
    try:
        model = recorded_model(rollout.attributes, scene=True, design=rollout.design)
    except RunError as error:
        raise PictureError(f"{rollout.run}: {error}") from error
    return Motion(model=model, qpos=read_only(_recorded(rollout, model)), time=read_only(rollout.values("time")))


def _recorded(rollout: RolloutData, model: Any) -> Array:
    """Return MuJoCo's positions, shape (count, nq); bodies that stand for closures stay where the model has them.

    Raises:
        PictureError: The recorded joints are not those of the model.
    """
    base = [rollout.values("base_pose")] if "base_pose" in rollout.data else []
    recorded = rollout.values("qpos")
    if "closure" not in rollout.data.coords:
        qpos = np.concatenate([*base, recorded], axis=1)
        if qpos.shape[1] != model.nq:
            raise PictureError(
                f"{rollout.run}: {qpos.shape[1]} positions were recorded, but the model in the run's attributes has "
                f"{model.nq}"
            )
        return qpos
    qpos = np.tile(model.qpos0, (len(recorded), 1))
    for name, values in zip(rollout.data["joint"].values.tolist(), recorded.T, strict=True):
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, str(name))
        if joint < 0:
            raise PictureError(f"{rollout.run}: joint {name} is not in the model in the run's attributes")
        qpos[:, model.jnt_qposadr[joint]] = values
    return qpos


def motion_of_robot(robot: RobotModel | MechanismModel, configuration: str = "home") -> Motion:
    """Return a robot or a mechanism at rest in one of its configurations.

    Raises:
        ConfigurationError: It has no configuration of that name.
        EngineError: MuJoCo refuses the model.
        AssemblyError: The mechanism's loops cannot be closed at that one.
    """
    from dh2sim.engines.mujoco_model import compile_robot
    from dh2sim.formats.mjcf.scene import to_scene
    from dh2sim.kinematics.loop_motion import named_configuration
    from dh2sim.model.mechanism import MechanismModel

    is_mechanism = isinstance(robot, MechanismModel)
    q = named_configuration(robot.spec, configuration) if is_mechanism else robot.spec.configuration(configuration)
    model, _ = compile_robot(robot, scene=to_scene(robot))
    if is_mechanism:  # closures have coordinates of their own
        q = np.array(model.key(configuration).qpos)
    return Motion(model=model, qpos=read_only(np.asarray(q)[None, :]), time=read_only([0.0]))
