"""The closed loops of a mechanism as it is simulated: how its passive joints follow the driven ones.

The equality constraints of the compiled model, ``connect`` and ``weld`` between sites, for many configurations at
once, from what MuJoCo's kinematics leave of each: anchors and axes of the joints, and places of the sites. With J the
constraints' Jacobian, split into the columns of driven joints and of all others, velocities that keep the loops
closed are v = S v_driven with S = [I; -pinv(J_others) J_driven], and the equation of motion becomes that of the
driven joints, Sᵀ M S a + Sᵀ (c + M S' v_driven) = tau: R. Featherstone, Rigid Body Dynamics Algorithms (2008),
section 8.2.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

from dh2sim.typing import Array

CLOSED: Final = 1e-11
"""Of loops, in sizes of the mechanism, and rad."""
SINGULAR: Final = 1e-5
"""Least singular value of the passive joints' constraints in a regular position, lengths in sizes."""
RANK: Final = 1e-8
STEP: Final = 0.1
"""rad, or sizes: of a step of any driven joint."""
JUMP: Final = 0.5
"""rad, or sizes: more than this no passive joint moves in a step."""
NEWTON: Final = 8
FIELDS: Final = ("xanchor", "xaxis", "site_xpos", "site_xmat")


class Kinematics(NamedTuple):
    """What MuJoCo computes of configurations."""

    anchors: Array
    """Points of the joints' axes, m, shape (batch, nv, 3)."""
    axes: Array
    """Their directions, shape (batch, nv, 3)."""
    points: Array
    """Origins of the sites, m, shape (batch, sites, 3)."""
    rotations: Array
    """Their orientations, shape (batch, sites, 3, 3)."""

    @classmethod
    def of(cls, batch: Batch) -> Kinematics:
        """Return views of a batch's fields; they change with it."""
        anchors, axes, points, matrices = (batch.bind(name) for name in FIELDS)
        return cls(anchors, axes, points, matrices.reshape(len(matrices), -1, 3, 3))

    @classmethod
    def of_data(cls, data: mujoco.MjData) -> Kinematics:
        """Return those of one configuration, a batch of one."""
        anchors, axes, points, matrices = (np.array(getattr(data, name))[None] for name in FIELDS)
        return cls(anchors, axes, points, matrices.reshape(1, -1, 3, 3))


