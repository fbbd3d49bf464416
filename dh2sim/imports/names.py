"""Names of other formats as names that a robot file allows."""

from __future__ import annotations

import re
from collections.abc import Sequence

from dh2sim.robot.fields import LONGEST_NAME, is_reserved, name_problem
from dh2sim.robot.words import shown

_FALLBACK = "robot"


def robot_name(name: str) -> str:
    """Return a name that a robot file allows, as near to ``name`` as can be."""
    return _legal(name) or _FALLBACK


def joint_names(names: Sequence[str]) -> tuple[tuple[str, ...], list[str]]:
    """Return names that a robot file allows, all different, and a sentence for each that had to be changed.

    Args:
        names: The joints' names, base first; an empty one stands for a joint without a name.
    """
    taken = {name for name in names if _fits(name)}
    used: set[str] = set()
    changed, notes = [], []
    for i, name in enumerate(names, start=1):
        new = name
        if not _fits(name) or name in used:
            stem = _legal(name) or f"joint_{i}"
            new = next(n for n in (stem, *(f"{stem}_{k}" for k in range(2, len(names) + 3))) if n not in taken | used)
            if name:
                notes.append(f"Joint {shown(name)} is named {new} here: a robot file does not allow its name.")
        used.add(new)
        changed.append(new)
    return tuple(changed), notes


def _fits(name: str) -> bool:
    return name_problem(name) is None and not is_reserved(name)


def _legal(name: str) -> str:
    """Return the name with what is not allowed replaced; empty where nothing is left."""
    cleaned = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_-")
    if cleaned and not cleaned[0].isalpha():
        cleaned = f"n{cleaned}"
    cleaned = cleaned[: LONGEST_NAME - 8]
    return f"{cleaned}_" if is_reserved(cleaned) else cleaned
