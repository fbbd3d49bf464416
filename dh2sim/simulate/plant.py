"""The robot as it is simulated: what controllers and records need to know of a compiled model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plant:
    """A compiled model with its limits, joints and actuators in the order of the table."""

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

    @property
    def n(self) -> int:
        """Number of moving joints."""
        return len(self.joints)


def make_plant(
    model: mujoco.MjModel,
    *,
    velocity: Sequence[float],
    kp: Sequence[float],
    kv: Sequence[float],
    home: Sequence[float],
) -> Plant:
    """Describe a compiled model that ``to_mjcf`` wrote.

    Args:
        model: the compiled model.
        velocity: velocity limits of the moving joints, rad/s or m/s.
        kp: their stiffness for controllers with motors, N·m/rad or N/m.
        kv: their damping for controllers with motors, N·m·s/rad or N·s/m.
        home: home configuration, rad or m.
    """
    floating = model.njnt > 0 and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    first = 1 if floating else 0
    ids = range(first, model.njnt)
    limited = np.array([bool(model.jnt_limited[i]) for i in ids], dtype=bool)
    ranges = model.jnt_range[first:].reshape(-1, 2)
    controlled = model.actuator_ctrllimited.astype(bool)
    controls = model.actuator_ctrlrange.reshape(-1, 2)
    return Plant(
        model=model,
        timestep=float(model.opt.timestep),
        floating=bool(floating),
        joints=tuple(model.joint(i).name for i in ids),
        turns=tuple(model.jnt_type[i] == mujoco.mjtJoint.mjJNT_HINGE for i in ids),
        actuators=tuple(model.actuator(i).name for i in range(model.nu)),
        driven=tuple(int(model.actuator_trnid[i, 0]) - first for i in range(model.nu)),
        lower=read_only(np.where(limited, ranges[:, 0], -np.inf)),
        upper=read_only(np.where(limited, ranges[:, 1], np.inf)),
        velocity=read_only(velocity),
        kp=read_only(kp),
        kv=read_only(kv),
        home=read_only(home),
        control_lower=read_only(np.where(controlled, controls[:, 0], -np.inf)),
        control_upper=read_only(np.where(controlled, controls[:, 1], np.inf)),
    )
