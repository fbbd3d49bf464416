"""The workspace of a robot: what a frame's origin reaches inside the joints' limits."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, TypedDict

import numpy as np

from dh2sim.errors import ConfigurationError, SettingsError
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.model.build import model_of
from dh2sim.model.robot_model import RobotModel
from dh2sim.progress import Stage, silent
from dh2sim.robot.spec import SpecLike
from dh2sim.typing import Array, read_only
from dh2sim.workspace.dexterity import Dexterity, Turn, dexterity_at
from dh2sim.workspace.extremes import Extreme, distance_from, extreme_of, greatest, height_along, least
from dh2sim.workspace.point import InBasis, PointMap, motion_rank
from dh2sim.workspace.section import Section, around_first_axis, planar_section, turned_section
from dh2sim.workspace.voxels import Measure, draw_voxels, grid_around, grow_voxels, spanned

USUAL: Final = 100_000
"""Voxels of the box around the workspace, at most, where no size is given: configurations fill most of them."""
ACROSS: Final = 100
"""Of them along its longest side, at most: those of a plane are fewer, and their section is finer anyway."""
_ROUND: Final = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
SAMPLES: Final = 200_000
ORIENTATIONS: Final = 24
MOST_SAMPLES: Final = 100_000_000
MOST_JOINTS: Final = 30
"""That move the point: the work grows with the third power of their number."""
MOST_POSES: Final = 2_000_000
"""Of inverse kinematics, half a millisecond each."""
MOST_NODES: Final = 1_000_000
"""Of the grid of a section."""
FINER: Final = 4
"""Nodes of a section are so many times as close as voxels."""
_SPREAD: Final = 4096
"""Random configurations that searches of extremes start from."""


class WorkspaceKeywords(TypedDict, total=False):
    """Arguments of :func:`compute_workspace`."""

    frame: str
    size: float | None
    samples: int
    seed: int
    threads: int
    section: bool
    dexterity: bool
    orientations: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Workspace:
    """What the origin of a frame reaches inside the limits."""

    robot: str
    frame: str
    joints: tuple[str, ...]
    """Names of all joints, in the order of joint vectors."""
    turning: tuple[bool, ...]
    """Which of them turn."""
    dimension: int
    """3 where the point fills space, 2 a surface or a plane, 1 a curve or a line, 0 where it does not move."""
    axes: Array = field(repr=False)
    """Axes of the space, plane or line that the point stays in, in base_link, unit vectors, shape (k, 3)."""
    origin: Array = field(repr=False)
    """Where all coordinates along the axes are zero, in base_link, m, shape (3,)."""
    size: float
    """Edge of the voxels, m."""
    samples: int
    seed: int
    centers: Array = field(repr=False)
    """Centres of the voxels that are reached, in base_link, m, shape (N, 3)."""
    count: Array = field(repr=False)
    """How many of the random configurations reach each, shape (N,); 0 where a search got there alone."""
    manipulability: Array = field(repr=False)
    """Best manipulability of the configurations found in each, shape (N,)."""
    q: Array = field(repr=False)
    """The configuration that has it, rad and m, shape (N, n)."""
    measure: str
    """'pose' where manipulability is that of the whole frame, as of ``Robot.manipulability``; 'position' where it is
    that of its origin alone, since fewer than six joints move it, or not in all ways."""
    extremes: Mapping[str, Extreme]
    """``farthest`` and ``nearest`` from base_link's origin, ``highest`` and ``lowest`` along its z; where the first
    joint turns, ``outermost`` and ``innermost`` from its axis."""
    section: Section | None
    dexterity: Dexterity | None
    """Shares for the voxels, in their order."""
    notes: tuple[str, ...]
    """What was assumed, one sentence each."""

    def __repr__(self) -> str:
        size = f"{self.volume:.4g} m³" if self.volume is not None else f"{self.area:.4g} m²" if self.area else "flat"
        farthest = self.extremes.get("farthest")
        far = "" if farthest is None else f", at most {farthest.value:.4g} m away"
        return f"<Workspace of '{self.robot}', {self.frame}: {size}{far}>"

    @property
    def volume(self) -> float | None:
        """m³: the section's where there is one, else that of all voxels, also at the boundary; None if flat."""
        if self.dimension < 3:
            return None
        if self.section is not None and self.section.volume is not None:
            return self.section.volume
        return len(self.centers) * self.size**3

    @property
    def area(self) -> float | None:
        """m², of what a planar arm reaches in its plane: the section's, else of all its cells; None if not flat."""
        if not (self.dimension == len(self.axes) == 2):
            return None
        return len(self.centers) * self.size**2 if self.section is None else self.section.area


