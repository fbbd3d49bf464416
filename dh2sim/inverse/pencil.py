"""Elimination of all unknowns but one from the loop equations, as a matrix pencil: its eigenvalues are the solutions.

See ``docs/inverse.md``. What the axis of a joint, or the centre of a wrist, looks like from both ways round the ring
gives equations that are linear in products of one factor, (1, cos q, sin q) or (1, d, d²), for each joint. Their
coefficients come from sampling at three values a joint. Sources: M. Raghavan, B. Roth, Inverse kinematics of the
general 6R manipulator and related linkages, J. Mechanical Design 115(3), 1993; D. Manocha, J. F. Canny, Efficient
inverse kinematics for general 6R manipulators, IEEE Trans. Robotics and Automation 10(5), 1994.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np

from dh2sim.inverse.eigenpairs import are_double, eigenpairs, shared, taken_apart
from dh2sim.inverse.loop import Candidates, Indices, Loop, inverse_poses, joint_motion, loop_order
from dh2sim.inverse.spherical import spherical_angles
from dh2sim.typing import Array

_GATE = 0.15
"""Imaginary part of half an angle up to which an eigenvalue may be a real solution that rounding has moved."""
_ZERO = 1e-11
"""Singular values below this share of the largest are zero."""
_UNDETERMINED = 1e8
"""Condition above which the joints that are eliminated linearly cannot be told from the others."""
_MEET = 1e-9
"""Axes that pass each other no farther than that, in lengths of the arm, meet."""
_THIRDS: Array = 2.0 * np.pi / 3.0 * np.arange(3.0)
_UNITS: Array = np.array([-1.0, 0.0, 1.0])
_HARMONICS = np.stack([np.full(3, 1.0), 2.0 * np.cos(_THIRDS), 2.0 * np.sin(_THIRDS)]) / 3.0
"""From values at 0, 120 and 240 degrees to the coefficients of (1, cos, sin)."""
_POWERS = np.array([[0.0, 1.0, 0.0], [-0.5, 0.0, 0.5], [0.5, -1.0, 0.5]])
"""From values at -1, 0 and 1 to the coefficients of (1, d, d²)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pencil:
    """One way to eliminate: which joint is read first, in which direction, and what is seen from both sides.

    Seen is the axis of the last joint: two joints are then eliminated linearly, two by dialytic elimination, and one
    is the eigenvalue of a pencil of 24 x 24. Or the point where the last three axes meet: one, one, one, and 8 x 8.
    """

    first: int
    backwards: bool
    wrist: bool
    hidden: int
    """Which of the joints left by linear elimination is the eigenvalue, counted from the first of them."""
    rank: int
    """Of the equations in the joints that are eliminated linearly: 8 and 2, or less where the arm is special."""
    phases: Array = field(repr=False)
    """Where half-angle tangents are measured from, rad, shape (6,): random, so that no solution is at infinity."""
    mixing: Array = field(repr=False)
    """Random weights that combine surplus equations, shape (12, 28)."""
    motions: tuple[Array, ...] = field(repr=False)
    """Each joint at its three sampled coordinates, those eliminated linearly moving back, shape (3, 4, 4)."""
    bases: tuple[Array, Array] = field(repr=False)
    """From samples to coefficients: of products of (1, cos, sin) or (1, d, d²) for the joints eliminated linearly,
    and of powers of half-angle tangents for the others."""

    def candidates(self, loop: Loop) -> Candidates:
        """Return configurations near all solutions of N poses, and some that are none."""
        ring = loop.variant(self.first, backwards=self.backwards)
        ends = self._ends(ring)
        right = self._right_side(ring, ends[1])
        C = self._matrices(ring, ends[0], right)
        with np.errstate(all="ignore"):
            t, v, large, rounding = eigenpairs(C)
            half = np.arctan(t)
        double, groups = are_double(half), shared(C, half, rounding)
        double[groups[0]] = True
        blurred = np.flatnonzero(large | double | (right.condition(self.rank) > _UNDETERMINED))
        largest = np.take_along_axis(v, np.abs(v).argmax(1)[:, None], 1)[:, 0]
        poses, k = np.nonzero((np.abs(half.imag) < _GATE) & (np.abs(largest) > 0.0))
        # rounding may have split a double root into a pair: begin on both sides of it
        angles, v = half[poses, k].real + half[poses, k].imag, (v[poses, :, k] / largest[poses, k, None]).real
        more = taken_apart(C, *groups)
        poses, angles, v = (np.concatenate(pair) for pair in zip((poses, angles, v), more, strict=True))
        psi = [angles, *_ratios(v.reshape(len(v), 4, v.shape[1] // 4))]
        q = np.full((len(poses), 6), np.nan)
        for joint, angle in zip(self._left, psi, strict=False):
            q[:, joint] = self._coordinate(ring, joint, angle)
        with np.errstate(all="ignore"):
            pose, q = self._completed(ring, ends[0], right, poses, q)
        sane = np.isfinite(q).all(axis=1) & (np.abs(q).max(axis=1, initial=0.0) < 1e6)
        pose, q = pose[sane], q[sane]
        ordered = np.empty_like(q)
        ordered[:, loop_order(self.first, backwards=self.backwards)] = -q if self.backwards else q
        return Candidates(pose=pose, q=ordered, blurred=blurred)

    def condition(self, loop: Loop) -> Array:
        """Return the condition numbers of the matrices that are divided by, shape (N,): huge if singular."""
        ring = loop.variant(self.first, backwards=self.backwards)
        ends = self._ends(ring)
        right = self._right_side(ring, ends[1])
        values = np.linalg.svd(self._matrices(ring, ends[0], right)[2], compute_uv=False)
        return np.maximum(_quotient(values[:, 0], values[:, -1]), right.condition(self.rank))

    @property
    def _linear(self) -> tuple[int, ...]:
        """The joints that are eliminated linearly, in the order in which the axis is seen through them."""
        return (0,) if self.wrist else (0, 1)

    @property
    def _left(self) -> tuple[int, ...]:
        """The other joints: the hidden one, the one whose powers are shifted, and the rest."""
        joints = (1, 2) if self.wrist else (2, 3, 4)
        return (joints[self.hidden], *(joint for joint in joints if joint != joints[self.hidden]))

    def _coordinate(self, ring: Loop, joint: int, psi: Array) -> Array:
        """Return a joint's coordinate for the angle psi, whose tangent is the unknown."""
        phase = float(self.phases[joint])
        return phase + 2.0 * psi if ring.turns[joint] else np.asarray(np.tan(phase + psi))

    def _ends(self, ring: Loop) -> tuple[Array, Array]:
        """Return what is seen, from the link before the last joints and from the link behind: shape (N, 4, c)."""
        behind = inverse_poses(ring.links[5])
        if not self.wrist:
            line = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 1.0], [1.0, 0.0]])  # a point of z, and its direction
            return ring.links[4] @ line, behind @ line
        centres = [np.stack([0.0 * h, 0.0 * h, h, 1.0 + 0.0 * h], axis=-1)[..., None] for h in wrist_centre(ring)]
        return ring.links[2] @ centres[0], behind @ centres[1]

    def _right_side(self, ring: Loop, seen: Array) -> _RightSide:
        """Return the equations' coefficients of products of the joints that are eliminated linearly."""
        for joint in self._linear:
            seen = _stacked(inverse_poses(ring.links[joint]), _sampled(self.motions[joint], seen))
        values = _numbers(seen)
        terms = values.reshape(*values.shape[:2], -1) @ self.bases[0]
        U, S, Vt = np.linalg.svd(terms[:, :, 1:])
        inverse = np.zeros_like(S)
        np.divide(1.0, S, out=inverse, where=_ZERO * S[:, :1] < S)
        size = S.shape[1]
        return _RightSide(
            constant=terms[:, :, 0],
            null=np.swapaxes(U[:, :, self.rank :], 1, 2),
            pseudo_inverse=np.swapaxes(Vt, 1, 2) * inverse[:, None, :] @ np.swapaxes(U[:, :, :size], 1, 2),
            values=S,
        )

    def _matrices(self, ring: Loop, seen: Array, right: _RightSide) -> Array:
        """Return the coefficients of 1, t, t² of the square matrix that is singular at solutions, (3, N, s, s)."""
        joints = sorted(self._left)
        for joint in reversed(joints):
            seen = _sampled(self.motions[joint], seen)
            if joint != joints[0]:
                seen = _stacked(ring.links[joint - 1], seen)
        values = _numbers(seen)
        values = values.reshape(*values.shape[:2], -1) - right.constant[:, :, None]
        reduced = right.null @ (values @ self.bases[1])
        count, rows = reduced.shape[:2]
        reduced = reduced.reshape(count, rows, *[3] * len(joints))
        reduced = np.moveaxis(reduced, 2 + self.hidden, 0).reshape(3, count, rows, 3, -1)
        shifted = np.zeros((3, count, 2, rows, 4, reduced.shape[-1]))
        shifted[:, :, 0, :, :3], shifted[:, :, 1, :, 1:] = reduced, reduced
        square = shifted.reshape(3, count, 2 * rows, -1)
        size = square.shape[-1]
        return square if 2 * rows == size else self.mixing[:size, : 2 * rows] @ square

    def _completed(
        self, ring: Loop, seen: Array, right: _RightSide, pose: Indices, q: Array
    ) -> tuple[Indices, Array]:
        """Return the candidates with the coordinates of all joints, given those on the left."""
        links = [K if len(K) == 1 else K[pose] for K in ring.links]
        seen = seen if len(seen) == 1 else seen[pose]
        joints = sorted(self._left)
        motions = {joint: joint_motion(ring.turns[joint], q[:, joint]) for joint in joints}
        for joint in reversed(joints):
            seen = motions[joint] @ seen
            if joint != joints[0]:
                seen = links[joint - 1] @ seen
        constant, inverse = (x if len(x) == 1 else x[pose] for x in (right.constant, right.pseudo_inverse))
        products = (inverse @ (_numbers(seen[:, None])[:, :, 0] - constant)[:, :, None])[:, :, 0]
        step = 1
        for joint in self._linear:  # products of (1, cos, sin): the first joint's alone come first
            if ring.turns[joint]:
                q[:, joint] = np.arctan2(products[:, 2 * step - 1], products[:, step - 1])
            else:
                q[:, joint] = products[:, step - 1]
            motions[joint] = joint_motion(ring.turns[joint], q[:, joint])
            step *= 3
        known = 3 if self.wrist else 5
        before = reduce(np.matmul, (motions[joint] @ links[joint] for joint in range(known)))
        left = inverse_poses(links[5] @ before)
        if not self.wrist:
            q[:, 5] = np.arctan2(left[:, 1, 0] - left[:, 0, 1], left[:, 0, 0] + left[:, 1, 1])
            return pose, q
        A, B = (np.broadcast_to(links[i][:, :3, :3], (len(pose), 3, 3)) for i in (3, 4))
        which, angles = spherical_angles(A, B, left[:, :3, :3])
        q = q[which]
        q[:, 3:] = angles
        return pose[which], q


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _RightSide:
    """Coefficients Q of the products of linearly eliminated joints, one row an equation."""

    constant: Array
    """Of the product 1, shape (N, rows)."""
    null: Array
    """What is orthogonal to the other columns, shape (N, rows - rank, rows)."""
    pseudo_inverse: Array
    """Of the other columns, shape (N, columns, rows)."""
    values: Array
    """Their singular values, shape (N, columns)."""

    @property
    def rank(self) -> int:
        """Greatest rank of all poses."""
        return int((self.values > _ZERO * self.values[:, :1]).sum(axis=1).max())

    def condition(self, rank: int) -> Array:
        """Return the condition numbers of coefficients of this rank, shape (N,): huge where it is less."""
        return _quotient(self.values[:, 0], self.values[:, rank - 1])


