"""In how many orientations a position is reached: the complete inverse kinematics, asked for each of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import ConfigurationError
from dh2sim.inverse.goals import Free
from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics, geometric_jacobian
from dh2sim.kinematics.rotations import rotations_about, rotations_of_quaternions
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.progress import Advance, no_progress
from dh2sim.robot.row import JointType, Limits
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from dh2sim.workspace.point import STILL

Kind: TypeAlias = Literal["orientations", "directions", "angles"]
BATCH: Final = 960
"""Poses that are solved together."""
LOCKS: Final = 6
"""Values of a joint to spare at which an arm of seven joints is asked."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Turn:
    """Positions that are those of a section, turned about the axis of the first joint."""

    joint: str
    low: float
    """Limits of the joint, rad."""
    high: float
    cell: NDArray[np.int64]
    """Number of the section's position that each is, shape (N,)."""
    azimuth: Array
    """Angle by which each is turned from there, rad, shape (N,)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dexterity:
    """Shares of orientations that are reached at positions."""

    kind: Kind
    """What is counted: all 'orientations'; 'directions' of tool0's z, whatever the roll; or 'angles' about the one
    axis that an arm turns about."""
    orientations: int
    """How many are asked for at each position, spread evenly."""
    share: Array = field(repr=False)
    """Of each position, 0 to 1, shape (N,)."""
    notes: tuple[str, ...]
    """What the shares do not say, in sentences."""


def dexterity_at(
    spec: RobotSpec,
    positions: Array,
    orientations: int,
    *,
    travel: tuple[Array, Array],
    turn: Turn | None = None,
    advance: Advance = no_progress,
) -> Dexterity:
    """Return in which share of orientations tool0 reaches positions inside the limits.

    Args:
        spec: The robot.
        positions: In base_link, m, shape (N, 3).
        orientations: How many to ask for at each.
        travel: Lower and upper coordinates of the joints, rad and m, shape (n,) each.
        turn: Of a robot whose first joint turns: where positions stand about its axis. Then positions in one section
            are solved once, and turned with the first joint.
        advance: Called with numbers of poses as they are done.

    Raises:
        ConfigurationError: The arm reaches a position in one orientation, or some, but in no share of all.
    """
    kind, axis, R0 = _kind(spec, travel)
    rotations = spread_rotations(orientations, kind, axis, R0)
    free: Free | None = "roll" if kind == "directions" else None
    solver = InverseSolver(spec if turn is None else _unlimited(spec, turn.joint))
    locked = [name for name in solver.joints_to_lock(free) if turn is None or name != turn.joint]
    if len(locked) > 1 or len(solver.joints_to_lock(free)) > len(locked):
        raise ConfigurationError(
            f"{spec.name} has {len(solver.joints_to_lock(free))} joints to spare: its dexterity cannot be computed"
        )
    names = [row.name for row in spec.moving_rows]
    notes, values = [], np.zeros(1)
    if locked:
        index = names.index(locked[0])
        values = np.linspace(travel[0][index], travel[1][index], 2 * LOCKS + 1)[1::2]
        notes.append(f"Each orientation is asked for at {LOCKS} values of {locked[0]}: shares may be higher.")
    share = np.zeros(len(positions if turn is None else turn.cell))
    each = max(1, BATCH // orientations)
    order = np.arange(len(share)) if turn is None else np.argsort(turn.cell, kind="stable")
    of_cell = order if turn is None else turn.cell[order]
    for start in range(0, len(positions), each):
        block = np.arange(start, min(start + each, len(positions)))
        poses = np.broadcast_to(np.eye(4), (len(block) * orientations, 4, 4)).copy()
        poses[:, :3, :3] = np.tile(rotations, (len(block), 1, 1))
        poses[:, :3, 3] = np.repeat(positions[block], orientations, axis=0)
        found: list[list[float]] = [[] for _ in poses]
        for value in values:
            open_ = np.arange(len(poses)) if turn is not None else np.flatnonzero([not q for q in found])
            results = solver.solve(poses[open_], lock=dict.fromkeys(locked, value), free=free) if len(open_) else []
            for k, solutions in zip(open_, results, strict=True):
                found[k] += (
                    [0.0] * len(solutions) if turn is None else solutions.q[:, names.index(turn.joint)].tolist()
                )
        advance(len(poses))
        low, high = np.searchsorted(of_cell, [block[0], block[-1] + 1]).tolist()
        for index in range(low, high):
            mine = found[(of_cell[index] - start) * orientations : (of_cell[index] - start + 1) * orientations]
            share[order[index]] = sum(_inside(q, turn, order[index]) for q in mine) / orientations
    return Dexterity(kind=kind, orientations=orientations, share=read_only(share), notes=tuple(notes))


def _inside(found: list[float], turn: Turn | None, position: int) -> bool:
    """Return whether one of the first joint's coordinates, turned to a position, is inside its limits."""
    if turn is None or not found:
        return bool(found)
    width = turn.high - turn.low
    return any((q + turn.azimuth[position] - turn.low) % (2.0 * math.pi) <= width + 1e-9 for q in found)


