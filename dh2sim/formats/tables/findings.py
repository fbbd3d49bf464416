"""What is wrong with a table, and what the user should know of how it was read."""

from __future__ import annotations

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.formats.tables.grid import Cell


class Findings:
    """Collects the problems and the notes of one file."""

    def __init__(self, file: str) -> None:
        """Start with none; ``file`` is the name that messages begin with."""
        self.file = file
        self.problems: list[Problem] = []
        self.notes: list[str] = []

    def wrong(self, cell: Cell, path: str, message: str) -> None:
        """Note what is wrong with a cell; ``path`` is such as ``row 3, alpha``."""
        self.wrong_at(cell.line, cell.column, path, message)

    def wrong_at(self, line: int, column: int, path: str, message: str) -> None:
        """Note what is wrong at a place, counted from 1."""
        self.problems.append(Problem(file=self.file, line=line, column=column, path=path, message=message))

    def note(self, sentence: str) -> None:
        """Keep a sentence for the user, once."""
        if sentence not in self.notes:
            self.notes.append(sentence)

    def error(self) -> ImportedFileError:
        """Return all problems as one error, each told once."""
        return ImportedFileError(dict.fromkeys(self.problems))

    def check(self) -> None:
        """Raise an ImportedFileError if anything is wrong."""
        if self.problems:
            raise self.error()
