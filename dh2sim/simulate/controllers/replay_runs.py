"""Runs of dh2sim that are replayed: their controls, or the positions that joints went through."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from dh2sim.errors import ControllerError
from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.recording import Recording
from dh2sim.simulate.layout import FORMAT
from dh2sim.typing import Array, read_only


def read_run(path: Path, file: str, kind: str) -> Recording:
    """Read what a run has recorded; the numbers themselves are read when they are needed.

    Args:
        path: folder of the run.
        file: as the user named it.
        kind: 'reference': the positions of the joints; otherwise the controls.

    Raises:
        ControllerError: it is no run, or has not recorded them.
    """
    import zarr

    positions = kind == "reference"
    variable, labels, instants = ("qpos", "joint", "time") if positions else ("ctrl", "actuator", "interval_time")
    with _readable(file):
        run: Any = zarr.open_group(path, mode="r")
        if run.attrs.get("dh2sim_run") != FORMAT:
            raise ControllerError(f"'{file}' is not a run of dh2sim")
        if variable not in run:
            raise ControllerError(
                f"'{file}' has recorded no {'positions' if positions else 'controls'}; "
                f"run it again with {variable} in --record"
            )
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
        read=functools.partial(_some, run[variable], file),
        digest=_digest(path, (variable, labels, instants)),
    )


@contextmanager
def _readable(file: str) -> Iterator[None]:
    """Say that a folder is no run, or damaged; zarr has many ways to say so."""
    try:
        yield
    except (ControllerError, MemoryError):
        raise
    except Exception as error:
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ControllerError(f"'{file}' cannot be read as a run of dh2sim: {text}") from error


def _actuation(names: tuple[str, ...], joints: int) -> ActuatorType | None:
    """Return the type of actuator at every joint; None if they differ or a joint has none."""
    suffixes = {name.rpartition("_")[2] for name in names}
    if not names:
        return ActuatorType.NONE
    return ActuatorType(suffixes.pop()) if len(suffixes) == 1 and len(names) == joints else None


def _some(variable: Any, file: str, rollouts: range) -> Array:
    with _readable(file):
        return np.asarray(variable[rollouts.start : rollouts.stop], dtype=np.float64)


def _digest(path: Path, arrays: tuple[str, ...]) -> str:
    digest = hashlib.sha256()
    for array in arrays:
        for file in sorted((path / array).rglob("*")):
            if file.is_file():
                digest.update(f"{file.relative_to(path).as_posix()}\0".encode())
                with file.open("rb") as stream:
                    digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()
