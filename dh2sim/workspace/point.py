"""The origin of a frame as a function of the joints that move it, with first and second derivatives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dh2sim.kinematics.batch_frame import cross, difference, write_column
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import frame_place, joint_frames
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.typing import Array, read_only

Flags: TypeAlias = NDArray[np.bool_]
TRIALS: Final = 64
"""Configurations at which it is seen which joints move the point, and in how many directions."""
STILL: Final = 1e-9
"""Share of the largest singular value, or of the largest distance, below which nothing moves."""


class Coordinates(Protocol):
    """Coordinates of the point, such as x, y, z or r, z, as a function of joints inside a box."""

    lower: Array
    """Lowest joint coordinates, shape (m,); -inf where a joint turns all around."""
    upper: Array
    """Highest ones."""
    steps: Array
    """How far a joint may move in one step of a search, rad or m, shape (m,)."""

    def values(self, q: Array) -> tuple[Array, Array]:
        """Return coordinates, shape (N, k), and their derivatives, shape (N, k, m), at ``q``, shape (N, m)."""
        ...


class PointMap:
    """The origin of a frame in base_link, m, as a function of the joints that move it."""

    def __init__(
        self, chain: KinematicChain, frame: str, travel: Sequence[tuple[float, float]], home: Array, size: float
    ) -> None:
        """Prepare a robot.

        Args:
            chain: The robot.
            frame: Name of the frame.
            travel: Lowest and highest coordinate of every moving joint, rad and m.
            home: Where joints are that do not move the point, shape (n,).
            size: Length that steps are measured by, m.

        Raises:
            UnknownFrameError: There is no such frame.
        """
        self.chain, self.frame, self.size = chain, frame, size
        self._carriers, self._T = frame_place(chain, frame)
        self.low, self.high = (read_only([ends[k] for ends in travel]) for k in (0, 1))
        """Limits of all moving joints, rad and m, shape (n,)."""
        self.home = np.clip(home, self.low, self.high)
        self.turns = np.array([joint.type.turns for joint in chain.moving_joints], dtype=np.bool_)
        self.joints: tuple[int, ...] = tuple(range(chain.n))
        q = scattered_configurations(self.low, self.high, TRIALS)
        self.J_trials = self.values(q)[1]
        moving = np.abs(self.J_trials).max(axis=(0, 1), initial=0.0) > STILL * np.where(self.turns, size, 1.0)
        self._select(np.flatnonzero(moving).tolist())
        self.J_trials = self.J_trials[:, :, moving]

    def _select(self, joints: Sequence[int]) -> None:
        self.joints = tuple(joints)
        """Indices of the joints that move the point, the first first; m of them."""
        index = np.array(joints, dtype=np.intp)
        low, high, turns = self.low[index], self.high[index], self.turns[index]
        around = turns & (high - low >= 2.0 * math.pi - 1e-9)
        self.lower, self.upper = np.where(around, -np.inf, low), np.where(around, np.inf, high)
        self.steps = np.where(turns, 0.6, 0.5 * self.size)
        self.sample_low = np.where(around, -math.pi, low)
        """Limits that configurations are drawn between: a turn is enough."""
        self.sample_high = np.where(around, math.pi, high)

    def without_first(self) -> PointMap:
        """Return the same point with its first joint held at home."""
        inner = object.__new__(PointMap)
        inner.__dict__.update(self.__dict__)
        inner._select(self.joints[1:])
        inner.J_trials = self.J_trials[:, :, 1:]
        return inner

    def full(self, q: Array) -> Array:
        """Return vectors of all joints inside their limits, shape (N, n), of those that move the point, (N, m)."""
        vectors = np.broadcast_to(self.home, (len(q), len(self.home))).copy()
        vectors[:, list(self.joints)] = q
        middle = 0.5 * (self.low + self.high)
        beyond = self.turns & ((vectors < self.low) | (vectors > self.high))
        turned = vectors - 2.0 * math.pi * np.round((vectors - middle) / (2.0 * math.pi))
        return np.asarray(np.clip(np.where(beyond, turned, vectors), self.low, self.high))

    def positions(self, q: Array) -> Array:
        """Return the point alone, shape (N, 3)."""
        return self._evaluate(q, derivatives=False)[0]

    def values(self, q: Array) -> tuple[Array, Array]:
        """Return the point, m, shape (N, 3), and its Jacobian, shape (N, 3, m), at ``q``, shape (N, m)."""
        p, J, _ = self._evaluate(q, derivatives=True)
        return p, J

    def second(self, q: Array) -> tuple[Array, Array, Array]:
        """Return also the second derivatives, shape (N, 3, m, m).

        With z the axis of a joint that turns, the derivative of a later joint's column is its cross product with z;
        sliding changes no column.
        """
        p, J, z = self._evaluate(q, derivatives=True)
        m = len(self.joints)
        H = np.zeros((len(q), 3, m, m))
        for i, joint in enumerate(self.joints):
            if self.turns[joint]:
                columns = np.cross(z[:, :, i, None], J[:, :, i:], axis=1)
                H[:, :, i, i:] = columns
                H[:, :, i:, i] = columns
        return p, J, H

    def _evaluate(self, q: Array, *, derivatives: bool) -> tuple[Array, Array, Array]:
        count, m = len(q), len(self.joints)
        columns = np.repeat(self.home[:, None], count, axis=1)
        columns[list(self.joints)] = q.T
        p, J, z = np.empty((count, 3)), np.empty((count, 3, m)), np.empty((count, 3, m))
        if not self._carriers:
            p[:] = self._T[:3, 3]
            J[:] = 0.0
            return p, J, z
        frames = []
        for frame in joint_frames(self.chain, columns):
            frames.append(frame)
            if len(frames) == self._carriers:
                break
        target = frames[-1].then(self._T)
        write_column(target.p, 1.0, p)
        if derivatives:
            moving = [
                (joint, frame) for joint, frame in zip(self.chain.joints, frames, strict=False) if joint.type.moves
            ]
            J[:] = 0.0
            for k, index in enumerate(self.joints):
                if index < len(moving):
                    joint, frame = moving[index]
                    sign = joint.sign * frame.signs[2]
                    write_column(frame.z, sign, z[:, :, k])
                    linear = cross(frame.z, difference(target.p, frame.p)) if joint.type.turns else frame.z
                    write_column(linear, sign, J[:, :, k])
        return p, J, z

    def first_axis(self) -> tuple[Array, Array]:
        """Return a point of the first moving joint's axis in base_link, m, and its direction, shape (3,) each."""
        columns = self.home[:, None]
        number = -1
        for joint, frame in zip(self.chain.joints, joint_frames(self.chain, columns), strict=False):
            number += joint.type.moves
            if number == self.joints[0]:
                point, direction = np.empty((1, 3)), np.empty((1, 3))
                write_column(frame.p, 1.0, point)
                write_column(frame.z, joint.sign * frame.signs[2], direction)
                return point[0], direction[0]
        raise AssertionError("a joint that moves the point is in the chain")

    @property
    def first_turns(self) -> bool:
        """Whether the first joint that moves the point turns."""
        return bool(self.joints) and bool(self.turns[self.joints[0]])


