"""What of an MJCF has no place in a serial arm, told in a few sentences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from dh2sim.formats.from_mjcf.chain import Selection, names_of
from dh2sim.formats.from_mjcf.compile import Compiled
from dh2sim.formats.from_mjcf.masses import weight_of
from dh2sim.formats.from_mjcf.tree import WORLD, MjcfTree
from dh2sim.formats.notes import Notes
from dh2sim.robot.words import listed, shown

_MOST_BRANCHES: Final = 20
"""Branches that are told one by one."""


def note_leftovers(compiled: Compiled, tree: MjcfTree, selection: Selection, notes: Notes) -> None:
    """Note what is merged, what is not on the arm, and what no robot file says."""
    starts = [selection.base, *(body for body in selection.bodies if body.joints)]
    for body in starts:
        merged = [tree.bodies[part].label for part in tree.rigid(body.id)[1:]]
        if merged and body.id != WORLD:
            notes.group(
                "Bodies that are fixed to a link of the arm were merged into it: {}.",
                body.name or body.label,
                f"with {listed(merged)}",
            )
    for body in selection.bodies:
        if len(body.joints) > 1:
            sentence = "Bodies with several joints were split; the links between have no mass: {}."
            notes.group(sentence, body.name or body.label, names_of(body.joints))
    _note_branches(compiled, tree, selection, [body.id for body in starts], notes)
    _note_elements(compiled, notes)


def _note_branches(
    compiled: Compiled, tree: MjcfTree, selection: Selection, starts: Sequence[int], notes: Notes
) -> None:
    base = selection.base.id
    below = set(tree.below(base))
    others = tuple(body.id for body in tree.bodies[1:] if body.id not in below)
    if others:
        what = weight_of(compiled, tree, others)
        notes.add(f"What is not below the base {selection.base.label} is left out: {what}.")
    arm = {body.id for body in selection.bodies}
    rigid = {part for start in starts for part in tree.rigid(start)}
    branches = [
        child
        for part in sorted(rigid)
        for child in tree.bodies[part].children
        if child not in arm and child not in rigid
    ]
    for child in branches[:_MOST_BRANCHES]:
        body = tree.bodies[child]
        by = f"with {names_of(body.joints)} " if body.joints else "as it is moved by others "
        notes.add(f"Left out {by}on {_on(tree, body.parent)}: {weight_of(compiled, tree, tree.below(child))}.")
    if len(branches) > _MOST_BRANCHES:
        notes.add(f"Left out with all that they carry: {len(branches) - _MOST_BRANCHES} more bodies that move.")


def _on(tree: MjcfTree, body: int) -> str:
    return "the world" if body == WORLD else tree.bodies[body].label


def _note_elements(compiled: Compiled, notes: Notes) -> None:
    """One sentence on what a model may hold besides bodies, joints and actuators."""
    model = compiled.model
    if compiled.keyframes:
        names = listed(shown(name) for name in compiled.keyframes if name) if any(compiled.keyframes) else ""
        notes.add(f"Keyframes are not carried over{names and f': {names}'}.")
    counts = {
        "camera": model.ncam,
        "light": model.nlight,
        "sensor": model.nsensor,
        "contact pair": model.npair,
        "contact exclusion": model.nexclude,
        "soft body": model.nflex,
    }
    told = [f"{count} {what if count == 1 else _plural(what)}" for what, count in counts.items() if count]
    if told:
        notes.add(f"Not carried over: {listed(told)}.")
    if model.opt.density or model.opt.viscosity or any(model.opt.wind.tolist()):
        notes.add("The medium around the robot (density, viscosity, wind) is not carried over.")


def _plural(word: str) -> str:
    return f"{word[:-1]}ies" if word.endswith("y") else f"{word}s"
