"""Time-optimal motion along a path under limits of velocity, acceleration and torque, by TOPP-RA.

Source: H. Pham, Q.-C. Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis, IEEE
Transactions on Robotics 34 (2018). It keeps limits at the points of a grid; between them they are exceeded by some
tenths of a percent, which a last, even stretch takes back.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from dh2sim.errors import TrajectoryError
from dh2sim.extras import require_extra
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import without_meshes
from dh2sim.trajectory.curves import Curve, PiecewisePolynomial
from dh2sim.trajectory.limits import INSIDE, MotionLimits
from dh2sim.trajectory.motion import Motion, needed_stretch
from dh2sim.trajectory.profiles import Profile
from dh2sim.typing import Array

GRID: Final = 200
"""Intervals of the path, at least."""


class InverseDynamics:
    """Torques that a motion takes, by MuJoCo: tau = M(q) a + c(q, v) + g(q) + damping v, friction aside."""

    def __init__(self, model: RobotModel) -> None:
        """Compile the robot."""
        import mujoco

        self._mujoco = mujoco
        self._model = mujoco.MjModel.from_xml_string(to_mjcf(without_meshes(model)))
        self._data = mujoco.MjData(self._model)
        self.friction = np.array([joint.dynamics.friction for joint in model.moving_joints])
        """Dry friction, N·m or N, shape (n,)."""

    def parts(self, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array, Array]:
        """Return the parts that grow with the square of the speed, with the speed, and not, each of shape (N, n)."""
        mujoco, model, data = self._mujoco, self._model, self._data
        found = np.zeros((3, *q.shape))
        inertia = np.zeros((model.nv, model.nv))
        for i in range(len(q)):
            data.qpos[:], data.qvel[:] = q[i], 0.0
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_crb(model, data)
            mujoco.mj_fullM(model, data, inertia)
            mujoco.mj_comVel(model, data)
            mujoco.mj_rne(model, data, 0, found[2, i])
            data.qvel[:] = qd[i]
            mujoco.mj_comVel(model, data)
            mujoco.mj_passive(model, data)
            mujoco.mj_rne(model, data, 0, found[0, i])
            found[0, i] += inertia @ qdd[i] - found[2, i]
            found[1, i] = -data.qfrc_passive
        return found[0], found[1], found[2]

    def torques(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return torques and forces, N·m and N, shape (N, n), without dry friction."""
        square, linear, still = self.parts(q, qd, qdd)
        return square + linear + still


def time_optimal(model: RobotModel, path: Curve, limits: MotionLimits, tool: tuple[float, float]) -> Motion:
    """Return the fastest motion along a path, from rest to rest, within limits of velocity, acceleration and torque.

    Args:
        model: The robot.
        path: Joint vectors over the parameter, from 0.
        limits: Of joints and of the tool; that of jerk is not kept, for acceleration jumps.
        tool: Distance, m, and angle, rad, that the tool moves in a unit of the parameter.

    Raises:
        TrajectoryError: A joint cannot even hold the robot somewhere on the path.
        MissingExtraError: TOPP-RA is not installed.
    """
    require_extra("toppra", "toppra", what="profile 'optimal'")
    dynamics = InverseDynamics(model)
    effort = np.array([joint.effort for joint in model.moving_joints])
    _require_holding(model, dynamics, path, effort)
    grid = _grid(path)
    speed = _parameterized(path, grid, limits, dynamics, effort, tool)
    h = np.diff(grid)
    times = np.concatenate([[0.0], np.cumsum(2.0 * h / (speed[:-1] + speed[1:]))])
    rise = (speed[1:] ** 2 - speed[:-1] ** 2) / (2.0 * h)
    terms = np.stack([grid[:-1], speed[:-1], 0.5 * rise], axis=1)[:, :, None]
    motion = Motion(duration=float(times[-1]), law=PiecewisePolynomial.of(times, terms), path=path)
    motion = motion.stretched(max(1.0, needed_stretch(motion, Profile.OPTIMAL, limits, tool)))
    return motion.stretched(_torque_stretch(motion, dynamics, effort))


def _grid(path: Curve) -> Array:
    end = float(path.breaks[-1])
    even = np.linspace(0.0, end, GRID + 1)
    apart = np.abs(even[:, None] - np.asarray(path.breaks)[None]).min(axis=1) > 0.1 * end / GRID
    return np.unique(np.concatenate([even[apart], path.breaks]))


