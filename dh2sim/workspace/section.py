"""The section of a workspace: of an arm that turns first in r and z, of a planar arm in its own plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.kinematics.sampling import random_configurations
from dh2sim.progress import Advance
from dh2sim.typing import Array, read_only
from dh2sim.workspace.point import AroundAxis, InBasis, PointMap, motion_rank
from dh2sim.workspace.region import Curve, Region, find_region

SAMPLES: Final = 60_000
"""Random configurations that nodes are searched from; a region takes no more, whatever the voxels take."""
LINE: Final = 721
"""Points of a section that is a line."""
_SINGULAR_STARTS: Final = 3000
_NEWTON: Final = 40
_AT_LIMIT: Final = 1e-6
"""rad or m from a limit at which a joint is there."""
SINGULAR: Final = -1
"""Stands for the number of a joint where no limit, but a singularity bounds the region."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Section:
    """A section of a workspace, with the curves that bound it."""

    labels: tuple[str, str]
    """Of the coordinates: ``('r', 'z')``, or two axes of a plane."""
    turns_about: str | None
    """Joint about whose axis the section turns; None of a planar arm, whose section is the workspace."""
    axis_point: Array = field(repr=False)
    """Where both coordinates are zero, in base_link, m, shape (3,)."""
    directions: Array = field(repr=False)
    """Directions of the coordinates in base_link, unit vectors, shape (2, 3); of r, where joints are at home."""
    curves: tuple[Curve, ...]
    """Closed curves around what is reached, which is on their left; the longest first."""
    held_by: tuple[NDArray[np.int64], ...] = field(repr=False)
    """For each corner of each curve: index of the joint whose limit it is at, or ``SINGULAR``."""
    line: Array = field(repr=False)
    """The section, m, shape (N, 2), where it is a line or a point; else of shape (0, 2)."""
    nodes: Array = field(repr=False)
    """Nodes of the grid that are reached, m, shape (N, 2)."""
    size: float
    """Distance of nodes, m: what is thinner may be missing."""
    singular: Array = field(repr=False)
    """Points where the section's Jacobian loses rank inside all limits: a scattering of curves, m, shape (N, 2)."""
    singular_q: Array = field(repr=False)
    """Configurations there, of all joints, rad and m, shape (N, n)."""
    area: float
    """m²."""
    full_turn_volume: float | None
    """m³, if the first joint turned all around (Pappus); None of a planar arm."""
    volume: float | None
    """m³, inside the first joint's limits; None of a planar arm."""


def around_first_axis(point: PointMap) -> AroundAxis:
    """Return r and z about the axis of the first joint; z is zero beside the origin of base_link."""
    origin, direction = point.first_axis()
    direction = np.where(np.abs(direction) < 1e-12, 0.0, direction)
    foot = origin - (origin @ direction) * direction
    return AroundAxis(point.without_first(), np.where(np.abs(foot) < 1e-12, 0.0, foot), direction)


def turned_section(point: PointMap, names: Sequence[str], size: float, seed: int, advance: Advance) -> Section:
    """Return the section of an arm whose first joint turns.

    Args:
        point: The point.
        names: Of all moving joints.
        size: Distance of the grid's nodes, m.
        seed: Of the random configurations that are searched from.
        advance: Called with numbers of nodes as they are reached.
    """
    around = around_first_axis(point)
    direction = around.points(np.array([1.0]), np.array([0.0]))[0] - around.origin
    axes = np.stack([direction, around.direction])
    section, region, q = _section(around, around.point, ("r", "z"), axes, size, seed, advance)
    first = point.joints[0]
    full = sum(_turned_volume(curve) for curve in region.curves)
    share = _turn_share(around, region, q, float(point.high[first] - point.low[first]))
    return replace(section, turns_about=names[first], full_turn_volume=full, volume=full * share)


def planar_section(point: PointMap, axes: Array, origin: Array, size: float, seed: int, advance: Advance) -> Section:
    """Return what a planar arm reaches in its plane: axes, shape (2, 3), and a point of it, shape (3,)."""
    plane = InBasis(point, axes, origin)
    return _section(plane, point, axis_labels(axes), axes, size, seed, advance)[0]


def axis_labels(axes: Array) -> tuple[str, str]:
    """Return names of the axes of a plane: those of base_link, or u and v."""
    names = ["xyz"[int(np.argmax(axis))] if axis.max() == 1.0 else "" for axis in axes]
    return (names[0], names[1]) if all(names) else ("u", "v")


