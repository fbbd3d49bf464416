"""A run in a folder, which any number of processes and machines may write to at the same time.

A file is written under a name that no other process uses, brought to the disk, and renamed. Until then its writer
holds a lock on it, by which others tell that it lives: only what dead writers left is removed.
"""

from __future__ import annotations

import errno
import os
import re
import secrets
import socket
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from dh2sim.files import PARTIAL, open_plain_file, read_plain_file, sync
from dh2sim.locks import lock_handle
from dh2sim.simulate.store.storage import run_all

_PIECE: Final = 4 * 2**20
_NO_LINKS: Final = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK, errno.EINVAL)
"""What systems answer that have no hard links."""


class LocalStore:
    """The files of a folder; see ``Store``."""

    def __init__(self, path: Path) -> None:
        """Use a folder, whether it exists or not."""
        self.path = path

    @property
    def name(self) -> str:
        """The path."""
        return str(self.path)

    @property
    def zarr(self) -> Path:
        """The path."""
        return self.path

    def file(self, key: str = "") -> str:
        """Return the path of a file or a folder of the run."""
        return str(self.path / key)

    def exists(self) -> bool:
        """Return whether there is anything at the path."""
        return self.path.exists()

    def put(self, files: Mapping[str, tuple[bytes, ...]]) -> None:
        """Write files; where one cannot be written, none of them appears."""
        partials: dict[str, _Partial] = {}
        try:
            for key in files:
                partials[key] = _Partial(self.path / key)
            run_all(lambda key: partials[key].write(files[key]), files)
            *others, last = files
            run_all(lambda key: partials[key].rename(), others)
            partials[last].rename()
        finally:
            for partial in partials.values():
                partial.close()

    def put_new(self, key: str, data: bytes) -> bool:
        """Write a file unless there is one, and return whether it was written."""
        partial = _Partial(self.path / key)
        try:
            partial.write([data])
            return partial.link()
        finally:
            partial.close()

    def get(self, key: str, *, most: int, last: int | None = None) -> bytes:
        """Return what is in a plain file, or its ``last`` bytes."""
        if last is None:
            return read_plain_file(self.path / key, most)
        with open_plain_file(self.path / key) as file:
            file.seek(-last, os.SEEK_END)
            return file.read(last)

    def pieces(self, key: str) -> Iterator[bytes]:
        """Yield what is in a plain file."""
        with open_plain_file(self.path / key) as file:
            while piece := file.read(_PIECE):
                yield piece

    def list(self, folder: str) -> dict[str, int]:
        """Return the names in a folder, which is not a link, with their sizes; -1 for what is not a plain file."""
        if folder and (self.path / folder).is_symlink():
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), self.file(folder))
        sizes = {}
        with os.scandir(self.path / folder) as entries:
            for entry in entries:
                with suppress(FileNotFoundError):  # renamed or removed meanwhile
                    found = entry.stat(follow_symlinks=False)
                    sizes[entry.name] = found.st_size if stat.S_ISREG(found.st_mode) else -1
        return {name: size for name, size in sizes.items() if not _of_partial(name)}

    def delete(self, key: str) -> None:
        """Remove a file, if it is there."""
        with suppress(FileNotFoundError):
            (self.path / key).unlink()

    def remove_partials(self) -> None:
        """Remove the files that dead processes did not finish, as far as possible; living ones keep theirs."""
        for file in self.path.rglob(f".*{PARTIAL}"):
            with suppress(OSError):
                handle = os.open(file, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
                try:
                    if lock_handle(handle) and os.path.samestat(os.fstat(handle), os.lstat(file)):
                        file.unlink()
                finally:
                    os.close(handle)


def _of_partial(name: str) -> bool:
    return name.startswith(".") and name.endswith(PARTIAL)


class _Partial:
    """A file on its way: written under a name of its own, and locked until it has the name that it is for."""

    def __init__(self, path: Path) -> None:
        """Make it, empty.

        Raises:
            OSError: It cannot be made.
        """
        self._path = path
        flags = os.O_CREAT | os.O_EXCL | os.O_RDWR | getattr(os, "O_BINARY", 0)
        while True:
            self._partial = path.with_name(_partial_name(path.name))
            self._handle: int | None = os.open(self._partial, flags, 0o666)
            with suppress(FileNotFoundError, BlockingIOError):  # another process took it for that of a dead one
                lock_handle(self._handle)
                if os.path.samestat(os.fstat(self._handle), os.lstat(self._partial)):
                    return
            os.close(self._handle)

    def write(self, parts: Sequence[bytes]) -> None:
        """Write all of it, and bring it to the disk."""
        assert self._handle is not None
        for part in parts:
            left = memoryview(part)
            while left:  # near a limit of size, a file takes some of the bytes before it refuses
                left = left[os.write(self._handle, left) :]
        os.fsync(self._handle)
        if os.name == "nt":  # where an open file keeps its name
            os.close(self._handle)
            self._handle = None

    def rename(self) -> None:
        """Give it its name, in place of a file that may have it."""
        os.replace(self._partial, self._path)
        sync(self._path.parent)

    def link(self) -> bool:
        """Give it its name unless a file has that, and return whether it was given."""
        try:
            os.link(self._partial, self._path)
        except FileExistsError:
            return False
        except OSError as error:
            if error.errno not in _NO_LINKS:
                raise
            if os.path.lexists(self._path):
                return False
            os.replace(self._partial, self._path)
        sync(self._path.parent)
        return True

    def close(self) -> None:
        """Remove what has not got its name, as far as possible."""
        with suppress(OSError):
            self._partial.unlink()
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


def _partial_name(name: str) -> str:
    """Return a name that no other process, on whatever machine, uses."""
    host = re.sub(r"[^A-Za-z0-9]+", "-", socket.gethostname())[:40]
    return f".{name}-{host}-{os.getpid()}-{secrets.token_hex(4)}{PARTIAL}"
