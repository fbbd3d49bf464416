"""Texts of YAML: words, folded texts, comments; trees on one line where they fit on it, else in blocks."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping
from typing import Final, TypeAlias

from dh2sim.robot.yaml_tree import NOT_PRINTABLE, resolve_plain

WIDTH: Final = 100
"""Columns that a line should have at most."""
_INDENT: Final = "  "
_WORD: Final = re.compile(r"(?:/|\.\./)*[A-Za-z][A-Za-z0-9_./-]*")
"""Names and paths in which nothing means anything to YAML, also inside brackets."""
_OTHERS_BOOL: Final = frozenset({"y", "yes", "n", "no", "on", "off"})
"""Booleans of YAML 1.1, which other programs may read the file by."""
_ESCAPES: Final = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
_REPLACEMENT: Final = "\N{REPLACEMENT CHARACTER}"


def word(text: str) -> str:
    """Return a name or a path, in quotes only where it needs them."""
    return text if _WORD.fullmatch(text) and _is_text(text) else quoted(text)


def quoted(text: str) -> str:
    """Return text in double quotes; what YAML cannot hold becomes the replacement character U+FFFD."""
    return f'"{"".join(map(_escaped, NOT_PRINTABLE.sub(_REPLACEMENT, text)))}"'


def text_lines(key: str, text: str) -> list[str]:
    """Return the lines of a key at the top of the file whose value is any text.

    Plain on one line where that is possible and short enough; else folded, where folding keeps every character;
    else in double quotes.
    """
    line = f"{key}: {text if _is_plain(text) else quoted(text)}"
    if (len(line) <= WIDTH and "\n" not in text) or not _can_be_folded(text):
        return [line]
    body = text.removesuffix("\n")
    lines = [f"{key}: {'>-' if body == text else '>'}"]
    for index, paragraph in enumerate(body.split("\n")):
        lines += [""] if index else []
        lines += _wrapped(paragraph, _INDENT)
    return lines


def comment_lines(texts: Iterable[str]) -> list[str]:
    """Return comments; long lines are wrapped, and what YAML cannot hold becomes U+FFFD."""
    lines: list[str] = []
    for text in texts:
        for line in text.splitlines() or [""]:
            shown = NOT_PRINTABLE.sub(_REPLACEMENT, line).rstrip()
            lines += [f"# {shown}"] if 0 < len(shown) <= WIDTH - 2 else _wrapped(shown, "# ") or ["#"]
    return lines


def _is_text(text: str) -> bool:
    """Whether readers take these characters, without quotes, for a text."""
    return resolve_plain(text) == text and text.casefold() not in _OTHERS_BOOL


def _is_plain(text: str) -> bool:
    """Whether a text needs no quotes as the value of a key outside of brackets."""
    if not text[:1].isalpha() or not text.isprintable() or not _is_text(text):
        return False
    return ": " not in text and " #" not in text and not text.endswith((":", " "))


def _can_be_folded(text: str) -> bool:
    """Whether single spaces and line feeds are the only white space, with a word at both ends."""
    lines = text.removesuffix("\n").split("\n")
    if not lines[0] or not lines[-1]:
        return False
    return all(line.isprintable() and line.strip(" ") == line and "  " not in line for line in lines)


def _wrapped(text: str, prefix: str) -> list[str]:
    """Return lines of at most WIDTH columns, where words are not longer than that."""
    wrapper = textwrap.TextWrapper(
        width=WIDTH,
        initial_indent=prefix,
        subsequent_indent=prefix,
        break_long_words=prefix != _INDENT,
        break_on_hyphens=False,
    )
    return wrapper.wrap(text)


def _escaped(character: str) -> str:
    if character in _ESCAPES:
        return _ESCAPES[character]
    if character.isprintable():
        return character
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


Tree: TypeAlias = "str | list[str] | dict[str, Tree]"
"""Texts as written in the file, in lists and mappings."""


def inline(tree: Tree) -> str:
    """Return a tree on one line."""
    match tree:
        case str():
            return tree
        case list():
            return f"[{', '.join(tree)}]"
        case dict():
            return f"{{{', '.join(f'{key}: {inline(value)}' for key, value in tree.items())}}}"


def entry_lines(key: str, tree: Tree, indent: int = 0) -> list[str]:
    """Return the lines of a key: one, unless the value is a mapping that is too long for it."""
    line = f"{' ' * indent}{key}: {inline(tree)}"
    if len(line) <= WIDTH or not isinstance(tree, dict):
        return [line]
    return [f"{' ' * indent}{key}:", *block_lines(tree, indent + 2)]


def block_lines(tree: Mapping[str, Tree], indent: int) -> list[str]:
    """Return the lines of a mapping's keys."""
    return [line for key, value in tree.items() for line in entry_lines(key, value, indent)]