class ClosedLoops:
    """The constraints of a compiled mechanism, all of whose joints have one coordinate."""

    def __init__(self, model: mujoco.MjModel, driven: NDArray[np.intp], start: Array, size: float) -> None:
        """Describe the loops.

        Args:
            model: The compiled model.
            driven: Degrees of freedom of the driven joints.
            start: Positions at which the loops are closed, shape (nq,).
            size: Of the mechanism, m.
        """
        self.model, self.driven, self.start, self.size = model, driven, start, size
        limited = model.jnt_limited.astype(bool)
        self._lower = np.where(limited, model.jnt_range[:, 0] - CLOSED, -np.inf)
        self._upper = np.where(limited, model.jnt_range[:, 1] + CLOSED, np.inf)
        self._others = np.setdiff1d(np.arange(model.nv), driven)
        self._turns = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        self._scale = np.where(self._turns, 1.0, size)
        between = model.eq_objtype == mujoco.mjtObj.mjOBJ_SITE  # couplings of joints follow from the others
        sites = np.stack([model.eq_obj1id, model.eq_obj2id], axis=1)[between]
        self._sites: NDArray[np.intp] = np.asarray(sites, dtype=np.intp).reshape(-1, 2)
        self._welded = np.flatnonzero(model.eq_type[between] == mujoco.mjtEq.mjEQ_WELD)
        self._ancestors = _ancestors(model)
        self._carries = self.carries(model.site_bodyid[self._sites])  # (equalities, 2, nv)
        self._before = self.carries(model.jnt_bodyid) & ~np.eye(model.nv, dtype=bool)  # joints that carry a joint
        self._weights = np.concatenate([np.full(3 * len(sites), 1.0 / size), np.ones(3 * len(self._welded))])
        data = mujoco.MjData(model)
        data.qpos[:] = start
        mujoco.mj_kinematics(model, data)
        J = self.jacobian(Kinematics.of_data(data))[0]
        values = np.linalg.svd(J[:, self._others], compute_uv=False)
        whole = np.linalg.svd(J, compute_uv=False)
        self.freedoms = model.nv - int((whole > RANK * max(1.0, float(whole.max(initial=0.0)))).sum())
        """Of the loops at the start, to first order."""
        passive = int((values > RANK * max(1.0, float(values.max(initial=0.0)))).sum())
        self.determined = passive == len(self._others) and self.freedoms == len(driven)
        """Whether the driven joints move independently, and determine all others."""

    @property
    def reference(self) -> Array:
        """Positions of the driven joints at the start, shape (driven,)."""
        return np.asarray(self.start[self.driven])

    def carries(self, bodies: NDArray[Any]) -> NDArray[np.bool_]:
        """Return which joints carry some bodies, shape (…, nv) for bodies of shape (…)."""
        return np.asarray(self._ancestors[bodies])

    def jacobian(self, at: Kinematics) -> Array:
        """Return the constraints' Jacobian, lengths in sizes, shape (batch, constraints, nv)."""
        return self._rows(at, at.axes, self._lever(at))

    def _lever(self, at: Kinematics) -> Array:
        """Return the velocities of the equalities' points by joint, shape (batch, equalities, 2, nv, 3)."""
        arms = at.points[:, self._sites][:, :, :, None] - at.anchors[:, None, None]
        turning = np.cross(at.axes[:, None, None], arms)
        return np.where(self._turns[:, None], turning, at.axes[:, None, None])

    def _rows(self, at: Kinematics, axes: Array, velocities: Array) -> Array:
        count, nv = at.axes.shape[:2]
        both = np.where(self._carries[..., None], velocities, 0.0)
        rows = [(both[:, :, 0] - both[:, :, 1]).transpose(0, 1, 3, 2).reshape(count, -1, nv)]
        sides = self._carries[:, 0].astype(float) - self._carries[:, 1]
        turning = sides[self._welded][:, :, None] * np.where(self._turns[:, None], axes, 0.0)[:, None]
        rows.append(turning.transpose(0, 1, 3, 2).reshape(count, -1, nv))
        return np.asarray(self._weights[:, None] * np.concatenate(rows, axis=1) * self._scale)

    def errors(self, at: Kinematics) -> Array:
        """Return how far the loops are open, lengths in sizes, and rad, shape (batch, constraints)."""
        ends = at.points[:, self._sites]
        parts = [(ends[:, :, 0] - ends[:, :, 1]).reshape(len(ends), -1)]
        a, b = (at.rotations[:, self._sites[self._welded, side]] for side in (0, 1))
        R = (a[..., :, None, :] * b[..., None, :, :]).sum(axis=-1)
        twist = [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]]
        parts.append(0.5 * np.stack(twist, axis=-1).reshape(len(ends), -1))
        return np.asarray(self._weights * np.concatenate(parts, axis=1))

    def motions(self, at: Kinematics) -> Array:
        """Return S: velocities of all joints for a unit velocity of each driven one, shape (batch, nv, driven)."""
        J = self.jacobian(at)
        return self._followed(J, _inverse(J[:, :, self._others]))

    def _followed(self, J: Array, inverse: Array) -> Array:
        follows = -inverse @ J[:, :, self.driven]
        S = np.zeros((len(J), self.model.nv, len(self.driven)))
        S[:, self.driven, np.arange(len(self.driven))] = 1.0
        S[:, self._others] = self._scale[self._others, None] * follows / self._scale[self.driven]
        return S

    def inertia(self, qpos: Array) -> Array:
        """Return the inertia that the driven joints feel at positions of shape (nq,), shape (driven, driven)."""
        model = self.model
        data, M = mujoco.MjData(model), np.zeros((model.nv, model.nv))
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, M)
        return np.asarray(joint_inertia(M[None], self.motions(Kinematics.of_data(data)))[0])

    def rates(self, qpos: Array, driven: Array) -> tuple[Array, Array]:
        """Return how far loops are open, and the velocities that the driven joints' give to all.

        Args:
            qpos: Positions, shape (count, nq).
            driven: Velocities of the driven joints, shape (count, driven).

        Returns:
            The greatest of each in sizes or rad, shape (count,), and velocities, shape (count, nv).
        """
        batch = Batch(self.model, len(qpos), nthread=1)
        at = Kinematics.of(batch)
        batch.bind("qpos")[:] = qpos
        _forward(batch, np.arange(len(qpos)))
        velocities = (self.motions(at) @ driven[:, :, None])[:, :, 0]
        return np.abs(self.errors(at)).max(axis=1, initial=0.0), np.asarray(velocities)

    def balancing(self, at: Kinematics, force: Array) -> Array:
        """Return the least forces of the driven joints that balance those of all joints together with the loops.

        Args:
            at: The configurations.
            force: Of all joints, shape (batch, nv).

        Returns:
            Shape (batch, driven); the best there are where driven joints cannot balance them.
        """
        J = self.jacobian(at)
        held = np.zeros((len(J), self.model.nv, len(self.driven) + J.shape[1]))
        held[:, self.driven, np.arange(len(self.driven))] = 1.0
        held[:, :, len(self.driven) :] = J.transpose(0, 2, 1)
        return np.asarray((_inverse(held) @ force[:, :, None])[:, : len(self.driven), 0])

    def motions_and_drift(self, at: Kinematics, v: Array) -> tuple[Array, Array]:
        """Return S, and S' v_driven: the accelerations of all joints while no driven one accelerates.

        Args:
            at: The configurations.
            v: Velocities of all joints, shape (batch, nv).

        Returns:
            Shapes (batch, nv, driven) and (batch, nv).
        """
        moving = v[:, :, None] * at.axes
        spins = np.where(self._turns[:, None], moving, 0.0)
        angular = _sum(self._before, spins)  # of the body that each joint is on
        arms = at.anchors[:, :, None] - at.anchors[:, None]  # joint i seen from joint j
        carried = np.where(self._turns[:, None], np.cross(spins[:, None], arms), moving[:, None])
        anchors = np.where(self._before[..., None], carried, 0.0).sum(axis=2)
        axes = np.cross(angular, at.axes)
        levers = self._lever(at)
        ends = np.where(self._carries[..., None], v[:, None, None, :, None] * levers, 0.0).sum(axis=3)
        arms = at.points[:, self._sites][:, :, :, None] - at.anchors[:, None, None]
        rates = np.cross(axes[:, None, None], arms)
        rates += np.cross(at.axes[:, None, None], ends[:, :, :, None] - anchors[:, None, None])
        rates = np.where(self._turns[:, None], rates, axes[:, None, None])
        bias = (self._rows(at, axes, rates) / self._scale * v[:, None]).sum(axis=2)
        J = self._rows(at, at.axes, levers)
        inverse = _inverse(J[:, :, self._others])
        accelerations = np.zeros(v.shape)
        accelerations[:, self._others] = -(inverse @ bias[:, :, None])[:, :, 0]
        return self._followed(J, inverse), accelerations * self._scale

    def follow(self, start: Array, targets: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Move the driven joints straight to targets; the others follow on their branch of motion.

        Args:
            start: Positions at which the loops are closed, shape (batch, nq).
            targets: Of the driven joints, shape (batch, driven).

        Returns:
            Positions, shape (batch, nq), and whether the targets were reached; where not, a singular position, a dead
            one or the limit of a passive joint is in the way, and the positions are the last before it.
        """
        qpos, reached = start.copy(), np.ones(len(start), dtype=bool)
        first = start[:, self.driven]
        way = targets - first
        steps = np.ceil(np.abs(way / self._scale[self.driven]).max(axis=1, initial=0.0) / STEP).astype(int)
        if not steps.any():
            return qpos, reached
        batch = Batch(self.model, len(start), nthread=1)
        S = np.zeros((len(start), self.model.nv, len(self.driven)))
        S[:] = self._look(batch, np.arange(len(start)), start).motions
        for k in range(1, int(steps.max()) + 1):
            going = np.flatnonzero(reached & (steps >= k))
            if not len(going):
                break
            share = (k / steps[going])[:, None]
            wanted = np.where(share == 1.0, targets[going], first[going] + share * way[going])
            ahead = S[going] @ (wanted - qpos[going][:, self.driven])[:, :, None]
            predicted = qpos[going] + ahead[:, :, 0]
            predicted[:, self.driven] = wanted
            found, closed, S[going] = self._closed(batch, going, predicted)
            jump = (np.abs(found - qpos[going]) / self._scale)[:, self._others].max(axis=1, initial=0.0)
            inside = ((found >= self._lower) & (found <= self._upper))[:, self._others].all(axis=1)
            good = closed & inside & (jump < JUMP)
            qpos[going[good]] = found[good]
            reached[going[~good]] = False
        return qpos, reached

    def _closed(self, batch: Batch, which: NDArray[np.intp], qpos: Array) -> tuple[Array, NDArray[np.bool_], Array]:
        """Return positions at which the loops are closed, the driven joints as they are, whether they are, and S."""
        qpos, going = qpos.copy(), np.arange(len(qpos))
        closed = np.zeros(len(qpos), dtype=bool)
        S = np.zeros((len(qpos), self.model.nv, len(self.driven)))
        for _ in range(NEWTON):
            seen = self._look(batch, which[going], qpos[going])
            S[going] = seen.motions
            done = np.abs(seen.errors).max(axis=1, initial=0.0) <= CLOSED
            closed[going] = done & (seen.least > SINGULAR)
            going, errors, inverse = going[~done], seen.errors[~done], seen.inverse[~done]
            if not len(going):
                break
            step = -(inverse @ errors[:, :, None])[:, :, 0] * self._scale[self._others]
            qpos[np.ix_(going, self._others)] += np.clip(step, -JUMP * self.size, JUMP * self.size)
        return qpos, closed, S

    def _look(self, batch: Batch, which: NDArray[np.intp], qpos: Array) -> _Seen:
        """Compute what Newton steps take of some simulations of a batch at positions of shape (which, nq)."""
        at = Kinematics.of(batch)
        batch.bind("qpos")[which] = qpos
        _forward(batch, which)
        at = Kinematics(*(field[which] for field in at))
        J = self.jacobian(at)
        u, values, directions = np.linalg.svd(J[:, :, self._others], full_matrices=False)
        least = values[:, -1] if len(self._others) else np.ones(len(J))
        if J.shape[1] < len(self._others):
            least = np.zeros(len(J))
        most = values.max(axis=1, initial=0.0)[:, None]
        gains = np.where(values > RANK * most, 1.0 / np.where(values > RANK * most, values, 1.0), 0.0)
        inverse = directions.transpose(0, 2, 1) @ (gains[:, :, None] * u.transpose(0, 2, 1))
        return _Seen(self.errors(at), inverse, least, self._followed(J, inverse))


class _Seen(NamedTuple):
    errors: Array
    """Shape (batch, constraints)."""
    inverse: Array
    """Of the passive joints' Jacobian, shape (batch, passive, constraints)."""
    least: Array
    """Its least singular value, shape (batch,)."""
    motions: Array
    """S, shape (batch, nv, driven)."""


def _inverse(matrices: Array) -> Array:
    """Return pseudo-inverses, shape (batch, columns, rows)."""
    return np.asarray(np.linalg.pinv(matrices, rcond=RANK), dtype=np.float64)


def joint_inertia(M: Array, S: Array) -> Array:
    """Return Sᵀ M S, shape (batch, driven, driven): the inertia that the driven joints feel."""
    return np.asarray(S.transpose(0, 2, 1) @ M @ S)


def _forward(batch: Batch, which: NDArray[np.intp]) -> None:
    try:
        batch.forward(which.astype(np.int32), stage=int(mujoco.mjtStage.mjSTAGE_POS))
    except SimulationError:  # what is computed before a failure is of no account
        return


def _sum(chosen: NDArray[np.bool_], vectors: Array) -> Array:
    """Return for each row of ``chosen`` the sum of the vectors that it names, shape (batch, rows, 3)."""
    return np.asarray(np.where(chosen[None, :, :, None], vectors[:, None], 0.0).sum(axis=2))


def _ancestors(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Return which joints carry each body, shape (bodies, nv)."""
    carries = np.zeros((model.nbody, model.nv), dtype=bool)
    for body in range(1, model.nbody):
        carries[body] = carries[model.body_parentid[body]]
        first = int(model.body_dofadr[body])
        if first >= 0:
            carries[body, first : first + int(model.body_dofnum[body])] = True
    return carries
