"""What prints in colour and in tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

WIDEST = 1000
"""Columns; more than any table has."""


def make_console(width: int | None = None) -> Console:
    """Return a console on standard output, by default as wide as the terminal."""
    from rich.console import Console

    class PlainSpoken(Console):
        """Leaves it to the command what comes of a reader that has had enough; rich would end the program."""

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

    return PlainSpoken(highlight=False, width=width)


def print_whole(table: Table) -> None:
    """Print a table at the width it needs, however narrow the terminal: no column is cut short or left out."""
    make_console(WIDEST).print(table)
