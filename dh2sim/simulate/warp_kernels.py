"""What is looked at on the device after each time step; imported only where Warp is installed."""

from __future__ import annotations

import warp as wp


@wp.kernel  # type: ignore[untyped-decorator]
def watch(
    qpos: wp.array2d(dtype=float),  # type: ignore[valid-type]
    qvel: wp.array2d(dtype=float),  # type: ignore[valid-type]
    qacc: wp.array2d(dtype=float),  # type: ignore[valid-type]
    constraints: wp.array(dtype=int),  # type: ignore[valid-type]
    room: int,
    huge: float,
    found: wp.array(dtype=int),  # type: ignore[valid-type]
) -> None:
    """Note simulations whose state is not finite or huge, or that have more constraints than there is room for.

    Bits of ``found``: 1 positions, 2 velocities, 4 accelerations, 8 constraints.
    """
    world = wp.tid()
    bits = int(0)  # noqa: UP018, RUF046 - so that Warp lets it change
    for i in range(qpos.shape[1]):
        if not (wp.abs(qpos[world, i]) < huge):
            bits = bits | 1
    for i in range(qvel.shape[1]):
        if not (wp.abs(qvel[world, i]) < huge):
            bits = bits | 2
        if not (wp.abs(qacc[world, i]) < huge):
            bits = bits | 4
    if constraints[world] > room:
        bits = bits | 8
    found[world] = found[world] | bits


@wp.kernel  # type: ignore[untyped-decorator]
def count_contacts(
    total: wp.array(dtype=int),  # type: ignore[valid-type]
    world_of: wp.array(dtype=int),  # type: ignore[valid-type]
    counts: wp.array(dtype=int),  # type: ignore[valid-type]
) -> None:
    """Count the contacts of each simulation, which are in one list for all of them."""
    i = wp.tid()
    if i < total[0]:
        wp.atomic_add(counts, world_of[i], 1)
