"""The words of a MATLAB script, and its statements."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from dh2sim.formats.table.toolbox import ScriptError

_MAX_TOKENS: Final = 200_000
_TOKEN: Final = re.compile(
    r"(?P<space>[ \t]+|\.\.\.[^\n]*\n|\\\n)"
    r"|(?P<comment>[%#][^\n]*)"
    r"|(?P<newline>\n)"
    r"|(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?)"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<operator>\.\*|\./|\.\^|==|~=|!=|<=|>=|&&|\|\||[-+*/^()\[\]{},;=.:'\"<>~!&|@\\])"
    r"|(?P<other>.)",
    re.DOTALL,
)
_STRINGS: Final = {"'": re.compile(r"'((?:[^'\n]|'')*)'"), '"': re.compile(r'"((?:[^"\n]|"")*)"')}


class Token(NamedTuple):
    """A word: a number, a name, a string, an operator or a line's end, and its place, from 1."""

    kind: str
    text: str
    line: int
    column: int
    spaced: bool
    """Whether there is a space before it."""


END: Final = Token("end", "", 0, 0, True)


def tokens_of(text: str) -> list[Token]:
    """Return the words of a script, without comments.

    Raises:
        ScriptError: It has too many.
    """
    text = _without_blocks(text)
    tokens: list[Token] = []
    position, line, start, spaced = 0, 1, 0, True
    while position < len(text):
        found = _TOKEN.match(text, position)
        if found is None:
            break
        kind, piece = found.lastgroup or "", found.group()
        column = position - start + 1
        if kind == "operator" and piece in _STRINGS and not (piece == "'" and _is_transpose(tokens, spaced=spaced)):
            string = _STRINGS[piece].match(text, position)
            if string is not None:
                kind, found, piece = "string", string, string[1].replace(piece * 2, piece)
        position = found.end()
        if kind == "space":
            spaced = True
        elif kind != "comment":
            tokens.append(Token(kind, piece, line, column, spaced))
            spaced = False
        if "\n" in found.group():
            line, start, spaced = line + 1, position, True
        if len(tokens) > _MAX_TOKENS:
            raise ScriptError(f"the script has more than {_MAX_TOKENS} words", line, 1)
    return tokens


def _without_blocks(text: str) -> str:
    """Return a script without the lines between ``%{`` and ``%}``."""
    lines, depth = text.split("\n"), 0
    for index, line in enumerate(lines):
        mark = line.strip()
        depth += mark in ("%{", "#{")
        if depth:
            lines[index] = ""
        depth = max(depth - (mark in ("%}", "#}")), 0)
    return "\n".join(lines)


def _is_transpose(tokens: Sequence[Token], *, spaced: bool) -> bool:
    if not tokens or spaced:
        return False
    last = tokens[-1]
    return last.kind in ("name", "number") or last.text in (")", "]", "}", "'")


def statements_of(tokens: Sequence[Token]) -> list[list[Token]]:
    """Return the statements that words make: they end with a line, a semicolon or a comma outside brackets."""
    statements: list[list[Token]] = []
    current: list[Token] = []
    depth = 0
    for token in tokens:
        if token.kind == "operator":
            depth += (token.text in "([{") - (token.text in ")]}")
        if depth <= 0 and (token.kind == "newline" or (token.kind == "operator" and token.text in ",;")):
            if current:
                statements.append(current)
            current, depth = [], 0
        else:
            current.append(token)
    return [*statements, current] if current else statements


def names_in_tokens(tokens: Sequence[Token]) -> set[str]:
    """Return the names among words."""
    return {token.text for token in tokens if token.kind == "name"}


def equals_sign(tokens: Sequence[Token]) -> int | None:
    """Return the index of the equals sign of an assignment."""
    depth = 0
    for index, token in enumerate(tokens):
        if token.kind == "operator":
            depth += (token.text in "([{") - (token.text in ")]}")
            if token.text == "=" and depth == 0:
                return index if 0 < index < len(tokens) - 1 else None
    return None


def closing_bracket(tokens: Sequence[Token]) -> int:
    """Return the index of the bracket that closes the first one.

    Raises:
        ScriptError: There is none.
    """
    depth = 0
    for index, token in enumerate(tokens):
        if token.kind == "operator":
            depth += (token.text in "([{") - (token.text in ")]}")
            if depth == 0:
                return index
    raise ScriptError("a bracket is never closed", tokens[0].line, tokens[0].column)
