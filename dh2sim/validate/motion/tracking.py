"""Checks of controlled motion: rest under gravity compensation, tracking by computed torque, inverse dynamics."""

from __future__ import annotations

import math
from collections.abc import Set
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from dh2sim.messages import listed
from dh2sim.model.robot_model import RobotModel
from dh2sim.simulate.run import rollout
from dh2sim.typing import Array
from dh2sim.validate.motion.free_motion import frictionless, without_contacts, without_dry_friction
from dh2sim.validate.report import Check, LeftOut, Quantity, Worst, finding, impossible

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

CONTROLLERS = ("sine", "computed-torque")
"""An open-loop one with position actuators, and a closed-loop one with motors."""
INVERSE_ARMS = 2
INVERSE_STEPS = 200
INVERSE_TOLERANCE = 1e-9
"""Of the greatest force on the joint."""


def recorded_rollouts(model: RobotModel, *, seed: int = 0) -> tuple[xr.Dataset, ...]:
    """Record accelerations and forces of a robot, once for each of ``CONTROLLERS``; without dry friction."""
    return tuple(
        rollout(
            without_dry_friction(model),
            rollouts=INVERSE_ARMS,
            steps=INVERSE_STEPS,
            controller=controller,
            start="random",
            record=("qpos", "qvel", "qacc", "torque"),
            seed=seed,
        )
        for controller in CONTROLLERS
    )


def check_inverse(runs: Sequence[xr.Dataset]) -> Check:
    """Require ``mj_inverse`` of positions, velocities and accelerations to return the actuators' forces.

    Instants at which a limit or a contact is active are left out: there ``mj_inverse`` and the simulation agree only
    as far as MuJoCo's solver has converged. So are those after a rollout became unstable.

    Args:
        runs: The result of ``recorded_rollouts``; the model is the one in their attributes.

    Returns:
        A check whose error is relative to the greatest force on the joint in the run: that of the actuator, the
        inertial force, or Coriolis, centrifugal and gravity forces together.
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
        return impossible(Quantity.INVERSE, "limits or contacts are active at every recorded instant")
    return finding(
        Quantity.INVERSE,
        worst,
        INVERSE_TOLERANCE,
        samples=count,
        reference="mj_inverse",
        failure=f"the recorded force on {where.where} differs by {worst:.2g} of its greatest from that of the "
        f"recorded acceleration (tolerance {INVERSE_TOLERANCE:g})",
        worst=where,
    )


def _finite(columns: list[Array]) -> list[Array]:
    rows = np.logical_and.reduce([np.isfinite(column).all(axis=1) for column in columns])
    return [column[rows] for column in columns]


def _inverse(model: mujoco.MjModel, q: Array, v: Array, a: Array) -> tuple[np.ndarray, Array, Array]:
    """Return for N instants whether no constraint is active, shape (N,), and the inverse dynamics, shape (N, nv).

    The third result is the greatest of the forces whose sum is the second.
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


POSES = 8
DURATION = 1.0
"""s."""
REST_TOLERANCE = 1e-9
"""rad or m."""


def resting_rollouts(model: RobotModel, *, controller: str = "gravity-compensation", seed: int = 0) -> xr.Dataset:
    """Hold a robot in random poses, without friction, which would hide unbalanced forces."""
    return rollout(
        without_contacts(frictionless(model)),
        rollouts=POSES,
        duration=DURATION,
        controller=controller,
        start="random",
        record=("qpos",),
        seed=seed,
    )


def check_rest(run: xr.Dataset, assumed: Set[str] = frozenset()) -> Check:
    """Require an arm to stay where it started.

    Args:
        run: The result of ``resting_rollouts``. Rollouts in which a motor is too weak to hold its load are left out,
            and reported.
        assumed: Joints whose effort limit was assumed, and must not be too weak.

    Returns:
        A check whose error is the greatest motion of a joint in a second, rad or m.
    """
    held, left_out = _strong(run)
    if left_out is not None and not assumed.isdisjoint(left_out.joints):
        return _assumed_too_weak(Quantity.REST, REST_TOLERANCE, left_out, assumed)
    if not held.any():
        reason = "the motors are too weak to carry the arm in any of its random poses"
        return impossible(Quantity.REST, reason, left_out)
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
        REST_TOLERANCE,
        samples=len(q),
        failure=f"{name} moves by {farthest:.2g} {unit} (tolerance {REST_TOLERANCE:g}) "
        "though its motor balances gravity",
        worst=Worst(where=name, q=tuple(q[row, 0].tolist()), sample=int(run["rollout"].values[row])),
        left_out=left_out,
    )


