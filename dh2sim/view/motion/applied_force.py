"""What pulls at a robot in a simulation: a constant force, or a spring from where the mouse is.

Pulling at a link with the mouse: where the mouse is in space, and how hard a spring from there pulls.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.messages import did_you_mean, listed, shown
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Place:
    """A point of a link."""

    body: int
    """The link's number in MuJoCo."""
    point: Array
    """In the link's frame, m, shape (3,)."""

    def position(self, data: mujoco.MjData) -> Array:
        """Return where the point is, m, shape (3,)."""
        return np.asarray(data.xpos[self.body] + data.xmat[self.body].reshape(3, 3) @ self.point)

    def jacobian(self, model: mujoco.MjModel, data: mujoco.MjData) -> Array:
        """Return the derivative of its position by the joint positions, shape (3, nv)."""
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, self.position(data), self.body)
        return jacobian

    def mass(self, model: mujoco.MjModel, data: mujoco.MjData) -> float:
        """Return how heavy the point feels to one who pulls at it, on the average of all directions, kg.

        The inverse of J M⁻¹ Jᵀ, the mobility of the point: O. Khatib, A unified approach for motion and force control
        of robot manipulators, IEEE J. Robotics and Automation 3(1), 1987. At most the mass of all that moves.
        """
        whole = float(model.body_subtreemass[0])
        jacobian = self.jacobian(model, data)
        solved = np.zeros_like(jacobian)
        mujoco.mj_solveM(model, data, solved, jacobian)
        mobility = float(np.sum(jacobian * solved)) / 3.0
        return 1.0 / mobility if mobility * whole > 1.0 else whole


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Push:
    """A force that stays what it is."""

    place: Place
    force: Array
    """N, shape (3,)."""

    def force_at(self, point: Array, velocity: Array) -> Array:  # noqa: ARG002
        """Return the force, N, shape (3,)."""
        return self.force


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drag:
    """A spring."""

    place: Place
    target: Array
    """Where it pulls to, m, shape (3,)."""
    spring: Spring

    def force_at(self, point: Array, velocity: Array) -> Array:
        """Return the force, N, shape (3,), on a point at ``point`` with ``velocity``, m and m/s."""
        return spring_force(self.spring, point, velocity, self.target)


Grip: TypeAlias = Push | Drag


def joint_forces(grip: Grip, model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return what a grip does to the joints, N·m or N, shape (nv,): the principle of virtual work."""
    jacobian = grip.place.jacobian(model, data)
    with np.errstate(over="ignore", invalid="ignore"):  # what becomes of it is looked at after the time step
        force = grip.force_at(grip.place.position(data), jacobian @ data.qvel)
        return np.asarray(force @ jacobian)


def find_place(bodies: Mapping[str, int], link: str, point_in_link: ArrayLike) -> Place:
    """Return a point of a link.

    Args:
        bodies: numbers of the links in MuJoCo, by name.
        link: the link's name.
        point_in_link: m, shape (3,).

    Raises:
        ConfigurationError: there is no such link, or it is no point.
    """
    if link not in bodies:
        raise ConfigurationError(
            f"there is no link {shown(link)}.{did_you_mean(link, bodies)} Links: {listed(bodies)}"
        )
    return Place(body=bodies[link], point=vector(point_in_link, "the point"))


def vector(values: ArrayLike, what: str) -> Array:
    """Return three finite numbers.

    Raises:
        ConfigurationError: they are not.
    """
    array = read_only(values)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ConfigurationError(f"{what} must be three finite numbers, got {np.asarray(values).tolist()}")
    return array
