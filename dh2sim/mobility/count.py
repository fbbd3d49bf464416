"""Gruebler and Kutzbach's count of the freedoms of a mechanism, in both forms, with every number stated."""

from __future__ import annotations

from dataclasses import dataclass

from dh2sim.mobility.mechanism import Mechanism
from dh2sim.mobility.screws import algebra


@dataclass(frozen=True, slots=True, kw_only=True)
class Count:
    """What counting says; dimensions that make constraints depend on each other are unknown to it."""

    links: int
    """n, the ground among them."""
    joints: int
    """j"""
    freedoms: tuple[int, ...]
    """f_i of every joint."""
    dimension: int
    """lambda: dimension of the Lie algebra that all screws generate."""
    loop_dimensions: tuple[int, ...]
    """lambda of every independent loop by itself."""

    @property
    def gruebler(self) -> int:
        """Return F = lambda (n - j - 1) + sum f_i."""
        return self.dimension * (self.links - self.joints - 1) + sum(self.freedoms)

    @property
    def constraints(self) -> tuple[int, ...]:
        """Return C_i = lambda - f_i of every joint."""
        return tuple(self.dimension - f for f in self.freedoms)

    @property
    def constraints_form(self) -> int:
        """Return F = lambda (n - 1) - sum C_i."""
        return self.dimension * (self.links - 1) - sum(self.constraints)

    @property
    def by_loop(self) -> int:
        """Return F = sum f_i - sum of lambda over independent loops, each with its own."""
        return sum(self.freedoms) - sum(self.loop_dimensions)


def count_freedoms(mechanism: Mechanism) -> Count:
    """Count the freedoms of a mechanism from its links and joints alone.

    Of the geometry, only the screws' algebra is looked at, for lambda.
    """
    return Count(
        links=len(mechanism.links),
        joints=len(mechanism.joints),
        freedoms=tuple(joint.freedoms for joint in mechanism.joints),
        dimension=len(algebra(mechanism.screws)),
        loop_dimensions=tuple(loop.dimension for loop in mechanism.loops),
    )
