"""The robots that come with dh2sim."""

from __future__ import annotations

from pathlib import Path
from typing import Final

_PACKAGE: Final = Path(__file__).resolve().parent.parent
_FOLDERS: Final = (_PACKAGE / "robots", _PACKAGE.parent / "robots")
"""In an installed wheel; in a checkout."""


def builtin_robots() -> tuple[str, ...]:
    """Return the names of the robots that come with dh2sim, sorted."""
    return tuple(sorted(path.stem for path in _folder().glob("*.yaml")))


def builtin_path(name: str) -> Path | None:
    """Return the file of a robot that comes with dh2sim, with or without ``.yaml``; None for others."""
    stem = name.removesuffix(".yaml")
    return _folder() / f"{stem}.yaml" if stem in builtin_robots() else None


def _folder() -> Path:
    """Return the folder of robot files; the package's own one where there is one."""
    return next((folder for folder in _FOLDERS if folder.is_dir()), _FOLDERS[0])
