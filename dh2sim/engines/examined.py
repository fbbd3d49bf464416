"""Model files that somebody else may have written, examined before engines open them in this process.

``validate`` and ``check`` read the exports in a folder, such as that of a pull request. An engine in this process
could be made to take all memory, or to open other files. So a file is scanned first, and MuJoCo compiles it in a
process with limits of memory and time; the model that comes back is what its engine uses.
"""

from __future__ import annotations

import re
from pathlib import Path, PurePath, PureWindowsPath
from typing import TYPE_CHECKING, Final

from dh2sim.errors import Dh2simError, EngineError, ModelError
from dh2sim.formats.mesh_paths import is_inside
from dh2sim.formats.mjcf.compile import compile_file
from dh2sim.formats.mjcf.includes import read_utf_8, scan_files
from dh2sim.formats.xml_read import Element, parse_xml
from dh2sim.messages import shown
from dh2sim.model.meshes import STL_FACE, STL_HEADER, read_mesh_file
from dh2sim.mujoco_warnings import note_warning

if TYPE_CHECKING:
    import mujoco

MOST_LINKS: Final = 4000
"""Of a URDF; an export has up to two a row, and some at its ends."""
_PATHS: Final = re.compile("^file|dir$")
"""Attributes of an MJCF that name files and folders."""


class Examined:
    """Files that were examined, each once."""

    def __init__(self) -> None:
        """Begin with none."""
        self._found: dict[Path, mujoco.MjModel | EngineError] = {}

    def model(self, path: Path) -> mujoco.MjModel:
        """Return the model in a URDF or an MJCF, once it is found harmless.

        Raises:
            EngineError: It is not, or MuJoCo refuses it.
        """
        if path not in self._found:
            try:
                self._found[path] = _compiled(path)
            except EngineError as error:
                self._found[path] = error
        found = self._found[path]
        if isinstance(found, EngineError):
            raise EngineError(str(found))
        return found


def _compiled(path: Path) -> mujoco.MjModel:
    """Return the model in a file.

    Raises:
        EngineError: It is not, or MuJoCo refuses it.
    """
    try:
        if path.suffix == ".urdf":
            _examine_urdf(path)
        else:
            _examine_mjcf(path)
    except Dh2simError as error:
        raise EngineError(str(error)) from error
    try:
        model, warnings = compile_file(path)
    except ModelError as error:
        raise EngineError(f"{path}: MuJoCo refuses the file: {error}") from error
    for text in warnings:
        note_warning(text)
    return model


def _examine_mjcf(path: Path) -> None:
    for root in scan_files(path, file=str(path), root=None).roots:
        for element in root.walk():
            for name, value in element.attributes.items():
                if _PATHS.search(name) and not _is_below(value):
                    raise _refused(path, element, f"names {shown(value)}, which is not below the file's folder")


def _examine_urdf(path: Path) -> None:
    root = parse_xml(read_utf_8(path, str(path), 0), file=str(path))
    links = 0
    for element in root.walk():
        links += element.tag == "link"
        name = element.attributes.get("filename")
        if name is not None:
            _examine_mesh(path, element, name)
    if links > MOST_LINKS:
        raise Dh2simError(f"{path}: has {links} links; at most {MOST_LINKS} are read")


def _examine_mesh(path: Path, element: Element, name: str) -> None:
    """Refuse what no export names: engines read meshes in this process."""
    file = path.parent / name
    if not _is_below(name) or (file.exists() and not is_inside(file, [path.parent.resolve()])):
        raise _refused(path, element, f"names {shown(name)}, which is not below the file's folder")
    try:
        data = read_mesh_file(file)
    except OSError as error:
        raise _refused(path, element, f"names {shown(name)}, which cannot be read: {error.strerror}") from None
    if len(data) < STL_HEADER or len(data) != STL_HEADER + STL_FACE * int.from_bytes(data[80:84], "little"):
        raise _refused(path, element, f"names {shown(name)}, which is not a binary STL file as exports have")


def _is_below(path: str) -> bool:
    parts = PurePath(path.replace("\\", "/"))
    return not parts.is_absolute() and not PureWindowsPath(path).anchor and ".." not in parts.parts


def _refused(path: Path, element: Element, message: str) -> Dh2simError:
    return Dh2simError(f"{path}:{element.line}:{element.column}: <{element.tag}> {message}")
