"""Description of a run: what is simulated and recorded, and how often."""

from __future__ import annotations

import copyreg
import math
import operator
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from functools import partial
from os import PathLike
from types import MappingProxyType
from typing import Any, Final, SupportsIndex, TypedDict, Unpack

from dh2sim.errors import SettingsError
from dh2sim.messages import did_you_mean, listed
from dh2sim.simulate.designs import DesignTable, Draw, read_design_table, read_draws
from dh2sim.simulate.quantities import checked_settings

RECORDABLE: Final = ("qpos", "qvel", "ctrl", "tool_pose", "reference", "qacc", "torque", "energy", "contacts")
"""What ``record`` may contain."""
DEFAULT_RECORD: Final = ("qpos", "qvel", "ctrl", "tool_pose", "reference")
"""'reference' is recorded for controllers that follow one."""
STARTS: Final = ("home", "zero", "random")
AUTO: Final = "auto"
REFERENCE: Final = "reference"
INTEGRATORS: Final = ("Euler", "RK4", "implicit", "implicitfast")
WARP: Final = "warp"
ENGINES: Final = ("mujoco", WARP)
"""What simulates: MuJoCo, or MuJoCo Warp on a GPU."""
DEFAULT_DURATION: Final = 2.0
"""s."""
MOST_STEPS: Final = 10**12
"""Years of computing."""
MOST_ROLLOUTS: Final = 10**7


def _frozen(values: dict[str, Any]) -> MappingProxyType[str, Any]:
    return MappingProxyType(values)


# options and jobs are sent to other processes, and Python's read-only mapping cannot be pickled by itself
copyreg.pickle(MappingProxyType, lambda values: (_frozen, (dict(values),)))


class RolloutKeywords(TypedDict, total=False):
    """What a ``RolloutOptions`` is made from; each keyword may be left out."""

    rollouts: SupportsIndex
    steps: SupportsIndex | None
    duration: float | None
    timestep: float
    integrator: str
    controller: str | type
    start: str
    seed: SupportsIndex
    record: str | Sequence[str]
    every: SupportsIndex
    randomize: Mapping[str, float | str]
    floating_base: bool
    vary: Mapping[str, str | float | Draw]
    designs: str | PathLike[str] | Mapping[str, Any] | DesignTable | None
    per_design: SupportsIndex | None
    engine: str


class _OptionError(Exception):
    """A value cannot be used; each of its arguments is a message that follows the option's name."""


def _whole(value: object, *, least: int, most: int | None = None, advice: str = "") -> int:
    try:
        number = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise _OptionError(f"must be a whole number, got {value!r}") from None
    if number < least:
        raise _OptionError(f"must be at least {least}, got {number}")
    if most is not None and number > most:
        raise _OptionError(f"must be at most {most:,}, got {number}{advice}")
    return number


def _number(value: object) -> float:
    if isinstance(value, str | bool) or not hasattr(value, "__float__"):
        raise _OptionError(f"must be a number, got {value!r}")
    return float(value)


def _timestep(value: object) -> float:
    number = _number(value)
    if not 0.0 < number <= 1.0:
        raise _OptionError(f"must be above 0 s and at most 1 s, got {number}")
    return number


def _steps(duration: object, timestep: float) -> int:
    """Return how many time steps a duration takes."""
    length = DEFAULT_DURATION if duration is None else _number(duration)
    if not (math.isfinite(length) and length > 0.0):
        raise _OptionError(f"must be a finite time above 0 s, got {length}")
    if length / timestep > MOST_STEPS:
        raise _OptionError(f"must be at most {MOST_STEPS:,} time steps of {timestep:g} s, got {length:g}")
    steps = round(length / timestep)
    if abs(steps * timestep - length) > 1e-9 * length:
        near = max(1, steps)
        raise _OptionError(
            f"must be a whole number of time steps of {timestep:g} s, got {length:g}; "
            f"{near * timestep:g} s is {near} step{'s' if near > 1 else ''}"
        )
    return steps


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise _OptionError(f"must be text, got {value!r}")
    return value


def _controller(value: object) -> str | type:
    return value if isinstance(value, type) else _text(value)


def _one_of(names: Sequence[str], value: object) -> str:
    """Return one of some names as it is spelt there."""
    found = [name for name in names if name.lower() == _text(value).lower()]
    if not found:
        guess = did_you_mean(_text(value), names)
        raise _OptionError(f"must be one of {listed(names)}, got {value!r}.{guess}".rstrip("."))
    return found[0]


