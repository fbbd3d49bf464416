"""Which joints of a URDF make up the arm: those from a base link to a tip link, named or found."""

from __future__ import annotations

from dataclasses import dataclass

from dh2sim.formats.arm import NoArmError, unknown_name
from dh2sim.formats.urdf.tree import UrdfJoint, UrdfTree
from dh2sim.formats.xml_read import XmlReport
from dh2sim.messages import Notes, listed, shown


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Selection:
    """The chosen part of the tree."""

    base: str
    tip: str
    joints: tuple[UrdfJoint, ...]
    """From the base to the tip, fixed ones too; at least one moves."""


def select_chain(tree: UrdfTree, base: str | None, tip: str | None, report: XmlReport, notes: Notes) -> Selection:
    """Choose the joints that make up the arm.

    Args:
        tree: The file's links and joints.
        base: Name of the base link; None for the root.
        tip: Name of the tip link; None to find it: ``tool0``, or else where the only way that moves ends.
        report: Takes the problems.
        notes: Takes what was chosen that could have been chosen otherwise.

    Raises:
        ImportedFileError: No such link, the tip is not below the base, nothing moves between them, or the arm forks.
    """
    for argument, name in (("base", base), ("tip", tip)):
        if name is not None and name not in tree.elements:
            report.add(tree.robot, argument, unknown_name(name, "link", {"links": tree.elements}))
    report.check()
    start = tree.links.root if base is None else base
    try:
        end = _found_tip(tree, start, notes) if tip is None else tip
        arm = tree.links.arm(start, end)
    except NoArmError as error:
        raise report.failure(tree.elements[error.node], "", error.message) from None
    return Selection(base=start, tip=end, joints=tuple(tree.above[link] for link in arm))


def _found_tip(tree: UrdfTree, base: str, notes: Notes) -> str:
    if (tool := _tool0(tree, base)) is not None:
        return tool
    end = tree.links.end(base, notes)
    frames = tree.links.children[end]
    if frames and not tree.links.moves(tree.links.below(end)[1:]):
        several = f"{len(frames)} frames are fixed to it and can be chosen instead: {listed(map(shown, frames))}"
        notes.add(f"The tip is {shown(end)}; {several}.")
    return end


def _tool0(tree: UrdfTree, base: str) -> str | None:
    """Return the one link called ``tool0``, or ``..._tool0`` as in robots of several arms, that something moves."""
    tools = [name for name in tree.links.below(base) if name == "tool0" or name.endswith("_tool0")]
    chosen = ["tool0"] if "tool0" in tools else tools
    if len(chosen) != 1 or not tree.links.moves(tree.links.way(base, chosen[0]) or ()):
        return None
    return chosen[0]
