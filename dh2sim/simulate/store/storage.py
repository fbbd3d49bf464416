"""Where runs are kept: what a folder and an object store have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from os import PathLike
from typing import Any, Final, Protocol, TypeVar

Place = str | PathLike[str]
"""A folder, or ``s3://BUCKET/NAME``."""
MOST_THREADS: Final = 4
"""That encode and write the chunks of a block: more would take processors from the simulation of the next one."""

_In = TypeVar("_In")
_Out = TypeVar("_Out")


class Store(Protocol):
    """The files of a run, by keys such as ``qpos/c.0.0.0``; each is there whole or not at all."""

    @property
    def name(self) -> str:
        """The place as it was given, for messages."""
        ...

    @property
    def zarr(self) -> Any:
        """What zarr and xarray open: a path, or one of zarr's stores, read only."""
        ...

    def file(self, key: str = "") -> str:
        """Return how messages name a file or a folder of the run."""
        ...

    def exists(self) -> bool:
        """Return whether there is anything at the place.

        Raises:
            RunError: That cannot be asked.
        """
        ...

    def put(self, files: Mapping[str, tuple[bytes, ...]]) -> None:
        """Write files, each the sum of its parts, in place of any that are there; they are safe on return.

        The last one appears when all others are safe.

        Raises:
            OSError: One cannot be written.
        """
        ...

    def put_new(self, key: str, data: bytes) -> bool:
        """Write a file unless there is one, and return whether it was written; it is safe on return.

        Raises:
            OSError: It cannot be written.
        """
        ...

    def get(self, key: str, *, most: int, last: int | None = None) -> bytes:
        """Return what is in a file, or its ``last`` bytes.

        Raises:
            FileNotFoundError: There is none.
            OSError: It cannot be read, or has more than ``most`` bytes.
        """
        ...

    def pieces(self, key: str) -> Iterator[bytes]:
        """Yield what is in a file, in pieces of moderate size.

        Raises:
            OSError: It cannot be read.
        """
        ...

    def list(self, folder: str) -> dict[str, int]:
        """Return the names in a folder with their sizes in bytes, -1 for what is not a plain file.

        Raises:
            OSError: It cannot be listed.
        """
        ...

    def delete(self, key: str) -> None:
        """Remove a file, if it is there.

        Raises:
            OSError: It cannot be removed.
        """
        ...


def run_all(function: Callable[[_In], _Out], items: Iterable[_In], *, threads: int = MOST_THREADS) -> list[_Out]:
    """Call a function for each item in threads of its own and return the results.

    After an error, what has not begun is left out, and the error is raised when all calls have ended.
    """
    with ThreadPoolExecutor(threads, thread_name_prefix="run-store") as pool:
        futures = [pool.submit(function, item) for item in items]
        try:
            wait(futures, return_when=FIRST_EXCEPTION)
        finally:  # after a signal, too
            for future in futures:
                future.cancel()
            wait(futures)
        for future in futures:
            if not future.cancelled() and (error := future.exception()):
                raise error
        return [future.result() for future in futures]