def _record(value: object) -> tuple[str, ...]:
    """Return recorded quantities in the order of ``RECORDABLE``, each once."""
    given = value.split(",") if isinstance(value, str) else value
    if not isinstance(given, Iterable):
        raise _OptionError(f"must be names, got {value!r}")
    names = [name for name in (_text(name).strip() for name in given) if name]
    if not names:
        raise _OptionError(f"must not be empty. Allowed: {listed(RECORDABLE)}")
    if unknown := _unknown(names, RECORDABLE):
        raise _OptionError(*unknown)
    return tuple(name for name in RECORDABLE if name in names)


def _randomize(value: object) -> Mapping[str, float | str]:
    """Return settings in the order of ``QUANTITIES``."""
    if not isinstance(value, Mapping):
        raise _OptionError(f"must map names to numbers or distributions, got {value!r}")
    settings = {_text(name): each if isinstance(each, str) else _number(each) for name, each in value.items()}
    found, problems = checked_settings(settings)
    if problems:
        raise _OptionError(*problems)
    return MappingProxyType(found)


def _unknown(names: Iterable[Any], known: Sequence[str]) -> list[str]:
    return [
        f"must not contain {name!r}.{did_you_mean(_text(name), known)} Allowed: {listed(known)}"
        for name in names
        if name not in known
    ]


def _yes_or_no(value: object) -> bool:
    if not isinstance(value, bool):
        raise _OptionError(f"must be True or False, got {value!r}")
    return value


def _option(default: Any, read: Callable[[Any], Any]) -> Any:
    return field(default=default, metadata={"read": read})


