"""Closing the loops of a mechanism: what its closures require of a configuration, and Gauss-Newton steps to it.

A closure between frames a and b is seen in frame a: its residual is how far b is from where the joint lets it be, and
its Jacobian has a row for each constraint, the components of b's twist relative to a that the joint forbids. Both are
in Python's own arithmetic, so that an assembly is the same bits on every machine.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from operator import mul
from typing import Final, NamedTuple

from numpy.typing import ArrayLike

from dh2sim.errors import AssemblyError
from dh2sim.kinematics.transforms import compose, invert
from dh2sim.kinematics.tree import BASE, Closure, KinematicTree, body_poses, build_tree, joint_values, placed
from dh2sim.kinematics.trig import atan2
from dh2sim.messages import listed
from dh2sim.robot.mechanism import ClosureType
from dh2sim.robot.spec import RobotSpec, SpecLike, spec_of
from dh2sim.typing import Array, read_only

TOLERANCE: Final = 1e-12
"""Of closed loops: m for mechanisms up to 1 m, then of their size; and rad."""
_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
POSITIONS: Final = {
    ClosureType.CYLINDRICAL: (0, 1),
    ClosureType.PRISMATIC: (0, 1),
}
"""Coordinates of b's origin in frame a that must be zero, where that is not all three."""
FREEDOMS: Final = {
    ClosureType.REVOLUTE: 1,
    ClosureType.SPHERICAL: 3,
    ClosureType.UNIVERSAL: 2,
    ClosureType.CYLINDRICAL: 2,
    ClosureType.PRISMATIC: 1,
    ClosureType.FIXED: 0,
}
"""Of the joints that close loops; each has 6 less as many constraints."""
Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosureGap:
    """How far a closure is from being closed."""

    name: str
    position: float
    """m"""
    rotation: float
    """rad"""

    def __str__(self) -> str:
        """Return what of the closure is open, in mm and deg."""
        position, rotation = (0.0 if value < TOLERANCE else value for value in (self.position, self.rotation))
        gap = f"{1000 * position:.6g} mm and {math.degrees(rotation):.6g} deg"
        opposite = "; its z axes are opposite: turn one frame with 'alpha: 180 deg'"
        return f"{self.name} stays open by {gap}{opposite if self.opposite else ''}"

    @property
    def opposite(self) -> bool:
        """Whether the frames only have to be turned over."""
        return self.position < 1e-6 and abs(self.rotation - math.pi) < 1e-6


class _Rows(NamedTuple):
    """The constraints of one closure: a residual, m or rad, and a row of the Jacobian for each."""

    positions: list[float]
    position_rows: list[list[float]]
    rotations: list[float]
    rotation_rows: list[list[float]]


def closure_gaps(tree: KinematicTree, q: ArrayLike) -> tuple[ClosureGap, ...]:
    """Return how far each closure is from being closed.

    Args:
        tree: The mechanism.
        q: Joint vector, rad and m, shape (n,).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    return tuple(
        ClosureGap(name=closure.name, position=_norm(rows.positions), rotation=_norm(rows.rotations))
        for closure, rows in zip(tree.closures, _closure_rows(tree, q), strict=True)
    )


def constraint_jacobian(tree: KinematicTree, q: ArrayLike) -> Array:
    """Return the Jacobian of the closures' constraints: what it takes from joint velocities is what they forbid.

    Args:
        tree: The mechanism.
        q: Joint vector, rad and m, shape (n,), at which the loops are closed.

    Returns:
        Shape (sum of 6 - freedoms of the closures, n): for each closure the components of its frame b's velocity
        relative to frame a, along the axes of a, that its joint forbids, m/s first, then rad/s.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    rows = [row for of in _closure_rows(tree, q) for row in (*of.position_rows, *of.rotation_rows)]
    return read_only(rows).reshape(len(rows), tree.n)


def _closure_rows(tree: KinematicTree, q: ArrayLike) -> Iterator[_Rows]:
    poses = body_poses(tree, q)
    for closure in tree.closures:
        yield _rows_of(tree, closure, poses)


