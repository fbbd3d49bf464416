"""Measurements of a robot: joint vectors, and what was measured at each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dh2sim.arguments import real_array
from dh2sim.errors import CalibrationError
from dh2sim.kinematics.chain import serial_spec_of
from dh2sim.messages import counted
from dh2sim.robot.spec import SpecLike
from dh2sim.typing import Array, read_only


class Kind(StrEnum):
    """What was measured of tool0."""

    POSE = "pose"
    """Position and orientation, in base_link or in the frame of a station."""
    POSITION = "position"
    """The position alone."""
    DISTANCE = "distance"
    """The distance from a fixed point of a station, or between the positions at two configurations."""
    SOCKET = "socket"
    """That its origin, a ball, was in a socket: at the same unknown point as in other rows."""


OTHER_KINDS: Final = {"point": "position", "points": "position", "poses": "pose", "distances": "distance"}
"""What the kinds are called elsewhere."""


def noise_sigmas(noise: object) -> tuple[float, float]:
    """Return standard deviations of a component, m and rad, that are given together or as one number.

    Raises:
        ArgumentError: They are not numbers.
        CalibrationError: They are not above 0, or not one or two.
    """
    given = real_array("noise", noise)
    if given.shape not in ((), (2,)) or not (np.isfinite(given) & (given > 0.0)).all():
        raise CalibrationError(f"noise must be a positive number, m, or two, m and rad; got {given.tolist()}")
    length, angle = np.broadcast_to(given, 2).tolist()
    return length, angle


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measurements:
    """Measurements, one in each row; made by ``measurements`` and ``read_measurements``, which check them."""

    kind: Kind
    q: Array
    """Joint vectors, rad and m, shape (N, n)."""
    position: Array | None = None
    """Of tool0, m, shape (N, 3); of distances: the fixed point of the row's station in base_link, where known."""
    rotation: Array | None = None
    """Orientation of tool0, shape (N, 3, 3)."""
    distance: Array | None = None
    """m, shape (N,); of sockets: to another socket of the placement, NaN where none is given."""
    station: tuple[str, ...] | None = None
    """Of each row, whose pose relative to base_link, or whose fixed point, is unknown."""
    pair: tuple[str, ...] | None = None
    """Of each row: the two rows with the same name belong together; distances are between them."""
    socket: tuple[str, ...] | None = None
    placement: tuple[str, ...] | None = None
    """Of the sockets: those of another placement are others."""
    to: tuple[str, ...] | None = None
    """The socket that ``distance`` leads to; empty for the only other one of the placement."""
    groups: tuple[str, ...] | None = None
    """What is held out together."""
    group_name: str = ""
    """What the groups are called."""
    lines: tuple[int, ...] = ()
    """Of the file, from 1."""
    file: str = ""
    notes: tuple[str, ...] = ()
    """What of the file is left out."""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.q)

    def place(self, row: int) -> str:
        """Return how a row is called in messages."""
        return f"line {self.lines[row]}" if self.lines else f"row {row}"

    def rows(self, which: NDArray[np.intp] | NDArray[np.bool_] | Sequence[int]) -> Measurements:
        """Return some of the rows."""
        index = np.asarray(which)
        index = np.flatnonzero(index) if index.dtype == bool else index

        def texts(values: tuple[str, ...] | None) -> tuple[str, ...] | None:
            return None if values is None else tuple(values[k] for k in index.tolist())

        return replace(
            self,
            q=self.q[index],
            position=None if self.position is None else self.position[index],
            rotation=None if self.rotation is None else self.rotation[index],
            distance=None if self.distance is None else self.distance[index],
            station=texts(self.station),
            pair=texts(self.pair),
            socket=texts(self.socket),
            placement=texts(self.placement),
            to=texts(self.to),
            groups=texts(self.groups),
            lines=tuple(self.lines[k] for k in index.tolist()) if self.lines else (),
        )

    @property
    def has_base(self) -> bool:
        """Whether they tell where the arm is in base_link."""
        if self.kind in (Kind.POSE, Kind.POSITION):
            return self.station is None
        return self.kind is Kind.DISTANCE and self.position is not None

    def socket_names(self) -> tuple[str, ...]:
        """Return the socket of each row by a name that tells it from those of other placements."""
        sockets = self.socket or ()
        if self.placement is None:
            return sockets
        return tuple(f"{placement}/{socket}" for placement, socket in zip(self.placement, sockets, strict=True))