def compute_workspace(
    robot: SpecLike,
    *,
    frame: str = "tool0",
    size: float | None = None,
    samples: int = SAMPLES,
    seed: int = 0,
    threads: int = 0,
    section: bool = False,
    dexterity: bool = False,
    orientations: int = ORIENTATIONS,
    stage: Stage = silent,
) -> Workspace:
    """Return what the origin of a frame reaches inside the limits.

    Random configurations fill voxels; searches from each voxel to its neighbours complete them. Results do not depend
    on the number of threads.

    Args:
        robot: The robot, in any form.
        frame: tool0, dh_0 … dh_n or link_1 … link_n.
        size: Edge of the voxels, m; by default the least round number with which the box around the workspace has at
            most 100 000 voxels, and 100 along each side: 0.04 for an arm that reaches 0.9 m.
        samples: Number of random configurations.
        seed: Of them.
        threads: Number of threads; 0: one for each processor.
        section: Whether to find the section and its boundary: in r and z of an arm whose first joint turns, in its
            plane of a planar arm.
        dexterity: Whether to find the share of orientations in which each voxel's centre is reached.
        orientations: How many to ask for.
        stage: Shows progress.

    Raises:
        SettingsError: An argument is wrong, or asks for too much; the text says what would do.
        UnknownFrameError: There is no such frame.
        ConfigurationError: The arm has no section, no choice of orientations, or more than ``MOST_JOINTS`` joints.
    """
    model = model_of(robot)
    spec, chain = model.spec, model.chain
    _check(size=1.0 if size is None else size, samples=samples, seed=seed, threads=threads, orientations=orientations)
    if dexterity and frame != "tool0":
        raise SettingsError([("dexterity", f"is that of tool0, not of {frame}")])
    workers = threads or os.cpu_count() or 1
    point = PointMap(chain, frame, [joint.travel for joint in model.moving_joints], model.home, model.extent)
    if len(point.joints) > MOST_JOINTS:
        moving = len(point.joints)
        raise ConfigurationError(
            f"{spec.name}: {moving} joints move {frame}; workspaces are found for at most {MOST_JOINTS}. Take a "
            "frame nearer to the base, or fix joints"
        )
    names = tuple(joint.name for joint in model.moving_joints)
    q = random_configurations(point.sample_low, point.sample_high, _SPREAD, [seed, 2])
    p = point.positions(q)
    axes, origin = spanned(p, point.size)
    if section:
        _require_section(spec.name, point, len(axes), names)
    along_axes = InBasis(point, axes, origin)
    box = [
        [float((greatest(point, turned(height_along(axis)), q, p)[1] - origin) @ axis) for axis in axes]
        for turned in (least, lambda objective: objective)
    ]
    low, high = (np.array(side, dtype=np.float64) for side in box)
    if size is None:
        size = _usual_size(high - low)
    shape = {3: "voxels", 2: "cells", 1: "pieces"}[len(axes)]
    grid = grid_around(low, high, size, shape)
    if section:
        _require_nodes(low, high, size)
    measure = Measure(point, along_axes)
    with stage("sampling", "configurations", samples) as advance:
        voxels = draw_voxels(point, measure, grid, samples, seed, workers, advance)
    with stage("completing", shape, math.prod(grid.shape) - len(voxels)) as advance:
        voxels = grow_voxels(voxels, measure, along_axes, workers, advance)
    places = grid.centers(voxels.numbers)
    centers = np.repeat(origin[None], len(voxels), axis=0)
    for axis, coordinate in zip(axes, places.T, strict=True):
        centers = centers + coordinate[:, None] * axis
    found_section = None
    if section:
        fine = size / FINER
        with stage("section", "nodes", int(np.prod((high - low) / fine + 2.0))) as advance:
            if len(axes) == 3:
                found_section = turned_section(point, names, fine, seed, advance)
            else:
                found_section = planar_section(point, axes, origin, fine, seed, advance)
    shares = _dexterity(model, point, centers, size, orientations, stage) if dexterity else None
    return Workspace(
        robot=spec.name,
        frame=frame,
        joints=names,
        turning=tuple(joint.type.turns for joint in model.moving_joints),
        dimension=motion_rank(point.J_trials),
        axes=read_only(axes),
        origin=read_only(origin),
        size=size,
        samples=samples,
        seed=seed,
        centers=read_only(centers),
        count=read_only(voxels.count),
        manipulability=read_only(voxels.manipulability),
        q=read_only(point.full(voxels.q)),
        measure="pose" if measure.whole else "position",
        extremes=_extremes(point, q, p),
        section=found_section,
        dexterity=shares,
        notes=_notes(model, point),
    )


def _usual_size(extent: Array) -> float:
    """Return the least round edge of voxels, m, with which a box, shape (k,), keeps ``USUAL`` and ``ACROSS``."""
    finest = float(extent.max()) / ACROSS
    decade = 10.0 ** math.floor(math.log10(finest)) if finest > 0.0 else 0.01
    sizes = (decade * 10.0**power * step for power in range(4) for step in _ROUND)
    return next(
        float(f"{size:.3g}")
        for size in sizes
        if size >= finest * (1.0 - 1e-9) and np.prod(extent / size + 1.0) <= USUAL
    )


