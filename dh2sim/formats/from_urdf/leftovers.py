"""What of a URDF has no place in a serial arm, told in a few sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

from dh2sim.formats.from_urdf.chain import Selection
from dh2sim.formats.from_urdf.parts import Body, weight_of
from dh2sim.formats.from_urdf.tree import UrdfJoint, UrdfTree
from dh2sim.formats.notes import Notes
from dh2sim.robot.words import listed, shown

_MOST_BRANCHES: Final = 20
"""Branches that are told one by one."""

_CARRIED: Final = {
    "robot": ("link", "joint", "material", "mujoco"),
    "link": ("inertial", "visual", "collision"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
}
"""Elements that are read or told of elsewhere. ``mujoco`` only tells MuJoCo how to read the file."""


def note_leftovers(tree: UrdfTree, selection: Selection, bodies: Sequence[Body], notes: Notes) -> None:
    """Note what is merged, what is not on the arm, and what no robot file says."""
    for body in bodies:
        merged = listed(shown(part.name) for part in body.parts[1:])
        if len(body.parts) > 1:
            notes.group(
                "Links that are fixed to a link of the arm were merged into it: {}.", body.name, f"with {merged}"
            )
    _note_branches(tree, selection, bodies, notes)
    if any(part.element.first("collision") for body in bodies for part in body.parts):
        notes.add("Collision shapes are not carried over.")
    _note_elements(tree, notes)


def _note_branches(tree: UrdfTree, selection: Selection, bodies: Sequence[Body], notes: Notes) -> None:
    if selection.base != tree.root:
        below = set(tree.descendants(selection.base))
        others = weight_of(tree, [name for name in tree.descendants(tree.root) if name not in below])
        notes.add(f"What is not below the base {shown(selection.base)} is left out: {others}.")
    branches = [(body, joint) for body in bodies for joint in body.branches]
    for _, joint in branches[:_MOST_BRANCHES]:
        what = weight_of(tree, tree.descendants(joint.child))
        notes.add(f"Left out with joint {shown(joint.name)} ({_kind(joint)}) on {shown(joint.parent)}: {what}.")
    if len(branches) > _MOST_BRANCHES:
        notes.add(f"Left out with {len(branches) - _MOST_BRANCHES} more joints: all that they carry.")


def _kind(joint: UrdfJoint) -> str:
    mimic = joint.element.first("mimic")
    return joint.type if mimic is None else f"{joint.type}, mimics {shown(mimic.attributes.get('joint', ''))}"


def _note_elements(tree: UrdfTree, notes: Notes) -> None:
    counts: Counter[str] = Counter()
    for owner in (tree.robot, *tree.robot.all("link"), *tree.robot.all("joint")):
        counts.update(element.tag for element in owner.children if element.tag not in _CARRIED[owner.tag])
    if loops := counts.pop("loop_joint", 0):
        notes.add(f"The file closes loops with {loops} <loop_joint>; the arm is read as if it were open.")
    if counts:
        names = (f"{count} <{tag[:60]}>" if count > 1 else f"<{tag[:60]}>" for tag, count in sorted(counts.items()))
        notes.add(f"Elements that a robot file has no place for are not carried over: {listed(names)}.")