def measurements(
    robot: SpecLike,
    q: ArrayLike,
    *,
    poses: ArrayLike | None = None,
    positions: ArrayLike | None = None,
    distances: ArrayLike | None = None,
    station_points: ArrayLike | None = None,
    sockets: Sequence[object] | None = None,
    placements: Sequence[object] | None = None,
    stations: Sequence[object] | None = None,
    pairs: Sequence[object] | None = None,
    groups: Sequence[object] | None = None,
) -> Measurements:
    """Return measurements that are given as arrays, one in each row.

    Args:
        robot: That was measured.
        q: Joint vectors, rad and m, shape (N, n).
        poses: Of tool0 in base_link, or in the frame of a station, shape (N, 4, 4).
        positions: In place of poses, m, shape (N, 3).
        distances: m, shape (N,): of tool0 from its station's fixed point; between the two rows of a pair; or, with
            sockets, of the row's socket from the only other one of its placement (NaN where there is none to give).
        station_points: With distances: the fixed points of the rows' stations in base_link, if they are known, m,
            shape (N, 3).
        sockets: The socket that the origin of tool0 was in, a name a row.
        placements: Of the sockets: those of another placement are others.
        stations: A name a row: stations whose frame, or fixed point, is unknown.
        pairs: A name a row, each twice.
        groups: A name a row: rows that are held out together; default placements, else stations, else sockets.

    Raises:
        CalibrationError: Something does not fit together; the text says what.
    """
    spec = serial_spec_of(robot)
    vectors = np.asarray(q, dtype=np.float64)
    n = len(spec.moving_rows)
    if vectors.ndim != 2 or vectors.shape[1] != n:
        raise CalibrationError(f"expected joint vectors of shape (N, {n}), got shape {vectors.shape}")
    count = len(vectors)

    def array(name: str, value: ArrayLike | None, *shape: int) -> Array | None:
        if value is None:
            return None
        found = np.asarray(value, dtype=np.float64)
        if found.shape != (count, *shape):
            raise CalibrationError(f"expected {name} of shape {(count, *shape)}, got shape {found.shape}")
        return read_only(found)

    def names(name: str, value: Sequence[object] | None) -> tuple[str, ...] | None:
        if value is None:
            return None
        if len(value) != count:
            raise CalibrationError(f"expected {counted(count, 'name')} in {name}, got {len(value)}")
        return tuple(str(each) for each in value)

    T = array("poses", poses, 4, 4)
    given = {
        Kind.SOCKET: sockets is not None,
        Kind.DISTANCE: sockets is None and distances is not None,
        Kind.POSE: T is not None,
        Kind.POSITION: positions is not None,
    }
    kinds = [kind for kind, there in given.items() if there]
    if len(kinds) != 1:
        raise CalibrationError("give one of poses, positions, distances and sockets")
    position = T[:, :3, 3] if T is not None else array("positions", positions, 3)
    if kinds[0] is Kind.DISTANCE:
        position = array("station_points", station_points, 3)
    made = Measurements(
        kind=kinds[0],
        q=read_only(vectors),
        position=position,
        rotation=None if T is None else T[:, :3, :3],
        distance=array("distances", distances),
        station=names("stations", stations),
        pair=names("pairs", pairs),
        socket=names("sockets", sockets),
        placement=names("placements", placements),
        groups=names("groups", groups),
        group_name="group" if groups is not None else "",
    )
    problems = [message for _, _, message in problems_of(made)]
    if problems:
        raise CalibrationError("\n".join(problems))
    return grouped(made)


def grouped(given: Measurements) -> Measurements:
    """Return measurements with groups: by default placements, else stations, else sockets; else rows stand alone."""
    if given.groups is not None:
        return given
    found: dict[str, tuple[str, ...] | None] = {
        "placement": given.placement,
        "station": given.station,
        "socket": given.socket,
        "pair": given.pair,
    }
    for name, values in found.items():
        if values is not None and len(set(values)) > 1:
            return replace(given, groups=values, group_name=name)
    return given


