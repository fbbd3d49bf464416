"""What is wanted of a run, and whether it can be had of any robot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from dh2sim.messages import did_you_mean, listed
from dh2sim.simulate.settings import DEFAULT_RECORD, RANDOMIZABLE, RECORDABLE

DURATION = 2.0
"""s, where neither steps nor duration are given."""
MOST_STEPS = 10**12
"""Time steps of a rollout: years of computing."""
MOST_ROLLOUTS = 10**7
"""Of one run; with other seeds there can be more runs."""
INTEGRATORS = {name.lower(): name for name in ("Euler", "RK4", "implicit", "implicitfast")}


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """What is wanted of a run; see ``dh2sim.simulate.rollout``."""

    rollouts: int = 256
    steps: int | None = None
    duration: float | None = None
    timestep: float = 0.002
    integrator: str = "implicitfast"
    controller: str = "sine"
    start: str = "home"
    seed: int = 0
    record: Sequence[str] = DEFAULT_RECORD
    every: int = 1
    randomize: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    floating_base: bool = False

    @property
    def integrator_name(self) -> str:
        """The integrator as MuJoCo spells it; empty if there is no such one."""
        return INTEGRATORS.get(self.integrator.lower(), "")

    @property
    def recorded(self) -> tuple[str, ...]:
        """What is recorded, in the order of ``RECORDABLE``."""
        return tuple(name for name in RECORDABLE if name in self.record)


def names_of(record: Sequence[str]) -> tuple[str, ...]:
    """Return names that may also be given as one text with commas between them."""
    names = record.split(",") if isinstance(record, str) else record
    return tuple(name.strip() for name in names if name.strip())


def check_wish(wish: Wish) -> tuple[int, list[str]]:
    """Return the time steps of a rollout, 0 if that is unclear, and everything that is wrong with a wish."""
    problems: list[str] = []
    steps = _steps(wish, problems)
    _check_numbers(wish, problems)
    _check_record(wish, problems)
    if not wish.integrator_name:
        problems.append(f"--integrator {wish.integrator}: allowed are {listed(list(INTEGRATORS.values()))}")
    if wish.integrator_name == "RK4" and "qacc" in wish.record:
        problems.append("--record qacc: RK4 does not tell the acceleration at the beginning of a step; use Euler")
    if steps and wish.every >= 1 and steps % wish.every:
        problems.append(f"--every {wish.every}: does not divide the {steps} steps of a rollout")
    return steps, problems


def _steps(wish: Wish, problems: list[str]) -> int:
    """Number of time steps; 0 where a problem was noted."""
    if not (math.isfinite(wish.timestep) and 0.0 < wish.timestep <= 1.0):
        problems.append(f"--timestep {wish.timestep}: is not between 0 and 1 s")
        return 0
    if wish.steps is not None:
        if wish.duration is not None:
            problems.append("--steps and --duration: give one of them, not both")
        elif wish.steps < 1:
            problems.append(f"--steps {wish.steps}: is not at least 1")
        elif wish.steps > MOST_STEPS:
            problems.append(f"--steps {wish.steps}: is more than {MOST_STEPS:,}")
        else:
            return wish.steps
        return 0
    duration = DURATION if wish.duration is None else wish.duration
    if not (math.isfinite(duration) and duration > 0.0):
        problems.append(f"--duration {duration}: is not a time above 0 s")
        return 0
    if duration / wish.timestep > MOST_STEPS:
        problems.append(f"--duration {duration:g}: is more than {MOST_STEPS:,} time steps of {wish.timestep:g} s")
        return 0
    steps = round(duration / wish.timestep)
    if abs(steps * wish.timestep - duration) > 1e-9 * duration:
        near = max(1, steps)
        problems.append(
            f"--duration {duration:g}: is not a whole number of time steps of {wish.timestep:g} s; "
            f"--steps {near} is {near * wish.timestep:g} s"
        )
        return 0
    return steps


def _check_numbers(wish: Wish, problems: list[str]) -> None:
    for name, value, least in (("rollouts", wish.rollouts, 1), ("every", wish.every, 1), ("seed", wish.seed, 0)):
        if value < least:
            problems.append(f"--{name} {value}: is not at least {least}")
    if wish.rollouts > MOST_ROLLOUTS:
        problems.append(
            f"--rollouts {wish.rollouts}: is more than {MOST_ROLLOUTS:,}; make several runs of other seeds"
        )
    for name, share in wish.randomize.items():
        if name not in RANDOMIZABLE:
            hint = did_you_mean(name, RANDOMIZABLE)
            problems.append(f"--randomize {name}: is not known.{hint} Allowed: {listed(RANDOMIZABLE)}")
        elif not (math.isfinite(share) and 0.0 <= share < 1.0):
            problems.append(f"--randomize {name}={share:g}: is not a share of at least 0 and below 1")


def _check_record(wish: Wish, problems: list[str]) -> None:
    problems += [
        f"--record {name}: is not known.{did_you_mean(name, RECORDABLE)} Allowed: {listed(RECORDABLE)}"
        for name in wish.record
        if name not in RECORDABLE
    ]
    if not wish.record:
        problems.append(f"--record: names nothing. Allowed: {listed(RECORDABLE)}")
