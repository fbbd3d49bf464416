"""A region of a plane that a point reaches, with the curves that bound it.

Nodes of a grid are reached exactly, by searches from random configurations and from neighbours. Where one of two
neighbours is reached, the boundary between them is found by bisection; marching squares links these places to
closed curves, which are refined where they bend. Every corner of a curve is attained by a configuration inside the
limits, so that curves never claim what is not reached.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.progress import Advance, no_progress
from dh2sim.typing import Array, read_only
from dh2sim.workspace.point import Coordinates, Flags
from dh2sim.workspace.reaching import reach

EXACT: Final = 1e-10
"""How exactly a search reaches a node or a corner of a curve, as a share of the size."""
_SEEDS: Final = 6
"""Random configurations near a node from which it is searched."""
_BISECTIONS: Final = 20
_REFINEMENTS: Final = 5
"""Rounds in which pieces of a curve are halved."""
_FLAT: Final = 1e-3
"""Share of a cell by which the middle of a piece may be off the boundary."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Curve:
    """A closed curve that bounds a region, which is on its left."""

    points: Array
    """m, shape (N, 2); the last is joined to the first."""
    q: Array = field(repr=False)
    """Configurations that attain them, of the joints that move the point, rad and m, shape (N, m)."""

    @property
    def area(self) -> float:
        """Area inside, m²; negative of a curve around a hole."""
        x, y = self.points.T
        return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Region:
    """What is reached of a plane."""

    curves: tuple[Curve, ...]
    """The longest first; curves around holes turn clockwise."""
    nodes: Array = field(repr=False)
    """The nodes of the grid that are reached, m, shape (N, 2)."""
    q: Array = field(repr=False)
    """Configurations that reach them, shape (N, m)."""
    size: float
    """Distance of neighbouring nodes, m."""

    @property
    def area(self) -> float:
        """m²."""
        return sum(curve.area for curve in self.curves)


def find_region(
    coordinates: Coordinates,
    q: Array,
    low: Array,
    high: Array,
    size: float,
    *,
    scale: float,
    half_plane: bool = False,
    advance: Advance = no_progress,
) -> Region:
    """Find the region that two coordinates of a point reach.

    Args:
        coordinates: The two coordinates.
        q: Random configurations, shape (N, m).
        low: Least coordinates, m, shape (2,).
        high: Greatest coordinates.
        size: Distance of nodes, m.
        scale: Size of the arm, m.
        half_plane: Whether the first coordinate is a distance from an axis, which is never negative.
        advance: Called with numbers of nodes as they are reached.
    """
    search = _Search(coordinates, q, low, high, size, scale, half_plane, advance)
    search.seed()
    search.grow()
    ends = search.crossings()
    loops = _linked(search.reached, ends, search.center_reached)
    curves = [search.refined(*loop) for loop in loops]
    curves = [curve for curve in curves if len(curve.points) >= 3]
    numbers = np.flatnonzero(search.reached.ravel())
    return Region(
        curves=tuple(sorted(curves, key=lambda curve: -abs(curve.area))),
        nodes=read_only(search.places(numbers)),
        q=read_only(search.q[numbers]),
        size=size,
    )


