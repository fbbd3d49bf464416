"""Closed loops at many configurations at once: their constraints, and Newton's method back onto them.

The constraints are those of ``loop_closure``, in NumPy: for searches, where bits do not matter but thousands of
configurations do. Lengths are in sizes of the mechanism, and so are the coordinates of joints that slide.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dh2sim.kinematics.loop_closure import POSITIONS, TOLERANCE, mechanism_size
from dh2sim.kinematics.rotations import rotation_vectors
from dh2sim.kinematics.tree import BASE, Closure, Frame, KinematicTree
from dh2sim.robot.mechanism import ClosureType
from dh2sim.typing import Array

_BLOCK: Final = 2048
"""Configurations that are computed together."""
_NEWTON: Final = 12
_SETTLED: Final = 1e-14
"""Correction, rad and sizes, after which Newton's method has nothing to add."""
_DAMPING: Final = 1e-14
"""Share of the sum of squared singular values."""


class Closed(NamedTuple):
    """Configurations moved onto the loops."""

    q: Array
    """rad and m, shape (N, n)."""
    ok: NDArray[np.bool_]
    """Whether the loops are closed, shape (N,)."""
    moved: Array
    """The longest correction of a joint, rad and sizes, shape (N,)."""


class LoopBatch:
    """The constraints of a mechanism's loops."""

    def __init__(self, tree: KinematicTree) -> None:
        """Lay them out."""
        self.tree, self.size = tree, mechanism_size(tree)
        self.scale = np.array([1.0 if joint.type.turns else self.size for joint in tree.moving_joints])
        """Unit of each joint coordinate: 1 rad, or the mechanism's size in m, shape (n,)."""
        paths = [[tree.path(tree.frame(name).body) for name in (each.a, each.b)] for each in tree.closures]
        self._loops = [
            [
                *((body, -1.0) for body in to_a if body not in to_b),
                *((body, 1.0) for body in to_b if body not in to_a),
            ]
            for to_a, to_b in paths
        ]

    def poses(self, q: Array) -> list[Array]:
        """Return the poses of all bodies in base_link, shape (N, 4, 4) each, at joint vectors (N, n), rad and m."""
        found: list[Array] = []
        for joint, parent, column in zip(self.tree.joints, self.tree.parents, self.tree.coordinates, strict=True):
            T = joint.T_parent_joint if parent == BASE else found[parent] @ joint.T_parent_joint
            T = np.array(np.broadcast_to(T, (len(q), 4, 4)))
            if column >= 0:
                amount = joint.sign * q[:, column]
                if joint.type.turns:
                    c, s = np.cos(amount)[:, None], np.sin(amount)[:, None]
                    x, y = T[:, :3, 0], T[:, :3, 1]
                    T[:, :3, 0], T[:, :3, 1] = c * x + s * y, c * y - s * x
                else:
                    T[:, :3, 3] += amount[:, None] * T[:, :3, 2]
            found.append(T)
        return found

    def placed(self, poses: Sequence[Array], frame: Frame, count: int) -> Array:
        """Return the poses of a frame, shape (count, 4, 4), given those of the bodies."""
        if frame.body == BASE:
            return np.broadcast_to(frame.T_body_frame, (count, 4, 4))
        return poses[frame.body] @ frame.T_body_frame

    def twists(self, poses: Sequence[Array], frame: Frame, count: int) -> Array:
        """Return the twist of a frame for a unit velocity of each joint, rad and m, shape (count, 6, n)."""
        origin = self.placed(poses, frame, count)[:, :3, 3]
        J = np.zeros((count, 6, self.tree.n))
        for body in self.tree.path(frame.body):
            joint, column = self.tree.joints[body], self.tree.coordinates[body]
            if column >= 0:
                z = joint.sign * poses[body][:, :3, 2]
                J[:, :3, column] = _cross(z, origin - poses[body][:, :3, 3]) if joint.type.turns else z
                J[:, 3:, column] = z if joint.type.turns else 0.0
        return J

    def evaluate(self, q: Array) -> tuple[Array, Array]:
        """Return how far the constraints are from being met, and their Jacobian.

        Args:
            q: Joint vectors, rad and m, shape (N, n).

        Returns:
            Shapes (N, c) and (N, c, n), rad and sizes, for coordinates in units of ``scale``.
        """
        poses, count = self.poses(q), len(q)
        residuals, rows = [np.zeros((count, 0))], [np.zeros((count, 0, self.tree.n))]
        for closure, loop in zip(self.tree.closures, self._loops, strict=True):
            residual, jacobian = self._closure(closure, loop, poses, count)
            residuals.append(residual)
            rows.append(jacobian)
        return np.concatenate(residuals, axis=1), np.concatenate(rows, axis=1)

    def _closure(
        self, closure: Closure, loop: Sequence[tuple[int, float]], poses: Sequence[Array], count: int
    ) -> tuple[Array, Array]:
        a, b = (self.placed(poses, self.tree.frame(name), count) for name in (closure.a, closure.b))
        R_a_base = np.swapaxes(a[:, :3, :3], 1, 2)
        origin = (R_a_base @ (b[:, :3, 3] - a[:, :3, 3])[:, :, None])[:, :, 0]
        angles, axes = _rotation(closure.type, R_a_base @ b[:, :3, :3])
        kept = list(POSITIONS.get(closure.type, (0, 1, 2)))
        turning, moving = np.zeros((count, 3, self.tree.n)), np.zeros((count, 3, self.tree.n))
        for body, side in loop:
            joint, column = self.tree.joints[body], self.tree.coordinates[body]
            if column < 0:
                continue
            z = side * joint.sign * poses[body][:, :3, 2]
            if joint.type.turns:
                moving[:, :, column] = _cross(z, b[:, :3, 3] - poses[body][:, :3, 3]) / self.size
                turning[:, :, column] = z
            else:
                moving[:, :, column] = z
        rows = np.concatenate([(R_a_base @ moving)[:, kept], axes @ (R_a_base @ turning)], axis=1)
        return np.concatenate([origin[:, kept] / self.size, angles], axis=1), rows

    def closed(self, q: Array, held: Sequence[int] = ()) -> Closed:
        """Return configurations moved onto the loops by Newton's method, some joints held.

        Args:
            q: Where to begin, rad and m, shape (N, n).
            held: Columns of the joints that stay.
        """
        parts = [self._closed(q[part], held) for part in blocks(len(q))]
        return Closed(*(np.concatenate(each) for each in zip(*parts, strict=True)))

    def _closed(self, q: Array, held: Sequence[int]) -> Closed:
        free = [k for k in range(self.tree.n) if k not in held]
        found, moved = np.array(q), np.zeros(len(q))
        going, columns = np.arange(len(q)), np.array(free, dtype=np.intp)
        before = np.full(len(q), np.inf)
        for _ in range(_NEWTON if free else 0):
            residual, J = self.evaluate(found[going])
            step = -_shortest(J[:, :, free], residual)
            size = np.abs(step).max(axis=1, initial=0.0)
            step = np.where((size < 1.0)[:, None], step, 0.0)  # one that is lost stays where it is, open
            found[going[:, None], columns] += step * self.scale[free]
            moved[going] += size
            more = (size >= _SETTLED) & (size < 1.0) & ((size >= 1e-11) | (size < 0.5 * before))
            going, before = going[more], size[more]
            if not len(going):
                break
        return Closed(found, self.are_closed(found), moved)

    def are_closed(self, q: Array) -> NDArray[np.bool_]:
        """Return whether all loops are closed at configurations, shape (N,), as ``is_closed`` does for one."""
        residual, _ = self.evaluate(q)
        limits, start = np.ones(len(q), dtype=np.bool_), 0
        for closure in self.tree.closures:
            lengths, angles = len(POSITIONS.get(closure.type, (0, 1, 2))), _ANGLES[closure.type]
            position = np.linalg.norm(residual[:, start : start + lengths], axis=1) * self.size
            rotation = np.linalg.norm(residual[:, start + lengths : start + lengths + angles], axis=1)
            limits &= (position <= TOLERANCE * max(1.0, self.size)) & (rotation <= TOLERANCE)
            start += lengths + angles
        return limits


