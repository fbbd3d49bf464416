"""Ways down an MJCF's tree of bodies, by the number of joints on them."""

from __future__ import annotations

from typing import Final

from dh2sim.formats.from_mjcf.tree import WORLD, MjcfTree, Motion

LEAST_BEFORE_A_HAND: Final = 3
"""Joints of an arm that ends where it forks into fingers."""


class Walk:
    """The bodies of a tree with the number of joints below each; free joints do not count."""

    def __init__(self, tree: MjcfTree) -> None:
        """Count the joints of all bodies."""
        self._tree = tree
        self._own = [sum(joint.motion is not Motion.FREE for joint in body.joints) for body in tree.bodies]
        self._below = [0] * len(tree.bodies)
        for body in reversed(tree.bodies[1:]):
            self._below[body.parent] += self.size(body.id)

    def below(self, body: int) -> int:
        """Return the number of joints below a body."""
        return self._below[body]

    def size(self, body: int) -> int:
        """Return the number of joints of a branch: those of its first body and all below."""
        return self._own[body] + self._below[body]

    def branches(self, body: int) -> list[int]:
        """Return the bodies on a body that have joints, or carry others that do."""
        return [child for child in self._tree.bodies[body].children if self.size(child)]

    def follow(self, body: int, count: int) -> tuple[int, int]:
        """Go down while exactly one way has joints; ``count`` and the result count those passed."""
        while len(branches := self.branches(body)) == 1:
            body = branches[0]
            count += self._own[body]
        return body, count

    def is_hand(self, body: int, count: int) -> bool:
        """Whether an arm of ``count`` joints ends at a fork: every branch has fewer."""
        return count >= LEAST_BEFORE_A_HAND and all(self.size(child) < count for child in self.branches(body))

    def last_moving(self, body: int) -> int:
        """Return the body itself or the nearest above that has a joint; the world where there is none."""
        while body != WORLD and not self._own[body]:
            body = self._tree.bodies[body].parent
        return body

    def ends(self, body: int, count: int) -> list[tuple[int, int]]:
        """Return where the ways below a fork end, and their joints: at a hand, or where nothing moves any more."""
        found = []
        waiting = [(child, count + self._own[child]) for child in reversed(self.branches(body))]
        while waiting:
            end, number = self.follow(*waiting.pop())
            branches = self.branches(end)
            if branches and not self.is_hand(end, number):
                waiting += [(child, number + self._own[child]) for child in reversed(branches)]
            else:
                found.append((end, number))
        return found


def counted(joints: int) -> str:
    """Return a number of joints in words."""
    return "1 joint" if joints == 1 else f"{joints} joints"
