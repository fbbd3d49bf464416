"""Files that come from a browser in parts: put together, and never more in memory than a robot file may have."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, TypeGuard

from dh2sim.errors import Dh2simError
from dh2sim.robot.document import MAX_BYTES
from dh2sim.view.uploads import file_name

MOST_PARTS: Final = 16
"""Of one file; viser's page sends half a megabyte at a time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Uploaded:
    """A file that has come whole."""

    button: str
    """Which it was chosen with."""
    name: str
    """For messages; fit to be shown, and no path."""
    data: bytes = field(repr=False)


@dataclass(slots=True, kw_only=True)
class _Incoming:
    transfer: str
    button: str
    name: str
    size: int
    count: int
    parts: dict[int, bytes] = field(default_factory=dict)

    @property
    def received(self) -> int:
        return sum(len(part) for part in self.parts.values())


class Intake:
    """Takes one file at a time; whatever a page sends, it holds ``MAX_BYTES`` at most. Not for two threads."""

    def __init__(self) -> None:
        """Wait for a file."""
        self._incoming: _Incoming | None = None

    @property
    def held(self) -> int:
        """Bytes of files that have not come whole."""
        return 0 if self._incoming is None else self._incoming.received

    @property
    def awaited(self) -> tuple[str, str] | None:
        """The button and the transfer of the file that is coming, if any."""
        return None if self._incoming is None else (self._incoming.button, self._incoming.transfer)

    def announce(self, *, transfer: str, button: str, name: object, size: object, count: object) -> Uploaded | None:
        """Expect a file, instead of one that has not come whole; an empty one is there at once.

        Args:
            transfer: What its parts are known by.
            button: Which it was chosen with.
            name: As the browser gives it. This and the following may be anything.
            size: Of the file, bytes.
            count: Of its parts.

        Raises:
            Dh2simError: It is too large, or the announcement makes no sense; no part of it will be kept.
        """
        self._incoming = None
        known = file_name(name) if isinstance(name, str) else file_name("")
        if _is_count(size) and size > MAX_BYTES:
            raise Dh2simError(f"{known} has {size} bytes; at most {MAX_BYTES} are allowed.")
        if not (_is_count(size) and _is_count(count)) or count > MOST_PARTS or (count == 0) != (size == 0):
            raise Dh2simError(f"{known} was announced otherwise than browsers do.")
        if count == 0:
            return Uploaded(button=button, name=known, data=b"")
        self._incoming = _Incoming(transfer=transfer, button=button, name=known, size=size, count=count)
        return None

    def take(self, *, transfer: object, index: object, content: object) -> Uploaded | None:
        """Take a part; return the file if that was the last one. Parts of files that are not expected are dropped.

        Raises:
            Dh2simError: The file is not what was announced; nothing of it is kept.
        """
        coming = self._incoming
        if coming is None or transfer != coming.transfer:
            return None
        if not (_is_count(index) and isinstance(content, bytes)):
            raise self._dropped(coming)
        if index >= coming.count or index in coming.parts or coming.received + len(content) > coming.size:
            raise self._dropped(coming)
        coming.parts[index] = content
        if len(coming.parts) < coming.count:
            return None
        if coming.received != coming.size:
            raise self._dropped(coming)
        self._incoming = None
        data = b"".join(coming.parts[i] for i in range(coming.count))
        return Uploaded(button=coming.button, name=coming.name, data=data)

    def _dropped(self, coming: _Incoming) -> Dh2simError:
        self._incoming = None
        return Dh2simError(f"{coming.name} came otherwise than it was announced; nothing of it was kept.")


def _is_count(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0
