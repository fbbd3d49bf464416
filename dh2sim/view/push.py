"""Pulling at a link with the mouse: where the mouse is in space, and how hard a spring from there pulls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.typing import Array, read_only

RATE = 10.0
"""rad/s: how quickly the spring swings what it pulls at, were that free; MuJoCo's own viewer does as quickly."""
STRONGEST = 100.0
"""m/s²: the spring does not pull harder than what accelerates the mass by so much."""
GRAZING = 1e-6
"""Sine of the angle between ray and plane below which they do not meet."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spring:
    """A spring with a damper, critically damped for the mass that it pulls at."""

    stiffness: float
    """N/m."""
    damping: float
    """N·s/m."""
    strongest: float
    """N: the force is never greater."""


def spring_for(mass: float) -> Spring:
    """Return a spring that pulls alike at light and heavy robots.

    Args:
        mass: how heavy the grabbed point feels, kg.
    """
    return Spring(stiffness=mass * RATE**2, damping=2.0 * mass * RATE, strongest=mass * STRONGEST)


def dragged_point(origin: ArrayLike, direction: ArrayLike, grabbed: ArrayLike, normal: ArrayLike) -> Array | None:
    """Return where the mouse has dragged a point to: in the plane through it that faces the camera.

    Args:
        origin: of the mouse's ray, m, shape (3,).
        direction: of the ray, of any length, shape (3,).
        grabbed: the point where it was grabbed, m, shape (3,).
        normal: the direction in which the camera looks, of any length, shape (3,).

    Returns:
        The point, m, read-only, shape (3,); None where the ray does not meet the plane, or only behind its origin.
    """
    start, ray, facing = np.asarray(origin, dtype=float), _unit(direction), _unit(normal)
    slope = float(ray @ facing)
    if abs(slope) < GRAZING:
        return None
    distance = float((np.asarray(grabbed, dtype=float) - start) @ facing) / slope
    return read_only(start + distance * ray) if distance >= 0.0 else None


def spring_force(spring: Spring, point: ArrayLike, velocity: ArrayLike, target: ArrayLike) -> Array:
    """Return the force of a spring between a point of a link and where the mouse is.

    Args:
        spring: the spring.
        point: where the grabbed point is now, m, shape (3,).
        velocity: its velocity, m/s, shape (3,).
        target: where it was dragged to, m, shape (3,).

    Returns:
        The force on the link at that point, N, read-only, shape (3,).
    """
    stretch = 0.5 * np.asarray(target, dtype=float) - 0.5 * np.asarray(point, dtype=float)  # halves never overflow
    pull = spring.stiffness * 2.0 * _shortened(stretch, 0.5 * spring.strongest / spring.stiffness)
    return read_only(_shortened(pull - spring.damping * np.asarray(velocity, dtype=float), spring.strongest))


def _shortened(vector: Array, longest: float) -> Array:
    """Return a vector with its direction kept and its length at most ``longest``."""
    greatest = float(np.abs(vector).max())
    if greatest == 0.0:
        return vector
    direction = vector / greatest
    length = math.hypot(*direction)
    return vector if greatest <= longest / length else direction * (longest / length)


def _unit(vector: ArrayLike) -> Array:
    """Return a vector of length 1 along ``vector``, or zero for zero."""
    array = np.asarray(vector, dtype=float)
    length = math.hypot(*array)
    return array / length if length > 0.0 else array
