"""The reachable set as voxels: drawn at random, and completed by searches from every voxel to its neighbours."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import SettingsError
from dh2sim.kinematics.forward import geometric_jacobian
from dh2sim.kinematics.sampling import random_configurations, scattered_configurations
from dh2sim.progress import Advance
from dh2sim.typing import Array, read_only
from dh2sim.workspace.point import Coordinates, Flags, InBasis, PointMap, motion_rank
from dh2sim.workspace.reaching import reach

MOST_VOXELS: Final = 8_000_000
"""Of the box around the reachable set: about 1 GB of memory."""
BATCH: Final = 4096
"""Configurations that are computed together, whatever the number of threads."""
_STEPS: Final = 8
"""Of a search from a voxel to the next."""

In = TypeVar("In")
Out = TypeVar("Out")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grid:
    """Voxels, or cells of a plane, or pieces of a line: cubes of one size along some axes."""

    origin: Array
    """Lower corner of the first voxel, in coordinates along the axes, m, shape (k,)."""
    shape: tuple[int, ...]
    size: float
    """Edge, m."""

    def numbers(self, x: Array) -> NDArray[np.int64]:
        """Return the number of the voxel that each point is in, shape (N,); x is inside the grid, shape (N, k)."""
        index = np.floor((x - self.origin) / self.size).astype(np.int64)
        index = np.clip(index, 0, np.array(self.shape) - 1)
        return np.asarray(np.ravel_multi_index(tuple(index.T), self.shape), dtype=np.int64)

    def indices(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the indices of voxels along the axes, shape (N, k)."""
        return np.stack(np.unravel_index(numbers, self.shape), axis=-1).astype(np.int64)

    def centers(self, numbers: NDArray[np.int64]) -> Array:
        """Return the centres of voxels, m, shape (N, k)."""
        return np.asarray(self.origin + (self.indices(numbers) + 0.5) * self.size)


def grid_around(low: Array, high: Array, size: float, least: str) -> Grid:
    """Return the grid whose planes are at whole multiples of the size, around a box, with a voxel to spare.

    Raises:
        SettingsError: It would have too many voxels; the text says which size would do.
    """
    extent = np.maximum(high - low, 0.0)
    first = np.floor(low / size) - 1.0
    counts = np.floor(high / size) + 1.0 - first + 1.0
    total = float(np.prod(counts))
    if not total <= MOST_VOXELS:
        enough = size
        while np.prod(np.floor(extent / enough) + 4.0) > MOST_VOXELS:
            enough *= 1.05
        digits = 10.0 ** (math.floor(math.log10(enough)) - 1)
        enough = math.ceil(enough / digits) * digits
        raise SettingsError(
            [("size", f"of {size:g} m would need {total:.2g} {least}, more than {MOST_VOXELS:,}; use {enough:g} m")]
        )
    return Grid(origin=read_only(first * size), shape=tuple(int(count) for count in counts), size=size)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Voxels:
    """The voxels that the point reaches."""

    grid: Grid
    numbers: NDArray[np.int64] = field(repr=False)
    """Numbers in the grid, ascending, shape (N,)."""
    count: NDArray[np.int64] = field(repr=False)
    """Random configurations that put the point there, shape (N,); 0 where only a search got there."""
    manipulability: Array = field(repr=False)
    """The best of the configurations found, shape (N,)."""
    q: Array = field(repr=False)
    """The configuration that has it, rad and m, of the joints that move the point, shape (N, m)."""

    def __len__(self) -> int:
        """Return the number of voxels."""
        return len(self.numbers)


