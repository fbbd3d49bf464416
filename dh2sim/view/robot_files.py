"""What a page does with files: it opens robots, compares them, and offers models for download."""

from __future__ import annotations

import contextlib
import io
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from dh2sim.errors import Dh2simError
from dh2sim.export import Format, render, verify_files
from dh2sim.input_files import read_input
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.catalog import builtin_path, builtin_robots
from dh2sim.robot.yaml_tree import MAX_BYTES
from dh2sim.view.events import Compare, Event, Notify, OpenText, ReplaceText
from dh2sim.view.initial_state import builtin_ghost, is_same_file, uploaded_ghost
from dh2sim.view.state import ViewState

_SUFFIXES = {Format.URDF: "urdf", Format.MJCF: "xml"}
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a ZIP archive can hold, so that the same robot gives the same bytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Download:
    """A file for download."""

    name: str
    data: bytes = field(repr=False)
    summary: str
    """Result of the comparison with the table."""


def model_file(model: RobotModel, kind: Format) -> Download:
    """Return a robot's URDF or MJCF, verified against its table; in an archive if it has meshes.

    Args:
        model: The robot.
        kind: Which of them.

    Raises:
        ModelError: The format cannot hold the robot.
        EngineError: MuJoCo refuses the file.
        MismatchError: The file's poses differ from the table's.
    """
    files = render(model, [kind])
    with tempfile.TemporaryDirectory() as folder:
        write_files(files, Path(folder))
        (result,) = verify_files(model, Path(folder), [kind])
    summary = f"largest difference to the table {result.position_error:.1e} m, {result.rotation_error:.1e} rad"
    name = f"{model.name}.{_SUFFIXES[kind]}"
    if any(link.mesh is not None for link in model.all_links):
        return Download(name=f"{model.name}-{kind.value}.zip", data=_archive(files), summary=summary)
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


MAX_BESIDE = 100
"""Robot files beside the first one that can be chosen."""


def robot_files_in(folder: Path | None) -> tuple[str, ...]:
    """Return the names of the robot files in a folder, sorted; none for that of the robots that come with dh2sim.

    A YAML file with a key ``joints`` that is not too large for a robot file counts as one. It is read when chosen.
    """
    if folder is None or folder == _builtin_folder():
        return ()
    with contextlib.suppress(OSError):
        files = [file for file in sorted(folder.iterdir()) if file.suffix in (".yaml", ".yml")]
        return tuple(file.name for file in files if _is_robot_file(file))[:MAX_BESIDE]
    return ()


def _is_robot_file(file: Path) -> bool:
    try:
        data = read_input(file, MAX_BYTES) if file.is_file() else b""
    except OSError:
        return False
    return len(data) <= MAX_BYTES and b"\njoints:" in b"\n" + data


def _builtin_folder() -> Path | None:
    path = next(map(builtin_path, builtin_robots()), None)
    return None if path is None else path.parent


def _name_of(state: ViewState) -> str:
    """Return the name of a robot that comes with dh2sim, or of the file."""
    return _listed_name(state.file, state.folder)


@lru_cache(maxsize=8)  # asked for with every picture
def _listed_name(file: str, folder: Path | None) -> str:
    name = Path(file).name
    return name.removesuffix(".yaml") if folder is not None and folder == _builtin_folder() else name


class RobotFiles:
    """The file actions of a page; used on the page's thread alone."""

    def __init__(
        self,
        state: Callable[[], ViewState],
        apply: Callable[[Event], None],
        download: Callable[[str, bytes], None],
        on_open: Callable[[], None],
    ) -> None:
        """Remember the robot file that was opened first.

        Args:
            state: Returns the page's state.
            apply: Applies an event at once.
            download: Offers a file for download, given its name and content.
            on_open: Called when another robot file is shown.
        """
        self._state = state
        self._apply = apply
        self._download = download
        self._on_open = on_open
        self._initial = state()
        self._beside = robot_files_in(self._initial.folder)
        self._known = (*self._beside, *builtin_robots())

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots to choose from: files beside the first one, those that come with dh2sim, and the present one."""
        return self._known if self.chosen in self._known else (self.chosen, *self._known)

    @property
    def chosen(self) -> str:
        """The robot that is shown, as ``robots`` names it."""
        return _name_of(self._state())

    def choose(self, robot: str) -> None:
        """Open one of ``robots``.

        Raises:
            Dh2simError: The file cannot be read, or is no longer there.
        """
        if robot == self.chosen:
            return
        if robot == _name_of(self._initial):
            self.reopen()
            return
        beside = robot in self._beside and self._initial.folder is not None
        path = self._initial.folder / robot if beside and self._initial.folder is not None else builtin_path(robot)
        if path is None:
            raise Dh2simError(f"{robot} is no longer there.")
        try:
            text = read_input(path, MAX_BYTES)
        except OSError as error:
            raise Dh2simError(f"{robot}: {error.strerror or error}") from error
        self._open(OpenText(text=text, file=path.name, folder=path.parent))

    def save(self) -> None:
        """Offer the robot file as edited."""
        state = self._state()
        self._download(f"{state.spec.name}.yaml", state.text.encode())

    def export(self, kind: Format) -> None:
        """Offer a model that was verified against the table.

        Raises:
            Dh2simError: It cannot be made, or does not match.
        """
        made = model_file(self._state().model, kind)
        self._download(made.name, made.data)
        self._apply(Notify(notice=f"{made.name}: {made.summary}."))

    def open(self, text: bytes, file: str) -> None:
        """Open an uploaded robot file, given its content and its name."""
        self._open(OpenText(text=text, file=file))

    def reopen(self) -> None:
        """Return to the robot file that was opened first."""
        initial = self._initial
        if is_same_file(self._state(), initial):
            self._apply(ReplaceText(text=initial.text))
        else:
            self._open(OpenText(text=initial.text, file=initial.file, folder=initial.folder))

    def compare(self, robot: str) -> None:
        """Draw a built-in robot, given its name, as the ghost.

        Raises:
            Dh2simError: The robot is unknown.
        """
        self._apply(Compare(ghost=builtin_ghost(robot)))

    def compare_uploaded(self, text: bytes, file: str) -> None:
        """Draw the robot of an uploaded file as the ghost.

        Raises:
            Dh2simError: The file is invalid.
        """
        self._apply(Compare(ghost=uploaded_ghost(text, file)))
        self._apply(Notify(notice=""))

    def _open(self, event: OpenText) -> None:
        """Show another robot, unless its file is invalid."""
        before = self._state().model
        self._apply(event)
        if self._state().model is not before:
            self._on_open()
