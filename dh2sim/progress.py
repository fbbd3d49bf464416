"""How long work says how far it is."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import TypeAlias

Advance: TypeAlias = Callable[[int], None]
"""Takes how many are done since the last call."""
Stage: TypeAlias = Callable[[str, str, int], AbstractContextManager[Advance]]
"""Shows progress: what is done, what is counted, how many there are at most."""


def no_progress(_done: int) -> None:
    """Show nothing."""


def silent(_doing: str, _what: str, _total: int) -> AbstractContextManager[Advance]:
    """Show nothing."""
    return nullcontext(no_progress)