class Measure:
    """Yoshikawa's manipulability: of the whole frame where joints move it in all six ways, else of its origin."""

    def __init__(self, point: PointMap, coordinates: InBasis) -> None:
        """Choose for a point with coordinates along the axes that it moves in."""
        self._point, self._coordinates = point, coordinates
        rank = motion_rank(self._jacobians(_trials(point)))
        self.whole = rank == 6
        """Whether turning counts, too: m³ for an arm of six turning joints, as ``dh2sim jacobian`` prints."""
        self._rank = 6 if self.whole else motion_rank(point.J_trials)

    def of(self, q: Array) -> Array:
        """Return it at configurations of the joints that move the point, (N, m)."""
        return self._of(self._jacobians(q) if self.whole else self._coordinates.values(q)[1])

    def places_and_values(self, q: Array) -> tuple[Array, Array]:
        """Return where the point is, m, shape (N, k), and the measure there."""
        if self.whole:
            return self._coordinates.places(q), self.of(q)
        x, J = self._coordinates.values(q)
        return x, self._of(J)

    def _of(self, A: Array) -> Array:
        rows, columns = A.shape[1:]
        if rows == columns and rows == self._rank:
            return np.asarray(np.abs(np.linalg.det(A)))
        if min(rows, columns) == self._rank:
            gram = A @ A.swapaxes(1, 2) if rows < columns else A.swapaxes(1, 2) @ A
            return np.asarray(np.sqrt(np.maximum(np.linalg.det(gram), 0.0)))
        return np.asarray(np.linalg.svd(A, compute_uv=False)[:, : self._rank].prod(axis=-1))

    def _jacobians(self, q: Array) -> Array:
        vectors = np.broadcast_to(self._point.home, (len(q), len(self._point.home))).copy()
        vectors[:, list(self._point.joints)] = q
        return geometric_jacobian(self._point.chain, vectors, frame=self._point.frame)


def _trials(point: PointMap) -> Array:
    return scattered_configurations(point.sample_low, point.sample_high, 16)


def in_order(work: Callable[[In], Out], items: Iterable[In], threads: int) -> Iterator[Out]:
    """Yield what ``work`` makes of items, in their order, computed by several threads."""
    if threads <= 1:
        yield from map(work, items)
        return
    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(work, items)


def batches(count: int) -> list[slice]:
    """Return the parts of an array that are computed together."""
    return [slice(start, min(start + BATCH, count)) for start in range(0, count, BATCH)]


