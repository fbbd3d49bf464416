"""What measurements should have been, by given values of all unknowns, and how that changes with each of them.

Besides the robot's own there are unknowns of the measurement: poses of stations, fixed points that distances lead to,
sockets. Equations are e = measured - predicted, and a step dx of the unknowns takes J dx off them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.calibrate.measurements import Kind, Measurements, socket_distances
from dh2sim.calibrate.parameters import (
    AXES,
    POSE_PARTS,
    Parameter,
    RobotParameters,
    Values,
    moved_pose,
)
from dh2sim.kinematics.rotations import hat, rotation_vectors
from dh2sim.typing import Array

LENGTH, ANGLE, ARTEFACT = 0, 1, 2
"""Scales of equations: lengths and angles that were measured, and what an artefact is known to."""
ARTEFACT_SIGMA: Final = 1e-5
"""m, to which distances between sockets are known."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class State:
    """Values of all unknowns."""

    values: Values
    stations: Array
    """Poses of base_link in the stations' frames, shape (stations, 4, 4)."""
    points: Array
    """Sockets, or fixed points of stations, in base_link, m, shape (points, 3)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Equations:
    """Equations of all measurements at a state."""

    e: Array
    """Measured minus predicted, m and rad, shape (E,)."""
    J: Array
    """Shape (E, U), a column for each unknown."""
    scale: NDArray[np.intp]
    """LENGTH, ANGLE or ARTEFACT, shape (E,)."""
    row: NDArray[np.intp]
    """The measurement that each belongs to, -1 for an artefact; shape (E,)."""


class Observations:
    """Measurements of a robot as equations for its parameters."""

    def __init__(self, robot: RobotParameters, measured: Measurements) -> None:
        """Take both."""
        self.robot = robot
        self.measured = measured
        self.station_names: tuple[str, ...] = ()
        self.point_names: tuple[str, ...] = ()
        count = len(measured)
        self._station = np.zeros(count, dtype=np.intp)
        self._point = np.zeros(count, dtype=np.intp)
        self._ends: list[tuple[int, int, float]] = []
        what = ""
        if measured.kind in (Kind.POSE, Kind.POSITION):
            if measured.station is not None:
                self.station_names, self._station = _numbered(measured.station)
        elif measured.kind is Kind.SOCKET:
            what = "socket"
            self.point_names, self._point = _numbered(measured.socket_names())
            self._ends = [
                (self.point_names.index(one), self.point_names.index(other), distance)
                for (one, other), distance in socket_distances(measured).items()
            ]
        elif measured.pair is None and measured.position is None:
            what = "station"
            self.point_names, self._point = _numbered(measured.station or ("1",) * count)
        self._pairs = _pairs(measured.pair) if measured.kind is Kind.DISTANCE and measured.pair is not None else None
        stations = [
            Parameter(name=f"station {name}.{part}", group=None, is_angle=k >= 3, part=k)
            for name in self.station_names
            for k, part in enumerate(POSE_PARTS)
        ]
        points = [
            Parameter(name=f"{what} {name}.{axis}", group=None, is_angle=False, part=k)
            for name in self.point_names
            for k, axis in enumerate(AXES)
        ]
        self.unknowns: tuple[Parameter, ...] = (*robot.parameters, *stations, *points)
        """The robot's, in its order, then those of the measurement."""

    def start(self, values: Values) -> State:
        """Return a state with stations and points at zero."""
        return State(
            values=values,
            stations=np.tile(np.eye(4), (len(self.station_names), 1, 1)),
            points=np.zeros((len(self.point_names), 3)),
        )

    def moved(self, state: State, step: Array) -> State:
        """Return a state changed by a step, one number an unknown."""
        robot = len(self.robot.parameters)
        poses = robot + 6 * len(self.station_names)
        stations = [moved_pose(T, d) for T, d in zip(state.stations, step[robot:poses].reshape(-1, 6), strict=True)]
        return State(
            values=self.robot.moved(state.values, step[:robot]),
            stations=np.array(stations).reshape(-1, 4, 4),
            points=state.points + step[poses:].reshape(-1, 3),
        )

    def rows_of_points(self) -> NDArray[np.intp]:
        """Return the socket or fixed point of each row, by its number."""
        return self._point

    def rows_of_stations(self) -> NDArray[np.intp]:
        """Return the station of each row, by its number."""
        return self._station

    def equations(self, state: State) -> Equations:
        """Return all equations and their derivatives."""
        measured = self.measured
        R, p, J = self.robot.jacobian(state.values, measured.q)
        if measured.kind in (Kind.POSE, Kind.POSITION):
            return self._poses(state, R, p, J)
        if measured.kind is Kind.SOCKET:
            return self._sockets(state, p, J)
        return self._distances(state, p, J)

    def _poses(self, state: State, R: Array, p: Array, J: Array) -> Equations:
        measured, robot = self.measured, J.shape[2]
        count = len(measured)
        assert measured.position is not None
        full = np.zeros((count, 6, len(self.unknowns)))
        full[:, :, :robot] = J
        if self.station_names:
            T = state.stations[self._station]
            turned = np.einsum("nij,nj->ni", T[:, :3, :3], p)
            full[:, :3, :robot] = T[:, :3, :3] @ J[:, :3]
            full[:, 3:, :robot] = T[:, :3, :3] @ J[:, 3:]
            for k in range(len(self.station_names)):
                rows = np.flatnonzero(self._station == k)
                first = robot + 6 * k
                full[rows, :3, first : first + 3] = np.eye(3)
                for axis in range(3):
                    full[rows, :3, first + 3 + axis] = np.cross(np.eye(3)[axis], turned[rows])
                full[rows, 3:, first + 3 : first + 6] = np.eye(3)
            p, R = turned + T[:, :3, 3], T[:, :3, :3] @ R
        parts = 6 if measured.rotation is not None else 3
        e = np.zeros((count, parts))
        e[:, :3] = measured.position - p
        if measured.rotation is not None:
            e[:, 3:] = rotation_vectors(measured.rotation @ R.transpose(0, 2, 1))
            full[:, 3:] = _right_inverse(e[:, 3:]) @ full[:, 3:]
        scale = np.tile(np.repeat([LENGTH, ANGLE], 3)[:parts], count)
        return Equations(
            e=e.ravel(),
            J=full[:, :parts].reshape(count * parts, -1),
            scale=scale,
            row=np.repeat(np.arange(count), parts),
        )

    def _sockets(self, state: State, p: Array, J: Array) -> Equations:
        count, robot = len(p), J.shape[2]
        full = np.zeros((count, 3, len(self.unknowns)))
        full[:, :, :robot] = J[:, :3]
        for axis in range(3):
            full[np.arange(count), axis, robot + 3 * self._point + axis] = -1.0
        e = [(state.points[self._point] - p).ravel()]
        rows = [full.reshape(3 * count, -1)]
        for one, other, distance in self._ends:
            along, found = _direction(state.points[one] - state.points[other])
            gradient = np.zeros((1, len(self.unknowns)))
            gradient[0, robot + 3 * one : robot + 3 * one + 3] = along
            gradient[0, robot + 3 * other : robot + 3 * other + 3] = -along
            e.append(np.array([distance - found]))
            rows.append(gradient)
        artefacts = len(self._ends)
        return Equations(
            e=np.concatenate(e),
            J=np.concatenate(rows),
            scale=np.repeat([LENGTH, ARTEFACT], [3 * count, artefacts]),
            row=np.concatenate([np.repeat(np.arange(count), 3), np.full(artefacts, -1)]),
        )

    def _distances(self, state: State, p: Array, J: Array) -> Equations:
        measured, robot = self.measured, J.shape[2]
        assert measured.distance is not None
        if self._pairs is not None:
            first, second = self._pairs.T
            gap, Jp = p[first] - p[second], J[first, :3] - J[second, :3]
            distance, rows = measured.distance[first], first
        else:
            fixed = measured.position if measured.position is not None else state.points[self._point]
            gap, Jp, distance, rows = p - fixed, J[:, :3], measured.distance, np.arange(len(p))
        along, found = _direction(gap)
        full = np.zeros((len(gap), len(self.unknowns)))
        full[:, :robot] = np.einsum("ni,nik->nk", along, Jp)
        if self.point_names:
            for axis in range(3):
                full[np.arange(len(gap)), robot + 3 * self._point + axis] = -along[:, axis]
        return Equations(
            e=distance - found, J=full, scale=np.full(len(gap), LENGTH), row=np.asarray(rows, dtype=np.intp)
        )

    def with_random_rows(self, q: Array) -> Observations:
        """Return the like of these for joint vectors that nothing was measured at, with values that do not matter."""
        measured = self.measured
        index = np.arange(len(q)) % len(measured)
        some = measured.rows(index)
        if some.pair is not None:
            some = replace(some, pair=tuple(str(k // 2) for k in range(len(q))))
        if some.socket is not None:
            some = replace(some, socket=("",) * len(q), placement=None, distance=None, to=None)
        return Observations(self.robot, replace(some, q=q))


def _numbered(names: tuple[str, ...]) -> tuple[tuple[str, ...], NDArray[np.intp]]:
    known = {name: k for k, name in enumerate(dict.fromkeys(names))}
    return tuple(known), np.array([known[name] for name in names], dtype=np.intp)


def _pairs(names: tuple[str, ...]) -> NDArray[np.intp]:
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        rows.setdefault(name, []).append(row)
    return np.array([both for both in rows.values() if len(both) == 2], dtype=np.intp).reshape(-1, 2)


def _direction(gap: Array) -> tuple[Array, Array]:
    """Return unit vectors and lengths; a gap of length zero has no direction."""
    length = np.linalg.norm(gap, axis=-1)
    return gap / np.maximum(length, 1e-12)[..., None], length


def _right_inverse(vectors: Array) -> Array:
    """Return by how much the rotation vectors of E change when E exp(d) takes the place of E, shape (N, 3, 3).

    The inverse of the right Jacobian of SO(3): G. S. Chirikjian, Stochastic Models, Information Theory, and Lie
    Groups 2, 2012, section 10.6.
    """
    angle = np.linalg.norm(vectors, axis=1)
    K = hat(vectors)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    factor = np.where(small, 1.0 / 12.0, 1.0 / safe**2 - 1.0 / (2.0 * safe * np.tan(0.5 * safe)))
    return np.asarray(np.eye(3) + 0.5 * K + factor[:, None, None] * (K @ K))
