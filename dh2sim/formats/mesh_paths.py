"""Paths of mesh files: ``package://`` and other names resolved, and kept to the folders that a file may use."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final, TypeAlias
from urllib.parse import unquote

from dh2sim.errors import Dh2simError
from dh2sim.input_files import read_input

FindMesh: TypeAlias = Callable[[str], Path | None]
"""Returns the file of a mesh name, or None."""


OUTSIDE: Final = "Meshes outside of the file's own folders are used only with root, a folder that holds them: {}."
"""Note on links that have such meshes."""


class MeshOutsideError(Dh2simError):
    """A mesh exists, but where a file of a stranger may not reach."""


_PACKAGES: Final = ("package://", "model://")
_NAME: Final = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")
_MAX_FOLDERS: Final = 1000
"""Searched for a package one level further down: a workspace groups packages in repositories."""


def own_folders(directory: Path) -> tuple[Path, ...]:
    """Return the folders that hold what belongs to a file: its own, and where its package ends, links resolved.

    The package is the folder above with a ``package.xml``; without one, the folder above the file's, as in
    ``urdf/arm.urdf`` and ``meshes/link.stl``.
    """
    home = Path(os.path.realpath(directory))
    package = next((folder for folder in (home, *home.parents) if package_name(folder) is not None), home.parent)
    return (home,) if package == package.parent else (home, package)


def is_inside(path: Path, folders: Iterable[Path]) -> bool:
    """Whether a file is in or below one of some folders, links resolved; these are given without links."""
    real = Path(os.path.realpath(path))
    return any(real.is_relative_to(folder) for folder in folders)


def mesh_finder(directory: Path, package_paths: Sequence[Path] = (), root: Path | None = None) -> FindMesh:
    """Return a function from the mesh names of a file to paths.

    ``package://pkg/rest`` and ``model://pkg/rest`` are looked for in the given folders, then in those of
    ``ROS_PACKAGE_PATH`` and ``AMENT_PREFIX_PATH`` (``share``), then in the file's own folder and those above it. In
    each, the package is a folder ``pkg``, the folder itself if it is called so or has a ``package.xml`` that says so,
    or, save above the file, a folder ``pkg`` one level further down. ``file://`` names and plain ones are paths,
    relative ones to the file's folder. No name and no link leads out of the package that it names, of those in
    ``package_paths``, or of the file's own (``own_folders``), unless into ``root``.

    Args:
        directory: The folder of the file that names the meshes.
        package_paths: Folders that hold packages, or are packages.
        root: A folder, in and below which any file may be named.

    Returns:
        A function that returns the absolute path of a file that exists, or None; it raises nothing but a
        MeshOutsideError, where there is such a file that may not be used.
    """
    home = directory.absolute()
    given = [*package_paths, *([] if root is None else [root])]
    allowed = (*own_folders(home), *(Path(os.path.realpath(path)) for path in given))
    roots = [*(path.absolute() for path in package_paths), *_environment()]
    packages: dict[str, list[Path]] = {}

    def find(uri: str) -> Path | None:
        try:
            return _find(uri)
        except (OSError, ValueError):  # an impossible file name, or a folder that cannot be read
            return None

    def _find(uri: str) -> Path | None:
        for scheme in _PACKAGES:
            if uri.startswith(scheme):
                package, _, rest = uri.removeprefix(scheme).partition("/")
                if package in ("", ".", "..") or not rest:
                    return None
                if package not in packages:
                    packages[package] = list(dict.fromkeys(_folders(package, roots, home)))
                return _first(
                    (folder / name, (*allowed, Path(os.path.realpath(folder))))
                    for folder in packages[package]
                    for name in _spellings(rest)
                )
        if uri.startswith("file://"):
            return _first((home / name, allowed) for name in _spellings(uri.removeprefix("file://")))
        return None if not uri or "://" in uri else _first([(home / uri, allowed)])

    return find


def _spellings(name: str) -> Sequence[str]:
    """Return a path as it is, and with ``%20`` and the like replaced."""
    return list(dict.fromkeys((name, unquote(name))))


def _first(candidates: Iterable[tuple[Path, Sequence[Path]]]) -> Path | None:
    """Return the first of some paths that is a file in one of the folders beside it.

    Raises:
        MeshOutsideError: There are such files, but none in these folders.
    """
    outside = None
    for path, folders in candidates:
        if path.is_file():
            if is_inside(path, folders):
                return path
            outside = outside or path
    if outside is not None:
        raise MeshOutsideError(f"{outside} is outside of the file's own folders")
    return None


def _environment() -> list[Path]:
    """Return the folders of packages in the environment variables of ROS 1 and ROS 2."""
    ros_1 = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    ros_2 = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    paths = [Path(path) for path in ros_1 if path] + [Path(path, "share") for path in ros_2 if path]
    return [path.absolute() for path in paths]


def _folders(package: str, roots: Sequence[Path], home: Path) -> Iterator[Path]:
    """Yield folders that may be the package, the likeliest first."""
    for root in roots:
        yield from _in(root, package)
        yield from (folder / package for folder in _subfolders(root) if (folder / package).is_dir())
    for folder in (home, *home.parents[:-1]):  # no folder of a whole disk is a package
        yield from _in(folder, package)


def _in(folder: Path, package: str) -> Iterator[Path]:
    if (folder / package).is_dir():
        yield folder / package
    if package in (folder.name, package_name(folder)):
        yield folder


def package_name(folder: Path) -> str | None:
    """Return the name that a folder's ``package.xml`` gives it; None where there is none."""
    try:
        found = _NAME.search(read_input(folder / "package.xml", 100_000))
    except OSError:
        return None
    return found.group(1).decode("utf-8", "replace") if found else None


def _subfolders(root: Path) -> list[Path]:
    try:
        with os.scandir(root) as entries:
            names = sorted(
                entry.name for entry, _ in zip(entries, range(_MAX_FOLDERS), strict=False) if entry.is_dir()
            )
    except OSError:
        return []
    return [root / name for name in names]
