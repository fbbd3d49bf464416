"""Where a fit starts: base, tool, stations, fixed points and sockets, from the table as it is.

Closed forms, so that a tracker may stand anywhere and any reflector be on the tool.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.calibrate.measurements import Kind
from dh2sim.calibrate.observations import Observations, State
from dh2sim.calibrate.parameters import Group, Values
from dh2sim.typing import Array

_ALTERNATIONS: Final = 30


def initial_states(observations: Observations, values: Values, groups: Collection[Group]) -> list[State]:
    """Return states to start from: as a table says, and as closed forms say.

    Args:
        observations: The measurements.
        values: The table.
        groups: What is unknown: base and tool are left alone unless they are.
    """
    robot, measured = observations.robot, observations.measured
    nominal = observations.start(values)
    R, p = robot.tool_poses(nominal.values, measured.q)
    tool = nominal.values.tool
    R_flange, p_flange = R @ tool[:3, :3].T, p - (R @ tool[:3, :3].T) @ tool[:3, 3]
    if measured.kind is Kind.SOCKET:
        return [_sockets(observations, nominal, R_flange, p_flange, free=Group.TOOL in groups)]
    if measured.kind is Kind.DISTANCE:
        if observations.point_names:
            return [_fixed_points(observations, nominal, p)]
        return [nominal]
    assert measured.position is not None
    stations = len(observations.station_names)
    free_base = Group.BASE in groups and not stations
    if not (free_base or stations):
        return [nominal]
    frame = observations.rows_of_stations()
    found: list[State] = [nominal]
    made = [(_placed(p, measured.position, frame, max(stations, 1)), tool)]
    if Group.TOOL in groups:
        made.append(_alternating(R_flange, p_flange, measured.position, frame, max(stations, 1), tool))
        if measured.rotation is not None:
            made.append(
                _robot_world(R_flange, p_flange, measured.rotation, measured.position, frame, max(stations, 1))
            )
    for T, new_tool in made:
        values = replace(nominal.values, tool=new_tool)
        if stations:
            found.append(replace(nominal, values=values, stations=T))
        else:
            found.append(replace(nominal, values=replace(values, base=T[0] @ values.base)))
    return found


def _placed(points: Array, seen: Array, frame: NDArray[np.intp], frames: int) -> Array:
    """Return the pose of the arm in each frame that moves points onto where they were seen (Kabsch, 1976)."""
    T = np.tile(np.eye(4), (frames, 1, 1))
    for k in range(frames):
        mine = frame == k
        x, y = points[mine], seen[mine]
        if not len(x):
            continue
        U, _, Vt = np.linalg.svd((y - y.mean(axis=0)).T @ (x - x.mean(axis=0)))
        T[k, :3, :3] = U @ np.diag([1.0, 1.0, float(np.sign(np.linalg.det(U @ Vt)))]) @ Vt
        T[k, :3, 3] = y.mean(axis=0) - T[k, :3, :3] @ x.mean(axis=0)
    return T


def _alternating(
    R: Array, p: Array, seen: Array, frame: NDArray[np.intp], frames: int, tool: Array
) -> tuple[Array, Array]:
    """Return poses of the arm and the tool, found in turns: one moves the other's points onto those seen."""
    at = tool[:3, 3]
    T = _placed(p + R @ at, seen, frame, frames)
    for _ in range(_ALTERNATIONS):
        turned = T[frame][:, :3, :3]
        # seen = turned (p + R at) + origin: the origin of each frame is found along
        A = np.zeros((3 * len(p), 3 + 3 * frames))
        A[:, :3] = (turned @ R).reshape(-1, 3)
        for axis in range(3):
            A[3 * np.arange(len(p)) + axis, 3 + 3 * frame + axis] = 1.0
        rest = (seen - np.einsum("nij,nj->ni", turned, p)).ravel()
        at = np.linalg.lstsq(A, rest, rcond=1e-9)[0][:3]
        T = _placed(p + R @ at, seen, frame, frames)
    new = tool.copy()
    new[:3, 3] = at
    return T, new


