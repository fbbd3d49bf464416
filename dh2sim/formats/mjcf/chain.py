"""Which part of an MJCF's tree is the arm: from a base body to a body or a site, named or found.

Ways down an MJCF's tree of bodies, by the number of joints on them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from dh2sim.errors import ImportedFileError
from dh2sim.formats.mjcf.includes import MjcfFiles
from dh2sim.formats.mjcf.tree import WORLD, MjcfBody, MjcfJoint, MjcfSite, MjcfTree, Motion
from dh2sim.messages import Notes, did_you_mean, listed, shown

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


FIRST_TIP: Final = "tool0"
OTHER_TIPS: Final = ("attachment_site", "ee_site", "end_effector", "tcp")
"""Names of sites that are taken for the tip where there is exactly one of them, and no FIRST_TIP."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Selection:
    """The chosen part of the tree."""

    base: MjcfBody
    bodies: tuple[MjcfBody, ...]
    """From the base, without it, down to the body of the tip; at least one has a joint."""
    site: MjcfSite | None
    """The tip; None where it is the last body's frame."""

    @property
    def tip(self) -> MjcfBody:
        """The body of the tip."""
        return self.bodies[-1]

    @property
    def joints(self) -> tuple[MjcfJoint, ...]:
        """From base to tip, in the order in which they move it."""
        return tuple(joint for body in self.bodies for joint in body.joints)


def select_chain(tree: MjcfTree, base: str | None, tip: str | None, files: MjcfFiles, notes: Notes) -> Selection:
    """Choose the bodies that make up the arm.

    Args:
        tree: All bodies.
        base: Name of the base body, ``world`` among them. By default the topmost body above the arm, where that has
            no joint or floats; else the world.
        tip: Name of a site or a body; a site wins. By default the site ``tool0``, else the only one of OTHER_TIPS;
            else the way down is followed: see ``_followed``.
        files: For messages.
        notes: Takes what was chosen that could have been chosen otherwise.

    Raises:
        ImportedFileError: No such base or tip, the tip is not below the base, nothing moves between them, or the
            robot forks.
    """
    return _Chooser(tree, files, notes).selection(base, tip)


