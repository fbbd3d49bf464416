"""Which part of a URDF's tree is the arm: the joints from a base to a tip, named or found."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from dh2sim.formats.urdf.tree import UrdfJoint, UrdfTree
from dh2sim.formats.xml_read import XmlReport
from dh2sim.messages import Notes, listed, shown

_LEAST_BEFORE_A_HAND = 3
"""Moving joints of an arm that ends where it forks into fingers."""


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
    for option, name in (("--base", base), ("--tip", tip)):
        if name is not None and name not in tree.links:
            guess = report.guess(name, tree.links)
            known = listed(map(shown, tree.links))
            report.add(tree.robot, "", f"{option}: the file has no link {shown(name)}.{guess} Its links: {known}")
    report.check()
    start = tree.root if base is None else base
    if tip is None:
        tip = _found_tip(tree, start, report, notes)
    joints = _way(tree, start, tip)
    if joints is None:
        turned = _way(tree, tip, start) is not None
        hint = f"; {shown(start)} is below {shown(tip)}: exchange base and tip" if turned else ""
        raise report.failure(tree.links[tip], "", f"the tip {shown(tip)} is not below the base {shown(start)}{hint}")
    if not any(joint.moves for joint in joints):
        raise report.failure(
            tree.links[tip], "", f"no joint moves between the base {shown(start)} and the tip {shown(tip)}"
        )
    return Selection(base=start, tip=tip, joints=tuple(joints))


def _way(tree: UrdfTree, base: str, tip: str) -> list[UrdfJoint] | None:
    """Return the joints from the base to the tip, or None where there is no way down."""
    joints = []
    link = tip
    while link != base:
        if link not in tree.above:
            return None
        joints.append(tree.above[link])
        link = joints[-1].parent
    return joints[::-1]


def _found_tip(tree: UrdfTree, base: str, report: XmlReport, notes: Notes) -> str:
    below = tree.descendants(base)
    moving = _moving_below(tree, below)
    if moving[base] == 0:
        raise report.failure(tree.links[base], "", f"no joint moves below the base {shown(base)}")
    if (tool := _tool0(tree, base, below)) is not None:
        return tool
    walk = _Walk(tree, moving)
    link, count = walk.follow(base, 0)
    branches = walk.moving_branches(link)
    if branches and not walk.is_hand(link, count):
        choices = listed(f"{shown(name)} ({_joints(number)})" for name, number in walk.ends(link, count))
        message = f"the robot forks at link {shown(link)}: choose an arm with --tip. Possible tips: {choices}"
        raise report.failure(tree.links[link], "", message)
    if branches:
        fingers = listed(f"{shown(joint.child)} ({_joints(walk.size(joint))})" for joint in branches)
        notes.add(
            f"The arm of {_joints(count)} ends at {shown(link)}, where it forks; taken for a hand and left out: "
            f"{fingers}. Name another tip with --tip."
        )
    elif frames := [joint.child for joint in tree.below[link]]:
        several = f"{len(frames)} frames are fixed to it: {listed(map(shown, frames))}"
        notes.add(f"The tip is {shown(link)}; {several}. Name one with --tip to have it instead.")
    return link


def _tool0(tree: UrdfTree, base: str, below: Iterable[str]) -> str | None:
    """Return the one link called ``tool0``, or ``..._tool0`` as in robots of several arms, that something moves."""
    tools = [name for name in below if name == "tool0" or name.endswith("_tool0")]
    chosen = ["tool0"] if "tool0" in tools else tools
    if len(chosen) != 1 or not any(joint.moves for joint in _way(tree, base, chosen[0]) or ()):
        return None
    return chosen[0]


def _moving_below(tree: UrdfTree, links: list[str]) -> dict[str, int]:
    """Count the moving joints below each link; ``links`` has every link after the one that it is on."""
    counts: dict[str, int] = {}
    for link in reversed(links):
        counts[link] = sum(counts[joint.child] + joint.moves for joint in tree.below[link])
    return counts


@dataclass(frozen=True, slots=True, eq=False)
class _Walk:
    """Ways down a tree, with the number of moving joints below each link."""

    tree: UrdfTree
    moving: dict[str, int]

    def moving_branches(self, link: str) -> list[UrdfJoint]:
        """The joints on a link that move or carry others that do."""
        return [joint for joint in self.tree.below[link] if joint.moves or self.moving[joint.child]]

    def follow(self, link: str, count: int) -> tuple[str, int]:
        """Go down while there is one way: the only one that moves, or behind the last moving joint the only one."""
        while True:
            branches = self.moving_branches(link)
            ways = branches or self.tree.below[link]
            if len(ways) != 1:
                return link, count
            link = ways[0].child
            count += ways[0].moves

    def is_hand(self, link: str, count: int) -> bool:
        """Whether an arm of ``count`` moving joints ends at a fork: every branch has fewer."""
        branches = self.moving_branches(link)
        return count >= _LEAST_BEFORE_A_HAND and all(self.size(joint) < count for joint in branches)

    def ends(self, link: str, count: int) -> list[tuple[str, int]]:
        """Where the ways below a fork end: at a hand, or where nothing moves any more; with their moving joints."""
        found = []
        waiting = [(joint.child, count + joint.moves) for joint in reversed(self.moving_branches(link))]
        while waiting:
            end, number = self.follow(*waiting.pop())
            branches = self.moving_branches(end)
            if branches and not self.is_hand(end, number):
                waiting += [(joint.child, number + joint.moves) for joint in reversed(branches)]
            else:
                found.append((end, number))
        return found

    def size(self, joint: UrdfJoint) -> int:
        """Number of moving joints of a branch."""
        return self.moving[joint.child] + joint.moves


def _joints(count: int) -> str:
    return "1 joint" if count == 1 else f"{count} joints"
