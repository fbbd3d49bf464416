"""A second robot, drawn pale beside the first: another one, or the same table misread in the other convention."""

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
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from dh2sim.view.scene.items import Color, Scene
from dh2sim.view.scene.solids import robot_solids

PALE: Color = (0.45, 0.55, 0.75)
OPACITY = 0.3
SAME_POSE = 1e-9
"""Largest distance, m, and angle, rad, between poses that count as the same."""

_OTHER = {Convention.STANDARD: Convention.MODIFIED, Convention.MODIFIED: Convention.STANDARD}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GhostConfiguration:
    """Joint coordinates of a ghost."""

    q: Array = field(repr=False)
    """rad and m, inside its limits."""
    notes: tuple[str, ...]
    """A sentence for each way in which they differ from the robot's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolOffset:
    """How far a tool is from another pose."""

    distance: float
    """m."""
    angle: float
    """rad, from 0 to pi."""

    @property
    def text(self) -> str:
        """The offset in words, such as ``0.1 m away and turned by 3°``."""
        parts = []
        if self.distance > SAME_POSE:
            parts.append(f"{_digits(self.distance)} m away")
        if self.angle > SAME_POSE:
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
        ``/ghost``, in base_link, and everything below it.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    return robot_solids(model, q, "/ghost", color=color, opacity=opacity)


def ghost_configuration(ghost: RobotModel, robot: RobotModel, q: ArrayLike) -> GhostConfiguration:
    """Give a ghost the joint coordinates of a robot, as far as it has the same joints.

    Joints are matched by name; if the robots have no name in common, by order. A coordinate is passed on between
    joints that both turn or both slide, and is moved inside the ghost's limits. All other joints of the ghost are at
    home.

    Args:
        ghost: The second robot.
        robot: The first.
        q: The first one's joint vector, rad and m, shape (n,).
    """
    given = [float(value) for value in read_only(q)]
    pairs = _pairs(ghost, robot)
    coordinates, at_home, clipped = [], [], []
    for i, joint in enumerate(ghost.moving_joints):
        partner = pairs.get(i)
        if partner is None:
            at_home.append(joint.name)
            coordinates.append(float(ghost.home[i]))
            continue
        asked = given[partner]
        inside = joint.clamped(asked)
        if inside != asked:
            clipped.append(joint.name)
        coordinates.append(inside)
    notes = []
    if at_home:
        notes.append(f"Joints of {ghost.name} that {robot.name} does not have, shown at home: {listed(at_home)}.")
    if clipped:
        notes.append(f"Joints of {ghost.name} at their limits: {listed(clipped)}.")
    return GhostConfiguration(q=read_only(coordinates), notes=tuple(notes))


def misread(spec: RobotSpec) -> RobotSpec:
    """Return the robot that the same numbers describe in the other convention: the classic mistake.

    Standard rows become modified ones and the other way round, every number unchanged; this is not a
    conversion. Hayati rows have no other reading and stay.
    """
    rows = tuple(replace(row, convention=_OTHER.get(row.convention, row.convention)) for row in spec.rows)
    convention = _OTHER.get(spec.convention, spec.convention)
    return replace(spec, rows=rows, convention=convention, name=f"{spec.name}_misread", source_file=None)


def misread_offset(spec: RobotSpec, q: ArrayLike) -> ToolOffset:
    """Return how far misreading a table moves tool0 at ``q``, shape (n,)."""
    right, wrong = (forward_kinematics(build_chain(reading), q) for reading in (spec, misread(spec)))
    return _offset(wrong, right)


def misread_text(spec: RobotSpec, q: ArrayLike) -> str:
    """Return a sentence on where the misread table has tool0 at ``q``, shape (n,)."""
    used = {row.convention for row in spec.rows}
    if used == {Convention.HAYATI}:
        return "All rows are Hayati rows, which have no other reading."
    others = {_OTHER[convention] for convention in used if convention in _OTHER}
    how = "with standard and modified swapped" if len(others) == 2 else f"as {others.pop()}"
    return f"Read {how}, this table has tool0 {misread_offset(spec, q).text}."


def ghost_text(ghost: RobotModel, robot: RobotModel, q: ArrayLike) -> str:
    """Return where a ghost has tool0 while the robot is at ``q``, shape (n,), and which joints differ."""
    configuration = ghost_configuration(ghost, robot, q)
    offset = _offset(forward_kinematics(ghost.chain, configuration.q), forward_kinematics(robot.chain, q))
    return " ".join([f"{ghost.name} has tool0 {offset.text}.", *configuration.notes])


def _offset(T_a: Array, T_b: Array) -> ToolOffset:
    distance, angle = pose_errors(T_a, T_b)
    return ToolOffset(distance=float(distance), angle=float(angle))


def _pairs(ghost: RobotModel, robot: RobotModel) -> dict[int, int]:
    """Return which joint of the robot each joint of the ghost follows; both are indices of moving joints."""
    places = {joint.name: i for i, joint in enumerate(robot.moving_joints)}
    names = [joint.name for joint in ghost.moving_joints]
    by_name = {i: places[name] for i, name in enumerate(names) if name in places}
    pairs = by_name or {i: i for i in range(min(ghost.chain.n, robot.chain.n))}
    return {i: j for i, j in pairs.items() if ghost.moving_joints[i].type.turns == robot.moving_joints[j].type.turns}


def _digits(value: float) -> str:
    """Return a number with three digits."""
    return np.format_float_positional(float(f"{value:.3g}"), trim="-")
