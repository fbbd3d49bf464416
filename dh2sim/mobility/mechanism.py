"""A mechanism: links, the joints between them, and the loops that these close."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.mobility.screws import algebra, sliding, turning
from dh2sim.typing import Array, read_only


class PairType(StrEnum):
    """A kinematic pair: what one link may do against the next."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    CYLINDRICAL = "cylindrical"
    UNIVERSAL = "universal"
    SPHERICAL = "spherical"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pair:
    """A joint of a mechanism, as it is at the assembly."""

    name: str
    type: PairType
    links: tuple[int, int]
    """The second moves against the first."""
    screws: Array = field(repr=False)
    """One for each freedom, in the ground's frame, lengths in m, shape (freedoms, 6)."""
    point: Array = field(repr=False)
    """A point of the axis, or the centre, m, shape (3,)."""

    @property
    def freedoms(self) -> int:
        """Return the number of its freedoms."""
        return len(self.screws)


def pair(
    name: str,
    type: PairType | str,  # noqa: A002
    links: tuple[int, int],
    point: ArrayLike,
    *axes: ArrayLike,
) -> Pair:
    """Return a joint, given by a point and its axes at the assembly.

    Args:
        name: Of the joint.
        type: What it allows.
        links: Indices of the two links.
        point: On the axis, m, shape (3,).
        axes: One direction, shape (3,); two for a universal joint, that on the first link first; none for a
            spherical one.
    """
    kind = PairType(type)
    where = read_only(point)
    match kind:
        case PairType.REVOLUTE:
            screws = [turning(where, axes[0])]
        case PairType.PRISMATIC:
            screws = [sliding(axes[0])]
        case PairType.CYLINDRICAL:
            screws = [turning(where, axes[0]), sliding(axes[0])]
        case PairType.UNIVERSAL:
            screws = [turning(where, axis) for axis in axes]
        case PairType.SPHERICAL:
            screws = [turning(where, axis) for axis in np.eye(3)]
    return Pair(name=name, type=kind, links=links, screws=read_only(screws), point=where)


@dataclass(frozen=True, kw_only=True, eq=False)
class Mechanism:
    """Links that joints connect, the ground first, as they are at the assembly.

    Raises:
        ValueError: A link is not connected with the ground.
    """

    name: str
    links: tuple[str, ...]
    joints: tuple[Pair, ...]
    actuated: tuple[str, ...] | None = None
    """Names of the joints that are driven; None where that is not said."""
    limb_names: Mapping[frozenset[int], str] = field(default_factory=dict, repr=False)
    """What some sets of links are called together."""

    def __post_init__(self) -> None:
        """Check that it is in one piece."""
        alone = [name for name, path in zip(self.links, self.tree.paths, strict=True) if path is None]
        if alone:
            raise ValueError(f"no joint connects {alone[0]} with {self.links[0]}")

    @cached_property
    def tree(self) -> SpanningTree:
        """The joints by which each link is first reached from the ground, and the ones that close loops."""
        return _spanning_tree(len(self.links), [joint.links for joint in self.joints])

    @cached_property
    def owners(self) -> tuple[int, ...]:
        """The joint of every freedom."""
        return tuple(k for k, joint in enumerate(self.joints) for _ in range(joint.freedoms))

    @property
    def freedoms(self) -> int:
        """Return the sum of the freedoms of all joints."""
        return len(self.owners)

    @cached_property
    def size(self) -> float:
        """The largest distance of a joint from the middle of all, m; 1 where they are all in one place."""
        if not self.joints:
            return 1.0
        points = np.array([joint.point for joint in self.joints])
        distances = np.linalg.norm(points - self._middle, axis=1)
        return float(distances.max()) if distances.max() > 1e-9 * max(1.0, float(np.abs(points).max())) else 1.0

    @cached_property
    def _middle(self) -> Array:
        return np.asarray(np.mean([joint.point for joint in self.joints], axis=0))

    @cached_property
    def screws(self) -> Array:
        """The screw of every freedom, seen from the middle of the joints, lengths in ``size``, shape (freedoms, 6).

        A unit of a slide is one ``size`` then; where a mechanism is, and how large, changes no number.
        """
        if not self.joints:
            return read_only(np.zeros((0, 6)))
        screws = np.vstack([joint.screws for joint in self.joints])
        turns, slides = screws[:, :3], screws[:, 3:]
        about_middle = (slides - np.cross(self._middle, turns)) / np.where(turns.any(1), self.size, 1.0)[:, None]
        return read_only(np.concatenate([turns, about_middle], axis=1))

    def together(self, links: Iterable[int]) -> str:
        """Return what links are called together."""
        which = tuple(links)
        return self.limb_names.get(frozenset(which)) or " with ".join(self.links[i] for i in which)

    def screws_of(self, joints: Iterable[int]) -> Array:
        """Return the rows of ``screws`` of some joints, shape (their freedoms, 6)."""
        return np.asarray(self.screws[self.freedoms_of(joints)])

    def freedoms_of(self, joints: Iterable[int]) -> list[int]:
        """Return the indices of the freedoms of some joints."""
        wanted = set(joints)
        return [i for i, owner in enumerate(self.owners) if owner in wanted]

    @cached_property
    def loops(self) -> tuple[Loop, ...]:
        """As many independent loops as there are, short and simple ones first."""
        return _independent_loops(self)

    def without(self, links: Iterable[int], joints: Iterable[int]) -> Mechanism | None:
        """Return the mechanism without some links and joints, None where that leaves something unconnected."""
        gone, cut = set(links), set(joints)
        kept = [i for i in range(len(self.links)) if i not in gone]
        new = {old: index for index, old in enumerate(kept)}
        joined = [joint for k, joint in enumerate(self.joints) if k not in cut and not gone & set(joint.links)]
        moved = [
            Pair(
                name=joint.name,
                type=joint.type,
                links=(new[joint.links[0]], new[joint.links[1]]),
                screws=joint.screws,
                point=joint.point,
            )
            for joint in joined
        ]
        if None in _spanning_tree(len(kept), [joint.links for joint in moved]).paths:
            return None
        return Mechanism(name=self.name, links=tuple(self.links[i] for i in kept), joints=tuple(moved))


