"""An arm whose motors balance gravity stays where it is."""

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

POSES = 8
DURATION = 1.0
"""s."""
TOLERANCE = 1e-9
"""rad or m."""


def resting_rollouts(model: RobotModel, *, controller: str = "gravity-compensation", seed: int = 0) -> xr.Dataset:
    """Let a robot stand in random poses, without friction, which would hide what is not balanced."""
    return rollout(
        untouchable(frictionless(model)),
        rollouts=POSES,
        duration=DURATION,
        controller=controller,
        start="random",
        record=("qpos",),
        seed=seed,
    )


def check_rest(run: xr.Dataset) -> Check:
    """Require an arm to stay where it started.

    Args:
        run: what ``resting_rollouts`` returned. Rollouts in which a motor is too weak for the weight that it carries
            are left out.

    Returns:
        A check whose error is the farthest that any joint moved in a second, rad or m.
    """
    held = ~(run["saturation"].values > 0).any(axis=1)
    if not held.any():
        return impossible(Quantity.REST, "the motors are too weak to carry the arm in any of its random poses")
    run = run.isel(rollout=held)
    q = run["qpos"].values
    moved = np.abs(q - q[:, :1])
    moved = np.where(np.isfinite(moved), moved, np.inf).max(axis=1)
    row, joint = (int(k) for k in np.unravel_index(np.argmax(moved), moved.shape))
    farthest = float(moved[row, joint])
    name, unit = str(run["joint"].values[joint]), str(run["joint_unit"].values[joint])
    return finding(
        Quantity.REST,
        farthest,
        TOLERANCE,
        samples=len(q),
        failure=f"{name} moves by {farthest:.2g} {unit} (tolerance {TOLERANCE:g}) though its motor balances gravity",
        worst=Worst(where=name, q=tuple(q[row, 0].tolist()), sample=int(run["rollout"].values[row])),
    )