def build_pencil(
    loop: Loop, first: int, *, backwards: bool, wrist: bool, hidden: int, rng: np.random.Generator
) -> Pencil | None:
    """Return a pencil, or None where it cannot be used.

    Args:
        loop: The ring, for some poses.
        first: The joint that is read first.
        backwards: Whether the ring is read against the arrow.
        wrist: Whether the last three joints are a wrist; otherwise the last joint must turn.
        hidden: 0, 1 or (without a wrist) 2.
        rng: For phases and mixing.
    """
    ring = loop.variant(first, backwards=backwards)
    if (wrist and not (all(ring.turns[3:]) and is_wrist(ring))) or not ring.turns[5]:
        return None
    phases, mixing = rng.uniform(-np.pi, np.pi, 6), np.linalg.qr(rng.normal(size=(28, 12)))[0].T

    linear, others = ((0,), (1, 2)) if wrist else ((0, 1), (2, 3, 4))
    motions = []
    for joint, turns in enumerate(ring.turns):
        start = 0.0 if joint in linear else float(phases[joint])
        sampled = joint_motion(turns, start + _THIRDS if turns else _UNITS)
        motions.append(inverse_poses(sampled) if joint in linear else sampled)
    full, rows, size = (2, 4, 4) if wrist else (8, 14, 12)
    pencil = Pencil(
        first=first,
        backwards=backwards,
        wrist=wrist,
        hidden=hidden,
        rank=full,
        phases=phases,
        mixing=mixing,
        motions=tuple(motions),
        bases=(
            _kronecker([_HARMONICS if ring.turns[joint] else _POWERS for joint in reversed(linear)]).T,
            _kronecker([_in_half_tangents(ring.turns[joint], float(phases[joint])) for joint in others]).T,
        ),
    )
    rank = pencil._right_side(ring, pencil._ends(ring)[1]).rank
    return replace(pencil, rank=rank) if 2 * (rows - rank) >= size else None


