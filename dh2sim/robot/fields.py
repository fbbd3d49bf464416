"""Types of the values in a robot file: how each is read, checked and described in the JSON Schema."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Final, NoReturn, TypeAlias

from pydantic import AfterValidator, BeforeValidator, PlainValidator, ValidationInfo, WithJsonSchema
from pydantic_core import PydanticCustomError

from dh2sim.robot.number import NumberError, to_number
from dh2sim.robot.words import did_you_mean, listed, shown

PROBLEM: Final = "dh2sim"
"""Type of the validation errors that carry a whole message."""
NAME_PATTERN: Final = "^[A-Za-z][A-Za-z0-9_-]*$"
LONGEST_NAME: Final = 100
_RESERVED: Final = re.compile(r"base_link-base|flange-tool0|base_link-dh_0|link_[0-9]+-(flange|dh_[0-9]+)")
MESH_SUFFIXES: Final = (".stl", ".obj", ".ply", ".glb")


@dataclass(frozen=True, slots=True, kw_only=True)
class Context:
    """What validators need to know besides the value."""

    parameters: Mapping[str, float]
    """Evaluated; NaN for a parameter that is wrong, which has been reported."""
    directory: Path | None
    """Where paths in the file start; None where it may name no files."""


def name_problem(value: object, what: str = "a name") -> str | None:
    """Return what is wrong with the name of a robot, a joint or a configuration, or None."""
    if isinstance(value, str) and len(value) > LONGEST_NAME:
        return f"{what} has at most {LONGEST_NAME} characters, found {len(value)}"
    if isinstance(value, str) and re.fullmatch(NAME_PATTERN[1:-1], value):
        return None
    allowed = "letters, digits, '_' and '-', starting with a letter"
    return f"{what} is made of {allowed}; found {shown(value)}"


def is_reserved(name: str) -> bool:
    """Whether a joint cannot have this name, which a fixed joint of the exports has."""
    return _RESERVED.fullmatch(name) is not None


def _fail(message: str) -> NoReturn:
    raise PydanticCustomError(PROBLEM, "{message}", {"message": message})


def _name(value: object) -> str:
    if problem := name_problem(value):
        _fail(problem)
    return str(value)


def _text(value: object) -> str:
    if not isinstance(value, str):
        hint = "; put it in quotes" if isinstance(value, bool | int | float) else ""
        _fail(f"expected text, found {shown(value)}{hint}")
    return value


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        _fail(f"expected true or false, found {shown(value)}")
    return value


def _context(info: ValidationInfo) -> Context:
    if not isinstance(info.context, Context):
        raise TypeError("a robot file is validated with a Context")
    return info.context


def _number(value: object, info: ValidationInfo) -> float:
    try:
        return to_number(value, _context(info).parameters)
    except NumberError as error:
        _fail(str(error))


def _checked(wrong: Callable[[float], bool], allowed: str) -> Callable[[object, ValidationInfo], float]:
    """Return a reader of numbers that complains of some, but never of NaN (reported elsewhere)."""

    def read(value: object, info: ValidationInfo) -> float:
        number = _number(value, info)
        if wrong(number):
            result = f" = {number!r}" if isinstance(value, str) else ""
            _fail(f"{allowed}, found {shown(value)}{result}")
        return number

    return read


def _number_schema(**limits: float) -> WithJsonSchema:
    return WithJsonSchema({"type": ["number", "string"], **limits})


_positive = _checked(lambda number: number <= 0, "must be greater than 0")
_not_negative = _checked(lambda number: number < 0, "must not be negative")
_fraction = _checked(lambda number: number < 0 or number > 1, "must be from 0 to 1")


def length_is(*counts: int, of: str) -> BeforeValidator:
    """Return a check that a value is a list of one of these lengths."""

    def check(value: object) -> object:
        expected = f"expected a list of {' or '.join(map(str, counts))} numbers ({of})"
        if not isinstance(value, list):
            _fail(f"{expected}, found {shown(value)}")
        if len(value) not in counts:
            _fail(f"{expected}, found a list of {len(value)}")
        return value

    return BeforeValidator(check)


def one_of(choices: type[StrEnum]) -> BeforeValidator:
    """Return a check that a value is a member of an enumeration."""
    names = [choice.value for choice in choices]

    def check(value: object) -> object:
        if value not in names:
            guess = did_you_mean(value, names) if isinstance(value, str) else ""
            _fail(f"found {shown(value)}.{guess} Allowed: {listed(names)}")
        return value

    return BeforeValidator(check)


def _ordered(limits: tuple[float, float]) -> tuple[float, float]:
    lower, upper = limits
    if lower >= upper:
        _fail(f"the lower limit {lower!r} is not below the upper limit {upper!r}")
    return limits


def _mesh_file(value: object, info: ValidationInfo) -> Path:
    text = _text(value)
    directory = _context(info).directory
    if directory is None:  # nothing is looked for: an answer would tell what there is on this machine
        _fail(f"found {shown(text)}; a robot file that was uploaded cannot name mesh files")
    path = directory / text
    if path.suffix.lower() not in MESH_SUFFIXES:
        _fail(f"{shown(text)} is no mesh file that can be read; allowed: {listed(MESH_SUFFIXES)}")
    try:
        exists = path.is_file()
    except (OSError, ValueError):
        exists = False
    if not exists:
        _fail(f"there is no file {shown(text)} in {directory.absolute()}")
    return path.absolute()


def _parameters(_value: object, info: ValidationInfo) -> Mapping[str, float]:
    return _context(info).parameters


Name: TypeAlias = Annotated[
    str,
    PlainValidator(_name),
    WithJsonSchema({"type": "string", "pattern": NAME_PATTERN, "maxLength": LONGEST_NAME}),
]
Text: TypeAlias = Annotated[str, BeforeValidator(_text)]
Flag: TypeAlias = Annotated[bool, BeforeValidator(_flag)]

Number: TypeAlias = Annotated[float, PlainValidator(_number), _number_schema()]
Positive: TypeAlias = Annotated[float, PlainValidator(_positive), _number_schema(exclusiveMinimum=0)]
NotNegative: TypeAlias = Annotated[float, PlainValidator(_not_negative), _number_schema(minimum=0)]
Fraction: TypeAlias = Annotated[float, PlainValidator(_fraction), _number_schema(minimum=0, maximum=1)]

Vector: TypeAlias = Annotated[tuple[Number, Number, Number], length_is(3, of="x, y, z")]
Angles: TypeAlias = Annotated[tuple[Number, Number, Number], length_is(3, of="roll, pitch, yaw")]
Range: TypeAlias = Annotated[tuple[Number, Number], length_is(2, of="lower, upper"), AfterValidator(_ordered)]
_COLOR_SCHEMA: Final[dict[str, Any]] = {
    "type": "array",
    "items": {"type": ["number", "string"], "minimum": 0, "maximum": 1},
    "minItems": 3,
    "maxItems": 4,
}
Color: TypeAlias = Annotated[
    tuple[Fraction, ...], length_is(3, 4, of="red, green, blue, alpha"), WithJsonSchema(_COLOR_SCHEMA)
]

MeshFile: TypeAlias = Annotated[Path, PlainValidator(_mesh_file), WithJsonSchema({"type": "string"})]
Parameters: TypeAlias = Annotated[
    Mapping[str, float],
    PlainValidator(_parameters),
    WithJsonSchema(
        {
            "type": "object",
            "propertyNames": {"pattern": "^[A-Za-z_][A-Za-z0-9_]*$"},
            "additionalProperties": {"type": ["number", "string"]},
        }
    ),
]
