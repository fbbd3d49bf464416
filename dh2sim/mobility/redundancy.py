"""Which constraints a mechanism has twice, and which of its freedoms move nothing but a rod about itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from dh2sim.mobility.constraints import LoopEquations, Rank, rank_of
from dh2sim.mobility.mechanism import Mechanism
from dh2sim.mobility.screws import algebra, common_motions, row_space
from dh2sim.mobility.walk import walk
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Limb:
    """Links one after the other, each with two joints, between two links with more, or the ground."""

    links: tuple[int, ...]
    joints: tuple[int, ...]
    """One more than there are links."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class IdleFreedom:
    """A motion of some links of a limb in which everything else stands still."""

    links: tuple[int, ...]
    joints: tuple[int, int]
    motion: Array = field(repr=False)
    """Velocities of all freedoms, shape (freedoms,)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RedundantJoint:
    """A joint some of whose constraints follow from all the others."""

    joint: int
    constraints: int
    """lambda of its loop less its freedoms."""
    redundant: int


def limbs(mechanism: Mechanism) -> tuple[Limb, ...]:
    """Return the limbs of a mechanism that have a link of their own."""
    touching: list[list[int]] = [[] for _ in mechanism.links]
    for k, joint in enumerate(mechanism.joints):
        for link in joint.links:
            touching[link].append(k)
    inner = {link for link, joints in enumerate(touching) if link and len(joints) == 2}
    found: dict[frozenset[int], Limb] = {}
    for start in sorted(inner):
        if any(start in known for known in found):
            continue
        halves = [list(_along(mechanism, touching, inner, start, k)) for k in touching[start]]
        before, after = halves
        links = [link for link, _ in reversed(before) if link != start] + [start]
        links += [link for link, _ in after if link != start]
        joints = [k for _, k in reversed(before)] + [k for _, k in after]
        if len(set(links)) == len(links) and joints[0] != joints[-1]:
            found[frozenset(links)] = Limb(links=tuple(links), joints=tuple(joints))
    return tuple(found.values())


def _along(
    mechanism: Mechanism, touching: list[list[int]], inner: set[int], link: int, joint: int
) -> Iterator[tuple[int, int]]:
    """Yield links and the joints by which they are left, from a link in the direction of one of its joints."""
    start = link
    while True:
        yield link, joint
        a, b = mechanism.joints[joint].links
        link = b if link == a else a
        if link not in inner or link == start:
            return
        joint = next(k for k in touching[link] if k != joint)


def idle_freedoms(mechanism: Mechanism) -> tuple[IdleFreedom, ...]:
    """Return the freedoms that move only links within a limb, as a rod between two ball joints spins about itself.

    Two joints of a limb must allow the same motion; revolute joints one after the other whose axes meet count as one,
    as robot files have ball joints in rows. Where both are on the ground, all that moves would move with it, which is
    not idle.
    """
    found: list[IdleFreedom] = []
    in_loops = {k for loop in mechanism.loops for k in loop.joints}
    for limb in limbs(mechanism):
        if not in_loops.issuperset(limb.joints):
            continue
        for first, second in _pairs_of_joints(mechanism, limb):
            ends = [set(mechanism.joints[limb.joints[k]].links) for k in (first.start, second.stop - 1)]
            if all(0 in end for end in ends):
                continue
            sides = [mechanism.freedoms_of(limb.joints[side]) for side in (first, second)]
            a, b = (mechanism.screws[side] for side in sides)
            for screw in common_motions(a, b):
                motion = np.zeros(mechanism.freedoms)
                for side, screws in zip(sides, (a, b), strict=True):
                    motion[side] = np.linalg.lstsq(screws.T, screw, rcond=None)[0]
                if len(row_space(np.array([*(idle.motion for idle in found), motion]))) > len(found):
                    links = limb.links[first.stop - 1 : second.start]
                    ends_at = (limb.joints[first.stop - 1], limb.joints[second.start])
                    found.append(IdleFreedom(links=links, joints=ends_at, motion=motion))
    return tuple(found)


def _pairs_of_joints(mechanism: Mechanism, limb: Limb) -> list[tuple[slice, slice]]:
    """Return pairs of joints of a limb, or of two or three that make a ball joint one after the other; small first.

    Pairs that are one ball joint together are left out: what they share is the motion of a spherical linkage.
    """
    count = len(limb.joints)
    ranges = [slice(i, i + size) for size in (1, 2, 3) for i in range(count - size + 1)]
    single = [one for one in ranges if one.stop - one.start == 1 or _one_centre(mechanism, limb.joints[one])]
    pairs = [
        (a, b)
        for a in single
        for b in single
        if a.stop <= b.start and not _one_centre(mechanism, limb.joints[a] + limb.joints[b])
    ]
    return sorted(pairs, key=lambda pair: pair[1].stop - pair[1].start + pair[0].stop - pair[0].start)


def _one_centre(mechanism: Mechanism, joints: tuple[int, ...]) -> bool:
    """Whether joints move about one point and nothing else."""
    basis = algebra(mechanism.screws_of(joints))
    return bool(len(basis) == 3 == np.linalg.matrix_rank(basis[:, :3], tol=1e-6))


def redundant_limbs(mechanism: Mechanism, finite: int) -> tuple[Limb, ...]:
    """Return the limbs each of which may be taken off without any other link being freer for it.

    Args:
        mechanism: With loops.
        finite: Its finite mobility.
    """
    if len(mechanism.loops) < 2:
        return ()
    found = []
    for limb in limbs(mechanism):
        rest = mechanism.without(limb.links, limb.joints)
        if rest is None or not rest.joints:
            continue
        own = mechanism.screws_of(limb.joints)
        idle = len(own) - len(row_space(own))
        wanted = finite - idle
        if rest.freedoms - sum(loop.dimension for loop in rest.loops) > wanted:
            continue  # no mechanism has fewer freedoms than are counted loop by loop
        rank, equations = _rank(rest)
        if rank.mobility == wanted or (rank.mobility > wanted == walk(equations, rank).dimension):
            found.append(limb)
    return tuple(found)


def redundant_joints(mechanism: Mechanism, mobility: int) -> tuple[RedundantJoint, ...]:
    """Return the joints that could be made freer without a further freedom of the whole.

    Cutting a joint removes its constraints; those that do not free anything were redundant.

    Args:
        mechanism: With loops.
        mobility: Instantaneous, of the whole.
    """
    found = []
    for k, joint in enumerate(mechanism.joints):
        dimensions = [loop.dimension for loop in mechanism.loops if k in loop.joints]
        rest = mechanism.without((), (k,)) if dimensions else None
        if rest is None:
            continue
        constraints = min(dimensions) - joint.freedoms
        redundant = constraints - (_rank(rest)[0].mobility - mobility)
        if redundant > 0:
            found.append(RedundantJoint(joint=k, constraints=constraints, redundant=redundant))
    return tuple(found)


def _rank(mechanism: Mechanism) -> tuple[Rank, LoopEquations]:
    equations = LoopEquations(mechanism)
    return rank_of(equations.jacobian(np.zeros(mechanism.freedoms))), equations
