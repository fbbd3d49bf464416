"""A tree of nodes against the models of a file: every complaint becomes a problem with its place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dh2sim.robot.document import Node
from dh2sim.robot.fields import PROBLEM, Context
from dh2sim.robot.report import Loc, Report
from dh2sim.robot.schema import RobotEntry
from dh2sim.robot.words import closest, did_you_mean, listed, shown

Model = TypeVar("Model", bound=BaseModel)


class _Nothing:
    """Stands for YAML's null, so that no optional field takes it."""

    def __str__(self) -> str:
        return "nothing"


_NOTHING: Final = _Nothing()


def read_structure(root: Node, context: Context, report: Report) -> RobotEntry | None:
    """Return the robot file's content, or None with what is wrong noted in ``report``."""
    return read_model(RobotEntry, root, context, report)


def read_model(model: type[Model], root: Node, context: Context, report: Report) -> Model | None:
    """Return the content of a file that ``model`` describes, or None with what is wrong noted in ``report``."""
    try:
        return model.model_validate(_plain(root), context=context)
    except ValidationError as error:
        errors = error.errors(include_url=False, include_input=False)
    guessed = {
        (*loc[:-1], closest(str(loc[-1]), _keys(model, loc[:-1])))
        for loc in (details["loc"] for details in errors if details["type"] == "extra_forbidden")
    }
    for details in errors:
        if details["type"] != "missing" or details["loc"] not in guessed:
            _note(model, details, root, report)
    return None


def _plain(node: Node) -> object:
    """Return a node's value as pydantic takes it."""
    match node.value:
        case None:
            return _NOTHING
        case dict() as entries:
            return {key: _plain(entry.value) for key, entry in entries.items()}
        case list() as items:
            return [_plain(item) for item in items]
        case scalar:
            return scalar


def _note(model: type[BaseModel], details: ErrorDetails, root: Node, report: Report) -> None:
    """Note a validation error at the place of the file that it is about."""
    loc = details["loc"]
    parent = root.at(*loc[:-1])
    match details["type"]:
        case "extra_forbidden":
            entry = root.entry(*loc)
            key, allowed = str(loc[-1]), _keys(model, loc[:-1])
            message = f"unknown key {shown(key)}.{did_you_mean(key, allowed)} Allowed keys: {listed(allowed)}"
            if entry is not None:
                report.add(entry.line, entry.column, loc[:-1], message)
        case "missing":
            if parent is not None and not parent.wrong:
                report.add(parent.line, parent.column, loc[:-1], f"missing key '{loc[-1]}'")
        case _:
            node = root.at(*loc) or parent or root
            if not node.wrong:
                report.add(node.line, node.column, loc, _message(model, details, node))


def _message(model: type[BaseModel], details: ErrorDetails, node: Node) -> str:
    found = shown(node.value)
    match details["type"]:
        case kind if kind == PROBLEM:
            return str(details["ctx"]["message"])
        case "model_type" | "dict_type":
            keys = _keys(model, details["loc"])
            return f"expected a mapping{f' with the keys {listed(keys)}' if keys else ''}, found {found}"
        case "list_type":
            return f"expected a list, found {found}"
        case "too_short":
            return "the list is empty; at least one entry is needed"
        case _:
            return f"{details['msg']}, found {found}"


def _keys(model: type[BaseModel], loc: Loc) -> Mapping[str, Any] | tuple[str, ...]:
    """Return the keys that the mapping at a place may hold; none where they are free."""
    here: type[BaseModel] | None = model
    for part in loc:
        if isinstance(part, str):
            field = here.model_fields.get(part) if here else None
            here = _model_in(field.annotation) if field else None
    return here.model_fields if here else ()


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the model that a field's type holds: itself, or inside a list or an optional."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((model for inner in get_args(annotation) if (model := _model_in(inner))), None)