class _Chooser:
    def __init__(self, tree: MjcfTree, files: MjcfFiles, notes: Notes) -> None:
        self._tree = tree
        self._files = files
        self._notes = notes
        self._sites = {site.name: site for body in tree.bodies for site in body.sites if site.name}
        self._bodies = {body.name: body for body in tree.bodies if body.name}

    def selection(self, base: str | None, tip: str | None) -> Selection:
        self._check_names(base, tip)
        start = None if base is None else self._bodies[base]
        site = self._known_site(start) if tip is None else self._sites.get(tip)
        if site is not None:
            end = self._tree.bodies[site.body]
        elif tip is not None:
            end = self._bodies[tip]
        else:
            start = self._only_tree() if start is None else start
            end, site = self._followed(start)
        start = self._default_base(end) if start is None else start
        self._note_floating(start)
        return self._checked(start, end, site, "" if tip is None else shown(tip))

    def _check_names(self, base: str | None, tip: str | None) -> None:
        problems = []
        for option, name, known in (("base", base, self._bodies), ("tip", tip, {**self._sites, **self._bodies})):
            if name is None or name in known:
                continue
            sites = f"; its sites: {listed(map(shown, self._sites))}" if option == "tip" else ""
            what = "site or body" if option == "tip" else "body"
            problems.append(
                self._files.problem(
                    f"--{option}: the file has no {what} {shown(name)}.{did_you_mean(name, known)} "
                    f"Its bodies: {listed(map(shown, self._bodies))}{sites}"
                )
            )
        if problems:
            raise ImportedFileError(problems)

    def _known_site(self, base: MjcfBody | None) -> MjcfSite | None:
        """Return the site that is a tip by its name: one that joints move."""
        for names in ((FIRST_TIP,), OTHER_TIPS):
            found = [self._sites[name] for name in names if name in self._sites and self._moves(name, base)]
            if len(found) == 1:
                return found[0]
        return None

    def _moves(self, site: str, base: MjcfBody | None) -> bool:
        end = self._tree.bodies[self._sites[site].body]
        start = self._default_base(end) if base is None else base
        way = self._tree.way(start.id, end.id)
        return way is not None and bool(self._tree.joints_of(way))

    def _default_base(self, tip: MjcfBody) -> MjcfBody:
        way = self._tree.way(WORLD, tip.id) or (WORLD,)
        top = self._tree.bodies[way[0]]
        moves = any(joint.motion is not Motion.FREE for joint in top.joints)
        return self._tree.bodies[WORLD] if moves else top

    def _only_tree(self) -> MjcfBody:
        """Return the base of the only tree with joints below the world; bodies that just float do not count."""
        world = self._tree.bodies[WORLD]
        walk = Walk(self._tree)
        tops = [body for body in world.children if walk.size(body)]
        if not tops:
            raise self._files.error("the file has no joint that moves: no hinge and no slide")
        if len(tops) > 1:
            raise self._forks("the file holds several trees with joints", walk, WORLD, 0)
        return self._default_base(self._tree.bodies[tops[0]])

    def _followed(self, base: MjcfBody) -> tuple[MjcfBody, MjcfSite | None]:
        """Go down from the base while there is one way that moves.

        The arm ends where nothing more moves, or at a hand: a fork behind three joints or more, into branches of
        fewer joints. The tip is the one site on its last link, if there is exactly one.
        """
        walk = Walk(self._tree)
        if not walk.below(base.id):
            raise self._files.error(f"no joint moves below the base {base.label}", element=("body", base.name))
        last, count = walk.follow(base.id, 0)
        branches = walk.branches(last)
        end = self._tree.bodies[last]
        if branches and not walk.is_hand(last, count):
            raise self._forks(f"the robot forks at {_called(end)}", walk, last, count)
        sites = [site for body in self._tree.rigid(walk.last_moving(last)) for site in self._tree.bodies[body].sites]
        site = sites[0] if len(sites) == 1 else None
        self._note_end(end if site is None else self._tree.bodies[site.body], site, sites)
        if branches:
            fingers = listed(f"{self._tree.bodies[child].label} ({counted(walk.size(child))})" for child in branches)
            self._notes.add(
                f"The arm of {counted(count)} ends at {end.label}, where it forks; taken for a hand and left out: "
                f"{fingers}. Name another tip with --tip."
            )
        return (end if site is None else self._tree.bodies[site.body]), site

    def _note_end(self, end: MjcfBody, site: MjcfSite | None, sites: list[MjcfSite]) -> None:
        if site is not None:
            named = f"site {shown(site.name)}" if site.name else "site without a name"
            self._notes.add(f"The tip is the {named} on {end.label}, the only one on the last link.")
        elif sites:
            names = listed(shown(site.name) for site in sites if site.name)
            self._notes.add(
                f"The tip is the frame of body {end.label}; the last link has {len(sites)} sites: {names}. "
                "Name one with --tip to have it instead."
            )

    def _forks(self, what: str, walk: Walk, body: int, count: int) -> ImportedFileError:
        choices = listed(
            f"{self._tree.bodies[end].label} ({counted(number)})" for end, number in walk.ends(body, count)
        )
        message = f"{what}: choose an arm with --tip. Possible tips: {choices}"
        return self._files.error(message, element=("body", self._tree.bodies[body].name))

    def _note_floating(self, base: MjcfBody) -> None:
        if any(joint.motion is Motion.FREE for joint in base.joints):
            self._notes.add(f"The base {base.label} floats on a free joint; the table starts at the base.")

    def _checked(self, base: MjcfBody, tip: MjcfBody, site: MjcfSite | None, given: str) -> Selection:
        name = given or (shown(site.name) if site is not None else tip.label)
        place = ("body", tip.name) if site is None else ("site", site.name)
        way = self._tree.way(base.id, tip.id)
        if way is None:
            turned = self._tree.way(tip.id, base.id) is not None
            hint = f"; {base.label} is below {name}: exchange base and tip" if turned else ""
            raise self._files.error(f"the tip {name} is not below the base {base.label}{hint}", element=place)
        if not self._tree.joints_of(way):
            raise self._files.error(f"no joint moves between the base {base.label} and the tip {name}", element=place)
        return Selection(base=base, bodies=tuple(self._tree.bodies[i] for i in way), site=site)


def _called(body: MjcfBody) -> str:
    return "the world" if body.id == WORLD else f"body {body.label}" if body.name else body.label


def names_of(joints: Iterable[MjcfJoint]) -> str:
    """Return the names of some joints for a message."""
    return listed(shown(joint.name) if joint.name else f"joint {joint.id} (without a name)" for joint in joints)
