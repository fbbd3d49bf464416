"""Options of controllers: annotated parameters of a constructor, read from ``key=value,…`` with pydantic."""

from __future__ import annotations

import inspect
import sys
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.errors import PydanticUserError

from dh2sim.errors import ControllerError
from dh2sim.messages import did_you_mean, listed

_QUOTES: Final = "\"'"
_READING: Final = ConfigDict(allow_inf_nan=False)
_KINDS: Final = {"number": "a number", "integer": "a whole number", "boolean": "true or false", "string": "some text"}
_BOUNDS: Final = {
    "exclusiveMinimum": "above",
    "minimum": "at least",
    "maximum": "at most",
    "exclusiveMaximum": "below",
}
"""Keywords of a JSON Schema, and how a message names them."""


def Within(
    *,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    below: float | None = None,
    unit: str = "",
) -> Any:
    """Return the range of a number, for an annotation: it is put into ``Annotated`` with the type.

    It is pydantic's ``Field`` with ``gt``, ``ge``, ``le`` and ``lt``, which may be used itself.
    """
    return Field(gt=above, ge=at_least, le=at_most, lt=below, json_schema_extra={"unit": unit} if unit else None)


def split_pairs(text: str, alone: str | None = None) -> tuple[list[tuple[str, str]], list[str]]:
    """Split ``key=value,key=value``; a value alone may come first, for the option that ``alone`` names.

    A value that contains a comma, or has spaces at its ends, is put in quotation marks.

    Args:
        text: What follows the controller's name; may be empty.
        alone: An option's name; None where every value has a key.

    Returns:
        Keys with their values in the order given, and what is wrong.
    """
    pairs: list[tuple[str, str]] = []
    problems = []
    for number, part in enumerate(_split(text)):
        if number == 0 and alone is not None and "=" not in part:
            part = f"{alone}={part.strip()}"
        key, equals, value = part.partition("=")
        key, value = key.strip(), value.strip()
        if not equals or not key:
            problems.append(f"{part.strip()!r} is not of the form key=value")
        elif value[:1] in _QUOTES and value[:1]:
            if len(value) < 2 or value[-1] != value[0]:
                problems.append(f"the value of '{key}' has an unclosed quotation mark {value[0]}")
            else:
                pairs.append((key, value[1:-1]))
        else:
            pairs.append((key, value))
    return pairs, problems


def join_pairs(name: str, pairs: Iterable[tuple[str, object]]) -> str:
    """Return a controller's name with options, which ``split_pairs`` splits into the same values."""
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
    """Split at commas outside quotation marks; empty parts are left out."""
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """One option of a controller."""

    name: str
    parameter: str
    """Name in the signature; an underscore at its end, as in ``as_``, is not part of the option's name."""
    required: bool
    default: Any
    adapter: TypeAdapter[Any] = field(repr=False, compare=False)
    """Reads a value."""
    schema: Mapping[str, Any] = field(repr=False)
    """JSON Schema of the values other than None."""
    optional: bool
    """Whether the value may be None, which is typed as 'none'."""

    def __str__(self) -> str:
        """Return the name with its default."""
        return f"{self.name}=…" if self.required else f"{self.name}={value_text(self.default)}"

    def read(self, text: str) -> Any:
        """Return the value of a text.

        Raises:
            ValueError: It is not a value of this option; the message says what is allowed.
        """
        if self.optional and text.casefold() == "none":
            return None
        try:
            if text:
                return self.adapter.validate_strings(text)
        except ValidationError:
            pass
        guess = did_you_mean(text, self._choices) if self._choices else ""
        message = f"option '{self.name}' must be {self._allowed}, got {text!r}{guess and '.' + guess}"
        raise ValueError(message) from None

    @property
    def _choices(self) -> list[str]:
        return [*self.schema.get("enum", ()), *([self.schema["const"]] if "const" in self.schema else ())]

    @property
    def _allowed(self) -> str:
        """Return, for example, ``a number above 0 Hz and at most 10 Hz, or none``."""
        words = listed(self._choices, " or ") if self._choices else _KINDS[self.schema["type"]]
        unit = f" {self.schema['unit']}" if "unit" in self.schema else ""
        given = [(word, self.schema[key]) for key, word in _BOUNDS.items() if key in self.schema]
        bounds = " and ".join(f"{word} {value_text(float(bound))}{unit}" for word, bound in given)
        if bounds:
            words = f"{words} of {bounds}" if bounds.startswith("at") else f"{words} {bounds}"
        return f"{words}, or none" if self.optional else words


