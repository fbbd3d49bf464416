"""Robot files that come from the browser: read as any other, but nothing that they name is looked at.

Files that come from a browser in parts: put together, and never more in memory than a robot file may have.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import Final, TypeGuard

from dh2sim.errors import Dh2simError
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.yaml_tree import MAX_BYTES
from dh2sim.view.events import OpenText
from dh2sim.view.initial_state import state_of
from dh2sim.view.state import Ghost, ViewState
from dh2sim.view.table_edits import reading_of
from dh2sim.view.table_state import Source, Wrong, editable_text, read

MOST_PROBLEMS: Final = 12
"""That are told; how many more there are is told, too."""
_NAMELESS: Final = "robot.yaml"
_LONGEST_NAME: Final = 60
_STANDS: Final = "The robot is the one of before"


def file_name(given: str) -> str:
    """Return what messages call a file that a browser gave a name: no folders, printable, and not long."""
    name = re.split(r"[/\\]", given[-10 * _LONGEST_NAME :])[-1]
    printable = "".join(letter if letter.isprintable() else "_" for letter in name).strip()
    cut = printable if len(printable) <= _LONGEST_NAME else f"{printable[: _LONGEST_NAME - 6]}…{printable[-5:]}"
    return cut or _NAMELESS


def opened(state: ViewState, event: OpenText) -> ViewState:
    """Return the state with the robot of another file, at home; the one of before and a notice where that is wrong.

    What moves the joints ends, and nothing points at places of the robot that was shown before. Of that stay what is
    drawn, the unit of angles, and another robot to compare with.
    """
    source = Source(file=event.file, folder=event.folder)
    result = _read(event.text, source)
    if isinstance(result, Wrong):
        return replace(state, notice=f"{_STANDS}.\n{_told(result)}")
    text, model = result
    return replace(
        state_of(model, text, source),
        shown=state.shown,
        angle=state.angle,
        ghost=reading_of(model) if state.ghost is not None and state.ghost.reading else state.ghost,
        notice=f"Opened {source.file}: {_summary(model)}.",
    )


def uploaded_ghost(text: bytes, file: str) -> Ghost:
    """Return the robot of a file that comes from the browser, to stand beside the one that a page shows.

    Args:
        text: The file's content.
        file: Its name, for messages.

    Raises:
        Dh2simError: It is wrong; the text has a line for each problem.
    """
    result = _read(text, Source(file=file, folder=None))
    if isinstance(result, Wrong):
        raise Dh2simError(f"There is nothing new to compare with.\n{_told(result)}")
    _, model = result
    return Ghost(model=model, label=f"{model.name} (uploaded)")


def _read(text: str | bytes, source: Source) -> tuple[str, RobotModel] | Wrong:
    """Return the robot of a file, and its text as the table can be edited in."""
    model = read(text, source)
    if isinstance(model, Wrong):
        return model
    try:
        own = editable_text(model.spec, source)
    except Dh2simError as error:
        return Wrong(messages={"": str(error)})
    if model.spec.source_file is not None and own == model.spec.source_file.text:
        return own, model
    rewritten = read(own, source)
    return rewritten if isinstance(rewritten, Wrong) else (own, rewritten)


def _told(wrong: Wrong) -> str:
    """Return all that is wrong with a file, or the first of many problems; a line for each."""
    lines = wrong.told.split("\n")
    more = len(lines) - MOST_PROBLEMS
    return "\n".join(lines if more <= 0 else [*lines[:MOST_PROBLEMS], f"… and {more} more."])


def _summary(model: RobotModel) -> str:
    joints = len(model.joints)
    return f"{model.name}, {joints} {'joint' if joints == 1 else 'joints'}"


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
