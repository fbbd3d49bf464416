"""A second robot, pale, beside the first; and the classic one: the same table read in the other convention."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.messages import listed
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.spec import Convention, RobotSpec
from dh2sim.typing import Array, read_only
from dh2sim.view.scene.items import Color, Scene
from dh2sim.view.scene.solids import robot_solids

PALE: Color = (0.45, 0.55, 0.75)
OPACITY = 0.3
SAME_PLACE = 1e-9
"""m and rad: tools no farther apart are at the same place."""

_OTHER = {Convention.STANDARD: Convention.MODIFIED, Convention.MODIFIED: Convention.STANDARD}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GhostConfiguration:
    """Where a ghost stands."""

    q: Array = field(repr=False)
    """Of the ghost, rad and m, inside its limits."""
    notes: tuple[str, ...]
    """A sentence for each way in which it does not stand as the robot does."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """How far a tool is from where the other robot has it."""

    distance: float
    """m."""
    angle: float
    """rad, from 0 to pi."""

    def told(self, what: str) -> str:
        """Return a sentence: ``what`` puts tool0 so far off."""
        return f"{what} puts tool0 {self.text}."

    @property
    def text(self) -> str:
        """How far it is off, such as ``0.1 m away and turned by 3°``."""
        parts = []
        if self.distance > SAME_PLACE:
            parts.append(f"{_digits(self.distance)} m away")
        if self.angle > SAME_PLACE:
            parts.append(f"turned by {_digits(math.degrees(self.angle))}°")
        return " and ".join(parts) or "at the same pose"


def ghost_scene(model: RobotModel, q: ArrayLike, color: Color = PALE, opacity: float = OPACITY) -> Scene:
    """Return a robot as translucent solids of one colour.

    Args:
        model: The ghost.
        q: Its joint vector, rad and m, shape (n,); see ``ghost_configuration``.
        color: Of all its links.
        opacity: From 0 to 1.

    Returns:
        ``/ghost``, in base_link, and all below it.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    return robot_solids(model, q, "/ghost", color=color, opacity=opacity)


def ghost_configuration(ghost: RobotModel, robot: RobotModel, q: ArrayLike) -> GhostConfiguration:
    """Bring a ghost to a robot's joint coordinates, as far as it has the same joints.

    Joints are matched by their names; where the robots have no name in common, by their order. A coordinate is handed
    on between joints that both turn or both slide, and moved inside the ghost's limits; all other joints of the ghost
    stand at home.

    Args:
        ghost: The second robot.
        robot: The first.
        q: The first one's joint vector, rad and m, shape (n,).
    """
    given = [float(value) for value in read_only(q)]
    pairs = _pairs(ghost, robot)
    coordinates, at_home, moved = [], [], []
    for i, joint in enumerate(ghost.moving_joints):
        partner = pairs.get(i)
        if partner is None:
            at_home.append(joint.name)
            coordinates.append(float(ghost.home[i]))
            continue
        wanted = given[partner]
        inside = joint.clamped(wanted)
        if inside != wanted:
            moved.append(joint.name)
        coordinates.append(inside)
    notes = []
    if at_home:
        notes.append(
            f"{ghost.name} has joints that {robot.name} does not have, which stay at home: {listed(at_home)}."
        )
    if moved:
        notes.append(f"{ghost.name} stops at the limits of: {listed(moved)}.")
    return GhostConfiguration(q=read_only(coordinates), notes=tuple(notes))


def other_reading(spec: RobotSpec) -> RobotSpec:
    """Return the robot that the same numbers make when they are read in the other convention: the classic mistake.

    Standard rows become modified ones and modified rows standard ones, with every number where it stands; this is no
    conversion. Hayati rows have no other reading and stay.
    """
    rows = tuple(replace(row, convention=_OTHER.get(row.convention, row.convention)) for row in spec.rows)
    convention = _OTHER.get(spec.convention, spec.convention)
    return replace(spec, rows=rows, convention=convention, name=f"{spec.name}_misread", source_file=None)


def reading_gap(spec: RobotSpec, q: ArrayLike) -> Gap:
    """Return how far the other reading of a table has tool0 from where the right one has it, at ``q``, shape (n,)."""
    here, there = (forward_kinematics(build_chain(reading), q) for reading in (spec, other_reading(spec)))
    distance, angle = pose_errors(there, here)
    return Gap(distance=float(distance), angle=float(angle))


def told_reading(spec: RobotSpec, q: ArrayLike) -> str:
    """Return a sentence on what the other reading of a table makes of tool0 at ``q``, shape (n,)."""
    used = {row.convention for row in spec.rows}
    if used == {Convention.HAYATI}:
        return "All rows are Hayati rows, which have no other reading."
    others = {_OTHER[convention] for convention in used if convention in _OTHER}
    way = "with standard and modified swapped" if len(others) == 2 else f"as {others.pop()}"
    return reading_gap(spec, q).told(f"Read {way}, this table")


def told_ghost(ghost: RobotModel, robot: RobotModel, q: ArrayLike) -> str:
    """Return where a ghost has its tool when it stands as the robot does at ``q``, shape (n,); and why not."""
    stands = ghost_configuration(ghost, robot, q)
    distance, angle = pose_errors(forward_kinematics(ghost.chain, stands.q), forward_kinematics(robot.chain, q))
    gap = Gap(distance=float(distance), angle=float(angle))
    return " ".join([gap.told(ghost.name), *stands.notes])


def _pairs(ghost: RobotModel, robot: RobotModel) -> dict[int, int]:
    """Return which joint of the robot moves along with each joint of the ghost; both are numbers of moving joints."""
    places = {joint.name: i for i, joint in enumerate(robot.moving_joints)}
    names = [joint.name for joint in ghost.moving_joints]
    by_name = {i: places[name] for i, name in enumerate(names) if name in places}
    pairs = by_name or {i: i for i in range(min(ghost.chain.n, robot.chain.n))}
    return {
        i: j
        for i, j in pairs.items()
        if ghost.moving_joints[i].joint.type.turns == robot.moving_joints[j].joint.type.turns
    }


def _digits(value: float) -> str:
    """Write a number with three digits."""
    return np.format_float_positional(float(f"{value:.3g}"), trim="-")
