"""Inverse kinematics of a robot: its limits and names, the oracle's verdict, and what is known of the result."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.arguments import flag, mapping, real_array
from dh2sim.errors import ConfigurationError
from dh2sim.inverse.branches import branch_names
from dh2sim.inverse.elimination import Found, Method
from dh2sim.inverse.families import family_kind, moving_joints, split_families
from dh2sim.inverse.goals import Free, read_goals, require_free
from dh2sim.inverse.loop import DEPENDENT, Arm, Flags, Indices, build_arm, joint_rank, pose_and_jacobian
from dh2sim.inverse.nearest import (
    goal_residuals,
    goal_sigma_min,
    least_singular_values,
    miss_text,
    no_solutions,
    numeric_solutions,
)
from dh2sim.inverse.numeric import NumericSolver, arm_size
from dh2sim.inverse.reach import limits_reason, position_limits, why_unreachable
from dh2sim.inverse.redundancy import SAMPLES, curves_and_nearest, joints_to_lock, self_motions
from dh2sim.inverse.self_motion import LONGEST, SELF_MOTION, Path
from dh2sim.inverse.solutions import Solutions
from dh2sim.inverse.table import bare_table, shared_builds
from dh2sim.inverse.trial import choose_method
from dh2sim.inverse.turns import Turns
from dh2sim.kinematics.chain import build_chain, configuration_of, joint_vector, serial_spec_of
from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.robot.spec import RobotSpec, SpecLike
from dh2sim.typing import Array, read_only

VERIFIED: Final = 1e-10
"""Residual up to which a configuration is a solution."""
UNSURE: Final = "The pose is nearly singular, and not every solution is accounted for: some may be missing."
ROUNDED: Final = (
    "But for rounding of the table the joints move tool0 in one direction less, as with an alpha of 3.141593 where "
    "pi is meant: every pose is nearly singular, and solutions may be missing."
)
ODD: Final = "Solutions come in pairs, but an odd number was found: at least one is missing."
_ROUNDED: Final = 1e-6
"""Share of the largest singular value that angles written to seven digits leave of zero."""
_EQUAL: Final = 1e-6
"""Distance of configurations below which they are the same."""
_GOAL_JOINTS: Final[Mapping[str | None, int]] = {None: 0, "roll": 1, "rotation": 3}


MOST_JOINTS: Final = 50
"""That move, of arms whose solutions are all found; of others one is searched numerically."""
_Built = TypeVar("_Built")


class InverseSolver:
    """All solutions of the inverse kinematics of one robot.

    What is built for a robot and a kind of goal, in 0.1 to 1 s, is kept, and shared by solvers of equal tables.
    A solver can be pickled with it.
    """

    def __init__(self, robot: SpecLike) -> None:
        """Prepare a robot, in any form.

        Raises:
            TypeError: It is not a robot.
            ModelError: It has branches or closed loops.
            ConfigurationError: None of its joints moves.
        """
        spec = serial_spec_of(robot)
        if not spec.moving_rows:
            raise ConfigurationError(f"{spec.name} has no joint that moves")
        self._prepare(bare_table(spec))

    def _prepare(self, spec: RobotSpec) -> None:
        self._spec = spec
        rows = spec.moving_rows
        self.names = tuple(row.name for row in rows)
        """Names of the joints, in the order of joint vectors."""
        self._limits = tuple(row.limits.position for row in rows)
        self._home = spec.named_configurations["home"]
        self._chain = build_chain(spec)
        self._built = shared_builds(spec)
        lower, upper = position_limits(rows)
        self.size = arm_size(self._chain, lower, upper)
        """Unit of length of residuals and singular values, m: a bound on the distance from base_link to tool0."""
        turns = np.array([row.type.turns for row in rows], dtype=np.bool_)
        self._turns = Turns(lower, upper, turns, np.where(turns, 1.0, self.size))
        self._turning = turns

    def __getstate__(self) -> dict[str, Any]:
        """Return what a pickle holds: the table, and what is built."""
        spec = self._spec
        parts = {"name": spec.name, "base": spec.base, "tool": spec.tool, "rows": spec.rows, "units": spec.units}
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
        numeric: bool = False,
    ) -> Any:
        """Return all configurations that reach a pose, or each of many poses.

        An arm with one joint to spare has curves of them, its self-motions: what of them is inside the limits is
        returned, and as ``q`` the configuration of each that is nearest to ``q0``. With more to spare, joints are
        locked first, from the tool inwards, where a solution near ``q0`` has them.

        Args:
            T: Poses of tool0 in base_link, shape (4, 4) or (N, 4, 4).
            q0: The solutions nearest to this joint vector, rad and m, shape (n,), come first; by default ``home``.
            limits: Whether to keep position limits: then every whole turn that fits is a solution of its own, and
                what violates them is left out. Otherwise joints that turn are within half a turn of ``q0``, or
                inside their limits if they cannot be both.
            lock: Values of joints that are not to move, by name, rad or m; of shape (N,) to lock each pose's own.
            free: 'rotation' for goals that are positions, 'roll' for those that may turn about z of tool0.
            numeric: Whether to descend from ``q0``, and then from other starts, to one solution only: quick enough to
                track a moving pose, and as good for one out of reach, to which ``nearest`` is the way.

        Returns:
            The :class:`Solutions` of one pose, or a list of those of N poses. For one pose alone branches are named,
            and how far a pose is out of reach is found out.

        Raises:
            ConfigurationError: A pose is not a rigid transform, ``q0`` has the wrong shape, a joint to lock is
                unknown, or more than ``MOST_JOINTS`` joints move and ``numeric`` is not given.
        """
        limits, numeric = flag("limits", limits), flag("numeric", numeric)
        goals = read_goals(T)
        poses = goals.reshape(-1, 4, 4)
        near = self._home if q0 is None else joint_vector(self._chain, q0)
        locked = self._locked({} if lock is None else mapping("lock", lock), len(poses))
        require_free(free)
        count = len(self.names) - len(locked)
        if not numeric and count > MOST_JOINTS:
            raise ConfigurationError(
                f"{self._spec.name}: {count} joints move; all solutions are found of arms with at most "
                f"{MOST_JOINTS}: use numeric for one solution"
            )
        surplus = 0 if numeric else self._surplus(free, tuple(sorted(locked)))
        if numeric:
            results = self._numeric(poses, near, locked, free, limits=limits)
        elif surplus:
            each = [{j: values[i % len(values)] for j, values in locked.items()} for i in range(len(poses))]
            results = [
                self._redundant(pose, near, lock_, free, surplus, limits=limits)
                for pose, lock_ in zip(poses, each, strict=True)
            ]
        else:
            method = self._method(free, tuple(sorted(locked)))
            arm, scaled = method.arm, method.arm.scaled_poses(poses)
            found = method.solve(scaled, _scaled_locks(arm, locked))
            lacking = method.lacking(found, len(poses))
            found, families = split_families(arm, scaled, method.moving, found)
            results = self._results(method, found, poses, near, free, limits=limits)
            for i in np.flatnonzero(lacking):
                results[i] = replace(results[i], complete=False, notes=(*results[i].notes, ODD))
            for i in found.unsure:
                results[i] = replace(results[i], complete=False, notes=(*results[i].notes, UNSURE))
            if self._surplus(free, tuple(sorted(locked)), _ROUNDED):  # joints are independent by rounding alone
                results = [replace(one, complete=False, notes=(*one.notes, ROUNDED)) for one in results]
            for k, paths in families.items():
                count = int((found.pose == k).sum())
                results[k] = self._with_families(results[k], count, arm, paths, poses[k], near, free, limits=limits)
        if goals.ndim == 3:
            return results
        [alone] = results
        if not len(alone) and not alone.reason:
            alone = self._unreached(alone, poses[0], near, locked, free, limits=limits)
        return replace(alone, branch=self._names(alone)) if len(alone) else alone

    def _names(self, found: Solutions) -> tuple[str, ...]:
        """Return the names of branches; isolated solutions that differ by whole turns have the same."""
        if found.curves:
            return branch_names(self._chain, found.q)
        first = {same: k for k, same in reversed(list(enumerate(found.same.tolist())))}
        names = branch_names(self._chain, found.q[list(first.values())])
        named = dict(zip(first, names, strict=True))
        return tuple(named[same] for same in found.same.tolist())

    def joints_to_lock(self, free: Free | None = None) -> tuple[str, ...]:
        """Return the names of the joints to lock so that solutions are isolated: none for most arms of six joints."""
        surplus = self._surplus(free, ())
        if not surplus:
            return ()
        arm = self._arm(free)
        chosen = joints_to_lock(arm, self._moving(free, ()), self._trial_ranges(arm), surplus)
        return tuple(self.names[joint] for joint in sorted(chosen))

    def _numeric(
        self, T: Array, q0: Array, locked: Mapping[int, Array], free: Free | None, *, limits: bool
    ) -> list[Solutions]:
        if any(len(values) > 1 for values in locked.values()):
            each = [{joint: values[i % len(values)][None] for joint, values in locked.items()} for i in range(len(T))]
            return [
                self._numeric(pose[None], q0, lock, free, limits=limits)[0]
                for pose, lock in zip(T, each, strict=True)
            ]
        solver = self._numeric_solver(locked, limits=limits)
        rank = self._rank(free)
        return numeric_solutions(self._spec, self._chain, solver, T, q0, free=free, size=self.size, rank=rank)

    def _unreached(
        self,
        none: Solutions,
        T: Array,
        q0: Array,
        locked: Mapping[int, Array],
        free: Free | None,
        *,
        limits: bool,
    ) -> Solutions:
        """Return why a pose is not reached; or what a last, numeric search finds."""
        [last] = self._numeric(T[None], q0, locked, free, limits=False)
        nearest = none.nearest if none.nearest is not None else last.nearest
        if len(last):
            if not limits or last.within_limits[0]:
                return last
            return replace(none, reason=limits_reason(self._spec, last.q), nearest=nearest)
        shortfall = None if locked else why_unreachable(self._spec, T, q0=q0, free=free)
        if shortfall is not None:
            return replace(none, reason=shortfall.reason, nearest=shortfall.q if none.nearest is None else nearest)
        names = ", ".join(self.names[joint] for joint in locked)
        where = f" with {names} locked" if names else ""
        assert nearest is not None
        reason = f"not reached{where}; the nearest is {miss_text(self._spec, nearest, T, free)}"
        return replace(none, reason=reason, nearest=nearest)

    def _numeric_solver(self, locked: Mapping[int, Array], *, limits: bool) -> NumericSolver:
        def build() -> NumericSolver:
            lower, upper = self._bounds(limits=limits)
            for joint, values in locked.items():
                lower[joint] = upper[joint] = values[0]
            return NumericSolver(self._chain, lower, upper)

        return build() if locked else self._kept(("numeric", limits), build)

    def _bounds(self, *, limits: bool) -> tuple[Array, Array]:
        lower, upper = (np.array(bound) for bound in position_limits(self._spec.moving_rows))
        return (lower, upper) if limits else (np.full(len(lower), -math.inf), np.full(len(upper), math.inf))

    def _redundant(
        self, T: Array, q0: Array, locked: Mapping[int, Any], free: Free | None, surplus: int, *, limits: bool
    ) -> Solutions:
        """Return the solutions of a pose for which the arm has joints to spare."""
        given = {joint: np.atleast_1d(value) for joint, value in locked.items()}
        arm, moving, ranges = self._arm(free), self._moving(free, tuple(given)), self._trial_ranges(self._arm(free))
        if surplus > 1:
            [near] = self._numeric(T[None], q0, given, free, limits=limits)
            if not len(near):
                return near
            held = {joint: near.q[0, joint : joint + 1] for joint in joints_to_lock(arm, moving, ranges, surplus)}
            values = {**given, **held}
            method = self._method(free, tuple(sorted(values)))
            found = method.solve(arm.scaled_poses(T[None]), _scaled_locks(arm, values))
            [result] = self._results(method, found, T[None], q0, free, limits=limits)
            names = listed(self.names[joint] for joint in sorted(held))
            note = f"{surplus} joints to spare: {names} are held where a solution near the start has them."
            return replace(result, complete=False, notes=(*result.notes, note))
        fixed, shares = _scaled_locks(arm, given), [1.0]
        sampled: list[str] = []

        def solve_locked(poses: Array, lock: Mapping[int, Array]) -> Array:
            method = self._method(free, tuple(sorted((*fixed, *lock))))
            shares.append(method.found_share)
            sampled.extend(self.names[joint] for joint in lock)
            return method.solve(poses, {**fixed, **lock}).q

        near_scaled = arm.scaled(np.append(q0, np.zeros(arm.goal_joints)))
        for joint, value in fixed.items():
            near_scaled[joint] = value[0]
        paths = self_motions(arm, arm.scaled_poses(T), moving, ranges, near_scaled, solve_locked)
        none = replace(no_solutions(len(self.names)), complete=min(shares) == 1.0, found_share=min(shares))
        note = f"Self-motions were looked for at {SAMPLES} values each of {listed(sampled, ' and ')}."
        result = self._of_paths(none, arm, paths, [SELF_MOTION] * len(paths), T, q0, free, limits=limits)
        return replace(result, notes=(note,)) if paths else result

    def _of_paths(
        self,
        none: Solutions,
        arm: Arm,
        paths: list[Path],
        kinds: Sequence[str],
        T: Array,
        q0: Array,
        free: Free | None,
        *,
        limits: bool,
    ) -> Solutions:
        """Return what limits leave of curves, and the configuration of each that is nearest to ``q0``."""
        curves, q, same = curves_and_nearest(arm, paths, kinds, *self._bounds(limits=limits), q0)
        if paths and not len(q):
            ends = np.concatenate([arm.unscaled(path.q)[:, : len(q0)] for path in paths])
            return replace(none, reason=limits_reason(self._spec, self._turns.placed(ends, q0)))
        reached = goal_residuals(self._spec, q0[None], T[None], free=free, size=self.size)[0] <= VERIFIED
        if reached and len(q) and self._turns.distance(q[:1], q0)[0] < 2.0 * LONGEST:
            q[0] = q0  # between two points of the first curve
        goals = np.broadcast_to(T, (len(q), 4, 4))
        return replace(
            none,
            q=read_only(q),
            residual=read_only(goal_residuals(self._spec, q, goals, free=free, size=self.size)),
            sigma_min=read_only(goal_sigma_min(self._chain, q, free=free, size=self.size, rank=self._rank(free))),
            within_limits=self._turns.inside(q),
            same=np.array(same, dtype=np.intp),
            branch=("",) * len(q),
            curves=tuple(curves),
        )

    def _with_families(
        self,
        isolated: Solutions,
        count: int,
        arm: Arm,
        paths: list[Path],
        T: Array,
        q0: Array,
        free: Free | None,
        *,
        limits: bool,
    ) -> Solutions:
        """Add families at a singularity to the isolated solutions of a pose, of which there are so many in all."""
        kinds = [family_kind(path, len(q0), arm.turns) for path in paths]
        families = self._of_paths(no_solutions(len(q0)), arm, paths, kinds, T, q0, free, limits=limits)
        if not len(families):
            return isolated if len(isolated) else replace(isolated, reason=isolated.reason or families.reason)
        notes = []
        for path, kind in zip(paths, kinds, strict=True):
            *names, last = (self.names[joint] for joint in moving_joints(path, len(q0)))
            joints = f"{', '.join(names)} and {last} move" if names else f"{last} moves"
            notes.append(f"{kind.capitalize()}: {joints}, tool0 does not.")
        order = np.argsort(self._turns.distance(np.concatenate([isolated.q, families.q]), q0), kind="stable")
        same = np.concatenate([isolated.same, families.same + count])[order]
        return replace(
            isolated,
            q=read_only(np.concatenate([isolated.q, families.q])[order]),
            residual=read_only(np.concatenate([isolated.residual, families.residual])[order]),
            sigma_min=read_only(np.concatenate([isolated.sigma_min, families.sigma_min])[order]),
            within_limits=np.concatenate([isolated.within_limits, families.within_limits])[order],
            same=same,
            branch=("",) * len(order),
            curves=families.curves,
            notes=(*isolated.notes, *dict.fromkeys(notes)),
            reason="",
        )

    def _results(
        self, method: Method, found: Found, poses: Array, q0: Array, free: Free | None, *, limits: bool
    ) -> list[Solutions]:
        """Verify what was found by the table's own product, and return it pose by pose."""
        n = len(self.names)
        q = method.arm.unscaled(found.q)[:, :n]
        residual = goal_residuals(self._spec, q, poses[found.pose], free=free, size=self.size)
        true = residual <= VERIFIED
        if method.arm.goal_joints:
            true &= _first_of_equal(found.pose, q, self._turns)
        found, q, residual = found.of(true), q[true], residual[true]
        sigma, all_q = self._sigma_min(method.arm, found, free), q
        if limits:
            which, q = self._turns.allowed(q, q0)
        else:
            which, q = np.arange(len(q)), self._turns.placed(q, q0)
        pose, sigma, residual = found.pose[which], sigma[which], residual[which]
        order = np.lexsort([self._turns.distance(q, q0), pose])
        pose, sigma, residual, which, q = pose[order], sigma[order], residual[order], which[order], q[order]
        inside = self._turns.inside(q)
        ends = np.searchsorted(pose, np.arange(len(poses) + 1))
        reasons = [""] * len(poses)
        for k in set(found.pose.tolist()).difference(pose.tolist()):
            reasons[k] = limits_reason(self._spec, self._turns.placed(all_q[found.pose == k], q0))
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
                reason=reasons[i],
            )
            for i, (start, end) in enumerate(pairwise(ends))
        ]

    def _sigma_min(self, arm: Arm, found: Found, free: Free | None) -> Array:
        """Return the least singular values of the goal's Jacobian at an arm's solutions, shape (M,)."""
        J = np.array(found.J[:, :, : len(self.names)])
        J[:, :3, self._turning] *= arm.length / self.size
        R = pose_and_jacobian(arm, found.q)[0][:, :, :3] if free == "roll" else None
        return least_singular_values(J, R, free=free, rank=self._rank(free))

    def _kept(self, key: object, build: Callable[[], _Built]) -> _Built:
        """Return what is built once, and kept for solvers of equal tables."""
        if key not in self._built:
            self._built[key] = build()
        kept: _Built = self._built[key]
        return kept

    def _arm(self, free: Free | None) -> Arm:
        return self._kept(free, lambda: build_arm(self._chain, self._limits, _GOAL_JOINTS[free]))

    def _moving(self, free: Free | None, locked: tuple[int, ...]) -> Flags:
        moving = np.ones(self._arm(free).n, dtype=np.bool_)
        moving[list(locked)] = False
        return moving

    def _rank(self, free: Free | None) -> int:
        """Return in how many of the goal's directions the joints move tool0 at a general configuration."""
        joints = self._arm(free).n
        return joints - self._surplus(free, ()) - self._arm(free).goal_joints

    def _surplus(self, free: Free | None, locked: tuple[int, ...], zero: float = DEPENDENT) -> int:
        """Return how many joints more than the goal needs an arm has; ``zero`` is as for ``joint_rank``."""

        def count() -> int:
            arm, moving = self._arm(free), self._moving(free, locked)
            return int(moving.sum()) - joint_rank(arm, moving, self._trial_ranges(arm), zero)

        return self._kept(("surplus", free, locked, zero), count)

    def _method(self, free: Free | None, locked: tuple[int, ...]) -> Method:
        arm = self._arm(free)
        return self._kept(
            (free, locked), lambda: choose_method(arm, self._moving(free, locked), self._trial_ranges(arm))
        )

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
            value = np.atleast_1d(real_array(f"lock[{name!r}]", given))
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
    numeric: bool = False,
) -> Any:
    """Return all configurations of a robot that reach a pose, or each of many poses: see ``InverseSolver.solve``.

    ``q0`` may be the name of a configuration, too.
    """
    near = None if q0 is None else configuration_of(robot, q0)
    return InverseSolver(robot).solve(T, near, limits, lock, free, numeric)


def _first_of_equal(pose: Indices, q: Array, turns: Turns) -> Flags:
    """Return which configurations of a pose are the first of those that only joints of the goal tell apart."""
    first = np.ones(len(q), dtype=np.bool_)
    for k in range(1, len(q)):
        before = np.flatnonzero((pose[:k] == pose[k]) & first[:k])
        first[k] = not (turns.distance(turns.nearest(q[before], q[k]), q[k]) < _EQUAL).any()
    return first


def _scaled_locks(arm: Arm, locked: Mapping[int, Array]) -> dict[int, Array]:
    """Return locked coordinates in the arm's units."""
    return {j: q if arm.turns[j] else (q + arm.offsets[j]) / arm.length for j, q in locked.items()}
