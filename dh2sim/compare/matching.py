"""Correspondences between two mechanisms: rigid motions, joint senses and zeros that make one out of the other.

Let M_i be the rigid motion that takes link i of A to link i of B, both at coordinate zero and in base_link. B moves
as A does exactly if M_i takes the axes of both joints of the link to those of B, up to the sense, and if joint i can
make M_i out of M_(i-1), by turning about or sliding along its axis: M_i = exp(-B_i o_i) M_(i-1), where o_i is the
zero of joint i. Then q_B = s q_A + o, and

    FK_B(q_B) = M_0 FK_A(q_A) T_A⁻¹ M_n⁻¹ T_B.

Links that sliding joints connect share a rotation. It follows from the directions of the axes at such a group, and
from the common normal of its first and last axis (Kabsch, Acta Cryst. A32, 1976); up to eight ways, as axes may be
taken with either sense. With the rotations known all places are linear: how far each axis is shifted along itself,
and the zeros of slides. Parallel, coincident and concurrent axes leave something free, which is not a special case: a
least-squares solution of least norm.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from dh2sim.compare.screws import ScrewAxes
from dh2sim.kinematics.rotations import rotations_about
from dh2sim.typing import Array

MOST_HYPOTHESES = 256
"""Followed at a time; senses are left open by axes that meet at right angles, two ways for each."""
_MOST_READ = 32
"""Hypotheses of which zeros, base and tool are computed: those with the fewest joints that turn the other way."""
MARGIN = 10.0
"""By which what is found on the way may be further off than the tolerance."""
_SURE = 1e-7
"""Sine below which directions are taken for parallel, at any tolerance."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Correspondence:
    """One way to make robot B out of robot A: FK_B(sense q + zero) = T_base FK_A(q) T_tool."""

    senses: Array
    """+1 or -1 for each joint, shape (n,)."""
    zeros: Array
    """The coordinates of B at which A is at zero, rad and m, shape (n,)."""
    T_base: Array = field(repr=False)
    """Pose of A's base_link in B's, shape (4, 4)."""
    T_tool: Array = field(repr=False)
    """Pose of B's tool0 in A's, shape (4, 4)."""
    links: tuple[Array, ...] = field(repr=False)
    """M_0 … M_n, each of shape (4, 4)."""


class ObstacleKind(StrEnum):
    """What keeps two mechanisms from being the same."""

    COUNT = "count"
    """The numbers of joints."""
    TYPE = "type"
    """A joint turns in one and slides in the other."""
    TWIST = "twist"
    """The angle between two axes."""
    DISTANCE = "distance"
    """How far two axes are apart, or on which side."""
    OFFSET = "offset"
    """How far two common normals are apart along the axis between them, or on which side."""
    SUM = "sum"
    """No single number is far off, but all together are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """Where two mechanisms first differ."""

    kind: ObstacleKind
    first: int
    """Index of the first joint concerned."""
    last: int
    """Index of the last joint concerned."""


@dataclass(slots=True, kw_only=True)
class _Hypothesis:
    senses: list[float]
    rotations: list[Array]
    """Of the groups of links so far."""
    gaps: list[float]
    """What shifts must make up for, m: three numbers for each group between turning joints."""
    shifts: Array
    """Of the axes of turning joints along themselves, and zeros of slides, by joint; m, shape (n,)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Group:
    """Links that only sliding joints connect, with the joints around and between them."""

    joints: tuple[int, ...]
    start: int | None
    """The turning joint before; None at the base."""
    end: int | None
    """The turning joint behind; None at the tool."""


def _groups(turns: tuple[bool, ...]) -> list[_Group]:
    groups = []
    start: int | None = None
    inside: list[int] = []
    for i, turn in enumerate(turns):
        inside.append(i)
        if turn:
            groups.append(_Group(joints=tuple(inside), start=start, end=i))
            start, inside = i, [i]
    groups.append(_Group(joints=tuple(inside), start=start, end=None))
    return groups