def problems_of(given: Measurements) -> list[tuple[int, str, str]]:
    """Return what does not go together in measurements: row from 0 (-1: all), column, message."""
    found: list[tuple[int, str, str]] = []
    for name, values in (("joint vectors", given.q), ("positions", given.position), ("rotations", given.rotation)):
        if values is not None and not np.isfinite(values).all():
            row = int(np.argwhere(~np.isfinite(values))[0][0])
            found.append((row, "", f"{name}: row {row} is not finite"))
    if not len(given):
        found.append((-1, "", "there are no measurements"))
    if given.rotation is not None and len(given):
        off = np.abs(given.rotation @ given.rotation.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
        found += [
            (int(k), "", f"{given.place(int(k))}: not a rotation: R Rᵀ differs from 1 by {off[k]:.2g}")
            for k in np.flatnonzero(~(off < 1e-3))
        ]
    if given.kind is Kind.DISTANCE and given.distance is not None:
        found += [
            (int(k), "distance", f"{given.place(int(k))}: a distance must be a positive number")
            for k in np.flatnonzero(~(given.distance > 0.0))
        ]
        if given.pair is not None:
            if given.station is not None or given.position is not None:
                found.append((-1, "pair", "distances are between pairs of rows, or from stations, not both"))
            count: dict[str, int] = {}
            for name in given.pair:
                count[name] = count.get(name, 0) + 1
            found += [
                (given.pair.index(name), "pair", f"pair '{name}' has {counted(times, 'row')}; a pair has two")
                for name, times in count.items()
                if times != 2
            ]
    if given.kind is Kind.SOCKET:
        names = given.socket_names()
        count = {}
        for name in names:
            count[name] = count.get(name, 0) + 1
        found += [
            (names.index(name), "socket", f"socket '{name}' has one row; at least two are needed")
            for name, times in count.items()
            if times == 1
        ]
        found += [(row, "distance", message) for row, message in _socket_distance_problems(given)]
    return found


def _socket_distance_problems(given: Measurements) -> list[tuple[int, str]]:
    try:
        socket_distances(given)
    except _SocketError as error:
        return [(error.row, str(error))]
    return []


class _SocketError(ValueError):
    def __init__(self, row: int, message: str) -> None:
        self.row = row
        super().__init__(message)


def socket_distances(given: Measurements) -> dict[tuple[str, str], float]:
    """Return the known distances between sockets, m, by their names."""
    found: dict[tuple[str, str], float] = {}
    if given.distance is None:
        return found
    names, sockets = given.socket_names(), given.socket or ()
    placements = given.placement or ("",) * len(sockets)
    of_placement: dict[str, set[str]] = {}
    for placement, name in zip(placements, names, strict=True):
        of_placement.setdefault(placement, set()).add(name)
    for row, (name, placement, distance) in enumerate(zip(names, placements, given.distance.tolist(), strict=True)):
        if not np.isfinite(distance):
            continue
        others = of_placement[placement] - {name}
        to = given.to[row] if given.to is not None else ""
        if to:
            other = f"{placement}/{to}" if given.placement is not None else to
            if other not in others:
                raise _SocketError(row, f"{given.place(row)}: there is no other socket '{to}' in this placement")
        elif len(others) == 1:
            [other] = others
        elif not others:
            continue
        else:
            raise _SocketError(
                row,
                f"{given.place(row)}: the placement has {len(others) + 1} sockets; which one the distance leads to "
                "must be in a column 'to'",
            )
        if distance <= 0.0:
            raise _SocketError(row, f"{given.place(row)}: a distance must be a positive number")
        ends = (min(name, other), max(name, other))
        if abs(found.setdefault(ends, distance) - distance) > 1e-9:
            raise _SocketError(
                row,
                f"{given.place(row)}: sockets '{ends[0]}' and '{ends[1]}' are {distance:g} m apart here, "
                f"{found[ends]:g} m in a row before",
            )
    return found
