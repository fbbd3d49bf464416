"""The robots that come with dh2sim: their files, and what a list says of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from dh2sim.robot.yaml_tree import Node, Report, compose

_PACKAGE: Final = Path(__file__).resolve().parent.parent
_FOLDERS: Final = (_PACKAGE / "robots", _PACKAGE.parent / "robots")
"""In an installed wheel; in a checkout."""
_MECHANISMS: Final = "mechanisms"
"""The folder in it of the files with branches and closed loops."""
_GROUPS: Final = "groups.toml"
"""The file in the folder that sorts the robots: a list of names for each group."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """What a list says of a robot."""

    name: str
    group: str
    """What kind of robot it is, in the singular: 'course robot', 'cobot', …"""
    joints: str
    """The moving rows, base first: R for a revolute joint, P for a prismatic one."""
    conventions: tuple[str, ...]
    """Of its rows, each once, in their order."""
    description: str
    source: str


def builtin_robots() -> tuple[str, ...]:
    """Return the names of the robots that come with dh2sim, sorted."""
    return tuple(sorted(path.stem for path in _folder().glob("*.yaml")))


def builtin_mechanisms() -> tuple[str, ...]:
    """Return the names of the mechanisms with branches and closed loops that come with dh2sim, sorted."""
    return tuple(sorted(path.stem for path in (_folder() / _MECHANISMS).glob("*.yaml")))


def builtin_path(name: str) -> Path | None:
    """Return the file of what comes with dh2sim by this name, with or without ``.yaml``; None for others."""
    stem = name.removesuffix(".yaml")
    if stem in builtin_robots():
        return _folder() / f"{stem}.yaml"
    return _folder() / _MECHANISMS / f"{stem}.yaml" if stem in builtin_mechanisms() else None


def builtin_groups() -> dict[str, tuple[str, ...]]:
    """Return the names of the robots that come with dh2sim, by what kind of robot they are."""
    import tomllib

    file = _folder() / _GROUPS
    listed = tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return {group: tuple(names) for group, names in listed.items()}


def builtin_group(name: str, text: str) -> str | None:
    """Return the group of the robot that comes with dh2sim by this name and with this file, None for others."""
    path = builtin_path(name)
    if path is None or path.read_text(encoding="utf-8") != text:
        return None
    if path.parent.name == _MECHANISMS:
        return "mechanism"
    return next((group for group, names in builtin_groups().items() if name in names), None)


def summaries() -> Iterator[Summary]:
    """Yield the summary of every robot that comes with dh2sim, group by group.

    Their files are known to be right, so they are not checked, and no number in them is evaluated.
    """
    for group, names in builtin_groups().items():
        for name in names:
            yield _summary(_folder() / f"{name}.yaml", group)


def mechanism_summaries() -> Iterator[Summary]:
    """Yield the summary of every mechanism that comes with dh2sim, by name; its joints are those of all chains."""
    for name in builtin_mechanisms():
        yield _summary(_folder() / _MECHANISMS / f"{name}.yaml", "mechanism")


def _summary(path: Path, group: str) -> Summary:
    root = compose(path.read_text(encoding="utf-8"), Report(path.name))
    branches = root.at("branches")
    chains = [root, *_entries(branches)]
    rows = [row for chain in chains for row in _rows(chain)]
    types = [_text(row, "type") for row in rows]
    common = _text(root, "convention")
    return Summary(
        name=_text(root, "name"),
        group=group,
        joints="".join("P" if kind == "prismatic" else "R" for kind in types if kind != "fixed"),
        conventions=tuple(dict.fromkeys(_text(row, "convention") or common for row in rows)),
        description=" ".join(_text(root, "description").split()),
        source=" ".join(_text(root, "source").split()),
    )


def _entries(mapping: Node | None) -> list[Node]:
    found = None if mapping is None else mapping.value
    return [entry.value for entry in found.values()] if isinstance(found, dict) else []


def _rows(chain: Node) -> list[Node]:
    rows = chain.at("joints")
    assert rows is not None and isinstance(rows.value, list), chain  # noqa: PT018
    return rows.value


def _text(node: Node, key: str) -> str:
    """Return the text of a key, empty where it is missing."""
    found = node.at(key)
    return str(found.value) if found else ""


def _folder() -> Path:
    """Return the folder of robot files; the package's own one where there is one."""
    return next((folder for folder in _FOLDERS if folder.is_dir()), _FOLDERS[0])
