"""The text of a robot file, and the tree of nodes that know where they stand in it."""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass, field
from typing import Final, NamedTuple, NoReturn, TypeAlias

from dh2sim.robot.report import Report
from dh2sim.robot.scalars import Scalar

MAX_BYTES: Final = 1_000_000
MAX_LINE: Final = 100_000

NOT_PRINTABLE: Final = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f\ud800-\udfff\ufffe\uffff]")
"""What YAML allows nowhere. (Its complement, the printable characters, takes ten times as long to compile.)"""


class Entry(NamedTuple):
    """A key of a mapping and its value."""

    line: int
    """Line of the key, from 1."""
    column: int
    """Column of the key, from 1."""
    value: Node


Value: TypeAlias = Scalar | list["Node"] | dict[str, Entry]


@dataclass(slots=True, eq=False)
class Node:
    """A value and where it stands, both counted from 1."""

    line: int
    column: int
    value: Value = field(repr=False)
    wrong: bool = False
    """Already complained of: nothing more is to be said of the value, nor of keys missing in it."""

    def at(self, *loc: str | int) -> Node | None:
        """Return the node at a place below this one, or None."""
        node: Node | None = self
        for part in loc:
            match node.value if node else None:
                case dict() as entries if isinstance(part, str):
                    entry = entries.get(part)
                    node = entry.value if entry else None
                case list() as items if isinstance(part, int):
                    node = items[part] if part < len(items) else None
                case _:
                    return None
        return node

    def entry(self, *loc: str | int) -> Entry | None:
        """Return the mapping entry at a place whose last part is a key, or None."""
        parent = self.at(*loc[:-1])
        if parent is None or not isinstance(parent.value, dict) or not isinstance(loc[-1], str):
            return None
        return parent.value.get(loc[-1])


def check_size(size: int, report: Report) -> None:
    """Raise a RobotFileError if a file of ``size`` bytes is too large."""
    if size > MAX_BYTES:
        report.add(1, 1, (), f"the file has {size} bytes; at most {MAX_BYTES} are allowed")
        raise report.error()


def decode(data: bytes, report: Report) -> str:
    """Return the text of a file, every line ended by a line feed.

    Raises:
        RobotFileError: Too large, not UTF-8, a control character, or a line that is too long.
    """
    check_size(len(data), report)
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        text = data.decode().replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode()
        _fail_at(report, before, len(before), f"not UTF-8: byte 0x{data[error.start]:02x}")
    if found := NOT_PRINTABLE.search(text):
        _fail_at(report, text, found.start(), f"control character U+{ord(found.group()):04X} is not allowed")
    for number, line in enumerate(text.split("\n"), start=1):
        if len(line) > MAX_LINE:
            report.add(number, 1, (), f"the line has {len(line)} characters; at most {MAX_LINE} are allowed")
            raise report.error()
    return text


def _fail_at(report: Report, text: str, offset: int, message: str) -> NoReturn:
    line = text.count("\n", 0, offset) + 1
    report.add(line, offset - text.rfind("\n", 0, offset), (), message)
    raise report.error() from None
