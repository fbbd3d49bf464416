"""The files of an MJCF, scanned before MuJoCo opens any: which files it includes, and how large it becomes."""

from __future__ import annotations

import math
import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath
from typing import Final, NamedTuple

from dh2sim.errors import Dh2simError, ImportedFileError, Problem
from dh2sim.formats.mesh_paths import is_inside, own_folders
from dh2sim.formats.xml_read import MAX_BYTES, Element, XmlReport, parse_xml
from dh2sim.messages import shown


def read_utf_8(path: Path, name: str, before: int) -> bytes:
    """Return the content of a file.

    Args:
        path: The file; a pipe or a device is not read.
        name: What messages call it.
        before: Number of bytes of the model that were read before; of all together there is a limit.

    Raises:
        ImportedFileError: The files are too large, or this one is not in UTF-8.
        Dh2simError: It cannot be read.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise Dh2simError(f"{name}: not a regular file")
        with path.open("rb") as stream:
            data = stream.read(max(MAX_BYTES - before, 0) + 1)
    except (OSError, ValueError) as error:
        raise Dh2simError(f"{name}: cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if before + len(data) > MAX_BYTES:
        raise refused(
            name, 1, f"the file is too large: at most {MAX_BYTES} bytes are read, with all that it includes"
        )
    _check_utf_8(data, name)
    return data


def _check_utf_8(data: bytes, name: str) -> None:
    try:
        data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        message = f"not UTF-8: byte 0x{data[error.start]:02x}; MuJoCo reads no other encoding"
        raise refused(name, line, message) from None


def refused(file: str, line: int, message: str) -> ImportedFileError:
    """Return an error at a line of a file."""
    return ImportedFileError([Problem(file=file, line=line, column=1, path="", message=message)])


MAX_FILES: Final = 200
MAX_ELEMENTS: Final = 10_000
"""After includes, attachments and repetitions; MuJoCo's time to read them grows with the square of their number."""
MAX_POINTS: Final = 4_000_000
"""Of a height field."""
MAX_NESTING: Final = 510
"""Elements, through all includes. MuJoCo's own limit in one file is 500."""
MAX_MODELS: Final = 10
"""Models that are attached to one another."""


class Place(NamedTuple):
    """Where an element is."""

    file: str
    """As messages call it."""
    line: int
    column: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MjcfFiles:
    """An MJCF and all that it includes, scanned and found harmless."""

    path: Path
    """The file itself, absolute."""
    file: str
    """What messages call it."""
    folders: tuple[Path, ...]
    """Of the file and of every model that it attaches; their meshes are looked for from there."""
    allowed: tuple[Path, ...]
    """Folders in and below which meshes are used, without links."""
    models: int
    """Number of models: the file itself and those that are attached."""
    places: Mapping[tuple[str, str], Place] = field(repr=False)
    """Of elements, by tag and name."""
    roots: tuple[Element, ...] = field(repr=False)
    """Of all files."""

    def error(self, message: str, *, path: str = "", element: tuple[str, str] | None = None) -> ImportedFileError:
        """Return an error at an element, given by tag and name, or at the file's beginning."""
        return ImportedFileError([self.problem(message, path=path, element=element)])

    def problem(self, message: str, *, path: str = "", element: tuple[str, str] | None = None) -> Problem:
        """Return a problem at an element, given by tag and name, or at the file's beginning."""
        place = self.places.get(element, Place(self.file, 1, 1)) if element else Place(self.file, 1, 1)
        return Problem(file=place.file, line=place.line, column=place.column, path=path, message=message)


def scan_files(path: Path, *, file: str, root: Path | None) -> MjcfFiles:
    """Read an MJCF and the files that it includes or attaches, without MuJoCo.

    Args:
        path: The file.
        file: Its name, for messages.
        root: Folder outside of which no file is included; by default the file's own.

    Raises:
        ImportedFileError: Not an MJCF; a file outside of ``root`` is included; a plugin is requested; or the whole is
            larger than the limits above.
        Dh2simError: A file cannot be read.
    """
    main = path.absolute()
    search = _Search(main, file, root)
    search.model(main, file)
    return MjcfFiles(
        path=main,
        file=file,
        folders=tuple(search.folders),
        allowed=(
            Path(os.path.realpath(search.root)),
            *(own for folder in search.folders for own in own_folders(folder)),
        ),
        models=search.models,
        places=search.places,
        roots=tuple(search.trees.values()),
    )


