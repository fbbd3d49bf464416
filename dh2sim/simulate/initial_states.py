"""Initial states of rollouts: a named configuration, random ones, or those of a file."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from mujoco.batch import Batch

from dh2sim.errors import SettingsError
from dh2sim.formats.mjcf.mechanism import joint_coordinates
from dh2sim.input_files import NpyFile, csv_numbers, read_input, refuse_named_pipe, repeated
from dh2sim.messages import did_you_mean, listed
from dh2sim.model.mechanism import MechanismModel
from dh2sim.simulate.closed_loops import ClosedLoops
from dh2sim.simulate.mujoco_runtime import forward, set_models
from dh2sim.simulate.options import REFERENCE, STARTS, RolloutOptions
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.randomization import Generators, Purpose
from dh2sim.typing import Array, read_only

MOST_FILE_BYTES = 2**30
"""Largest file of states that is read."""
TRIES = 50
"""Draws of a random configuration before one in which links touch is taken."""

OPEN = 1e-6
"""By which loops may be open in states that are given: sizes of the mechanism, rad, and their rates."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class InitialStates:
    """Where rollouts start."""

    name: str
    """'random', or the configuration or file that ``given`` comes from."""
    given: Array | None = field(default=None, repr=False)
    """Joint positions and velocities, rad, m and their rates, shape (1 or rollouts, 2, n)."""
    closed: tuple[Array, Array] | None = field(default=None, repr=False)
    """MuJoCo's positions and velocities of all joints of a mechanism in them, shapes (…, nq) and (…, nv)."""
    digest: str = ""
    """SHA-256 of ``given``; empty for home and zero, which are the robot's."""
    named: bool = False
    """Whether it is a named configuration."""
    first: int = 0
    """The rollout that the first state is of, where there is one for each."""

    def states(
        self, plant: Plant, options: RolloutOptions, rollouts: Sequence[int], own: Array | None = None
    ) -> tuple[Array, Array]:
        """Return MuJoCo's positions and velocities at the start of some rollouts, shapes (batch, nq) and (batch, nv).

        Random configurations lie inside the limits, uniformly, and no links touch in them if such are found. Those of
        a mechanism are where its driven joints get to from the assembly. Rollouts with designs of their own that
        start in a named configuration do so in their design's, ``own``.
        """
        qpos, qvel = np.zeros((len(rollouts), plant.model.nq)), np.zeros((len(rollouts), plant.model.nv))
        if plant.floating:
            qpos[:, 3] = 1.0  # of the base's quaternion
        if own is not None and self.named:
            qpos[:, plant.positions] = own
            return qpos, qvel
        if self.given is None and plant.loops is not None:
            return _random_closed(plant, plant.loops, options.seed, rollouts), qvel
        if self.given is None:
            qpos[:, plant.positions] = _random(plant, options.seed, rollouts)
            return qpos, qvel
        chosen = np.zeros(1, dtype=int) if len(self.given) == 1 else np.asarray(rollouts) - self.first
        if self.closed is not None:
            qpos[:], qvel[:] = (of[chosen] for of in self.closed)
        else:
            qpos[:, plant.positions], qvel[:, plant.velocities] = self.given[chosen, 0], self.given[chosen, 1]
        return qpos, qvel

    def of(self, rollouts: range) -> InitialStates:
        """Return no more of them than what some rollouts need."""
        if self.given is None or len(self.given) == 1:
            return self
        part = slice(rollouts.start - self.first, rollouts.stop - self.first)
        closed = None if self.closed is None else (self.closed[0][part], self.closed[1][part])
        return replace(self, given=self.given[part], closed=closed, first=rollouts.start)

    def on_loops(self, plant: Plant, robot: MechanismModel) -> InitialStates:
        """Return the states with MuJoCo's positions and velocities of all joints, those inside closures too.

        Raises:
            SettingsError: Loops are open in a state, or its velocities would open them.
        """
        loops = plant.loops
        if self.given is None or loops is None:
            return self
        qpos = np.zeros((len(self.given), plant.model.nq))
        qpos[:, plant.positions] = self.given[:, 0]
        if plant.helpers:
            for row, q in zip(qpos, self.given[:, 0], strict=True):
                for name, value in joint_coordinates(robot, q).items():
                    row[plant.model.joint(name).qposadr[0]] = value
        v = self.given[:, 1]
        open_, qvel = loops.rates(qpos, v[:, list(plant.independent or ())])
        apart = np.abs(qvel[:, plant.velocities] - v).max(axis=1, initial=0.0) > OPEN * (
            1.0 + np.abs(v).max(initial=0.0)
        )
        for wrong, what in (
            (open_ > OPEN, "the loops are open"),
            (apart, "the velocities of passive joints are not those that the driven ones' give them"),
        ):
            if wrong.any():
                row = int(np.argmax(wrong))
                where = f" of rollout {row}" if len(qpos) > 1 else ""
                raise _refused(f"{self.name}: in the state{where} {what}")
        return replace(self, closed=(read_only(qpos), read_only(qvel)))

    def check(self, plant: Plant) -> None:
        """Require positions that are given to be inside the limits.

        Raises:
            SettingsError: They are not; the error names the first that is not.
        """
        if self.given is None or self.name == "home":  # home is inside but for rounding
            return
        q = self.given[:, 0]
        outside = (q < plant.lower) | (q > plant.upper)
        if outside.any():
            row, joint = (int(k) for k in np.argwhere(outside)[0])
            unit = "rad" if plant.turns[joint] else "m"
            where = f" of rollout {row}" if len(q) > 1 else ""
            raise _refused(
                f"{self.name}: {plant.joints[joint]}{where} would start at {q[row, joint]:g} {unit}, outside its "
                f"limits {plant.lower[joint]:g} to {plant.upper[joint]:g} {unit}"
            )