def _strong(run: xr.Dataset) -> tuple[NDArray[np.bool_], LeftOut | None]:
    """Return in which rollouts no control was clipped, shape (rollouts,), and the others, if there are any."""
    clipped = run["saturation"].values > 0
    weak: NDArray[np.bool_] = np.any(clipped, axis=1)
    names = [str(name).rpartition("_")[0] for name in run["actuator"].values]
    joints = {name: int(count) for name, count in zip(names, clipped.sum(axis=0), strict=True) if count}
    return ~weak, LeftOut(rollouts=int(weak.sum()), joints=joints) if joints else None


def _assumed_too_weak(quantity: Quantity, tolerance: float, left_out: LeftOut, assumed: Set[str]) -> Check:
    joints = [joint for joint in left_out.joints if joint in assumed]
    return finding(
        quantity,
        math.inf,
        tolerance,
        samples=0,
        failure=f"the effort that was assumed for {listed(joints)} is too small; give it in the robot file",
        left_out=left_out,
    )


TRACKING_ARMS = 8
PERIODS = (1.0, 2.0, 4.0, 8.0, 16.0)
"""s: durations of a motion from waypoint to waypoint, tried in turn until no motor is too weak."""
TRACKING_STEPS = 250
"""Time steps of each of two such motions."""
BANDWIDTH = 20.0
"""Bandwidth of the controller, rad/s, times the duration."""
TRACKING_TOLERANCE = 0.2
"""Of the distance that a joint moves in a time step at its greatest speed. Theory gives 0.14 for any arm: the errors
of computed torque do not depend on its masses, and come only from controls that are constant during a time step."""
LEAST_STEP = 1e-9
"""rad or m: lower bound of that distance."""


def tracking_rollouts(model: RobotModel, *, controller: str = "computed-torque", seed: int = 0) -> xr.Dataset:
    """Follow smooth random references, without friction and contacts, as fast as the motors allow."""
    for period in PERIODS:
        run = rollout(
            without_contacts(frictionless(model)),
            rollouts=TRACKING_ARMS,
            steps=2 * TRACKING_STEPS,
            timestep=period / TRACKING_STEPS,
            controller=f"{controller}:period={period:g},bandwidth={BANDWIDTH / period:g}",
            start="random",
            record=("qpos", "qvel", "reference"),
            seed=seed,
        )
        if not run["saturation"].values.any():
            break
    return run


def check_tracking(run: xr.Dataset, assumed: Set[str] = frozenset()) -> Check:
    """Require every joint to stay close to its reference.

    Args:
        run: The result of ``tracking_rollouts``. Rollouts in which a motor is too weak are left out, and reported.
        assumed: Joints whose effort limit was assumed, and must not be too weak.

    Returns:
        A check whose error is in units of the distance that the joint moves in a time step at its greatest speed, so
        that it is comparable for prismatic and revolute joints, and for small and large robots.
    """
    strong, left_out = _strong(run)
    if left_out is not None and not assumed.isdisjoint(left_out.joints):
        return _assumed_too_weak(Quantity.TRACKING, TRACKING_TOLERANCE, left_out, assumed)
    if not strong.any():
        return impossible(Quantity.TRACKING, "the motors are too weak for any motion that was tried", left_out)
    run = run.isel(rollout=strong)
    error = np.abs(run["qpos"].values - run["qpos_ref"].values)
    error = np.where(np.isfinite(error), error, np.inf).max(axis=1)
    speed = np.abs(run["qvel_ref"].values).max(axis=(0, 1))
    relative = error / np.maximum(speed * float(run.attrs["timestep"]), LEAST_STEP)
    row, joint = (int(k) for k in np.unravel_index(np.argmax(relative), relative.shape))
    name, unit = str(run["joint"].values[joint]), str(run["joint_unit"].values[joint])
    return finding(
        Quantity.TRACKING,
        float(relative[row, joint]),
        TRACKING_TOLERANCE,
        samples=len(error),
        failure=f"{name} is {error[row, joint]:.2g} {unit} off its reference, {relative[row, joint]:.2g} of its "
        f"motion in a time step (tolerance {TRACKING_TOLERANCE:g})",
        worst=Worst(where=name, q=tuple(run["qpos"].values[row, 0].tolist()), sample=int(run["rollout"].values[row])),
        left_out=left_out,
    )