def correspondences(a: ScrewAxes, b: ScrewAxes, tolerance: float) -> list[Correspondence] | Obstacle:
    """Return the ways to make B out of A, the simplest first, or where that first fails.

    Args:
        a: The axes of A.
        b: The axes of B.
        tolerance: rad, and m for a reach of up to 1 m, then of the reach; ways found may be off by a few times that.
    """
    if a.n != b.n:
        return Obstacle(kind=ObstacleKind.COUNT, first=min(a.n, b.n), last=max(a.n, b.n))
    for i, (of_a, of_b) in enumerate(zip(a.turns, b.turns, strict=True)):
        if of_a is not of_b:
            return Obstacle(kind=ObstacleKind.TYPE, first=i, last=i)
    matcher = _Matcher(a, b, tolerance)
    hypotheses = [_Hypothesis(senses=[], rotations=[], gaps=[], shifts=np.zeros(a.n))]
    for index in range(len(matcher.groups)):
        hypotheses, obstacle = matcher.extended(hypotheses, index)
        if obstacle is not None:
            return obstacle
    simplest = sorted(hypotheses, key=lambda hypothesis: sum(sense < 0 for sense in hypothesis.senses))
    ways = [way for hypothesis in simplest[:_MOST_READ] for way in matcher.ways(hypothesis)]
    return sorted(ways, key=lambda way: _cost(way, matcher))


def some_correspondences(a: ScrewAxes, b: ScrewAxes, tolerance: float, count: int) -> list[Correspondence]:
    """Return a few of the ways to make B out of A, whichever are found first; arguments as for ``correspondences``.

    Depth first, which is quick where axes leave many senses open.
    """
    if a.turns != b.turns:
        return []
    matcher = _Matcher(a, b, tolerance)
    nothing = _Hypothesis(senses=[], rotations=[], gaps=[], shifts=np.zeros(a.n))
    left = MOST_HYPOTHESES * len(matcher.groups)

    def completed(hypothesis: _Hypothesis, index: int) -> Iterator[_Hypothesis]:
        nonlocal left
        if index == len(matcher.groups):
            yield hypothesis
        elif left > 0:
            left -= 1
            for longer in matcher.extended([hypothesis], index)[0]:
                yield from completed(longer, index + 1)

    return [next(matcher.ways(found)) for found in itertools.islice(completed(nothing, 0), count)]


