"""When actuators were at the end of what they can do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import PictureError
from dh2sim.simulate.pictures.backend import import_mujoco
from dh2sim.simulate.pictures.selection import RolloutData

NEAR = 1e-9
"""Share of a range within which a value is at its end."""


def saturated(rollout: RolloutData) -> NDArray[np.bool_]:
    """Return in which intervals the control or the force of a joint's actuator is at an end of its range.

    Args:
        rollout: the data; controls and torques as far as they were recorded.

    Returns:
        Shape (interval, joint); all False where nothing was recorded or nothing is limited.

    Raises:
        PictureError: the model in the run's attributes cannot be read.
    """
    mujoco = import_mujoco()
    joints = rollout.names("joint")
    found = np.zeros((int(rollout.data.sizes["interval"]), len(joints)), dtype=bool)
    if "ctrl" not in rollout.data and "torque" not in rollout.data:
        return found
    try:
        model = mujoco.MjModel.from_xml_string(str(rollout.attributes.get("mjcf", "")))
    except ValueError as error:
        told = " ".join(str(error).split())
        raise PictureError(f"{rollout.run}: MuJoCo refuses the model in the run's attributes: {told}") from error
    for number in range(model.nu):
        actuator, joint = model.actuator(number).name, model.joint(int(model.actuator_trnid[number, 0])).name
        if joint not in joints:
            continue
        column = joints.index(joint)
        if "ctrl" in rollout.data and actuator in rollout.names("actuator") and model.actuator_ctrllimited[number]:
            control = rollout.values("ctrl")[:, rollout.names("actuator").index(actuator)]
            found[:, column] |= _at_end(control, model.actuator_ctrlrange[number])
        if "torque" in rollout.data and model.actuator_forcelimited[number]:
            found[:, column] |= _at_end(rollout.values("torque")[:, column], model.actuator_forcerange[number])
    return found


def _at_end(values: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.bool_]:
    low, high = float(ends[0]), float(ends[1])
    near = NEAR * (high - low)
    return np.asarray((values <= low + near) | (values >= high - near))