def _rows_of(tree: KinematicTree, closure: Closure, poses: Sequence[Array]) -> _Rows:
    """Return the residual and the Jacobian of a closure, given the poses of the bodies."""
    a, b = tree.frame(closure.a), tree.frame(closure.b)
    T_a_base = invert(placed(poses, a))
    T_a_b = compose(T_a_base, placed(poses, b)).tolist()
    origin: Vector = (T_a_b[0][3], T_a_b[1][3], T_a_b[2][3])
    rotations, axes = _rotation_residual(closure.type, [row[:3] for row in T_a_b[:3]])
    kept = POSITIONS.get(closure.type, (0, 1, 2))
    position_rows = [[0.0] * tree.n for _ in kept]
    rotation_rows = [[0.0] * tree.n for _ in axes]
    for body, side in _loop(tree, a.body, b.body):
        joint, column = tree.joints[body], tree.coordinates[body]
        if column < 0:
            continue
        T_a_joint = compose(T_a_base, poses[body]).tolist()
        sign = side * joint.sign
        z = (sign * T_a_joint[0][2], sign * T_a_joint[1][2], sign * T_a_joint[2][2])
        velocity = z
        if joint.type.turns:
            arm = [origin[k] - T_a_joint[k][3] for k in range(3)]
            velocity = _cross(z, (arm[0], arm[1], arm[2]))
            for row, axis in zip(rotation_rows, axes, strict=True):
                row[column] = _dot(axis, z)
        for row, k in zip(position_rows, kept, strict=True):
            row[column] = velocity[k]
    return _Rows([origin[k] for k in kept], position_rows, rotations, rotation_rows)


def _loop(tree: KinematicTree, a: int, b: int) -> Iterator[tuple[int, float]]:
    """Yield the joints that move bodies a and b against each other, with +1 for those that carry b."""
    to_a, to_b = tree.path(a), tree.path(b)
    yield from ((body, -1.0) for body in to_a if body not in to_b)
    yield from ((body, 1.0) for body in to_b if body not in to_a)


def _rotation_residual(kind: ClosureType, R: list[list[float]]) -> tuple[list[float], list[Vector]]:
    """Return how far a rotation is from one that a joint allows, rad, and the axes in a that it is measured about."""
    zb = (R[0][2], R[1][2], R[2][2])
    match kind:
        case ClosureType.SPHERICAL:
            return [], []
        case ClosureType.UNIVERSAL:  # the angle between the axes, less a right one
            sine = math.sqrt(zb[0] * zb[0] + zb[1] * zb[1])
            if sine == 0.0:
                return [atan2(zb[2], sine)], [_X]
            return [atan2(zb[2], sine)], [(zb[1] / sine, -zb[0] / sine, 0.0)]
        case ClosureType.REVOLUTE | ClosureType.CYLINDRICAL:  # the least rotation that turns one axis into the other
            sine = math.sqrt(zb[0] * zb[0] + zb[1] * zb[1])
            angle = atan2(sine, zb[2])
            if sine == 0.0:
                return [angle, 0.0], [_X, _Y]
            return [-zb[1] / sine * angle, zb[0] / sine * angle], [_X, _Y]
        case ClosureType.PRISMATIC | ClosureType.FIXED:
            return list(_rotation_vector(R)), [_X, _Y, _Z]


def _rotation_vector(R: list[list[float]]) -> Vector:
    """Return the axis of a rotation times its angle, rad in [0, pi]."""
    x, y, z = ((R[2][1] - R[1][2]) / 2, (R[0][2] - R[2][0]) / 2, (R[1][0] - R[0][1]) / 2)
    sine, cosine = math.sqrt(x * x + y * y + z * z), (R[0][0] + R[1][1] + R[2][2] - 1) / 2
    if sine > 1e-8 or cosine > 0:
        factor = atan2(sine, cosine) / sine if sine else 1.0
        return (factor * x, factor * y, factor * z)
    k = max(range(3), key=lambda i: R[i][i])  # half a turn: R + I is twice the axis times its transpose
    column = [R[i][k] + (i == k) for i in range(3)]
    factor = math.pi / _norm(column)
    return (factor * column[0], factor * column[1], factor * column[2])


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _norm(values: Iterable[float]) -> float:
    return math.sqrt(math.fsum(value * value for value in values))


