"""Where something stands in a robot file, and the problems found so far."""

from __future__ import annotations

import re
from typing import Final, TypeAlias

from dh2sim.errors import Problem, RobotFileError
from dh2sim.robot.words import shown

Loc: TypeAlias = tuple[str | int, ...]
"""Keys and indices from the top of the file, such as ``("joints", 2, "a")``."""

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


class Report:
    """Collects the problems of one file."""

    def __init__(self, file: str) -> None:
        """Start with none; ``file`` is the name that messages begin with."""
        self.file = file
        self.problems: list[Problem] = []

    def add(self, line: int, column: int, loc: Loc, message: str) -> None:
        """Note a problem at a line and column, both counted from 1."""
        self.problems.append(Problem(file=self.file, line=line, column=column, path=path_of(loc), message=message))

    def error(self) -> RobotFileError:
        """Return all of them as one error, each told once."""
        return RobotFileError(dict.fromkeys(self.problems))
