"""Recorded controls or joint positions, read from CSV and NumPy files and from runs, to be replayed."""

from __future__ import annotations

import functools
import hashlib
import os
import stat
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import ControllerError, RunError
from dh2sim.files import open_plain_file
from dh2sim.input_files import NpyFile, csv_numbers, read_input, refuse_named_pipe, repeated
from dh2sim.messages import closest, listed
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.controllers.reference import read_reference
from dh2sim.simulate.dataset_layout import FORMAT
from dh2sim.simulate.store.codec import chunk_problem
from dh2sim.simulate.store.local import LocalStore
from dh2sim.simulate.store.manifest import METADATA, ForeignArray, check_array, read_node
from dh2sim.typing import Array, read_only

MOST_LABELS = 10_000
"""Joints or actuators of a run that is replayed."""
MOST_INSTANTS = 10**8
_HEAD = 32
"""Bytes of a chunk that say how large it becomes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """Controls or positions at instants, of one rollout or of many."""

    file: str
    """As messages name it."""
    positions: bool
    """Whether it contains positions of joints; otherwise controls."""
    actuation: ActuatorType | None
    """The actuators that it drives; None: the robot's own."""
    names: tuple[str, ...] | None
    """Joints or actuators of the columns; None if unnamed, and then in the robot's order."""
    width: int
    """Number of columns, m."""
    length: int
    """Number of instants, K."""
    times: Array | None
    """Instants, s, from 0, shape (K,); None: one for each time step."""
    rollouts: int | None
    """Number of rollouts; None: one, for all."""
    read: Callable[[range], Array] = field(repr=False)
    """Reads the numbers of some rollouts, shape (rollouts, K, m)."""
    digest: str
    """SHA-256 of the file."""

    def times_at(self, timestep: float) -> Array:
        """Return the instants, s, shape (K,)."""
        return read_only(np.arange(self.length) * timestep) if self.times is None else self.times

    @property
    def first(self) -> Mapping[str, float] | None:
        """Where positions that are one for all rollouts begin, by joint; None for others."""
        if not self.positions or self.rollouts is not None or self.names is None:
            return None
        return dict(zip(self.names, self.read(range(1))[0, 0].tolist(), strict=True))

    def only(self, rollout: int) -> Recording:
        """Return one of its rollouts, for all.

        Raises:
            ControllerError: It does not have the rollout, or not all of it.
        """
        if rollout >= (self.rollouts or 1):
            held = "one rollout, 0" if self.rollouts in (None, 1) else f"rollouts 0 to {self.rollouts - 1}"
            raise ControllerError(f"{self.file} has {held}; rollout must be one of them, got {rollout}")
        data = self.read(range(rollout, rollout + 1))
        if not np.isfinite(data).all():
            raise ControllerError(
                f"{self.file} does not contain all of rollout {rollout}: it stopped early, or the run is not finished"
            )
        return replace(self, rollouts=None, read=functools.partial(_the_same, data))

    def columns(
        self, wanted: Sequence[str], what: str, *, joints: Sequence[str], besides: Collection[str] = ()
    ) -> list[int]:
        """Return which column belongs to each of the robot's joints or actuators.

        Args:
            wanted: The robot's names, in its order.
            what: 'joints' or 'actuators', for messages.
            joints: The robot's joints.
            besides: Names of columns that are left out: passive joints, which follow.

        Raises:
            ControllerError: Columns are missing, or there is one that the robot does not have.
        """
        if self.names is None:
            if self.width != len(wanted):
                raise ControllerError(
                    f"{self.file} has {self.width} columns; the robot has {len(wanted)} {what}: {listed(wanted)}"
                )
            return list(range(self.width))
        missing = [name for name in wanted if name not in self.names]
        unknown = [name for name in self.names if name not in wanted and name not in besides]
        if not missing and not unknown:
            return [self.names.index(name) for name in wanted]
        problems = []
        if missing:
            problems.append(f"missing column {_quoted(missing)}")
        for name in unknown:
            guess = closest(name, missing)
            problems.append(f"unknown column '{name}'" + (f"; did you mean '{guess}'?" if guess else ""))
        if not self.positions and set(self.names) <= set(joints):
            problems.append("the columns are joints: say as=reference")
        start = f"{self.file} does not fit the robot, whose {what} are {listed(wanted)}"
        raise ControllerError("\n  ".join([f"{start}:", *problems]))