def wrist_centre(ring: Loop) -> tuple[Array, Array]:
    """Return how high on its axis the fourth joint's, and the sixth's, is nearest to the fifth's, shape (N,) each."""
    return _feet(ring.links[3])[0], _feet(ring.links[4])[1]


def is_wrist(ring: Loop) -> bool:
    """Whether the last three axes of a ring meet in a point, for all its poses."""
    distances, heights = [], []
    for i, K in enumerate(ring.links[3:5]):
        if float(np.hypot(K[:, 0, 2], K[:, 1, 2]).min()) < 1e-6:  # parallel
            return False
        feet = _feet(K)
        heights.append(feet[1 - i])
        distances.append(np.abs(K[:, 0, 3] * K[:, 1, 2] - K[:, 1, 3] * K[:, 0, 2]) / np.hypot(K[:, 0, 2], K[:, 1, 2]))
    apart = np.abs(heights[0] - heights[1])
    return bool(max(float(x.max()) for x in (*distances, apart)) < _MEET)


def _feet(K: Array) -> tuple[Array, Array]:
    """Return where two axes are nearest: how high on z, and on the axis of the next joint; shape (N,) each."""
    px, py, pz = K[:, 0, 3], K[:, 1, 3], K[:, 2, 3]
    lx, ly, lz = K[:, 0, 2], K[:, 1, 2], K[:, 2, 2]
    along = -(px * lx + py * ly) / (lx * lx + ly * ly)
    return pz + along * lz, along