def blocks(count: int) -> Iterator[slice]:
    """Yield the parts of an array that are computed together; one that is empty of an empty one."""
    yield from (slice(start, start + _BLOCK) for start in range(0, max(count, 1), _BLOCK))


def _shortest(J: Array, right: Array) -> Array:
    """Return the shortest least-squares solutions of J x = right, shape (N, m): good enough for Newton's method.

    Constraints of loops are often redundant, so that the normal equations are damped a little.
    """
    rows, columns = J.shape[1:]
    across = np.swapaxes(J, 1, 2)
    gram = J @ across if rows < columns else across @ J
    damping = _DAMPING * np.trace(gram, axis1=1, axis2=2) + 1e-300
    gram = gram + damping[:, None, None] * np.eye(min(rows, columns))
    if rows < columns:
        return (across @ np.linalg.solve(gram, right[:, :, None]))[:, :, 0]
    return np.linalg.solve(gram, across @ right[:, :, None])[:, :, 0]


_ANGLES: Final = {
    ClosureType.SPHERICAL: 0,
    ClosureType.UNIVERSAL: 1,
    ClosureType.REVOLUTE: 2,
    ClosureType.CYLINDRICAL: 2,
    ClosureType.PRISMATIC: 3,
    ClosureType.FIXED: 3,
}


def _rotation(kind: ClosureType, R: Array) -> tuple[Array, Array]:
    """Return how far rotations (N, 3, 3) are from what a joint allows, and the axes that this is measured about."""
    count, z = len(R), R[:, :, 2]
    fixed = np.broadcast_to(np.eye(3)[: _ANGLES[kind]], (count, _ANGLES[kind], 3))
    sine = np.hypot(z[:, 0], z[:, 1])
    safe = np.where(sine > 0.0, sine, 1.0)
    match kind:
        case ClosureType.SPHERICAL:
            return np.zeros((count, 0)), fixed
        case ClosureType.UNIVERSAL:
            axes = np.stack([z[:, 1] / safe, -z[:, 0] / safe, 0.0 * sine], axis=1)
            axes = np.where(sine[:, None] > 0.0, axes, np.eye(3)[0])
            return np.arctan2(z[:, 2], sine)[:, None], axes[:, None]
        case ClosureType.REVOLUTE | ClosureType.CYLINDRICAL:
            angle = np.arctan2(sine, z[:, 2])
            ways = np.where(sine[:, None] > 0.0, np.stack([-z[:, 1], z[:, 0]], axis=1) / safe[:, None], [1.0, 0.0])
            return ways * angle[:, None], fixed
        case _:
            return rotation_vectors(R), fixed


def _cross(a: Array, b: Array) -> Array:
    return np.stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ],
        axis=1,
    )