class _Matcher:
    def __init__(self, a: ScrewAxes, b: ScrewAxes, tolerance: float) -> None:
        self.a, self.b = a, b
        self.angle = MARGIN * tolerance + 1e-12
        self.size = max(1.0, a.reach, b.reach)
        self.length = self.angle * self.size
        self.parallel = max(_SURE, self.angle)
        self.groups = _groups(a.turns)
        self.all_parallel = [self._all_parallel(group) for group in self.groups]
        self.normals = [self._normals(group) for group in self.groups]
        self.shifting = [self._shifting(index) for index in range(len(self.groups))]
        self.cosines_a = a.directions @ a.directions.T
        self.cosines_b = b.directions @ b.directions.T

    # ------------------------------------------------------------------ group by group

    def extended(self, hypotheses: list[_Hypothesis], index: int) -> tuple[list[_Hypothesis], Obstacle | None]:
        """Return the hypotheses that go on through a group, or where all of them end."""
        group = self.groups[index]
        turned, placed = [], []
        failed: dict[ObstacleKind, tuple[int, int]] = {}
        for hypothesis in hypotheses:
            for senses in self._senses(hypothesis.senses, group, failed):
                previous = hypothesis.rotations[-1] if hypothesis.rotations else np.eye(3)
                R = self._rotation(senses, index, previous)
                ends = min(group.joints, default=0), max(group.joints, default=0)
                if self._misdirected(R, senses, group):
                    failed.setdefault(ObstacleKind.TWIST, ends)
                elif self._misplaced(R, index):
                    failed.setdefault(ObstacleKind.DISTANCE, ends)
                else:
                    turned.append(
                        _Hypothesis(
                            senses=senses,
                            rotations=[*hypothesis.rotations, R],
                            gaps=[*hypothesis.gaps, *self._gap(R, group)],
                            shifts=hypothesis.shifts,
                        )
                    )
        for hypothesis in turned:
            shifts = self._shifts(hypothesis, index)
            if shifts is not None:
                hypothesis.shifts = shifts
                placed.append(hypothesis)
        if placed:
            return placed[:MOST_HYPOTHESES], None
        if turned:
            failed[ObstacleKind.OFFSET] = group.joints[0], group.joints[0]
        kind = next(k for k in (ObstacleKind.OFFSET, ObstacleKind.DISTANCE, ObstacleKind.TWIST) if k in failed)
        first, last = failed[kind]
        return [], Obstacle(kind=kind, first=first, last=last)

    def _senses(
        self, known: list[float], group: _Group, failed: dict[ObstacleKind, tuple[int, int]]
    ) -> Iterator[list[float]]:
        """Yield the senses of all joints so far, with those of the group that its angles allow."""
        new = [i for i in group.joints if i >= len(known)]
        partial = [known]
        for i in new:
            longer = []
            for senses, sense in itertools.product(partial, (1.0, -1.0)):
                worst = None
                for j in group.joints:
                    if j >= i:
                        break
                    of_a = float(self.cosines_a[i, j])
                    of_b = sense * senses[j] * float(self.cosines_b[i, j])
                    # the cosine is flat near parallel axes: how far apart the angles are, not their cosines
                    if abs(of_a - of_b) > self.angle and abs(_angle(of_a) - _angle(of_b)) > 2.0 * self.parallel:
                        worst = j
                        break
                if worst is None:
                    longer.append([*senses, sense])
                else:
                    failed.setdefault(ObstacleKind.TWIST, (worst, i))
            partial = longer[:MOST_HYPOTHESES]
        yield from partial

    def _rotation(self, senses: list[float], index: int, previous: Array) -> Array:
        """Return the rotation of a group's links that takes A's directions nearest to B's."""
        joints = list(self.groups[index].joints)
        if not joints:
            return previous
        of_a = self.a.directions[joints]
        of_b = self.b.directions[joints] * np.array([senses[i] for i in joints])[:, None]
        normals = self.normals[index]
        if self.all_parallel[index]:
            R = _least_turn(previous @ of_a[0], of_b[0]) @ previous
            if normals is None or max(np.linalg.norm(w) for w in normals) <= self.length:
                return np.asarray(R)
            u, v = R @ normals[0], normals[1]
            return rotations_about(of_b[0], math.atan2(float(np.cross(u, v) @ of_b[0]), float(u @ v))) @ R
        if normals is not None:
            of_a = np.vstack([of_a, normals[0] / self.size])
            of_b = np.vstack([of_b, normals[1] / self.size])
        U, _, Vt = np.linalg.svd(of_b.T @ of_a)
        proper = U @ Vt
        if np.linalg.det(proper) < 0.0:
            proper = (U * [1.0, 1.0, -1.0]) @ Vt
        return np.asarray(proper)

    def _all_parallel(self, group: _Group) -> bool:
        joints = list(group.joints)
        for axes in (self.a, self.b):
            z = axes.directions[joints]
            gaps = np.minimum(np.abs(z - z[:1]).max(axis=1), np.abs(z + z[:1]).max(axis=1))
            if float(np.max(gaps, initial=0.0)) > self.parallel:
                return False
        return True

    def _normals(self, group: _Group) -> tuple[Array, Array] | None:
        """Return what leads from the first axis of a group to its last, across all its directions, in A and B.

        Sliding along any of the directions does not change it.
        """
        if group.start is None or group.end is None:
            return None
        joints = list(group.joints)
        parts, ranks = [], []
        for axes in (self.a, self.b):
            _, S, Vt = np.linalg.svd(axes.directions[joints])
            ranks.append(int((self.parallel * math.sqrt(len(joints)) < S).sum()))
            parts.append((axes.points[group.end] - axes.points[group.start], Vt))
        rank = min(ranks)
        if rank == 3:
            return None
        w_a, w_b = (Vt[rank:].T @ (Vt[rank:] @ gap) for gap, Vt in parts)
        return w_a, w_b

    def _misdirected(self, R: Array, senses: list[float], group: _Group) -> bool:
        joints = list(group.joints)
        if not joints:
            return False
        signs = np.array([senses[i] for i in joints])[:, None]
        gaps = self.a.directions[joints] @ R.T - signs * self.b.directions[joints]
        return float(np.abs(gaps).max()) > max(self.angle, 1e-9)

    def _misplaced(self, R: Array, index: int) -> bool:
        normals = self.normals[index]
        if normals is None:
            return False
        w_a, w_b = normals
        return float(np.abs(R @ w_a - w_b).max()) > self.length

    def _shifting(self, index: int) -> tuple[Array, Array]:
        """Return what shifts of axes and zeros of slides do to the gaps of the groups so far, and its inverse."""
        blocks = [np.zeros((0, self.a.n))]
        for group in self.groups[: index + 1]:
            if group.start is not None and group.end is not None:
                block = np.zeros((3, self.a.n))
                block[:, group.start] = self.b.directions[group.start]
                block[:, group.joints[1:]] = -self.b.directions[list(group.joints[1:])].T
                blocks.append(block)
        matrix = np.vstack(blocks)
        return matrix, np.asarray(np.linalg.pinv(matrix, rcond=self.parallel))

    def _gap(self, R: Array, group: _Group) -> list[float]:
        if group.start is None or group.end is None:
            return []
        p_a, p_b = (axes.points[group.end] - axes.points[group.start] for axes in (self.a, self.b))
        gap: list[float] = (p_b - R @ p_a).tolist()
        return gap

    def _shifts(self, hypothesis: _Hypothesis, index: int) -> Array | None:
        """Return how far each axis is shifted along itself, and zeros of slides; None if no such are good enough."""
        matrix, inverse = self.shifting[index]
        gaps = np.array(hypothesis.gaps)
        solution = inverse @ gaps
        if float(np.max(np.abs(matrix @ solution - gaps), initial=0.0)) > self.length:
            return None
        return np.asarray(solution)

    # ------------------------------------------------------------------ what a hypothesis means

    def ways(self, hypothesis: _Hypothesis) -> Iterator[Correspondence]:
        """Yield the correspondences of a hypothesis: what the ends leave free goes into base and tool, or zeros."""
        for first, last in itertools.product(self._first(hypothesis), self._last(hypothesis)):
            yield self._way(hypothesis, first, last)

    def _first(self, hypothesis: _Hypothesis) -> Iterator[tuple[Array, bool]]:
        """Yield rotations of the base's links, and whether slides there make up for a translation of the base."""
        slides = any(not self.a.turns[i] for i in self.groups[0].joints)
        R = hypothesis.rotations[0]
        yield R, False
        if slides:
            yield R, True
        if len(self.groups) > 1 and self.all_parallel[0]:
            yield hypothesis.rotations[1], False  # the first joint stays at its zero
            if slides:
                yield hypothesis.rotations[1], True

    def _last(self, hypothesis: _Hypothesis) -> Iterator[tuple[Array, bool]]:
        if len(self.groups) == 1:
            yield hypothesis.rotations[0], False
            return
        group = self.groups[-1]
        slides = any(not self.a.turns[i] for i in group.joints)
        R = hypothesis.rotations[-1]
        yield R, False
        if slides:
            yield R, True
        if self.all_parallel[-1]:
            same = self.b.T_base_tool[:3, :3] @ self.a.T_base_tool[:3, :3].T  # tool0 stays as it is
            if not self._misdirected(same, hypothesis.senses, group):
                yield same, False
                if slides:
                    yield same, True

    def _way(self, hypothesis: _Hypothesis, first: tuple[Array, bool], last: tuple[Array, bool]) -> Correspondence:
        a, b, n = self.a, self.b, self.a.n
        rotations = [first[0], *hypothesis.rotations[1:-1], last[0]] if len(self.groups) > 1 else [first[0]]
        zeros = np.where(a.turns, 0.0, hypothesis.shifts)
        links = [np.eye(4) for _ in range(n + 1)]
        for index, group in enumerate(self.groups):
            R = rotations[index]
            inner = [i for i in group.joints if not a.turns[i]]
            if group.start is not None:
                t = self._anchor(group.start, R, hypothesis.shifts)
                if group.end is None and inner and last[1]:
                    target = b.T_base_tool[:3, 3] - R @ a.T_base_tool[:3, 3]
                    U = b.directions[inner].T
                    zeros[inner] = np.linalg.lstsq(U, t - target, rcond=self.parallel)[0]
            elif group.end is not None:
                t = self._anchor(group.end, R, hypothesis.shifts)
                U = b.directions[inner].T
                if inner and first[1]:
                    zeros[inner] = np.linalg.lstsq(-U, t, rcond=self.parallel)[0]
                t = t + U @ zeros[inner]
            else:
                t = np.zeros(3)
            link = 0 if group.start is None else group.start + 1
            links[link] = _pose(R, t)
            for i in inner:
                t = t - zeros[i] * b.directions[i]
                links[i + 1] = _pose(R, t)
            if index > 0 and group.start is not None:
                zeros[group.start] = -_turn(R @ rotations[index - 1].T, b.directions[group.start])
        T_tool = np.asarray(np.linalg.solve(links[n] @ a.T_base_tool, b.T_base_tool), dtype=np.float64)
        return Correspondence(
            senses=np.array(hypothesis.senses), zeros=zeros, T_base=links[0], T_tool=T_tool, links=tuple(links)
        )

    def _anchor(self, joint: int, R: Array, shifts: Array) -> Array:
        b = self.b
        return np.asarray(b.points[joint] + shifts[joint] * b.directions[joint] - R @ self.a.points[joint])


