"""Joint positions that bring tool0 to a pose: differential inverse kinematics, iterated until nothing improves.

In every iteration mink (https://github.com/kevinzakka/mink) linearises what is left to do and solves a quadratic
program within the joints' limits. Its damping is Levenberg's and Marquardt's: it grows whenever a step does not
improve, and so the result is never farther from the goal than the start.

The pose that inverse kinematics looks for: checked, and measured against.

What inverse kinematics wants of tool0, as mink's tasks: position and orientation apart, each measured plainly.
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
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.kinematics.transforms import quaternion_from_rotation
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array, read_only
from dh2sim.validate.motion.free_motion import compile_model
from dh2sim.view.motion.joint_vector import joint_vector

TOLERANCE = 1e-3
"""How far a rotation matrix may be from one: single precision, and numbers that were typed, are welcome."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Goal:
    """A pose in base_link."""

    position: Array
    """m, shape (3,)."""
    rotation: Array
    """A rotation to the last bits, shape (3, 3)."""

    def within(self, distance: float) -> Array:
        """Return the position, or where the way to it leaves a ball around base_link's origin, m, shape (3,)."""
        far = math.hypot(*self.position)
        if far <= distance:
            return self.position
        # the greatest component first: the length of the longest vectors is no double
        direction = self.position / np.abs(self.position).max()
        return np.asarray(direction * (distance / np.linalg.norm(direction)))


def read_goal(T: ArrayLike) -> Goal:
    """Check a pose, and turn its axes to right angles where they are only nearly so.

    Raises:
        ConfigurationError: it is no pose of finite numbers.
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
            "the goal is no pose: its upper left 3x3 part must be a rotation, its last row 0 0 0 1"
        )
    left, _, right = np.linalg.svd(R)
    return Goal(position=read_only(pose[:3, 3]), rotation=read_only(left @ right))


def rotation_angle(R_a: Array, R_b: Array) -> float:
    """Return the angle between two orientations, rad, from 0 to pi, exact for small ones too."""
    R = R_a.T @ R_b
    sine = 0.5 * math.hypot(R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    return math.atan2(sine, 0.5 * (float(np.trace(R)) - 1.0))


TOOL = "tool0"
"""The site."""


class PositionTask(mink.Task):  # type: ignore[misc, unused-ignore]
    """Bring tool0's origin to a point.

    mink's ``FrameTask`` measures along a screw motion, in which the way to a point depends on how far the
    orientations differ: for a goal that cannot be reached, the nearest by that measure is not the nearest in space.
    """

    def __init__(self, model: mujoco.MjModel, cost: float) -> None:
        """Weigh the distance; ``cost`` is that of 1 m."""
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
    """Turn tool0 to a goal's orientation; ``cost`` is that of 1 rad."""
    return mink.FrameTask(TOOL, "site", position_cost=0.0, orientation_cost=cost)


REACHED = 1e-7
"""Of a robot whose size is 1: how near to the goal is there; m, and rad."""
SMALLEST = 1e-6
"""m: a robot that reaches less only turns, and is taken to be of size 1."""
ENOUGH = 1e-11
"""Error, of the same robot, below which no step is worth its time."""
LEVER = 0.3
"""How much an error of 1 rad counts, in sizes of the robot, where both position and orientation can be met."""
SMALL_LEVER = 0.03
"""The same where they cannot: with fewer joints than a pose has coordinates."""
POSTURE = 1e-3
"""How much being 1 rad away from the start counts, in sizes of the robot."""
LEAST_DAMPING, FIRST_DAMPING, MOST_DAMPING = 1e-12, 1e-6, 1e3
STALLED = 1e-4
"""A step that takes away less than this share of the cost brings little."""
PATIENCE = 4
"""So many of them in a row bring nothing."""
NUDGE = 0.1
"""rad, and sizes of the robot: how far joints are moved out of a configuration in which they cannot improve."""
GOLDEN = 0.5 * (1.0 + math.sqrt(5.0))


@dataclass(slots=True, kw_only=True)
class _Allowance:
    """Steps and time that are left."""

    steps: int
    deadline: float
    """Reading of ``time.perf_counter``, s."""
    taken: int = 0

    def spent(self) -> bool:
        """Whether nothing is left; the first step is always allowed."""
        return self.taken >= self.steps or (self.taken > 0 and time.perf_counter() >= self.deadline)

    def take(self) -> bool:
        """Take a step, if there is one left."""
        if self.spent():
            return False
        self.taken += 1
        return True


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution:
    """What was found."""

    q: Array
    """Joint positions within their limits, rad or m, read-only, shape (n,)."""
    position_error: float
    """Distance of tool0 from the goal, m."""
    rotation_error: float
    """Angle between tool0's orientation and the goal's, rad, from 0 to pi."""
    reached: bool
    """Whether tool0 is at the goal; its orientation counts for robots of six joints and more."""