def _unlimited(spec: RobotSpec, joint: str) -> RobotSpec:
    """Return the robot with one joint that turns without end."""
    rows = tuple(
        replace(row, type=JointType.CONTINUOUS, limits=Limits()) if row.name == joint else row for row in spec.rows
    )
    return replace(spec, rows=rows)


def _kind(spec: RobotSpec, travel: tuple[Array, Array]) -> tuple[Kind, Array, Array]:
    """Return what orientations an arm has at a position, the axis that it turns about, and an orientation it has."""
    chain = build_chain(spec)
    q = scattered_configurations(*travel, 24)
    J = geometric_jacobian(chain, q)
    size = max(1e-300, float(np.abs(J[:, :3]).max(initial=0.0)))
    scaled = J / np.array([size, size, size, 1.0, 1.0, 1.0])[:, None]
    values = np.linalg.svd(scaled, compute_uv=False)
    rank = int((values > STILL * values.max(initial=1e-300)).sum(axis=1).max())
    turning = np.linalg.svd(np.concatenate(list(J[:, 3:]), axis=1))
    axes = int((turning[1] > STILL).sum())
    place = int((np.linalg.svd(J[:, :3], compute_uv=False) > STILL * size).sum(axis=1).max())
    R0 = forward_kinematics(chain, spec.named_configurations["home"])[:3, :3]
    if axes == 1 and rank == place + 1:
        axis = turning[0][:, 0]
        return "angles", axis * np.sign(axis[np.argmax(np.abs(axis))]), R0
    if rank == 6:
        return "orientations", np.zeros(3), R0
    if rank == 5 and place == 3 and chain.n == 5:
        return "directions", np.zeros(3), R0
    joints = "1 joint" if chain.n == 1 else f"{chain.n} joints"
    raise ConfigurationError(
        f"{spec.name}, with {joints}, cannot choose the orientation at a position: there is no dexterity to measure"
    )


def spread_rotations(count: int, kind: Kind, axis: Array, R0: Array) -> Array:
    """Return rotations that are spread evenly, shape (count, 3, 3), the same ones every time.

    All orientations: super-Fibonacci spirals (M. Alexa, Super-Fibonacci Spirals: Fast, Low-Discrepancy Sampling of
    SO(3), CVPR 2022). Directions of z: a Fibonacci lattice on the sphere. Angles: equal steps from ``R0``.
    """
    s = np.arange(count) + 0.5
    if kind == "angles":
        return np.asarray(rotations_about(axis, 2.0 * math.pi * s / count) @ R0)
    if kind == "directions":
        height, longitude = 1.0 - 2.0 * s / count, math.pi * (3.0 - math.sqrt(5.0)) * s
        tilt = np.arccos(height)
        zero = np.zeros(count)
        sine = np.sin(tilt / 2)
        quaternions = [np.cos(tilt / 2), -sine * np.sin(longitude), sine * np.cos(longitude), zero]
        return rotations_of_quaternions(np.stack(quaternions, axis=-1))
    psi = 1.533751168755204288118041
    r, R = np.sqrt(s / count), np.sqrt(1.0 - s / count)
    alpha, beta = 2.0 * math.pi * s / math.sqrt(2.0), 2.0 * math.pi * s / psi
    quaternions = [R * np.cos(beta), r * np.sin(alpha), r * np.cos(alpha), R * np.sin(beta)]
    return rotations_of_quaternions(np.stack(quaternions, axis=-1))
