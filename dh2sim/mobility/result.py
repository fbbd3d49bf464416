"""What is known about a mechanism's mobility: numbers, and the verdict on them in words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from dh2sim.messages import listed
from dh2sim.mobility.constraints import Rank
from dh2sim.mobility.count import Count
from dh2sim.mobility.mechanism import Mechanism
from dh2sim.mobility.redundancy import IdleFreedom, Limb, RedundantJoint
from dh2sim.mobility.walk import Walk

_NEARLY: Final = 1e-3
"""Share of the largest singular value below which one that counts is suspicious."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Actuation:
    """What the driven joints leave free."""

    joints: tuple[str, ...]
    freedoms: int
    """Of these joints."""
    free: int
    """Velocities that are left at the assembly while they are held, idle ones not counted."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mobility:
    """The degrees of freedom of a mechanism at its assembly."""

    mechanism: Mechanism
    count: Count
    rank: Rank
    """Of the loops' constraints at the assembly."""
    finite: int
    """Freedoms of the motion through the assembly; of the freest branch where several meet."""
    walk: Walk | None
    """None where the constraints are independent, so that every velocity is the beginning of a motion."""
    redundant_joints: tuple[RedundantJoint, ...]
    redundant_limbs: tuple[Limb, ...]
    """Each alone could be taken off."""
    idle: tuple[IdleFreedom, ...]
    actuation: Actuation | None
    """None where the mechanism does not say what is driven."""

    def __repr__(self) -> str:
        return f"<Mobility of '{self.mechanism.name}': {self.finite}, counted {self.gruebler}>"

    def __str__(self) -> str:
        return f"{self.mechanism.name}: {self.verdict}"

    @property
    def instantaneous(self) -> int:
        """Return the number of independent velocities that violate no constraint."""
        return self.rank.mobility

    @property
    def gruebler(self) -> int:
        """Return the count F = lambda (n - j - 1) + sum f_i."""
        return self.count.gruebler

    @cached_property
    def verdict(self) -> str:
        """What counting and moving say together, in words."""
        return _verdict(self)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON holds it; names of links and joints in place of indices."""
        links, joints = self.mechanism.links, [joint.name for joint in self.mechanism.joints]
        count, rank = self.count, self.rank
        return {
            "robot": self.mechanism.name,
            "links": count.links,
            "joints": count.joints,
            "freedoms": list(count.freedoms),
            "lambda": count.dimension,
            "gruebler": count.gruebler,
            "constraints_form": count.constraints_form,
            "instantaneous": self.instantaneous,
            "finite": self.finite,
            "verdict": self.verdict,
            "constraints": list(count.constraints),
            "count_by_loop": count.by_loop,
            "loops": [
                {"joints": [joints[k] for k in loop.joints], "lambda": loop.dimension}
                for loop in self.mechanism.loops
            ],
            "rank": rank.rank,
            "smallest_kept": rank.kept,
            "largest_dropped": rank.dropped,
            "gap": rank.gap if math.isfinite(rank.gap) else None,
            "walked": self.walk is not None,
            "branches": [self.finite] if self.walk is None else list(self.walk.branches),
            "redundant_limbs": [[links[i] for i in limb.links] for limb in self.redundant_limbs],
            "redundant_joints": [
                {"joint": joints[each.joint], "constraints": each.constraints, "redundant": each.redundant}
                for each in self.redundant_joints
            ],
            "idle": [
                {"links": [links[i] for i in each.links], "between": [joints[k] for k in each.joints]}
                for each in self.idle
            ],
            "actuated": None
            if self.actuation is None
            else {
                "joints": list(self.actuation.joints),
                "freedoms": self.actuation.freedoms,
                "free": self.actuation.free,
            },
            "link_names": list(links),
            "joint_names": joints,
            "joint_types": [joint.type.value for joint in self.mechanism.joints],
        }


def _verdict(mobility: Mobility) -> str:
    """Return sentences: counted and moves, and why; then what is singular, suspicious, idle, and how it is driven."""
    count, finite = mobility.count, mobility.finite
    parts = [f"Counted {count.gruebler}, moves {finite}: {_reason(mobility)}."]
    for sentence in (_singular, _nearly, _idle, _driven):
        parts += filter(None, [sentence(mobility)])
    return " ".join(parts)


def _reason(mobility: Mobility) -> str:
    count, finite = mobility.count, mobility.finite
    if not mobility.mechanism.joints:
        return "there is no joint that moves"
    if not mobility.mechanism.loops:
        return "there is no loop, and every joint is free"
    if finite > count.by_loop:
        return _redundant(mobility, finite - count.by_loop)
    if finite < count.by_loop:
        if finite:
            return "this is a singular position, which leaves fewer freedoms than usual"
        return "with these dimensions it can be assembled in this position only"
    if count.gruebler != finite:
        kinds = sorted(set(count.loop_dimensions))
        return (
            f"with lambda {' or '.join(map(str, kinds))}, each loop its own, it is counted {finite}, which is right"
        )
    if mobility.instantaneous != finite:
        return "the count is right in general, but this is a singular position"
    return "the count is right" if finite else "it is rigid, as counted"


def _redundant(mobility: Mobility, surplus: int) -> str:
    """Name links that can be taken off; where there is none, joints with more constraints than needed."""
    limbs = [mobility.mechanism.together(limb.links) for limb in mobility.redundant_limbs]
    rigid = "it is rigid, and " if not mobility.finite else ""
    if limbs:
        other = f", as is any one of {listed(limbs[:-1])} in its place" if len(limbs) > 1 else ""
        extra = "" if surplus == 1 else f"; {surplus} constraints are redundant in all"
        return f"{rigid}{limbs[-1]} is redundant{other}{extra}"
    joints = mobility.mechanism.joints
    kinds = {(each.redundant, each.constraints) for each in mobility.redundant_joints}
    verb = "is" if surplus == 1 else "are"
    start = f"{rigid}{_count(surplus, 'constraint')} {verb} redundant with these dimensions"
    if len(mobility.mechanism.loops) == 1 and len(kinds) == 1:
        ((redundant, constraints),) = kinds
        follow = "follows" if redundant == 1 else "follow"
        return f"{start}; of the {constraints} of any one joint, {redundant} {follow} from the rest"
    loose = [f"{each.redundant} of {joints[each.joint].name}" for each in mobility.redundant_joints]
    return f"{start}; each of these follows from the rest: {listed(loose)}" if loose else start


def _singular(mobility: Mobility) -> str:
    walk, finite, instantaneous = mobility.walk, mobility.finite, mobility.instantaneous
    if walk is None or instantaneous == finite:
        return ""
    velocities = "velocity violates" if instantaneous == 1 else "independent velocities violate"
    start = f"Instantaneous {instantaneous}: {instantaneous} {velocities} no constraint to first order"
    if not finite:
        return f"{start}, but none goes on: it is shaky."
    if len(walk.branches) > 1:
        first, *others = walk.branches
        freedoms = " and ".join([str(first), *(_count(each, "freedom") for each in others)])
        return f"{start}; branches of motion with {freedoms} meet here (bifurcation)."
    if walk.tangents > finite:
        return f"{start}; {walk.tangents - finite} of them go nowhere wherever it moves: it is shaky throughout."
    if walk.spread > finite:
        each = f", each with {_count(finite, 'freedom')}" if finite > 1 else ""
        return f"{start}, for branches of motion meet here{each} (bifurcation)."
    return f"{start}, but only {finite} {'goes' if finite == 1 else 'go'} on: it is shaky here."


def _nearly(mobility: Mobility) -> str:
    """A file with rounded dimensions describes another mechanism than was meant."""
    values, rank = mobility.rank.values, mobility.rank.rank
    small = [i for i in range(1, rank) if values[i] < min(_NEARLY * values[0], 0.01 * values[i - 1])]
    if not small:
        return ""
    return (
        f"A singular value of the constraints is {values[small[0]]:.1e}, far below the others: with slightly other "
        f"dimensions it would have {_count(rank - small[0], 'freedom')} more. Are some of them rounded?"
    )


def _idle(mobility: Mobility) -> str:
    idle = mobility.idle
    if not idle:
        return ""
    moving = listed(mobility.mechanism.together(each.links) for each in idle)
    left = mobility.finite - len(idle)
    one = len(idle) == 1
    start = f"{len(idle)} {'is' if one else 'are'} idle: {moving} {'spins' if one else 'spin'} and nothing else moves"
    return f"{start}; {left} {'is' if left == 1 else 'are'} left." if left >= 0 else f"{start}."


def _driven(mobility: Mobility) -> str:
    actuation = mobility.actuation
    if actuation is None:
        return ""
    freedoms = mobility.finite - len(mobility.idle)
    number = len(actuation.joints)
    driven = f"{listed(actuation.joints)} {'is' if number == 1 else 'are'}" if number else "Nothing is"
    driven = f"{driven} actuated, but {_count(freedoms, 'freedom')} {'is' if freedoms == 1 else 'are'} to be driven"
    if actuation.freedoms > freedoms:
        return f"{driven}: {actuation.freedoms - freedoms} too many."
    if actuation.freedoms < freedoms:
        return f"{driven}: {freedoms - actuation.freedoms} too few."
    if actuation.free > 0:
        held = "it is" if number == 1 else "they are"
        return (
            f"Held here, {listed(actuation.joints)} do{'es' * (number == 1)} not hold the mechanism: "
            f"{_count(actuation.free, 'velocity')} {'is' if actuation.free == 1 else 'are'} left while {held} locked."
        )
    return ""


def _count(number: int, what: str) -> str:
    if number == 1:
        return f"1 {what}"
    return f"{number} {what[:-1]}ies" if what.endswith("y") else f"{number} {what}s"