@dataclass(frozen=True, slots=True, kw_only=True)
class SpanningTree:
    """How links are reached from the first one."""

    order: tuple[tuple[int, int], ...]
    """Joints with their direction, +1 or -1, each after those that lead to it."""
    paths: tuple[tuple[tuple[int, int], ...] | None, ...]
    """Of each link, the joints on the way from the ground with their directions; None where there is no way."""
    chords: tuple[int, ...]
    """The joints that are not in the tree: each closes a loop."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop:
    """A closed way round a mechanism."""

    joints: tuple[int, ...]
    """In the order of the way."""
    basis: Array = field(repr=False)
    """Of the algebra of its screws, shape (lambda, 6)."""

    @property
    def dimension(self) -> int:
        """Return lambda: how many constraints closing the loop is."""
        return len(self.basis)


def _spanning_tree(count: int, edges: Sequence[tuple[int, int]], root: int = 0) -> SpanningTree:
    """Return the tree of shortest ways from a link; among equals, joints that come first are taken."""
    paths: list[tuple[tuple[int, int], ...] | None] = [None] * count
    paths[root] = ()
    touching: list[list[int]] = [[] for _ in range(count)]
    for k, (a, b) in enumerate(edges):
        touching[a].append(k)
        touching[b].append(k)
    order: list[tuple[int, int]] = []
    queue = deque([root])
    while queue:
        here = queue.popleft()
        way = paths[here]
        assert way is not None
        for k in touching[here]:
            a, b = edges[k]
            there, direction = (b, 1) if a == here else (a, -1)
            if paths[there] is None:
                paths[there] = (*way, (k, direction))
                order.append((k, direction))
                queue.append(there)
    used = {k for k, _ in order}
    chords = tuple(k for k in range(len(edges)) if k not in used)
    return SpanningTree(order=tuple(order), paths=tuple(paths), chords=chords)


_MOST_ROOTS: Final = 60
"""Links from which short loops are looked for; more are not needed for what is drawn by hand."""


def _independent_loops(mechanism: Mechanism) -> tuple[Loop, ...]:
    """Return a shortest basis of loops (Horton 1987), those whose algebra is smaller first among equals."""
    edges = [joint.links for joint in mechanism.joints]
    wanted = len(edges) - len(mechanism.links) + 1
    if not wanted:
        return ()
    found: dict[frozenset[int], tuple[int, ...]] = {}
    for root in range(min(len(mechanism.links), _MOST_ROOTS)):
        tree = _spanning_tree(len(mechanism.links), edges, root)
        for chord in tree.chords:
            there, back = (tree.paths[link] or () for link in edges[chord])
            way = (*(k for k, _ in there), chord, *(k for k, _ in reversed(back)))
            if len(set(way)) == len(way):
                found.setdefault(frozenset(way), way)
    by_length = sorted(found.values(), key=len)
    candidates = [Loop(joints=way, basis=algebra(mechanism.screws_of(way))) for way in by_length]
    candidates.sort(key=lambda loop: (len(loop.joints), loop.dimension))
    chosen: list[Loop] = []
    reduced: dict[int, int] = {}  # echelon form over GF(2), by leading bit
    for loop in candidates:
        bits = sum(1 << k for k in loop.joints)
        while bits and (lead := bits.bit_length()) in reduced:
            bits ^= reduced[lead]
        if bits:
            reduced[bits.bit_length()] = bits
            chosen.append(loop)
            if len(chosen) == wanted:
                break
    return tuple(chosen)