def _refused(problem: str) -> SettingsError:
    return SettingsError([("start", problem)])


def read_initial_states(
    start: str, joints: tuple[str, ...], configurations: Mapping[str, Array], rollouts: int
) -> InitialStates:
    """Read the option ``start``.

    Args:
        start: 'home', 'zero', 'random', a configuration of the robot file, or the path of a .csv or .npy file.
        joints: Names of the moving joints.
        configurations: Those that have a name, each of shape (n,).
        rollouts: Number of rollouts of the run.

    Raises:
        SettingsError: It is none of these, or the file is wrong.
    """
    path = Path(start)
    if start == "random":
        return InitialStates(name=start)
    if start in configurations:
        states = np.zeros((1, 2, len(joints)))
        states[0, 0] = configurations[start]
    elif path.suffix.lower() in (".csv", ".npy"):
        states = _read_file(path, joints, rollouts)
    else:
        known = list(dict.fromkeys([*STARTS, *configurations]))
        raise _refused(
            f"must be one of {listed(known)}, or a .csv or .npy file of joint positions, got {start!r}."
            f"{did_you_mean(start, known)}".rstrip(".")
        )
    frozen = read_only(states)
    digest = "" if start in STARTS else hashlib.sha256(frozen.tobytes()).hexdigest()
    return InitialStates(name=start, given=frozen, digest=digest, named=start in configurations)


def reference_start(first: Mapping[str, float] | None, joints: tuple[str, ...]) -> InitialStates:
    """Return the start of rollouts where the file begins that the controller follows.

    Args:
        first: Positions by joint, rad and m; None for a controller that follows no file.
        joints: Names of the moving joints.

    Raises:
        SettingsError: It follows none, or not with these joints.
    """
    if first is None:
        raise _refused(f"must not be '{REFERENCE}': the controller follows no file that begins somewhere")
    if set(first) != set(joints):
        raise _refused(f"the controller's file begins with joints {listed(first)}; the robot has {listed(joints)}")
    states = np.zeros((1, 2, len(joints)))
    states[0, 0] = [first[joint] for joint in joints]
    frozen = read_only(states)
    return InitialStates(name=REFERENCE, given=frozen, digest=hashlib.sha256(frozen.tobytes()).hexdigest())


def _read_file(path: Path, joints: tuple[str, ...], rollouts: int) -> Array:
    try:
        refuse_named_pipe(path)
        if path.stat().st_size > MOST_FILE_BYTES:
            raise _refused(f"{path}: is larger than {MOST_FILE_BYTES / 2**30:g} GB")
        states = _npy(path, joints) if path.suffix.lower() == ".npy" else _csv(path, joints)
    except OSError as error:
        raise _refused(f"{path}: cannot be read: {error.strerror or error}") from error
    if len(states) not in (1, rollouts):
        raise _refused(f"{path}: must contain 1 state, or one for each of {rollouts} rollouts, got {len(states)}")
    if not np.isfinite(states).all():
        row, _, joint = np.argwhere(~np.isfinite(states))[0]
        raise _refused(f"{path}: state {row + 1}, {joints[joint]}: must be a finite number")
    return states


