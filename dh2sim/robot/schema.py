"""The robot file as it is written, in its own units, as pydantic models and as JSON Schema.

Types of the values in a robot file: how each is read, checked and described in the JSON Schema.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Final, NoReturn, TypeAlias

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.robot.expressions import NumberError, to_number
from dh2sim.robot.spec import ActuatorType, AngleUnit, Convention, JointType, LengthUnit

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

_TRIANGLE_TOLERANCE: Final = 1e-9
"""By which two principal moments may fall short of the third, relative to it."""

ConventionField: TypeAlias = Annotated[Convention, one_of(Convention)]
ActuatorTypeField: TypeAlias = Annotated[ActuatorType, one_of(ActuatorType)]


class _Model(BaseModel):
    # built when the whole is first used, and then once: robot files are read by commands that should be quick
    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True, defer_build=True)


class UnitsEntry(_Model):
    """Units of the angles and lengths in this file."""

    angle: Annotated[AngleUnit, one_of(AngleUnit)] = Field(default=AngleUnit.RAD, description="Unit of angles.")
    length: Annotated[LengthUnit, one_of(LengthUnit)] = Field(default=LengthUnit.M, description="Unit of lengths.")


class MeshEntry(_Model):
    """A mesh file that shows a link."""

    file: MeshFile = Field(description="STL, OBJ, PLY or GLB file; relative to the folder of this file.")
    scale: Positive = Field(default=1.0, description="Metres per unit of the mesh file.")
    xyz: Vector = Field(
        default=(0.0, 0.0, 0.0),
        description="Position of the mesh file's own frame in the DH frame, in the file's length unit.",
    )
    rpy: Angles = Field(
        default=(0.0, 0.0, 0.0), description="Roll, pitch, yaw of it in the DH frame, in the file's angle unit."
    )


class PoseEntry(_Model):
    """A pose: position, and angles about fixed x, y, z as in URDF."""

    xyz: Vector = Field(default=(0.0, 0.0, 0.0), description="Position, in the file's length unit.")
    rpy: Angles = Field(default=(0.0, 0.0, 0.0), description="Roll, pitch, yaw, in the file's angle unit.")


class BaseEntry(PoseEntry):
    """Pose of DH frame 0 in base_link, and how the base looks."""

    mesh: MeshEntry | None = Field(default=None, description="Visual mesh, in DH frame 0.")
    color: Color | None = Field(default=None, description="Red, green, blue and optionally alpha, each 0 to 1.")


class InertiaEntry(_Model):
    """Inertia about the centre of mass along DH frame i's axes, kg·m²."""

    ixx: Number = Field(description="kg·m²")
    iyy: Number = Field(description="kg·m²")
    izz: Number = Field(description="kg·m²")
    ixy: Number = Field(default=0.0, description="kg·m²; the matrix entry, as in URDF.")
    ixz: Number = Field(default=0.0, description="kg·m²; the matrix entry, as in URDF.")
    iyz: Number = Field(default=0.0, description="kg·m²; the matrix entry, as in URDF.")

    @property
    def matrix(self) -> list[list[float]]:
        """The symmetric matrix, 3 × 3."""
        return [
            [self.ixx, self.ixy, self.ixz],
            [self.ixy, self.iyy, self.iyz],
            [self.ixz, self.iyz, self.izz],
        ]

    @model_validator(mode="after")
    def _is_of_a_body(self) -> InertiaEntry:
        matrix = np.array(self.matrix)
        scale = float(np.abs(matrix).max())
        if math.isnan(scale):
            return self
        a, b, c = np.linalg.eigvalsh(matrix / scale).tolist() if scale > 0 else (0.0, 0.0, 0.0)
        moments = ", ".join(f"{moment * scale:.6g}" for moment in (a, b, c))
        message = None
        if a <= 0:
            message = f"not positive definite: the principal moments are {moments}"
        elif a + b < c * (1 - _TRIANGLE_TOLERANCE):
            message = f"no body has the principal moments {moments}: two make less than the third"
        if message:
            raise PydanticCustomError(PROBLEM, "{message}", {"message": message})
        return self


class LinkEntry(_Model):
    """The link that a joint moves."""

    mass: Positive | None = Field(default=None, description="kg")
    com: Vector | None = Field(default=None, description="Centre of mass in DH frame i, in the file's length unit.")
    inertia: InertiaEntry | None = Field(default=None, description="About com, along DH frame i's axes, kg·m².")
    density: Positive | None = Field(
        default=None, description="kg/m³, for shapes made from the table; used where mass is not given."
    )
    radius: Positive | None = Field(
        default=None, description="Of the shapes made from the table, in the file's length unit."
    )
    color: Color | None = Field(default=None, description="Red, green, blue and optionally alpha, each 0 to 1.")
    mesh: MeshEntry | None = Field(default=None, description="Visual mesh, in DH frame i.")


