"""Inverse kinematics of a robot: its limits and names, the oracle's verdict, and what is known of the result."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.inverse.elimination import Found, Method, choose_method
from dh2sim.inverse.goals import Free, read_goals, require_free
from dh2sim.inverse.loop import Arm, build_arm, joint_rank
from dh2sim.inverse.nearest import goal_residuals, goal_sigma_min
from dh2sim.inverse.numeric import arm_size
from dh2sim.inverse.reach import position_limits
from dh2sim.inverse.solutions import Solutions
from dh2sim.inverse.turns import Turns
from dh2sim.kinematics.chain import SpecLike, build_chain, joint_vector, spec_of
from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.robot.spec import BaseSpec, Limits, RobotSpec, Row, ToolSpec
from dh2sim.typing import Array, read_only

VERIFIED: Final = 1e-10
"""Residual up to which a configuration is a solution."""
_GOAL_JOINTS: Final[Mapping[str | None, int]] = {None: 0, "roll": 1, "rotation": 3}


class InverseSolver:
    """All solutions of the inverse kinematics of one robot.

    What is built for a robot and a kind of goal, in 0.1 to 1 s, is kept, and shared by solvers of equal tables.
    A solver can be pickled with it.
    """

    def __init__(self, robot: SpecLike) -> None:
        """Prepare a robot, in any form.

        Raises:
            TypeError: It is not a robot.
        """
        self._prepare(_bare(spec_of(robot)))

    def _prepare(self, spec: RobotSpec) -> None:
        self._spec = spec
        rows = spec.moving_rows
        self.names = tuple(row.name for row in rows)
        """Names of the joints, in the order of joint vectors."""
        self._limits = tuple(row.limits.position for row in rows)
        self._home = spec.named_configurations["home"]
        self._chain = build_chain(spec)
        self._built = _shared(_key(spec))
        lower, upper = position_limits(rows)
        self.size = arm_size(self._chain, lower, upper)
        """Unit of length of residuals and singular values, m: a bound on the distance from base_link to tool0."""
        turns = np.array([row.type.turns for row in rows], dtype=np.bool_)
        self._turns = Turns(lower, upper, turns, np.where(turns, 1.0, self.size))

    def __getstate__(self) -> dict[str, Any]:
        """Return what a pickle holds: the table, and what is built."""
        spec = self._spec
        parts = {"name": spec.name, "base": spec.base, "tool": spec.tool, "rows": spec.rows}
        return {"parts": {**parts, "configurations": dict(spec.configurations)}, "built": dict(self._built)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a solver from a pickle."""
        self._prepare(RobotSpec(**state["parts"]))
        self._built.update(state["built"])

    def solve(
        self,
        T: ArrayLike,
        q0: ArrayLike | None = None,
        limits: bool = True,
        lock: Mapping[str, ArrayLike] | None = None,
        free: Free | None = None,
    ) -> Any:
        """Return all configurations that reach a pose, or each of many poses.

        Args:
            T: Poses of tool0 in base_link, shape (4, 4) or (N, 4, 4).
            q0: The solutions nearest to this joint vector, rad and m, shape (n,), come first; by default ``home``.
            limits: Whether to keep position limits: then every whole turn that fits is a solution of its own, and
                what violates them is left out. Otherwise joints that turn are within half a turn of ``q0``, or
                inside their limits if they cannot be both.
            lock: Values of joints that are not to move, by name, rad or m; of shape (N,) to lock each pose's own.
            free: 'rotation' for goals that are positions, 'roll' for those that may turn about z of tool0.

        Returns:
            The :class:`Solutions` of one pose, or a list of those of N poses.

        Raises:
            ConfigurationError: A pose is no rigid transform, ``q0`` has the wrong shape, a joint to lock is unknown,
                or the arm has more joints than the goal needs.
        """
        goals = read_goals(T)
        poses = goals.reshape(-1, 4, 4)
        near = self._home if q0 is None else joint_vector(self._chain, q0)
        locked = self._locked(lock or {}, len(poses))
        require_free(free)
        method = self._method(free, tuple(sorted(locked)))
        arm = method.arm
        scaled = {
            joint: q if arm.turns[joint] else (q + arm.offsets[joint]) / arm.length for joint, q in locked.items()
        }
        found = method.solve(arm.scaled_poses(poses), scaled)
        results = self._results(method, found, poses, near, free, limits=limits)
        return results[0] if goals.ndim == 2 else results

    def _results(
        self, method: Method, found: Found, poses: Array, q0: Array, free: Free | None, *, limits: bool
    ) -> list[Solutions]:
        """Verify what was found by the table's own product, and tell it pose by pose."""
        n = len(self.names)
        q = method.arm.unscaled(found.q)[:, :n]
        residual = goal_residuals(self._spec, q, poses[found.pose], free=free, size=self.size)
        true = residual <= VERIFIED
        found, q, residual = found.of(true), q[true], residual[true]
        sigma = goal_sigma_min(self._spec, q, free=free, size=self.size)
        if limits:
            which, q = self._turns.allowed(q, q0)
        else:
            which, q = np.arange(len(q)), self._turns.placed(q, q0)
        pose, sigma, residual = found.pose[which], sigma[which], residual[which]
        order = np.lexsort([self._turns.distance(q, q0), pose])
        pose, sigma, residual, which, q = pose[order], sigma[order], residual[order], which[order], q[order]
        inside = self._turns.inside(q)
        ends = np.searchsorted(pose, np.arange(len(poses) + 1))
        first = np.searchsorted(found.pose, np.arange(len(poses)))
        complete = method.found_share == 1.0
        return [
            Solutions(
                q=read_only(q[start:end]),
                residual=read_only(residual[start:end]),
                sigma_min=read_only(sigma[start:end]),
                within_limits=inside[start:end],
                same=which[start:end] - first[i],
                branch=("",) * int(end - start),
                complete=complete,
                found_share=method.found_share,
            )
            for i, (start, end) in enumerate(pairwise(ends))
        ]

    def _arm(self, free: Free | None) -> Arm:
        if free not in self._built:
            self._built[free] = build_arm(self._chain, self._limits, _GOAL_JOINTS[free])
        arm = self._built[free]
        assert isinstance(arm, Arm)
        return arm

    def _method(self, free: Free | None, locked: tuple[int, ...]) -> Method:
        if (free, locked) not in self._built:
            arm = self._arm(free)
            moving = np.ones(arm.n, dtype=np.bool_)
            moving[list(locked)] = False
            ranges = self._trial_ranges(arm)
            surplus = int(moving.sum()) - joint_rank(arm, moving, ranges)
            if surplus:
                more = "1 joint more" if surplus == 1 else f"{surplus} joints more"
                raise ConfigurationError(f"the arm has {more} than the goal needs: lock some of {listed(self.names)}")
            self._built[free, locked] = choose_method(arm, moving, ranges)
        method = self._built[free, locked]
        assert isinstance(method, Method)
        return method

    def _trial_ranges(self, arm: Arm) -> Array:
        """Return where trial configurations are drawn from, in the arm's units, shape (n, 2)."""
        ranges = [(-math.pi, math.pi) if turns else (-1.0, 1.0) for turns in arm.turns]
        for i, limit in enumerate(self._limits):
            if limit is not None and not arm.turns[i]:
                low, high = ((value + float(arm.offsets[i])) / arm.length for value in limit)
                if high > low:
                    ranges[i] = (low, high)
        return np.array(ranges)

    def _locked(self, lock: Mapping[str, ArrayLike], poses: int) -> dict[int, Array]:
        """Return the locked joints' coordinates by index, each of shape (1,) or (poses,)."""
        locked = {}
        for name, given in lock.items():
            if name not in self.names:
                hint = did_you_mean(name, self.names)
                raise ConfigurationError(f"unknown joint {shown(name)} to lock.{hint} Joints: {listed(self.names)}")
            value = np.atleast_1d(np.asarray(given, dtype=np.float64))
            if value.shape not in ((1,), (poses,)) or not np.isfinite(value).all():
                raise ConfigurationError(
                    f"the value of {name}, which is locked, must be a finite number, or one for each pose"
                )
            locked[self.names.index(name)] = value
        return locked