class InverseKinematics:
    """Solves for one robot; keeps the compiled model, and must not be used by two threads at a time."""

    def __init__(self, model: RobotModel) -> None:
        """Compile a robot.

        Args:
            model: the robot; its meshes are not needed.

        Raises:
            ModelError: an MJCF cannot hold the robot.
            EngineError: MuJoCo refuses the model.
        """
        self._chain = model.chain
        self._size = model.reach if model.reach > SMALLEST else 1.0
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
        """A comparable motion of every joint: 1 rad, or the robot's size in m."""
        self._configuration = mink.Configuration(compiled)
        self._limits = [mink.ConfigurationLimit(compiled, gain=1.0)]
        self._position = PositionTask(compiled, cost=1.0 / self._size)
        self._orientation = orientation_task(LEVER if self._whole_pose else SMALL_LEVER)
        self._posture = mink.PostureTask(compiled, cost=POSTURE / self._units)

    def solve(
        self, q_start: ArrayLike, T_base_tool: ArrayLike, *, limit_steps: int = 150, time_budget_s: float = 0.02
    ) -> Solution:
        """Bring tool0 to a pose, or as near as it gets.

        A robot of six joints and more weighs position and orientation against each other. One with fewer cannot meet
        both: it first goes to the best of both, with little weight on the orientation, and from there takes only the
        position the rest of the way.

        Args:
            q_start: where to begin, rad or m, shape (n,); moved inside the limits. The solution is one near to it.
            T_base_tool: pose of tool0 in base_link, shape (4, 4).
            limit_steps: most steps.
            time_budget_s: most time, s; one step is always made.

        Returns:
            The solution; with ``reached`` False it is the nearest that was found.

        Raises:
            ConfigurationError: ``q_start`` or ``T_base_tool`` has a wrong shape or is not finite, or the latter is no
                pose.
        """
        goal = read_goal(T_base_tool)
        given = joint_vector(self._chain, q_start)
        if self._chain.n == 0:
            return self._judged(given, goal)
        start = np.empty(len(self._places))
        start[self._places] = given
        start = np.clip(start, self._lower, self._upper)
        self._aim(goal, start)
        allowance = _Allowance(steps=limit_steps, deadline=time.perf_counter() + time_budget_s)
        q, error = self._approach(start, allowance)
        for sign in (1.0, -1.0):
            if error <= REACHED or allowance.spent():
                break
            other, other_error = self._approach(self._nudged(q, sign), allowance)
            if other_error < (1.0 - 100 * STALLED) * error:
                q, error = other, other_error
        return self._judged(q[self._places], goal)

    def _aim(self, goal: Goal, start: Array) -> None:
        """Aim the tasks; what is out of sight is looked for in its direction, so that nothing overflows."""
        self._position.target = goal.within(1e3 * self._size)
        self._orientation.set_target(mink.SE3(np.concatenate([quaternion_from_rotation(goal.rotation), np.zeros(3)])))
        self._posture.set_target(start)

    def _approach(self, q: Array, allowance: _Allowance) -> tuple[Array, float]:
        """Descend with everything, then without the pull of the start; return the positions and the error left.

        What a robot with few joints lacks, it then takes out of the orientation alone.
        """
        pose = (self._position, self._orientation)
        q = self._descended(q, (*pose, self._posture), allowance, patience=1)
        q = self._descended(q, pose, allowance, patience=PATIENCE)
        error = math.sqrt(self._cost(pose))
        if self._whole_pose or error <= REACHED:
            return q, error
        q = self._descended(q, (self._position,), allowance, patience=PATIENCE)
        return q, math.sqrt(self._cost((self._position,)))

    def _descended(self, q: Array, tasks: Sequence[mink.Task], allowance: _Allowance, *, patience: int) -> Array:
        """Take steps, none of which makes the cost greater, until they bring nothing."""
        self._configuration.update(q)
        cost, damping, dull = self._cost(tasks), FIRST_DAMPING, 0
        while cost > ENOUGH**2 and dull < patience and damping <= MOST_DAMPING and allowance.take():
            tried = self._step(q, tasks, damping)
            self._configuration.update(tried)
            new = self._cost(tasks)
            if new < cost:
                dull = dull + 1 if cost - new < STALLED * cost else 0
                q, cost, damping = tried, new, max(damping / 10.0, LEAST_DAMPING)
            else:
                damping *= 10.0
                self._configuration.update(q)
        return q

    def _step(self, q: Array, tasks: Sequence[mink.Task], damping: float) -> Array:
        """Return where one step leads; the configuration is at ``q``."""
        try:
            # daqp would overstep limits by 1e-6, and clipping that spoils the step
            move = mink.solve_ik(
                self._configuration, tasks, 1.0, solver="daqp", damping=damping, limits=self._limits, primal_tol=1e-13
            )
        except mink.NoSolutionFound:
            return q
        return np.asarray(np.clip(q + move, self._lower, self._upper))

    def _cost(self, tasks: Sequence[mink.Task]) -> float:
        return sum(float(np.sum((task.cost * task.compute_error(self._configuration)) ** 2)) for task in tasks)

    def _nudged(self, q: Array, sign: float) -> Array:
        """Move every joint a little, each otherwise: a stretched arm does not know which way to bend."""
        turns = np.cos(2.0 * math.pi * GOLDEN * np.arange(1, len(q) + 1))
        return np.asarray(np.clip(q + sign * NUDGE * self._units * turns, self._lower, self._upper))

    def _judged(self, q: Array, goal: Goal) -> Solution:
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