def _sampled(motions: Array, seen: Array) -> Array:
    """Move what is seen by three motions, shape (3, 4, 4); they make a new axis behind that of the poses."""
    extra = seen.ndim - 3
    return motions.reshape(3, *[1] * extra, 4, 4) @ seen[:, None]


def _stacked(links: Array, seen: Array) -> Array:
    """Move what is seen by the link of each pose, shape (N, 4, 4)."""
    return links.reshape(len(links), *[1] * (seen.ndim - 3), 4, 4) @ seen


def _numbers(seen: Array) -> Array:
    """Return what transforms linearly under motions, of a point or of a line with a point on it.

    The point's are p and p·p. The line's besides, with its direction d, are d, p x d, p·d and (p·p) d - 2 (p·d) p.

    Args:
        seen: Homogeneous points, and directions, in columns, shape (N, ..., 4, c).

    Returns:
        Shape (N, 4 or 14, ...).
    """
    p = np.moveaxis(seen[..., :3, 0], -1, 0)
    pp = (p * p).sum(axis=0)
    if seen.shape[-1] == 1:
        return np.asarray(np.moveaxis(np.stack([*p, pp]), 0, 1))
    d = np.moveaxis(seen[..., :3, 1], -1, 0)
    pd = (p * d).sum(axis=0)
    moment = (p[1] * d[2] - p[2] * d[1], p[2] * d[0] - p[0] * d[2], p[0] * d[1] - p[1] * d[0])
    return np.asarray(np.moveaxis(np.stack([*d, *moment, pd, *(pp * d - 2.0 * pd * p), *p, pp]), 0, 1))


def _kronecker(matrices: Sequence[Array]) -> Array:
    """Return what the matrices do to a tensor, one to each of its axes, as one matrix for the flattened tensor."""
    return reduce(lambda left, right: np.asarray(np.kron(left, right), dtype=np.float64), matrices)


def _in_half_tangents(turns: bool, phase: float) -> Array:
    """Return the matrix from three samples to the coefficients of 1, t, t², with a common denominator left out.

    A turn is q = phase + 2 atan t, and a slide d = tan(phase + atan t): both a projective line, entered at random.
    """
    if turns:
        matrix = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0], [1.0, -1.0, 0.0]]) @ _HARMONICS
    else:
        c, s = np.cos(phase), np.sin(phase)
        rows = [[c * c, s * c, s * s], [-2.0 * s * c, c * c - s * s, 2.0 * s * c], [s * s, -s * c, c * c]]
        matrix = np.array(rows) @ _POWERS
    return np.asarray(matrix)


def _quotient(large: Array, small: Array) -> Array:
    """Return quotients of singular values, huge where the small ones are zero."""
    return np.asarray(large / np.maximum(small, 1e-300 + 1e-300 * large))


def _ratios(v: Array) -> list[Array]:
    """Return the angles whose tangents are ratios of neighbours in vectors of products t_4^i t_5^j, (M, 4, 1 or 3).

    All neighbours count, the larger the more.
    """
    pairs = [(v[:, :3], v[:, 1:])] + ([(v[:, :, :2], v[:, :, 1:])] if v.shape[2] > 1 else [])
    angles = []
    for low, high in pairs:
        a, b, c = (low * low).sum((1, 2)), (low * high).sum((1, 2)), (high * high).sum((1, 2))
        angles.append(np.where(a >= c, np.arctan2(b, a), np.arctan2(c, b)))
    return angles
