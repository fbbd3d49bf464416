"""Errors in how a command was called, with the look of all other errors; imported when there is one."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, Final

from dh2sim.cli.common import BAD_INPUT, complain
from dh2sim.messages import did_you_mean, shown

_PLAIN: Final = {
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "float_parsing": "must be a number",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than_equal": "must be at most {le:g}",
}
"""What is required of a value, by the kind of pydantic's error."""


def complain_usage(error: Any, ctx: Any) -> int:
    """Print what is wrong with how a command was called, and what to do; return the exit status.

    Args:
        error: A usage error of typer; its classes, click's in earlier versions, are recognized by their names.
        ctx: The context of the command, or of the program if no command was found.
    """
    path = ctx.command_path
    match type(error).__name__:
        case "NoArgsIsHelpError":
            error.show()
            return BAD_INPUT
        case "NoSuchOption":
            text = unknown_option(error.option_name, ctx)
        case "MissingParameter":
            text = f"{error.param.param_type_name} {_hint(error)} is missing. '{path} --help' has examples"
        case "BadParameter":
            text = _wrong_value(error)
        case _:
            text = f"{_sentence(error.format_message())} '{path} --help' shows how to call it"
    return complain(text)


def unknown(kind: str, name: str, known: Iterable[str], ctx: Any) -> str:
    """Return what to say of a command or an option that there is not."""
    return f"unknown {kind} {shown(name)}.{did_you_mean(name, known)} '{ctx.command_path} --help' lists them all"


def unknown_option(word: str, ctx: Any) -> str:
    """Return what to say of an option that a command does not have."""
    parameters = ctx.command.get_params(ctx)
    names = [name for parameter in parameters for name in (*parameter.opts, *parameter.secondary_opts)]
    return unknown("option", word.partition("=")[0], [name for name in names if name.startswith("--")], ctx)


def _hint(error: Any) -> str:
    """Return the name of the option or argument that an error is about."""
    if error.param_hint is not None:
        return str(error.param_hint)
    if error.param is None:
        return ""
    if error.param.param_type_name == "argument":
        return str(error.param.metavar or error.param.name.upper())
    return str(max(error.param.opts, key=len))


def _wrong_value(error: Any) -> str:
    """Return an option or argument and what is wrong with it: a sentence, or words after a colon."""
    message = _plain(error)
    hint = _hint(error)
    return f"{hint} {message}" if message[:1].islower() else f"{hint}: {message}".removeprefix(": ")


def _plain(error: Any) -> str:
    """Return the message for a wrong value; typer passes on that of pydantic, which does not quote the value."""
    details: list[dict[str, Any]] = getattr(error.__cause__, "errors", list)()
    required = _PLAIN.get(details[0]["type"]) if details else None
    if required is None:
        return str(error.message).rstrip(".")
    value = details[0]["input"]
    limits = details[0].get("ctx", {})
    return f"{required.format(**limits)}, got {value if 'ge' in limits or 'le' in limits else shown(value)}"


def _sentence(text: str) -> str:
    """Return a message of typer or click as a sentence that can follow the name of the program."""
    if found := re.match(r"Got unexpected extra argument\S* \((.*)\)", text):
        return f"unexpected argument{'s' if ' ' in found[1] else ''} {shown(found[1])}."
    ended = text if text.endswith(("?", ".")) else f"{text}."
    return ended[0].lower() + ended[1:]