def _npy(path: Path, joints: tuple[str, ...]) -> Array:
    n = len(joints)
    try:
        found = NpyFile(path)
        numbers: Array = found.all().astype(np.float64) if found.dtype.kind in "fiu" else np.zeros(0)
    except ValueError as error:
        raise _refused(f"{path}: {error}") from error
    if found.dtype.kind in "fiu":
        if numbers.shape == (n,):
            numbers = numbers[None]
        if numbers.ndim == 2 and numbers.shape[1] == n:
            return np.stack([numbers, np.zeros(numbers.shape)], axis=1)
        if numbers.ndim == 3 and numbers.shape[1:] == (2, n):
            return numbers
    raise _refused(
        f"{path}: must contain numbers of shape ({n},) or (rollouts, {n}), joint positions in rad and m, or "
        f"(rollouts, 2, {n}), positions and velocities; got {found.dtype} of shape {found.shape}"
    )


def _csv(path: Path, joints: tuple[str, ...]) -> Array:
    data = read_input(path, MOST_FILE_BYTES)
    if len(data) > MOST_FILE_BYTES:  # a device
        raise _refused(f"{path}: is larger than {MOST_FILE_BYTES / 2**30:g} GB")
    try:
        read = csv_numbers(data)
    except ValueError as error:
        raise _refused(f"{path}: {error}") from error
    header = read.header
    allowed = [*joints, *(f"{joint}_velocity" for joint in joints)]
    problems = [
        f"{path}:1: unknown column '{name}'.{did_you_mean(name, allowed)}" for name in header if name not in allowed
    ]
    problems += [f"{path}:1: missing column '{joint}'" for joint in joints if joint not in header]
    problems += [f"{path}:1: duplicate column '{name}'" for name in repeated(header)]
    if problems:
        columns = f"Columns are joints, rad or m, and optionally {allowed[-1]} and so on"
        raise SettingsError([*(("start", problem) for problem in problems), ("", columns)])
    if read.problems:
        raise SettingsError([("start", f"{path}: {problem}") for problem in read.problems])
    states = np.zeros((len(read.values), 2, len(joints)))
    for name, column in zip(header, read.values.T, strict=True):
        kind, joint = divmod(allowed.index(name), len(joints))
        states[:, kind, joint] = column
    return states


def _random(plant: Plant, seed: int, rollouts: Sequence[int]) -> Array:
    half, shape = plant.free_half_ranges, (len(rollouts), plant.n)
    lower = np.broadcast_to(np.where(np.isfinite(plant.lower), plant.lower, -half), shape)
    upper = np.broadcast_to(np.where(np.isfinite(plant.upper), plant.upper, half), shape)
    sources = Generators(seed, rollouts, Purpose.START)
    batch = Batch(plant.model, len(rollouts), nthread=1)
    set_models(batch, plant)
    qpos, contacts = batch.bind("qpos"), batch.bind("ncon")
    q = np.zeros((len(rollouts), plant.n))
    left = np.arange(len(rollouts))
    for _ in range(TRIES):
        for i in left.tolist():
            q[i] = sources[i].uniform(lower[i], upper[i])
        qpos[left, 7 if plant.floating else 0 :] = q[left]
        forward(batch, left)
        left = left[contacts[left] > 0]
        if not len(left):
            break
    return q


DRAWS = 10
"""Of driven joints from their whole range; after that, ever nearer to the assembly."""


def _random_closed(plant: Plant, loops: ClosedLoops, seed: int, rollouts: Sequence[int]) -> Array:
    """Return random positions of a mechanism, shape (batch, nq): where drawn driven joints are reached."""
    driven = plant.controlled
    half = driven.free_half_ranges
    lower = np.where(np.isfinite(driven.lower), driven.lower, driven.home - half)
    upper = np.where(np.isfinite(driven.upper), driven.upper, driven.home + half)
    sources = Generators(seed, rollouts, Purpose.START)
    start = np.tile(loops.start, (len(rollouts), 1))
    batch = Batch(plant.model, len(rollouts), nthread=1)
    place, contacts = batch.bind("qpos"), batch.bind("ncon")
    found, left = start.copy(), np.arange(len(rollouts))
    for draw in range(TRIES):
        share = 0.5 ** max(0, draw - DRAWS + 1)
        drawn = np.array([sources[i].uniform(lower, upper) for i in left.tolist()])
        qpos, reached = loops.follow(start[left], driven.home + share * (drawn - driven.home))
        place[left] = qpos
        forward(batch, left)
        reached &= contacts[left] == 0
        found[left[reached]] = qpos[reached]
        left = left[~reached]
        if not len(left):
            break
    return found
