"""Which part of a tree of links is the arm: from a base to a tip, named or found; the same for URDF and MJCF.

A robot may have several arms, hands and heads. The table is made of one way down the tree; what branches off is left
out, and reported with its mass.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

from dh2sim.messages import Notes, did_you_mean, listed, shown
from dh2sim.robot.magnitudes import MOST_ROWS

_LEAST_BEFORE_A_HAND: Final = 3
"""Moving joints of an arm that may end where it forks into fingers."""
_MOST_BRANCHES: Final = 20
"""Branches that are reported one by one."""

Node = TypeVar("Node", bound=Hashable)


class NoArmError(Exception):
    """There is no arm where one was looked for; the readers turn it into an error with a place."""

    def __init__(self, message: str, node: Any) -> None:
        """Keep the message, and the link that it is about."""
        super().__init__(message)
        self.message, self.node = message, node


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkTree(Generic[Node]):
    """The links of a robot, each on its parent, with the number of joints that move them."""

    root: Node
    noun: str
    """How the format calls a link: ``link`` or ``body``."""
    names: Mapping[Node, str]
    """Of every link, in the order of the file; empty for one without a name."""
    parents: Mapping[Node, Node]
    """Of every link but the root."""
    children: Mapping[Node, Sequence[Node]]
    """Of every link, in the order of the file."""
    moving: Mapping[Node, int]
    """Number of joints that move a link on its parent; those of a link that floats freely do not count."""
    floating: frozenset[Node] = frozenset()
    """Links that float freely."""
    ends_at_frame: bool = False
    """Whether an arm goes on to a frame that is the only link fixed to its last one."""

    def label(self, node: Node) -> str:
        """Return how messages call a link."""
        return shown(self.names[node]) if self.names[node] else f"{self.noun} {node} (without a name)"

    def way(self, base: Node, tip: Node) -> tuple[Node, ...] | None:
        """Return the links from a base, without it, down to a tip, or None where there is no way down."""
        way: list[Node] = []
        node = tip
        while node != base:
            if node not in self.parents:
                return None
            way.append(node)
            node = self.parents[node]
        return tuple(reversed(way))

    def below(self, node: Node) -> tuple[Node, ...]:
        """Return a link and all links below it, each after its parent, branch by branch."""
        found, waiting = [], [node]
        while waiting:
            found.append(waiting.pop())
            waiting += reversed(self.children[found[-1]])
        return tuple(found)

    def not_below(self, node: Node) -> tuple[Node, ...]:
        """Return all links but a link and those below it, each after its parent."""
        below = set(self.below(node))
        return tuple(other for other in self.below(self.root) if other not in below)

    def moves(self, way: Iterable[Node]) -> bool:
        """Whether a joint moves one of some links on its parent."""
        return any(self.moving[node] or node in self.floating for node in way)

    def arm(self, base: Node, tip: Node, *, called: str = "") -> tuple[Node, ...]:
        """Return the links from a base, without it, down to a tip.

        Args:
            base: Where the arm begins.
            tip: Where it ends.
            called: How messages call the tip, where it is a frame on the link.

        Raises:
            NoArmError: The tip is not below the base, or no joint moves between them, or more than a table can have.
        """
        called = called or self.label(tip)
        way = self.way(base, tip)
        if way is None:
            hint = f"; {self.label(base)} is below {called}: exchange base and tip" if self.way(tip, base) else ""
            raise NoArmError(f"the tip {called} is not below the base {self.label(base)}{hint}", tip)
        if not self.moves(way):
            raise NoArmError(f"no joint moves between the base {self.label(base)} and the tip {called}", tip)
        if (count := sum(self.moving[node] for node in way)) > MOST_ROWS:
            raise NoArmError(f"the arm has {count} joints; at most {MOST_ROWS} are read", tip)
        return way

    def end(self, base: Node, notes: Notes) -> Node:
        """Follow the only way down that moves, to where nothing moves any more or the arm ends at a hand.

        A hand is a fork behind three joints or more, into branches of fewer joints than the arm has.

        Args:
            base: Where the arm begins.
            notes: Takes what was taken for a hand.

        Raises:
            NoArmError: Nothing moves below the base, or the robot forks.
        """
        walk = _Walk(self)
        if not walk.branches(base):
            raise NoArmError(f"no joint moves below the base {self.label(base)}", base)
        end, count = walk.follow(base, 0)
        branches = walk.branches(end)
        if branches and not walk.is_hand(end, count):
            raise walk.fork(f"the robot forks at {self.label(end)}", end, count)
        if branches:
            fingers = listed(f"{self.label(branch)} ({_joints(walk.size[branch])})" for branch in branches)
            notes.add(
                f"The arm of {_joints(count)} ends at {self.label(end)}, where it forks; taken for a hand and left "
                f"out: {fingers}. Another tip can be chosen."
            )
        return end

    def only_branch(self, node: Node) -> Node | None:
        """Return the only child that moves or carries what moves; None where there is none.

        Raises:
            NoArmError: There are several.
        """
        walk = _Walk(self)
        branches = walk.branches(node)
        if len(branches) > 1:
            raise walk.fork("the file has several trees with joints", node, 0)
        return branches[0] if branches else None

    def weighed(self, nodes: Sequence[Node], mass: float | None) -> str:
        """Return words for some links and their mass in kg, such as ``link 'finger' (0.1 kg)``; None is unknown."""
        label = self.label(nodes[0])
        if len(nodes) > 1:
            what = f"{len(nodes)} {'bodies' if self.noun == 'body' else f'{self.noun}s'} from {label} on"
        else:
            what = f"{self.noun} {label}" if self.names[nodes[0]] else label
        if mass is None:
            return f"{what} (mass unknown)"
        return f"{what} ({mass:.6g} kg)" if mass > 0.0 else what


class _Walk(Generic[Node]):
    """Ways down a tree, with the number of moving joints of each branch."""

    def __init__(self, tree: LinkTree[Node]) -> None:
        self._tree = tree
        self.size: dict[Node, int] = {}
        for node in reversed(tree.below(tree.root)):
            self.size[node] = tree.moving[node] + sum(self.size[child] for child in tree.children[node])

    def branches(self, node: Node) -> list[Node]:
        """Return the links on a link that move or carry others that do."""
        return [child for child in self._tree.children[node] if self.size[child]]

    def follow(self, node: Node, count: int) -> tuple[Node, int]:
        """Go down while exactly one way moves; ``count`` and the result count the joints passed."""
        while True:
            ways: Sequence[Node] = self.branches(node)
            if not ways and self._tree.ends_at_frame:
                ways = self._tree.children[node]
            if len(ways) != 1:
                return node, count
            node = ways[0]
            count += self._tree.moving[node]

    def is_hand(self, node: Node, count: int) -> bool:
        """Whether an arm of ``count`` joints ends at a fork: every branch has fewer."""
        return count >= _LEAST_BEFORE_A_HAND and all(self.size[branch] < count for branch in self.branches(node))

    def fork(self, what: str, node: Node, count: int) -> NoArmError:
        """Return the error of a fork, with the tips that may have been meant."""
        tree = self._tree
        tips = (
            f"{'tip=' if tree.names[end] else ''}{tree.label(end)} ({_joints(joints)})"
            for end, joints in self._ends(node, count)
        )
        return NoArmError(f"{what}; choose one arm: {listed(tips)}", node)

    def _ends(self, node: Node, count: int) -> list[tuple[Node, int]]:
        """Return where the ways below a fork end, and their joints: at a hand, or where nothing moves any more."""
        moving = self._tree.moving
        found = []
        waiting = [(branch, count + moving[branch]) for branch in reversed(self.branches(node))]
        while waiting:
            end, joints = self.follow(*waiting.pop())
            branches = self.branches(end)
            if branches and not self.is_hand(end, joints):
                waiting += [(branch, joints + moving[branch]) for branch in reversed(branches)]
            else:
                found.append((end, joints))
        return found


def _joints(count: int) -> str:
    return "1 joint" if count == 1 else f"{count} joints"


def unknown_name(name: str, what: str, known: Mapping[str, Iterable[str]]) -> str:
    """Return the message on a base or a tip that the file does not have.

    Args:
        name: As it was given.
        what: What was looked for, such as ``link``.
        known: What the file has, by kind, such as ``links``.
    """
    kinds = {kind: list(names) for kind, names in known.items()}
    guess = did_you_mean(name, [name for names in reversed(kinds.values()) for name in names])
    known_names = "; its ".join(f"{kind}: {listed(map(shown, names))}" for kind, names in kinds.items())
    return f"the file has no {what} {shown(name)}.{guess} Its {known_names}"


def note_left_out(notes: Notes, branches: Sequence[Callable[[], str]]) -> None:
    """Note the branches that are left out; of very many the first.

    Args:
        notes: Takes the sentences.
        branches: For each a function that describes it, such as ``with joint 'a' on 'hand': link 'finger'``.
    """
    for describe in branches[:_MOST_BRANCHES]:
        notes.add(f"Left out {describe()}.")
    if len(branches) > _MOST_BRANCHES:
        notes.add(f"Left out: {len(branches) - _MOST_BRANCHES} more branches.")


def note_gravity(notes: Notes, gravity: Sequence[float], base: str, root: str) -> None:
    """Note a gravity, m/s², of a base that is turned; base and root are labels."""
    words = ", ".join(f"{value:.6g}" for value in gravity)
    notes.add(f"Gravity is ({words}) m/s² in the base {base}, which is turned in {root}.")


def described(kind: str, file: str, base: str, tip: str) -> str:
    """Return what a robot file says of its origin, such as ``URDF panda.urdf, from panda_link0 to panda_link8``."""
    return f"{kind} {Path(file).name}, from {_plain(base)} to {_plain(tip)}"


def _plain(name: str) -> str:
    """Return a name as it is, if that is fit for a line of text."""
    return name if name.isprintable() and len(name) <= 60 else shown(name)
