"""Rings with slides for which pencils do not serve: three slides anywhere, and two slides opposite each other.

With three slides the rotations of the three turning joints close by themselves, and the slides follow linearly. With
two slides that have two turning joints between them on both sides, every line pencil is singular, as four turning
joints close a spherical four-bar linkage, which has one freedom left; what fixes it is that no slide moves anything
along the common normal of both. See ``docs/inverse.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from dh2sim.inverse.loop import Candidates, Indices, Loop, joint_motion, loop_order
from dh2sim.inverse.spherical import spherical_angles
from dh2sim.typing import Array

_GATE = 0.3
"""Imaginary part of an angle up to which a root may be a real solution that rounding has moved."""
_NOTHING = 1e-12
"""Share of the largest coefficient below which one is rounding."""
_DEGREE = 8
"""Of the resultant: highest multiple of the angle."""
_SAMPLES = 2 * _DEGREE + 1
_OUTER = np.repeat(2.0 * np.pi / _SAMPLES * np.arange(_SAMPLES), 5)[None]
_INNER = np.tile(2.0 * np.pi / 5.0 * np.arange(5), _SAMPLES)[None]


class ThreeSlides:
    """Three turning joints and three slides, in any order."""

    def candidates(self, loop: Loop) -> Candidates:
        """Return the configurations that close the ring at N poses."""
        turning = [i for i, turns in enumerate(loop.turns) if turns]
        count = len(loop.links[5])
        between = [self._rotation(loop, joint, turning[(k + 1) % 3]) for k, joint in enumerate(turning)]
        A, B, C = (np.broadcast_to(R, (count, 3, 3)) for R in between)
        pose, angles = spherical_angles(A, B, np.swapaxes(C, 1, 2))
        q = np.zeros((len(pose), 6))
        q[:, turning] = angles
        frames = _frames(loop, pose, q)
        directions = np.stack([frames[i][:, :3, 2] for i in range(6) if not loop.turns[i]], axis=2)
        with np.errstate(all="ignore"):
            d = np.linalg.pinv(directions) @ -frames[6][:, :3, 3, None]
        q[:, [i for i in range(6) if not loop.turns[i]]] = d[:, :, 0]
        return Candidates(pose=pose, q=q)

    def condition(self, loop: Loop) -> Array:
        """Return 1: the slides of an arm with six freedoms are not in a plane."""
        return np.ones(len(loop.links[5]))

    @staticmethod
    def _rotation(loop: Loop, joint: int, following: int) -> Array:
        """Return the rotation from one joint to another that follows it round the ring, shape (1 or N, 3, 3)."""
        steps = [(joint + k) % 6 for k in range((following - joint - 1) % 6 + 1)]
        return reduce(np.matmul, (loop.links[i][:, :3, :3] for i in steps))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OppositeSlides:
    """A ring read from one of two slides that are opposite each other: P R R P R R."""

    first: int
    backwards: bool

    def candidates(self, loop: Loop) -> Candidates:
        """Return configurations near all solutions of N poses, and some that are none.

        The direction of the last axis gives the first turning joint in terms of the second and third, and a relation
        g between these two; with it, the translation along the common normal of the slides is a relation f. Their
        resultant is a trigonometric polynomial in the second joint's angle.
        """
        ring = _Ring(loop.variant(self.first, backwards=self.backwards))
        f, g = (np.fft.fft(x.reshape(len(x), _SAMPLES, 5)) / 5.0 for x in ring.relations(_OUTER, _INNER))
        with np.errstate(all="ignore"):
            values = np.linalg.det(_sylvester(*np.broadcast_arrays(f, g)))
            root, q2 = _real_roots(np.roll(np.fft.fft(values) / _SAMPLES, _DEGREE, axis=1))
        which, q = ring.of(root).closed(q2)
        sane = np.isfinite(q).all(axis=1)
        which, q = which[sane], q[sane]
        ordered = np.empty_like(q)
        ordered[:, loop_order(self.first, backwards=self.backwards)] = -q if self.backwards else q
        return Candidates(pose=root[which], q=ordered)

    def condition(self, loop: Loop) -> Array:
        """Return how nearly parallel the axes on both sides of the first slide are; they must not be, shape (N,)."""
        ring = _Ring(loop.variant(self.first, backwards=self.backwards))
        apart = np.maximum(np.hypot(ring.d[:, 0], ring.d[:, 1]), 1e-300)
        return np.broadcast_to(1.0 / apart, (len(loop.links[5]),))


class _Ring:
    """The constants of a ring P R R P R R: R_1 A R_2 B R_4 C R_5 D is the identity."""

    def __init__(self, ring: Loop) -> None:
        self.links = ring.links
        K = [link[:, :3, :3] for link in ring.links]
        t = [link[:, :3, 3] for link in ring.links]
        back = np.swapaxes(K[0], 1, 2)
        self.A, self.B, self.C, self.D = K[1], K[2] @ K[3], K[4], K[5] @ K[0]
        inverse = np.swapaxes(self.D, 1, 2)
        self.c, self.d = self.C[:, :, 2], inverse[:, :, 2]  # the last axis, from both sides
        self.b, self.e = K[2][:, :, 2], back[:, :, 2]  # the slides' directions
        self.alpha = _turned(inverse, t[5]) + _turned(back, t[0])
        self.t1, self.gamma, self.delta = t[1], t[2] + _turned(K[2], t[3]), t[4]

    def of(self, pose: Indices) -> _Ring:
        """Return the constants of some of the poses."""
        return _Ring(Loop(turns=(), links=tuple(K if len(K) == 1 else K[pose] for K in self.links)))

    def relations(self, q2: Array, q4: Array) -> tuple[Array, Array]:
        """Return f and g at angles of shape (1 or N, S), each of shape (N, S)."""
        v, way, u = self._vectors(q2, q4)
        d = self.d[:, None]
        with np.errstate(all="ignore"):
            square = d[..., 0] ** 2 + d[..., 1] ** 2
            c = (d[..., 0] * u[..., 0] + d[..., 1] * u[..., 1]) / square
            s = (d[..., 1] * u[..., 0] - d[..., 0] * u[..., 1]) / square
            normal = np.cross(_turned_back(c, s, self.e[:, None]), v)
            across = _turned_back(c, s, np.cross(self.alpha, self.e)[:, None])
        return (v * across + normal * way).sum(axis=-1), u[..., 2] - d[..., 2]

    def closed(self, q2: Array) -> tuple[Indices, Array]:
        """Return the ring's coordinates for an angle of the second turning joint of each pose, shape (N,).

        Returns:
            Which angle each belongs to, shape (S,), and coordinates, shape (S, 6).
        """
        quarters = 0.5 * np.pi * np.arange(3.0)[None]
        g = self.relations(q2[:, None], quarters)[1].T
        middle = 0.5 * (g[0] + g[2])
        cosine, sine = g[0] - middle, g[1] - middle
        with np.errstate(all="ignore"):
            spread = np.arccos(np.clip(-middle / np.hypot(cosine, sine), -1.0, 1.0))
        centre = np.arctan2(sine, cosine)
        which = np.concatenate([np.arange(len(q2)), np.arange(len(q2))])
        ring, q2, q4 = self.of(which), q2[which], np.concatenate([centre + spread, centre - spread])
        v, way, u = (x[:, 0] for x in ring._vectors(q2[:, None], q4[:, None]))
        d = ring.d
        q1 = np.arctan2(d[:, 1] * u[:, 0] - d[:, 0] * u[:, 1], d[:, 0] * u[:, 0] + d[:, 1] * u[:, 1])
        R1, R2, R4 = (joint_motion(True, angle)[:, :3, :3] for angle in (q1, q2, q4))
        left = np.swapaxes(ring.D @ R1 @ ring.A @ R2 @ ring.B @ R4 @ ring.C, 1, 2)
        q5 = np.arctan2(left[:, 1, 0] - left[:, 0, 1], left[:, 0, 0] + left[:, 1, 1])
        c, s = np.cos(q1), np.sin(q1)
        slides = np.stack([_turned_back(c, s, ring.e), v], axis=2)
        gap = _turned_back(c, s, ring.alpha) + way
        sane = np.isfinite(gap).all(axis=1) & np.isfinite(slides).all(axis=(1, 2))
        d = np.full((len(which), 2), np.nan)
        d[sane] = -(np.linalg.pinv(slides[sane]) @ gap[sane, :, None])[:, :, 0]
        return which, np.stack([d[:, 0], q1, q2, d[:, 1], q4, q5], axis=1)

    def _vectors(self, q2: Array, q4: Array) -> tuple[Array, Array, Array]:
        """Return the second slide, the way to the last joint, and its axis, seen from behind the first turning joint.

        Each has the shape (N, S, 3).
        """
        R2, R4 = (joint_motion(True, angle)[..., :3, :3] for angle in (q2, q4))
        AR2 = self.A[:, None] @ R2
        rest = AR2 @ self.B[:, None] @ R4
        way = self.t1[:, None] + _turned(AR2, self.gamma[:, None]) + _turned(rest, self.delta[:, None])
        return _turned(AR2, self.b[:, None]), way, _turned(rest, self.c[:, None])


def _turned(R: Array, v: Array) -> Array:
    return np.asarray(np.einsum("...ij,...j->...i", R, v))


def _turned_back(c: Array, s: Array, v: Array) -> Array:
    """Turn vectors about z by the negative of an angle."""
    x, y, z = np.broadcast_arrays(v[..., 0], v[..., 1], v[..., 2])
    return np.stack(np.broadcast_arrays(c * x + s * y, c * y - s * x, z), axis=-1)


def _sylvester(f: NDArray[np.complex128], g: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return Sylvester's matrices of trigonometric polynomials f and g of degrees 2 and 1 in one angle.

    Args:
        f: Coefficients by multiples 0, 1, 2, -2, -1 of the angle, shape (..., 5).
        g: Likewise; those of 2 and -2 are zero.

    Returns:
        Shape (..., 6, 6).
    """
    f, g = np.roll(f, 2, axis=-1), np.roll(g, 2, axis=-1)[..., 1:4]
    matrix = np.zeros((*f.shape[:-1], 6, 6), dtype=np.complex128)
    for k in range(4):
        matrix[..., k, k : k + 3] = g
    for k in range(2):
        matrix[..., 4 + k, k : k + 5] = f
    return matrix


