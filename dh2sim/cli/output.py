"""What commands print: tables, progress, sizes, and files on standard output or on disk."""

from __future__ import annotations

import json
import math
import re
import shutil
import sys
import textwrap
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dh2sim.errors import NotFiniteError, OutputError
from dh2sim.files import require_folder
from dh2sim.messages import printable
from dh2sim.progress import Advance

WIDTH: Final = 80
"""Columns of lines of text, at most."""
_NARROWEST: Final = 40

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

WIDEST = 1000
"""Columns; wider than any table."""


def make_console(width: int | None = None) -> Console:
    """Return a console on standard output, by default as wide as the terminal."""
    from rich.console import Console

    class RaisingConsole(Console):
        """Raises an error when its reader has closed the output; rich would end the program."""

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

    return RaisingConsole(highlight=False, width=width)


def terminal_width() -> int | None:
    """Return the columns of the terminal that is standard output; None where that is a file or a pipe."""
    return max(shutil.get_terminal_size().columns, _NARROWEST) if sys.stdout.isatty() else None


def wrapped(
    text: str, *, first: str = "", rest: str = "  ", width: int | None = None, commas: bool = False
) -> list[str]:
    """Return the lines of a text for a terminal.

    Args:
        text: The text.
        first: What the first line begins with.
        rest: What the others do.
        width: Columns; by default the terminal's, at most ``WIDTH``.
        commas: Whether a word that is too long for a line, such as a controller's options, may end after a comma.
    """
    wrapper = _Wrapper if commas else textwrap.TextWrapper
    return wrapper(
        width=width or min(terminal_width() or WIDTH, WIDTH),
        initial_indent=first,
        subsequent_indent=rest,
        break_long_words=False,
        break_on_hyphens=False,
    ).wrap(printable(text))


class _Wrapper(textwrap.TextWrapper):
    """Breaks words after commas where they are too long for a line."""

    def _split(self, text: str) -> list[str]:
        room = self.width - max(len(self.initial_indent), len(self.subsequent_indent))
        parts = (re.split("(?<=,)", word) if len(word) > room else [word] for word in super()._split(text))
        return [part for word in parts for part in word if part]


def print_wrapped(text: str, *, first: str = "", rest: str = "  ", commas: bool = False) -> None:
    """Print a text as ``wrapped`` returns it."""
    print("\n".join(wrapped(text, first=first, rest=rest, commas=commas)))


def print_whole(table: Table) -> None:
    """Print a table at the width it needs, however narrow the terminal: no column is cut short or left out."""
    make_console(WIDEST).print(table)


def table_lines(rows: Sequence[Sequence[str]], *, left: int, head: int = 1) -> list[str]:
    """Return a table in aligned columns, each as wide as it needs, with a line below its head.

    Args:
        rows: The cells, the head first.
        left: How many columns are aligned left; the others are aligned right.
        head: How many rows are the head.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(f"{cell:{'<' if k < left else '>'}{widths[k]}}" for k, cell in enumerate(row)).rstrip()
        for row in rows
    ]
    return [*lines[:head], "─" * max(map(len, lines)), *lines[head:]]


def json_text(value: object, *, indent: int | None = 2, ensure_ascii: bool = True) -> str:
    """Return a value as JSON, which has no NaN and no infinity.

    Raises:
        NotFiniteError: A number in it is either.
    """
    try:
        return json.dumps(value, indent=indent, ensure_ascii=ensure_ascii, allow_nan=False)
    except ValueError:
        place, number = next(_not_finite(value, "JSON"))
        raise NotFiniteError(place, repr(number)) from None


def _not_finite(value: object, place: str) -> Iterator[tuple[str, float]]:
    match value:
        case float() if not math.isfinite(value):
            yield place, value
        case dict():
            for key, inner in value.items():
                yield from _not_finite(inner, f"{place}.{key}")
        case list() | tuple():
            for index, inner in enumerate(value):
                yield from _not_finite(inner, f"{place}[{index}]")


@contextmanager
def progress_bar(doing: str, what: str, total: int, *, quiet: bool = False, after: float = 0.0) -> Iterator[Advance]:
    """Show a bar on standard error if that is a terminal; it vanishes in the end.

    Args:
        doing: what is done, as in 'comparing'.
        what: what is counted, as in 'poses'.
        total: how many there are.
        quiet: show nothing.
        after: s: work that is done sooner shows none.

    Yields:
        A function to call with how many are done since the last call.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda _: None
        return
    begun = time.monotonic()
    shown: list[Advance] = []
    done_before = 0

    with ExitStack() as stack:

        def advance(done: int) -> None:
            nonlocal done_before
            if not shown and time.monotonic() - begun >= after:
                shown.append(stack.enter_context(_bar(doing, what, total)))
                shown[0](done_before)
            if shown:
                shown[0](done)
            done_before += done

        advance(0)
        yield advance


@contextmanager
def _bar(doing: str, what: str, total: int) -> Iterator[Advance]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    with Progress(
        TextColumn(doing),
        BarColumn(),
        TextColumn("{task.completed:,.0f} of {task.total:,.0f} " + what),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    ) as bar:
        task = bar.add_task("", total=total)
        yield lambda done: bar.advance(task, done)


def size_text(count: int) -> str:
    """Return a number of bytes as in '12.3 MB'."""
    size, unit = float(count), "B"
    for larger in ("kB", "MB", "GB", "TB"):
        if size < 999.95:
            break
        size, unit = size / 1000.0, larger
    return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"


def require_free(out: Path | None, *, force: bool) -> None:
    """Refuse to overwrite a file, unless asked to.

    Raises:
        OutputError: There is a file, or no folder to put one in.
    """
    if out is None:
        return
    require_folder(out)
    if out.exists() and not force:
        raise OutputError(f"'{out}' already exists; choose another name, or overwrite it with --force")


def hand_over(text: str, out: Path | None, *, summary: str, notes: Iterable[str] = (), quiet: bool = False) -> None:
    """Print a robot file, or write it whole; summary and notes go where they do not mix with the file.

    Raises:
        OutputError: It cannot be written; an existing file is unchanged.
    """
    if out is None:
        sys.stdout.write(text)
        sys.stdout.flush()
    else:
        from dh2sim.files import atomic_file

        with atomic_file(out) as draft:
            draft.write_text(text, encoding="utf-8")
    if quiet:
        return
    for note in notes:
        print("\n".join(wrapped(f"dh2sim: note: {note}")), file=sys.stderr)
    where = "" if out is None else f"{out}: "
    print(printable(f"{where}{summary}"), file=sys.stderr if out is None else sys.stdout)
