"""Differential inverse kinematics: joint positions that bring tool0 to a pose, iterated until nothing improves.

In every iteration mink (https://github.com/kevinzakka/mink) linearises the remaining error and solves a quadratic
program within the joints' limits. The damping is that of Levenberg and Marquardt: it grows whenever a step does not
improve, so the result is never farther from the goal than the start.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import mink
import mujoco
import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.chain import joint_vector
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.kinematics.transforms import quaternion_from_rotation
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array, read_only
from dh2sim.validate.motion.free_motion import compile_model

TOLERANCE = 1e-3
"""Largest error of a rotation matrix: single precision and typed numbers are accepted."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GoalPose:
    """A pose in base_link."""

    position: Array
    """m, shape (3,)."""
    rotation: Array
    """Exactly orthonormal, shape (3, 3)."""

    def within(self, distance: float) -> Array:
        """Return the position, or the nearest one within ``distance`` of base_link's origin, m, shape (3,)."""
        far = math.hypot(*self.position)
        if far <= distance:
            return self.position
        # divided by the greatest component first: the length of the longest vectors overflows
        direction = self.position / np.abs(self.position).max()
        return np.asarray(direction * (distance / np.linalg.norm(direction)))


def read_goal(T: ArrayLike) -> GoalPose:
    """Check a pose of shape (4, 4), and make its rotation orthonormal.

    Raises:
        ConfigurationError: It is no pose of finite numbers.
    """
    try:
        pose = np.asarray(T, dtype=np.float64)
    except (TypeError, ValueError):
        raise ConfigurationError("the goal must be an array of real numbers") from None
    if pose.shape != (4, 4):
        raise ConfigurationError(f"the goal must be a pose of shape (4, 4), got shape {pose.shape}")
    if not np.isfinite(pose).all():
        row, column = (int(i) for i in np.argwhere(~np.isfinite(pose))[0])
        raise ConfigurationError(
            f"the goal's element in row {row + 1}, column {column + 1} is {pose[row, column]}: it must be finite"
        )
    R = pose[:3, :3]
    wrong = np.abs(R).max() > 1.0 + TOLERANCE or np.abs(R.T @ R - np.eye(3)).max() > TOLERANCE
    if wrong or np.linalg.det(R) < 0.0 or np.abs(pose[3] - [0.0, 0.0, 0.0, 1.0]).max() > TOLERANCE:
        raise ConfigurationError(
            "the goal must be a pose: its upper left 3x3 part must be a rotation, its last row 0 0 0 1"
        )
    left, _, right = np.linalg.svd(R)
    return GoalPose(position=read_only(pose[:3, 3]), rotation=read_only(left @ right))