def inverse_kinematics(
    robot: SpecLike,
    T: ArrayLike,
    q0: ArrayLike | None = None,
    limits: bool = True,
    lock: Mapping[str, ArrayLike] | None = None,
    free: Free | None = None,
) -> Any:
    """Return all configurations of a robot that reach a pose, or each of many poses: see ``InverseSolver.solve``."""
    return InverseSolver(robot).solve(T, q0, limits, lock, free)


@lru_cache(maxsize=64)
def _shared(key: tuple[object, ...]) -> dict[Any, Any]:  # noqa: ARG001
    """Return what is built for a table, the same for equal tables."""
    return {}


def _key(spec: RobotSpec) -> tuple[object, ...]:
    """Return the numbers of a table, which tell it from others."""
    poses = (spec.base.pose, spec.tool)
    return (
        *(tuple(values.tolist()) for pose in poses for values in (pose.xyz, pose.rpy)),
        *((r.type, r.convention, r.a, r.alpha, r.d, r.theta, r.beta, r.flip, r.limits.position) for r in spec.rows),
    )


def _bare(spec: RobotSpec) -> RobotSpec:
    """Return a robot without all that does not count here."""

    def bare(row: Row) -> Row:
        return Row(
            name=row.name,
            type=row.type,
            convention=row.convention,
            a=row.a,
            alpha=row.alpha,
            d=row.d,
            theta=row.theta,
            beta=row.beta,
            flip=row.flip,
            limits=Limits(position=row.limits.position),
        )

    home = {name: q for name, q in spec.configurations.items() if name == "home"}
    return RobotSpec(
        name=spec.name,
        base=BaseSpec(pose=spec.base.pose),
        tool=ToolSpec.at(spec.tool),
        rows=tuple(bare(row) for row in spec.rows),
        configurations=home,
    )
