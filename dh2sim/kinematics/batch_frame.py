"""A frame's pose in base_link for a block of configurations, one array a component.

Most components of a robot's first frames, and of its constant transforms, are 0 or 1. A component that is the
same in all configurations is kept as a float; multiplying by 0 or 1 and adding 0 cost nothing, and a column
changes its sign for free. On large arrays this is ten times as fast as a stack of 4x4 matrix products.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final, TypeAlias

import numpy as np

from dh2sim.typing import Array

Component: TypeAlias = float | Array
"""One number of a pose: a float where it is the same in every configuration, else shape (N,)."""
Column: TypeAlias = tuple[Component, Component, Component]

BLOCK = 8192
"""Configurations in a block: many enough to hide the cost of a call, few enough for the processor's cache."""
_KEPT: Final = 2**25 - 2**16
"""Size of an array, bytes: just below the largest that glibc learns from."""


@cache
def keep_freed_memory() -> None:
    """Let the C library keep memory that blocks free, once for this process.

    A block's components come and go at the end of the heap. glibc gives that end back to the system when 128 kB are
    free, and each block then pays for fresh pages what it pays for its computation, or twice as much. When a larger
    array is freed, glibc raises that limit to twice its size: mallopt(3), M_MMAP_THRESHOLD. Nothing is written to the
    array, so that it takes no memory; with other C libraries it has no effect.
    """
    np.empty(_KEPT, dtype=np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlockFrame:
    """Pose of a frame in base_link for N configurations: axes x, y, z, each times its sign, and origin p."""

    x: Column = (1.0, 0.0, 0.0)
    y: Column = (0.0, 1.0, 0.0)
    z: Column = (0.0, 0.0, 1.0)
    p: Column = (0.0, 0.0, 0.0)
    signs: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def then(self, T: Array) -> BlockFrame:
        """Return the frame that has the constant pose ``T``, shape (4, 4), in this one."""
        rows = [[sign * factor for factor in row] for sign, row in zip(self.signs, T[:3].tolist(), strict=True)]
        factors = list(zip(*rows, strict=True))
        (x, x_sign), (y, y_sign), (z, z_sign) = (self._axis(factor) for factor in factors[:3])
        p = self._sum(factors[3], self.p)
        return BlockFrame(x=x, y=y, z=z, p=p, signs=(x_sign, y_sign, z_sign))

    def turned(self, sine: Array, cosine: Array, sign: float) -> BlockFrame:
        """Return the frame turned about its own z; ``sine`` is to be multiplied by ``sign``."""
        x_sign, y_sign, _ = self.signs
        add, subtract = (_plus, _minus) if sign * x_sign * y_sign > 0.0 else (_minus, _plus)
        x = tuple(add(_times(a, cosine), _times(b, sine)) for a, b in zip(self.x, self.y, strict=True))
        y = tuple(subtract(_times(b, cosine), _times(a, sine)) for a, b in zip(self.x, self.y, strict=True))
        return BlockFrame(x=_column(x), y=_column(y), z=self.z, p=self.p, signs=self.signs)

    def slid(self, distance: Array, sign: float) -> BlockFrame:
        """Return the frame moved along its own z; ``distance``, m, is to be multiplied by ``sign``."""
        add = _plus if sign * self.signs[2] > 0.0 else _minus
        p = tuple(add(a, _times(b, distance)) for a, b in zip(self.p, self.z, strict=True))
        return BlockFrame(x=self.x, y=self.y, z=self.z, p=_column(p), signs=self.signs)

    def write(self, out: Array) -> None:
        """Put the poses into ``out``, shape (N, 4, 4), or (N, 3, 4) for those without their last row."""
        columns = ((self.x, self.signs[0]), (self.y, self.signs[1]), (self.z, self.signs[2]), (self.p, 1.0))
        for j, (column, sign) in enumerate(columns):
            write_column(column, sign, out[:, :3, j])
            if out.shape[1] == 4:
                out[:, 3, j] = 1.0 if j == 3 else 0.0

    def _axis(self, factors: Sequence[float]) -> tuple[Column, float]:
        """Combine the axes; an axis that stays one of them, or its opposite, is passed on with its sign."""
        for axis, factor in zip((self.x, self.y, self.z), factors, strict=True):
            if abs(factor) == 1.0 and sum(map(abs, factors)) == 1.0:
                return axis, factor
        return self._sum(factors, (0.0, 0.0, 0.0)), 1.0

    def _sum(self, factors: Sequence[float], start: Column) -> Column:
        """Return start + x·factors[0] + y·factors[1] + z·factors[2]."""
        total = list(start)
        for axis, factor in zip((self.x, self.y, self.z), factors, strict=True):
            if factor != 0.0:
                total = [_plus(a, _times(b, factor)) for a, b in zip(total, axis, strict=True)]
        return _column(total)


def write_column(column: Column, sign: float, out: Array) -> None:
    """Put ``sign`` times the column into ``out``, shape (N, 3)."""
    for i, component in enumerate(column):
        if sign > 0.0:
            out[:, i] = component
        elif isinstance(component, float):
            out[:, i] = 0.0 - component
        else:
            np.negative(component, out=out[:, i])


def sines_and_cosines(angles: Array) -> tuple[Array, Array]:
    """Return sine and cosine of ``angles``, rad, each of their shape, to within about 4e-16.

    With t = tan(angle/2): sin = 2t/(1 + t²) and cos = (1 - t²)/(1 + t²). NumPy's tangent alone is faster than
    its sine and its cosine together, several times so on processors with AVX-512.
    """
    t = np.tan(0.5 * angles)
    squared = t * t
    scale = 1.0 / (1.0 + squared)
    return (t + t) * scale, (1.0 - squared) * scale


def difference(a: Column, b: Column) -> Column:
    """Return a - b."""
    return _minus(a[0], b[0]), _minus(a[1], b[1]), _minus(a[2], b[2])


def cross(a: Column, b: Column) -> Column:
    """Return the cross product a x b."""
    return (
        _minus(_times(a[1], b[2]), _times(a[2], b[1])),
        _minus(_times(a[2], b[0]), _times(a[0], b[2])),
        _minus(_times(a[0], b[1]), _times(a[1], b[0])),
    )


def _column(components: list[Component] | tuple[Component, ...]) -> Column:
    x, y, z = components
    return x, y, z


def _times(a: Component, b: Component) -> Component:
    if isinstance(a, float):
        a, b = b, a
    if isinstance(b, float):
        if b == 0.0:
            return 0.0
        if b == 1.0:
            return a
    return a * b


def _plus(a: Component, b: Component) -> Component:
    if isinstance(a, float) and a == 0.0:
        return b
    if isinstance(b, float) and b == 0.0:
        return a
    return a + b


def _minus(a: Component, b: Component) -> Component:
    if isinstance(b, float) and b == 0.0:
        return a
    if isinstance(a, float) and a == 0.0:
        return -b
    return a - b