def _real_roots(coefficients: NDArray[np.complex128]) -> tuple[Indices, Array]:
    """Return the angles at which trigonometric polynomials are zero.

    Args:
        coefficients: By multiples of the angle from -degree to degree, complex, shape (N, 2 degree + 1).

    Returns:
        Which polynomial each belongs to, shape (M,), and angles, rad, shape (M,).
    """
    coefficients = np.where(np.isfinite(coefficients).all(axis=1, keepdims=True), coefficients, 0.0)
    size = np.abs(coefficients).max(axis=1, keepdims=True)
    used = np.flatnonzero((np.abs(coefficients) > _NOTHING * size).any(axis=0))
    if not len(used):
        return np.zeros(0, dtype=np.intp), np.zeros(0)
    p = coefficients[:, used[0] : used[-1] + 1]
    degree = p.shape[1] - 1
    companion = np.zeros((len(p), degree, degree), dtype=np.complex128)
    companion[:, range(1, degree), range(degree - 1)] = 1.0
    with np.errstate(all="ignore"):
        companion[:, :, -1] = -p[:, :-1] / p[:, -1:]
    companion[~np.isfinite(companion).all(axis=(1, 2))] = 0.0
    z = np.linalg.eigvals(companion)
    with np.errstate(divide="ignore"):
        which, k = np.nonzero(np.abs(np.log(np.abs(z))) < _GATE)
    return which, np.angle(z[which, k])


def _frames(loop: Loop, pose: Indices, q: Array) -> list[Array]:
    """Return the frames of the joints round the ring, before each moves, and behind the last link, (M, 4, 4)."""
    frames = [np.broadcast_to(np.eye(4), (len(q), 4, 4))]
    for i, turns in enumerate(loop.turns):
        link = loop.links[i] if len(loop.links[i]) == 1 else loop.links[i][pose]
        frames.append(frames[-1] @ joint_motion(turns, q[:, i]) @ link)
    return frames
