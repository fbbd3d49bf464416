"""Words that messages share: values and places, lists of names, guesses at what was meant, notes on a file."""

from __future__ import annotations

import difflib
import functools
import itertools
import re
from collections.abc import Iterable
from enum import StrEnum
from typing import Final, TypeAlias, TypeVar

from dh2sim.errors import Dh2simError

Loc: TypeAlias = tuple[str | int, ...]
"""Keys and indices from the top of a file, such as ``("joints", 2, "a")``."""

_LONGEST_SHOWN: Final = 60
_LONGEST_GUESSED: Final = 60
_MOST_GUESSED: Final = 100
"""Names that a guess is made among: the first of a long list."""
_MOST_LISTED: Final = 40
_PLAIN_KEY: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")


def path_of(loc: Loc) -> str:
    """Return the path of a place, such as ``joints[2].limits.position``."""
    path = ""
    for part in loc:
        if isinstance(part, int):
            path += f"[{part}]"
        elif not _PLAIN_KEY.fullmatch(part) or len(part) > 100:
            path += f"[{shown(part)}]"
        else:
            path += f".{part}" if path else part
    return path


def loc_of(path: str) -> Loc:
    """Return the place of a path that ``path_of`` made."""
    parts = re.findall(r"\[([0-9]+)\]|\['(.+?)'\]|([^.\[]+)", path)
    return tuple(int(index) if index else quoted or key for index, quoted, key in parts)


def shown(value: object) -> str:
    """Return how a message names a value read from a robot file; long text is cut short."""
    match value:
        case None:
            return "nothing"
        case bool():
            return "true" if value else "false"
        case str():
            return repr(value if len(value) <= _LONGEST_SHOWN else value[: _LONGEST_SHOWN - 3] + "...")
        case int() if abs(value) >= 10**_LONGEST_SHOWN:
            return "a number of too many digits"
        case int() | float():
            return repr(value)
        case dict():
            return "a mapping"
        case list():
            return "a list"
        case _:
            return f"a {type(value).__name__}"


def printable(text: str) -> str:
    """Return a text from a file for a terminal, which must not obey it: control characters are written as escapes."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" else repr(c)[1:-1] for c in text)


def bug_text(error: Exception) -> str:
    """Return what to say of an error that is no fault of the user's."""
    return f"This is a bug in dh2sim, please report it: {type(error).__name__}: {error}"


def counted(count: int, noun: str) -> str:
    """Return a number with a noun whose plural ends in s, as in '1 row' and '1,200 rows'."""
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"


def listed(names: Iterable[str], between: str = ", ") -> str:
    """Return names with commas between them, or ``none``; a long list is cut short."""
    first = list(itertools.islice(names, _MOST_LISTED + 1))
    if len(first) > _MOST_LISTED:
        first[-1] = "..."
    return between.join(first) or "none"


def closest(name: str, known: Iterable[str], *, likeness: float = 0.6) -> str | None:
    """Return the known name that ``name`` may be a slip of the pen for, or None.

    Args:
        name: What was found.
        known: What could be meant.
        likeness: Least ratio of ``difflib.SequenceMatcher``, 1 for equal names.
    """
    if len(name) > _LONGEST_GUESSED:
        return None
    return _closest(name.casefold(), tuple(itertools.islice(known, _MOST_GUESSED)), likeness)


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ``" Did you mean 'x'?"``, to follow a full stop, or the empty string."""
    match = closest(name, known)
    return "" if match is None else f" Did you mean '{match}'?"


@functools.lru_cache(maxsize=100_000)
def _closest(name: str, known: tuple[str, ...], likeness: float) -> str | None:
    folded = {candidate.casefold(): candidate for candidate in known}
    matches = difflib.get_close_matches(name, folded, n=1, cutoff=likeness)
    return folded[matches[0]] if matches else None


Choice = TypeVar("Choice", bound=StrEnum)


def member(kind: type[Choice], value: Choice | str, what: str, error: type[Dh2simError] = Dh2simError) -> Choice:
    """Return the member of an enumeration that a value names; ``what`` is its name for the message.

    Raises:
        Dh2simError: There is none; of the class ``error``.
    """
    for choice in kind:
        if isinstance(value, str) and choice == value:
            return choice
    raise error(f"unknown {what} {value!r}.{did_you_mean(str(value), kind)} Allowed: {listed(kind)}")


class Notes:
    """Collects the notes of one file, in the order in which their kinds first come up."""

    def __init__(self) -> None:
        """Start with none."""
        self._names: dict[str, dict[str, None]] = {}

    def add(self, sentence: str) -> None:
        """Note a sentence of its own."""
        self._names.setdefault(sentence, {})

    def group(self, sentence: str, name: str, detail: str = "") -> None:
        """Note one more name for a sentence, which has a ``{}`` where all its names go."""
        self._names.setdefault(sentence, {})[f"{shown(name)}{detail and f' ({detail})'}"] = None

    def sentences(self) -> tuple[str, ...]:
        """Return them all."""
        return tuple(sentence.replace("{}", listed(names), 1) for sentence, names in self._names.items())