def rotation_angle(R_a: Array, R_b: Array) -> float:
    """Return the angle between two orientations, rad, from 0 to pi, exact for small ones too."""
    R = R_a.T @ R_b
    sine = 0.5 * math.hypot(R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    return math.atan2(sine, 0.5 * (float(np.trace(R)) - 1.0))


TOOL = "tool0"
"""Name of the site."""


class PositionTask(mink.Task):  # type: ignore[misc, unused-ignore]
    """Bring tool0's origin to a point.

    mink's ``FrameTask`` measures along a screw motion, in which the distance to a point depends on the orientations:
    for a goal out of reach, the nearest pose by that measure is not the nearest in space.
    """

    def __init__(self, model: mujoco.MjModel, cost: float) -> None:
        """Weigh the distance: 1 m costs ``cost``."""
        super().__init__(cost=np.full(3, cost))
        self.target: Array = np.zeros(3)
        """The point, m, shape (3,)."""
        self._site = model.site(TOOL).id

    def compute_error(self, configuration: mink.Configuration) -> Array:
        """Return tool0's origin less the point, m, shape (3,)."""
        return np.asarray(configuration.data.site_xpos[self._site] - self.target)

    def compute_jacobian(self, configuration: mink.Configuration) -> Array:
        """Return its derivative by the joint positions, shape (3, nv)."""
        jacobian = np.empty((3, configuration.model.nv))
        mujoco.mj_jacSite(configuration.model, configuration.data, jacobian, None, self._site)
        return jacobian


def orientation_task(cost: float) -> mink.FrameTask:
    """Return the task to turn tool0 to a goal's orientation: 1 rad costs ``cost``."""
    return mink.FrameTask(TOOL, "site", position_cost=0.0, orientation_cost=cost)


REACHED = 1e-7
"""Error that counts as none, m and rad, for a robot of size 1."""
SMALLEST_REACH = 1e-6
"""m: a robot with less only turns, and counts as of size 1."""
ENOUGH = 1e-11
"""Error of the same robot below which no more steps are made."""
LEVER = 0.3
"""Cost of 1 rad, in sizes of the robot, if position and orientation can both be reached."""
SMALL_LEVER = 0.03
"""Likewise if they cannot, with fewer than six joints."""
POSTURE = 1e-3
"""Cost of being 1 rad away from the start, in sizes of the robot."""
MIN_DAMPING, FIRST_DAMPING, MAX_DAMPING = 1e-12, 1e-6, 1e3
STALLED = 1e-4
"""A step that reduces the cost by less than this share is a poor one."""
PATIENCE = 4
"""Poor steps in a row after which no more are made."""
NUDGE = 0.1
"""rad and sizes of the robot: how far joints are moved out of a configuration in which no step improves."""
GOLDEN = 0.5 * (1.0 + math.sqrt(5.0))


@dataclass(slots=True, kw_only=True)
class _Budget:
    """Steps and time that are left."""

    steps: int
    deadline: float
    """Reading of ``time.perf_counter``, s."""
    taken: int = 0

    def spent(self) -> bool:
        """Return whether nothing is left; the first step is always allowed."""
        return self.taken >= self.steps or (self.taken > 0 and time.perf_counter() >= self.deadline)

    def take(self) -> bool:
        """Take a step if one is left."""
        if self.spent():
            return False
        self.taken += 1
        return True


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution:
    """Result of inverse kinematics."""

    q: Array
    """Joint positions inside the limits, rad or m, read-only, shape (n,)."""
    position_error: float
    """Distance of tool0 from the goal, m."""
    rotation_error: float
    """Angle between tool0's orientation and the goal's, rad, from 0 to pi."""
    reached: bool
    """Whether tool0 is at the goal; the orientation counts for robots of six joints and more."""


class InverseKinematics:
    """The solver of one robot; not thread-safe."""

    def __init__(self, model: RobotModel) -> None:
        """Compile a robot.

        Args:
            model: The robot; its meshes are not used.

        Raises:
            ModelError: An MJCF cannot hold the robot.
            EngineError: MuJoCo refuses the model.
        """
        self._chain = model.chain
        self._size = model.reach if model.reach > SMALLEST_REACH else 1.0
        self._whole_pose = model.chain.n >= 6
        if model.chain.n == 0:
            return
        compiled = compile_model(model)
        joints = [compiled.joint(joint.name) for joint in model.moving_joints]
        self._places = np.array([joint.qposadr[0] for joint in joints])
        limited = compiled.jnt_limited.astype(bool)
        self._lower = np.where(limited, compiled.jnt_range[:, 0], -np.inf)
        self._upper = np.where(limited, compiled.jnt_range[:, 1], np.inf)
        turns = compiled.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        self._units = np.where(turns, 1.0, self._size)
        """Comparable motions of the joints: 1 rad, or the robot's size in m."""
        self._configuration = mink.Configuration(compiled)
        self._limits = [mink.ConfigurationLimit(compiled, gain=1.0)]
        self._position = PositionTask(compiled, cost=1.0 / self._size)
        self._orientation = orientation_task(LEVER if self._whole_pose else SMALL_LEVER)
        self._posture = mink.PostureTask(compiled, cost=POSTURE / self._units)

    def solve(
        self, q_start: ArrayLike, T_base_tool: ArrayLike, *, limit_steps: int = 150, time_budget_s: float = 0.02
    ) -> Solution:
        """Bring tool0 to a pose, or as near as possible.

        A robot of six joints and more weighs position and orientation against each other. One with fewer cannot reach
        both: it first minimises both, with little weight on the orientation, and from there the position alone.

        Args:
            q_start: Initial joint positions, rad or m, shape (n,), moved inside the limits; the solution is near.
            T_base_tool: Pose of tool0 in base_link, shape (4, 4).
            limit_steps: Most steps.
            time_budget_s: Longest computing time, s; one step is always made.

        Returns:
            The solution; if ``reached`` is False, the nearest that was found.

        Raises:
            ConfigurationError: ``q_start`` or ``T_base_tool`` has a wrong shape or is not finite, or the latter is no
                pose.
        """
        goal = read_goal(T_base_tool)
        given = joint_vector(self._chain, q_start)
        if self._chain.n == 0:
            return self._solution(given, goal)
        start = np.empty(len(self._places))
        start[self._places] = given
        start = np.clip(start, self._lower, self._upper)
        self._aim(goal, start)
        budget = _Budget(steps=limit_steps, deadline=time.perf_counter() + time_budget_s)
        q, error = self._approach(start, budget)
        for sign in (1.0, -1.0):
            if error <= REACHED or budget.spent():
                break
            other, other_error = self._approach(self._nudged(q, sign), budget)
            if other_error < (1.0 - 100 * STALLED) * error:
                q, error = other, other_error
        return self._solution(q[self._places], goal)

    def _aim(self, goal: GoalPose, start: Array) -> None:
        """Set the tasks' targets; a goal very far away is moved nearer, so that nothing overflows."""
        self._position.target = goal.within(1e3 * self._size)
        self._orientation.set_target(mink.SE3(np.concatenate([quaternion_from_rotation(goal.rotation), np.zeros(3)])))
        self._posture.set_target(start)

    def _approach(self, q: Array, budget: _Budget) -> tuple[Array, float]:
        """Minimise with the posture, then without it; return the positions and the remaining error.

        A robot of fewer than six joints then gives up the orientation.
        """
        pose = (self._position, self._orientation)
        q = self._minimised(q, (*pose, self._posture), budget, patience=1)
        q = self._minimised(q, pose, budget, patience=PATIENCE)
        error = math.sqrt(self._cost(pose))
        if self._whole_pose or error <= REACHED:
            return q, error
        q = self._minimised(q, (self._position,), budget, patience=PATIENCE)
        return q, math.sqrt(self._cost((self._position,)))

    def _minimised(self, q: Array, tasks: Sequence[mink.Task], budget: _Budget, *, patience: int) -> Array:
        """Take steps that reduce the cost until they no longer do."""
        self._configuration.update(q)
        cost, damping, poor = self._cost(tasks), FIRST_DAMPING, 0
        while cost > ENOUGH**2 and poor < patience and damping <= MAX_DAMPING and budget.take():
            tried = self._step(q, tasks, damping)
            self._configuration.update(tried)
            new = self._cost(tasks)
            if new < cost:
                poor = poor + 1 if cost - new < STALLED * cost else 0
                q, cost, damping = tried, new, max(damping / 10.0, MIN_DAMPING)
            else:
                damping *= 10.0
                self._configuration.update(q)
        return q

    def _step(self, q: Array, tasks: Sequence[mink.Task], damping: float) -> Array:
        """Return the positions after one step from ``q``, where the configuration is."""
        try:
            # by default daqp oversteps limits by 1e-6, and clipping that spoils the step
            move = mink.solve_ik(
                self._configuration, tasks, 1.0, solver="daqp", damping=damping, limits=self._limits, primal_tol=1e-13
            )
        except mink.NoSolutionFound:
            return q
        return np.asarray(np.clip(q + move, self._lower, self._upper))

    def _cost(self, tasks: Sequence[mink.Task]) -> float:
        return sum(float(np.sum((task.cost * task.compute_error(self._configuration)) ** 2)) for task in tasks)

    def _nudged(self, q: Array, sign: float) -> Array:
        """Move every joint a little, each by another amount: a stretched arm has no gradient to bend."""
        turns = np.cos(2.0 * math.pi * GOLDEN * np.arange(1, len(q) + 1))
        return np.asarray(np.clip(q + sign * NUDGE * self._units * turns, self._lower, self._upper))

    def _solution(self, q: Array, goal: GoalPose) -> Solution:
        T = forward_kinematics(self._chain, q)
        position_error = math.dist(T[:3, 3], goal.position)
        rotation_error = rotation_angle(T[:3, :3], goal.rotation)
        turned = rotation_error <= 1e-6 or not self._whole_pose
        return Solution(
            q=read_only(q),
            position_error=position_error,
            rotation_error=rotation_error,
            reached=position_error <= 1e-6 * min(self._size, 1.0) and turned,
        )
