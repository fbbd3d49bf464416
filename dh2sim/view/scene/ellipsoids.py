"""Ellipsoids of velocity and force around the origin of tool0."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from dh2sim.kinematics.forward import geometric_jacobian
from dh2sim.kinematics.singularity import VelocityEllipsoid, velocity_ellipsoid
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.scene.items import Color, Item, Lines, Solid, vector
from dh2sim.view.scene.link_poses import poses_at, robot_size, round_length
from dh2sim.view.scene.solids import ball_triangles, orientation_of, position_of
from dh2sim.view.state import Part, ViewState

ELLIPSOID: Final = "/ellipsoid"
FORCE: Final = "/force"
VELOCITY_SCALE: Final = 0.15
"""m of an ellipsoid for each m/s of a velocity."""
_VELOCITY_COLOR: Final[Color] = (0.05, 0.50, 0.62)
_FORCE_COLOR: Final[Color] = (0.80, 0.38, 0.05)
_FLAT: Final = 0.01
"""Thickness of an ellipsoid that is flat, as a share of its length."""
_LONGEST: Final = 0.6
"""Half length at which the ellipsoid of force is cut off, as a share of the robot's size."""


def ellipsoids(state: ViewState) -> Iterator[tuple[str, Item]]:
    """Yield the ellipsoids that are shown, each with its principal axes."""
    if not {Part.ELLIPSOID, Part.FORCE} & state.shown:
        return
    ellipsoid = velocity_ellipsoid(geometric_jacobian(state.model.chain, state.q))
    if not ellipsoid.semi_axes[0] > 0.0:
        return
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = ellipsoid.axes, poses_at(state.model, state.q).tool0[:3, 3]
    if Part.ELLIPSOID in state.shown:
        yield from _drawn(ELLIPSOID, T, VELOCITY_SCALE * ellipsoid.semi_axes, _VELOCITY_COLOR)
    if Part.FORCE in state.shown:
        longest = _LONGEST * robot_size(state.model)
        halves = np.minimum(force_scale(state.model) * force_half_axes(ellipsoid), longest)
        yield from _drawn(FORCE, T, halves, _FORCE_COLOR)


def force_half_axes(ellipsoid: VelocityEllipsoid) -> Array:
    """Return the half axes of the ellipsoid of force, N, shape (3,), along the axes of that of velocity.

    It has the forces f at the tool that joint torques and forces of norm 1 hold: |J_vᵀ f| = 1. Its half axes are one
    over those of velocity: infinite where the tool cannot move, for there no joint has to hold it. Source: B.
    Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics: Modelling, Planning and Control, 2009, section 3.9.
    """
    v = ellipsoid.semi_axes
    still = v <= 1e-9 * v[0]
    return np.where(still, np.inf, 1.0 / np.where(still, 1.0, v))


def force_scale(model: RobotModel) -> float:
    """Return how much of the ellipsoid of force is drawn for 1 N, m: it shrinks as arms grow, which forces do."""
    return round_length(0.04 * robot_size(model) ** 2)


def _drawn(root: str, T: Array, halves: Array, color: Color) -> Iterator[tuple[str, Item]]:
    position, orientation = position_of(T), orientation_of(T)
    vertices, faces = ball_triangles()
    scale = vector(np.maximum(halves, _FLAT * halves.max()))
    yield (
        f"{root}/surface",
        Solid(
            position=position,
            orientation=orientation,
            vertices=vertices,
            faces=faces,
            color=color,
            opacity=0.35,
            scale=scale,
        ),
    )
    segments = tuple((vector(-half), vector(half)) for half in np.diag(halves))
    axes = Lines(position=position, orientation=orientation, segments=segments, color=color, width=2.0)
    yield f"{root}/axes", axes