def _robot_world(
    R: Array, p: Array, R_seen: Array, seen: Array, frame: NDArray[np.intp], frames: int
) -> tuple[Array, Array]:
    """Return poses of the arm and the tool from whole poses; one frame after the other, the tool from the first.

    M. Shah, Solving the robot-world/hand-eye calibration problem using the Kronecker product, J. Mechanisms and
    Robotics 5(3), 2013: vec(Y) and vec(X) are singular vectors of the sum of kron(B, A), where A X = Y B.
    """
    T = np.tile(np.eye(4), (frames, 1, 1))
    tool = np.eye(4)
    largest = int(np.argmax(np.bincount(frame, minlength=frames)))
    mine = frame == largest
    K = np.einsum("nij,nkl->ikjl", R[mine], R_seen[mine]).reshape(9, 9)
    U, _, Vt = np.linalg.svd(K)
    X, Y = _rotation(Vt[0].reshape(3, 3).T), _rotation(U[:, 0].reshape(3, 3).T)
    tool[:3, :3] = X.T
    for k in range(frames):
        rows = frame == k
        if rows.any():
            T[k, :3, :3] = (
                Y if k == largest else _rotation((R_seen[rows] @ X @ R[rows].transpose(0, 2, 1)).sum(axis=0))
            )
    turned = T[frame][:, :3, :3]
    A = np.zeros((3 * len(p), 3 + 3 * frames))
    A[:, :3] = (turned @ R).reshape(-1, 3)
    for axis in range(3):
        A[3 * np.arange(len(p)) + axis, 3 + 3 * frame + axis] = 1.0
    found = np.linalg.lstsq(A, (seen - np.einsum("nij,nj->ni", turned, p)).ravel(), rcond=1e-9)[0]
    tool[:3, 3] = found[:3]
    T[:, :3, 3] = found[3:].reshape(-1, 3)
    return T, tool


def _rotation(M: Array) -> Array:
    """Return the rotation nearest to a matrix, whose sign does not matter."""
    M = M if np.linalg.det(M) >= 0.0 else -M
    U, _, Vt = np.linalg.svd(M)
    return np.asarray(U @ np.diag([1.0, 1.0, float(np.sign(np.linalg.det(U @ Vt)))]) @ Vt)


def _sockets(observations: Observations, nominal: State, R: Array, p: Array, *, free: bool) -> State:
    """Return sockets, and the ball on the tool, that are nearest to each other by least squares."""
    point = observations.rows_of_points()
    count = len(observations.point_names)
    at = nominal.values.tool[:3, 3]
    if free:
        A = np.zeros((3 * len(p), 3 + 3 * count))
        A[:, :3] = R.reshape(-1, 3)
        for axis in range(3):
            A[3 * np.arange(len(p)) + axis, 3 + 3 * point + axis] = -1.0
        # p + R (at + change) = socket, the least change where there are several
        found = np.linalg.lstsq(A, -(p + R @ at).ravel(), rcond=1e-6)[0]
        at = at + found[:3]
    tool = nominal.values.tool.copy()
    tool[:3, 3] = at
    ball = p + R @ at
    sums = np.stack([np.bincount(point, ball[:, axis], minlength=count) for axis in range(3)], axis=1)
    points = sums / np.bincount(point, minlength=count)[:, None]
    return replace(nominal, values=replace(nominal.values, tool=tool), points=points)


def _fixed_points(observations: Observations, nominal: State, p: Array) -> State:
    """Return the points that distances lead to, by trilateration: |p - b|² = d² is linear in b and |b|²."""
    measured, point = observations.measured, observations.rows_of_points()
    assert measured.distance is not None
    points = nominal.points.copy()
    for k in range(len(points)):
        x, d = p[point == k], measured.distance[point == k]
        middle = x.mean(axis=0)
        y = x - middle
        _, S, Vt = np.linalg.svd(y, full_matrices=True)
        rank = int((1e-3 * S[0] < S).sum()) if len(S) and S[0] > 0.0 else 0
        inside = y @ Vt[:rank].T
        A = np.column_stack([2.0 * inside, np.ones(len(x))])
        found = np.linalg.lstsq(A, (inside**2).sum(axis=1) - d**2, rcond=None)[0]
        b = found[:rank]
        points[k] = middle + b @ Vt[:rank]
        if rank < 3:  # the arm stayed in a plane: the point is beside it, on either side
            beside = np.sqrt(max(float(np.mean(d**2 - ((inside - b) ** 2).sum(axis=1))), 1e-6))
            points[k] += beside * Vt[2]
    return replace(nominal, points=points)
