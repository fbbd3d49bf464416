"""Paths of a URDF's mesh files: ``package://`` and other names resolved."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final, TypeAlias
from urllib.parse import unquote

FindMesh: TypeAlias = Callable[[str], Path | None]
"""Returns the file of a mesh name, or None."""

_PACKAGES: Final = ("package://", "model://")
_NAME: Final = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")
_MAX_FOLDERS: Final = 1000
"""Searched for a package one level further down: a workspace groups packages in repositories."""


def mesh_finder(directory: Path, package_paths: Sequence[Path] = ()) -> FindMesh:
    """Return a function from the mesh names of a file to paths.

    ``package://pkg/rest`` and ``model://pkg/rest`` are looked for in the given folders, then in those of
    ``ROS_PACKAGE_PATH`` and ``AMENT_PREFIX_PATH`` (``share``), then in the file's own folder and those above it. In
    each, the package is a folder ``pkg``, the folder itself if it is called so or has a ``package.xml`` that says so,
    or, save above the file, a folder ``pkg`` one level further down. ``file://`` names and plain ones are paths,
    relative ones to the file's folder.

    Args:
        directory: The folder of the file that names the meshes.
        package_paths: Folders that hold packages, or are packages.

    Returns:
        A function that returns the absolute path of a file that exists, or None; it never raises.
    """
    home = directory.absolute()
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
                return _first(folder / name for folder in packages[package] for name in _spellings(rest))
        if uri.startswith("file://"):
            return _first(home / name for name in _spellings(uri.removeprefix("file://")))
        return None if not uri or "://" in uri else _first([home / uri])

    return find


def _spellings(name: str) -> Sequence[str]:
    """Return a path as it is, and with ``%20`` and the like replaced."""
    return list(dict.fromkeys((name, unquote(name))))


def _first(paths: Iterator[Path] | Sequence[Path]) -> Path | None:
    return next((path for path in paths if path.is_file()), None)


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
    for folder in (home, *home.parents):
        yield from _in(folder, package)


def _in(folder: Path, package: str) -> Iterator[Path]:
    if (folder / package).is_dir():
        yield folder / package
    if package in (folder.name, package_name(folder)):
        yield folder


def package_name(folder: Path) -> str | None:
    """Return the name that a folder's ``package.xml`` gives it; None where there is none."""
    try:
        with (folder / "package.xml").open("rb") as stream:
            found = _NAME.search(stream.read(100_000))
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