def _check(*, size: float, samples: int, seed: int, threads: int, orientations: int) -> None:
    problems = []
    if not (isinstance(size, int | float) and math.isfinite(size) and size > 0.0):
        problems.append(("size", f"must be a length above 0, in m, got {size!r}"))
    for name, value, most in (
        ("samples", samples, MOST_SAMPLES),
        ("orientations", orientations, 10_000),
    ):
        if not (isinstance(value, int | np.integer) and 1 <= value <= most):
            problems.append((name, f"must be a whole number from 1 to {most:,}, got {value!r}"))
    for name, value in (("seed", seed), ("threads", threads)):
        if not (isinstance(value, int | np.integer) and value >= 0):
            problems.append((name, f"must be a whole number of at least 0, got {value!r}"))
    if problems:
        raise SettingsError(problems)


def _require_section(name: str, point: PointMap, dimension: int, names: tuple[str, ...]) -> None:
    if dimension == 3 and not point.first_turns:
        first = names[point.joints[0]]
        raise ConfigurationError(
            f"{name} has no section in r and z: its first joint, {first}, slides; its voxels show what it reaches"
        )
    if dimension < 2:
        what = "moves along a line" if point.joints else "does not move"
        raise ConfigurationError(f"{name} has no section: {point.frame} {what}")


def _require_nodes(low: Array, high: Array, size: float) -> None:
    extent = high - low
    if len(extent) == 3:
        extent = np.array([0.5 * extent.max(), extent.max()])
    if not np.prod(extent / (size / FINER) + 4.0) <= MOST_NODES:
        enough = FINER * math.sqrt(float(np.prod(extent)) / MOST_NODES)
        digits = 10.0 ** (math.floor(math.log10(enough)) - 1)
        enough = math.ceil(1.1 * enough / digits) * digits
        raise SettingsError(
            [("size", f"of {size:g} m would need more than {MOST_NODES:,} nodes of the section; use {enough:g} m")]
        )


def _extremes(point: PointMap, q: Array, p: Array) -> dict[str, Extreme]:
    z = np.array([0.0, 0.0, 1.0])
    zero = np.zeros(3)

    def distance(place: Array) -> float:
        return math.hypot(*place.tolist())

    def height(place: Array) -> float:
        return float(place[2])

    found = {
        "farthest": extreme_of(point, distance_from(zero), q, p, distance),
        "nearest": extreme_of(point, least(distance_from(zero)), q, p, distance),
        "highest": extreme_of(point, height_along(z), q, p, height),
        "lowest": extreme_of(point, least(height_along(z)), q, p, height),
    }
    if point.first_turns:
        around = around_first_axis(point)
        objective = distance_from(around.origin, around.direction)

        def radius(place: Array) -> float:
            return float(around.section_of_points(place[None])[0, 0])

        found["outermost"] = extreme_of(point, objective, q, p, radius)
        found["innermost"] = extreme_of(point, least(objective), q, p, radius)
    return found


def _notes(model: RobotModel, point: PointMap) -> tuple[str, ...]:
    notes = []
    for index in point.joints:
        joint = model.moving_joints[index]
        row = model.spec.moving_rows[index]
        if row.limits.position is None and not joint.type.turns:
            low, high = joint.travel
            notes.append(f"{joint.name} has no limits: {low:g} to {high:g} m is assumed.")
    still = [joint.name for k, joint in enumerate(model.moving_joints) if k not in point.joints]
    if still and point.joints:
        words = " and ".join([", ".join(still[:-1]), still[-1]] if len(still) > 1 else still)
        verb, held = ("does", "it is") if len(still) == 1 else ("do", "they are")
        notes.append(f"{words} {verb} not move the point: {held} held at home.")
    return tuple(notes)


def _dexterity(
    model: RobotModel, point: PointMap, centers: Array, size: float, orientations: int, stage: Stage
) -> Dexterity:
    turn, positions = None, centers
    if point.first_turns and point.joints[0] == 0:
        around = around_first_axis(point)
        section = around.section_of_points(centers)
        cells, cell = np.unique(np.floor(section / size).astype(np.int64), axis=0, return_inverse=True)
        middle = np.asarray((cells + 0.5) * size, dtype=np.float64)
        positions = around.points(middle[:, 0], middle[:, 1])
        if not _spatial(point):  # the plane of a planar arm, not the middle of a cell beside it
            middle[:, 1] = section[0, 1]
            positions = around.points(middle[:, 0], middle[:, 1])
        turn = Turn(
            joint=model.moving_joints[0].name,
            low=float(point.low[0]),
            high=float(point.high[0]),
            cell=cell.ravel(),
            azimuth=around.azimuths_of_points(centers),
        )
    poses = len(positions) * orientations
    if poses > MOST_POSES:
        raise SettingsError(
            [("dexterity", f"would solve {poses:,} poses, more than {MOST_POSES:,}; make voxels larger")]
        )
    with stage("dexterity", "poses", poses) as advance:
        return dexterity_at(model.spec, positions, orientations, travel=model.travel, turn=turn, advance=advance)


def _spatial(point: PointMap) -> bool:
    return (
        len(
            spanned(point.positions(random_configurations(point.sample_low, point.sample_high, 64, 0)), point.size)[0]
        )
        == 3
    )
