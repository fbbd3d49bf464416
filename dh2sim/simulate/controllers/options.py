"""Options of a controller: what its constructor's signature says of them, and values read from text.

Which controller a run uses, and with which options.

``NAME:key=value,…`` as typed: how it is taken apart, and how it is written.
"""

from __future__ import annotations

import inspect
import math
import sys
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final, Literal

from dh2sim.errors import ControllerError
from dh2sim.messages import did_you_mean, listed
from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.controllers.protocol import Controller, RolloutBatch


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerChoice:
    """A controller by name, with its options checked."""

    text: str
    """As on the command line, ``NAME`` or ``NAME:key=value,…``: all options that were given, in a fixed order."""
    name: str
    make: Callable[[RolloutBatch], Controller] = field(compare=False, repr=False)
    """Makes the controller of a group of rollouts, options already bound."""
    actuation: ActuatorType | None
    """The actuators that the model is simulated with, one at every joint (none: no actuators at all); None: those of
    the robot file."""
    options: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}), compare=False)
    digest: str = ""
    """SHA-256 of what the options do not show: files that the controller reads, code that is not dh2sim's own."""
    follows: bool = False
    """Whether it follows a reference, which can be recorded."""


_QUOTES = "\"'"


def split_pairs(text: str) -> tuple[list[tuple[str, str]], list[str]]:
    """Take ``key=value,key=value`` apart.

    A value that holds a comma, or spaces at its ends, stands in quotation marks.

    Args:
        text: what follows the controller's name; may be empty.

    Returns:
        Keys with their values in the order given, and what is wrong, a sentence each.
    """
    pairs: list[tuple[str, str]] = []
    problems = []
    for part in _split(text):
        key, equals, value = part.partition("=")
        key, value = key.strip(), value.strip()
        if not equals or not key:
            problems.append(f"{part.strip()!r} is not of the form key=value")
        elif value[:1] in _QUOTES and value[:1]:
            if len(value) < 2 or value[-1] != value[0]:
                problems.append(f"the value of '{key}' has a quotation mark {value[0]} that is not closed")
            else:
                pairs.append((key, value[1:-1]))
        else:
            pairs.append((key, value))
    return pairs, problems


def join_pairs(name: str, pairs: Iterable[tuple[str, object]]) -> str:
    """Write a controller's name with options, so that ``split_pairs`` gives the same values back."""
    text = ",".join(f"{key}={_quoted(value_text(value))}" for key, value in pairs)
    return f"{name}:{text}" if text else name


def value_text(value: object) -> str:
    """Return an option's value as it is typed."""
    match value:
        case None:
            return "none"
        case bool():
            return "true" if value else "false"
        case float() if value.is_integer() and abs(value) < 1e15:
            return str(int(value))
        case float():
            return repr(value)
        case _:
            return str(value)


def _split(text: str) -> list[str]:
    """Split at commas that are in no value's quotation marks; empty parts are left out."""
    parts = [""]
    quote = ""
    for character in text:
        if quote:
            quote = "" if character == quote else quote
        elif character in _QUOTES and parts[-1].rstrip().endswith("="):
            quote = character
        elif character == ",":
            parts.append("")
            continue
        parts[-1] += character
    return [part for part in parts if part.strip()]


def _quoted(text: str) -> str:
    if "," not in text and text == text.strip() and text[:1] not in (*_QUOTES,):
        return text
    return f"'{text}'" if '"' in text else f'"{text}"'


