"""MuJoCo's warnings, in sentences: it would print them, and append them to a file in the current folder."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Final

_SINGULAR: Final = re.compile(r"Inertia matrix is too close to singular.* at DOF (\d+)")
_UNSTABLE: Final = re.compile(r"huge value in (\w+) at \w+ (\d+)\..* Time = ([0-9.e+-]+)\.")
_WORDS: Final = {"QPOS": "position", "QVEL": "velocity", "QACC": "acceleration", "CTRL": "control"}

_lock = threading.Lock()
_collectors: list[list[str]] = []
_own: Callable[[str], None] | None = None
"""The handler of the process before the first of the contexts that are open."""


@contextmanager
def mujoco_warnings() -> Iterator[list[str]]:
    """Collect what MuJoCo warns of while the context lasts; where contexts are nested or meet, in the latest.

    Yields:
        The texts as MuJoCo words them, each once.
    """
    import mujoco

    global _own
    collected: list[str] = []
    with _lock:
        if not _collectors:
            _own = mujoco.get_mju_user_warning()
            mujoco.set_mju_user_warning(note_warning)
        _collectors.append(collected)
    try:
        yield collected
    finally:
        with _lock:
            del _collectors[next(i for i, other in enumerate(_collectors) if other is collected)]
            if not _collectors:
                mujoco.set_mju_user_warning(_own)


def note_warning(text: str) -> None:
    """Add what MuJoCo warned of, here or in another process, to what is collected."""
    with _lock:
        if _collectors and text not in _collectors[-1]:
            _collectors[-1].append(text)


def warning_sentences(texts: Sequence[str], joints: Sequence[str] = ()) -> tuple[str, ...]:
    """Return what MuJoCo warned of in our words, each sentence once.

    Args:
        texts: From ``mujoco_warnings``.
        joints: Names of the joints by degree of freedom, of a model whose base is fixed.
    """
    return tuple(dict.fromkeys(_sentence(" ".join(text.split()), joints) for text in texts))


def _sentence(text: str, joints: Sequence[str]) -> str:
    def named(dof: str) -> str:
        return joints[int(dof)] if int(dof) < len(joints) else f"degree of freedom {dof}"

    if found := _SINGULAR.search(text):
        return (
            f"What {named(found[1])} moves is lost in rounding beside the rest: its mass or inertia is too small, or "
            "that of other links too large, to be simulated."
        )
    if found := _UNSTABLE.search(text):
        what = _WORDS.get(found[1], found[1])
        return f"A simulation became unstable at {float(found[3]):g} s: {what} of {named(found[2])}."
    if "XML contains a 'NaN'" in text:
        return "An XML file contains NaN, which is not a number."
    return f"MuJoCo warns: {text.rstrip('.')}."
