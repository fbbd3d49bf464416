"""Pairs of links that touch by construction, and so must not collide with each other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import reference_joint_poses
from dh2sim.kinematics.transforms import identity
from dh2sim.model.shapes import Shape
from dh2sim.typing import Array


class Reason(StrEnum):
    """Why a pair of links does not collide, in the words of SRDF files."""

    ADJACENT = "Adjacent"
    """Neighbours on the chain, fixed links counted with the link that carries them."""
    DEFAULT = "Default"
    """Their shapes overlap at zero or at home."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExcludedPair:
    """Two links that do not collide with each other."""

    link1: str
    link2: str
    reason: Reason


def excluded_pairs(
    chain: KinematicChain,
    names: Sequence[str],
    shapes: Sequence[Sequence[Shape]],
    configurations: Iterable[Array],
) -> tuple[ExcludedPair, ...]:
    """List the pairs of links that touch because they are neighbours, or in one of the configurations.

    Args:
        chain: The chain, n rows.
        names: Of the n + 1 links, the base link's first; then of what is fixed to the last one.
        shapes: Of each, in its link's frame; in the last link's for what is fixed to it.
        configurations: Joint vectors (rad, m); links that touch in one of them do so by construction.

    Returns:
        The pairs in the order of the links. Shapes count as capsules here, a cylinder with rounded ends of its own
        radius, so that links that nearly touch are among the pairs.
    """
    group = [0]
    for joint in chain.joints:
        group.append(group[-1] + (1 if joint.type.moves else 0))
    group += group[-1:] * (len(names) - len(group))
    touching = _overlapping(chain, shapes, configurations)
    pairs = []
    for i in range(len(names)):
        for j in range(i + 1, len(names)):
            if not shapes[i] or not shapes[j]:
                continue
            if group[j] - group[i] <= 1:
                pairs.append(ExcludedPair(link1=names[i], link2=names[j], reason=Reason.ADJACENT))
            elif touching[i, j]:
                pairs.append(ExcludedPair(link1=names[i], link2=names[j], reason=Reason.DEFAULT))
    return tuple(pairs)


def _overlapping(
    chain: KinematicChain, shapes: Sequence[Sequence[Shape]], configurations: Iterable[Array]
) -> np.ndarray:
    """Whether each pair of links overlaps in one of the configurations: booleans, shape (links, links)."""
    solid = [(index, shape) for index, own in enumerate(shapes) for shape in own if shape.solid]
    result = np.zeros((len(shapes), len(shapes)), dtype=bool)
    if not solid:
        return result
    link, radii = np.array([index for index, _ in solid]), np.array([shape.radius for _, shape in solid])
    centres = np.array([shape.T_link_shape for _, shape in solid])
    half = np.array([[0.5 * shape.length] for _, shape in solid]) * centres[:, :3, 2]
    x, y, z = np.stack([centres[:, :3, 3] - half, centres[:, :3, 3] + half]).transpose(2, 0, 1)[:, :, None, :, None]
    k, other = _pairs_of(len(solid))
    apart = link[k] != link[other]
    k, other = k[apart], other[apart]
    poses = np.array([[identity(), *reference_joint_poses(chain, q)] for q in configurations])
    T = poses[:, np.minimum(link, poses.shape[1] - 1), :3]
    a, b = T[..., 0] * x + T[..., 1] * y + T[..., 2] * z + T[..., 3]  # which rounds as plain arithmetic does
    first, second = ((a[:, one].reshape(-1, 3), b[:, one].reshape(-1, 3)) for one in (k, other))
    near = segment_distance(*first, *second).reshape(len(poses), -1) <= 1.001 * (radii[k] + radii[other])
    touching = near.any(axis=0)
    result[link[k[touching]], link[other[touching]]] = True
    return result | result.T


@lru_cache(maxsize=64)  # robots that differ in lengths have as many shapes
def _pairs_of(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    return np.triu_indices(count, 1)


def segment_distance(a: Array, b: Array, starts: Array, ends: Array) -> Array:
    """Return the distance, m, shape (k,), of segments from a to b, shape (3,) or (k, 3), to k others, shape (k, 3).

    Those that are parallel to within 1e-6 rad count as parallel, and those shorter than 1e-100 m as points. (Ericson,
    Real-Time Collision Detection, 5.1.9.)
    """
    d1, d2 = b - a, ends - starts
    between = a - starts
    length1 = _dots(d1, d1)
    length2 = _dots(d2, d2)
    mixed = _dots(d1, d2)
    c, f = _dots(d1, between), _dots(d2, between)
    denominator = length1 * length2 - mixed * mixed
    point1, point2 = length1 < 1e-200, length2 < 1e-200
    parallel = point1 | point2 | (denominator <= 1e-12 * length1 * length2)
    s = np.where(parallel, 0.0, np.clip((mixed * f - c * length2) / np.where(parallel, 1.0, denominator), 0.0, 1.0))
    t = (mixed * s + f) / np.where(point2, 1.0, length2)
    clipped = np.clip(t, 0.0, 1.0)
    foot = np.clip((clipped * mixed - c) / np.where(point1, 1.0, length1), 0.0, 1.0)
    s = np.where((t == clipped) & ~point2, s, foot)
    gap = (a + s[:, None] * d1) - (starts + clipped[:, None] * d2)
    return np.asarray(np.sqrt(_dots(gap, gap)))


def _dots(a: Array, b: Array) -> Array:
    product = a * b
    return np.asarray(product[..., 0] + product[..., 1] + product[..., 2])