def options_of(constructor: Callable[..., object], module: str, *, skip: int) -> tuple[Option, ...]:
    """Return the options that a constructor takes.

    Args:
        constructor: A class or function; its parameters' annotations and defaults say what the options are.
        module: Name of the module that annotations are looked up in, where the constructor does not say.
        skip: Number of first parameters that are not options.

    Raises:
        TypeError: A parameter cannot be an option; the message says which and why.
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
        name: Name of the controller, for messages.
        options: Those that it has.
        text: ``key=value,…``; may be empty.

    Raises:
        ControllerError: Options are wrong; the error reports all that are.
    """
    required = [option.name for option in options if option.required]
    pairs, problems = split_pairs(text, required[0] if len(required) == 1 else None)
    known = {option.name: option for option in options}
    keys = [key for key, _ in pairs]
    problems += [f"unknown option '{key}'.{did_you_mean(key, known)}" for key in keys if key not in known]
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
        raise ControllerError(_report(name, problems, allowed))
    return {key: values[key] for key in known if key in values}


def _report(name: str, problems: list[str], allowed: str) -> str:
    """Return one line, or one for each problem after a line that names the controller."""
    if len(problems) == 1:
        end = "" if problems[0].endswith((".", "?")) else "."
        return f"controller '{name}': {problems[0]}{end} {allowed}"
    return "\n  ".join([f"controller '{name}':", *problems, allowed])


def _option(parameter: inspect.Parameter, module: str) -> Option:
    name = parameter.name.removesuffix("_")
    if parameter.kind is parameter.POSITIONAL_ONLY:
        raise TypeError(f"parameter '{parameter.name}' cannot be given by name")
    required = parameter.default is parameter.empty
    default = None if required else parameter.default
    annotation = _annotation(parameter, module)
    try:
        adapter = TypeAdapter(annotation, config=_READING)
        schema = adapter.json_schema()
    except PydanticUserError:
        raise _unreadable(name, annotation) from None
    kinds = [kind for kind in schema.get("anyOf", [schema]) if kind.get("type") != "null"]
    simple = len(kinds) == 1 and kinds[0].get("type") in _KINDS and "format" not in kinds[0]
    if not simple or not all(isinstance(choice, str) for choice in kinds[0].get("enum", ())):
        raise _unreadable(name, annotation)
    return Option(
        name=name,
        parameter=parameter.name,
        required=required,
        default=default,
        adapter=adapter,
        schema={**schema, **kinds[0]},
        optional="anyOf" in schema or (default is None and not required),
    )


def _unreadable(name: str, annotation: object) -> TypeError:
    return TypeError(
        f"option '{name}' is of type {getattr(annotation, '__name__', annotation)}; "
        "it may be float, int, bool, str, a Literal of texts, or one of these or None"
    )


def _annotation(parameter: inspect.Parameter, module: str) -> Any:
    """Return an annotation, also one written as text; without one, the type of the default."""
    if parameter.annotation is parameter.empty:
        plain = parameter.default is parameter.empty or parameter.default is None
        return str if plain else type(parameter.default)
    holder = types.SimpleNamespace(__annotations__={"option": parameter.annotation})
    names: Mapping[str, Any] = vars(sys.modules[module]) if module in sys.modules else {}
    try:
        return typing.get_type_hints(holder, dict(names), include_extras=True)["option"]
    except Exception as error:  # whatever an expression can raise
        name = parameter.name.removesuffix("_")
        raise TypeError(f"the annotation of option '{name}' is not understood: {error}") from error
