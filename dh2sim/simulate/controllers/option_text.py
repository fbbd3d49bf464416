"""``NAME:key=value,…`` as typed: how it is taken apart, and how it is written."""

from __future__ import annotations

from collections.abc import Iterable

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