def _cost(way: Correspondence, matcher: _Matcher) -> tuple[int, int, int]:
    """How much there is to say about a correspondence: joints that turn the other way, zeros, base and tool."""
    flips = int((way.senses < 0).sum())
    zeros = int((np.abs(way.zeros) > matcher.angle).sum())
    moved = [T for T in (way.T_base, way.T_tool) if np.abs(T - np.eye(4)).max() > matcher.length]
    return flips + zeros + len(moved), flips, zeros


def _angle(cosine: float) -> float:
    return math.acos(max(-1.0, min(1.0, cosine)))


def _turn(R: Array, axis: Array) -> float:
    """Return the angle of a rotation about an axis that it keeps, rad, in (-pi, pi]."""
    x, y, z = axis.tolist()
    sine = (R[2, 1] - R[1, 2]) * x + (R[0, 2] - R[2, 0]) * y + (R[1, 0] - R[0, 1]) * z
    angle = math.atan2(float(sine), float(np.trace(R)) - 1.0)
    return math.pi if angle <= -math.pi + 1e-12 else angle


def _least_turn(u: Array, v: Array) -> Array:
    """Return the rotation by the smallest angle that takes one unit vector to another, shape (3, 3)."""
    cosine = float(u @ v)
    if cosine < -1.0 + 1e-9:  # by half a turn about whatever is perpendicular
        helper = np.eye(3)[int(np.argmin(np.abs(u)))]
        axis = helper - (helper @ u) * u
        axis /= np.linalg.norm(axis)
        half = 2.0 * np.outer(axis, axis) - np.eye(3)
        return _least_turn(half @ u, v) @ half
    K = np.outer(v, u) - np.outer(u, v)
    return np.asarray(np.eye(3) + K + K @ K / (1.0 + cosine))


def _pose(R: Array, t: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return T
