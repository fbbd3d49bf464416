"""Which bodies of an MJCF make up the arm: those from a base body to a body or a site, named or found."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from dh2sim.errors import ImportedFileError
from dh2sim.formats.arm import NoArmError, unknown_name
from dh2sim.formats.mjcf.includes import MjcfFiles
from dh2sim.formats.mjcf.tree import WORLD, MjcfBody, MjcfJoint, MjcfSite, MjcfTree, Motion
from dh2sim.messages import Notes, listed, shown

_FIRST_TIP: Final = "tool0"
_OTHER_TIPS: Final = ("attachment_site", "ee_site", "end_effector", "tcp")
"""Names of sites that are taken for the tip where there is exactly one of them, and no _FIRST_TIP."""


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
        tip: Name of a site or a body; a site wins. By default the site ``tool0``, else the only one of _OTHER_TIPS;
            else where the only way with joints ends, or the only site there.
        files: For messages.
        notes: Takes what was chosen that could have been chosen otherwise.

    Raises:
        ImportedFileError: No such base or tip, the tip is not below the base, nothing moves between them, or the
            robot forks.
    """
    sites = {site.name: site for body in tree.bodies for site in body.sites if site.name}
    bodies = {body.name: body for body in tree.bodies if body.name}
    _check_names(base, tip, sites, bodies, files)
    start = None if base is None else bodies[base]
    site = _known_site(tree, start, sites) if tip is None else sites.get(tip)
    try:
        if site is not None:
            end = tree.bodies[site.body]
        elif tip is not None:
            end = bodies[tip]
        else:
            start = _base_of_only_tree(tree, files) if start is None else start
            end, site = _found_end(tree, start, notes)
        start = _default_base(tree, end) if start is None else start
        called = shown(tip) if tip is not None else shown(site.name) if site is not None else ""
        way = tree.links.arm(start.id, end.id, called=called)
    except NoArmError as error:
        element = ("body", tree.bodies[error.node].name) if site is None else ("site", site.name)
        raise files.error(error.message, element=element) from None
    if any(joint.motion is Motion.FREE for joint in start.joints):
        notes.add(f"The base {start.label} floats on a free joint; the table starts at the base.")
    return Selection(base=start, bodies=tuple(tree.bodies[i] for i in way), site=site)


def _check_names(
    base: str | None,
    tip: str | None,
    sites: dict[str, MjcfSite],
    bodies: dict[str, MjcfBody],
    files: MjcfFiles,
) -> None:
    problems = []
    if base is not None and base not in bodies:
        problems.append(files.problem(unknown_name(base, "body", {"bodies": bodies}), path="base"))
    if tip is not None and tip not in sites and tip not in bodies:
        message = unknown_name(tip, "site or body", {"bodies": bodies, "sites": sites})
        problems.append(files.problem(message, path="tip"))
    if problems:
        raise ImportedFileError(problems)


def _known_site(tree: MjcfTree, base: MjcfBody | None, sites: dict[str, MjcfSite]) -> MjcfSite | None:
    """Return the site that is a tip by its name: one that joints move."""

    def moves(site: MjcfSite) -> bool:
        end = tree.bodies[site.body]
        start = _default_base(tree, end) if base is None else base
        return tree.links.moves(tree.links.way(start.id, end.id) or ())

    for names in ((_FIRST_TIP,), _OTHER_TIPS):
        found = [sites[name] for name in names if name in sites and moves(sites[name])]
        if len(found) == 1:
            return found[0]
    return None


def _default_base(tree: MjcfTree, tip: MjcfBody) -> MjcfBody:
    """Return the topmost body above the tip, where that has no joint or floats, else the world."""
    way = tree.links.way(WORLD, tip.id) or (WORLD,)
    top = tree.bodies[way[0]]
    return tree.bodies[WORLD] if tree.links.moving[top.id] else top


def _base_of_only_tree(tree: MjcfTree, files: MjcfFiles) -> MjcfBody:
    """Return the base of the only tree with joints below the world; bodies that just float do not count."""
    top = tree.links.only_branch(WORLD)
    if top is None:
        raise files.error("the file has no joint that moves: no hinge and no slide")
    return _default_base(tree, tree.bodies[top])


def _found_end(tree: MjcfTree, base: MjcfBody, notes: Notes) -> tuple[MjcfBody, MjcfSite | None]:
    """Return the body where the only way with joints ends, and the site on its last link, if there is just one."""
    found = tree.links.end(base.id, notes)
    last = tree.bodies[found]
    while last.id != WORLD and not tree.links.moving[last.id]:  # up to the last body that has a joint
        last = tree.bodies[last.parent]
    sites = [site for body in tree.rigid(last.id) for site in tree.bodies[body].sites]
    site = sites[0] if len(sites) == 1 else None
    end = tree.bodies[found if site is None else site.body]
    if site is not None:
        named = f"site {shown(site.name)}" if site.name else "site without a name"
        notes.add(f"The tip is the {named} on {end.label}, the only one on the last link.")
    elif sites:
        names = listed(shown(site.name) for site in sites if site.name)
        notes.add(
            f"The tip is the frame of body {end.label}; the last link has {len(sites)} sites, which can be chosen "
            f"instead: {names}."
        )
    return end, site


def names_of(joints: Iterable[MjcfJoint]) -> str:
    """Return the names of some joints for a message."""
    return listed(shown(joint.name) if joint.name else f"joint {joint.id} (without a name)" for joint in joints)
