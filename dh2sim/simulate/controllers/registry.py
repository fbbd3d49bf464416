"""The known controllers, and how one is chosen by a text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final

from dh2sim.errors import ControllerError
from dh2sim.messages import did_you_mean, listed
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.controllers.options import Option, join_pairs, options_of, read_options
from dh2sim.simulate.controllers.position import Hold, RandomSpline, Sine
from dh2sim.simulate.controllers.protocol import Controller, Prepared, RolloutBatch
from dh2sim.simulate.controllers.replay import Replay
from dh2sim.simulate.controllers.torque import PD, ComputedTorque, GravityCompensation, Passive
from dh2sim.simulate.controllers.user_code import (
    guard_methods,
    load_class,
    load_plugin,
    module_and_class,
    plugins,
    source_digest,
    user_code,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerChoice:
    """A controller with its options, as a run uses it."""

    text: str
    """``NAME`` or ``NAME:key=value,…``: all options that were given, in a fixed order."""
    name: str
    make: Callable[[RolloutBatch], Controller] = field(compare=False, repr=False)
    """Makes the controller of a batch of rollouts, options already bound."""
    actuation: ActuatorType | None
    """Actuators that the model is simulated with, one at every joint; None: those of the robot file."""
    options: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}), compare=False)
    digest: str = ""
    """SHA-256 of what the options do not show: files that the controller reads, and code outside dh2sim."""
    follows: bool = False
    """Whether it follows a reference, which can be recorded."""
    first: Mapping[str, float] | None = None
    """Where the reference of a file begins, by joint, rad and m."""
    own: bool
    """Whether the code is part of dh2sim."""


BUILT_IN: Final[Mapping[str, type]] = MappingProxyType(
    {
        "passive": Passive,
        "hold": Hold,
        "gravity-compensation": GravityCompensation,
        "pd": PD,
        "computed-torque": ComputedTorque,
        "sine": Sine,
        "random": RandomSpline,
        "replay": Replay,
    }
)


def choose(text: str | type) -> ControllerChoice:
    """Return the controller that a text names.

    Args:
        text: ``NAME`` or ``NAME:key=value,…`` of a controller of dh2sim or of an installed package, or
            ``MODULE:CLASS`` or ``MODULE:CLASS:key=value,…`` of a user's class; or the class, whose options have
            their defaults.

    Raises:
        ControllerError: The controller is unknown, its options or files are wrong, or its code failed.
    """
    if isinstance(text, type):
        return _choice(f"{text.__module__}:{text.__qualname__}", text, "", own=False)
    head, _, rest = text.partition(":")
    name = head.strip()
    if name in BUILT_IN:
        return _choice(name, BUILT_IN[name], rest, own=True)
    installed = plugins()
    if name in installed:
        return _choice(name, load_plugin(name, installed[name]), rest, own=False)
    written = module_and_class(text)
    if written is not None:
        module, class_name, options = written
        found = load_class(module, class_name)
        if found is not None:
            return _choice(f"{module}:{class_name}", found, options, own=False)
    known = [*BUILT_IN, *(plugin for plugin in installed if plugin not in BUILT_IN)]
    what = f"controller '{name}'" if written is None else f"controller and no module '{name}'"
    raise ControllerError(
        f"unknown {what}.{did_you_mean(name, known)} Known controllers: {listed(known)}; "
        "your own is named MODULE:CLASS"
    )


def slower(text: str) -> str | None:
    """Return a controller of dh2sim with twice the ``period`` of its reference; None for one without that option."""
    name, _, rest = text.partition(":")
    if name not in BUILT_IN:
        return None
    options = _options(name, BUILT_IN[name])
    defaults = {option.name: option.default for option in options}
    if "period" not in defaults:
        return None
    given = read_options(name, options, rest)
    if given.get("reference") is not None:
        return None
    given["period"] = 2.0 * given.get("period", defaults["period"])
    return join_pairs(name, given.items())


@dataclass(frozen=True, slots=True, kw_only=True)
class _Maker:
    """Makes the controller of a batch of rollouts; a class so that it can be sent to another process."""

    name: str
    make: Callable[..., Controller]
    options: Mapping[str, Any] = field(default_factory=dict)
    own: bool
    """Whether the code is part of dh2sim."""

    def __call__(self, batch: RolloutBatch) -> Controller:
        if self.own:
            with _named(self.name):
                return self.make(batch, **self.options)
        with user_code(self.name):
            controller = self.make(batch, **self.options)
        _check_methods(self.name, controller)
        return guard_methods(self.name, controller)


def _choice(name: str, found: type, text: str, *, own: bool) -> ControllerChoice:
    prepare = _prepare_of(found)
    options = _options(name, found)
    given = read_options(name, options, text)
    arguments = {option.parameter: given[option.name] for option in options if option.name in given}
    if prepare is None:
        _check_methods(name, found)
        prepared = Prepared(
            make=found,
            actuation=getattr(found, "actuation", None),
            follows=callable(getattr(found, "reference", None)),
        )
        maker = _Maker(name=name, make=found, options=arguments, own=own)
    else:
        with _named(name) if own else user_code(name):
            prepared = prepare(**arguments)
        maker = _Maker(name=name, make=prepared.make, own=own)
    code = "" if own else source_digest(found)
    return ControllerChoice(
        text=join_pairs(name, given.items()),
        name=name,
        make=maker,
        actuation=_actuation(name, prepared.actuation),
        options=MappingProxyType(given),
        digest=" ".join(filter(None, (code, prepared.digest))),
        follows=prepared.follows,
        first=prepared.first,
        own=own,
    )


def _prepare_of(found: type) -> Any:
    """Return a class's ``prepare``; None without one, or where the class replaces the constructor that it is for."""
    for kind in found.__mro__:
        if "prepare" in vars(kind):
            return getattr(found, "prepare", None)
        if "__init__" in vars(kind):
            return None
    return getattr(found, "prepare", None)


def _options(name: str, found: type) -> tuple[Option, ...]:
    """Return the options of ``prepare``, or of the constructor after its first argument."""
    prepare = _prepare_of(found)
    try:
        if prepare is None:
            return options_of(found, found.__module__, skip=1)
        return options_of(prepare, found.__module__, skip=0)
    except (TypeError, ValueError) as error:
        raise ControllerError(f"controller '{name}': {error}") from error


def _check_methods(name: str, found: object) -> None:
    """Require a controller, or its class, to have either ``control`` or ``controls``."""
    has = [method for method in ("control", "controls") if callable(getattr(found, method, None))]
    if len(has) != 1:
        raise ControllerError(
            f"controller '{name}' must have either control(observation) or controls(first, count), got "
            f"{'both' if has else 'neither'}"
        )


@contextmanager
def _named(name: str) -> Iterator[None]:
    """Put the controller's name before an error."""
    try:
        yield
    except ControllerError as error:
        raise ControllerError(f"controller '{name}': {error}") from error


def _actuation(name: str, value: object) -> ActuatorType | None:
    if value is None:
        return None
    known = [kind.value for kind in ActuatorType]
    if isinstance(value, str) and value in known:
        return ActuatorType(value)
    guess = did_you_mean(value, known) if isinstance(value, str) else ""
    raise ControllerError(
        f"controller '{name}': actuation must be {listed(repr(kind) for kind in known)}, or None for the robot's own "
        f"actuators, got {value!r}.{guess}".rstrip(".")
    )
