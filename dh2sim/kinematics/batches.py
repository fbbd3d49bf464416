"""How results for many joint vectors are computed: where they are put, in blocks, by threads, by which backend."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import repeat
from typing import Final, Literal, TypeAlias, TypedDict

import numpy as np

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.batch_frame import BLOCK, keep_freed_memory
from dh2sim.kinematics.straight_line import JACOBIAN, Kind
from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.processors import available_processors
from dh2sim.typing import Array

THREADED: Final = 200_000
"""Joint vectors from which on threads are started; for fewer, starting them costs more than is gained."""
_BLOCKS: Final = 8
"""Blocks that a thread computes at once. Python runs one thread at a time, between the calls of NumPy; calls for one
block are so short that two threads which wait for each other take twice as long as one."""
_FEW_BLOCKS: Final = 4
"""Blocks at once for which NumPy's calls are too short for threads."""
_JOINTS: Final = 64
"""Blocks at once times joints: bounds the memory of a thread."""
Kernel: TypeAlias = Callable[[Array, Array], bool]
"""Fills results, shape (N, numbers of one), from joint vectors, shape (N, n); False where a coordinate is too large
or not finite."""
Fill: TypeAlias = Callable[[Array, Array], None]
"""Fills the results of a block, shape (N, *shape of one), from its joint coordinates."""


class JacobianOptions(TypedDict, total=False):
    """How Jacobians are computed."""

    out: Array | None
    """Takes the result: an array of doubles of the result's shape, which is returned; by default a new one."""
    threads: int
    """Number of threads for 200 000 joint vectors and more; 0: as many as there are processors for this process. The
    bits do not depend on it. NumPy takes one for robots of more than 16 joints. Default 1."""
    backend: Literal["numpy", "numba"]
    """numba: batches are computed by code that is compiled for the robot, about seven times as fast; the last bits
    differ. Needs the extra ``fast``. Default numpy."""


class BatchOptions(JacobianOptions, total=False):
    """How poses are computed."""

    rows: Literal[3, 4]
    """3 leaves out the last row of each pose, which is 0 0 0 1. Default 4."""


def checked_options(kind: Kind, options: BatchOptions | JacobianOptions) -> tuple[Array | None, int, int, bool]:
    """Return ``out``, the rows of one result, the number of threads, and whether Numba is to be used.

    Raises:
        ConfigurationError: An option is unknown, or has a value that is not allowed.
    """
    names = ["out", "threads", *([] if kind is JACOBIAN else ["rows"]), "backend"]
    for name in options:
        if name not in names:
            raise TypeError(f"unknown option {shown(name)}.{did_you_mean(name, names)} Options: {listed(names)}")
    rows: object = options.get("rows", kind.rows)
    if not isinstance(rows, int | np.integer) or rows not in (3, 4, kind.rows):
        raise ConfigurationError(f"rows must be 3 or 4, got {rows!r}")
    backend: object = options.get("backend", "numpy")
    if backend not in ("numpy", "numba"):
        raise ConfigurationError(f"backend must be 'numpy' or 'numba', got {backend!r}")
    return options.get("out"), int(rows), thread_count(options.get("threads", 1)), backend == "numba"


def thread_count(threads: int) -> int:
    """Return a number of threads: that of the processors this process may use in place of 0.

    Raises:
        ConfigurationError: It is not a whole number, or negative.
    """
    if isinstance(threads, bool) or not isinstance(threads, int | np.integer) or threads < 0:
        raise ConfigurationError(f"threads must be a whole number, 0 for all processors, got {threads!r}")
    if threads:
        return int(threads)
    return available_processors()


def require_shape(out: Array, shape: tuple[int, ...]) -> Array:
    """Return an array that is to take a result.

    Raises:
        ConfigurationError: It is not an array of doubles of this shape, or cannot be written to.
    """
    if not isinstance(out, np.ndarray):
        raise ConfigurationError(f"out must be an array of float64 of shape {shape}, got {type(out).__name__}")
    if out.shape != shape or out.dtype != np.float64 or not out.dtype.isnative:
        raise ConfigurationError(
            f"out must be an array of float64 of shape {shape}, got one of {out.dtype} of shape {out.shape}"
        )
    if not out.flags.writeable:
        raise ConfigurationError("out must be an array that can be written to")
    return out


def in_blocks(
    vectors: Array,
    batch: tuple[int, ...],
    shape: tuple[int, ...],
    fill: Fill,
    out: Array | None = None,
    threads: int = 1,
    kernel: Kernel | None = None,
) -> Array:
    """Compute something of ``shape`` for every joint vector, a block at a time.

    Args:
        vectors: Joint vectors, checked, shape (count, n).
        batch: Shape whose product is count.
        shape: Shape of one result.
        fill: Called with the results of a block, shape (N, *shape), to be filled, and its joint
            coordinates, shape (n, N).
        out: Takes the result, shape (*batch, *shape); by default a new array.
        threads: Number of threads, or 0; blocks are the same for any number.
        kernel: Does the same by compiled code, where coordinates are not too large for it.

    Returns:
        Shape (*batch, *shape).

    Raises:
        ConfigurationError: ``out`` has another shape or type, or ``threads`` is negative.
    """
    count, threads = len(vectors), thread_count(threads)
    if out is not None:
        require_shape(out, (*batch, *shape))
        if np.may_share_memory(out, vectors):
            vectors = vectors.copy()
    direct = out is not None and out.flags.c_contiguous
    results = out.reshape(count, *shape) if out is not None and direct else np.empty((count, *shape))

    def compute(start: int, blocks: int = 1) -> None:
        part = slice(start, min(start + blocks * BLOCK, count))
        if kernel is not None:
            flat = results[part].reshape(-1, math.prod(shape))
            if kernel(np.ascontiguousarray(vectors[part]), flat):
                return
            if blocks > 1:  # as for one thread: only the blocks with a large coordinate are left to NumPy
                for first in range(start, part.stop, BLOCK):
                    compute(first)
                return
        fill(results[part], np.ascontiguousarray(vectors[part].T))

    keep_freed_memory()
    at_once = max(1, min(_BLOCKS, _JOINTS // max(1, vectors.shape[1])))
    if threads == 1 or count < THREADED or (kernel is None and at_once < _FEW_BLOCKS):
        for start in range(0, count, BLOCK):
            compute(start)
    else:
        from concurrent.futures import ThreadPoolExecutor

        blocks = math.ceil(count / BLOCK)
        at_once = math.ceil(blocks / math.ceil(blocks / at_once))  # all alike
        starts = range(0, count, at_once * BLOCK)
        with ThreadPoolExecutor(min(threads, len(starts))) as pool:
            list(pool.map(compute, starts, repeat(at_once)))
    if out is None:
        return results.reshape(*batch, *shape)
    if not direct:
        out[...] = results.reshape(*batch, *shape)
    return out