def motion_rank(J: Array) -> int:
    """Return in how many directions points move at once, at the best of several configurations; J is (N, k, m)."""
    if not J.shape[-1]:
        return 0
    values = np.linalg.svd(J, compute_uv=False)
    return int((values > STILL * max(values.max(), 1e-300)).sum(axis=-1).max())


class InBasis:
    """Coordinates of the point along some axes: all three, or two in the plane of a planar arm, or one."""

    def __init__(self, point: PointMap, axes: Array, origin: Array) -> None:
        """Prepare axes, unit vectors in base_link, shape (k, 3), and the origin, m, shape (3,)."""
        self._point, self._axes, self.origin = point, axes, origin
        self.lower, self.upper, self.steps = point.lower, point.upper, point.steps

    def places(self, q: Array) -> Array:
        """Return coordinates alone, m, shape (N, k)."""
        return along(self._point.positions(q) - self.origin, self._axes)

    def values(self, q: Array) -> tuple[Array, Array]:
        """Return coordinates, m, shape (N, k), and their derivatives, shape (N, k, m)."""
        p, J = self._point.values(q)
        return along(p - self.origin, self._axes), np.stack([along_columns(J, axis) for axis in self._axes], axis=1)

    def second(self, q: Array) -> tuple[Array, Array]:
        """Return derivatives, shape (N, k, m), and second derivatives, shape (N, k, m, m)."""
        _, J, H = self._point.second(q)
        first = np.stack([along_columns(J, axis) for axis in self._axes], axis=1)
        return first, np.stack([along_columns(H, axis) for axis in self._axes], axis=1)


