"""Poses of every frame, engine by engine, against the textbook product of the table."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from dh2sim.engines.engine import PoseEngine
from dh2sim.kinematics.comparison import pose_errors
from dh2sim.kinematics.table import table_frame_poses, table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.validate.report import Check, Quantity, Worst

CHUNK_NUMBERS = 2**19
"""How many doubles of poses are compared at a time: they stay in the cache."""


def check_poses(
    engine: PoseEngine,
    spec: RobotSpec,
    q: Array,
    tolerance: float,
    reach: float,
    *,
    threads: int = 1,
    advance: Callable[[int], None] | None = None,
) -> Check:
    """Compare an engine's frames with the table's.

    Args:
        engine: the engine.
        spec: the robot, whose table is the truth.
        q: joint vectors, rad and m, shape (N, n).
        tolerance: allowed angle, rad, and distance as a share of max(1 m, reach).
        reach: m.
        threads: how many chunks are compared at once; 0 for one a processor. The engine must allow for it.
        advance: told after each chunk how many configurations are done with.

    Returns:
        The check; of several equally bad errors the first is named.
    """
    started = time.perf_counter()
    size = max(1, CHUNK_NUMBERS // (16 * len(engine.frames)))
    scale = max(1.0, reach)

    def compare(start: int) -> tuple[float, float, float, int, int]:
        part = q[start : start + size]
        with np.errstate(all="ignore"):  # a file may hold anything; what is not finite fails
            position, rotation = pose_errors(engine.frame_poses(part), _reference(spec, part, engine.frames))
            badness = np.maximum(position / scale, rotation)
        # a NaN is worse than any number: argmax finds it, and no comparison with a tolerance holds for it
        worst = int(np.argmax(badness))
        sample, frame = divmod(worst, len(engine.frames))
        if advance is not None:
            advance(len(part))
        return (
            float(np.max(position)),
            float(np.max(rotation)),
            float(badness.flat[worst]),
            start + sample,
            frame,
        )

    starts = range(0, len(q), size)
    workers = threads or os.cpu_count() or 1
    if workers > 1 and len(starts) > 1:
        with ThreadPoolExecutor(workers) as pool:
            results = list(pool.map(compare, starts))
    else:
        results = [compare(start) for start in starts]
    position = float(np.max([result[0] for result in results]))
    rotation = float(np.max([result[1] for result in results]))
    worst = results[int(np.argmax([result[2] for result in results]))]
    return Check(
        engine=engine.name,
        quantity=Quantity.POSE,
        ok=bool(position <= tolerance * scale and rotation <= tolerance),
        samples=len(q),
        frames=len(engine.frames),
        max_position_error=position,
        max_rotation_error=rotation,
        tolerance=tolerance,
        worst=Worst(where=engine.frames[worst[4]], q=tuple(q[worst[3]].tolist()), sample=worst[3]),
        seconds=time.perf_counter() - started,
    )


def _reference(spec: RobotSpec, q: Array, frames: Sequence[str]) -> Array:
    tool = table_tool_pose(spec, q)[:, None]
    return tool if len(frames) == 1 else np.concatenate([table_frame_poses(spec, q), tool], axis=1)
