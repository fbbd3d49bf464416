"""Files that are replayed: what they hold and which actuators that drives."""

from __future__ import annotations

import csv
import functools
import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dh2sim.errors import ControllerError
from dh2sim.robot.spec import ActuatorType
from dh2sim.robot.words import listed
from dh2sim.simulate.controllers.recording import Recording
from dh2sim.simulate.controllers.replay_runs import read_run
from dh2sim.typing import Array, read_only

_MOST_TOLD = 5


def read_recording(file: str, kind: str) -> Recording:
    """Read a file that is replayed.

    Args:
        file: its path.
        kind: 'auto', 'ctrl' or 'reference'.

    Raises:
        ControllerError: the file cannot be used.
    """
    try:
        path = Path(file).expanduser()
        there, folder = path.exists(), path.is_dir()
    except (OSError, RuntimeError) as error:
        raise ControllerError(f"cannot read '{file}': {error}") from error
    if not there:
        raise ControllerError(f"there is no file '{file}'")
    if folder:
        return read_run(path, file, kind)
    readers = {".csv": _read_csv, ".npy": _read_npy}
    if path.suffix.lower() not in readers:
        raise ControllerError(f"'{file}' cannot be replayed; what can is a .csv file, a .npy file or a run of dh2sim")
    try:
        return readers[path.suffix.lower()](path, file, kind)
    except OSError as error:
        raise ControllerError(f"cannot read '{file}': {error.strerror or error}") from error


def actuator_type(column: str) -> ActuatorType | None:
    """Return the type of actuator that a column is named after, or None if it is none."""
    suffix = column.rpartition("_")[2]
    driving = {kind.value: kind for kind in ActuatorType if kind is not ActuatorType.NONE}
    return driving.get(suffix)


def _read_csv(path: Path, file: str, kind: str) -> Recording:
    raw = path.read_bytes()
    try:
        rows = list(csv.reader(raw.decode("utf-8-sig").splitlines()))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ControllerError(f"'{file}' is not a CSV file: {error}") from error
    header = [name.strip() for name in rows[0]] if rows else []
    names = [name for name in header if name != "time"]
    if not names:
        raise ControllerError(
            f"'{file}' needs a first line that names joints, such as joint_1, or actuators, such as joint_1_motor"
        )
    twice = sorted({name for name in header if header.count(name) > 1})
    if twice:
        raise ControllerError(f"'{file}' has more than one column {listed(map(repr, twice))}")
    positions, actuation = _meaning(file, names, kind)
    table = _numbers(file, header, rows[1:])
    times = None
    if "time" in header:
        times = _times(file, table[:, header.index("time")])
    data = read_only(table[:, [header.index(name) for name in names]][None])
    return Recording(
        file=f"'{file}'",
        positions=positions,
        actuation=actuation,
        names=tuple(names),
        width=len(names),
        length=len(table),
        times=times,
        rollouts=None,
        read=lambda _: data,
        digest=hashlib.sha256(raw).hexdigest(),
    )


def _meaning(file: str, names: Sequence[str], kind: str) -> tuple[bool, ActuatorType | None]:
    """Return whether columns are positions of joints, and the actuators that they drive."""
    if kind == "reference":
        return True, ActuatorType.POSITION
    types = {name: actuator_type(name) for name in names}
    joints = [name for name, found in types.items() if found is None]
    if len(joints) == len(names) and kind == "auto":
        return True, ActuatorType.POSITION
    if joints:
        controls = [name for name, found in types.items() if found is not None]
        mixed = f", but {listed(map(repr, controls))} are" if controls else ""
        raise ControllerError(
            f"'{file}': columns {listed(map(repr, joints))} are not named after actuators, as "
            f"joint_1_motor is{mixed}. A file holds controls alone, or with as=reference positions of joints alone"
        )
    found = set(types.values())
    return False, found.pop() if len(found) == 1 else None


def _numbers(file: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> Array:
    table = np.empty((len(rows), len(header)))
    problems = []
    filled = [(line, row) for line, row in enumerate(rows, start=2) if row]
    for i, (line, row) in enumerate(filled):
        if len(row) != len(header):
            problems.append(f"line {line} has {len(row)} values; the first line names {len(header)} columns")
            continue
        for j, text in enumerate(row):
            try:
                table[i, j] = float(text)
            except ValueError:
                table[i, j] = np.nan
            if not np.isfinite(table[i, j]):
                problems.append(f"line {line}, column '{header[j]}': {text!r} is not a finite number")
    if not filled:
        problems.append("it has no values below the first line")
    if problems:
        more = [f"and {len(problems) - _MOST_TOLD} more"] if len(problems) > _MOST_TOLD else []
        raise ControllerError("\n  ".join([f"'{file}' cannot be used:", *problems[:_MOST_TOLD], *more]))
    return table[: len(filled)]


def _times(file: str, times: Array) -> Array:
    if times[0] != 0.0:
        raise ControllerError(
            f"'{file}': time begins at {float(times[0])!r}; it counts seconds from the start, so the first is 0"
        )
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if late.size:
        i = int(late[0])
        raise ControllerError(
            f"'{file}': time must grow from row to row; {float(times[i + 1])!r} comes after {float(times[i])!r}"
        )
    return read_only(times)


def _read_npy(path: Path, file: str, kind: str) -> Recording:
    if kind == "auto":
        raise ControllerError(f"'{file}' does not say what its numbers are: add as=ctrl or as=reference")
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, EOFError) as error:
        raise ControllerError(f"'{file}' is not a NumPy file of numbers: {error}") from error
    if array.dtype.kind not in "fiu" or array.ndim not in (2, 3) or 0 in array.shape:
        raise ControllerError(
            f"'{file}' holds {array.dtype} of shape {array.shape}; it must hold real numbers of "
            "shape (time steps, columns) or (rollouts, time steps, columns)"
        )
    rows = array if array.ndim == 3 else array[None]
    for i, values in enumerate(rows):
        if not np.isfinite(values).all():
            which = f"rollout {i}, " if array.ndim == 3 else ""
            step, column = (int(k) for k in np.argwhere(~np.isfinite(values))[0])
            raise ControllerError(
                f"'{file}': {which}time step {step}, column {column}: "
                f"{float(values[step, column])} is not a finite number"
            )
    with path.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return Recording(
        file=f"'{file}'",
        positions=kind == "reference",
        actuation=ActuatorType.POSITION if kind == "reference" else None,
        names=None,
        width=rows.shape[2],
        length=rows.shape[1],
        times=None,
        rollouts=rows.shape[0] if array.ndim == 3 else None,
        read=functools.partial(_some, rows),
        digest=digest,
    )


def _some(rows: Array, rollouts: range) -> Array:
    return np.array(rows[rollouts.start : rollouts.stop], dtype=np.float64)