def mechanism_size(tree: KinematicTree) -> float:
    """Return the greatest length of a chain from base_link, m, its slides at zero; 1 where it is nothing."""
    lengths: list[float] = []
    for joint, parent in zip(tree.joints, tree.parents, strict=True):
        lengths.append((0.0 if parent == BASE else lengths[parent]) + _norm(joint.T_parent_joint[:3, 3].tolist()))
    ends = [
        (0.0 if body == BASE else lengths[body]) + _norm(T_body_frame[:3, 3].tolist())
        for body, T_body_frame in tree.frames.values()
    ]
    return max(ends) or 1.0


_DAMPING: Final = 1e-10
"""Least damping, of the mean square of the Jacobian's rows: constraints of loops are often redundant."""
_MOST_DAMPING: Final = 1e8
_ITERATIONS: Final = 200
_LONGEST_STEP: Final = 0.5
"""rad, and mechanism sizes."""
_TRIALS: Final = 12
"""Of configurations near the guess, or anywhere where none is given, that loops are closed from."""


def close_loops(tree: KinematicTree, guess: ArrayLike) -> Array:
    """Return a configuration near a guess at which all loops are closed, the same bits on every machine.

    Levenberg's damped Gauss-Newton steps on the residuals of the closures: K. Levenberg, A method for the solution of
    certain non-linear problems in least squares, Quarterly of Applied Mathematics 2(2), 1944.

    Args:
        tree: The mechanism.
        guess: Joint vector, rad and m, shape (n,).

    Returns:
        Shape (n,), read-only: every gap is at most ``TOLERANCE``.

    Raises:
        AssemblyError: The steps lead to no such configuration; the text says which closures stay open.
        ConfigurationError: ``guess`` has the wrong shape or is not finite.
    """
    q, closed = _descend(tree, joint_values(tree, guess))
    if not closed:
        limit = _tolerance(tree)
        gaps = [gap for gap in closure_gaps(tree, q) if gap.position > limit or gap.rotation > TOLERANCE]
        raise AssemblyError(f"the loops cannot be closed: {listed(map(str, gaps), '; ')}")
    return read_only(q)


def _tolerance(tree: KinematicTree) -> float:
    return TOLERANCE * max(1.0, mechanism_size(tree))


def is_closed(tree: KinematicTree, q: ArrayLike) -> bool:
    """Whether all loops are closed at a configuration."""
    limit = _tolerance(tree)
    return all(gap.position <= limit and gap.rotation <= TOLERANCE for gap in closure_gaps(tree, q))


def _descend(tree: KinematicTree, q: list[float]) -> tuple[list[float], bool]:
    """Return where damped Gauss-Newton steps lead to, and whether the loops are closed there."""
    size = mechanism_size(tree)
    scale = [1.0 if joint.type.turns else size for joint in tree.moving_joints]
    residual, jacobian = _scaled(tree, q, size, scale)
    error, damping, polished = _norm(residual), 1e-4, 0
    for _ in range(_ITERATIONS):
        closed = is_closed(tree, q)
        if error == 0.0 or polished == 2 or damping > _MOST_DAMPING:
            break
        step = _step(residual, jacobian, damping)
        longest = max(map(abs, step), default=0.0)
        factor = min(1.0, _LONGEST_STEP / longest) if longest else 1.0
        trial = [x + factor * s * k for x, s, k in zip(q, step, scale, strict=True)]
        tried = _scaled(tree, trial, size, scale)
        polished += closed
        if _norm(tried[0]) < error:
            q, (residual, jacobian) = trial, tried
            error, damping = _norm(residual), max(damping / 10, _DAMPING)
        elif not closed:
            damping *= 10
    return q, is_closed(tree, q)


def _scaled(
    tree: KinematicTree, q: Sequence[float], size: float, scale: Sequence[float]
) -> tuple[list[float], list[list[float]]]:
    """Return the residuals and their Jacobian with lengths in mechanism sizes."""
    residual: list[float] = []
    jacobian: list[list[float]] = []
    for rows in _closure_rows(tree, q):
        residual += [value / size for value in rows.positions] + rows.rotations
        jacobian += [[x * s / size for x, s in zip(row, scale, strict=True)] for row in rows.position_rows]
        jacobian += [[x * s for x, s in zip(row, scale, strict=True)] for row in rows.rotation_rows]
    return residual, jacobian


