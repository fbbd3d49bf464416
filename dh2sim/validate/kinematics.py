"""Kinematics: poses and Jacobians of every engine against the table, and the quaternions of an MJCF.

Poses are compared with the textbook product of the table. The library's Jacobian is compared with central differences
of that product, and other engines' Jacobians with the library's.
"""

from __future__ import annotations

import math
import os
import time
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Protocol

import numpy as np

from dh2sim.engines.engine import PoseEngine
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import forward_kinematics, frame_poses, geometric_jacobian
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.progress import Advance
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.validate.report import Check, Quantity, Worst

QUATERNION_TOLERANCE = 1e-12
"""Of the length."""


def check_unit_quaternions(path: Path) -> Check:
    """Check that every quaternion in a file has length 1; engines normalize them without a word."""
    try:
        elements = list(ET.parse(path).iter())
    except ET.ParseError as error:
        return _quaternion_check(False, reason=f"{path}: is not well-formed XML, although MuJoCo reads it: {error}")
    errors: list[tuple[float, str]] = []
    for element in elements:
        text = element.get("quat")
        if text is None:
            continue
        name = f"{element.tag} {element.get('name', '')}".strip()
        try:
            errors.append((abs(math.hypot(*map(float, text.split())) - 1.0), name))
        except ValueError:
            return _quaternion_check(False, reason=f"{path}: the quaternion of {name} must be a list of numbers")
    worst, where = max(errors, key=lambda error: math.inf if math.isnan(error[0]) else error[0], default=(0.0, ""))
    return _quaternion_check(worst <= QUATERNION_TOLERANCE, worst=worst, where=where)


def _quaternion_check(ok: bool, *, worst: float | None = None, where: str = "", reason: str | None = None) -> Check:
    return Check(
        engine="mjcf-file",
        quantity=Quantity.UNIT_QUATERNIONS,
        ok=ok,
        reference="1",
        max_error=worst,
        tolerance=QUATERNION_TOLERANCE,
        reason=reason,
        worst=Worst(where=where, q=()),
    )


class LibraryEngine:
    """dh2sim's kinematics, of the chain that the writers use."""

    name = "dh2sim"

    def __init__(self, chain: KinematicChain) -> None:
        """Compute with a chain."""
        self._chain = chain
        self.frames = (*(f"dh_{i}" for i in range(len(chain.joints) + 1)), "tool0")

    def frame_poses(self, q: Array) -> Array:
        """Return the poses of all frames in base_link, shape (N, frames, 4, 4); q of shape (N, n)."""
        return np.concatenate([frame_poses(self._chain, q), forward_kinematics(self._chain, q)[:, None]], axis=1)

    def jacobian(self, q: Array) -> Array:
        """Return the geometric Jacobian of tool0 in base_link, shape (N, 6, n); q of shape (N, n)."""
        return geometric_jacobian(self._chain, q)


CHUNK_NUMBERS = 2**19
"""Doubles of poses that are compared at a time, so that they stay in the cache."""


def check_poses(
    engine: PoseEngine,
    spec: RobotSpec,
    q: Array,
    tolerance: float,
    extent: float,
    *,
    threads: int = 1,
    advance: Advance | None = None,
) -> Check:
    """Compare an engine's frames with the table's.

    Args:
        engine: The engine.
        spec: The robot, whose table is the reference.
        q: Joint vectors, rad and m, shape (N, n).
        tolerance: Allowed angle, rad, and distance as a share of max(1 m, extent).
        extent: Of the frames from base_link, m.
        threads: Number of chunks that are compared at once; 0: one for each processor; the engine must allow it.
        advance: Called after each chunk with the number of configurations in it.

    Returns:
        The check; it names the first of several equally bad errors.
    """
    started = time.perf_counter()
    size = max(1, CHUNK_NUMBERS // (16 * len(engine.frames)))
    scale = max(1.0, extent)

    def compare(start: int) -> tuple[float, float, float, int, int]:
        part = q[start : start + size]
        with np.errstate(all="ignore"):  # a file may contain anything; what is not finite fails
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


DIFFERENCE_STEP = 1e-5
"""rad or m; rounding and truncation are then both about 1e-11 of the extent."""
DIFFERENCE_TOLERANCE = 1e-8
"""Of the Jacobian by differences; multiplied by the extent for its linear part."""


class JacobianEngine(Protocol):
    """An engine with a Jacobian."""

    name: str

    def jacobian(self, q: Array) -> Array:
        """Return the geometric Jacobian of tool0, linear rows first, shape (N, 6, n); q of shape (N, n)."""
        ...


def table_jacobian(spec: RobotSpec, q: Array) -> Array:
    """Return the geometric Jacobian of tool0 by central differences of the table's product.

    Args:
        spec: The robot.
        q: Joint vectors, rad and m, shape (N, n).

    Returns:
        Shape (N, 6, n). The angular part is the skew part of (R(q + h) - R(q - h)) / 2h · R(q)ᵀ.
    """
    n = q.shape[1]
    R = table_tool_pose(spec, q)[:, :3, :3]
    result = np.zeros((len(q), 6, n))
    for j in range(n):
        step = np.zeros(n)
        step[j] = DIFFERENCE_STEP
        change = (table_tool_pose(spec, q + step) - table_tool_pose(spec, q - step)) / (2 * DIFFERENCE_STEP)
        spin = change[:, :3, :3] @ R.transpose(0, 2, 1)
        result[:, :3, j] = change[:, :3, 3]
        result[:, 3, j] = 0.5 * (spin[:, 2, 1] - spin[:, 1, 2])
        result[:, 4, j] = 0.5 * (spin[:, 0, 2] - spin[:, 2, 0])
        result[:, 5, j] = 0.5 * (spin[:, 1, 0] - spin[:, 0, 1])
    return result


def check_jacobian(
    engine: JacobianEngine,
    reference: Array,
    q: Array,
    tolerance: float,
    extent: float,
    joints: Sequence[str],
    *,
    differences: bool = False,
) -> Check:
    """Compare an engine's Jacobian with a reference of shape (N, 6, n).

    Args:
        engine: The engine.
        reference: The Jacobians to compare with.
        q: Joint vectors, rad and m, shape (N, n).
        tolerance: Allowed error of an angular entry, and of a linear one as a share of max(1 m, extent).
        extent: Of the frames from base_link, m.
        joints: Names of the n joints, for the report.
        differences: Whether the reference was computed by central differences.
    """
    error = np.abs(engine.jacobian(q) - reference)
    error[:, :3] /= max(1.0, extent)
    by_joint = error.max(axis=1)  # (N, n)
    worst, joint = divmod(int(np.argmax(by_joint)), len(joints))  # a NaN is worse than any number
    largest = float(by_joint[worst, joint])
    return Check(
        engine=engine.name,
        quantity=Quantity.JACOBIAN,
        ok=bool(largest <= tolerance),
        reference="central differences" if differences else "dh2sim",
        samples=len(q),
        max_error=largest,
        tolerance=tolerance,
        worst=Worst(where=joints[joint], q=tuple(q[worst].tolist()), sample=worst),
    )
