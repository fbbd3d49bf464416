"""Single files are written beside where they will stand, and put there whole."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from dh2sim.errors import OutputError
from dh2sim.export.signals import signals_deferred


@contextmanager
def written_whole(out: Path) -> Iterator[Path]:
    """Give a temporary file with the same ending; it is renamed to ``out`` if all goes well, and removed otherwise.

    Args:
        out: where the file will stand; one that stands there is replaced.

    Yields:
        The path of the temporary file, which exists and is empty.

    Raises:
        OutputError: the file cannot be written; what stood there before stands untouched.
    """
    if out.is_dir():
        raise OutputError(f"cannot write '{out}': that is a folder")
    if not out.parent.is_dir():
        raise OutputError(f"cannot write '{out}': there is no folder '{out.parent}'")
    draft = out.with_name(f".{out.stem[:80]}-{secrets.token_hex(4)}{out.suffix}")
    try:
        try:
            os.close(os.open(draft, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            yield draft
            with signals_deferred():
                os.replace(draft, out)
        except OSError as error:
            raise OutputError(f"cannot write '{out}': {error.strerror or error}") from error
    finally:
        with suppress(FileNotFoundError):
            draft.unlink()