def _step(residual: Sequence[float], jacobian: Sequence[Sequence[float]], damping: float) -> list[float]:
    """Return -Jᵀ (J Jᵀ + damping I)⁻¹ e, the damping in units of the mean square of a row."""
    gram = [[math.fsum(map(mul, row, other)) for other in jacobian[: k + 1]] for k, row in enumerate(jacobian)]
    mean = math.fsum(gram[k][k] for k in range(len(gram))) / len(gram) or 1.0
    for k, row in enumerate(gram):
        row[k] += damping * mean
    y = _solve(gram, residual)
    columns = zip(*jacobian, strict=True)
    return [-math.fsum(map(mul, column, y)) for column in columns]


def _solve(lower: list[list[float]], right: Sequence[float]) -> list[float]:
    """Solve a positive definite system, given the lower half of its matrix, by Cholesky's decomposition."""
    count = len(lower)
    factor: list[list[float]] = []
    y: list[float] = []
    for i, row in enumerate(lower):
        new: list[float] = []
        for j in range(i):
            new.append((row[j] - math.fsum(map(mul, new, factor[j]))) / factor[j][j])
        new.append(math.sqrt(max(row[i] - math.fsum(map(mul, new, new)), 1e-300)))
        y.append((right[i] - math.fsum(map(mul, new, y))) / new[i])
        factor.append(new)
    for i in range(count - 1, -1, -1):
        y[i] = (y[i] - math.fsum(factor[k][i] * y[k] for k in range(i + 1, count))) / factor[i][i]
    return y


@functools.lru_cache(maxsize=16)
def _assembled(spec: RobotSpec) -> tuple[KinematicTree, Array]:
    tree = build_tree(spec)
    guess = joint_values(tree, spec.named_configurations["home"] if spec.assembly is None else spec.assembly.q)
    if not tree.closures:
        return tree, read_only(guess)
    place = f"{spec.name}: " if spec.assembly is None else f"{spec.assembly.location or 'assembly.q'}: "
    failures: list[str] = []
    for start in _starts(tree, guess, anywhere=spec.assembly is None):
        try:
            q = close_loops(tree, start)
        except AssemblyError as error:
            failures.append(str(error))
            continue
        if outside := _outside_limits(spec, q):
            failures.append(f"where the loops are closed, {outside}")
            continue
        return tree, q
    hint = "; give an assembly: a guess near which they can be" if spec.assembly is None else ""
    raise AssemblyError(f"{place}{failures[0]}{hint}")


def _outside_limits(spec: RobotSpec, q: Array) -> str:
    """Return which joint is outside of its limits, or the empty string."""
    for row, value in zip(spec.moving_rows, q.tolist(), strict=True):
        lower, upper = row.limits.position or (-math.inf, math.inf)
        if not lower <= value <= upper:
            at, low, high = (math.degrees(x) if row.type.turns else x for x in (value, lower, upper))
            unit = "deg" if row.type.turns else "m"
            return f"{row.name} is at {at:.6g} {unit}, outside its limits of {low:.6g} to {high:.6g} {unit}"
    return ""


def _starts(tree: KinematicTree, guess: Sequence[float], *, anywhere: bool) -> Iterator[list[float]]:
    """Yield a guess and configurations near it, or all over the joints' ranges, in a fixed order."""
    yield list(guess)
    size = mechanism_size(tree)
    for trial in range(1, _TRIALS):
        spread = math.pi if anywhere else 0.02 * trial
        start = []
        for k, (value, joint) in enumerate(zip(guess, tree.moving_joints, strict=True)):
            fraction = (trial * 0.618033988749895 + k * 0.7548776662466927) % 1.0  # spread evenly
            start.append(value + spread * (1.0 if joint.type.turns else size) * (2.0 * fraction - 1.0))
        yield start


def assembly(robot: SpecLike) -> tuple[KinematicTree, Array]:
    """Return the tree of a robot and a configuration at which its loops are closed.

    Args:
        robot: The robot. Its loops are closed from its ``assembly``, or from ``home``.

    Returns:
        The tree, and the joint vector, rad and m, shape (n,), read-only; ``home`` for a robot without closures.

    Raises:
        AssemblyError: The loops cannot be closed from there; the text says which closures stay open, and by how much.
    """
    return _assembled(spec_of(robot))