def _the_same(data: Array, _rollouts: range) -> Array:
    return data


def _quoted(names: Sequence[str]) -> str:
    return listed((f"'{name}'" for name in names), ", ")


def read_run(path: Path, file: str, kind: str) -> Recording:
    """Open what a run has recorded; the numbers are read when they are needed.

    Args:
        path: Folder of the run.
        file: Its path as the user wrote it.
        kind: 'reference' for the positions of the joints; otherwise the controls are read.

    Raises:
        ControllerError: It is not a run, or has not recorded them.
    """
    import zarr

    positions = kind == "reference"
    variable, labels, instants = ("qpos", "joint", "time") if positions else ("ctrl", "actuator", "interval_time")
    with _readable(file):
        store = LocalStore(path)
        attributes = (read_node(store, METADATA) or {}).get("attributes")
        if not isinstance(attributes, dict) or attributes.get("dh2sim_run") != FORMAT:
            raise ControllerError(f"'{file}' is not a run of dh2sim")
        if not (path / variable).is_dir():
            what = "positions" if positions else "controls"
            raise ControllerError(f"'{file}' has recorded no {what}; run it again with '{variable}' in record")
        limits = {variable: None, labels: MOST_LABELS, "joint": MOST_LABELS, instants: MOST_INSTANTS}
        arrays = {name: check_array(store, name, most=most) for name, most in limits.items()}
        for name, array in arrays.items():
            _check_chunks(path, name, array)
        digest = _digest(path, (variable, labels, instants))
        # without consolidated metadata, so that arrays are what was checked
        run: Any = zarr.open_group(path, mode="r", zarr_format=3, use_consolidated=False)
        names = tuple(str(name) for name in run[labels][:])
        joints = len(run["joint"][:])
        times = read_only(run[instants][:])
        rollouts, length, width = run[variable].shape
    return Recording(
        file=f"'{file}'",
        positions=positions,
        actuation=ActuatorType.POSITION if positions else _actuation(names, joints),
        names=names,
        width=width,
        length=length,
        times=times,
        rollouts=rollouts,
        read=functools.partial(_some_of_run, run[variable], file),
        digest=digest,
    )


@contextmanager
def _readable(file: str) -> Iterator[None]:
    """Turn the many exceptions of zarr for a folder that is damaged, or not a run, into one error."""
    try:
        yield
    except (ControllerError, MemoryError):
        raise
    except RunError as error:
        raise ControllerError(str(error)) from error
    except Exception as error:
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ControllerError(f"'{file}' cannot be read as a run of dh2sim: {text}") from error


def _actuation(names: tuple[str, ...], joints: int) -> ActuatorType | None:
    """Return the type of actuator at every joint; None if they differ or a joint has none."""
    suffixes = {name.rpartition("_")[2] for name in names}
    if not names:
        return ActuatorType.NONE
    return ActuatorType(suffixes.pop()) if len(suffixes) == 1 and len(names) == joints else None


def _some_of_run(variable: Any, file: str, rollouts: range) -> Array:
    with _readable(file):
        return np.asarray(variable[rollouts.start : rollouts.stop], dtype=np.float64)