class _Search:
    """The files of all models so far."""

    def __init__(self, main: Path, file: str, root: Path | None) -> None:
        self._main = main
        self.file = file
        self.root = Path(os.path.normpath(main.parent if root is None else root.absolute()))
        self.allowed = "the model's folder" if root is None else str(root)
        self.folders: dict[Path, None] = {}
        self.places: dict[tuple[str, str], Place] = {}
        self.trees: dict[Path, Element] = {}
        self.nested = 0
        self._bytes = 0
        self._counts: dict[Path, int] = {}
        self._open: list[Path] = []

    def model(self, path: Path, name: str) -> int:
        """Return the number of elements that MuJoCo makes of a model file."""
        if path in self._counts:
            return self._counts[path]
        self.folders.setdefault(path.parent)
        self._open.append(path)
        root = self.tree(path, name)
        if root.tag != "mujoco":
            what = ": this is a URDF, not an MJCF" if root.tag == "robot" else ""
            raise XmlReport(name).failure(root, "", f"expected <mujoco>, found <{root.tag[:60]}>{what}")
        self._counts[path] = _Model(self, path, name).expanded_size(root)
        self._open.pop()
        return self._counts[path]

    @property
    def models(self) -> int:
        """Number of models."""
        return len(self._counts)

    def root_hint(self, path: Path) -> str:
        """Return how to allow a file outside, or nothing where that would be a whole disk."""
        folder = Path(os.path.commonpath([self.root, path.parent]))
        if folder == folder.parent:
            return ""
        named = os.path.join(os.path.dirname(self.file), os.path.relpath(folder, self._main.parent))
        return f"; allow others with root={os.path.normpath(named)!r}"

    def attach_problem(self, path: Path) -> str | None:
        """Return why a model must not be attached to those that are being scanned, or None."""
        if path in self._open:
            return "a model cannot be attached to itself"
        return f"models are attached more than {MAX_MODELS} deep" if len(self._open) > MAX_MODELS else None

    def tree(self, path: Path, name: str) -> Element:
        """Return the root element of a file, and record the places of its named elements."""
        if path in self.trees:
            return self.trees[path]
        data = read_utf_8(path, name, self._bytes)
        self._bytes += len(data)
        root = self.trees[path] = parse_xml(data, file=name)
        if len(self.trees) > MAX_FILES:
            raise refused(self.file, 1, f"the model is made of more than {MAX_FILES} files")
        for element in root.walk():
            tag, own = element.tag, element.attributes.get("name", "")
            if own:
                place = Place(name, element.line, element.column)
                self.places.setdefault(("joint" if tag == "freejoint" else tag, own), place)
        return root