class LimitsEntry(_Model):
    """Limits of a joint, in the file's units."""

    position: Range | None = Field(
        default=None, description="Lower and upper joint coordinate, in the file's angle or length unit."
    )
    velocity: Positive | None = Field(default=None, description="In the file's angle or length unit per second.")
    effort: Positive | None = Field(default=None, description="N·m or N.")


class DynamicsEntry(_Model):
    """Joint dynamics, in SI units."""

    damping: NotNegative = Field(default=0.0, description="N·m·s/rad or N·s/m.")
    friction: NotNegative = Field(default=0.0, description="Coulomb friction, N·m or N.")
    armature: NotNegative = Field(default=0.0, description="Rotor inertia seen at the joint, kg·m² or kg.")


class ActuatorEntry(_Model):
    """What drives a joint in the MJCF."""

    type: ActuatorTypeField | None = Field(default=None, description="What the control signal is; default position.")
    kp: Positive | None = Field(default=None, description="Position gain, N·m/rad or N/m; for position.")
    kv: Positive | None = Field(
        default=None, description="Velocity gain, N·m·s/rad or N·s/m; for position and velocity."
    )


class JointEntry(_Model):
    """A row of the DH table: its transform at coordinate zero, how it moves and what it carries."""

    name: Name | None = Field(default=None, description="Default joint_<i>, counted from 1.")
    type: Annotated[JointType, one_of(JointType)] = Field(description="How the row moves.")
    convention: ConventionField | None = Field(default=None, description="Overrides the file's for this row.")
    a: Number = Field(default=0.0, description="a_i (modified: a_{i-1}), in the file's length unit.")
    alpha: Number = Field(default=0.0, description="alpha_i (modified: alpha_{i-1}), in the file's angle unit.")
    d: Number = Field(
        default=0.0,
        description="d_i, in the file's length unit; a prismatic coordinate adds to it. "
        "A Hayati row has one only if it is prismatic.",
    )
    theta: Number = Field(
        default=0.0, description="theta_i, in the file's angle unit; a revolute coordinate adds to it."
    )
    beta: Number = Field(
        default=0.0, description="beta_i, second twist, about y, in the file's angle unit; of a Hayati row alone."
    )
    flip: Flag = Field(default=False, description="True: the joint coordinate subtracts instead.")
    limits: LimitsEntry = Field(default_factory=LimitsEntry, description="Limits, in the file's units.")
    dynamics: DynamicsEntry = Field(default_factory=DynamicsEntry, description="Joint dynamics, SI.")
    link: LinkEntry = Field(default_factory=LinkEntry, description="The link that this joint moves.")
    actuator: ActuatorEntry = Field(default_factory=ActuatorEntry, description="Overrides the file's actuators.")


class RobotEntry(_Model):
    """A robot described by its Denavit-Hartenberg table.

    A number may be an arithmetic expression in a string: + - * / **, parentheses, parameters, pi, sqrt, sin,
    cos, tan, asin, acos, atan, atan2 (arguments in radians).
    """

    name: Name = Field(description="Name of the robot; names the exported files.")
    description: Text = Field(default="", description="What the robot is.")
    source: Text = Field(default="", description="Where the numbers come from.")
    convention: ConventionField = Field(
        description="standard: Rz(theta) Tz(d) Tx(a) Rx(alpha); modified: Tx(a) Rx(alpha) Rz(theta) Tz(d); "
        "hayati: Rz(theta) Tx(a) Rx(alpha) Ry(beta)."
    )
    units: UnitsEntry = Field(default_factory=UnitsEntry, description="Units of this file; default rad and m.")
    parameters: Parameters = Field(
        default_factory=dict, description="Named constants for expressions, in the file's units."
    )
    base: BaseEntry = Field(default_factory=BaseEntry, description="DH frame 0 in base_link.")
    tool: PoseEntry = Field(default_factory=PoseEntry, description="tool0 in DH frame n.")
    gravity: Vector = Field(default=(0.0, 0.0, -9.81), description="m/s² in base_link.")
    joints: list[JointEntry] = Field(min_length=1, description="The DH table, a row each, base first.")
    configurations: dict[str, list[Number]] = Field(
        default={},
        description="Named joint vectors, a number for each moving row, in the file's units.",
        json_schema_extra={"propertyNames": {"pattern": NAME_PATTERN, "maxLength": LONGEST_NAME}},
    )
    actuators: ActuatorEntry = Field(default_factory=ActuatorEntry, description="What drives every joint.")


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a robot file, for editors."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "dh2sim robot file",
        **_tidied(RobotEntry.model_json_schema()),
    }


def _tidied(schema: Any) -> Any:
    """Return a schema in which a key may be left out but not be null, without pydantic's made-up titles."""
    if isinstance(schema, list):
        return [_tidied(value) for value in schema]
    if not isinstance(schema, dict):
        return schema
    tidied = {
        key: _tidied(value)
        for key, value in schema.items()
        if value is not None and not (key == "title" and isinstance(value, str))
    }
    match tidied.pop("anyOf", None):
        case [inner, {"type": "null"}]:
            return {**inner, **tidied}
        case _:
            return tidied