def draw_voxels(
    point: PointMap,
    measure: Measure,
    grid: Grid,
    samples: int,
    seed: int,
    threads: int,
    advance: Advance,
) -> Voxels:
    """Return the voxels that random configurations reach: uniform between the limits of joints that move the point.

    Each batch has a generator of its own, so that the number of threads changes nothing.
    """
    parts = batches(samples)

    def draw(part: slice) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array]:
        q = random_configurations(
            point.sample_low, point.sample_high, part.stop - part.start, [seed, part.start // BATCH]
        )
        x, w = measure.places_and_values(q)
        return _best(grid.numbers(x), np.ones(len(q), dtype=np.int64), w, q)

    total: tuple[NDArray[np.int64], NDArray[np.int64], Array, Array] | None = None
    waiting: list[tuple[NDArray[np.int64], NDArray[np.int64], Array, Array]] = []
    for k, found in enumerate(in_order(draw, parts, threads)):
        waiting.append(found)
        if len(waiting) == 32 or k == len(parts) - 1:
            waiting = waiting if total is None else [total, *waiting]
            numbers, count, w, q = (np.concatenate(column) for column in zip(*waiting, strict=True))
            total, waiting = _best(numbers, count, w, q), []
        advance(parts[k].stop - parts[k].start)
    assert total is not None
    numbers, count, w, q = total
    return Voxels(grid=grid, numbers=numbers, count=count, manipulability=w, q=q)


def _best(
    numbers: NDArray[np.int64], count: NDArray[np.int64], w: Array, q: Array
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array]:
    """Return each voxel once: its count summed, its best manipulability, and the first configuration that has it."""
    order = np.lexsort([np.arange(len(numbers)), -w, numbers])
    ordered = numbers[order]
    first = np.flatnonzero(np.diff(ordered, prepend=ordered[0] - 1))
    best = order[first]
    return ordered[first], np.add.reduceat(count[order], first), w[best], q[best]


def grow_voxels(
    voxels: Voxels,
    measure: Measure,
    coordinates: Coordinates,
    threads: int,
    advance: Advance,
) -> Voxels:
    """Return also the voxels that searches from reached neighbours get into, until none is found any more.

    Every pair of neighbours is tried once, face to face. Random configurations leave out few voxels inside, but many
    at the boundary, where configurations are rare.
    """
    grid, half = voxels.grid, 0.5 * voxels.grid.size
    total = math.prod(grid.shape)
    place = np.full(total, -1, dtype=np.int32)
    place[voxels.numbers] = np.arange(len(voxels), dtype=np.int32)
    tried = np.zeros(total, dtype=np.uint8)
    numbers, all_q, found_w = [voxels.numbers], [voxels.q], [voxels.manipulability]
    known = len(voxels)
    new = voxels.numbers
    new_q = voxels.q
    strides = [math.prod(grid.shape[axis + 1 :]) for axis in range(len(grid.shape))]
    directions = [(axis, sign) for axis in range(len(grid.shape)) for sign in (1, -1)]
    while len(new):
        reached_now, q_now, w_now = [], [], []
        for bit, (axis, sign) in enumerate(directions):
            index = (new // strides[axis]) % grid.shape[axis]
            inside = (index + sign >= 0) & (index + sign < grid.shape[axis])
            targets = new[inside] + sign * strides[axis]
            fresh = (place[targets] < 0) & ((tried[targets] >> bit) & 1 == 0)
            targets, starts = targets[fresh], new_q[inside][fresh]
            tried[targets] |= np.uint8(1 << bit)
            if not len(targets):
                continue
            centers = grid.centers(targets)

            def search(part: slice, starts: Array = starts, centers: Array = centers) -> tuple[Array, Flags, Array]:
                q, ok = reach(
                    coordinates,
                    starts[part],
                    centers[part],
                    within=half * (1.0 - 1e-9),
                    slack=0.9 * half,
                    most=_STEPS,
                )
                w = np.zeros(len(q))
                if ok.any():
                    w[ok] = measure.of(q[ok])
                return q, ok, w

            results = list(in_order(search, batches(len(targets)), threads))
            q, ok, w = (np.concatenate(column) for column in zip(*results, strict=True))
            hits = targets[ok]
            place[hits] = np.arange(known, known + len(hits), dtype=np.int32)
            known += len(hits)
            reached_now.append(hits)
            q_now.append(q[ok])
            w_now.append(w[ok])
            advance(len(hits))
        new = np.concatenate(reached_now) if reached_now else np.empty(0, dtype=np.int64)
        new_q = np.concatenate(q_now) if q_now else np.empty((0, voxels.q.shape[1]))
        numbers.append(new)
        all_q.append(new_q)
        found_w.append(np.concatenate(w_now) if w_now else np.empty(0))
    merged = np.concatenate(numbers)
    order = np.argsort(merged, kind="stable")
    count = np.concatenate([voxels.count, np.zeros(len(merged) - len(voxels), dtype=np.int64)])
    return Voxels(
        grid=grid,
        numbers=merged[order],
        count=count[order],
        manipulability=np.concatenate(found_w)[order],
        q=np.concatenate(all_q)[order],
    )


def spanned(p: Array, scale: float) -> tuple[Array, Array]:
    """Return the axes of the line, plane or space that points lie in, shape (k, 3), and a point of it, shape (3,).

    Axes of a plane are those of base_link where they lie in it, else as near to them as can be. A point that does not
    move has the x axis.

    Args:
        p: Points, m, shape (N, 3).
        scale: Length beside which a distance from the plane is rounding, m.
    """
    center = 0.5 * (p.min(axis=0) + p.max(axis=0))
    _, values, vectors = np.linalg.svd(p - center, full_matrices=False)
    k = int((values > 1e-9 * scale * math.sqrt(len(p))).sum())
    if k == 3:
        return np.eye(3), np.zeros(3)
    if k == 0:
        return np.eye(3)[:1], np.array([0.0, center[1], center[2]])
    span = _tidied(vectors[:k])
    inside = span.T @ (span @ np.eye(3))
    nearest = sorted(range(3), key=lambda axis: (-round(float(inside[axis] @ inside[axis]), 6), axis))[:k]
    axes: list[Array] = []
    for axis in sorted(nearest):
        direction = inside[axis] - sum((float(inside[axis] @ other) * other for other in axes), np.zeros(3))
        axes.append(_tidied(direction / np.linalg.norm(direction)))
    basis = np.stack(axes)
    return basis, np.where(np.abs(offset := center - basis.T @ (basis @ center)) < 1e-12 * scale, 0.0, offset)


def _tidied(axes: Array) -> Array:
    return np.where(np.abs(axes) < 1e-12, 0.0, np.where(np.abs(np.abs(axes) - 1.0) < 1e-12, np.sign(axes), axes))