class _Model:
    """One model and the files that it includes."""

    def __init__(self, search: _Search, path: Path, name: str) -> None:
        self._search = search
        self._path = path
        self._name = name
        self._included: list[Path] = []
        self._attached: dict[str, int] = {}
        self._here = (path.parent, XmlReport(name))

    def expanded_size(self, root: Element) -> int:
        """Return the number of elements that MuJoCo makes of the model."""
        self._count(root)  # models may be attached before they are named
        self._included.clear()
        return self._count(root)

    def _count(self, element: Element) -> int:
        self._search.nested += 1
        if self._search.nested > MAX_NESTING:
            raise self._failure(element, f"elements are nested more than {MAX_NESTING} deep")
        total = _own_count(element)
        match element.tag:
            case "plugin":
                message = "<plugin> is refused: plugins are never run. Remove it and what needs it, and import again"
                raise self._failure(element, message)
            case "include":
                total += self._include(element)
            case "model":
                total += self._model(element)
            case "attach":
                total += self._attached.get(element.attributes.get("model", ""), 0)
            case "flexcomp" if "file" in element.attributes:
                self._check_inside(element)  # MuJoCo opens it while it reads the text
            case "hfield":
                if (points := _points(element)) > MAX_POINTS:
                    message = f"a height field of {points} points; at most {MAX_POINTS} are read"
                    raise self._failure(element, message)
        for child in element.children:
            total += self._count(child)
        if element.tag == "replicate":
            total *= max(1, _whole(element.attributes.get("count", "1")))
        if total > MAX_ELEMENTS:
            raise self._failure(element, f"this makes more than {MAX_ELEMENTS} elements once it is expanded")
        self._search.nested -= 1
        return total

    def _failure(self, element: Element, message: str, attribute: str = "") -> ImportedFileError:
        path = f"{element.tag}.{attribute}" if attribute else element.tag
        return self._here[1].failure(element, path[:60], message)

    def _include(self, element: Element) -> int:
        path, name = self._found(element)
        if path == self._path or path in self._included:
            raise self._failure(element, f"the file {shown(name)} is included already; MuJoCo includes a file once")
        self._included.append(path)
        before, self._here = self._here, (path.parent, XmlReport(name))
        self._search.nested += 1  # a call more than an element in an element
        total = self._count(self._search.tree(path, name))
        self._search.nested -= 1
        self._here = before
        return total

    def _model(self, element: Element) -> int:
        path, name = self._found(element)
        if (why := self._search.attach_problem(path)) is not None:
            raise self._failure(element, f"{shown(name)} is refused: {why}")
        count = self._search.model(path, name)
        own = self._search.tree(path, name).attributes.get("model", "")
        self._attached[element.attributes.get("name", own)] = count
        return count

    def _found(self, element: Element) -> tuple[Path, str]:
        """Return the file that an element names, and what messages call it."""
        paths = self._check_inside(element)
        path = next((path for path in paths if os.path.lexists(path)), None)
        if path is not None:
            return path, os.path.join(os.path.dirname(self._name), os.path.relpath(path, self._path.parent))
        given = shown(element.attributes.get("file", ""))
        raise self._failure(element, f"no file {given} in {self._path.parent}", "file")

    def _check_inside(self, element: Element) -> tuple[Path, ...]:
        """Return the files that an element may name, which must be in the folder that is allowed.

        MuJoCo looks in the model's folder first, then in that of the file with the element.
        """
        given = element.attributes.get("file", "")
        folders = dict.fromkeys((self._path.parent, self._here[0]))
        paths = [Path(os.path.normpath(folder / given.replace("\\", "/"))) for folder in folders]
        there = [path for path in paths if os.path.lexists(path)]
        root = self._search.root
        outside = [path for path in there or paths if not path.is_relative_to(root)]
        outside += [path for path in there if not is_inside(path, [Path(os.path.realpath(root))])]  # by a link
        on_a_drive = os.name != "nt" and PureWindowsPath(given).drive
        if not given or outside or on_a_drive:
            hint = self._search.root_hint(outside[0]) if there and outside else ""
            message = f"found {shown(given)}; only files in {self._search.allowed} and those below it are read{hint}"
            raise self._failure(element, message, "file")
        return tuple(paths)


def _own_count(element: Element) -> int:
    """Return how many elements MuJoCo's work on an element itself is worth.

    A node of a soft body is a body with three joints; a chain of n bodies costs as much as n² / 16 elements side by
    side, a built-in mesh of n by n vertices as n² / 8, and a height field of as many points as n² / 1000.
    """
    match element.tag:
        case "flexcomp":
            return 4 * _product(element.attributes.get("count", "1"))
        case "composite":
            count = _product(element.attributes.get("count", "1"))
            return count + count * count // 16
        case "mesh" if "builtin" in element.attributes:
            sizes = element.attributes.get("params", "1").split()[:2]
            return 1 + max([_whole(size) ** 2 // 8 for size in sizes], default=0)
        case "hfield":
            return 1 + _points(element) // 1000
        case _:
            return 1


def _points(field: Element) -> int:
    """Return the number of points that a height field without a file has."""
    return _whole(field.attributes.get("nrow", "0")) * _whole(field.attributes.get("ncol", "0"))


def _product(text: str) -> int:
    total = 1
    for word in text.split()[:10]:
        total = min(total * max(1, _whole(word)), 10**12)
    return total


def _whole(text: str) -> int:
    """Return a text as a whole number, 1 where it is not a number: MuJoCo complains of those."""
    try:
        value = float(text)
    except ValueError:
        return 1
    return int(min(max(value, 0.0), 1e12)) if math.isfinite(value) else 10**12