@dataclass(frozen=True, kw_only=True, init=False)
class RolloutOptions:
    """What is simulated in a run, and what is recorded.

    The numbers of a run depend on these options, the robot, and the files that they name, and on nothing else.
    """

    rollouts: int = _option(
        256, partial(_whole, least=1, most=MOST_ROLLOUTS, advice="; make several runs with other seeds")
    )
    """Number of rollouts."""
    steps: int = _option(1000, partial(_whole, least=1, most=MOST_STEPS))
    """Time steps of each rollout; by default as many as ``duration`` takes, 2 s."""
    timestep: float = _option(0.002, _timestep)
    """s."""
    integrator: str = _option("implicitfast", partial(_one_of, INTEGRATORS))
    """'Euler', 'RK4', 'implicit' or 'implicitfast'."""
    controller: str | type = field(default="sine", metadata={"read": _controller})
    """``NAME`` or ``NAME:key=value,…``; of your own ``MODULE:CLASS``, ``MODULE:CLASS:key=value,…``, or the class."""
    start: str = _option(AUTO, _text)
    """'home', 'zero', 'random', a configuration of the robot file, or a .csv or .npy file of states; 'reference':
    where the file begins that the controller follows; 'auto': that if there is one, else home."""
    seed: int = _option(0, partial(_whole, least=0))
    """Seed of the random number generators. The same seed gives the same bits at any number of threads."""
    record: tuple[str, ...] = _option(DEFAULT_RECORD, _record)
    """What is recorded, in the order of ``RECORDABLE``; may be given as one text with commas."""
    every: int = _option(1, partial(_whole, least=1))
    """Every N-th state is recorded; divides ``steps``."""
    randomize: Mapping[str, float | str] = field(
        default_factory=lambda: MappingProxyType({}), metadata={"read": _randomize}
    )
    """What is random, by the names of ``quantities.QUANTITIES``, with or without the name of a link, joint or row in
    brackets: a number, or a distribution as text."""
    floating_base: bool = _option(False, _yes_or_no)
    """Whether base_link floats."""
    vary: Mapping[str, Draw] = field(default_factory=lambda: MappingProxyType({}), metadata={"read": read_draws})
    """Numbers of the robot file that are drawn for each design, and how: ``0.05`` (a factor from 0.95 to 1.05),
    ``normal:SD``, ``uniform:LOW:HIGH`` or ``loguniform:LOW:HIGH``, in the units of the robot file."""
    designs: DesignTable | None = field(default=None, metadata={"read": read_design_table})
    """A CSV file of designs, or a mapping of names to values: a column for each number that differs."""
    per_design: int = _option(1, partial(_whole, least=1, most=MOST_ROLLOUTS))
    """Successive rollouts that have one design; with ``designs`` by default as many as ``rollouts`` allows."""
    engine: str = _option("mujoco", partial(_one_of, ENGINES))
    """'mujoco', or 'warp': MuJoCo Warp, on a GPU, whose numbers are near MuJoCo's and never the same bits."""

    def __init__(self, **given: Unpack[RolloutKeywords]) -> None:
        """Check the options.

        Args:
            **given: The fields, or in place of ``steps`` the ``duration`` of a rollout, s.

        Raises:
            SettingsError: Options are wrong; the error has a line for each.
        """
        values: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
        duration = values.pop("duration", None)
        wrong: dict[str, Sequence[object]] = {}
        for option in fields(self):
            value = MappingProxyType({}) if option.default is MISSING else option.default
            if option.name in values:
                try:
                    value = option.metadata["read"](values[option.name])
                except _OptionError as error:
                    wrong[option.name] = error.args
                except SettingsError as error:
                    wrong[option.name] = [problem for _, problem in error.problems]
            object.__setattr__(self, option.name, value)
        known = RolloutKeywords.__annotations__
        wrong |= {name: [f"is not an option.{did_you_mean(name, known)}"] for name in values if name not in known}
        if duration is not None and "steps" in values:
            wrong["duration"] = ["must not be given together with steps"]
        elif "steps" not in values and "timestep" not in wrong:
            try:
                object.__setattr__(self, "steps", _steps(duration, self.timestep))
            except _OptionError as error:
                wrong["duration"] = error.args
        if not {"steps", "duration", "timestep", "every"} & {*wrong} and self.steps % self.every:
            wrong["every"] = [f"must divide the {self.steps} steps of a rollout, got {self.every}"]
        wrong |= self._count_designs({*values} - {*wrong})
        if self.engine == WARP and self.integrator == "RK4" and {"energy", "contacts"} & {*self.record}:
            wrong["record"] = ["must not contain 'energy' or 'contacts' with RK4 and the engine 'warp'; use Euler"]
        if self.integrator == "RK4" and "qacc" in self.record:
            wrong["record"] = ["must not contain 'qacc' with RK4, which overwrites the acceleration; use Euler"]
        if wrong:
            raise SettingsError((name, str(problem)) for name, problems in wrong.items() for problem in problems)

    def _count_designs(self, given: Collection[str]) -> dict[str, Sequence[object]]:
        """Set how many rollouts there are, or how many each design has, and return what is wrong with them."""
        if self.designs is None:
            if self.per_design != 1 and not self.vary:
                return {"per_design": ["must be given together with vary or designs"]}
            return {}
        twice = [name for name in self.vary if name in self.designs.columns]
        if twice:
            return {"vary": [f"must not contain {listed(twice)}, which the designs have too"]}
        count = len(self.designs)
        if "rollouts" in given:
            if "per_design" not in given:
                object.__setattr__(self, "per_design", max(1, self.rollouts // count))
            if self.rollouts != count * self.per_design:
                problem = f"must be a multiple of the {count} designs, got {self.rollouts}"
                if "per_design" in given:
                    problem = f"must be {count * self.per_design} for {count} designs, got {self.rollouts}"
                return {"rollouts": [problem]}
        elif count * self.per_design > MOST_ROLLOUTS:
            return {"designs": [f"must give at most {MOST_ROLLOUTS:,} rollouts, got {count * self.per_design:,}"]}
        object.__setattr__(self, "rollouts", count * self.per_design)
        return {}

    @property
    def records(self) -> int:
        """Number of recorded intervals, K; states are recorded at K + 1 instants."""
        return self.steps // self.every

    def replace(self, **changes: Unpack[RolloutKeywords]) -> RolloutOptions:
        """Return the same options with some changed."""
        kept: Any = {option.name: getattr(self, option.name) for option in fields(self)}
        return RolloutOptions(**{**kept, **changes})

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, which ``from_json`` reads."""
        values = {option.name: getattr(self, option.name) for option in fields(self)}
        vary, designs, per_design = (values.pop(name) for name in ("vary", "designs", "per_design"))
        values |= {"record": list(self.record), "randomize": dict(self.randomize)}
        if self.engine == ENGINES[0]:
            del values["engine"]  # as in runs from before there was another one
        if vary:
            values["vary"] = {name: str(draw) for name, draw in vary.items()}
        if designs is not None:
            values["designs"] = designs.name
        return {**values, "per_design": per_design} if vary or designs is not None else values

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> RolloutOptions:
        """Make options from JSON values, such as the attribute ``settings`` of a dataset; other keys are ignored."""
        known: Any = {option.name: values[option.name] for option in fields(cls) if option.name in values}
        if not known.get("designs"):  # those of a run that was made in code are in its variables alone
            known.pop("designs", None)
        return cls(**known)