def _section(
    coordinates: AroundAxis | InBasis,
    point: PointMap,
    labels: tuple[str, str],
    directions: Array,
    size: float,
    seed: int,
    advance: Advance,
) -> tuple[Section, Region, Array]:
    """Return the section in two coordinates of a point, its region, and the configurations searched from."""
    q = random_configurations(point.sample_low, point.sample_high, SAMPLES, [seed, 1])
    x, J = coordinates.values(q)
    region = Region(curves=(), nodes=np.empty((0, 2)), q=q[:0], size=size)
    line, singular = np.empty((0, 2)), q[:0]
    if motion_rank(J[:64]) == 2:
        low, high = x.min(axis=0) - 0.25 * point.size, x.max(axis=0) + 0.25 * point.size
        half_plane = isinstance(coordinates, AroundAxis)
        region = find_region(
            coordinates, q, low, high, size, scale=point.size, half_plane=half_plane, advance=advance
        )
        singular = _singular_configurations(coordinates, point, q[:_SINGULAR_STARTS])
    elif len(point.joints) > 1:
        line = x
    elif point.joints:
        line = coordinates.values(np.linspace(point.sample_low, point.sample_high, LINE))[0]
    else:
        line = x[:1]
    section = Section(
        labels=labels,
        turns_about=None,
        axis_point=read_only(coordinates.origin),
        directions=read_only(directions),
        curves=region.curves,
        held_by=tuple(_held_by(coordinates, point, curve) for curve in region.curves),
        line=read_only(line),
        nodes=region.nodes,
        size=size,
        singular=read_only(coordinates.values(singular)[0]),
        singular_q=read_only(point.full(singular)),
        area=region.area,
        full_turn_volume=None,
        volume=None,
    )
    return section, region, q


def _turned_volume(curve: Curve) -> float:
    """Return the volume of what a curve bounds, turned about r = 0, m³; by Green's theorem, exact for its pieces."""
    r, z = curve.points.T
    r1, z1 = np.roll(r, -1), np.roll(z, -1)
    return float((math.pi / 3.0 * (z1 - z) * (r * r + r * r1 + r1 * r1)).sum())


def _turn_share(around: AroundAxis, region: Region, q: Array, turn: float) -> float:
    """Return the share of a full turn at which nodes are reached, weighted with their distance from the axis.

    Configurations that reach a node stand at different angles about the axis; each covers what the first joint turns.
    """
    if turn >= 2.0 * math.pi - 1e-9 or not len(region.nodes):
        return 1.0
    x = np.concatenate([region.nodes, around.values(q)[0]])
    angles = np.concatenate([around.azimuths(region.q), around.azimuths(q)])
    index = np.floor(x / region.size).astype(np.int64)
    cells, cell = np.unique(index, axis=0, return_inverse=True)
    cell = cell.ravel()
    order = np.lexsort([angles, cell])
    cell, angles = cell[order], angles[order]
    first = np.flatnonzero(np.diff(cell, prepend=-1))
    following = np.append(angles[1:], 0.0)
    last = np.append(first[1:], len(cell)) - 1
    following[last] = angles[first] + 2.0 * math.pi
    covered = np.add.reduceat(np.minimum(following - angles, turn), first)
    r = (cells[:, 0] + 0.5) * region.size
    return float((covered * r).sum() / (2.0 * math.pi * r.sum()))


def _held_by(coordinates: AroundAxis | InBasis, point: PointMap, curve: Curve) -> NDArray[np.int64]:
    """Return for each corner of a curve the joint whose limit holds the point back most, or ``SINGULAR``."""
    ahead, behind = np.roll(curve.points, -1, axis=0), np.roll(curve.points, 1, axis=0)
    tangent = ahead - behind
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=-1)
    normal /= np.maximum(np.hypot(*normal.T), 1e-300)[:, None]
    _, J = coordinates.values(curve.q)
    push = (J * normal[:, :, None]).sum(axis=1) * point.steps
    at = ((curve.q >= point.upper - _AT_LIMIT) & (push > 0.0)) | ((curve.q <= point.lower + _AT_LIMIT) & (push < 0.0))
    strength = np.where(at, np.abs(push), 0.0)
    joint = np.array(point.joints)[np.argmax(strength, axis=1)]
    return np.where(strength.max(axis=1) > 1e-3 * point.size, joint, SINGULAR).astype(np.int64)


def _singular_configurations(coordinates: AroundAxis | InBasis, point: PointMap, q: Array) -> Array:
    """Return configurations inside all limits at which the two coordinates cannot move at once, shape (N, m).

    A direction n(θ) that no joint moves along, Jᵀ n = 0, is one equation a joint; with θ there is an unknown more, so
    the set is made of curves, and Newton's steps of least norm lead onto them.
    """
    m = len(point.joints)
    theta = np.linspace(0.0, math.pi, len(q), endpoint=False)
    q = q.copy()
    residual = np.full(len(q), np.inf)
    for _ in range(_NEWTON):
        J, H = coordinates.second(q)
        c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
        G = (c * J[:, 0] + s * J[:, 1]) * point.steps
        residual = np.abs(G).max(axis=1)
        A = np.empty((len(q), m, m + 1))
        A[:, :, :m] = (c[:, :, None] * H[:, 0] + s[:, :, None] * H[:, 1]) * point.steps[:, None] * point.steps
        A[:, :, m] = (-s * J[:, 0] + c * J[:, 1]) * point.steps
        damping = 1e-12 * (A * A).sum(axis=(1, 2)) + 1e-300
        gram = A @ A.swapaxes(1, 2) + damping[:, None, None] * np.eye(m)
        step = (A.swapaxes(1, 2) @ np.linalg.solve(gram, -G[:, :, None]))[:, :, 0]
        step /= np.maximum(1.0, np.abs(step).max(axis=1))[:, None]
        q += step[:, :m] * point.steps
        theta += step[:, m]
    inside = ((q >= point.lower - 1e-9) & (q <= point.upper + 1e-9)).all(axis=1)
    return np.asarray(q[inside & (residual < 1e-9 * point.size)])