_WORDS: Final = {
    "true": True,
    "yes": True,
    "on": True,
    "1": True,
    "false": False,
    "no": False,
    "off": False,
    "0": False,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Within:
    """Range of a number, for an annotation: ``gain: Annotated[float, Within(above=0)] = 1.0``."""

    above: float = -math.inf
    """The number is greater than this."""
    at_least: float = -math.inf
    at_most: float = math.inf
    below: float = math.inf
    """The number is less than this."""
    unit: str = ""

    def holds(self, value: float) -> bool:
        """Return whether a number is in the range."""
        return self.above < value < self.below and self.at_least <= value <= self.at_most

    def __str__(self) -> str:
        """Return, for example, ``above 0 Hz and at most 10 Hz``, or ``of at least 1``."""
        words = (("above", self.above), ("at least", self.at_least), ("at most", self.at_most), ("below", self.below))
        unit = f" {self.unit}" if self.unit else ""
        text = " and ".join(f"{word} {value_text(float(x))}{unit}" for word, x in words if math.isfinite(x))
        return f"of {text}" if text.startswith("at") else text


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """One option of a controller."""

    name: str
    parameter: str
    """Name in the signature; an underscore at its end, as in ``as_``, is no part of the option's name."""
    kind: type = str
    """float, int, bool or str."""
    choices: tuple[str, ...] = ()
    """What a str may be; empty: anything."""
    empty: bool = False
    """Whether it may be 'none'."""
    required: bool = False
    default: Any = None
    within: Within | None = None

    def __str__(self) -> str:
        """Return the name with its default."""
        return f"{self.name}=…" if self.required else f"{self.name}={value_text(self.default)}"

    def read(self, text: str) -> Any:
        """Return the value that ``text`` stands for.

        Raises:
            ValueError: it stands for none; the text says what is allowed.
        """
        if self.empty and text.casefold() == "none":
            return None
        value = self._read(text)
        if value is None:
            raise ValueError(f"option '{self.name}' must be {self._allowed()}, not {text!r}{self._guess(text)}")
        return value

    def _read(self, text: str) -> Any:
        if self.kind is bool:
            return _WORDS.get(text.casefold())
        if self.kind is str:
            return text if text and (not self.choices or text in self.choices) else None
        try:
            number = self.kind(text)
        except ValueError:
            return None
        return number if math.isfinite(number) and (self.within is None or self.within.holds(number)) else None

    def _allowed(self) -> str:
        if self.choices:
            words = listed(self.choices, " or ")
        else:
            words = {float: "a number", int: "a whole number", bool: "true or false", str: "some text"}[self.kind]
        if self.within is not None:
            words = f"{words} {self.within}"
        return f"{words}, or none" if self.empty else words

    def _guess(self, text: str) -> str:
        guess = did_you_mean(text, self.choices) if self.choices else ""
        return f".{guess}" if guess else ""


def options_of(constructor: Callable[..., object], module: str, *, skip: int) -> tuple[Option, ...]:
    """Return the options that a constructor takes.

    Args:
        constructor: a class or function; its parameters' annotations and defaults say what the options are.
        module: name of the module that annotations are looked up in, where the constructor does not say.
        skip: how many of the first parameters are no options.

    Raises:
        TypeError: a parameter cannot be an option; the text says which and why.
    """
    parameters = list(inspect.signature(constructor).parameters.values())
    first = parameters[:skip]
    if len(first) < skip or any(p.kind in (p.KEYWORD_ONLY, p.VAR_KEYWORD) for p in first):
        raise TypeError("its constructor must take a RolloutBatch as its first argument")
    named = [p for p in parameters[skip:] if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    # an inherited constructor knows the names of its own module
    written = getattr(constructor, "__init__", None) if isinstance(constructor, type) else constructor
    home = getattr(written, "__module__", None) or module
    return tuple(_option(parameter, home) for parameter in named)


def read_options(name: str, options: tuple[Option, ...], text: str) -> dict[str, Any]:
    """Return the options that ``text`` gives, in the order of ``options``.

    Args:
        name: of the controller, for messages.
        options: those that it has.
        text: ``key=value,…``; may be empty.

    Raises:
        ControllerError: anything is wrong with them; all of it is told.
    """
    pairs, problems = split_pairs(text)
    known = {option.name: option for option in options}
    unknown = [key for key, _ in pairs if key not in known]
    problems += [f"unknown option '{key}'.{did_you_mean(key, known)}" for key in unknown]
    keys = [key for key, _ in pairs]
    problems += [f"option '{key}' is given twice" for key in known if keys.count(key) > 1]
    problems += [f"option '{o.name}' is missing" for o in options if o.required and o.name not in keys]
    values: dict[str, Any] = {}
    for key, value in pairs:
        if key in known:
            try:
                values[key] = known[key].read(value)
            except ValueError as error:
                problems.append(str(error))
    if problems:
        allowed = f"Options: {listed(map(str, options))}" if options else "It has no options"
        raise ControllerError(told(name, [*problems, allowed]))
    return {key: values[key] for key in known if key in values}


def told(name: str, problems: Iterable[str]) -> str:
    """Return the text of an error: one line, or one a problem after a line that names the controller."""
    *rest, last = problems
    if len(rest) == 0:
        return f"controller '{name}': {last}"
    if len(rest) == 1:
        end = "" if rest[0].endswith((".", "?")) else "."
        return f"controller '{name}': {rest[0]}{end} {last}"
    return "\n  ".join([f"controller '{name}':", *rest, last])


def _option(parameter: inspect.Parameter, module: str) -> Option:
    if parameter.kind is parameter.POSITIONAL_ONLY:
        raise TypeError(f"parameter '{parameter.name}' cannot be given by name")
    required = parameter.default is parameter.empty
    default = None if required else parameter.default
    annotation = _resolved(parameter, module)
    if annotation is parameter.empty:
        annotation = str if default is None else type(default)
    within = None
    if typing.get_origin(annotation) is typing.Annotated:
        annotation, *extras = typing.get_args(annotation)
        within = next((extra for extra in extras if isinstance(extra, Within)), None)
    empty = default is None and not required
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        members = typing.get_args(annotation)
        rest = [member for member in members if member is not types.NoneType]
        empty = len(rest) < len(members)
        annotation = rest[0] if len(rest) == 1 else annotation
    choices: tuple[str, ...] = ()
    if typing.get_origin(annotation) is Literal:
        choices = typing.get_args(annotation)
        annotation = str if all(isinstance(choice, str) for choice in choices) else annotation
    if annotation not in (float, int, bool, str):
        raise TypeError(
            f"option '{_name(parameter)}' is of type {getattr(annotation, '__name__', annotation)}; "
            "it may be float, int, bool, str, a Literal of texts, or one of these or None"
        )
    return Option(
        name=_name(parameter),
        parameter=parameter.name,
        kind=annotation,
        choices=choices,
        empty=empty,
        required=required,
        default=default,
        within=within,
    )


def _name(parameter: inspect.Parameter) -> str:
    return parameter.name.removesuffix("_")


def _resolved(parameter: inspect.Parameter, module: str) -> Any:
    """Return an annotation, also one written as text; others of the same signature are not looked at."""
    holder = types.SimpleNamespace(__annotations__={"option": parameter.annotation})
    names: Mapping[str, Any] = vars(sys.modules[module]) if module in sys.modules else {}
    try:
        return typing.get_type_hints(holder, dict(names), include_extras=True)["option"]
    except Exception as error:  # whatever an expression can raise
        raise TypeError(f"the annotation of option '{_name(parameter)}' is not understood: {error}") from error
