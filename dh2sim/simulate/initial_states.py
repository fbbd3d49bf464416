"""Where rollouts start.

What ``--start`` names: a configuration of the robot, or a file of states.
"""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mujoco.batch import Batch

from dh2sim.errors import ConfigurationError, SettingsError
from dh2sim.messages import did_you_mean, listed
from dh2sim.simulate.mujoco_runtime import forward
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.randomization import Generators, Purpose
from dh2sim.simulate.settings import STARTS, Settings
from dh2sim.typing import Array, read_only

MOST_BYTES = 2**30
"""A file of starts is no larger."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Start:
    """Where rollouts start."""

    name: str
    states: Array | None = None
    """Joint positions and velocities, shape (1 or rollouts, 2, n)."""
    digest: str = ""
    """SHA-256 of ``states``."""


def read_start(text: str, joints: tuple[str, ...], configurations: Mapping[str, Array], rollouts: int) -> Start:
    """Understand what ``--start`` says.

    Args:
        text: 'home', 'zero', 'random', a configuration of the robot file, or the path of a .csv or .npy file.
        joints: names of the moving joints.
        configurations: those of the robot file, by name, each of shape (n,).
        rollouts: of the run.

    Raises:
        SettingsError: it is none of these, or the file is wrong.
    """
    path = Path(text)
    if text in STARTS:
        return Start(name=text)
    if text in configurations:
        states = np.zeros((1, 2, len(joints)))
        states[0, 0] = configurations[text]
    elif path.suffix.lower() in (".csv", ".npy"):
        states = _read_file(path, joints, rollouts)
    else:
        known = [*STARTS, *(name for name in configurations if name not in STARTS)]
        raise SettingsError(
            f"--start {text}: there is no such start.{did_you_mean(text, known)} Allowed: {listed(known)}, or a .csv "
            "or .npy file of joint positions"
        )
    frozen = read_only(states)
    return Start(name=text, states=frozen, digest=hashlib.sha256(frozen.tobytes()).hexdigest())


def _read_file(path: Path, joints: tuple[str, ...], rollouts: int) -> Array:
    where = f"--start {path}"
    try:
        if path.stat().st_size > MOST_BYTES:
            raise SettingsError(f"{where}: is larger than {MOST_BYTES / 2**30:g} GB")
        states = _npy(path, where, joints) if path.suffix.lower() == ".npy" else _csv(path, where, joints)
    except OSError as error:
        raise SettingsError(f"{where}: cannot be read: {error.strerror or error}") from error
    if len(states) not in (1, rollouts):
        raise SettingsError(
            f"{where}: holds {len(states)} states; allowed are 1, or one for each of {rollouts} rollouts"
        )
    if not np.isfinite(states).all():
        row, _, joint = np.argwhere(~np.isfinite(states))[0]
        raise SettingsError(f"{where}: state {row + 1}, {joints[joint]}: is not a finite number")
    return states


def _npy(path: Path, where: str, joints: tuple[str, ...]) -> Array:
    n = len(joints)
    try:
        with path.open("rb") as stream:
            found: Any = np.lib.format.read_array(stream, allow_pickle=False)
    except (ValueError, EOFError, MemoryError) as error:
        raise SettingsError(f"{where}: is no array of NumPy: {error}") from error
    if found.dtype.kind in "fiu":
        numbers: Array = found.astype(np.float64)
        if numbers.shape == (n,):
            numbers = numbers[None]
        if numbers.ndim == 2 and numbers.shape[1] == n:
            return np.stack([numbers, np.zeros(numbers.shape)], axis=1)
        if numbers.ndim == 3 and numbers.shape[1:] == (2, n):
            return numbers
    raise SettingsError(
        f"{where}: expected numbers of shape ({n},) or (rollouts, {n}), joint positions in rad and m, or "
        f"(rollouts, 2, {n}), positions and velocities; found {found.dtype} of shape {found.shape}"
    )


def _csv(path: Path, where: str, joints: tuple[str, ...]) -> Array:
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.reader(stream)
            lines = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise SettingsError(f"{where}: is no CSV file: {error}") from error
    header = [cell.strip() for cell in lines[0][1]] if lines else []
    allowed = [*joints, *(f"{joint}_velocity" for joint in joints)]
    problems = [
        f"{where}:1: unknown column '{name}'.{did_you_mean(name, allowed)}" for name in header if name not in allowed
    ]
    problems += [f"{where}:1: column '{joint}' is missing" for joint in joints if joint not in header]
    problems += [
        f"{where}:1: column '{name}' stands there twice" for name in sorted({*header}) if header.count(name) > 1
    ]
    if problems:
        raise SettingsError(
            "\n".join([*problems, f"Columns are joints, rad or m, and optionally {allowed[-1]} and so on"])
        )
    states = np.zeros((len(lines) - 1, 2, len(joints)))
    for state, (line, row) in zip(states, lines[1:], strict=True):
        if len(row) != len(header):
            raise SettingsError(f"{where}:{line}: has {len(row)} cells, the header {len(header)}")
        for name, cell in zip(header, row, strict=True):
            kind, joint = (0, joints.index(name)) if name in joints else (1, allowed.index(name) - len(joints))
            try:
                state[kind, joint] = float(cell)
            except ValueError:
                raise SettingsError(f"{where}:{line}: {name}: '{cell}' is not a number") from None
    return states


TRIES = 50
"""Draws of a random configuration before one in which links touch is taken."""
FREE_RANGE = {True: math.pi, False: 1.0}
"""Half the range, rad or m, of random positions of a joint without limits that turns or slides."""


def starts(plant: Plant, settings: Settings, rollouts: range) -> tuple[Array, Array]:
    """Return joint positions and velocities at the start of some rollouts, each of shape (batch, n).

    Random configurations lie inside the limits, uniformly, and no links touch in them if that can be had.
    """
    shape = (len(rollouts), plant.n)
    if settings.start_states is not None:
        states = settings.start_states
        if len(states) == 1:
            states = np.broadcast_to(states, (len(rollouts), 2, plant.n))
        else:
            states = states[rollouts.start : rollouts.stop]
        return states[:, 0].copy(), states[:, 1].copy()
    if settings.start == "random":
        return _random(plant, settings.seed, rollouts), np.zeros(shape)
    q = plant.home if settings.start == "home" else np.zeros(plant.n)
    return np.broadcast_to(q, shape).copy(), np.zeros(shape)


def check_start(plant: Plant, q: Array, what: str) -> None:
    """Require joint positions, shape (count, n), to be inside the limits.

    Raises:
        ConfigurationError: they are not; the error names the first that is not.
    """
    outside = (q < plant.lower) | (q > plant.upper)
    if outside.any():
        row, joint = (int(k) for k in np.argwhere(outside)[0])
        unit = "rad" if plant.turns[joint] else "m"
        where = f" of rollout {row}" if len(q) > 1 else ""
        raise ConfigurationError(
            f"start {what}: {plant.joints[joint]}{where} would start at {q[row, joint]:g} {unit}, outside its limits "
            f"{plant.lower[joint]:g} to {plant.upper[joint]:g} {unit}"
        )


def _random(plant: Plant, seed: int, rollouts: range) -> Array:
    half = np.array([FREE_RANGE[turns] for turns in plant.turns])
    lower = np.where(np.isfinite(plant.lower), plant.lower, -half)
    upper = np.where(np.isfinite(plant.upper), plant.upper, half)
    sources = Generators(seed, rollouts, Purpose.START)
    batch = Batch(plant.model, len(rollouts), nthread=1)
    first = 7 if plant.floating else 0
    qpos, contacts = batch.bind("qpos"), batch.bind("ncon")
    q = np.zeros((len(rollouts), plant.n))
    left = np.arange(len(rollouts))
    for _ in range(TRIES):
        for i in left.tolist():
            q[i] = sources[i].uniform(lower, upper)
        qpos[left, first:] = q[left]
        forward(batch, left)
        left = left[contacts[left] > 0]
        if not len(left):
            break
    return q
