"""Paths of the tool: straight lines and arcs of its origin, with its orientation turning at a constant rate."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from dh2sim.errors import TrajectoryError
from dh2sim.kinematics.rotations import rotation_vectors, rotations_of_vectors
from dh2sim.typing import Array, read_only

_ON_LINE: Final = 1e-9
"""Sine of the angle between chords below which three points lie on a line."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToolPath:
    """A path of tool0 in base_link over the parameter 0 to 1, at a constant rate of position and orientation.

    The orientation is Rodrigues's rotation about one fixed axis, which is spherical linear interpolation (slerp).
    Source: K. Shoemake, Animating rotation with quaternion curves, SIGGRAPH 1985.
    """

    kind: str
    """'line' or 'arc'."""
    start: Array
    """Pose, shape (4, 4)."""
    distance: float
    """Length of the path of tool0's origin, m."""
    angle: float
    """By which it turns, rad."""
    turn: Array
    """Axis times angle of the whole turn, in base_link, rad, shape (3,)."""
    chord: Array
    """Of a line: from the start to the end, m, shape (3,)."""
    centre: Array | None = None
    """Of an arc, m, shape (3,)."""
    sweep: Array = field(default_factory=lambda: read_only(np.zeros(3)))
    """Of an arc: axis times angle about its centre, rad, shape (3,)."""

    def poses(self, x: Array) -> Array:
        """Return poses at parameters, shape (N, 4, 4)."""
        T = np.zeros((len(x), 4, 4))
        T[:, 3, 3] = 1.0
        T[:, :3, :3] = rotations_of_vectors(x[:, None] * self.turn) @ self.start[:3, :3]
        if self.centre is None:
            T[:, :3, 3] = self.start[:3, 3] + x[:, None] * self.chord
        else:
            spoke = self.start[:3, 3] - self.centre
            T[:, :3, 3] = self.centre + rotations_of_vectors(x[:, None] * self.sweep) @ spoke
        return T

    def velocities(self, T: Array) -> Array:
        """Return the origin's velocity and the angular velocity per unit of the parameter at poses, shape (N, 6)."""
        found = np.zeros((len(T), 6))
        found[:, 3:] = self.turn
        found[:, :3] = self.chord if self.centre is None else np.cross(self.sweep, T[:, :3, 3] - self.centre)
        return found

    def place(self, x: float) -> str:
        """Return where a parameter is: ``0.12 m of 0.5 m along the line``."""
        if self.distance > 1e-12:
            return f"{x * self.distance:.4g} m of {self.distance:.4g} m along the {self.kind}"
        whole = math.degrees(self.angle)
        return f"{x * whole:.4g} of {whole:.4g} degrees through the turn"


def line(start: Array, end: Array) -> ToolPath:
    """Return the straight line between two poses, shape (4, 4)."""
    turn = rotation_vectors(end[:3, :3] @ start[:3, :3].T)
    chord = end[:3, 3] - start[:3, 3]
    return ToolPath(
        kind="line",
        start=read_only(start),
        distance=float(np.linalg.norm(chord)),
        angle=float(np.linalg.norm(turn)),
        turn=read_only(turn),
        chord=read_only(chord),
    )


def arc(start: Array, via: Array, end: Array) -> ToolPath:
    """Return the arc of a circle from a pose through a point to a pose.

    Args:
        start: Pose, shape (4, 4).
        via: Point of the arc, m, shape (3,).
        end: Pose, shape (4, 4).

    Raises:
        TrajectoryError: The three points lie on a line, or two of them are the same.
    """
    a, b = via - start[:3, 3], end[:3, 3] - start[:3, 3]
    sides = [float(np.linalg.norm(side)) for side in (a, b, b - a)]
    if min(sides) <= _ON_LINE * max(sides):
        raise TrajectoryError(
            "start, via and end of an arc must be different points; a whole circle has centre and angle instead"
        )
    normal = np.cross(a, b)
    size = float(np.linalg.norm(normal))
    if size <= _ON_LINE * float(np.linalg.norm(a)) * float(np.linalg.norm(b)) or size == 0.0:
        raise TrajectoryError("start, via and end of the arc lie on a line: no circle goes through them")
    # the point at equal distance from all three
    centre = start[:3, 3] + (np.cross(normal, a) * (b @ b) + np.cross(b, normal) * (a @ a)) / (2.0 * size * size)
    axis = normal / size
    spoke, last = start[:3, 3] - centre, end[:3, 3] - centre
    swept = math.atan2(float(np.cross(spoke, last) @ axis), float(spoke @ last)) % math.tau
    return _arc(start, centre, axis * swept, rotation_vectors(end[:3, :3] @ start[:3, :3].T))


def circle(start: Array, centre: Array, axis: Array, angle: float) -> ToolPath:
    """Return the arc about a centre by an angle, rad, positive about the axis; the orientation stays.

    Raises:
        TrajectoryError: The start lies on the axis, or not in the plane of the circle.
    """
    unit = axis / np.linalg.norm(axis)
    spoke = start[:3, 3] - centre
    radius = float(np.linalg.norm(spoke))
    if radius <= 1e-12 or abs(float(unit @ spoke)) > 1e-6 * radius:
        raise TrajectoryError(
            "the circle does not go through its start: the line from centre to start must be perpendicular to axis"
        )
    return _arc(start, centre, unit * angle, np.zeros(3))


def _arc(start: Array, centre: Array, sweep: Array, turn: Array) -> ToolPath:
    radius = float(np.linalg.norm(start[:3, 3] - centre))
    return ToolPath(
        kind="arc",
        start=read_only(start),
        distance=radius * float(np.linalg.norm(sweep)),
        angle=float(np.linalg.norm(turn)),
        turn=read_only(turn),
        chord=read_only(np.zeros(3)),
        centre=read_only(centre),
        sweep=read_only(sweep),
    )