def _require_holding(model: RobotModel, dynamics: InverseDynamics, path: Curve, effort: Array) -> None:
    """Refuse a path on which gravity and friction take all that a joint has."""
    places = _grid(path)
    q = path.derivatives(places)[0]
    loads = np.abs(dynamics.parts(q, 0.0 * q, 0.0 * q)[2]) + dynamics.friction
    short = loads > 0.999 * effort
    if short.any():
        place, joint = (int(i) for i in np.argwhere(short)[0])
        name = model.moving_joints[joint].name
        unit = "N·m" if model.moving_joints[joint].type.turns else "N"
        raise TrajectoryError(
            f"{name} cannot move the robot at {100 * places[place] / places[-1]:.0f} % of the path: gravity and "
            f"friction take {loads[place, joint]:.4g} of {effort[joint]:.4g} {unit}"
        )


def _parameterized(
    path: Curve,
    grid: Array,
    limits: MotionLimits,
    dynamics: InverseDynamics,
    effort: Array,
    tool: tuple[float, float],
) -> Array:
    """Return the rate of the parameter at the grid, shape (k,)."""
    import toppra

    class Path(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
        def __call__(self, positions: Any, order: int = 0) -> Any:
            found = path.derivatives(np.atleast_1d(np.asarray(positions, dtype=np.float64)))[order]
            return found if np.ndim(positions) else found[0]

        @property
        def dof(self) -> int:
            return len(effort)

        @property
        def path_interval(self) -> Array:
            return np.array([grid[0], grid[-1]])

    def torque(q: Array, qd: Array, qdd: Array) -> Array:
        return np.asarray(dynamics.torques(q[None], qd[None], qdd[None])[0])

    velocity, acceleration = limits.velocity * INSIDE, limits.acceleration * INSIDE
    constraint = toppra.constraint
    constraints = [
        constraint.JointVelocityConstraint(np.stack([-velocity, velocity], axis=1)),
        constraint.JointTorqueConstraint(torque, np.stack([-effort, effort], axis=1), dynamics.friction),
    ]
    if np.isfinite(acceleration).all():
        constraints.append(constraint.JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)))
    solver = toppra.algorithm.TOPPRA(constraints, Path(), gridpoints=grid, solver_wrapper="seidel")
    _, speed, _ = solver.compute_parameterization(0.0, 0.0)
    if speed is None or not np.isfinite(speed).all():
        raise _none_found(path)
    found = np.maximum(np.asarray(speed, dtype=np.float64), 0.0)
    for limit, moved in zip((limits.tool_speed, limits.tool_turn), tool, strict=True):
        if moved > 0.0 and math.isfinite(limit):
            found = np.minimum(found, limit * INSIDE / moved)
    if (found[:-1] + found[1:]).min() <= 0.0:
        raise _none_found(path)
    return found


def _none_found(path: Curve) -> TrajectoryError:
    """Return the error of a path without a motion: at a place where no joint moves torques tell nothing about it."""
    rates = np.linalg.norm(path.derivatives(np.linspace(path.breaks[0], path.breaks[-1], 1001))[1], axis=1)
    still = np.flatnonzero(rates <= 1e-6 * rates.max())
    if not still.size:
        return TrajectoryError("no motion along the path keeps the limits of torque")
    return TrajectoryError(
        f"at {still[0] / 10:.0f} % of the path, in a singularity, joints turn round and limits of torque do not tell "
        "how fast the motion may be; take another profile"
    )


def torque_peaks(model: RobotModel, motions: Sequence[Motion]) -> Array:
    """Return the greatest torques and forces that motions take, dry friction included, N·m and N, shape (n,)."""
    dynamics = InverseDynamics(model)
    greatest = np.zeros(len(dynamics.friction))
    for motion in motions:
        q, qd, qdd, _ = motion.at(motion.times())
        found = np.abs(dynamics.torques(q, qd, qdd)) + np.where(qd != 0.0, dynamics.friction, 0.0)
        greatest = np.maximum(greatest, found.max(axis=0))
    return greatest


def _torque_stretch(motion: Motion, dynamics: InverseDynamics, effort: Array) -> float:
    """Return by what a motion has to be stretched for torques to stay within their limits, at least 1."""
    times = motion.times()
    q, qd, qdd, _ = motion.at(times)
    square, linear, still = dynamics.parts(q, qd, qdd)
    bound = effort * INSIDE - dynamics.friction

    def exceeds(k: float) -> bool:
        return bool((np.abs(still + linear / k + square / (k * k)) > bound).any())

    if not exceeds(1.0):
        return 1.0
    low, high = 1.0, 2.0
    while exceeds(high) and high < 1e6:
        low, high = high, 2.0 * high
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if exceeds(middle) else (low, middle)
    return high
