"""How commands that make robot files hand them over."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterable
from pathlib import Path

from dh2sim.errors import OutputError


def require_free(out: Path | None, *, force: bool) -> None:
    """Refuse to write over a file, unless asked to.

    Raises:
        OutputError: There is a file, or no folder to put one in.
    """
    if out is None:
        return
    if out.is_dir():
        raise OutputError(f"cannot write '{out}': that is a folder")
    if not out.parent.is_dir():
        raise OutputError(f"cannot write '{out}': there is no folder '{out.parent}'")
    if out.exists() and not force:
        raise OutputError(f"'{out}' exists already; choose another name, or write over it with --force")


def hand_over(text: str, out: Path | None, *, summary: str, notes: Iterable[str] = (), quiet: bool = False) -> None:
    """Print a robot file, or write it whole; what there is to say of it goes where it does not mix with the file.

    Raises:
        OutputError: It cannot be written; what stood there before stands untouched.
    """
    if out is None:
        sys.stdout.write(text)
        sys.stdout.flush()
    else:
        from dh2sim.export.placing import written_whole

        with written_whole(out) as draft:
            draft.write_text(text, encoding="utf-8")
    if quiet:
        return
    for note in notes:
        text = textwrap.fill(f"dh2sim: note: {note}", 80, subsequent_indent="  ", break_on_hyphens=False)
        print(text, file=sys.stderr)
    where = "" if out is None else f"{out}: "
    print(f"{where}{summary}", file=sys.stderr if out is None else sys.stdout)