class _Search:
    """Which nodes of a grid are reached, by which configurations, and where the boundary is between them."""

    def __init__(
        self,
        coordinates: Coordinates,
        q: Array,
        low: Array,
        high: Array,
        size: float,
        scale: float,
        half_plane: bool,
        advance: Advance,
    ) -> None:
        self.coordinates, self.size, self.scale, self.half_plane = coordinates, size, scale, half_plane
        self._advance = advance
        first = np.floor(low / size - 0.5) - 1.0
        if half_plane:
            first[0] = -1.0  # a column of nodes on the other side of the axis, which are never reached
        count = np.ceil(high / size - 0.5) + 1.0 - first + 1.0
        self.origin = (first + 0.5) * size
        """The first node: nodes are at odd halves of the size, none of them on the axis."""
        self.shape = int(count[0]), int(count[1])
        self.reached: Flags = np.zeros(self.shape, dtype=np.bool_)
        self.q = np.zeros((self.shape[0] * self.shape[1], q.shape[1]))
        x, _ = coordinates.values(q)
        index = np.clip(np.round((x - self.origin) / size).astype(np.int64), 0, np.array(self.shape) - 1)
        nearest = index[:, 0] * self.shape[1] + index[:, 1]
        distance = ((x - self.places(nearest)) ** 2).sum(axis=-1)
        order = np.lexsort([np.arange(len(q)), distance, nearest])
        self._samples, self._nearest = q[order], nearest[order]
        starts = np.flatnonzero(np.diff(self._nearest, prepend=-1))
        self._rank = np.arange(len(q)) - np.repeat(starts, np.diff(np.append(starts, len(q))))
        """How many samples of the same node are nearer."""
        self._first_sample = np.full(self.shape[0] * self.shape[1], -1, dtype=np.int64)
        self._first_sample[self._nearest[starts]] = starts
        self._sample_count = np.bincount(self._nearest, minlength=self.shape[0] * self.shape[1])

    def places(self, numbers: NDArray[np.int64]) -> Array:
        """Return nodes, m, shape (N, 2)."""
        return np.asarray(self.origin + self.size * np.stack(np.divmod(numbers, self.shape[1]), axis=-1))

    def _search(self, q: Array, targets: Array, most: int = 24) -> tuple[Array, Flags]:
        allowed = targets[:, 0] >= 0.0 if self.half_plane else np.ones(len(targets), dtype=np.bool_)
        found, ok = q.copy(), np.zeros(len(q), dtype=np.bool_)
        found[allowed], ok[allowed] = reach(
            self.coordinates, q[allowed], targets[allowed], within=EXACT * self.scale, most=most
        )
        return found, ok

    def _try(self, numbers: NDArray[np.int64], starts: Array) -> NDArray[np.int64]:
        """Search nodes that are not reached yet; return those that are now."""
        flat = self.reached.ravel()
        fresh = ~flat[numbers]
        numbers, starts = numbers[fresh], starts[fresh]
        q, ok = self._search(starts, self.places(numbers))
        hits = numbers[ok]
        flat[hits] = True
        self.q[hits] = q[ok]
        self._advance(len(hits))
        return hits

    def seed(self) -> None:
        """Reach nodes from the random configurations that are nearest to them."""
        for rank in range(_SEEDS):
            these = self._rank == rank
            self._try(self._nearest[these], self._samples[these])

    def grow(self) -> None:
        """Reach nodes from their neighbours until no more are; each pair is tried once."""
        tried = np.zeros(self.reached.size, dtype=np.uint8)
        new = np.flatnonzero(self.reached.ravel())
        while len(new):
            found = []
            for bit, (di, dj) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1))):
                i, j = np.divmod(new, self.shape[1])
                inside = (i + di >= 0) & (i + di < self.shape[0]) & (j + dj >= 0) & (j + dj < self.shape[1])
                targets, starts = (new + di * self.shape[1] + dj)[inside], self.q[new[inside]]
                fresh = (tried[targets] >> bit) & 1 == 0
                tried[targets] |= np.uint8(1 << bit)
                found.append(self._try(targets[fresh], starts[fresh]))
            new = np.concatenate(found)

    def crossings(self) -> dict[tuple[int, int, int, int], tuple[Array, Array]]:
        """Return where the boundary crosses the edges of the grid: by reached and unreached node, point and q."""
        pairs = []
        for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            i, j = np.nonzero(self.reached)
            inside = (i + di >= 0) & (i + di < self.shape[0]) & (j + dj >= 0) & (j + dj < self.shape[1])
            i, j = i[inside], j[inside]
            out = ~self.reached[i + di, j + dj]
            pairs.append(np.stack([i[out], j[out], i[out] + di, j[out] + dj], axis=-1))
        ends = np.concatenate(pairs)
        inner = ends[:, 0] * self.shape[1] + ends[:, 1]
        outer = ends[:, 2] * self.shape[1] + ends[:, 3]
        points, q = self.pushed(self.q[inner], self.places(inner), self.places(outer), inner, outer)
        keys = [(int(a), int(b), int(c), int(d)) for a, b, c, d in ends]
        return {key: (points[k], q[k]) for k, key in enumerate(keys)}

    def pushed(
        self,
        q: Array,
        inner: Array,
        outer: Array,
        near: NDArray[np.int64] | None = None,
        beyond: NDArray[np.int64] | None = None,
    ) -> tuple[Array, Array]:
        """Return the farthest points towards ``outer`` that are reached from ``inner``, and configurations.

        Where one sheet of configurations ends, others may go on: samples near both nodes are tried from there, too.
        """
        share = np.zeros(len(q))
        share, q = self._bisected(share, q, inner, outer)
        for nodes in (near, beyond):
            for rank in range(_SEEDS if nodes is not None else 0):
                assert nodes is not None
                has = (self._sample_count[nodes] > rank) & (share < 1.0 - 2.0**-_BISECTIONS)
                if not has.any():
                    continue
                start = self._samples[self._first_sample[nodes[has]] + rank]
                ahead = np.minimum(share[has] + 0.02, 1.0)
                target = inner[has] + ahead[:, None] * (outer[has] - inner[has])
                found, ok = self._search(start, target)
                if ok.any():
                    which = np.flatnonzero(has)[ok]
                    share[which], q[which] = self._bisected(ahead[ok], found[ok], inner[which], outer[which])
        return inner + share[:, None] * (outer - inner), q

    def _bisected(self, share: Array, q: Array, inner: Array, outer: Array) -> tuple[Array, Array]:
        low, high, q = share.copy(), np.ones(len(share)), q.copy()
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            found, ok = self._search(q, inner + middle[:, None] * (outer - inner), most=16)
            low, high = np.where(ok, middle, low), np.where(ok, high, middle)
            q[ok] = found[ok]
        return low, q

    def center_reached(self, i: int, j: int) -> bool:
        """Return whether the middle of the cell above node i, j is reached from one of its corners."""
        corners = [(a, b) for a in (i, i + 1) for b in (j, j + 1) if self.reached[a, b]]
        numbers = np.array([a * self.shape[1] + b for a, b in corners])
        target = self.origin + self.size * (np.array([i, j]) + 0.5)
        return bool(self._search(self.q[numbers], np.repeat(target[None], len(numbers), axis=0))[1].any())

    def refined(self, points: Array, q: Array) -> Curve:
        """Return a closed curve with its pieces halved where it bends: their middles are moved onto the boundary."""
        settled = np.zeros(len(points), dtype=np.bool_)
        for _ in range(_REFINEMENTS):
            ahead = np.roll(points, -1, axis=0)
            piece = ahead - points
            length = np.hypot(*piece.T)
            open_ = ~settled & (length > 2.0 * _FLAT * self.size)
            which = np.flatnonzero(open_)
            if not len(which):
                break
            middle = 0.5 * (points[which] + ahead[which])
            outward = np.stack([piece[which, 1], -piece[which, 0]], axis=-1) / length[which, None]
            span = 0.5 * length[which, None]
            start, ok = self._search(q[which], middle)
            other, other_ok = self._search(np.roll(q, -1, axis=0)[which], middle)
            start = np.where(ok[:, None], start, other)
            inside = ok | other_ok
            # a boundary that bends inwards: begin on the inner side
            deep, deep_ok = self._search(q[which], middle - outward * span)
            begin = np.where(inside[:, None], middle, middle - outward * span)
            start = np.where(inside[:, None], start, deep)
            usable = inside | deep_ok
            settled[which[~usable]] = True
            which, begin, start = which[usable], begin[usable], start[usable]
            end, at = middle[usable] + (outward * 2.0 * span)[usable], middle[usable]
            if self.half_plane and len(end):
                leftwards = end[:, 0] < 0.0
                cut = np.where(leftwards, begin[:, 0] / np.maximum(begin[:, 0] - end[:, 0], 1e-300), 1.0)
                end = begin + cut[:, None] * (end - begin)
            moved, moved_q = self.pushed(start, begin, end)
            offset = np.hypot(*(moved - at).T)
            bends = (offset > _FLAT * self.size) & (offset < 1.96 * span[usable][:, 0])
            settled[which[~bends]] = True
            keep = which[bends]
            if not len(keep):
                break
            points = np.insert(points, keep + 1, moved[bends], axis=0)
            q = np.insert(q, keep + 1, moved_q[bends], axis=0)
            settled = np.insert(settled, keep + 1, False)
        return Curve(points=read_only(points), q=read_only(q))