class AroundAxis:
    """Distance r from an axis, and height z along it."""

    def __init__(self, point: PointMap, origin: Array, direction: Array) -> None:
        """Prepare the axis: a point of it, m, and its unit direction, shape (3,) each."""
        self.point, self.origin, self.direction = point, origin, direction
        across = np.eye(3)[int(np.argmin(np.abs(direction)))]
        x = across - (across @ direction) * direction
        self._x = x / np.linalg.norm(x)
        self._y = np.cross(direction, self._x)
        self.lower, self.upper, self.steps = point.lower, point.upper, point.steps

    def values(self, q: Array) -> tuple[Array, Array]:
        """Return r and z, m, shape (N, 2), and their derivatives, shape (N, 2, m)."""
        p, J = self.point.values(q)
        x, y, z = along(p - self.origin, np.stack([self._x, self._y, self.direction])).T
        r = np.hypot(x, y)
        on_axis = r < 1e-12 * self.point.size
        safe = np.where(on_axis, 1.0, r)
        toward = np.where(on_axis, 1.0, x / safe), np.where(on_axis, 0.0, y / safe)
        Jx, Jy, Jz = (along_columns(J, axis) for axis in (self._x, self._y, self.direction))
        Jr = toward[0][:, None] * Jx + toward[1][:, None] * Jy
        return np.stack([r, z], axis=-1), np.stack([Jr, Jz], axis=1)

    def second(self, q: Array) -> tuple[Array, Array]:
        """Return derivatives of r and z, shape (N, 2, m), and second derivatives, shape (N, 2, m, m)."""
        p, J, H = self.point.second(q)
        x, y = along(p - self.origin, np.stack([self._x, self._y])).T
        r = np.maximum(np.hypot(x, y), 1e-12 * self.point.size)
        c, s = x / r, y / r
        Jx, Jy, Jz = (along_columns(J, axis) for axis in (self._x, self._y, self.direction))
        Hx, Hy, Hz = (along_columns(H, axis) for axis in (self._x, self._y, self.direction))
        across = c[:, None] * Jy - s[:, None] * Jx
        bent = across[:, :, None] * across[:, None, :] / r[:, None, None]
        Hr = c[:, None, None] * Hx + s[:, None, None] * Hy + bent
        return np.stack([c[:, None] * Jx + s[:, None] * Jy, Jz], axis=1), np.stack([Hr, Hz], axis=1)

    def azimuths(self, q: Array) -> Array:
        """Return the angle of the point about the axis while the first joint is at home, rad, shape (N,)."""
        x, y = along(self.point.positions(q) - self.origin, np.stack([self._x, self._y])).T
        return np.asarray(np.arctan2(y, x))

    def azimuths_of_points(self, points: Array) -> Array:
        """Return the angles of points about the axis, rad, shape (N,)."""
        x, y = along(points - self.origin, np.stack([self._x, self._y])).T
        return np.asarray(np.arctan2(y, x))

    def section_of_points(self, points: Array) -> Array:
        """Return r and z of points in base_link, shape (N, 2)."""
        x, y, z = along(points - self.origin, np.stack([self._x, self._y, self.direction])).T
        return np.stack([np.hypot(x, y), z], axis=-1)

    def points(self, r: Array, z: Array) -> Array:
        """Return points in base_link with these r and z, at azimuth zero, shape (N, 3)."""
        return np.asarray(self.origin + r[:, None] * self._x + z[:, None] * self.direction)


def along(vectors: Array, axes: Array) -> Array:
    """Return components of vectors, shape (N, 3), along axes, shape (k, 3): (N, k), by sums in a fixed order."""
    x, y, z = vectors.T
    return np.stack([x * a + y * b + z * c for a, b, c in axes.tolist()], axis=-1)


def along_columns(J: Array, axis: Array) -> Array:
    """Return components of derivatives, shape (N, 3, ...), along one axis: (N, ...)."""
    a, b, c = axis.tolist()
    return np.asarray(J[:, 0] * a + J[:, 1] * b + J[:, 2] * c)
