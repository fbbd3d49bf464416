"""Tables as they are printed."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

WIDEST = 1000
"""Columns; more than any table has."""


def print_whole(table: Table) -> None:
    """Print a table at the width it needs, however narrow the terminal: no column is cut short or left out."""
    from rich.console import Console

    Console(highlight=False, width=WIDEST).print(table)
