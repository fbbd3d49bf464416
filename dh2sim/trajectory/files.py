"""Trajectory files: samples of joints over time as CSV or NumPy archive, and what is between the samples."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import BinaryIO, Final, Self

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import OutputError, SettingsError, TrajectoryError
from dh2sim.files import atomic_file
from dh2sim.input_files import csv_numbers, npz_arrays, read_input, repeated
from dh2sim.messages import listed, shown
from dh2sim.progress import Advance, Stage, silent
from dh2sim.trajectory.curves import ORDERS, PiecewisePolynomial, cubic_spline, quintic_hermite
from dh2sim.typing import Array, read_only

SUFFIXES: Final = (".csv", ".npz")
MOST_BYTES: Final = 2**30
"""Largest file that is read."""
_MOST_REPORTED: Final = 5
_ROWS: Final = 8192
"""Of a .csv that are written at a time."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledTrajectory:
    """Joint positions at instants; between them, a smooth curve through them."""

    joints: tuple[str, ...]
    """Names of the n joints."""
    time: Array
    """s, from 0, increasing, shape (K,)."""
    q: Array
    """rad and m, shape (K, n)."""
    qd: Array | None = None
    """rad/s and m/s, shape (K, n); None where only positions are known."""
    qdd: Array | None = None
    """rad/s² and m/s², likewise."""
    qddd: Array | None = None
    """rad/s³ and m/s³, likewise."""
    turns: tuple[bool, ...] | None = None
    """Which joints turn; None where that is not known."""
    robot: str = ""
    """Name of the robot; '' where it is not known."""
    digest: str = ""
    """SHA-256 of the file that it was read from."""

    @classmethod
    def of(
        cls,
        joints: Sequence[str],
        time: ArrayLike,
        q: ArrayLike,
        *,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
        qddd: ArrayLike | None = None,
        turns: tuple[bool, ...] | None = None,
        robot: str = "",
        digest: str = "",
    ) -> Self:
        """Make one of arrays as :class:`SampledTrajectory` describes them."""
        rates = [None if each is None else read_only(each) for each in (qd, qdd, qddd)]
        return cls(
            joints=tuple(joints),
            time=read_only(time),
            q=read_only(q),
            qd=rates[0],
            qdd=rates[1],
            qddd=rates[2],
            turns=turns,
            robot=robot,
            digest=digest,
        )

    @cached_property
    def curve(self) -> PiecewisePolynomial:
        """Through the samples: of fifth degree where velocities and accelerations are known, else a cubic spline."""
        if len(self.time) < 2:
            return PiecewisePolynomial.of([0.0, 1.0], self.q[None])
        if self.qd is not None and self.qdd is not None:
            return quintic_hermite(self.time, self.q, self.qd, self.qdd)
        return cubic_spline(self.time, self.q)

    @property
    def duration(self) -> float:
        """Time of the last sample, s."""
        return float(self.time[-1])

    def at(self, t: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Return positions and their first three derivatives at times, s, shape (N,): each of shape (N, n).

        After the end, the last positions are held.
        """
        times = np.asarray(t, dtype=np.float64)
        found = self.curve.derivatives(times)
        found[1:, times >= self.duration] = 0.0
        return found[0], found[1], found[2], found[3]

    def states(self) -> tuple[Array, Array, Array, Array]:
        """Return positions and their first three derivatives at the samples, as far as known, else of the curve."""
        of_curve = self.curve.derivatives(self.time)
        given = (self.q, self.qd, self.qdd, self.qddd)
        q, qd, qdd, qddd = (
            of_curve[k] if each is None else each for k, each in zip(range(ORDERS), given, strict=True)
        )
        return q, qd, qdd, qddd

    def ordered(self, joints: Sequence[str], *, besides: Collection[str] = ()) -> Self:
        """Return the same trajectory with its joints in another order.

        Args:
            joints: Names of all joints.
            besides: Of joints that are left out: they follow.

        Raises:
            TrajectoryError: They are not the same joints.
        """
        if set(joints) != set(self.joints) - set(besides):
            raise TrajectoryError(f"its joints are {listed(self.joints)}; the robot has {listed(joints)}")
        order = [self.joints.index(joint) for joint in joints]
        rates = [None if each is None else each[:, order] for each in (self.qd, self.qdd, self.qddd)]
        return self.of(
            joints,
            self.time,
            self.q[:, order],
            qd=rates[0],
            qdd=rates[1],
            qddd=rates[2],
            turns=None if self.turns is None else tuple(self.turns[i] for i in order),
            robot=self.robot,
            digest=self.digest,
        )

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False, stage: Stage = silent) -> None:
        """Write a .csv or .npz file, whole or not at all.

        Args:
            path: The file.
            overwrite: Whether to replace a file.
            stage: Shows the progress of what takes long.

        Raises:
            OutputError: There is a file already, it cannot be written, or it would be too large to be read.
            SettingsError: The file has another ending.
        """
        file = Path(path)
        require_suffix(file)
        if file.exists() and not overwrite:
            raise OutputError(f"'{file}' already exists; choose another name, or pass overwrite=True")
        with atomic_file(file) as draft, draft.open("wb") as stream:
            if file.suffix.lower() == ".csv":
                with stage("writing", "samples", len(self.time)) as advance:
                    self._write_csv(stream, advance)
            else:
                self._write_npz(stream)
            if stream.tell() > MOST_BYTES:
                raise _too_large()

    def _write_csv(self, stream: BinaryIO, advance: Advance) -> None:
        stream.write((",".join(["time", *self.joints]) + "\n").encode())
        for start in range(0, len(self.time), _ROWS):
            part = slice(start, start + _ROWS)
            rows = zip(self.time[part].tolist(), self.q[part].tolist(), strict=True)
            stream.write("".join(",".join(map(repr, [time, *row])) + "\n" for time, row in rows).encode())
            if start == 0 and stream.tell() / _ROWS * len(self.time) > 1.1 * MOST_BYTES:
                raise _too_large()
            advance(len(self.time[part]))

    def _write_npz(self, stream: BinaryIO) -> None:
        arrays: dict[str, object] = {"time": self.time, "q": self.q}
        rates = {"qd": self.qd, "qdd": self.qdd, "qddd": self.qddd}
        arrays |= {name: values for name, values in rates.items() if values is not None}
        arrays["joints"] = np.array(self.joints, dtype=np.str_)
        if self.turns is not None:
            arrays["units"] = np.array(["rad" if turns else "m" for turns in self.turns], dtype=np.str_)
        arrays["robot"] = np.array(self.robot, dtype=np.str_)
        np.savez(stream, **arrays)  # type: ignore[arg-type]


def _too_large() -> OutputError:
    return OutputError(f"the file would be larger than {MOST_BYTES // 2**20} MB: take fewer samples")


def require_suffix(path: Path) -> None:
    """Check the ending of a trajectory file.

    Raises:
        SettingsError: It is neither .csv nor .npz.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise SettingsError([("out", f"must end in .csv or .npz, got {shown(str(path))}")])


def is_trajectory_file(path: str | os.PathLike[str]) -> bool:
    """Whether a path has the ending of a trajectory file."""
    return Path(path).suffix.lower() in SUFFIXES


def read_trajectory(path: str | os.PathLike[str]) -> SampledTrajectory:
    """Read a trajectory file.

    Args:
        path: A .csv whose first line names ``time`` and the joints; or an .npz with the arrays ``time``, ``q`` and
            ``joints``, and if known ``qd``, ``qdd`` and ``qddd``.

    Raises:
        TrajectoryError: It cannot be read, or is none; the text says what is wrong, and where.
    """
    file = Path(path)
    name = f"'{os.fspath(path)}'"
    if file.suffix.lower() not in SUFFIXES:
        raise TrajectoryError(f"{name} is not a trajectory file, which ends in .csv or .npz")
    try:
        data = read_input(file, MOST_BYTES)
    except OSError as error:
        raise TrajectoryError(f"cannot read {name}: {error.strerror or error}") from None
    if len(data) > MOST_BYTES:
        raise TrajectoryError(f"{name} is larger than {MOST_BYTES // 2**20} MB")
    digest = hashlib.sha256(data).hexdigest()
    return _from_csv(data, name, digest) if file.suffix.lower() == ".csv" else _from_npz(data, name, digest)


def _from_csv(data: bytes, file: str, digest: str) -> SampledTrajectory:
    try:
        read = csv_numbers(data)
    except ValueError as error:
        raise TrajectoryError(f"{file} {error}") from None
    header, table = read.header, read.values
    joints = header[1:]
    if header[:1] != ("time",) or not joints or "" in joints:
        raise TrajectoryError(
            f"{file}: the first line must be 'time' and the names of joints, found {shown(','.join(header))}"
        )
    if twice := repeated(header):
        raise TrajectoryError(f"{file}: the first line names {listed(twice)} more than once")
    if problems := read.problems or _times_problem(table[:, 0]):
        raise TrajectoryError("\n  ".join([f"{file} cannot be used:", *problems]))
    return SampledTrajectory.of(joints, table[:, 0], table[:, 1:], digest=digest)


def _times_problem(time: Array) -> list[str]:
    if time[0] != 0.0:
        return [f"time must start at 0, got {float(time[0])!r}"]
    late = np.flatnonzero(np.diff(time) <= 0.0)
    if late.size:
        i = int(late[0])
        return [f"time must increase from row to row; {float(time[i + 1])!r} comes after {float(time[i])!r}"]
    return []


def _from_npz(data: bytes, file: str, digest: str) -> SampledTrajectory:
    try:
        arrays = npz_arrays(data, MOST_BYTES)
    except ValueError as error:
        raise TrajectoryError(f"{file} {error}") from None
    missing = [name for name in ("time", "q", "joints") if name not in arrays]
    if missing:
        raise TrajectoryError(f"{file} lacks the arrays {listed(missing)}; it has {listed(arrays)}")
    joints = [str(name) for name in np.atleast_1d(arrays["joints"]).tolist()]
    shape = (arrays["time"].size, len(joints))
    numbers: dict[str, Array] = {}
    for name in ("time", "q", "qd", "qdd", "qddd"):
        if name not in arrays:
            continue
        found, wanted = arrays[name], shape[:1] if name == "time" else shape
        if found.dtype.kind not in "fiu" or found.shape != wanted:
            raise TrajectoryError(
                f"{file}: {name} must be real numbers of shape {wanted}, got {found.dtype} of {found.shape}"
            )
        if not found.size or not np.isfinite(found).all():
            raise TrajectoryError(f"{file}: {name} must hold finite numbers, and at least one")
        numbers[name] = found.astype(np.float64)
    if len(set(joints)) != len(joints):
        raise TrajectoryError(f"{file}: joints must have different names, got {listed(joints)}")
    problems = _times_problem(numbers["time"])
    if problems:
        raise TrajectoryError(f"{file}: {problems[0]}")
    units = [str(unit) for unit in np.atleast_1d(arrays.get("units", [])).tolist()]
    turns = tuple(unit == "rad" for unit in units) if len(units) == len(joints) else None
    robot = str(arrays["robot"]) if "robot" in arrays and arrays["robot"].ndim == 0 else ""
    rates = {name: numbers.get(name) for name in ("qd", "qdd", "qddd")}
    return SampledTrajectory.of(
        joints, numbers["time"], numbers["q"], **rates, turns=turns, robot=robot, digest=digest
    )
