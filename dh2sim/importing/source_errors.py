"""What is wrong with a robot that was made of a file, as errors of that file: nobody wrote the robot file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

from dh2sim.errors import ImportedFileError, Problem, RobotError
from dh2sim.formats.xml_read import place
from dh2sim.messages import Loc, loc_of, path_of

MADE: Final = "the robot file that is made"
"""The name of the text while it is read back."""


@contextmanager
def errors_of(file: str, data: bytes = b"", joints: Sequence[str] = ()) -> Iterator[None]:
    """Raise errors of the robot as errors of the file that it is made from.

    Args:
        file: Its name, for messages.
        data: Its content, in which joints are looked for.
        joints: Their names there, base first; without them problems are at the file's beginning.

    Raises:
        ImportedFileError: The robot is wrong.
    """
    try:
        yield
    except ImportedFileError:
        raise
    except RobotError as error:
        raise ImportedFileError(
            dict.fromkeys(_at_source(problem, file, data, joints) for problem in error.problems)
        ) from None


def _at_source(problem: Problem, file: str, data: bytes, joints: Sequence[str]) -> Problem:
    """Return a problem of the robot at its joint in the source."""
    loc: Loc = loc_of(problem.path)
    line, column, path, message = 1, 1, problem.path, problem.message
    match loc:
        case ("joints", int(number), *rest) if number < len(joints) and joints[number]:
            line, column = _place_of(joints[number], data)
            inside = path_of(tuple(rest))
            path = f"{place('joint', joints[number])}{f'.{inside}' if inside else ''}"
        case ():
            message = f"{MADE} is refused: {message}"
    return Problem(file=file, line=line, column=column, path=path, message=message)


def _place_of(joint: str, data: bytes) -> tuple[int, int]:
    """Return line and column of the tag or key with a joint's name, or else of the file's beginning."""
    name = re.escape(joint.encode())
    found = re.search(rb"<\w*joint\b[^<>]*\bname\s*=\s*([\"'])" + name + rb"\1", data)
    if found is None:
        return 1, 1
    start = found.start()
    return data.count(b"\n", 0, start) + 1, start - data.rfind(b"\n", 0, start)