def _check_chunks(path: Path, name: str, array: ForeignArray) -> None:
    """Refuse chunks that take more memory than their array says."""
    for file in _plain_files(path, name):
        if file.name == METADATA:
            continue
        with open_plain_file(file) as stream:
            problem = "it is larger than a chunk"
            if os.fstat(stream.fileno()).st_size <= array.largest_file:
                head = stream.peek(_HEAD)[:_HEAD]
                problem = chunk_problem(head, stream, array.codecs, array.largest_file) or ""
        if problem:
            raise ControllerError(f"'{file}' cannot be read: {problem}")


def _digest(path: Path, arrays: tuple[str, ...]) -> str:
    digest = hashlib.sha256()
    for array in arrays:
        for file in _plain_files(path, array):
            digest.update(f"{file.relative_to(path).as_posix()}\0".encode())
            with open_plain_file(file) as stream:
                digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()


def _plain_files(path: Path, array: str) -> list[Path]:
    """Return the files of an array, in order; refuse what zarr would follow or wait for, links and pipes."""
    files = []
    for entry in sorted([path / array, *(path / array).rglob("*")]):
        mode = entry.lstat().st_mode
        if stat.S_ISREG(mode):
            files.append(entry)
        elif not stat.S_ISDIR(mode):
            raise ControllerError(f"'{entry}' is not a plain file")
    return files


_MOST_BYTES = 2**30
"""Of a CSV file."""


def read_recording(file: str, kind: str) -> Recording:
    """Read a file to be replayed.

    Args:
        file: Its path.
        kind: 'auto', 'ctrl' or 'reference'.

    Raises:
        ControllerError: The file cannot be used.
    """
    try:
        path = Path(file).expanduser()
        there, folder = path.exists(), path.is_dir()
    except (OSError, RuntimeError) as error:
        raise ControllerError(f"cannot read '{file}': {error}") from error
    if not there and "://" in file:
        raise ControllerError(f"'{file}' cannot be replayed from an object store: copy the run into a folder first")
    if not there:
        raise ControllerError(f"no such file '{file}'")
    if folder:
        return read_run(path, file, kind)
    readers = {".csv": _read_csv, ".npy": _read_npy, ".npz": _read_npz}
    if path.suffix.lower() not in readers:
        raise ControllerError(f"'{file}' cannot be replayed; it must be a .csv, .npy or .npz file or a run of dh2sim")
    try:
        refuse_named_pipe(path)
        return readers[path.suffix.lower()](path, file, kind)
    except OSError as error:
        raise ControllerError(f"cannot read '{file}': {error.strerror or error}") from error


def actuator_type(column: str) -> ActuatorType | None:
    """Return the type of actuator that a column is named after, or None if it is none."""
    suffix = column.rpartition("_")[2]
    driving = {kind.value: kind for kind in ActuatorType if kind is not ActuatorType.NONE}
    return driving.get(suffix)


def _read_csv(path: Path, file: str, kind: str) -> Recording:
    raw = read_input(path, _MOST_BYTES)
    if len(raw) > _MOST_BYTES:
        raise ControllerError(f"'{file}' is larger than {_MOST_BYTES // 2**20} MB")
    try:
        read = csv_numbers(raw)
    except ValueError as error:
        raise ControllerError(f"'{file}' {error}") from error
    header, table = read.header, read.values
    names = [name for name in header if name != "time"]
    if not names:
        raise ControllerError(
            f"'{file}' needs a first line that names joints, such as joint_1, or actuators, such as joint_1_motor"
        )
    if twice := repeated(header):
        raise ControllerError(f"'{file}' has more than one column {listed(map(repr, twice))}")
    positions, actuation = _meaning(file, names, kind)
    if read.problems:
        raise ControllerError("\n  ".join([f"'{file}' cannot be used:", *read.problems]))
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
        read=functools.partial(_the_same, data),
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
            f"joint_1_motor is{mixed}. A file contains either controls, or with as=reference positions of joints"
        )
    found = set(types.values())
    return False, found.pop() if len(found) == 1 else None


