"""The robot as it is simulated: a compiled model, with what controllers and recorders need to know of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import mujoco
import numpy as np

from dh2sim.errors import EngineError
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import unloaded_gains
from dh2sim.mujoco_warnings import mujoco_warnings
from dh2sim.typing import Array, read_only

FREE_TURN: Final = math.pi
"""rad: half the range of a joint that turns without limits."""
FREE_SLIDE: Final = 1.0
"""m: half the range of a joint that slides without limits."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plant:
    """A compiled model with its limits, joints and actuators in the order of the table.

    Where the rollouts of a batch have designs of their own, all arrays have shape (batch, n) or (batch, actuators).
    """

    model: mujoco.MjModel = field(repr=False)
    timestep: float
    """s."""
    floating: bool
    """Whether base_link floats; then its seven positions and six velocities come before those of the joints."""
    joints: tuple[str, ...]
    """Names of the n moving joints."""
    turns: tuple[bool, ...]
    """Which of them turn (rad), the others slide (m)."""
    actuators: tuple[str, ...]
    driven: tuple[int, ...]
    """For each actuator the number of the joint that it drives, from 0."""
    lower: Array
    """Least joint positions, rad or m, shape (n,); -inf where unlimited."""
    upper: Array
    """Greatest joint positions; inf where unlimited."""
    velocity: Array
    """Velocity limits, rad/s or m/s, shape (n,)."""
    kp: Array
    """Stiffness for controllers with motors, N·m/rad or N/m, shape (n,)."""
    kv: Array
    """Damping for controllers with motors, N·m·s/rad or N·s/m, shape (n,)."""
    home: Array
    """Home configuration, shape (n,)."""
    control_lower: Array
    """Least controls, shape (actuators,); -inf where unlimited."""
    control_upper: Array
    """Greatest controls; inf where unlimited."""
    each: tuple[Plant, ...] = field(default=(), repr=False)
    """The plant of each rollout of a batch whose rollouts have designs of their own; ``model`` is that of the first,
    and they all have its bodies, joints and actuators."""

    @property
    def models(self) -> tuple[mujoco.MjModel, ...]:
        """The model of each rollout where they have designs of their own, or the one of all of them."""
        return tuple(plant.model for plant in self.each) or (self.model,)

    @property
    def n(self) -> int:
        """Number of moving joints."""
        return len(self.joints)

    @property
    def free_half_ranges(self) -> Array:
        """Half of the range that each joint is given where it has no limits, rad or m, shape (n,)."""
        return np.where(np.array(self.turns, dtype=bool), FREE_TURN, FREE_SLIDE)


_OWN: Final = ("lower", "upper", "velocity", "kp", "kv", "home", "control_lower", "control_upper")
"""What each design has."""


def batch_plant(plants: Sequence[Plant]) -> Plant:
    """Return the plant of a batch whose rollouts have these plants."""
    own: dict[str, Any] = {name: read_only(np.stack([getattr(plant, name) for plant in plants])) for name in _OWN}
    return replace(plants[0], **own, each=tuple(plants))


def compile_plant(mjcf: str, robot: RobotModel) -> Plant:
    """Compile the text that ``to_mjcf`` wrote of a robot.

    Raises:
        EngineError: MuJoCo refuses it.
    """
    try:
        with mujoco_warnings():  # a rollout says itself what becomes of it
            compiled = mujoco.MjModel.from_xml_string(mjcf)
    except ValueError as error:
        raise EngineError(
            f"MuJoCo refuses the robot as it would be simulated: {' '.join(str(error).split())}"
        ) from error
    return make_plant(compiled, robot)


def make_plant(compiled: mujoco.MjModel, robot: RobotModel) -> Plant:
    """Describe a robot that was compiled from what ``to_mjcf`` wrote.

    Args:
        compiled: The compiled model.
        robot: The robot, which has what an MJCF cannot hold: velocity limits, home, and gains where it has motors.
    """
    floating = compiled.njnt > 0 and compiled.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    first = 1 if floating else 0
    ids = range(first, compiled.njnt)
    limited = np.array([bool(compiled.jnt_limited[i]) for i in ids], dtype=bool)
    ranges = compiled.jnt_range[first:].reshape(-1, 2)
    controlled = compiled.actuator_ctrllimited.astype(bool)
    controls = compiled.actuator_ctrlrange.reshape(-1, 2)
    gains = unloaded_gains(robot)
    return Plant(
        model=compiled,
        timestep=float(compiled.opt.timestep),
        floating=bool(floating),
        joints=tuple(compiled.joint(i).name for i in ids),
        turns=tuple(compiled.jnt_type[i] == mujoco.mjtJoint.mjJNT_HINGE for i in ids),
        actuators=tuple(compiled.actuator(i).name for i in range(compiled.nu)),
        driven=tuple(int(compiled.actuator_trnid[i, 0]) - first for i in range(compiled.nu)),
        lower=read_only(np.where(limited, ranges[:, 0], -np.inf)),
        upper=read_only(np.where(limited, ranges[:, 1], np.inf)),
        velocity=read_only([joint.velocity for joint in robot.moving_joints]),
        kp=read_only([kp for kp, _ in gains]),
        kv=read_only([kv for _, kv in gains]),
        home=robot.home,
        control_lower=read_only(np.where(controlled, controls[:, 0], -np.inf)),
        control_upper=read_only(np.where(controlled, controls[:, 1], np.inf)),
    )
