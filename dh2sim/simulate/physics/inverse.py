"""Inverse dynamics of what was recorded give the forces that were recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from dh2sim.model.robot_model import RobotModel
from dh2sim.simulate.physics.findings import finding, impossible
from dh2sim.simulate.physics.variants import without_dry_friction
from dh2sim.simulate.run import rollout
from dh2sim.typing import Array
from dh2sim.validate.report import Check, Quantity, Worst

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

CONTROLLERS = ("sine", "computed-torque")
"""One that looks at no state, with position actuators, and one that does, with motors."""
ARMS = 2
STEPS = 200
TOLERANCE = 1e-9
"""Of the greatest force that the joint sees."""


def recorded_rollouts(model: RobotModel, *, seed: int = 0) -> tuple[xr.Dataset, ...]:
    """Record accelerations and forces of a robot, once for each of ``CONTROLLERS``; without dry friction."""
    return tuple(
        rollout(
            without_dry_friction(model),
            rollouts=ARMS,
            steps=STEPS,
            controller=controller,
            start="random",
            record=("qpos", "qvel", "qacc", "torque"),
            seed=seed,
        )
        for controller in CONTROLLERS
    )


def check_inverse(runs: Sequence[xr.Dataset]) -> Check:
    """Require ``mj_inverse``, given positions, velocities and accelerations, to return the actuators' forces.

    Instants at which a limit or a contact pushes are left out: there ``mj_inverse`` and the simulation agree as well
    as MuJoCo's solver has converged, and no better. So are those after a rollout became unstable.

    Args:
        runs: what ``recorded_rollouts`` returned; the model is the one in their attributes.

    Returns:
        A check whose error is relative to the greatest force that the joint sees in the run: actuators', inertial, or
        Coriolis, centrifugal and gravity forces together.
    """
    worst, where, count = -1.0, Worst(where="", q=()), 0
    for run in runs:
        model = mujoco.MjModel.from_xml_string(run.attrs["mjcf"])
        K = run.sizes["interval"]
        state = [run["qpos"].values[:, :K], run["qvel"].values[:, :K], run["qacc"].values]
        columns = [values.reshape(-1, model.nv) for values in (*state, run["torque"].values)]
        columns = _finite(columns)
        free, inverse, forces = _inverse(model, *columns[:3])
        if not free.any():
            continue
        torque = columns[3]
        size = np.maximum(np.abs(forces), np.abs(torque)).max(axis=0)
        error = np.abs(inverse - torque)[free] / np.maximum(size, np.finfo(float).tiny)
        count += len(error)
        instant, joint = (int(k) for k in np.unravel_index(np.argmax(error), error.shape))
        if error[instant, joint] > worst:
            worst = float(error[instant, joint])
            where = Worst(where=str(run["joint"].values[joint]), q=tuple(columns[0][free][instant].tolist()))
    if not count:
        return impossible(Quantity.INVERSE, "limits or contacts push at every recorded instant")
    return finding(
        Quantity.INVERSE,
        worst,
        TOLERANCE,
        samples=count,
        reference="mj_inverse",
        failure=f"the force recorded of {where.where} differs by {worst:.2g} of its greatest from what the recorded "
        f"acceleration takes (tolerance {TOLERANCE:g})",
        worst=where,
    )


def _finite(columns: list[Array]) -> list[Array]:
    rows = np.logical_and.reduce([np.isfinite(column).all(axis=1) for column in columns])
    return [column[rows] for column in columns]


def _inverse(model: mujoco.MjModel, q: Array, v: Array, a: Array) -> tuple[np.ndarray, Array, Array]:
    """For N instants: whether no constraint is active, shape (N,), and the inverse dynamics' forces, shape (N, nv).

    The third are the greatest of the forces that add up to the second.
    """
    data = mujoco.MjData(model)
    free = np.empty(len(q), dtype=bool)
    inverse, greatest = np.empty_like(q), np.empty_like(q)
    inertial = np.empty(model.nv)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
        mujoco.mj_inverse(model, data)
        mujoco.mj_mulM(model, data, inertial, a[k])
        free[k] = data.nefc == 0
        inverse[k] = data.qfrc_inverse
        greatest[k] = np.maximum.reduce([np.abs(inertial), np.abs(data.qfrc_bias), np.abs(data.qfrc_passive)])
    return free, inverse, greatest
