"""Scripts in a text: whole files, and blocks of code between fences."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import PurePath
from typing import Final

from dh2sim.formats.table.dh_table import Table
from dh2sim.formats.table.matlab_script import MADE_IN_MATLAB, read_matlab
from dh2sim.formats.table.python_script import MADE_IN_PYTHON, read_python
from dh2sim.formats.table.toolbox import table_of

_FENCE: Final = re.compile(r"\s*(`{3,}|~{3,})\s*([\w+-]*)")
_NAMES_IN_QUOTES: Final = re.compile(r"\b(?:Revolute|Prismatic)(?:MDH)?\s*\(\s*['\"]")
"""As only MATLAB has it."""
_MAX_BLOCKS: Final = 50


def script_tables(lines: Sequence[str], file: str) -> tuple[list[Table], list[tuple[int, int, str]]]:
    """Return the tables of the robots that scripts in a text make, and what of them cannot be read.

    Args:
        lines: The file's lines.
        file: Its name, whose ending may say the language.
    """
    tables: list[Table] = []
    problems: list[tuple[int, int, str]] = []
    suffix = PurePath(file).suffix.casefold()
    for text in _blocks(lines, file):
        python = suffix == ".py" or (
            suffix != ".m" and MADE_IN_PYTHON.search(text) and not _NAMES_IN_QUOTES.search(text)
        )
        if (python and not MADE_IN_PYTHON.search(text)) or (not python and not MADE_IN_MATLAB.search(text)):
            continue
        robots, errors = read_python(text) if python else read_matlab(text)
        wrong = [(error.line, error.column, str(error)) for error in errors]
        tables += [table_of(robot, by="DHRobot" if python else "SerialLink", wrong=wrong) for robot in robots]
        problems += wrong
    return tables, problems


def _blocks(lines: Sequence[str], file: str) -> Iterator[str]:
    """Yield the text, or its blocks between fences, with every line where it is in the file."""
    fences = [(index, found[1][0], found[2]) for index, line in enumerate(lines) if (found := _FENCE.match(line))]
    if not fences or PurePath(file).suffix.casefold() in (".m", ".py"):
        yield "\n".join(lines)
        return
    count, start = 0, None
    for index, sign, _ in fences:
        if start is None:
            start = (index, sign)
        elif sign == start[1]:
            block = lines[start[0] + 1 : index]
            if count < _MAX_BLOCKS and any("(" in line for line in block):
                count += 1
                yield "\n" * (start[0] + 1) + "\n".join(block)
            start = None
