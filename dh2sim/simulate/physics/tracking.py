"""Computed torque follows its reference as closely as sampled control can."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dh2sim.model.robot_model import RobotModel
from dh2sim.simulate.physics.findings import finding, impossible
from dh2sim.simulate.physics.variants import frictionless, untouchable
from dh2sim.simulate.run import rollout
from dh2sim.validate.report import Check, Quantity, Worst

if TYPE_CHECKING:
    import xarray as xr

ARMS = 8
PERIODS = (1.0, 2.0, 4.0, 8.0, 16.0)
"""s: durations of a motion from waypoint to waypoint, tried in turn until no motor is too weak for it."""
STEPS = 250
"""Time steps of such a motion; there are two of them."""
BANDWIDTH = 20.0
"""Of the controller, rad/s, times the duration."""
TOLERANCE = 0.2
"""Of the way that a joint makes in a time step at its greatest speed. Theory gives 0.14 whatever the arm: the errors
of computed torque know nothing of its masses, and only come from controls that are constant during a time step."""
STANDING = 1e-9
"""rad or m: way of a joint that stands still, as errors go."""


def tracking_rollouts(model: RobotModel, *, controller: str = "computed-torque", seed: int = 0) -> xr.Dataset:
    """Let a robot follow smooth random references, without friction and contacts, as fast as its motors allow."""
    for period in PERIODS:
        run = rollout(
            untouchable(frictionless(model)),
            rollouts=ARMS,
            steps=2 * STEPS,
            timestep=period / STEPS,
            controller=f"{controller}:period={period:g},bandwidth={BANDWIDTH / period:g}",
            start="random",
            record=("qpos", "qvel", "reference"),
            seed=seed,
        )
        if not run["saturation"].values.any():
            break
    return run


def check_tracking(run: xr.Dataset) -> Check:
    """Require every joint to be close to its reference all the time.

    Args:
        run: what ``tracking_rollouts`` returned. Rollouts in which a motor is too weak are left out.

    Returns:
        A check whose error is in units of the way that the joint makes in a time step at its greatest speed, so that
        it means the same for slides and for joints that turn, for small robots and for large ones.
    """
    strong = ~(run["saturation"].values > 0).any(axis=1)
    if not strong.any():
        return impossible(Quantity.TRACKING, "the motors are too weak for any motion that was tried")
    run = run.isel(rollout=strong)
    error = np.abs(run["qpos"].values - run["qpos_ref"].values)
    error = np.where(np.isfinite(error), error, np.inf).max(axis=1)
    speed = np.abs(run["qvel_ref"].values).max(axis=(0, 1))
    relative = error / np.maximum(speed * float(run.attrs["timestep"]), STANDING)
    row, joint = (int(k) for k in np.unravel_index(np.argmax(relative), relative.shape))
    name, unit = str(run["joint"].values[joint]), str(run["joint_unit"].values[joint])
    return finding(
        Quantity.TRACKING,
        float(relative[row, joint]),
        TOLERANCE,
        samples=len(error),
        failure=f"{name} is {error[row, joint]:.2g} {unit} off its reference, {relative[row, joint]:.2g} of the way "
        f"that it makes in a time step (tolerance {TOLERANCE:g})",
        worst=Worst(where=name, q=tuple(run["qpos"].values[row, 0].tolist()), sample=int(run["rollout"].values[row])),
    )
