"""When a simulation has become unstable: positions or speeds that no time step can follow."""

from __future__ import annotations

import mujoco
import numpy as np


class SpeedLimit:
    """Looks at the state after every time step."""

    def __init__(self, model: mujoco.MjModel, *, size: float) -> None:
        """Choose the limits.

        A joint that turns by more than 1 rad within a time step, or slides by more than the size of the robot, is not
        simulated any more: forces change faster than the steps see.

        Args:
            model: the compiled robot; its base stands still.
            size: of the robot, m.
        """
        turns = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        step = float(model.opt.timestep)
        self._names = [model.joint(i).name for i in range(model.njnt)]
        self._units = ["rad/s" if turn else "m/s" for turn in turns]
        self._most = np.where(turns, 1.0, max(size, 1.0)) / step

    def reason(self, data: mujoco.MjData) -> str:
        """Return what is wrong with a state, a sentence; empty if nothing is."""
        good = np.isfinite(data.qpos) & (np.abs(data.qvel) <= self._most)  # what is not finite is not less
        if good.all():
            return ""
        worst = int(np.argmin(good))
        speed, unit = abs(float(data.qvel[worst])), self._units[worst]
        moves = f"moves at {speed:.3g} {unit}" if np.isfinite(speed) else "moves at no finite speed"
        if speed <= self._most[worst]:
            moves = "has no finite position"
        return (
            f"The simulation became unstable at {float(data.time):.3f} s: {self._names[worst]} {moves}; "
            f"up to {self._most[worst]:.3g} {unit} can be simulated."
        )