def _times(file: str, times: Array) -> Array:
    if times[0] != 0.0:
        raise ControllerError(f"'{file}': time must start at 0, the start of the rollout, got {float(times[0])!r}")
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if late.size:
        i = int(late[0])
        raise ControllerError(
            f"'{file}': time must increase from row to row; {float(times[i + 1])!r} comes after {float(times[i])!r}"
        )
    return read_only(times)


def _read_npz(path: Path, file: str, kind: str) -> Recording:
    if kind == "ctrl":
        raise ControllerError(f"'{file}' is a trajectory: it contains positions of joints, no controls")
    read = read_reference(str(path))
    data = read_only(read.q[None])
    return Recording(
        file=f"'{file}'",
        positions=True,
        actuation=ActuatorType.POSITION,
        names=read.joints,
        width=len(read.joints),
        length=len(read.time),
        times=read.time,
        rollouts=None,
        read=functools.partial(_the_same, data),
        digest=read.digest,
    )


def _read_npy(path: Path, file: str, kind: str) -> Recording:
    if kind == "auto":
        raise ControllerError(f"'{file}' does not say what its numbers are: add as=ctrl or as=reference")
    try:
        array = NpyFile(path)
        if array.dtype.kind not in "fiu" or len(array.shape) not in (2, 3) or 0 in array.shape:
            raise ControllerError(
                f"'{file}' must contain real numbers of shape (time steps, columns) or (rollouts, time steps, "
                f"columns), got {array.dtype} of shape {array.shape}"
            )
        rows = _Rows(array, file)
        rows.check()
    except ValueError as error:
        raise ControllerError(f"'{file}' {error}") from error
    return Recording(
        file=f"'{file}'",
        positions=kind == "reference",
        actuation=ActuatorType.POSITION if kind == "reference" else None,
        names=None,
        width=array.shape[-1],
        length=array.shape[-2],
        times=None,
        rollouts=array.shape[0] if len(array.shape) == 3 else None,
        read=rows.read,
        digest=rows.digest,
    )


class _Rows:
    """The rollouts in a .npy file, read when they are needed, and the same whenever they are."""

    def __init__(self, array: NpyFile, file: str) -> None:
        self._array = array
        self._file = file
        self._checksums: list[int] = []
        self.digest = ""

    def check(self) -> None:
        """Read all of them once.

        Raises:
            ControllerError: A number is not finite.
            ValueError, OSError: The file cannot be read.
        """
        digest = hashlib.sha256(f"{self._array.dtype.str} {self._array.shape}".encode())
        batch = len(self._array.shape) == 3
        for i in range(self._array.shape[0] if batch else 1):
            values = self._rollout(i)
            if not np.isfinite(values).all():
                which = f"rollout {i}, " if batch else ""
                step, column = (int(k) for k in np.argwhere(~np.isfinite(values))[0])
                raise ControllerError(
                    f"'{self._file}': {which}time step {step}, column {column}: "
                    f"{float(values[step, column])} is not a finite number"
                )
            data = values.tobytes()
            digest.update(data)
            self._checksums.append(zlib.crc32(data))
        self.digest = digest.hexdigest()

    def read(self, rollouts: range) -> Array:
        """Return some, shape (rollouts, time steps, columns).

        Raises:
            ControllerError: The file was changed, or cannot be read.
        """
        found = np.empty((len(rollouts), *self._array.shape[-2:]))
        for k, i in enumerate(rollouts):
            try:
                values = self._rollout(i)
            except (OSError, ValueError) as error:
                raise ControllerError(f"'{self._file}' was changed while it was replayed: {error}") from error
            if zlib.crc32(values.tobytes()) != self._checksums[i]:
                raise ControllerError(f"'{self._file}' was changed while it was replayed")
            found[k] = values
        return found

    def _rollout(self, i: int) -> NDArray[Any]:
        return self._array.rows(i, i + 1)[0] if len(self._array.shape) == 3 else self._array.all()