def _linked(
    reached: Flags,
    ends: dict[tuple[int, int, int, int], tuple[Array, Array]],
    center_reached: Callable[[int, int], bool],
) -> list[tuple[Array, Array]]:
    """Link crossings of edges to closed curves with what is reached on their left: marching squares.

    Source: W. E. Lorensen, H. E. Cline, Marching Cubes, SIGGRAPH 1987, in two dimensions; the two ways through a cell
    with opposite corners reached are told apart by its centre.
    """
    after: dict[tuple[int, int, int, int], tuple[int, int, int, int]] = {}
    cells = {
        (i, j)
        for a, b, c, d in ends
        for i in (min(a, c) - (a == c), min(a, c))
        for j in (min(b, d) - (b == d), min(b, d))
    }
    for i, j in sorted(cells):
        if not (0 <= i < reached.shape[0] - 1 and 0 <= j < reached.shape[1] - 1):
            continue
        ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]  # counter-clockwise
        inside = [bool(reached[corner]) for corner in ring]
        leaves = [k for k in range(4) if inside[k] and not inside[(k + 1) % 4]]
        enters = [k for k in range(4) if not inside[k] and inside[(k + 1) % 4]]
        if not leaves:
            continue
        joined = len(leaves) == 2 and center_reached(i, j)
        for k in leaves:
            # the curve enters the cell where the ring leaves the region, and what is reached stays on its left
            order = [(k + step) % 4 for step in range(1, 4)]
            into = next(e for e in (order if joined else order[::-1]) if e in enters)
            start = (*ring[k], *ring[(k + 1) % 4])
            stop = (*ring[(into + 1) % 4], *ring[into])
            after[start] = stop
    loops = []
    while after:
        key = next(iter(after))
        chain = [key]
        following = after.pop(key)
        while following != chain[0] and following in after:
            chain.append(following)
            following = after.pop(following)
        loops.append((np.stack([ends[k][0] for k in chain]), np.stack([ends[k][1] for k in chain])))
    return loops
