"""What a page does with files: opens and compares robots, and hands out what was made of them.

Files that a page hands out; models are compared with the table first, as in any export.
"""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from dh2sim.export import Format, render, verify
from dh2sim.model.robot_model import RobotModel
from dh2sim.view.events import Compare, Event, OpenText, ReplaceText, Tell
from dh2sim.view.initial_state import builtin_ghost, is_same_file
from dh2sim.view.state import ViewState
from dh2sim.view.uploads import uploaded_ghost

_ENDINGS = {Format.URDF: "urdf", Format.MJCF: "xml"}
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The least time that a ZIP archive can hold: the same robot gives the same bytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Download:
    """A file for the user to keep."""

    name: str
    data: bytes = field(repr=False)
    summary: str
    """What was found when it was compared with the table."""


def model_file(model: RobotModel, wanted: Format) -> Download:
    """Return a robot's URDF or MJCF, compared with its table; in an archive where there are meshes with it.

    Args:
        model: The robot.
        wanted: Which.

    Raises:
        ModelError: The format cannot hold the robot.
        EngineError: MuJoCo refuses the file.
        MismatchError: The file's poses differ from the table's.
    """
    files = render(model, [wanted])
    with tempfile.TemporaryDirectory() as folder:
        write_files(files, Path(folder))
        (result,) = verify(model, Path(folder), [wanted])
    summary = f"off the table by at most {result.position_error:.1e} m and {result.rotation_error:.1e} rad"
    name = f"{model.name}.{_ENDINGS[wanted]}"
    if any(link.mesh is not None for link in model.all_links):
        return Download(name=f"{model.name}-{wanted.value}.zip", data=_archive(files), summary=summary)
    return Download(name=name, data=files[name], summary=summary)


def write_files(files: dict[str, bytes], folder: Path) -> None:
    """Write the files of an export into a folder."""
    for relative, data in files.items():
        path = folder / relative
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def _archive(files: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for relative, data in files.items():
            archive.writestr(zipfile.ZipInfo(relative, _EPOCH), data, zipfile.ZIP_DEFLATED)
    return stream.getvalue()


class RobotFiles:
    """Each call in its turn, on the page's own thread."""

    def __init__(
        self,
        state: Callable[[], ViewState],
        apply: Callable[[Event], None],
        hand_out: Callable[[str, bytes], None],
        exchanged: Callable[[], None],
    ) -> None:
        """Keep what is needed.

        Args:
            state: Returns the page's state; that of now is what can be returned to.
            apply: Lets an event happen now.
            hand_out: Gives the user a file, by its name and its content.
            exchanged: Called when another robot file is shown.
        """
        self._state = state
        self._apply = apply
        self._hand_out = hand_out
        self._exchanged = exchanged
        self._opened = state()

    def save(self) -> None:
        """Hand out the robot file as it is edited."""
        state = self._state()
        self._hand_out(f"{state.spec.name}.yaml", state.text.encode())

    def export(self, wanted: Format) -> None:
        """Hand out a model, compared with the table before.

        Raises:
            Dh2simError: It cannot be made, or does not match.
        """
        made = model_file(self._state().model, wanted)
        self._hand_out(made.name, made.data)
        self._apply(Tell(notice=f"{made.name}: {made.summary}."))

    def open(self, text: bytes, file: str) -> None:
        """Open a robot file that was uploaded, given its content and its name."""
        self._exchange(OpenText(text=text, file=file))

    def back(self) -> None:
        """Return to the robot file that was opened at first."""
        opened = self._opened
        if is_same_file(self._state(), opened):
            self._apply(ReplaceText(text=opened.text))
        else:
            self._exchange(OpenText(text=opened.text, file=opened.file, folder=opened.folder))

    def compare(self, robot: str) -> None:
        """Draw a robot that comes with dh2sim, given its name, beside the one that is shown.

        Raises:
            Dh2simError: There is no such robot.
        """
        self._apply(Compare(ghost=builtin_ghost(robot)))

    def compare_uploaded(self, text: bytes, file: str) -> None:
        """Draw the robot of a file that was uploaded beside the one that is shown.

        Raises:
            Dh2simError: The file is wrong.
        """
        self._apply(Compare(ghost=uploaded_ghost(text, file)))
        self._apply(Tell(notice=""))

    def _exchange(self, event: OpenText) -> None:
        """Show another robot, unless its file is wrong."""
        before = self._state().model
        self._apply(event)
        if self._state().model is not before:
            self._exchanged()
