"""The JSON Schemas of robot files, and of files with the same kinds of fields, for editors."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from dh2sim.robot.fields import (
    IN_SI,
    LONGEST_NAME,
    NAME_PATTERN,
    Choice,
    Color,
    Configurations,
    Flag,
    Kind,
    Name,
    Number,
    Numbers,
    Parameters,
    Texts,
    Vector,
)
from dh2sim.robot.magnitudes import ANGLE, LENGTH, MOST_ROWS, Magnitude
from dh2sim.robot.parts import Inertia, InertiaNumbers, NamedParts, Part, Parts, fields_of
from dh2sim.robot.spec import ROBOT
from dh2sim.robot.units import AngleUnit, LengthUnit

_NAME = {"pattern": NAME_PATTERN, "maxLength": LONGEST_NAME}
NUMBER = {"type": ["number", "string"]}
"""Of a number, or an expression."""
_NOTE = """A number may be an arithmetic expression in a string: + - * / **, parentheses, parameters, pi, sqrt, sin,
cos, tan, asin, acos, atan, atan2 (arguments in radians)."""


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a robot file."""
    return schema_of(ROBOT, "robot file", "A robot described by its Denavit-Hartenberg table.")


def schema_of(part: Part, title: str, description: str) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a file that is a part."""
    definitions: dict[str, Any] = {}
    whole = _part(part, definitions)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"dh2sim {title}",
        "$defs": dict(sorted(definitions.items())),
        **whole,
        "description": f"{description}\n\n{_NOTE}",
    }


def _part(part: Part, definitions: dict[str, Any]) -> dict[str, Any]:
    keys = part.keys
    required = [key for key, kind in keys.items() if kind.required]
    defaults = _defaults(part.of)
    return {
        "additionalProperties": False,
        "description": _summary(part.of),
        "properties": {key: _property(kind, defaults.get(key), definitions) for key, kind in keys.items()},
        **({"required": required} if required else {}),
        "type": "object",
    }


def _property(kind: Kind, default: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a key; ``default`` is None for a key without a default."""
    schema = _value(kind, definitions)
    if default is not None and not kind.required:
        schema["default"] = default
    return {**schema, "description": kind.description} if kind.description else schema


def _value(kind: Kind, definitions: dict[str, Any]) -> dict[str, Any]:
    if (own := kind.json_schema()) is not None:
        return own
    match kind:
        case Part():
            name = _name(kind.of)
            if name not in definitions:
                definitions[name] = _part(kind, definitions)
            mapping = {"$ref": f"#/$defs/{name}"}
            if (short := kind.list_is or kind.number_is) is None:
                return mapping
            return {"anyOf": [mapping, _value(kind.keys[short], definitions)]}
        case Inertia():
            return _value(Part("", InertiaNumbers), definitions)
        case Parts():
            least = 0 if kind.may_be_empty else 1
            return {
                "type": "array",
                "items": _value(kind.item, definitions),
                "minItems": least,
                "maxItems": MOST_ROWS,
            }
        case NamedParts():
            parts = _value(kind.item, definitions)
            return {"type": "object", "propertyNames": _NAME, "additionalProperties": parts}
        case Texts():
            lengths = {} if kind.count is None else {"minItems": kind.count, "maxItems": kind.count}
            return {"type": "array", "items": {"type": "string"}, **lengths}
        case Vector():
            return {"type": "array", "items": NUMBER}
        case Choice():
            letters = [spelling for short in kind.short for spelling in (short.upper(), short)]
            definitions[kind.of.__name__] = {
                "description": _summary(kind.of),
                "enum": [*(choice.value for choice in kind.of), *letters],
                "type": "string",
            }
            return {"$ref": f"#/$defs/{kind.of.__name__}"}
        case Number():
            return NUMBER | _bounds(kind)
        case Color():
            least, most = kind.counts
            return {"type": "array", "items": _value(kind.item, definitions), "minItems": least, "maxItems": most}
        case Numbers():
            (count,) = kind.counts
            items = [_value(kind.item, definitions) for _ in range(count)]
            return {"type": "array", "prefixItems": items, "minItems": count, "maxItems": count}
        case Configurations():
            return {"type": "object", "propertyNames": _NAME, "additionalProperties": _value(Vector(), definitions)}
        case Parameters():
            names = {"pattern": "^[A-Za-z_][A-Za-z0-9_]*$"}
            return {"type": "object", "propertyNames": names, "additionalProperties": NUMBER}
        case Name():
            return {"type": "string", **_NAME}
        case Flag():
            return {"type": "boolean"}
        case _:  # texts and the names of files
            return {"type": "string"}


def _bounds(kind: Number) -> dict[str, float]:
    """Return the bounds of a number as far as a schema can have them: it does not depend on the units of the file.

    The most is in the smallest unit, the least in the largest; the reader is exact.
    """
    if kind.most is not None and kind.least is not None:
        return {"minimum": kind.least, "maximum": kind.most}
    sizes = [kind.magnitude(turns=turns) for turns in (False, True)]
    most = max(size.most / min(_units(size)) for size in sizes)
    if math.isinf(most):
        return {}
    if kind.least is not None:
        return {"minimum": kind.least, "maximum": most}
    least = min(size.least / max(_units(size)) for size in sizes)
    return {"minimum": least if kind.above is not None else -most, "maximum": most}


def _units(of: Magnitude) -> list[float]:
    """Return the units that a file may give numbers in, in SI units."""
    names = {ANGLE: AngleUnit, LENGTH: LengthUnit}.get(of)
    return [IN_SI[unit.value] for unit in names] if names else [1.0]


def _defaults(part: type) -> dict[str, Any]:
    """Return the defaults of a part's values by key, as JSON; parts in it have their own."""
    defaults: dict[str, Any] = {}
    for field in dataclasses.fields(part):
        kind = fields_of(part).get(field.name)
        default = field.default if field.default_factory is dataclasses.MISSING else field.default_factory()
        match kind, default:
            case Part(inline=True), _:
                defaults |= _defaults(kind.of)
            case Choice(inherited=True), _:
                pass
            case _, bool() | float() | str():
                defaults[field.name] = default
            case Numbers(), np.ndarray():
                defaults[field.name] = default.tolist()
            case Configurations(), _:
                defaults[field.name] = {}
    return defaults


def _name(part: type) -> str:
    return {"Row": "JointEntry", "InertiaNumbers": "InertiaEntry"}.get(
        part.__name__, f"{part.__name__.removesuffix('Spec')}Entry"
    )


def _summary(described: type) -> str:
    """Return the first paragraph of a docstring."""
    return (described.__doc__ or "").split("\n\n")[0]
